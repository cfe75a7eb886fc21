"""Where the open part of a face and of an edge lies, from the distances at their corners."""

from __future__ import annotations

from numba import njit


@njit(nogil=True, cache=True)
def open_edge(a: float, b: float) -> float:
    """Part of an edge with these distances at its ends where distance >= 0."""
    if a >= 0.0:
        return 1.0 if b >= 0.0 else a / (a - b)
    return 0.0 if b < 0.0 else b / (b - a)


@njit(nogil=True, cache=True)
def open_polygon(a: float, b: float, c: float, d: float) -> tuple[float, float, float]:
    """Area of the part of a unit square with corner distances a, b, c, d (in turn) where distance
    >= 0, and its centre from that of the square along a-b and a-d."""
    if a >= 0.0 and b >= 0.0 and c >= 0.0 and d >= 0.0:
        return 1.0, 0.0, 0.0
    corner_x, corner_y = (-0.5, 0.5, 0.5, -0.5), (-0.5, -0.5, 0.5, 0.5)
    value = (a, b, c, d)
    twice, sum_x, sum_y, started = 0.0, 0.0, 0.0, False
    first_x, first_y, last_x, last_y = 0.0, 0.0, 0.0, 0.0
    for n in range(4):
        m = (n + 1) % 4
        for part in range(2):
            if part == 0:
                if value[n] < 0.0:
                    continue
                x, y = corner_x[n], corner_y[n]
            else:
                if (value[n] < 0.0) == (value[m] < 0.0):
                    continue
                t = value[n] / (value[n] - value[m])
                x = corner_x[n] + t * (corner_x[m] - corner_x[n])
                y = corner_y[n] + t * (corner_y[m] - corner_y[n])
            if started:  # a triangle with the first corner
                cross = (last_x - first_x) * (y - first_y) - (x - first_x) * (last_y - first_y)
                twice += cross
                sum_x += cross * (first_x + last_x + x)
                sum_y += cross * (first_y + last_y + y)
            else:
                first_x, first_y, started = x, y, True
            last_x, last_y = x, y
    if twice <= 0.0:
        return 0.0, 0.0, 0.0
    return 0.5 * twice, sum_x / (3.0 * twice), sum_y / (3.0 * twice)

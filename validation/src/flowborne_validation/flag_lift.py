"""D6: lift on Turek and Hron's rigid flag, with its end in six places of a cell."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from flowborne import World
from flowborne_validation.case import reference
from flowborne_validation.findings import Curve, Figure, Figures, Plot
from flowborne_validation.flag_in_channel import CFD, END, LAST, SHORTER, channel, march
from flowborne_validation.worlds import Parabola, mjcf, refined

FLOW = CFD[0]
"""Re 20: the lift is that of an axis 5 mm below the middle of the channel."""

PLACES = (0.01, 0.1, 0.3, 0.5, 0.7, 0.9)
"""Cells between the flag's end and the plane of nodes before it."""

FLAGS = {
    "square": '<geom type="box" pos="0.4 {y} 0" size="0.2 0.01 0.5"/>',
    "round": '<geom type="capsule" fromto="0.2 {y} 0 0.59 {y} 0" size="0.01"/>',
}
"""Kind of the flag's end -> its MJCF; both end at A."""

MIDDLE = 0.205
"""y of the middle of the channel, where there is no lift, m."""


def bodies(end: str, y: float) -> str:
    """MJCF of cylinder and flag with their axis at y."""
    return mjcf(f'<geom type="cylinder" pos="0.2 {y} 0" size="0.05 0.5"/>', FLAGS[end].format(y=y))


def lifts(end: str, y: float, grids: Sequence[int]) -> dict[int, list[float]]:
    """Cells across the channel -> lift in each of PLACES, N/m: the mean of its LAST part."""

    def build(at: tuple[int, float]) -> World:
        return channel(at[0], FLOW, at[1], bodies(end, y))

    found: dict[int, list[float]] = {cells: [] for cells in grids}
    for (cells, _), world, first in refined(product(grids, PLACES), build, Parabola(FLOW.peak)):
        rows = march(world, FLOW, FLOW.longest * (1.0 if first else SHORTER))
        found[cells].append(float(rows[-round(LAST * len(rows)) :, 1].mean()))
    return found


def lift_over_places(
    grids: Sequence[int], end: str, y: float, accepted: Sequence[float]
) -> Figures:
    """D6: the lift of six that is farthest from a straight line, from the published one with the
    axis at END to 0 in the middle of the channel. On 41 cells the flag's sides lie on planes of
    nodes with the axis at 0.2 m, and 0.1 and 0.3 of a cell above them with the axis at 0.201 m and
    0.203 m.

    end, y    kind of the flag's end; y of the axis of cylinder and flag, m
    accepted  error of the lift in every place over the published lift, on each grid
    """
    found: dict[str, Figure] = {}
    full = float(reference("D6", "lift of CFD1, N/m"))
    exact = full * (MIDDLE - y) / (MIDDLE - END[1])
    rows = lifts(end, y, grids)
    curves = [Curve("right", PLACES, [exact] * len(PLACES), True)]
    curves += [Curve(f"{cells} cells across", PLACES, row) for cells, row in rows.items()]
    plot = Plot("cells between end and plane", f"lift with the axis at {y:g} m (N/m)", curves)
    for (cells, row), part in zip(rows.items(), accepted, strict=True):
        listed = ", ".join(f"{at:g}: {lift:.3f}" for at, lift in zip(PLACES, row, strict=True))
        found[f"worst lift in six places on {cells} cells, {end} end, axis at {y:g} m"] = Figure(
            max(row, key=lambda lift: abs(lift - exact)),
            reference=exact,
            lines=[f"cells between end and plane, and lift in N/m: {listed}"],
            plot=plot if cells == max(rows) else None,
            judged={"absolute": part * full, "tolerance": f"{100.0 * part:g} % of {full:g}"},
        )
    return found

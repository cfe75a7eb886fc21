"""Makes the model and the mesh of the scene `fish`: `python tools/fish.py`.

The fish has an elliptical section at each station along its length, x forward and z up, with its
nose at x = 0. Bones are the cores of the sections; the flesh between them, around them, and of the
nose and the edge of the tail is one mesh of tetrahedra with the mirror planes y = 0 and z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flowborne.solids.tissue.mesh import FleshMesh
from flowborne.solids.tissue.mesh_file import mesh_bytes

Array = NDArray[np.float64]
Triangle = tuple[int, int, int]

LIBRARY = Path(__file__).parents[1] / "src" / "flowborne" / "scenes" / "library"

LENGTH = 0.4
"""m"""

JOINTS = 10

HEAD = 0.22
"""Share of the length before the first joint."""

WAVE = 0.95
"""Wavelength of a swimming fish over its length (Borazjani and Sotiropoulos 2008)."""

CORE = 0.55
"""Half axes of a bone over those of the section."""

AROUND = 8
"""Points around a section, a multiple of 4 so that no edge crosses a mirror plane."""

THINNEST = 0.025
"""Half width of the tail over the length: two cells in all on a grid of 50 cells a length."""

NOSE, HEAD_STATIONS, TAIL = 0.0, (0.02, 0.07, 0.13), 1.008
"""Shares of the length: both tips, and sections of the head. The first has no bone before it."""


@dataclass(frozen=True)
class Section:
    """The triangles of a section: point 0 in the middle, then a ring of the bone, then the skin's.

    points  (n, 2) y over the half width, z over the half height
    core    triangles inside the bone's ring
    shell   triangles between both rings
    order   (n,) equal for mirror images; differs for the ends of every edge
    """

    points: Array
    core: list[Triangle]
    shell: list[Triangle]
    order: list[float]


def half_width(s: float) -> float:
    """m, at a share `s` of the length: the profile NACA 0016, and no thinner than the tail."""
    terms = (0.2969 * np.sqrt(s), -0.126 * s, -0.3516 * s**2, 0.2843 * s**3, -0.1036 * s**4)
    return LENGTH * max(0.8 * float(sum(terms)), THINNEST * min(1.0, float(np.sqrt(s / 0.02))))


def half_height(s: float) -> float:
    """m: an ellipse to the highest section, a cubic to the peduncle, a straight tail fin."""
    highest, peduncle = 0.36, 0.86
    if s > peduncle:
        return LENGTH * float(np.interp(s, [peduncle, 0.97, TAIL], [0.0322, 0.11, 0.1162]))
    front, back = min(s / highest, 1.0), max(s - highest, 0.0) / (peduncle - highest)
    return LENGTH * 0.115 * (np.sqrt(front * (2.0 - front)) - 0.72 * back**2 * (3.0 - 2.0 * back))


def sway(s: float) -> float:
    """Amplitude of a swimming fish over its length at a share `s` of it (Videler and Hess 1984, as
    Borazjani and Sotiropoulos 2008 have it)."""
    return 0.02 - 0.0825 * s + 0.1625 * s**2


def limit(number: int) -> float:
    """Degrees that a joint may bend to each side: by which the wave of a fish that swims turns from
    one bone to the next."""
    bend = (2.0 * np.pi / WAVE) ** 2 * sway(joint_at(number))
    return float(np.degrees(bend * (1.0 - HEAD) / JOINTS))


def section() -> Section:
    """Diagonals between the rings start at the bone's point that is nearer to the plane y = 0."""
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    height = np.round(np.abs(circle[:, 1]), 9)
    core: list[Triangle] = []
    shell: list[Triangle] = []
    for k in range(AROUND):
        inner, after = 1 + k, 1 + (k + 1) % AROUND
        outer, beyond = inner + AROUND, after + AROUND
        core.append((0, inner, after))
        if height[k] < height[after - 1]:
            shell += [(inner, outer, beyond), (inner, beyond, after)]
        else:
            shell += [(inner, outer, after), (after, outer, beyond)]
    points = np.concatenate([np.zeros((1, 2)), CORE * circle, circle])
    order = [-1.0, *height, *(2.0 + height)]
    return Section(points, core, shell, order)


def joint_at(number: int) -> float:
    """Share of the length at which a joint is, counted from 0."""
    return HEAD + number * (1.0 - HEAD) / JOINTS


def stations() -> tuple[list[float], list[str]]:
    """Shares of the length of the sections, and the bone between each and the next, "" for none.

    A bone takes the middle half of the way from its joint to the next one.
    """
    quarter = 0.25 * (1.0 - HEAD) / JOINTS
    at = [*HEAD_STATIONS, HEAD - quarter]
    bones = ["", *["head"] * (len(at) - 2)]
    for number in range(JOINTS):
        at += [joint_at(number) + quarter, joint_at(number) + 3.0 * quarter]
        bones += ["", f"bone_{number + 1}"]
    return [*at, 1.0], [*bones, ""]


def prism(triangle: Triangle, order: list[float], low: int, high: int) -> list[list[int]]:
    """Three tetrahedra between the images of a triangle at two stations, whose points start at
    `low` and `high`. Diagonals of its sides rise from the point that is earlier in the order, so
    that neighbours have the same."""
    a, b, c = sorted(triangle, key=lambda point: order[point])
    return [
        [low + a, low + b, low + c, high + c],
        [low + a, low + b, high + b, high + c],
        [low + a, high + a, high + b, high + c],
    ]


def mesh() -> tuple[FleshMesh, dict[str, Array]]:
    """The flesh, and the points (k, 3) of each bone's hull, m in the world at rest."""
    flat, (at, bones) = section(), stations()
    count = len(flat.points)
    places = [
        np.column_stack(
            [
                np.full(count, -LENGTH * s),
                half_width(s) * flat.points[:, 0],
                half_height(s) * flat.points[:, 1],
            ]
        )
        for s in at
    ]
    points = np.concatenate([*places, [[-LENGTH * s, 0.0, 0.0] for s in (NOSE, TAIL)]])
    nose, tail = len(points) - 2, len(points) - 1
    holders, elements = [""] * len(points), []
    hulls: dict[str, Array] = {}
    for station, bone in enumerate(bones):
        low, high = station * count, (station + 1) * count
        for triangle in flat.shell if bone else flat.core + flat.shell:
            elements += prism(triangle, flat.order, low, high)
        if bone:
            rings = [first + k for first in (low, high) for k in range(1 + AROUND)]
            for point in rings:
                holders[point] = bone
            hulls[bone] = np.concatenate([hulls.get(bone, np.zeros((0, 3))), points[rings]])
    last = count * (len(at) - 1)
    for triangle in flat.core + flat.shell:
        elements += [[nose, *triangle], [tail, *(last + point for point in triangle)]]
    used, numbers = np.unique(right_handed(points, np.array(elements)), return_inverse=True)
    held = tuple(holders[point] for point in used)
    return FleshMesh(points[used], numbers.reshape(-1, 4), held), hulls


def right_handed(points: Array, elements: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m, 4) the tetrahedra, with two corners exchanged where their volume was negative."""
    edges = points[elements[:, 1:]] - points[elements[:, :1]]
    turned = np.linalg.det(edges) < 0.0
    elements[turned] = elements[turned][:, [0, 2, 1, 3]]
    return elements


def model(hulls: dict[str, Array]) -> str:
    """The MJCF: a chain of bones that starts with the head and floats in the plane z = 0."""
    origin = {name: joint_at(max(number - 1, 0)) for number, name in enumerate(hulls)}
    lines = [
        '<mujoco model="fish">',
        "  <!-- A fish of 0.4 m, its nose at x = 0 and forward: a head and ten bones in flesh,",
        "       made by tools/fish.py. It swims level: it does not roll, pitch or rise. -->",
        '  <compiler angle="degree"/>',
        "  <default>",
        '    <geom type="mesh" contype="0" conaffinity="0" density="1000" rgba="0.9 0.88 0.8 1"/>',
        '    <joint type="hinge" axis="0 0 1"/>',
        "  </default>",
        "  <asset>",
    ]
    for name, hull in hulls.items():
        own = np.unique(np.round(hull + np.array([LENGTH * origin[name], 0.0, 0.0]), 6), axis=0)
        numbers = "  ".join(" ".join(f"{x:.5f}" for x in point) for point in own)
        lines.append(f'    <mesh name="{name}" vertex="{numbers}"/>')
    lines += ["  </asset>", "  <worldbody>"]
    indent = "    "
    for number, (before, name) in enumerate(pairwise(["", *hulls])):
        back = origin[name] - (origin[before] if before else 0.0)
        lines.append(f'{indent}<body name="{name}" pos="{0.0 - LENGTH * back:.5g} 0 0">')
        if number == 0:
            lines += [
                f'{indent}  <joint name="head_x" type="slide" axis="1 0 0"/>',
                f'{indent}  <joint name="head_y" type="slide" axis="0 1 0"/>',
                f'{indent}  <joint name="heading"/>',
            ]
        else:
            most = f"{limit(number - 1):.3g}"
            lines.append(f'{indent}  <joint name="joint_{number}" range="-{most} {most}"/>')
        lines.append(f'{indent}  <geom name="{name}" mesh="{name}"/>')
        indent += "  "
    while len(indent) > 4:
        indent = indent[2:]
        lines.append(f"{indent}</body>")
    return "\n".join([*lines, "  </worldbody>", "</mujoco>"]) + "\n"


def main() -> None:
    flesh, hulls = mesh()
    (LIBRARY / "fish.npz").write_bytes(mesh_bytes(flesh, ""))
    (LIBRARY / "fish.xml").write_text(model(hulls))


if __name__ == "__main__":
    main()

"""Flesh: what of the tetrahedra is elastic, and which points a bone holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flowborne.phrases import rounded_up
from flowborne.shapes.shape import Mesh
from flowborne.solids.elements import outer_surface, with_middles
from flowborne.solids.tissue.bones import (
    MOST_SAMPLES,
    Bones,
    bones_of,
    contour,
    finest,
    signed_distance,
)
from flowborne.solids.tissue.mesher import tetrahedra_within
from flowborne.solids.tissue.surface_file import check_covers, place, read_surface
from flowborne.solids.tissue.symmetry import Chamber, chamber_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FIDELITY = 0.1
"""How far a face may be off the surface that it follows, in edges."""

THICKNESSES = 0.6
"""As FIDELITY, in thicknesses of the skin or of the thinnest bone's half."""

HELD = 0.5
"""How far outside a bone it still holds points, as a part of the distance that faces may be off."""

JOINT = 1.25
"""How close to a second bone points are let go, in half sizes of the thinnest bone."""

JOINT_EDGES = 0.75
"""The same in edges as long as most are, where those are too long for it."""

ASTRAY = 1.5
"""How far the outside of a mesh may be off its surface, in tolerances, and not be meshed again."""

TIGHTER = 0.8
"""Tolerance of the next try over that of the last one."""

TRIES = 8
"""How often flesh is meshed at most."""

FILLING = 6.0 * np.sqrt(2.0)
"""Regular tetrahedra that a cube of their edges has room for."""

MOST_ELEMENTS = 100_000
"""Most elements that the mesher's box may have room for: two balls of 0.6 m, 160 m apart, with
edges of 0.25 m take 13 s and 0.5 GB, and the built-in creatures with flesh ask for 7,000."""


SEEN = 0.6
"""Distance of samples at which the thinnest bone is not missed, in its half sizes."""

PER_SQUARE = 24.0
"""Elements around a plate, per square of its thickness: 24,000 for one of 0.5 m x 0.2 m x 1 cm."""


@dataclass(frozen=True)
class FleshMesh:
    """Elastic elements around bones, in world axes at rest.

    points    (n, 3) m
    elements  (m, 4) points of tetrahedra, right-handed, none of them inside a bone; (m, 3) of
              triangles in the plane z = 0 of a slab
    holders   n names: the bone that holds the point, "" for none
    """

    points: Array
    elements: Indices
    holders: tuple[str, ...]


def skin_mesh(
    spec: mujoco.MjSpec, bones: Sequence[str], thickness: float, size: float
) -> FleshMesh:
    """Flesh as far as `thickness` m outside the union of some bodies.

    It has the mirror planes that exchange some of them.

    bones   names of the bodies
    size    length of edges, m; shorter where the surface bends too much for it
    raises  ValueError for an unknown body, for one without a geom, for a bone that is too thin, for
            a skin that is too thin for its bones or too large for its edges, when the mesher fails
            and for a bone that holds no point
    """
    chosen = bones_of(spec, bones)
    _check_bones(chosen)
    low, high = chosen.box
    _check_elements(high - low + 2.0 * thickness, size)
    least = finest(chosen, thickness)
    if thickness < least:
        raise ValueError(
            f"a skin of {thickness:g} m is too thin for bones that reach over "
            f"{(high - low).max():.3g} m. Make it {least:.2g} m thick at least."
        )
    tolerance = min(FIDELITY * size, THICKNESSES * min(thickness, chosen.thinnest))
    skin = contour(chosen, thickness, min(_pitch(chosen, size), 0.5 * thickness))
    return _fleshed(skin, None, chosen, size, tolerance)


def surface_mesh(path: Path, spec: mujoco.MjSpec, bones: Sequence[str], size: float) -> FleshMesh:
    """Flesh as far as the closed surface in a file, which is in world axes at rest; as `skin_mesh`.

    raises  ValueError as `skin_mesh`, for a file that is no closed surface, and for a bone outside
            the surface
    """
    chosen = bones_of(spec, bones)
    _check_bones(chosen)
    tolerance = min(FIDELITY * size, THICKNESSES * chosen.thinnest)
    surface = read_surface(path)
    _check_elements(np.ptp(surface[0], axis=0), size)
    check_covers(path, surface, chosen, _pitch(chosen, size), tolerance)
    return _fleshed(surface, surface, chosen, size, tolerance)


def _check_bones(bones: Bones) -> None:
    """Raise ValueError for a bone that is too thin for flesh around it.

    The samples miss it, or it is a plate that needs too many elements.
    """
    low, high = bones.box
    for part in bones.parts:
        # 8 prod((high - low) / 2 + t - thinnest) = MOST_SAMPLES (SEEN t)^3 at the least half size t
        sampled = 8.0 * Polynomial.fromroots(part.thinnest - 0.5 * (high - low))
        sampled -= Polynomial([0.0, 0.0, 0.0, MOST_SAMPLES * SEEN**3])
        flat = 4.0 * np.prod(np.sort(part.half)[1:])
        squares = MOST_ELEMENTS / PER_SQUARE
        least = max(sampled.roots().real.max(), 0.5 * np.sqrt(flat / squares))
        if part.thinnest < least:
            raise ValueError(
                f"bone '{bones.names[part.bone]}' is {2.0 * part.thinnest:.3g} m thick, too thin "
                f"for flesh around it. Make it {rounded_up(2.0 * least)} m thick at least, or "
                "leave it out of the bones."
            )


def _check_elements(extent: Array, size: float) -> None:
    """Raise ValueError where the mesher's box has room for too many elements.

    That box is one edge farther out on every side than flesh that reaches over `extent` m.
    """
    # FILLING * prod(extent + 2 s) elements of volume s^3: as many as allowed at the largest root
    beside = 8.0 * FILLING * Polynomial.fromroots(-0.5 * extent)
    most = (beside - Polynomial([0.0, 0.0, 0.0, MOST_ELEMENTS])).roots().real.max()
    if size < most:
        raise ValueError(
            f"flesh that reaches over {extent.max():.3g} m would have more than "
            f"{MOST_ELEMENTS:,} elements with edges of {size:g} m. Make the size "
            f"{rounded_up(most)} m at least, or the flesh smaller."
        )


def _pitch(bones: Bones, size: float) -> float:
    """Distance of samples at which neither edges nor the thinnest bone are missed, m."""
    return min(0.3 * size, SEEN * bones.thinnest)


def _fleshed(
    outside: Mesh, own: Mesh | None, bones: Bones, size: float, tolerance: float
) -> FleshMesh:
    """Flesh between an outer surface and bones; `own` is the surface where it is the user's."""
    inside = contour(bones, 0.0, _pitch(bones, size))
    chamber = chamber_of(bones, inside[0], tolerance, own)
    hollow = _hollow(outside, inside)
    points, elements, tolerance = _meshed(hollow, outside, bones, chamber, size, tolerance)
    ends = points[with_middles(len(points), elements)[0]]
    edge = float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))
    joint = max(JOINT * bones.thinnest, JOINT_EDGES * edge)
    mesh = FleshMesh(points, elements, _holders(bones, points, HELD * tolerance, joint))
    _check_held(mesh, bones, size)
    return mesh


def _meshed(
    hollow: Mesh, outside: Mesh, bones: Bones, chamber: Chamber, size: float, tolerance: float
) -> tuple[Array, Indices, float]:
    """Points and right-handed tetrahedra between the surfaces, and the tolerance that it took.

    Where walls meet, the chamber is a wedge, and the mesher may leave out of its tip all that is
    within the tolerance of both: a pit as deep as the flesh. It meshes again until there is none.
    raises  ValueError when it always is
    """
    part = chamber.cut(hollow)
    for _ in range(TRIES):
        points, elements = tetrahedra_within(part, size, tolerance)
        flesh = bones.distance(points[elements].mean(axis=1)) > 0.0
        points, elements = chamber.unfold(points, elements, flesh, hollow, tolerance)
        used, renumbered = np.unique(elements, return_inverse=True)
        points, elements = points[used], renumbered.reshape(-1, 4)
        corners = points[np.unique(outer_surface(points, elements))]
        if np.abs(signed_distance(corners, outside)).max() <= ASTRAY * tolerance:
            return points, elements, tolerance
        tolerance *= TIGHTER
    raise ValueError(
        f"flesh that has edges of {size:g} m does not follow its surface. Make the size smaller."
    )


def _hollow(outside: Mesh, inside: Mesh) -> Mesh:
    """The surface of what lies between two surfaces.

    One surface has one face where a wall cuts it, a ring. Of two discs upon each other, one for
    each surface, the mesher cut off a corner in a third of its runs.
    """
    inward = inside[1][:, ::-1] + len(outside[0])
    return np.concatenate([outside[0], inside[0]]), np.concatenate([outside[1], inward])


def _connected(cells: Indices, count: int) -> Indices:
    """(count,) number of the part of a mesh that each of its points is in."""
    pairs = np.repeat(cells[:, 0], cells.shape[1] - 1), cells[:, 1:].ravel()
    links = coo_array((np.ones(pairs[0].size), pairs), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1])


def _holders(bones: Bones, points: Array, tolerance: float, joint: float) -> tuple[str, ...]:
    """The bone that each point is deepest in, "" for points more than `tolerance` m outside all.

    Points less than `joint` m from a second bone are let go: where a joint bends, flesh that both
    bones held would be torn. How stiff the flesh about it is goes with that distance, which is
    therefore the bones' own and no mesh's.
    """
    distances = bones.distances(points)
    nearest = distances.argmin(axis=1)
    held = distances.min(axis=1) <= tolerance
    if len(bones.names) > 1:
        held &= np.partition(distances, 1, axis=1)[:, 1] > joint
    return tuple(bones.names[b] if h else "" for b, h in zip(nearest, held, strict=True))


def _check_held(mesh: FleshMesh, bones: Bones, size: float) -> None:
    """Raise ValueError for a bone that holds no point, and for flesh that no bone holds."""
    idle = [name for name in bones.names if name not in mesh.holders]
    if idle:
        raise ValueError(
            f"bone '{idle[0]}' holds no point of flesh that has edges of {size:g} m. "
            "Make the size smaller, or leave the bone out."
        )
    parts = _connected(mesh.elements, len(mesh.points))
    held = np.array([bool(name) for name in mesh.holders])
    loose = ~np.isin(parts, parts[held])
    if loose.any():
        raise ValueError(
            f"the flesh about {place(mesh.points[loose].mean(axis=0))} touches no bone. "
            "Join it to the rest, or remove it."
        )

"""Flesh as a mesh: its tetrahedra, which of them are elastic, and which points a bone holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import mujoco
import numpy as np
from numpy.polynomial import Polynomial

from flowborne.base.extras import check_mesher
from flowborne.base.phrases import location, rounded_up
from flowborne.kernels.arrays import Array, Integers, Mesh
from flowborne.kernels.jit import numba_thread_count
from flowborne.shapes.thickness import connected
from flowborne.solids.elements import measures, oriented, outer_surface, with_middles
from flowborne.solids.tissue.bones import (
    MOST_SAMPLES,
    Bones,
    bones_of,
    contour,
    finest,
    signed_distance,
)
from flowborne.solids.tissue.mesh_run import SURFACES, TETRAHEDRA, run_apart
from flowborne.solids.tissue.surface_file import check_covers, read_surface
from flowborne.solids.tissue.symmetry import Chamber, chamber_of

FIDELITY = 0.1
"""Largest distance of a face from the surface that it follows, in edges."""

THICKNESSES = 0.6
"""The same, in thicknesses of the skin, or in half thicknesses of the thinnest bone."""

HELD = 0.5
"""Largest distance from a bone to the points that it holds, in tolerances of the faces."""

JOINT = 1.25
"""Bones hold no points closer than this to a second bone, in half sizes of the thinnest bone."""

JOINT_EDGES = 0.75
"""The same in median edges; the larger distance counts."""

ASTRAY = 1.5
"""Largest distance of the outside of a mesh from its surface, in tolerances, without a new try."""

TOLERANCE_RATIO = 0.8
"""Tolerance of the next try over that of the last one."""

MOST_TRIES = 8
"""Most meshings of one flesh."""

TETRAHEDRA_PER_CUBE = 6.0 * np.sqrt(2.0)
"""Volume of a cube over that of a regular tetrahedron with the same edges."""

MOST_ELEMENTS = 100_000
"""Most elements that fit into the box of the mesher. Two balls of 0.6 m, 160 m apart, with edges of
0.25 m take 13 s and 0.5 GB; the built-in creatures with flesh need 7,000."""

SAMPLE_SPACING = 0.6
"""Largest distance of samples that resolves the thinnest bone, in its half sizes."""

ELEMENTS_PER_SQUARE = 24.0
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
    elements: Integers
    holders: tuple[str, ...]


def skin_mesh(
    spec: mujoco.MjSpec,
    bones: Sequence[str],
    thickness: float,
    size: float,
    neighbours: Sequence[str] = (),
) -> FleshMesh:
    """Flesh up to `thickness` m outside the union of some bodies.

    It has the mirror planes that exchange some of these bodies.

    bones       names of the bodies
    size        length of edges, m; shorter where the curvature of the surface requires it
    neighbours  names of bodies that hold the points inside them too
    raises      ValueError for an unknown body, a body without a geom, a bone that is too thin, a
                skin that is too thin for its bones or too large for its edges, when the mesher
                fails, and for a bone that holds no point
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
    holding = bones_of(spec, [*bones, *neighbours])
    return _fleshed(skin, None, chosen, holding, size, tolerance)


def surface_mesh(
    path: Path,
    spec: mujoco.MjSpec,
    bones: Sequence[str],
    size: float,
    neighbours: Sequence[str] = (),
) -> FleshMesh:
    """Flesh up to the closed surface in a file, in world axes at rest; as `skin_mesh`.

    raises  ValueError as `skin_mesh`, for a file without a closed surface, and for a bone outside
            the surface
    """
    chosen = bones_of(spec, bones)
    _check_bones(chosen)
    tolerance = min(FIDELITY * size, THICKNESSES * chosen.thinnest)
    surface = read_surface(path)
    _check_elements(np.ptp(surface[0], axis=0), size)
    check_covers(path, surface, chosen, _pitch(chosen, size), tolerance)
    holding = bones_of(spec, [*bones, *neighbours])
    return _fleshed(surface, surface, chosen, holding, size, tolerance)


def _check_bones(bones: Bones) -> None:
    """Raise ValueError for a bone that is too thin for flesh around it.

    Too thin means that the samples miss it, or that it is a plate with too many elements around it.
    """
    low, high = bones.box
    for part in bones.parts:
        # at the smallest half size t
        # 8 prod((high - low) / 2 + t - thinnest) = MOST_SAMPLES (SAMPLE_SPACING t)^3
        sampled = 8.0 * Polynomial.fromroots(part.thinnest - 0.5 * (high - low))
        sampled -= Polynomial([0.0, 0.0, 0.0, MOST_SAMPLES * SAMPLE_SPACING**3])
        flat = 4.0 * np.prod(np.sort(part.half)[1:])
        squares = MOST_ELEMENTS / ELEMENTS_PER_SQUARE
        least = max(sampled.roots().real.max(), 0.5 * np.sqrt(flat / squares))
        if part.thinnest < least:
            raise ValueError(
                f"bone '{bones.names[part.bone]}' is {2.0 * part.thinnest:.3g} m thick, too thin "
                f"for flesh around it. Make it {rounded_up(2.0 * least)} m thick at least, or "
                "leave it out of the bones."
            )


def _check_elements(extent: Array, size: float) -> None:
    """Raise ValueError when too many elements fit into the box of the mesher.

    That box exceeds the flesh, which extends over `extent` m, by one edge on every side.
    """
    # TETRAHEDRA_PER_CUBE * prod(extent + 2 s) elements of volume s^3: the most at the largest root
    box = 8.0 * TETRAHEDRA_PER_CUBE * Polynomial.fromroots(-0.5 * extent)
    most = (box - Polynomial([0.0, 0.0, 0.0, MOST_ELEMENTS])).roots().real.max()
    if size < most:
        raise ValueError(
            f"flesh that reaches over {extent.max():.3g} m would have more than "
            f"{MOST_ELEMENTS:,} elements with edges of {size:g} m. Make the size "
            f"{rounded_up(most)} m at least, or the flesh smaller."
        )


def _pitch(bones: Bones, size: float) -> float:
    """Distance of samples that resolves edges and the thinnest bone, m."""
    return min(0.3 * size, SAMPLE_SPACING * bones.thinnest)


def _fleshed(
    outside: Mesh, own: Mesh | None, bones: Bones, holding: Bones, size: float, tolerance: float
) -> FleshMesh:
    """Flesh between an outer surface and bones; `own` is the surface if it is the user's.

    holding  the bones and their neighbours
    """
    inside = contour(bones, 0.0, _pitch(bones, size))
    chamber = chamber_of(bones, inside[0], tolerance, own)
    hollow = _hollow(outside, inside)
    points, elements, tolerance = _meshed(hollow, outside, bones, chamber, size, tolerance)
    ends = points[with_middles(len(points), elements)[0]]
    edge = float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))
    joint = max(JOINT * bones.thinnest, JOINT_EDGES * edge)
    mesh = FleshMesh(points, elements, _holders(holding, points, HELD * tolerance, joint))
    _check_held(mesh, bones, size)
    return mesh


def _meshed(
    hollow: Mesh, outside: Mesh, bones: Bones, chamber: Chamber, size: float, tolerance: float
) -> tuple[Array, Integers, float]:
    """Points and right-handed tetrahedra between the surfaces, and the tolerance used.

    Where walls meet, the chamber is a wedge. The mesher may drop the part of its tip that is within
    the tolerance of both walls, which leaves a pit as deep as the flesh. Where its faces are off a
    wall, the projection onto the wall may turn an element inside out. In both cases the flesh is
    meshed again with a smaller tolerance.
    raises  ValueError when every try has a pit or such an element
    """
    part = chamber.cut(hollow)
    for _ in range(MOST_TRIES):
        points, elements = tetrahedra_within(part, size, tolerance)
        flesh = bones.distance(points[elements].mean(axis=1)) > 0.0
        points, elements = chamber.unfold(points, elements, flesh, hollow, tolerance)
        used, renumbered = np.unique(elements, return_inverse=True)
        points, elements = points[used], renumbered.reshape(-1, 4)
        corners = points[np.unique(outer_surface(points, elements))]
        follows = np.abs(signed_distance(corners, outside)).max() <= ASTRAY * tolerance
        if follows and measures(points, elements).min() > 0.0:
            return points, elements, tolerance
        tolerance *= TOLERANCE_RATIO
    raise ValueError(
        f"flesh that has edges of {size:g} m does not follow its surface. Make the size smaller."
    )


def tetrahedra_within(surface: Mesh, size: float, tolerance: float) -> tuple[Array, Integers]:
    """Points (n, 3) and right-handed tetrahedra (m, 4) of the inside of a surface.

    surface    closed and outward; for a hollow body it has parts that point into the hollow
    size       length of edges, m; shorter where the curvature or size of the surface requires it
    tolerance  largest distance of faces of the tetrahedra from the surface, m
    raises     ValueError when the mesher fails
    source     fTetWild: Hu, Schneider, Wang, Zorin and Panozzo 2020

    Two runs give different meshes of the same quality, even on one thread.
    """
    check_mesher()
    points, triangles = surface
    across = float(np.linalg.norm(np.ptp(points, axis=0)))
    with TemporaryDirectory(prefix="flowborne-flesh-") as folder:
        np.savez(
            Path(folder) / SURFACES,
            points=points,
            triangles=triangles.astype(np.int32),
            size=min(size, across),  # the mesher's box exceeds the surface by it
            tolerance=tolerance / across,
            threads=numba_thread_count(),
        )
        why = run_apart(folder, TETRAHEDRA, "mesh")
        if why is not None:
            raise ValueError(
                f"the flesh cannot be meshed with edges of {size:g} m: {why}. Try another size."
            )
        with np.load(Path(folder) / TETRAHEDRA) as mesh:
            points, tetrahedra = mesh["points"], mesh["tetrahedra"].astype(np.int64)
    return points, oriented(points, tetrahedra)


def _hollow(outside: Mesh, inside: Mesh) -> Mesh:
    """The surface of the space between two surfaces.

    As one surface, it has one face where a wall cuts it, a ring. With two discs on top of each
    other, one for each surface, the mesher cut off a corner in a third of its runs.
    """
    inward = inside[1][:, ::-1] + len(outside[0])
    return np.concatenate([outside[0], inside[0]]), np.concatenate([outside[1], inward])


def _holders(bones: Bones, points: Array, tolerance: float, joint: float) -> tuple[str, ...]:
    """The bone that each point is deepest in, "" for points more than `tolerance` m outside all.

    Points less than `joint` m from a second bone are not held: flesh held by both bones would tear
    when the joint bends. This distance determines the stiffness of the flesh around the joint, so
    it depends on the bones and not on the mesh.
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
    first = np.repeat(mesh.elements[:, 0], mesh.elements.shape[1] - 1)
    parts = connected(len(mesh.points), first, mesh.elements[:, 1:].ravel())
    held = np.array([bool(name) for name in mesh.holders])
    loose = ~np.isin(parts, parts[held])
    if loose.any():
        raise ValueError(
            f"the flesh about {location(mesh.points[loose].mean(axis=0))} touches no bone. "
            "Join it to the rest, or remove it."
        )

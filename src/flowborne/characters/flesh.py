"""The flesh of a character: thin cores of some of its bodies inside the surface of their pieces.

A body of flesh has a capsule along its bone in place of its piece, and flesh fills the rest of the
piece. The pieces of neighbouring bodies of flesh are one surface, so that flesh bridges the joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.characters.division import Division, joined
from flowborne.characters.rig import Rig, Surface
from flowborne.kernels.arrays import Array, Mesh
from flowborne.shapes.mesh import ShapeMesh

CORE_RADIUS = 0.35
"""Radius of a core over the median depth of its axis below the surface."""

CORE_DEPTH = 2.0
"""Least depth of the axis of a core below the surface, in radii."""

CORE_GAP = 3.0
"""Distance of the axis of a core from the joints at its ends, in radii."""

LONGEST_GAP = 0.3
"""Largest of these distances, in lengths from joint to joint."""

EDGE = 1.5
"""Edges of the elements over the median depth of the axes."""

SAMPLES = 65
"""Points of an axis at which its depth is computed."""


@dataclass(frozen=True, eq=False)
class CharacterFlesh:
    """Flesh of a character at rest.

    surface     around it, with domes about the joints in the bodies that carry it, m
    cores       joint -> ends (2, 3) of the axis of its capsule, and the radius, m; both ends of
                the axis may be the same
    neighbours  joints of the bodies that carry it, and of those that it carries
    edge        length of the edges of elements, m
    """

    surface: Mesh
    cores: dict[int, tuple[Array, float]]
    neighbours: tuple[int, ...]
    edge: float


def flesh_of(
    rig: Rig, division: Division, bones: Sequence[str], name: str
) -> CharacterFlesh | None:
    """The flesh of some joints of a division; None without any.

    name    of the file, for messages
    raises  SceneError for a bone outside its piece
    """
    if not bones:
        return None
    surface = joined(division.soft)
    shape = ShapeMesh(*surface)
    cores, depths = {}, []
    for joint in sorted(map(rig.names.index, bones)):
        axis, gaps = _axis(rig, division, joint)
        depth = -shape.distance(axis)
        if not (depth > 0.0).any():
            raise SceneError(
                f"{name}: bone '{rig.names[joint]}' lies outside of its part of the mesh, so no "
                "flesh can grow around it. Move the bone inside in its rest pose, or leave it out."
            )
        middle = float(np.median(depth[depth > 0.0]))
        cores[joint] = _core(axis, depth, CORE_RADIUS * middle, gaps)
        depths.append(middle)
    neighbours = _neighbours(rig, division, [*cores])
    return CharacterFlesh(surface, cores, neighbours, EDGE * float(np.median(depths)))


def _neighbours(rig: Rig, division: Division, soft: list[int]) -> tuple[int, ...]:
    """Joints of the rigid bodies with a piece that joints connect to these."""
    found = []
    for joint in division.bodies[1:]:
        pair = joint, int(division.owners[rig.parents[joint]])
        found += [each for each in pair if {*pair} & {*soft} and each not in soft]
    return tuple(each for each in dict.fromkeys(found) if len(division.pieces[each][1]))


def _axis(rig: Rig, division: Division, joint: int) -> tuple[Array, int]:
    """(SAMPLES, 3) points from a joint to the mean of the joints below it, 2 ends with a gap.

    Without one it ends at the centre of the piece, without a gap, so that the end of flesh is free.
    """
    start, below = rig.position[joint], np.flatnonzero(rig.parents == joint)
    end, gaps = rig.position[below].mean(axis=0) if len(below) else start, 2
    if np.allclose(end, start):
        end, gaps = ShapeMesh(*division.pieces[joint]).centroid, 1
    return start + np.linspace(0.0, 1.0, SAMPLES)[:, None] * (end - start), gaps


def _core(axis: Array, depth: Array, radius: float, gaps: int) -> tuple[Array, float]:
    """Ends and radius of the longest capsule on an axis that is deep enough everywhere."""
    along = np.linalg.norm(axis - axis[0], axis=1)
    gap = min(CORE_GAP * radius, LONGEST_GAP * along[-1])
    fits = (depth >= CORE_DEPTH * radius) & (along >= gap)
    fits &= along <= along[-1] - (gaps - 1) * gap
    if not fits.any():
        fits = depth == depth.max()
    starts = np.flatnonzero(fits & ~np.append(False, fits[:-1]))
    ends = np.flatnonzero(fits & ~np.append(fits[1:], False))
    longest = int((ends - starts).argmax())
    return axis[[starts[longest], ends[longest]]], radius


def without(surface: Surface, division: Division, flesh: CharacterFlesh) -> Surface:
    """A surface without the triangles whose corners all belong to flesh."""
    soft = np.isin(division.owners, [*flesh.cores])
    of_flesh = surface.weights[:, soft].sum(axis=1) > 0.5 * surface.weights.sum(axis=1)
    kept = ~of_flesh[surface.faces].all(axis=1)
    return replace(surface, faces=surface.faces[kept], colours=surface.colours[kept])

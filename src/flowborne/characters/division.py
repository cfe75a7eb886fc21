"""Which joints of a character become bodies, and the closed piece of its surface that each gets.

A point of the surface lies beyond a joint where that joint and all below it have more than half of
the weight, and belongs to the last joint beyond which it lies. Weights being linear in a triangle,
triangles are cut there. What lies beyond a joint is never partly beyond another one, so that every
rim is between two bodies alone. The fan that closes it, about its middle, is the same on both
sides: the pieces fill the whole. As rigid pieces turn, a crack would open between them, and fluid
would enter it a hundred times as fast as they move: the shapes that the fluid meets have a dome
about the joint in place of the fan, inside the body above.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.characters.closing import closed, domes, volume_of, weld
from flowborne.characters.rig import Array, Integers, Rig, Surface
from flowborne.errors import SceneError
from flowborne.shapes.closing import fans, loops_of, rims_of
from flowborne.shapes.shape import Mesh

HALF = 0.5 + 1e-7
"""Weight with which a point lies beyond a joint; above a half, so that no point lies beyond two."""

LEAST = 2e-3
"""Part of the character's volume below which a joint is rigid with the one above it."""

TRUNK = 0.05
"""Part of the volume below which the topmost joint is rigid with the largest below it: a root that
is a handle has no mass, and moves with the hips."""


@dataclass(frozen=True, eq=False)
class Division:
    """A character as rigid bodies.

    owners  (n,) number of the joint that each joint is rigid with, itself where it moves
    leader  joint of the topmost body whose motion is that of the body
    pieces  joint that moves -> its closed part of the surface, m, where the rig has it at rest
    shapes  the same with domes about the joints
    volume  m^3 within the whole surface
    filled  m across each hole of the surface that was closed
    """

    owners: Integers
    leader: int
    pieces: dict[int, Mesh]
    shapes: dict[int, Mesh]
    volume: float
    filled: tuple[float, ...] = ()

    @property
    def bodies(self) -> tuple[int, ...]:
        """Joints that move, parents before children."""
        return tuple(int(joint) for joint in np.flatnonzero(self.owners == np.arange(self.count)))

    @property
    def count(self) -> int:
        """Number of joints."""
        return len(self.owners)


def divided(rig: Rig, surface: Surface, name: str, fill: bool = False) -> Division:
    """The bodies of a character.

    name    of its file, for messages
    fill    whether holes of any size are closed, and not only small ones
    raises  SceneError when the surface is not closed, or has no inside
    """
    whole, filled = closed(surface, name, fill)
    volume = volume_of((whole.vertices, whole.faces))
    if not volume > 0.0:
        raise SceneError(
            f"{name}: the surface holds {volume:.3g} m^3. Turn its faces outward (in Blender: "
            "Mesh, Normals, Recalculate Outside), and take a surface with an inside."
        )
    own, _ = _pieces(rig, np.arange(len(rig.names)), whole, domed=False)
    owners, leader = _merged(rig, np.array([volume_of(piece) for piece in own]) / volume)
    moves = np.flatnonzero(owners == np.arange(len(owners))).tolist()
    pieces, shapes = (
        {joint: meshes[joint] for joint in moves} for meshes in _pieces(rig, owners, whole)
    )
    return Division(owners, leader, pieces, shapes, volume, filled)


def _merged(rig: Rig, parts: Array) -> tuple[Integers, int]:
    """Joint that each joint is rigid with, and the leader of the topmost.

    parts  (n,) of the volume that each joint has
    """
    owners, parts = np.arange(len(parts)), parts.copy()
    for joint in range(len(owners) - 1, 0, -1):
        if parts[joint] < LEAST:
            parent = int(rig.parents[joint])
            owners[owners == joint] = parent
            parts[parent] += parts[joint]
    top = leader = 0
    while parts[top] < TRUNK:
        below = np.flatnonzero(_parents(rig, owners) == top)
        if not len(below):
            break
        leader = int(below[parts[below].argmax()])
        owners[owners == leader] = top
        parts[top] += parts[leader]
    return owners, leader


def _pieces(
    rig: Rig, owners: Integers, surface: Surface, *, domed: bool = True
) -> tuple[list[Mesh], list[Mesh]]:
    """The closed part of each joint, without triangles where it has none; and those with domes,
    where they are asked for."""
    share = surface.weights @ _beyond(rig.parents) - HALF
    below = [np.flatnonzero(_parents(rig, owners) == joint) for joint in range(len(owners))]
    share[:, owners != np.arange(len(owners))] = -HALF
    of_vertex = _last(share, rig.parents)[surface.faces]
    pure = (of_vertex == of_vertex[:, :1]).all(axis=1)
    corners = [surface.vertices[surface.faces[pure]].reshape(-1, 3)]
    joints = [of_vertex[pure, 0]]
    for face in surface.faces[~pure]:
        for joint in np.flatnonzero((share[face] > 0.0).any(axis=0)).tolist():
            inside = [share[face, joint], *(-share[face][:, other] for other in below[joint])]
            polygon = _cut(surface.vertices[face], inside)
            fan = [polygon[[0, n, n + 1]] for n in range(1, len(polygon) - 1)]
            corners += fan
            joints.append(np.full(len(fan), joint))
    every, of_face = np.concatenate(corners), np.concatenate(joints)
    first, welded = weld(every)
    points, faces = every[first], welded.reshape(-1, 3)
    sound = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces, of_face = faces[sound], of_face[sound]
    beyond = _beyond(rig.parents) > 0.0
    rims = {
        joint: loops_of(rims_of(faces[beyond[of_face, joint]]))
        for joint in np.unique(of_face).tolist()
        if rig.parents[joint] >= 0
    }
    caps = {joint: fans(points, loops) for joint, loops in rims.items()}
    found, round_ones = [], []
    for joint in range(len(owners)):
        parts = [(points, faces[of_face == joint])]
        parts += [(caps[d][0], caps[d][1][:, ::-1]) for d in below[joint] if d in caps]
        found.append(_joined([*parts, caps[joint]] if joint in caps else parts))
        if domed and joint in rims:
            dome = domes(points, rims[joint], rig.position[joint])
            round_ones.append(_joined([*parts, dome]))
        else:
            round_ones.append(found[-1])
    return found, round_ones


def _beyond(parents: Integers) -> Array:
    """(n, n) 1 where a joint, the row, is another one, the column, or anywhere below it."""
    found = np.eye(len(parents))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            found[joint] += found[parent]
    return found


def _parents(rig: Rig, owners: Integers) -> Integers:
    """(n,) joint that moves above each joint that moves; -1 for the others, and at the top."""
    moves = owners == np.arange(len(owners))
    return np.where(moves & (rig.parents >= 0), owners[rig.parents], -1)


def _last(share: Array, parents: Integers) -> Integers:
    """(k,) the joint farthest from the root whose share (k, n) is above 0."""
    found = np.zeros(len(share), np.int64)
    for joint in range(len(parents)):
        found[share[:, joint] > 0.0] = joint
    return found


def _cut(triangle: Array, heights: list[Array]) -> Array:
    """(k, 3) the polygon of a triangle where linear functions, (3,) at its corners, are above 0."""
    share = np.eye(3)
    for height in heights:
        share = _clipped(share, share @ height)
    return share @ triangle


def _clipped(polygon: Array, height: Array) -> Array:
    """The part of a convex polygon (k, m) where a linear function, (k,) there, is above 0.

    source  Sutherland and Hodgman 1974, Reentrant polygon clipping, for one plane
    """
    kept = []
    for n in range(len(polygon)):
        here, before = height[n], height[n - 1]
        if (here > 0.0) != (before > 0.0):
            share = before / (before - here)
            kept.append((1.0 - share) * polygon[n - 1] + share * polygon[n])
        if here > 0.0:
            kept.append(polygon[n])
    return np.array(kept).reshape(-1, polygon.shape[1])


def _joined(parts: list[Mesh]) -> Mesh:
    """Triangles of several meshes as one mesh without those that lie back to back."""
    corners = np.concatenate([points[faces].reshape(-1, 3) for points, faces in parts])
    points, number = np.unique(corners, axis=0, return_inverse=True)
    faces = number.reshape(-1, 3)
    same, which = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    sheets = np.bincount(which.ravel(), minlength=len(same)) > 1
    kept = faces[~sheets[which.ravel()]]
    used, renumbered = np.unique(kept, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3)

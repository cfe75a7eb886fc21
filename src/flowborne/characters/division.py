"""Which joints of a character become bodies, and the closed piece of its surface that each gets.

A point of the surface lies beyond a joint where that joint and all below it have more than half of
the weight, and belongs to the last joint beyond which it lies. Weights being linear in a triangle,
triangles are cut there. What lies beyond a joint is never partly beyond another one, so that every
rim is between two bodies alone. The fan that closes it, about its middle, is the same on both
sides: the pieces fill the whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from flowborne.characters.rig import Array, Integers, Rig, Surface
from flowborne.errors import SceneError
from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.shape import Mesh

SAME = 1e-7
"""Points this close, relative to the size of the surface, are one."""

CROWDED = 50
"""Points that may be one, on average."""

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
    volume  m^3 within the whole surface
    """

    owners: Integers
    leader: int
    pieces: dict[int, Mesh]
    volume: float

    @property
    def bodies(self) -> tuple[int, ...]:
        """Joints that move, parents before children."""
        return tuple(int(joint) for joint in np.flatnonzero(self.owners == np.arange(self.count)))

    @property
    def count(self) -> int:
        """Number of joints."""
        return len(self.owners)


def divided(rig: Rig, surface: Surface, name: str) -> Division:
    """The bodies of a character.

    name    of its file, for messages
    raises  SceneError when the surface is not closed, or has no inside
    """
    whole = closed(surface, name)
    volume = _volume((whole.vertices, whole.faces))
    if not volume > 0.0:
        raise SceneError(
            f"{name}: the surface holds {volume:.3g} m^3. Turn its faces outward (in Blender: "
            "Mesh, Normals, Recalculate Outside), and take a surface with an inside."
        )
    own = _pieces(rig, np.arange(len(rig.names)), whole)
    owners, leader = _merged(rig, np.array([_volume(piece) for piece in own]) / volume)
    cut = _pieces(rig, owners, whole)
    pieces = {joint: piece for joint, piece in enumerate(cut) if owners[joint] == joint}
    return Division(owners, leader, pieces, volume)


def closed(surface: Surface, name: str) -> Surface:
    """The surface with every point once, and no triangle without an area.

    raises  SceneError where an edge does not have a triangle on either side
    """
    first, welded = _welded(surface.vertices)
    weights = np.zeros((len(first), surface.weights.shape[1]))
    np.add.at(weights, welded, surface.weights)
    weights /= weights.sum(axis=1, keepdims=True)
    faces = welded[surface.faces]
    kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces = faces[kept]
    rims = _rims(faces)
    if len(rims):
        x, y, z = surface.vertices[first][rims[0]].mean(axis=0)
        raise SceneError(
            f"{name}: the surface is not watertight: {len(rims)} edges have a triangle on one side "
            f"alone, one of them at ({x:.4g}, {y:.4g}, {z:.4g}) m. Close the holes (in Blender: "
            "Mesh, Clean Up, Fill Holes), or leave out meshes that have no inside."
        )
    return Surface(surface.vertices[first], faces, weights, surface.colours[kept])


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


def _pieces(rig: Rig, owners: Integers, surface: Surface) -> list[Mesh]:
    """The closed part of each joint, without triangles where it has none."""
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
    first, welded = _welded(every)
    points, faces = every[first], welded.reshape(-1, 3)
    sound = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces, of_face = faces[sound], of_face[sound]
    beyond = _beyond(rig.parents) > 0.0
    caps = {
        joint: _caps(points, faces[beyond[of_face, joint]])
        for joint in np.unique(of_face).tolist()
        if rig.parents[joint] >= 0
    }
    found = []
    for joint in range(len(owners)):
        parts = [(points, faces[of_face == joint])]
        parts += [caps[joint]] if joint in caps else []
        parts += [(caps[d][0], caps[d][1][:, ::-1]) for d in below[joint] if d in caps]
        found.append(_joined(parts))
    return found


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


def _caps(points: Array, faces: Integers) -> Mesh:
    """Fans about their middles that close the rims of some triangles."""
    corners, caps = [points], [np.zeros((0, 3), np.int64)]
    for rim in _loops(_rims(faces)):
        start, stop = points[rim], points[np.roll(rim, -1)]
        length = np.linalg.norm(stop - start, axis=1)
        tip = np.full(len(rim), len(points) + len(corners) - 1)
        corners.append(np.average(0.5 * (start + stop), axis=0, weights=length)[None])
        caps.append(np.stack([np.roll(rim, -1), rim, tip], axis=1))
    return np.concatenate(corners), np.concatenate(caps)


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


def _rims(faces: Integers) -> Integers:
    """(k, 2) directed edges that are not used as often in the other direction."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = edges.min(axis=1), edges.max(axis=1)
    pairs, number = np.unique(np.stack([low, high], axis=1), axis=0, return_inverse=True)
    surplus = np.zeros(len(pairs), np.int64)
    np.add.at(surplus, number.ravel(), np.where(edges[:, 0] == low, 1, -1))
    ahead = np.repeat(pairs, np.maximum(surplus, 0), axis=0)
    back = np.repeat(pairs[:, ::-1], np.maximum(-surplus, 0), axis=0)
    return np.concatenate([ahead, back])


def _loops(edges: Integers) -> list[Integers]:
    """Closed ways through directed edges (k, 2) of which as many enter as leave every point."""
    leaving: dict[int, list[int]] = {}
    for start, stop in edges.tolist():
        leaving.setdefault(start, []).append(stop)
    loops = []
    while leaving:
        way = [next(iter(leaving))]
        place = {way[0]: 0}
        while way:
            after = leaving[way[-1]].pop()
            if not leaving[way[-1]]:
                del leaving[way[-1]]
            if after not in place:
                place[after] = len(way)
                way.append(after)
                continue
            loop = way[place[after] :]
            loops.append(np.array(loop))
            for point in loop[1:]:
                del place[point]
            way = way[: place[after] + 1]
            if way[-1] not in leaving:
                break
    return loops


def _welded(points: Array) -> tuple[Integers, Integers]:
    """Points that are not the same as an earlier one, and for every point its number there."""
    near = SAME * float(np.ptp(points, axis=0).max())
    single, of_point = np.unique(points, axis=0, return_inverse=True)
    tree = cKDTree(single)
    crowd = tree.count_neighbors(tree, near)
    if crowd > CROWDED * len(points):
        raise SceneError(
            f"the surface has {crowd / len(points):.3g} points within {near:.3g} m of each other, "
            f"and {CROWDED} are the most: most of it is tiny for its size. Look for stray points."
        )
    pairs = tree.query_pairs(near, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(single), len(single)))
    number = np.asarray(connected_components(links, directed=False)[1])[of_point.ravel()]
    return np.unique(number, return_index=True)[1], number


def _volume(mesh: Mesh) -> float:
    """m^3 inside; 0 without triangles."""
    return ShapeMesh(*mesh).volume if len(mesh[1]) else 0.0

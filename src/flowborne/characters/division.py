"""The joints of a character that become bodies, and the closed piece of the surface of each.

The surface is closed first. A point lies beyond a joint if that joint and its descendants have more
than half of the weight; it belongs to the last joint beyond which it lies. Weights are linear in a
triangle, so triangles are cut along straight lines. The regions beyond two joints are nested or
disjoint, so every rim separates exactly two bodies. Both bodies close the rim with the same fan
around its centre, so the pieces fill the whole volume. When rigid pieces rotate, a crack would open
between them, and fluid would enter it a hundred times as fast as they move. The shapes in the fluid
therefore have a dome around the joint instead of the fan, inside the parent body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from flowborne.base.errors import SceneError
from flowborne.base.phrases import location
from flowborne.characters.rig import PLAIN, Rig, Surface
from flowborne.kernels.arrays import Array, Integers, Mesh
from flowborne.shapes.closing import SMALL_HOLE, across_of, fans, loops_of, rims_of, wound
from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.thickness import connected, split_quads

WELD_DISTANCE = 1e-7
"""Distance below which points are welded, relative to the size of the surface."""

MAX_COINCIDENT = 50
"""Largest mean number of points within that distance of a point."""

DOME_RINGS = 6
"""Rings of triangles of a dome: 15 degrees each in a hemisphere."""

BEYOND_WEIGHT = 0.5 + 1e-7
"""Weight above which a point lies beyond a joint; more than a half, so that no point lies beyond
two disjoint ones."""

MIN_VOLUME = 2e-3
"""Part of the character's volume below which a joint is rigid with its parent."""

MIN_ROOT_VOLUME = 0.05
"""Part of the volume below which the root is rigid with its largest child: a root that is only a
control handle has no mass, and moves with the hips."""


@dataclass(frozen=True, eq=False)
class Division:
    """A character as rigid bodies.

    owners  (n,) for each joint the moving joint with which it is rigid, or itself
    leader  joint of the root body that gives the body its motion
    pieces  moving joint -> its closed part of the surface at rest, m
    shapes  the same with domes around the joints
    volume  m^3 inside the whole surface
    filled  width of each closed hole of the surface, m
    unsound joints that are rigid with a neighbour, as their piece alone is no body (`is_sound`)
    soft    shapes of chains of bodies that are chosen to be flesh
    """

    owners: Integers
    leader: int
    pieces: dict[int, Mesh]
    shapes: dict[int, Mesh]
    volume: float
    filled: tuple[float, ...] = ()
    unsound: tuple[int, ...] = ()
    soft: tuple[Mesh, ...] = ()

    @property
    def bodies(self) -> tuple[int, ...]:
        """Joints that move, parents before children."""
        return tuple(np.flatnonzero(self.owners == np.arange(len(self.owners))).tolist())


def divided(
    rig: Rig, surface: Surface, name: str, fill: bool = False, flesh: Sequence[str] = ()
) -> Division:
    """The bodies of a character.

    name    of its file, for messages
    fill    whether to close holes of any size instead of small ones only
    flesh   names of joints whose bodies are flesh
    raises  SceneError when the surface remains open, or has no positive volume, and for a joint of
            flesh that is no body
    """
    whole, filled = closed(surface, name, fill)
    volume = volume_of((whole.vertices, whole.faces))
    if not volume > 0.0:
        raise SceneError(
            f"{name}: the surface encloses {volume:.3g} m^3. Orient its faces outward (in Blender: "
            "Mesh, Normals, Recalculate Outside), and use a surface that encloses a volume."
        )
    _check_outward(whole, volume, name)
    own, _ = _pieces(rig, np.arange(len(rig.names)), whole, domed=False)
    owners, leader = _merged(rig, np.array([volume_of(piece) for piece in own]) / volume)
    unsound: list[int] = []
    while True:
        pieces, shapes = _pieces(rig, owners, whole)
        moves = np.flatnonzero(owners == np.arange(len(owners))).tolist()
        wrong = [j for j in moves if not (is_sound(pieces[j]) and is_sound(shapes[j]))]
        if not wrong or len(moves) == 1:
            break
        joint, other = _neighbours(rig, owners, wrong[-1], pieces)
        owners[owners == joint] = other
        unsound.append(joint)
    own_pieces, own_shapes = (
        {joint: meshes[joint] for joint in moves} for meshes in (pieces, shapes)
    )
    soft = _soft(rig, owners, whole, _named(rig, moves, flesh, name))
    return Division(owners, leader, own_pieces, own_shapes, volume, filled, tuple(unsound), soft)


def _check_outward(surface: Surface, volume: float, file: str) -> None:
    """Raise SceneError for a connected part of a closed surface with faces inward, unless it is a
    cavity of the others, or so small that it makes no body."""
    points, faces = surface.vertices, surface.faces
    part = connected(len(points), faces[:, :2].ravel(), faces[:, 1:].ravel())[faces[:, 0]]
    volumes = np.bincount(part, np.linalg.det(points[faces]) / 6.0)
    for wrong in np.flatnonzero(volumes < -MIN_VOLUME * volume):
        own = points[np.unique(faces[part == wrong])]
        if (ShapeMesh(points, faces[part != wrong]).distance(own) > 0.0).any():
            place, size = location(own.mean(axis=0).round(6)), np.ptp(own, axis=0).max()
            raise SceneError(
                f"{file}: the mesh around {place}, {size:.3g} m long, is inside out. Orient its "
                "faces outward (in Blender: Mesh, Normals, Recalculate Outside)."
            )


def _named(rig: Rig, moves: list[int], names: Sequence[str], file: str) -> list[int]:
    """Joints of these names. Raises SceneError for one that is no body."""
    bodies = {rig.names[joint]: joint for joint in moves}
    for name in names:
        if name not in bodies:
            why = "has too little of the mesh" if name in rig.names else "is not there"
            raise SceneError(
                f"{file}: joint '{name}' cannot be flesh, because it {why}. Name some of "
                f"{', '.join(bodies)}."
            )
    return [bodies[name] for name in names]


def _soft(rig: Rig, owners: Integers, surface: Surface, joints: list[int]) -> tuple[Mesh, ...]:
    """Shapes of the chains of these joints, each as that of one body."""
    if not joints:
        return ()
    tops, parents = np.arange(len(owners)), _parents(rig, owners)
    for joint in sorted(joints):
        if parents[joint] in joints:
            tops[joint] = tops[parents[joint]]
    _, shapes = _pieces(rig, tops[owners], surface)
    return tuple(shapes[top] for top in np.unique(tops[joints]).tolist())


def is_sound(mesh: Mesh) -> bool:
    """Whether a closed surface can be that of a body: nothing, or a volume whose centre of mass is
    inside its convex hull, and whose moments of inertia are such as matter has: above 0, and none
    above the sum of the other two."""
    import trimesh  # takes a tenth of a second

    if not len(mesh[1]):
        return True
    mass = trimesh.triangles.mass_properties(mesh[0][mesh[1]])
    if not mass.volume > 0.0:
        return False
    try:
        outside = ConvexHull(mesh[0]).equations @ np.append(mass.center_mass, 1.0)
    except QhullError:  # all points in a plane, but for rounding
        return False
    least, middle, most = np.linalg.eigvalsh(mass.inertia)
    return bool((outside < 0.0).all() and least > 0.0 and most < least + middle)


def _neighbours(rig: Rig, owners: Integers, joint: int, pieces: list[Mesh]) -> tuple[int, int]:
    """The joint that joins another one where the piece of `joint` is no body: it joins its parent;
    its largest child joins the root."""
    parents = _parents(rig, owners)
    if parents[joint] >= 0:
        return joint, int(parents[joint])
    below = np.flatnonzero(parents == joint).tolist()
    return max(below, key=lambda child: volume_of(pieces[child])), joint


def closed(surface: Surface, name: str, fill: bool = False) -> tuple[Surface, tuple[float, ...]]:
    """A closed surface: coincident points are welded, degenerate triangles are removed, triangles
    of a part get consistent winding, and holes are closed by fans around their centres.

    fill     whether to close also holes wider than SMALL_HOLE of the surface's size
    returns  the surface, and the width of each closed hole, m
    raises   SceneError when a hole remains open
    """
    first, welded = weld(surface.vertices)
    weights = np.zeros((len(first), surface.weights.shape[1]))
    np.add.at(weights, welded, surface.weights)
    weights /= weights.sum(axis=1, keepdims=True)
    points, faces = surface.vertices[first], welded[surface.faces]
    kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces = wound(faces[kept])
    rims = rims_of(faces)
    loops = loops_of(rims)
    across = [across_of(points[loop]) for loop in loops]
    size = float(np.ptp(points, axis=0).max())
    every, lids = fans(points, loops)
    whole = np.concatenate([faces, lids])
    wide = [n for n, width in enumerate(across) if width > SMALL_HOLE * size]
    if wide and not fill:
        widest = max(wide, key=lambda n: across[n])
        x, y, z = points[loops[widest]].mean(axis=0)
        remedy = "Close them by fill=True, or" if volume_of((every, whole)) > 0.0 else "Close them"
        raise SceneError(
            f"{name}: the surface is not watertight: {len(rims)} edges have a triangle on one side "
            f"only. Holes wider than {SMALL_HOLE:.0%} of it: {len(wide)}, the widest "
            f"{across[widest]:.3g} m across, at ({x:.4g}, {y:.4g}, {z:.4g}) m. {remedy} in Blender "
            "(Mesh, Clean Up, Fill Holes), or leave out meshes that enclose no volume."
        )
    means = [weights[loop].mean(axis=0, keepdims=True) for loop in loops]
    colours = np.concatenate([surface.colours[kept], np.full((len(lids), 3), PLAIN)])
    return Surface(every, whole, np.concatenate([weights, *means]), colours), tuple(across)


def domes(points: Array, loops: list[Integers], centre: Array) -> Mesh:
    """`fans` with a dome instead of a fan in each rim around a joint.

    The dome is centred on the joint, so that no gap opens between the two bodies as it turns.

    centre  (3,) of the joint, m
    """
    flat, lids = fans(points, loops)
    corners, faces, count = [flat], [np.zeros((0, 3), np.int64)], len(flat)
    triangles = np.split(lids, np.cumsum([len(rim) for rim in loops], dtype=int))[:-1]
    for rim, fan in zip(loops, triangles, strict=True):
        start, middle = points[rim], flat[fan[0, 2]]
        normal = np.cross(*np.moveaxis(flat[fan[:, :2]] - middle, 1, 0)).sum(axis=0)
        width = np.linalg.norm(start - middle, axis=1).mean()
        if np.linalg.norm(centre - middle) > width or not normal.any():
            faces.append(fan)
            continue
        normal /= np.linalg.norm(normal)
        about = centre + min(float(((start - centre) @ normal).mean()), 0.0) * normal
        offset = start - about
        height, radius = offset @ normal, np.linalg.norm(offset, axis=1)
        side = offset - height[:, None] * normal
        side /= np.maximum(np.linalg.norm(side, axis=1), np.finfo(float).tiny)[:, None]
        tilt = np.arccos(np.clip(height / np.maximum(radius, np.finfo(float).tiny), -1.0, 1.0))
        ring = rim
        for share in np.arange(1, DOME_RINGS) / DOME_RINGS:
            angle, far = ((1.0 - share) * tilt)[:, None], (1.0 - share) * radius[:, None]
            far = far + share * radius.mean()
            corners.append(about + far * (np.sin(angle) * side + np.cos(angle) * normal))
            above = count + np.arange(len(rim))
            count += len(rim)
            a, b, c, d = np.roll(ring, -1), ring, above, np.roll(above, -1)
            faces.append(split_quads(a, b, c, d))
            ring = above
        corners.append((about + radius.mean() * normal)[None])
        tip = np.full(len(rim), count)
        count += 1
        faces.append(np.stack([np.roll(ring, -1), ring, tip], axis=1))
    return np.concatenate(corners), np.concatenate(faces)


def weld(points: Array) -> tuple[Integers, Integers]:
    """Indices of the distinct points, and for every point its index among them."""
    near = WELD_DISTANCE * float(np.ptp(points, axis=0).max())
    single, of_point = np.unique(points, axis=0, return_inverse=True)
    tree = cKDTree(single)
    neighbours = tree.count_neighbors(tree, near) / len(points)
    if neighbours > MAX_COINCIDENT:
        raise SceneError(
            f"the surface has {neighbours:.3g} points within {near:.3g} m of each other; the "
            f"maximum is {MAX_COINCIDENT}: its details are too small for its size. Look for stray "
            "points."
        )
    pairs = tree.query_pairs(near, output_type="ndarray")
    number = connected(len(single), *pairs.T)[of_point.ravel()]
    return np.unique(number, return_index=True)[1], number


def volume_of(mesh: Mesh) -> float:
    """m^3 inside; 0 without triangles."""
    return ShapeMesh(*mesh).volume if len(mesh[1]) else 0.0


def _merged(rig: Rig, parts: Array) -> tuple[Integers, int]:
    """`owners` and `leader` of the division.

    parts  (n,) each joint's part of the volume
    """
    owners, parts = np.arange(len(parts)), parts.copy()
    for joint in range(len(owners) - 1, 0, -1):
        if parts[joint] < MIN_VOLUME:
            parent = int(rig.parents[joint])
            owners[owners == joint] = parent
            parts[parent] += parts[joint]
    top = leader = 0
    while parts[top] < MIN_ROOT_VOLUME:
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
    """The closed part of each joint, which may be empty, and the same with domes if `domed`."""
    beyond = _beyond(rig.parents)
    share = surface.weights @ beyond - BEYOND_WEIGHT
    below = [np.flatnonzero(_parents(rig, owners) == joint) for joint in range(len(owners))]
    share[:, owners != np.arange(len(owners))] = -BEYOND_WEIGHT
    last = (share > 0.0).cumsum(axis=1).argmax(axis=1)  # beyond which a vertex lies, or the root
    of_vertex = last[surface.faces]
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
    rims = {
        joint: loops_of(rims_of(faces[beyond[of_face, joint] > 0.0]))
        for joint in np.unique(of_face).tolist()
        if rig.parents[joint] >= 0
    }
    caps = {joint: fans(points, loops) for joint, loops in rims.items()}
    pieces, domed_pieces = [], []
    for joint in range(len(owners)):
        parts = [(points, faces[of_face == joint])]
        parts += [(caps[d][0], caps[d][1][:, ::-1]) for d in below[joint] if d in caps]
        pieces.append(joined([*parts, caps[joint]] if joint in caps else parts))
        if domed and joint in rims:
            dome = domes(points, rims[joint], rig.position[joint])
            domed_pieces.append(joined([*parts, dome]))
        else:
            domed_pieces.append(pieces[-1])
    return pieces, domed_pieces


def _beyond(parents: Integers) -> Array:
    """(n, n) 1 if the joint of the row is that of the column or its descendant, else 0."""
    found = np.eye(len(parents))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            found[joint] += found[parent]
    return found


def _parents(rig: Rig, owners: Integers) -> Integers:
    """(n,) the moving parent of each moving joint; -1 for the root and for other joints."""
    moves = owners == np.arange(len(owners))
    return np.where(moves & (rig.parents >= 0), owners[rig.parents], -1)


def _cut(triangle: Array, heights: list[Array]) -> Array:
    """(k, 3) the part of a triangle in which all linear functions, (3,) at its corners, are
    positive."""
    share = np.eye(3)
    for height in heights:
        share = _clipped(share, share @ height)
    return share @ triangle


def _clipped(polygon: Array, height: Array) -> Array:
    """The part of a convex polygon (k, m) in which a linear function, (k,) there, is positive.

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


def joined(parts: Sequence[Mesh]) -> Mesh:
    """Triangles of several meshes as one mesh, without coincident pairs of opposite winding."""
    corners = np.concatenate([points[faces].reshape(-1, 3) for points, faces in parts])
    points, number = np.unique(corners, axis=0, return_inverse=True)
    faces = number.reshape(-1, 3)
    same, which = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    sheets = np.bincount(which.ravel(), minlength=len(same)) > 1
    kept = faces[~sheets[which.ravel()]]
    used, renumbered = np.unique(kept, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3)

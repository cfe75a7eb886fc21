"""A surface as a closed one: points that are one are welded, and holes are closed."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from flowborne.characters.colours import PLAIN
from flowborne.characters.rig import Array, Integers, Surface
from flowborne.errors import SceneError
from flowborne.shapes.closing import SMALL_HOLE, across_of, fans, loops_of, rims_of, wound
from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.shape import Mesh

SAME = 1e-7
"""Points this close, relative to the size of the surface, are one."""

CROWDED = 50
"""Points that may be one, on average."""

RINGS = 6
"""Rings of triangles of a dome, 15 degrees each in a half ball."""


def closed(surface: Surface, name: str, fill: bool = False) -> tuple[Surface, tuple[float, ...]]:
    """The surface with every point once, no triangle without an area, all triangles of a part
    wound alike, and its holes closed by fans about their middles.

    fill     whether holes wider than SMALL_HOLE of the surface's size are closed, too
    returns  the surface, and m across each hole that was closed
    raises   SceneError where a hole is left open
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
        ways = "Close them by --fill, or" if volume_of((every, whole)) > 0.0 else "Close them"
        raise SceneError(
            f"{name}: the surface is not watertight: {len(rims)} edges have a triangle on one side "
            f"alone. Holes wider than {SMALL_HOLE:.0%} of it: {len(wide)}, the widest "
            f"{across[widest]:.3g} m across, at ({x:.4g}, {y:.4g}, {z:.4g}) m. {ways} in Blender "
            "(Mesh, Clean Up, Fill Holes), or leave out meshes that have no inside."
        )
    means = [weights[loop].mean(axis=0, keepdims=True) for loop in loops]
    colours = np.concatenate([surface.colours[kept], np.full((len(lids), 3), PLAIN)])
    return Surface(every, whole, np.concatenate([weights, *means]), colours), tuple(across)


def domes(points: Array, loops: list[Integers], centre: Array) -> Mesh:
    """As `fans`, but each rim around a joint is closed by a dome about it, so that two bodies with
    one in the other part neither at the rim nor beneath it as the joint turns.

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
        away = start - about
        height, radius = away @ normal, np.linalg.norm(away, axis=1)
        side = away - height[:, None] * normal
        side /= np.maximum(np.linalg.norm(side, axis=1), np.finfo(float).tiny)[:, None]
        tilt = np.arccos(np.clip(height / np.maximum(radius, np.finfo(float).tiny), -1.0, 1.0))
        ring = rim
        for share in np.arange(1, RINGS) / RINGS:
            angle, far = ((1.0 - share) * tilt)[:, None], (1.0 - share) * radius[:, None]
            far = far + share * radius.mean()
            corners.append(about + far * (np.sin(angle) * side + np.cos(angle) * normal))
            above = count + np.arange(len(rim))
            count += len(rim)
            a, b, c, d = np.roll(ring, -1), ring, above, np.roll(above, -1)
            faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
            ring = above
        corners.append((about + radius.mean() * normal)[None])
        tip = np.full(len(rim), count)
        count += 1
        faces.append(np.stack([np.roll(ring, -1), ring, tip], axis=1))
    return np.concatenate(corners), np.concatenate(faces)


def weld(points: Array) -> tuple[Integers, Integers]:
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


def volume_of(mesh: Mesh) -> float:
    """m^3 inside; 0 without triangles."""
    return ShapeMesh(*mesh).volume if len(mesh[1]) else 0.0

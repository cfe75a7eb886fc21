"""Thickness of a body of triangles, and length of its tips."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.kernels.thickness import Cells, any_within, by_cells, way_inward

RIM_SHARE = 0.05
"""Share of the area of a surface that may be thinner: around rims, where both sides meet."""

CLEARANCE = 0.95
"""Least distance of the surface from the centre of a ball that fits, in radii; facets are flat."""

BALL_DIAMETERS = 1.0, 0.05
"""Balls that must fit, in widths; the centre of the large one may lie beyond a thin part."""

MOST_FACETS = 1e5
"""Approximate number of pieces of a surface in the search for tips."""


def thinnest(vertices: Array, triangles: Integers, slab: bool, way: Array | None = None) -> float:
    """Thickness in m that a closed surface has everywhere except on `RIM_SHARE` of its area.

    vertices, triangles  (n, 3) m; (k, 3) outward
    slab                 whether its faces across z are cuts and do not count
    way                  the result of `way_inward`, if known
    """
    normal = outward(vertices[triangles])
    area = np.linalg.norm(normal, axis=1)
    if slab:
        area[across(normal)] = 0.0
    way = way_inward(vertices, triangles) if way is None else way
    order = np.argsort(way)
    part = np.cumsum(area[order]) / area.sum()
    return float(way[order][np.searchsorted(part, RIM_SHARE)])


def thin_parts(
    vertices: Array, triangles: Integers, width: float, thickened: Mask | None = None
) -> float:
    """Length of the tips of a body along its surface, where no ball of diameter `width` m fits, m.

    For a wedge of angle a it is half the width over tan(a / 2). The error is a third of the width;
    bodies that would need more than `MOST_FACETS` have a coarser result, which is rather too short.
    It is 0 when the ball fits nowhere: such a body is thin, and has no tips.

    vertices, triangles  (n, 3) m; (k, 3) outward. For a prism its sides, without its ends
    thickened            (k,) triangles beneath which the ball always fits
    """
    if width <= 0.0:
        return 0.0
    corners = vertices[triangles]
    area = 0.5 * float(np.linalg.norm(outward(corners), axis=1).sum())
    edge = max(0.5 * width, 2.0 * np.sqrt(area / MOST_FACETS))
    sure = np.zeros((0, 3, 3)) if thickened is None else divided(corners[thickened], edge)
    facets = divided(corners if thickened is None else corners[~thickened], edge)
    if not len(facets):
        return 0.0
    edge = max(edge, float(side_lengths(facets).max()))
    cells = by_cells(vertices, triangles)
    fits = np.ones(len(facets), bool)
    for part in BALL_DIAMETERS:
        fits[fits] = ball_fits(facets[fits], vertices, triangles, cells, part * width)
    if not fits.any() and not len(sure):
        return 0.0
    touched = cKDTree(np.concatenate([sure, facets[fits]]).mean(axis=1))
    beyond = touched.query(facets[~fits].reshape(-1, 3))[0].max(initial=0.0)
    return max(0.0, float(beyond) - 0.5 * edge)


def ball_fits(
    facets: Array, vertices: Array, triangles: Integers, cells: Cells, width: float
) -> Mask:
    """(k,) whether a ball of diameter `width` m beneath the middle of a facet clears the surface.

    facets               (k, 3, 3) corners of pieces of its triangles, m
    vertices, triangles  (n, 3) m; (k, 3) outward
    cells                of these triangles
    """
    normal = outward(facets)
    length = np.linalg.norm(normal, axis=1)[:, None]
    centre = facets.mean(axis=1) - 0.5 * width * normal / np.maximum(length, np.finfo(float).tiny)
    return ~any_within(centre, 0.5 * width * CLEARANCE, vertices, triangles, cells)


def divided(facets: Array, longest: float) -> Array:
    """(n, 3, 3) triangles (k, 3, 3), with longest sides halved until none is above `longest` m.

    More than four times `MOST_FACETS` at once, as from slivers, are not divided further.
    """
    done = [facets[:0]]
    while len(facets):
        side = side_lengths(facets)
        long = (side.max(axis=1) > longest) & (len(facets) <= 4.0 * MOST_FACETS)
        done.append(facets[~long])
        first = side[long].argmax(axis=1)[:, None] + np.arange(3)
        a, b, c = np.moveaxis(np.take_along_axis(facets[long], first[:, :, None] % 3, 1), 1, 0)
        middle = 0.5 * (a + b)
        halves = np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)
        facets = np.concatenate(halves)
    return np.concatenate(done)


def side_lengths(facets: Array) -> Array:
    """(k, 3) lengths of the sides of triangles (k, 3, 3), m."""
    return np.asarray(np.linalg.norm(np.roll(facets, -1, axis=1) - facets, axis=2))


def sides(vertices: Array, triangles: Integers) -> Integers:
    """(m, 3) triangles of the surface of a body in a slab, without its cuts across z."""
    return triangles[~across(outward(vertices[triangles]))]


def across(normal: Array) -> Mask:
    """(k,) whether triangles of normals (k, 3) lie across z."""
    return np.asarray(np.abs(normal[:, 2]) > 0.5 * np.linalg.norm(normal, axis=1))


def split_quads(a: Integers, b: Integers, c: Integers, d: Integers) -> Integers:
    """(2 k, 3) triangles a b c, then a c d, of quadrangles with corners (k,) in order."""
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def connected(count: int, one: Integers, other: Integers) -> Integers:
    """(count,) number of the connected part of each item; `one` and `other` (k,) are linked."""
    links = coo_array((np.ones(len(one)), (one, other)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1])


def outward(facets: Array) -> Array:
    """(k, 3) normals of triangles (k, 3, 3) with twice their areas as lengths, m^2."""
    return np.cross(facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0])

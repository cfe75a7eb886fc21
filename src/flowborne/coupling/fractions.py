"""Where bodies close the faces of the grid, and what pressure in each cell does to them.

Method: docs/method/cut-cells.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flowborne.coupling.flesh import Skins, face_centres, piece_of, skin_at
from flowborne.coupling.images import Images, displaced, periods
from flowborne.coupling.overlaps import handed_on
from flowborne.coupling.shapes import Shapes
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import PRESCRIBED, Array, Faces, Integers, Mask, Rows
from flowborne.kernels.closed_fractions import (
    Piece,
    close_faces,
    count_beside,
    open_cells,
    share_closed,
)
from flowborne.kernels.coupling_rows import (
    COVERED,
    NARROW,
    ClosedParts,
    flesh_rows,
    kinds_of_cells,
    list_cells,
)
from flowborne.kernels.cut_faces import other_axes
from flowborne.kernels.edge_crossings import (
    PIECES,
    Crossings,
    Placed,
    cross_geometry,
    merge_crossings,
    new_crossings,
    together,
)
from flowborne.kernels.node_distance import BAND, NEAR, lower_to_body, merge, node_box
from flowborne.kernels.skin import cross_skin, sample_skin

OTHER_AXES = np.array([other_axes(d) for d in range(3)])
"""(3, 2) the axes along a face, for each axis that it may be across."""


@dataclass(frozen=True)
class Geometry:
    """The bodies on the grid at one instant.

    Fleshes are numbered on after the bodies. What moves the bodies and the skins, the "motion", is
    the twist of every body and then the velocity of every vertex of flesh.

    distance   (nx+1, ny+1, nz+1) to the nearest body at the nodes, m, at most BAND cells
    nearest    (nx+1, ny+1, nz+1) that body
    crossings  of the edges with the nearest body
    open       open fraction of each face
    volume     (nx, ny, nz) open volume of each cell, m^3
    closed     parts of faces
    rows       of J, m of them: of the cells beside closed parts, one per cell and body; of flesh,
               one per cell and face; then one per cell that lends its pressure to covered ones, see
               `overlaps`. Columns are entries of the motion: 6 body + component, then 3 vertex +
               component; values what unit pressure in the cell exerts on each: wrench about the
               origin, force; m^2
    owner      (m,) the body; -1 of the last ones, whose area is 0
    area       (m, 3) area vector of the row's closed parts, m^2: force of unit pressure
    skins      the skins at the nodes
    images     of bodies across periodic sides
    """

    distance: Array
    nearest: Integers
    crossings: Crossings
    open: Faces
    volume: Array
    closed: ClosedParts
    rows: Rows
    owner: Integers
    area: Array
    skins: Skins
    images: Images


def beside_sides(grid: Grid, boundaries: Boundaries) -> Integers:
    """(nx, ny, nz) how many sides that prescribe the flux bound each cell."""
    beside = np.zeros(grid.shape, np.int64)
    for place, side in boundaries.around(grid):
        beside[place.layer] += side.normal == PRESCRIBED
    return beside


def around_bodies(
    shapes: Shapes,
    position: Array,
    rotation: Array,
    boxes: Array,
    skins: Skins,
    grid: Grid,
    boundaries: Boundaries,
) -> Iterator[Piece]:
    """All bodies and fleshes, and their images, that reach the grid.

    boxes  see `body_boxes`
    """
    placed, shape = shapes.placed(position, rotation), np.array(grid.shape)
    for body, geoms in shapes.geoms.items():
        for image in displaced(grid, boundaries, *boxes[body]):
            box = node_box(geoms, position, rotation, shapes.reach, image.nodes, shape)
            if grid.is_slab:
                box[2] = 0, 2
            if np.all(box[:, 1] - box[:, 0] >= 2):
                yield piece_of_body(body, shapes, placed, geoms, box, image)
    yield from skins.pieces


def piece_of_body(
    body: int, shapes: Shapes, placed: list[Placed], geoms: Integers, box: Integers, grid: Grid
) -> Piece:
    """A body on a grid: the union of its geometries."""
    skinned = [g for g in geoms if g in shapes.skins]
    phi = sampled(placed, [g for g in geoms if g not in shapes.skins], box, grid)
    for g in skinned:
        np.minimum(phi, skin_distance(shapes, placed, g, box, grid), out=phi)
    found = new_crossings(phi, grid.spacing, grid.is_slab)
    used, nodes = np.zeros(1, np.int64), grid.nodes
    for g in geoms:
        if g not in shapes.skins or shapes.sheets[g]:
            cross_geometry(found, used, phi, box, placed[g], int(g), nodes)
    for g in skinned:
        pieces = int(g) * PIECES + shapes.pieces[g]
        skin = at_place(shapes, placed, g), shapes.skins[g][1], pieces
        cross_skin(found, used, phi, *skin, box, nodes)
    return piece_of(body, grid, box, phi, found)


def body_boxes(shapes: Shapes, position: Array, rotation: Array, bodies: int) -> Array:
    """(bodies, 2, 3) lowest and highest corner of the box around each body's geometries, m; 0 of a
    body without any."""
    reach, boxes = np.einsum("gij,gj->gi", np.abs(rotation), shapes.reach), np.zeros((bodies, 2, 3))
    low, high = position - reach, position + reach
    for body, own in shapes.geoms.items():
        boxes[body] = low[own].min(axis=0), high[own].max(axis=0)
    return boxes


def join_ends(values: Array, axis: int) -> None:
    """Make what is open, or the distances, on both sides across a periodic axis alike, in place."""
    first, last = edge(axis, 0), edge(axis, -1)
    values[first] = values[last] = np.minimum(values[first], values[last])


def sampled(placed: list[Placed], geoms: list[int], box: Integers, grid: Grid) -> Array:
    """(box shape) distance to the nearest of some geometries at the nodes of a box, m."""
    phi = np.full(box[:, 1] - box[:, 0], BAND * grid.spacing)
    for g in geoms:
        lower_to_body(phi, box, placed[g], grid.nodes)
    return phi


def at_place(shapes: Shapes, placed: list[Placed], geom: int) -> Array:
    """(n, 3) vertices of a geometry with a skin, m."""
    return np.asarray(placed[geom].position + shapes.skins[geom][0] @ placed[geom].rotation.T)


def skin_distance(
    shapes: Shapes, placed: list[Placed], geom: int, box: Integers, grid: Grid
) -> Array:
    """(box shape) distance to a geometry with a skin at the nodes of a box, m.

    In a slab that to the triangles themselves; in a room the same within NEAR cells, and farther
    away what its table has; the smaller of both where that is of sheets.
    """
    vertices, faces = at_place(shapes, placed, geom), shapes.skins[geom][1]
    band, h = BAND if grid.is_slab else NEAR, grid.spacing
    near = sample_skin(vertices, faces, box, grid.nodes, band)
    if grid.is_slab:
        return near
    far = sampled(placed, [geom], box, grid)
    beyond = np.copysign(np.maximum(np.abs(far), NEAR * h), near)
    found = np.where(np.abs(near) < NEAR * h, near, beyond)
    return np.minimum(found, far) if shapes.sheets[geom] else found


def geometry(
    shapes: Shapes,
    position: Array,
    rotation: Array,
    skins: Skins,
    first_skin: int,
    grid: Grid,
    boundaries: Boundaries,
) -> Geometry:
    """Cut the grid by bodies and flesh.

    position, rotation  (ng, 3), (ng, 3, 3) where the geometries stand, in the order of `shapes`
    skins, first_skin   of the fleshes, and the number of bodies
    """
    nx, ny, nz = grid.shape
    flat = grid.is_slab
    h, area = grid.spacing, grid.face_area
    normal = boundaries.normal()
    distance = np.full((nx + 1, ny + 1, nz + 1), BAND * h)
    nearest = np.zeros((nx + 1, ny + 1, nz + 1), np.int64)
    beside = beside_sides(grid, boundaries)
    ox, oy, oz = opened = [np.ones(grid.face_shape(d)) for d in range(3)]
    total = grid.zeros_faces()
    corners = body_boxes(shapes, position, rotation, first_skin)
    pieces = list(around_bodies(shapes, position, rotation, corners, skins, grid, boundaries))
    boxes = np.array([piece.box for piece in pieces], np.int64).reshape(-1, 3, 2)
    crossings = together(distance.shape, [piece.crossings for piece in pieces])
    for piece in pieces:
        merge(distance, nearest, piece.distance, piece.box, piece.body)
        bodies = 1 + int(piece.body >= first_skin)  # a skin may fold onto itself
        count_beside(beside, piece.distance, piece.box, bodies)
    around = [d for d in range(3) if boundaries.periodic()[d]]
    for d in around:
        join_ends(distance, d)
    first = 0
    for piece in pieces:
        alone = piece.crossings.at, piece.distance, piece.box
        merge_crossings(crossings.at, crossings.part, distance, *alone, first)
        first += piece.crossings.part.size
        for d in grid.axes:
            close_faces(piece, total[d], d)
    listed, of = [(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 2)))], [(0, 0)]
    for piece in pieces:
        for d in grid.axes:
            faces = opened[d], total[d], distance, crossings, beside
            listed.append(share_closed(piece, *faces, d, normal[d]))
            of.append((d, piece.body))
    for d in around:
        join_ends(opened[d], d)
    face, closed, centre = map(np.concatenate, zip(*listed, strict=True))
    axis, part_body = np.repeat(np.transpose(of), [part.size for _, part, _ in listed], axis=1)
    kind = kinds_of_cells(ox, oy, oz, normal, boxes)
    with_rows = kind >= NARROW
    bones = [piece for piece in pieces if piece.body < first_skin]
    middles = np.concatenate([corners.mean(axis=1), skins.middle])
    images = Images(periods(grid, boundaries), middles)
    place, index = face_centres(axis, face, grid)
    first = int(np.searchsorted(part_body, first_skin))
    place[np.arange(first)[:, None], OTHER_AXES[axis[:first]]] += h * centre[:first]
    place = images.at_bodies(place, part_body)
    rows = bone_rows(bones, with_rows)
    common = bone_rows([] if boundaries.has_free_side(grid) else bones, kind == COVERED)
    if flat:
        oz[:] = 0.0
    volume = np.full(grid.shape, grid.cell_volume)
    open_cells(volume, grid.cell_volume, distance, crossings, (ox, oy, oz), boxes)
    owner, force = rows[2][::6] // 6, rows[3].reshape(-1, 6)[:, :3]
    corner, weight = np.zeros((0, 3), np.int64), np.zeros((0, 3))
    if first < len(face):
        corner, weight = skin_at(skins, place[first:], grid)
        skin = axis[first:], index[first:], closed[first:], corner, weight, 6 * first_skin, area
        part, of_skin = flesh_rows(*skin, with_rows)
        across = (of_skin[2][::3] - 6 * first_skin) % 3
        push = of_skin[3].reshape(-1, 3).sum(axis=1)[:, None] * np.eye(3)[across]
        owner = np.append(owner, part_body[first:][part])
        force = np.concatenate([force, push])
        rows = joined(rows, of_skin)
        if common[0].size:
            beside_bones = np.zeros(grid.shape, bool)
            beside_bones.flat[common[0]] = True
            common = joined(common, flesh_rows(*skin, beside_bones)[1])
    if common[0].size:
        columns = 6 * first_skin + skins.vertices.size
        lent = handed_on(common, kind, columns, boundaries.periodic())
        owner = np.append(owner, np.full(lent[0].size, -1))
        force = np.concatenate([force, np.zeros((lent[0].size, 3))])
        rows = joined(rows, lent)
    closed_parts = ClosedParts(axis, face, part_body, closed, place, corner, weight)
    cut = distance, nearest, crossings, (ox, oy, oz), volume
    return Geometry(*cut, closed_parts, rows, owner, force, skins, images)


def bone_rows(bones: list[Piece], listed: Mask) -> Rows:
    """Rows of J of bones in listed cells (nx, ny, nz)."""
    none = np.zeros((0, 6), np.int64)
    cells, columns, values = [np.zeros(0, np.int64)], [none], [np.zeros((0, 6))]
    for bone in bones:
        own, wrench = list_cells(bone, listed)
        cells.append(own)
        columns.append(np.full(wrench.shape, 6 * bone.body + np.arange(6)))
        values.append(wrench)
    found, column, value = np.concatenate(cells), np.concatenate(columns), np.concatenate(values)
    return found, 6 * np.arange(found.size + 1), column.ravel(), value.ravel()


def joined(rows: Rows, more: Rows) -> Rows:
    """Rows of J and more of them."""
    cells, start, columns, values = more
    return (
        np.append(rows[0], cells),
        np.append(rows[1], rows[1][-1] + start[1:]),
        np.append(rows[2], columns),
        np.append(rows[3], values),
    )

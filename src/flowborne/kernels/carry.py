"""One component of the velocity through a step on moving control volumes: all its substeps.

A slab is a room one layer thick along its first axis, as in `flux`. Indices of control volumes are
flat; lists of them are in ascending order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from flowborne.kernels.arrays import (
    FREE,
    PERIODIC,
    PRESCRIBED,
    Array,
    FaceGrid,
    Integers,
    Marks,
    Three,
)
from flowborne.kernels.control_volumes import (
    Closed,
    Transfers,
    fill_empty,
    indices,
    join_small,
    level,
    mark_cut,
    share_velocity,
    stride,
)
from flowborne.kernels.dye import face_of
from flowborne.kernels.face_masses import add_transfers, give
from flowborne.kernels.faces import flat
from flowborne.kernels.flux import (
    CLEAR,
    CUT,
    GHOSTS,
    UPSTREAM,
    Fluxes,
    Padded,
    Stage,
    in_line,
    pad_field,
    stage,
)
from flowborne.kernels.jit import kernel
from flowborne.kernels.lists import merged, place_of

AXIS, UPPER, NORMAL, TANGENTIAL, SUPPLIES, FIRST, IRROTATIONAL = range(7)
"""Columns of the table of sides: where the side lies, a of the velocity across and along it and
whether it supplies fluid (see `fluid.sides.side`), where its layer begins in packed layers, and
whether what comes in through a free side has `Sides.change` more beyond it than inside."""


class Sides(NamedTuple):
    """The sides of the domain to one component.

    table   (n, 7) integers, one row for each side
    wall    (substeps + 1, k) packed layers of what they prescribe when each begins and ends
    change  (k,) see IRROTATIONAL
    rate    (k,) volume per time that comes in
    share   (k,) of each control volume in the volume of its layer
    """

    table: Integers
    wall: Array
    change: Array
    rate: Array
    share: Array


class Volumes(NamedTuple):
    """Control volumes of one component in a step.

    cells            volumes of the cells at its start
    before, after    volumes that move with them at both ends
    cut              (n,) those that are cut at one of them
    was_shut, shut   closed ones at both ends
    faces            whose they are
    nothing          volume up to which one holds nothing
    """

    cells: Array
    before: Array
    after: Array
    cut: Integers
    was_shut: Closed
    shut: Closed
    faces: FaceGrid
    nothing: float


class Inlets(NamedTuple):
    """What comes into the control volumes of one component from within, and goes there.

    faces     (n,) flat, each once
    gain      (n,) m^3/s that come in with
    velocity  (n,) m/s
    loss      (n,) m^3/s that leave with the velocity of the fluid there; negative come in with it
    """

    faces: Integers
    gain: Array
    velocity: Array
    loss: Array


@kernel
def share_at_faces(
    cells: Integers, values: tuple[Array, ...], axis: int, shape: Three, ring: int
) -> tuple[Integers, Array]:
    """Half of what comes into each of some cells for both of its faces across an axis: the faces,
    flat and ascending, and (m, n) the sums on them.

    cells   (k,) flat, ascending
    values  m of (k,)
    shape   of the cells
    ring    how many there are along a periodic axis, whose last faces are the first ones; else 0
    """
    both, step, wrapped = np.empty((2, cells.size), np.int64), stride(shape, axis), 0
    plain, around = np.empty(cells.size, np.int64), np.empty(cells.size, np.int64)
    for n in range(cells.size):
        both[0, n] = face_of(shape, axis, cells[n], 0)
        both[1, n] = plain[n - wrapped] = both[0, n] + step
        if ring > 0 and indices(shape, cells[n])[axis] == ring - 1:
            both[1, n] = around[wrapped] = both[1, n] - ring * step
            wrapped += 1
    index = merged(merged(both[0], plain[: cells.size - wrapped])[0], around[:wrapped])[0]
    sums, near = np.zeros((len(values), index.size)), 0
    for faces in both:
        for n in range(cells.size):
            near = place_of(index, faces[n], near)
            for m in range(len(values)):
                sums[m, near] += 0.5 * values[m][n]
    return index, sums


class Exchange(NamedTuple):
    """What control volumes exchange: through their sides, with the outside and with each other."""

    flux: Fluxes
    sides: Sides
    inlets: Inlets
    given: Transfers


class Scratch(NamedTuple):
    """Arrays that a step is done in, without meaning before and after it: like the padded velocity
    and like the velocity; `nought` is 0 before and after."""

    padded: Padded
    kept: Array
    start: Array
    middle: Array
    early: Array
    late: Array
    nought: Array


@kernel
def layer(
    row: Integers, field: Array | Marks, shape: Three
) -> tuple[int, int, int, int, int, int, int]:
    """Where the layer of a padded field inside a side lies: its first element, the steps outwards
    and along the other two axes, the numbers along them, and along its own."""
    strides, axis, first = np.empty(3, np.int64), row[AXIS], 0
    strides[0], strides[1], strides[2] = field.shape[1] * field.shape[2], field.shape[2], 1
    for a in range(3):
        first += strides[a] * ((field.shape[a] - shape[a]) // 2)
    one, other = int(axis == 0), 2 - int(axis == 2)
    outward = -strides[axis]
    if row[UPPER]:
        first += strides[axis] * (shape[axis] - 1)
        outward = strides[axis]
    return first, outward, strides[one], strides[other], shape[one], shape[other], shape[axis]


@kernel
def fill_ghosts(field: Array, sides: Sides, time: int, faces: FaceGrid) -> None:
    """Set the two layers of ghosts around a padded field, u_ghost = a u_inside + b, in place;
    corners are left alone.

    Along a side whose flux is prescribed the second ghost is of the second layer inside. Elsewhere
    both are of the first one: beyond free sides and, with a = 1, across the component's own ones.

    time  row of what the sides prescribe
    """
    flat = field.reshape(-1)
    for s in range(sides.table.shape[0]):
        row = sides.table[s]
        own, first = row[AXIS] == faces.component, row[FIRST]
        start, out, one, other, n, m, length = layer(row, field, faces.shape)
        period = (length - int(own)) * out
        factor = 1.0 if own else float(row[TANGENTIAL])
        inward = out if row[NORMAL] == PRESCRIBED and not own else 0
        for i in range(n):
            for j in range(m):
                at = start + i * one + j * other
                if row[NORMAL] == PERIODIC:
                    flat[at + out] = flat[at + out - period]
                    flat[at + 2 * out] = flat[at + 2 * out - period]
                else:
                    b = 2.0 * sides.wall[time, first + i * m + j] if factor < 0.0 else 0.0
                    flat[at + out] = factor * flat[at] + b
                    flat[at + 2 * out] = factor * flat[at - inward] + b


@kernel
def mark_volumes(marks: Marks, cut: Integers, sides: Sides, faces: FaceGrid) -> None:
    """Padded marks of the control volumes: CLEAR where no cut one is among the next GHOSTS along an
    axis, UPSTREAM on a free side of the domain, where means would draw in ever more, else CUT."""
    flat = marks.reshape(-1)
    flat[:] = CLEAR
    mark_cut(marks, cut, faces.shape, faces.wraps, GHOSTS)
    for s in range(sides.table.shape[0]):
        row = sides.table[s]
        start, out, one, other, n, m, length = layer(row, marks, faces.shape)
        own = row[AXIS] == faces.component
        period = (length - int(own)) * out
        for a in range(n):
            for b in range(m):
                at_side = start + a * one + b * other
                if row[NORMAL] == PERIODIC:
                    if own and not row[UPPER]:  # the last faces are the first ones
                        flat[at_side - period] = flat[at_side]
                    flat[at_side + out] = flat[at_side + out - period]
                    flat[at_side + 2 * out] = flat[at_side + 2 * out - period]
                    continue
                flat[at_side + out] = flat[at_side + 2 * out] = CUT
                if own:
                    flat[at_side] = UPSTREAM if row[NORMAL] == FREE else CUT


@kernel
def add_side_rates(total: Array, flux: Fluxes, axis: int, listed: Integers, shape: Three) -> None:
    """Add volume per time that leaves listed control volumes through their sides across an axis,
    in place."""
    q, component = flux.through[axis], flux.component
    own, through = int(axis == component), q.reshape(-1)
    place, share = flux.place[own], flux.share[own]
    along, step = stride(q.shape, component), stride(q.shape, axis)
    for n in range(listed.size):
        i, j, k = at = indices(shape, listed[n])
        first = (i * q.shape[1] + j) * q.shape[2] + k - at[component] * along
        for upper in range(2):
            line = at[component] + upper * own
            begin = first + upper * step * (1 - own)
            rate = share[line, 0] * through[begin + place[line, 0] * along]
            rate += share[line, 1] * through[begin + place[line, 1] * along]
            total[n] += max((2 * upper - 1) * rate, 0.0)


@kernel
def what_flows_out(exchange: Exchange, listed: Integers, shape: Three) -> Array:
    """(n,) volume per time that leaves listed control volumes through their sides, inlets and
    transfers."""
    total, inlets, given = np.zeros(listed.size), exchange.inlets, exchange.given
    for axis in range(3):
        if shape[axis] > 1:
            add_side_rates(total, exchange.flux, axis, listed, shape)
    for faces, out, sign in (
        (inlets.faces, inlets.loss, 1.0),
        (given.givers, given.volume, 1.0),
        (given.takers, given.volume, -1.0),
    ):
        at = 0
        for m in range(faces.size):
            at = place_of(listed, faces[m], at)
            if at < listed.size and listed[at] == faces[m]:
                total[at] += max(sign * out[m], 0.0)
    return total


@kernel
def cross_sides(sides: Sides, flux: Fluxes, cells: Array, faces: FaceGrid) -> None:
    """Set what comes in through each side with each control volume beside it, and their shares in
    the volume of their layer, in place. The last faces along a periodic axis count as none.

    cells  volumes
    """
    at, (component, shape, wraps) = np.empty(3, np.int64), faces
    for s in range(sides.table.shape[0]):
        row = sides.table[s]
        axis, upper, first = row[AXIS], row[UPPER], row[FIRST]
        if row[NORMAL] == PERIODIC:
            continue
        q, total = flux.through[axis], 0.0
        one, other = int(axis == 0), 2 - int(axis == 2)
        for a in range(shape[one]):
            for b in range(shape[other]):
                at[one], at[other], at[axis] = a, b, upper * (shape[axis] - 1)
                line, n, through, held = at[component], first + a * shape[other] + b, 0.0, 0.0
                if wraps[component] > 0 and line == wraps[component]:
                    continue
                for m in range(2):
                    at[component], part = flux.place[0, line, m], flux.share[0, line, m]
                    at[axis] = min(at[axis], cells.shape[axis] - 1)
                    held += part * cells[at[0], at[1], at[2]]
                    at[axis] = upper * (q.shape[axis] - 1)
                    if axis != component:
                        through += part * q[at[0], at[1], at[2]]
                if axis == component:
                    through = q[at[0], at[1], at[2]]
                sides.rate[n] = (1.0 - 2.0 * upper) * through
                sides.share[n] = held
                total += held
        for n in range(first, first + shape[one] * shape[other]):
            sides.share[n] /= max(total, 1e-300)


@kernel
def draw_in(padded: Padded, sides: Sides, shape: Three) -> float:
    """Give what comes in through free sides its velocity, the mean of the layer beside it or one
    without vorticity, in the ghosts of a padded field; gives volume x velocity that comes in
    through all sides per time."""
    field, came = padded.values, 0.0
    flat, mark = field.reshape(-1), padded.marks.reshape(-1)
    for s in range(sides.table.shape[0]):
        row = sides.table[s]
        first, free = row[FIRST], row[NORMAL] == FREE
        if row[NORMAL] == PERIODIC:
            continue
        start, out, one, other, n, m, _ = layer(row, field, shape)
        mean = 0.0
        for a in range(n if free else 0):
            for b in range(m):
                mean += sides.share[first + a * m + b] * flat[start + a * one + b * other]
        for a in range(n):
            for b in range(m):
                at, rate = start + a * one + b * other, sides.rate[first + a * m + b]
                upstream = mark[at] == UPSTREAM
                if free and rate > 0.0:
                    if row[IRROTATIONAL]:
                        flat[at + out] = flat[at] + sides.change[first + a * m + b]
                    else:
                        flat[at + out] = mean if upstream else 2.0 * mean - flat[at]
                near, far = flat[at], flat[at + out]
                if upstream:
                    came += rate * (far if rate > 0.0 else near)
                else:
                    came += rate * (0.5 * (near + far))
    return came


@kernel
def hold(u: Array, volume: Array, sides: Sides, time: int, faces: FaceGrid) -> float:
    """Give the faces of inflows across the component their own velocity, in place; gives volume
    times what that changes it by.

    Their ghosts hold what they do: left alone, they would grow away from those beside them, by
    exp(1) while the flow crosses a cell.
    """
    flat, volumes, given = u.reshape(-1), volume.reshape(-1), 0.0
    for s in range(sides.table.shape[0]):
        row = sides.table[s]
        if not row[SUPPLIES] or row[AXIS] != faces.component:
            continue
        start, _, one, other, n, m, _ = layer(row, u, faces.shape)
        for a in range(n):
            for b in range(m):
                at, wanted = start + a * one + b * other, sides.wall[time, row[FIRST] + a * m + b]
                given += volumes[at] * (wanted - flat[at])
                flat[at] = wanted
    return given


@kernel
def empty_at_walls(now: Stage, sides: Sides, faces: FaceGrid) -> float:
    """Take from the faces of prescribed sides across the component what is left in control volumes
    that a body has filled, in place; gives what that changes volume times velocity by."""
    flat, volumes, given = now.later.reshape(-1), now.volume.reshape(-1), 0.0
    for s in range(sides.table.shape[0]):
        row = sides.table[s]
        if row[NORMAL] != PRESCRIBED or row[AXIS] != faces.component:
            continue
        start, _, one, other, n, m, _ = layer(row, now.later, faces.shape)
        for a in range(n):
            for b in range(m):
                at = start + a * one + b * other
                if volumes[at] <= now.nothing:
                    given -= flat[at]
                    flat[at] = 0.0
    return given


@kernel
def join(u: Array, axis: int) -> None:
    """Make the last layer across an axis the first one, in place."""
    layer, flat = 1, u.reshape(-1)
    for a in range(axis + 1, 3):
        layer *= u.shape[a]
    block = layer * u.shape[axis]
    for first in range(0, flat.size, block):
        for n in range(first, first + layer):
            flat[n + block - layer] = flat[n]


@kernel
def part_of_step(out: Array, start: Array, end: Array, part: float) -> None:
    """start + part (end - start)."""
    one, other, both = flat(start), flat(end), flat(out)
    for i in prange(both.shape[0]):
        for k in range(both.shape[1]):
            both[i, k] = one[i, k] + part * (other[i, k] - one[i, k])


@kernel
def settle(later: Array, high: Array, volumes: Volumes, leaving: Array, nought: Array) -> None:
    """Give what closed control volumes got to their targets, and mix what is too small, in place.

    high     volumes after the stage
    leaving  (n,) volume that leaves each that is cut in the substep
    """
    (shut, targets, _), held = volumes.shut, high.reshape(-1)
    was = np.empty((shut.size, 7))
    for n in range(shut.size):
        was[n, 6] = held[shut[n]]
        for m in range(6):
            was[n, m] = held[targets[n, m]]
    join_small(later, high, volumes.shut, volumes.nothing)
    level(later, high, volumes.cut, leaving, nought, volumes.nothing, volumes.faces)
    for n in range(shut.size):
        held[shut[n]] = was[n, 6]
        for m in range(6):
            held[targets[n, m]] = was[n, m]
    fill_and_follow(later, high, volumes, volumes.shut)


@kernel
def fill_and_follow(u: Array, held: Array, volumes: Volumes, shut: Closed) -> None:
    """Give control volumes that hold nothing the velocity around them, closed ones that of their
    targets, and the last ones of a periodic axis that of the first ones, in place."""
    fill_empty(u, held, volumes.cut, volumes.nothing, volumes.faces)
    share_velocity(u, shut)
    if volumes.faces.wraps[volumes.faces.component] > 0:
        join(u, volumes.faces.component)


@kernel
def pass_inlets(now: Stage, padded: Array, inlets: Inlets, own: Array) -> None:
    """Let through inlets what they bring to a padded field after a stage, in place.

    own  (n,) on return what leaves at each with the fluid's own velocity, per time
    """
    flat, shape = in_line(now), now.later.shape
    for n in range(own.size):
        f = inlets.faces[n]
        i, j, k = indices(shape, f)
        i += (padded.shape[0] - shape[0]) // 2
        own[n] = inlets.loss[n] * padded[i, j + GHOSTS, k + GHOSTS]
        give(flat, f, own[n] - inlets.gain[n] * inlets.velocity[n])


@kernel
def carry(
    out: Array,
    u: Array,
    along: Array,
    rising: float,
    volumes: Volumes,
    exchange: Exchange,
    scratch: Scratch,
    dt: float,
) -> tuple[float, float, Array]:
    """A component a step later, in `out`; gives the volume times velocity that came in through the
    sides, what inflows gave to what was carried to them, and (n,) what left at each inlet.

    u      at the start
    along  what else it is given, velocity per time, times `rising`; on return 0 where it is cut
    dt     s, of each substep
    """
    faces, sides, inlets = volumes.faces, exchange.sides, exchange.inlets
    mark_volumes(scratch.padded.marks, volumes.cut, sides, faces)
    cross_sides(sides, exchange.flux, volumes.cells, faces)
    out_of_cut = dt * what_flows_out(exchange, volumes.cut, faces.shape)
    if rising > 0.0:
        given = along.reshape(-1)
        for f in volumes.cut:
            given[f] = 0.0
        if faces.wraps[faces.component] > 0:
            join(along, faces.component)
    padded, middle, count = scratch.padded, scratch.middle, len(sides.wall) - 1
    start, later = (out, scratch.start) if count % 2 == 0 else (scratch.start, out)
    low = volumes.before
    leaving, drained = np.zeros(inlets.faces.size), np.zeros(inlets.faces.size)
    crossed, held = 0.0, 0.0
    part_of_step(start, u, u, 0.0)
    fill_and_follow(start, low, volumes, volumes.was_shut)
    for s in range(count):
        if s < count - 1:
            high = scratch.late if s % 2 == 0 else scratch.early
            part_of_step(high, volumes.before, volumes.after, (s + 1) / count)
        else:
            high = volumes.after
        for turn in range(2):
            weight = 1.0 - 0.5 * turn
            source, target = (start, middle) if turn == 0 else (middle, later)
            now = Stage(target, scratch.kept, high, weight, dt, volumes.nothing)
            if rising > 0.0 and s + turn > 0:
                pad_field(padded.values, source, along, rising * (s + turn) * dt)
            else:
                pad_field(padded.values, source, source, 0.0)
            fill_ghosts(padded.values, sides, s + turn, faces)
            came = draw_in(padded, sides, faces.shape)
            stage(now, start, low, padded, exchange.flux)
            pass_inlets(now, padded.values, inlets, leaving)
            add_transfers(now, source, exchange.given)
            if turn == 1:
                held += empty_at_walls(now, sides, faces)
            settle(target, high, volumes, out_of_cut, scratch.nought)
            crossed += 0.5 * dt * came
            drained += 0.5 * dt * leaving
        if s < count - 1:
            held += hold(later, high, sides, s + 1, faces)
            start, later, low = later, start, high
    return crossed, held, drained

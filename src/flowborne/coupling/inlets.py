"""What comes into the control volumes from within: through mouths and from sources."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flowborne.coupling.mouths import Jet
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.dye import Brought
from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.transport import NO_INLETS, Inlets
from flowborne.kernels.arrays import Integers


def cells_with_inlets(jets: tuple[Jet, ...], sources: Array) -> Integers:
    """Flat cells into which mouths and sources bring something, ascending."""
    cells = np.flatnonzero(sources)
    for jet in jets:
        cells = np.union1d(cells, jet.cells)
    return cells


def inlets_across(
    axis: int,
    cells: Integers,
    jets: tuple[Jet, ...],
    sources: Array,
    grid: Grid,
    sides: Boundaries,
) -> Inlets:
    """What mouths and sources bring to the control volumes of the faces across `axis`.

    A mouth that drinks, and a source, take or bring fluid as fast as that around.

    cells  see `cells_with_inlets`
    """
    if cells.size == 0:
        return NO_INLETS
    gain, weighted, local = np.zeros(cells.size), np.zeros(cells.size), -sources.reshape(-1)[cells]
    for jet in jets:
        at = np.searchsorted(cells, jet.cells)
        if jet.rate > 0.0:
            gain[at] += jet.rates
            weighted[at] += jet.rates * (jet.skin[axis] + jet.velocity[axis])
        else:
            local[at] -= jet.rates
    index, (gains, speeds, losses) = at_faces(cells, (gain, weighted, local), axis, grid, sides)
    used = (gains != 0.0) | (losses != 0.0)
    index, gains, speeds, losses = index[used], gains[used], speeds[used], losses[used]
    speeds = np.divide(speeds, gains, out=np.zeros(index.size), where=gains != 0.0)
    return Inlets(index, gains, speeds, losses)


def taken_by(
    jet: Jet, axis: int, inlets: Inlets, drained: Array, grid: Grid, sides: Boundaries
) -> float:
    """What a mouth that drinks took of volume times velocity across `axis` in a step, m^4/s."""
    if jet.rate >= 0.0:
        return 0.0
    index, (rates,) = at_faces(jet.cells, (-jet.rates,), axis, grid, sides)
    share, at = np.zeros(inlets.index.size), np.searchsorted(inlets.index, index)
    known = (at < inlets.index.size) & (inlets.index[at.clip(0, inlets.index.size - 1)] == index)
    share[at[known]] = rates[known]
    share = np.divide(share, inlets.loss, out=np.zeros(share.size), where=inlets.loss != 0.0)
    return float(share @ drained)


def after_drinking(jet: Jet, taken: Array, dt: float) -> Jet:
    """The jet of a mouth that drinks with the velocity of what it took, relative to the body."""
    if jet.rate >= 0.0:
        return jet
    return replace(jet, velocity=taken / (-jet.rate * dt) - jet.skin)


def at_faces(
    cells: Integers, values: tuple[Array, ...], axis: int, grid: Grid, sides: Boundaries
) -> tuple[Integers, list[Array]]:
    """Half of what comes into each of some cells for both of its faces across `axis`: the faces,
    flat and ascending, and the sums on them. The last face along a periodic axis is the first."""
    at = np.stack(np.unravel_index(cells, grid.shape))
    above = at.copy()
    above[axis] += 1
    if sides.periodic()[axis]:
        above[axis] %= grid.shape[axis]
    shape = grid.face_shape(axis)
    both = [np.ravel_multi_index(tuple(place), shape) for place in (at, above)]
    index, which = np.unique(np.concatenate(both), return_inverse=True)
    sums = [np.bincount(which, np.tile(v, 2), index.size) for v in values]
    return index, [np.asarray(0.5 * total, float) for total in sums]


def brought_by(jets: tuple[Jet, ...], rate: Array, names: tuple[str, ...]) -> Brought:
    """What mouths and sources bring into the cells: mouths their own dye, none that they do not
    name; sources, and mouths that drink, the fluid that is there.

    rate   (nx, ny, nz) what all of them bring, m^3/s
    names  of the scalars
    """
    blown = [jet for jet in jets if jet.rate > 0.0]
    gain, dye = np.zeros(rate.shape), {name: np.zeros(rate.shape) for name in names}
    for jet in blown:
        gain.reshape(-1)[jet.cells] += jet.rates
        for name in names:
            dye[name].reshape(-1)[jet.cells] += jet.mouth.scalars.get(name, 0.0) * jet.rates
    cells = np.flatnonzero(gain)
    amounts = {name: dye[name].reshape(-1)[cells] for name in names}
    return Brought(rate, cells, gain.reshape(-1)[cells], amounts)

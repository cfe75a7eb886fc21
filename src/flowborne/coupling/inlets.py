"""What comes into the control volumes from within: through mouths and from sources."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flowborne.coupling.mouths import Jet
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import means
from flowborne.fluid.dye import Brought
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.transport import NO_INLETS, Inlets


def inlets_across(
    axis: int,
    jets: tuple[Jet, ...],
    sources: Array,
    grid: Grid,
    sides: Boundaries,
) -> Inlets:
    """What mouths and sources bring to the control volumes of the faces across `axis`.

    A mouth that drinks, and a source, take or bring fluid as fast as that around.
    """
    if not jets and not sources.any():
        return NO_INLETS
    gain, weighted, local = (np.zeros(grid.shape) for _ in range(3))
    local -= sources
    for jet in jets:
        rates = np.zeros(grid.shape)
        rates.reshape(-1)[jet.cells] = jet.rates
        if jet.rate > 0.0:
            gain += rates
            weighted += rates * (jet.skin[axis] + jet.velocity[axis])
        else:
            local -= rates
    gains, speeds, losses = (at_faces(cells, axis, sides) for cells in (gain, weighted, local))
    index = np.flatnonzero((gains != 0.0) | (losses != 0.0))
    gains, speeds, losses = gains[index], speeds[index], losses[index]
    speeds = np.divide(speeds, gains, out=np.zeros(index.size), where=gains != 0.0)
    return Inlets(index, gains, speeds, losses)


def taken_by(
    jet: Jet, axis: int, inlets: Inlets, drained: Array, grid: Grid, sides: Boundaries
) -> float:
    """What a mouth that drinks took of volume times velocity across `axis` in a step, m^4/s."""
    if jet.rate >= 0.0:
        return 0.0
    rates = np.zeros(grid.shape)
    rates.reshape(-1)[jet.cells] = -jet.rates
    share = at_faces(rates, axis, sides)[inlets.index]
    share = np.divide(share, inlets.loss, out=np.zeros(share.size), where=inlets.loss != 0.0)
    return float(share @ drained)


def after_drinking(jet: Jet, taken: Array, dt: float) -> Jet:
    """The jet of a mouth that drinks with the velocity of what it took, relative to the body."""
    if jet.rate >= 0.0:
        return jet
    return replace(jet, velocity=taken / (-jet.rate * dt) - jet.skin)


def at_faces(cells: Array, axis: int, sides: Boundaries) -> Array:
    """(n,) half of what comes into each cell for both of its faces across `axis`; the last face
    along a periodic axis, which is the first one, has none."""
    values = means(cells, axis, sides.periodic()[axis])
    if sides.periodic()[axis]:
        values[edge(axis, -1)] = 0.0
    return values.reshape(-1)


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

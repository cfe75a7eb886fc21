"""Mouths: patches of a body's skin through which fluid is expelled, or taken in.

A mouth of area A that lets the volume rate Q through gives the fluid there the velocity  w = Q/A d
relative to the body, along its direction d. With the body's velocity v_b at the mouth,

    D u + J v = q                  q: Q, shared out over the cells at the mouth by the skin's area
    rho Q dt (v_b + w)             momentum that comes into the fluid in a step
    -rho Q dt w                    impulse on the body, at the middle of the mouth

What body and fluid gain together, rho Q dt v_b, is the momentum of what a body of constant mass is
filled with. All of it holds for a mouth that takes fluid in (Q < 0) as well. Sources bring fluid
in from within as mouths do.

Method: docs/method/mouths.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.ndimage import map_coordinates

from flowborne.base.errors import BreakdownError
from flowborne.coupling.fractions import Geometry
from flowborne.fluid.boundary import Boundaries, Source, cells_in
from flowborne.fluid.control_volumes import NONE
from flowborne.fluid.dye import Brought
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.far import Strength
from flowborne.fluid.transport import NO_INLETS
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.kernels.carry import Inlets, share_at_faces
from flowborne.kernels.lists import merged
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.scratch import cross

DEPTH = 3.0
"""Cells along a mouth, beyond its radius, within which skin may belong to it."""


@dataclass(frozen=True)
class Mouth:
    """A patch of a body's skin.

    name         for messages
    body         the body; the skin may be that of flesh around it, and moves with the body here
    position     centre of the patch in the body's frame, m
    direction    (3,) unit vector out of the body, in its frame
    radius       m
    volume_rate  expelled at full strength, m^3/s (m^2/s in a slab); negative is taken in
    strength     over time
    scalars      values of the carried scalars in what is expelled
    """

    name: str
    body: int
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    radius: float
    volume_rate: float
    strength: Strength
    scalars: Mapping[str, float] = field(default_factory=dict)

    def area(self, slab: bool) -> float:
        """m^2; width in m in a slab."""
        return 2.0 * self.radius if slab else np.pi * self.radius**2


@dataclass(frozen=True)
class Jet:
    """What a mouth does at one instant.

    bodies    number of bodies, from which on fleshes are numbered
    rate      Q, m^3/s
    centre    (3,) m
    along     (3,) d
    velocity  (3,) w, relative to the body, m/s
    skin      (3,) v_b, velocity of the body at the centre, m/s
    cells     (k,) flat indices of the cells at the mouth
    rates     (k,) part of Q that comes into each, m^3/s
    """

    mouth: Mouth
    bodies: int
    rate: float
    centre: Array
    along: Array
    velocity: Array
    skin: Array
    cells: Integers
    rates: Array


def jet_of(mouth: Mouth, cut: Geometry, pose: Kinematics, v: Array, grid: Grid, time: float) -> Jet:
    """What a mouth does at `time` (s), on bodies with the generalised velocity v (nv,).

    raises  ValueError when it covers no cell
    """
    turn = pose.body_rotation[mouth.body]
    centre = pose.body_position[mouth.body] + turn @ np.array(mouth.position)
    along = turn @ np.array(mouth.direction)
    rate = mouth.volume_rate * mouth.strength.at(time)
    bodies = len(pose.body_position)
    rows = np.flatnonzero(skin_of(mouth, cut.owner, bodies))
    cells, row = np.unique(cut.rows[0][rows], return_inverse=True)
    at = np.stack(np.unravel_index(cells, grid.shape), axis=1)
    skin = np.zeros(len(cells))
    np.add.at(skin, row, -cut.area[rows] @ along)
    centres = np.array(grid.origin) + grid.spacing * (at + 0.5)
    place = cut.images.at_bodies(centres, np.full(len(at), mouth.body))
    skin *= covered(place, mouth, centre, along, grid) * (skin > 0.0)
    here = skin > 0.0
    if not here.any():
        raise BreakdownError(
            f"{mouth.name} covers no cell at {centre.round(6).tolist()} m, {time:g} s. Put its "
            "position on the body's skin, inside the domain, with the direction out of the body"
        )
    twist = pose.twist_jacobian[mouth.body] @ v
    return Jet(
        mouth,
        bodies,
        rate,
        centre,
        along,
        rate / mouth.area(grid.is_slab) * along,
        twist[:3] + cross(twist[3:], centre),
        cells[here],
        rate * skin[here] / skin.sum(),
    )


def skin_of(mouth: Mouth, owner: Integers, bodies: int) -> Mask:
    """(n,) whether parts of skin belong to the mouth's body, or to flesh, which may be all around
    it; fleshes are numbered from `bodies` on."""
    return np.asarray((owner == mouth.body) | (owner >= bodies))


def covered(x: Array, mouth: Mouth, centre: Array, along: Array, grid: Grid) -> Array:
    """(n,) part of a cell around each place x (n, 3) that a mouth covers, seen along it."""
    gap, h = x - centre, grid.spacing
    height = gap @ along
    beside = np.linalg.norm(gap - height[:, None] * along, axis=1)
    near = np.abs(height) < mouth.radius + DEPTH * h
    part: Array = near * np.clip(0.5 + (mouth.radius - beside) / h, 0.0, 1.0)
    return part


def share_of(
    x: Array, mouth: Mouth, centre: Array, along: Array, cut: Geometry, grid: Grid
) -> Array:
    """(n,) part of a face at each place x (n, 3) on the skin that belongs to a mouth: `covered`,
    and with the skin that is nearest to it on the mouth's side."""
    share = covered(x, mouth, centre, along, grid)
    found = np.flatnonzero(share)
    step = 0.5 * grid.spacing * along
    outward = distance_at(x[found] + step, cut, grid)
    share[found] *= outward > distance_at(x[found] - step, cut, grid)
    return share


def distance_at(x: Array, cut: Geometry, grid: Grid) -> Array:
    """(n,) distance to the bodies at places x (n, 3), m."""
    inside = x - np.array(grid.origin)
    for axis in np.flatnonzero(cut.images.period):
        inside[:, axis] %= cut.images.period[axis]
    at = (inside / grid.spacing).T
    return np.asarray(map_coordinates(cut.distance, at, order=1, mode="nearest"))


def add_rates(rate: Array, jets: tuple[Jet, ...]) -> None:
    """Add the volume that comes into each cell, m^3/s, to `rate` (nx, ny, nz)."""
    for jet in jets:
        rate.reshape(-1)[jet.cells] += jet.rates


def skin_slip(
    jets: tuple[Jet, ...], point: Array, across: Array, body: Integers, cut: Geometry, grid: Grid
) -> Array:
    """(n,) velocity of the skin relative to its body, m/s: that of a jet in a mouth, 0 elsewhere.

    point, across, body  (n, 3) places on the skin in m, (n, 3) unit vector along which the
                         velocity is asked for, (n,) whose skin it is
    """
    slip = np.zeros(len(body))
    for jet in jets:
        own = np.flatnonzero(skin_of(jet.mouth, body, jet.bodies))
        share = share_of(point[own], jet.mouth, jet.centre, jet.along, cut, grid)
        slip[own] += share * (across[own] @ jet.velocity)
    return slip


def jet_wrench(jets: tuple[Jet, ...], density: float, nbody: int) -> Array:
    """(nbody, 6) reaction of the jets on the bodies about the world origin, N and N m."""
    wrench = np.zeros((nbody, 6))
    for jet in jets:
        force = -density * jet.rate * jet.velocity
        wrench[jet.mouth.body] += np.concatenate([force, cross(jet.centre, force)])
    return wrench


def cells_with_inlets(
    jets: tuple[Jet, ...], rate: Array, sources: tuple[Source, ...], grid: Grid
) -> Integers:
    """Flat cells into which mouths and sources bring something, ascending.

    rate  (nx, ny, nz) what the sources bring, m^3/s
    """
    cells = NONE
    for source in sources:
        if source.volume_rate is not None:
            parts = zip(grid.shape, cells_in(source, grid), strict=True)
            box = np.ix_(*(np.arange(count)[part] for count, part in parts))
            flat = np.ravel_multi_index(box, grid.shape).ravel()
            cells = merged(cells, flat[rate.reshape(-1)[flat] != 0.0])[0]
    for jet in jets:
        cells = merged(cells, jet.cells)[0]
    return cells


def inlets_across(
    axis: int, cells: Integers, jets: tuple[Jet, ...], sources: Array, grid: Grid, sides: Boundaries
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
    share, at = np.zeros(inlets.faces.size), np.searchsorted(inlets.faces, index)
    known = (at < inlets.faces.size) & (inlets.faces[at.clip(0, inlets.faces.size - 1)] == index)
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
) -> tuple[Integers, Array]:
    """Half of what comes into each of some cells for both of its faces across `axis`: the faces,
    flat and ascending, and the sums on them. The last face along a periodic axis is the first."""
    ring = grid.shape[axis] * sides.periodic()[axis]
    return share_at_faces(cells, values, axis, grid.shape, ring)


def brought_by(jets: tuple[Jet, ...], rate: Array, names: tuple[str, ...]) -> Brought:
    """What mouths and sources bring into the cells: mouths their own dye, none that they do not
    name; sources, and mouths that drink, the fluid that is there.

    rate   (nx, ny, nz) what all of them bring, m^3/s
    names  of the scalars
    """
    blown, cells = [jet for jet in jets if jet.rate > 0.0], NONE
    for jet in blown:
        cells = merged(cells, jet.cells)[0]
    gain, dye = np.zeros(cells.size), {name: np.zeros(cells.size) for name in names}
    for jet in blown:
        at = np.searchsorted(cells, jet.cells)
        gain[at] += jet.rates
        for name in names:
            dye[name][at] += jet.mouth.scalars.get(name, 0.0) * jet.rates
    return Brought(rate, cells, gain, dye)

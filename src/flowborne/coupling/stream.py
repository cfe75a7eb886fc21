"""What acts on the bodies from outside, simple winds and forces; and the fluid at points: one-way
coupling, in which its velocity is such a wind (eq. 2), and the flow that a creature's sensors
read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from flowborne.base.errors import SceneError
from flowborne.base.one_line import one_line
from flowborne.coupling.cut import cut_by_bodies
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Faces
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.wind import Wind, WindFaces


@dataclass(frozen=True)
class Sampled:
    """A velocity on faces as a field of place; outside the grid it is that of the nearest face."""

    velocity: Faces
    grid: Grid

    def __call__(self, x: Array, time: float) -> Array:
        """(n, 3) velocity in m/s at the places x (n, 3), linear between faces."""
        inside = ((x - np.array(self.grid.origin)) / self.grid.spacing).T
        values = np.zeros_like(x)
        for axis in self.grid.axes:
            at = inside - 0.5
            at[axis] += 0.5
            if self.grid.is_slab:
                at[2] = 0.0
            values[:, axis] = map_coordinates(self.velocity[axis], at, order=1, mode="nearest")
        return values


@dataclass(frozen=True)
class WindStream:
    """The simple wind on every face, eq. (2), with the velocity that the fluid has there.

    Meant for a fluid that does not feel the bodies.

    density  rho, kg/m^3
    bodies   names of the bodies that it blows on; all when None
    """

    density: float
    bodies: tuple[str, ...] | None = None

    def wrench(self, model: SolidModel, kinematics: Kinematics, v: Array, time: float) -> Array:
        """Raises ValueError: a stream blows in a world with a fluid only, by `winds_on`."""
        raise ValueError("a wind of kind 'stream' needs a world with a fluid: give its setup one")


def winds_on(world: World, pose: Kinematics) -> Array:
    """(k,) push of the simple winds: wrench on each body about the world origin, then force on each
    vertex of flesh."""
    model, v, time = world.setup.solid, world.solid.v, world.time
    wrench, force = np.zeros((len(pose.body_position), 6)), np.zeros_like(pose.vertices)
    for wind in world.setup.winds:
        blowing: Wind = wind
        if isinstance(wind, WindStream) and world.fluid is not None:
            field = Sampled(world.fluid.velocity, world.flow()[0].grid)
            blowing = WindFaces(field, wind.density, wind.bodies)
        wrench += blowing.wrench(model, pose, v, time)
        if model.flesh is not None and isinstance(blowing, WindFaces):
            force += blowing.on_flesh(model, pose, v, time)
    return np.append(wrench, force)


def forces_on(world: World, pose: Kinematics, time: float) -> Array:
    """(nbody, 6) wrench at `time` (s) of the forces from outside on each body about the origin."""
    total = np.zeros((len(pose.body_position), 6))
    for force in (*world.setup.forces, *world.told.forces):
        total += force.wrench(world.setup.solid, pose, world.solid.v, time)
    return total


@dataclass(frozen=True, eq=False)
class FlowState:
    """The fluid at points, in world axes.

    velocity  (n, 3) m/s
    pressure  (n,) dynamic pressure, Pa; nan where no fluid is within a cell
    """

    __repr__ = one_line

    velocity: Array
    pressure: Array


def _within(fluid: Fluid, x: Array) -> Array:
    """Points x (n, 3) in the domain; across periodic sides their images. Raises as `flow_at`."""
    low, high = np.array(fluid.grid.origin), np.array(fluid.grid.upper)
    out = (x < low) | (x > high)
    out[:, [axis for axis in range(3) if axis not in fluid.grid.axes]] = False
    lost = np.argwhere(out & ~np.array(fluid.boundaries.periodic()))
    if lost.size:
        n, axis = lost[0]
        raise SceneError(
            f"point {n + 1} of {len(x)} is at {'xyz'[axis]} = {x[n, axis]:.4g} m, outside the "
            f"domain from {low[axis]:.4g} to {high[axis]:.4g} m; give points within"
        )
    return np.where(out, low + (x - low) % (high - low), x)


def flow_at(world: World, x: Array) -> FlowState:
    """The fluid at points x (n, 3), linear between faces and between the centres of cells that hold
    fluid. Raises ValueError without a fluid, SceneError for a point outside the domain, unless the
    side there is periodic."""
    fluid, state = world.flow()
    grid = fluid.grid
    x = _within(fluid, x)
    at = ((x - np.array(grid.origin)) / grid.spacing - 0.5).T
    if grid.is_slab:
        at[2] = 0.0
    wet = (cut_by_bodies(world).volume > 0.0).astype(np.float64)
    pressed, share = (
        map_coordinates(values, at, order=1, mode="nearest")
        for values in (wet * state.pressure, wet)
    )
    pressure = np.divide(pressed, share, out=np.full(share.shape, np.nan), where=share > 0.0)
    return FlowState(Sampled(state.velocity, grid)(x, world.time), pressure)

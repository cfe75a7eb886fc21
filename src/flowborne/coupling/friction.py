"""Friction between fluid and bodies: the viscous solve, and how bones and flesh answer it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flowborne.coupling.flesh import skin_at
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.mouths import Jet, skin_slip
from flowborne.coupling.operators import (
    boundary_velocity,
    generalised,
    pressure_push,
)
from flowborne.coupling.viscous_solve import ViscousSystem, Walls, walls_of
from flowborne.coupling.world import World
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.projection import PressureGradient
from flowborne.fluid.viscosity import OpenParts, assemble_viscosity
from flowborne.kernels.fresh import fill_fresh
from flowborne.solids.driven import Driven
from flowborne.solids.dynamics import Kinematics

TOLERANCE = 1e-12
"""Relative residual of the viscous solve."""


def diffuse(
    world: World,
    velocity: Faces,
    mass: Faces,
    gradient: PressureGradient,
    cut: Geometry,
    jets: tuple[Jet, ...],
    pose: Kinematics,
    driven: Driven,
) -> tuple[Faces, Array, bool]:
    """Implicit viscosity with the pressure of the last step, and its impulse on the bodies.

    The pressure is there so that the boundary layer is that of the flow at the end of the step;
    it is taken off again before the new pressure is solved for. Cells that have opened since have
    that around them.

    returns  Faces; (k,) impulse; whether the solve converged
    """
    (fluid, state), dt = world.flow(), driven.system.dt
    bodies = pose.twist_jacobian.shape[0]
    size = 6 * bodies + pose.vertices.size
    if fluid.viscosity == 0.0:
        return velocity, np.zeros(size), True
    grid, sides = fluid.grid, fluid.boundaries
    last, wraps = state.pressure.copy(), np.array(grid.shape) * np.array(sides.periodic())
    fill_fresh(last, cut.open, np.flatnonzero(last == 0.0), wraps)
    pushed = velocity[0].copy(), velocity[1].copy(), velocity[2].copy()
    gradient.subtract(pushed, last, dt)
    earlier = pressure_push(cut, dt * last, size)
    moving = boundary_velocity(pose, driven.after(generalised(pose, earlier)))
    parts = assemble_viscosity(
        OpenParts(cut.distance, cut.crossings, cut.open, cut.volume),
        velocity,
        mass,
        grid,
        sides,
        fluid.viscosity,
        dt,
        world.time + dt,
    )
    walls = on_flesh(walls_of(parts, cut, grid), cut, bodies, grid)
    system = ViscousSystem(
        parts, walls, size, bodies, lambda drag: driven.answering(pose, drag), grid, sides, dt
    )
    slip = skin_slip(jets, walls.point, walls.across, walls.body, cut, grid)
    smooth, impulse, converged = system.solve(pushed, moving, TOLERANCE, slip)
    gradient.subtract(smooth, last, -dt)
    return smooth, impulse, converged


def on_flesh(walls: Walls, cut: Geometry, bodies: int, grid: Grid) -> Walls:
    """The walls with those on flesh moved by the vertices around them."""
    flesh = np.flatnonzero(walls.body >= bodies)
    if flesh.size == 0:
        return walls
    axis = np.argmax(walls.across[flesh], axis=1)
    corner, weight = skin_at(cut.skins, walls.point[flesh], grid)
    columns, arm = walls.columns.copy(), walls.arm.copy()
    columns[flesh], arm[flesh] = 0, 0.0
    columns[flesh, :3] = 6 * bodies + 3 * corner + axis[:, None]
    arm[flesh, :3] = weight
    return replace(walls, columns=columns, arm=arm)

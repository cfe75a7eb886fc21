"""Where the fluid's momentum came from and went to in a step."""

from __future__ import annotations

import numpy as np

from flowborne.coupling.flow import AdvectionResult
from flowborne.coupling.half_pressure import HalfPressure
from flowborne.coupling.report import Momentum
from flowborne.coupling.solve import Solved
from flowborne.coupling.world import World
from flowborne.fluid.grid import Array, Faces
from flowborne.fluid.momentum import fluid_momentum, momentum_change


def momentum_balance(
    world: World,
    mass: Faces,
    half: HalfPressure,
    advected: AdvectionResult,
    solved: Solved,
) -> Momentum:
    """The fluid's budget of a step that ends with the masses `mass` of the faces."""
    fluid, _ = world.flow()
    projected, before = solved.projected, solved.before_pressure
    assert projected is not None
    assert before is not None
    grid, boundaries = fluid.grid, fluid.boundaries
    first = 6 * world.setup.solid.nbody
    pressed = fluid_momentum(before, mass, grid, boundaries)
    taken, moved = momentum_change(before, projected.velocity, mass, grid, boundaries)
    after = fluid_momentum(projected.velocity, mass, grid, boundaries)
    pushes = linear(projected.impulse, first)
    exchanged = pushes.sum(axis=0)
    scale = float(np.abs(pushes).sum()) + moved
    missing = float(np.abs(exchanged + taken - projected.sides).max())
    sides = projected.sides + half.sides
    exchanged += linear(half.impulse, first).sum(axis=0)
    forces = pressed - fluid_momentum(advected.velocity, mass, grid, boundaries)
    given = advected.crossed + advected.expelled + advected.stopped + forces + sides - exchanged
    unknown = float(np.abs(after - half.start - given).max())
    return Momentum(
        fluid=after,
        exchanged=exchanged,
        exchange_error=missing / scale if scale > 0.0 else 0.0,
        boundary=sides + advected.stopped,
        crossed=advected.crossed,
        jet=advected.expelled,
        forces=forces,
        budget_error=unknown / scale if scale > 0.0 else 0.0,
    )


def linear(push: Array, first: int) -> Array:
    """(n, 3) the forces in a push (k,), with the wrenches on bodies before index `first`."""
    return np.concatenate([push[:first].reshape(-1, 6)[:, :3], push[first:].reshape(-1, 3)])

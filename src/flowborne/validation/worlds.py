"""Models, flows, sides and steps that several cases use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from flowborne import Array, StepReport, World
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryPeriodic,
    Field,
    Profile,
    advance,
    set_velocity,
    start_from,
)

Vector = tuple[float, float, float]

NOWHERE: Vector = (0.0, 0.0, 0.0)
PERIODIC = BoundaryPeriodic()
RING = Boundaries(PERIODIC, PERIODIC, PERIODIC, PERIODIC)
"""Periodic in x and y."""


def mjcf(*elements: str, options: str = "") -> str:
    """An MJCF model of world-body elements; angles in radians, no contact."""
    return (
        '<mujoco><compiler angle="radian"/><default><geom contype="0" conaffinity="0"/></default>'
        f"{options}<worldbody>{''.join(elements)}</worldbody></mujoco>"
    )


def start_at_once(world: World, dt: float) -> StepReport:
    """The first step from a flow that is not yet adapted to its bodies: the impulsive start.

    The pressure of this step is an impulse and no estimate of the next one, so it is cleared.
    """
    report = advance(world, dt)
    _, state = world.flow()
    for values in (*state.acceleration, state.pressure, state.earlier):
        values[:] = 0.0
    return report


@dataclass(frozen=True)
class Uniform:
    """The same velocity everywhere, as a profile and as a field."""

    velocity: Vector

    def __call__(
        self, x: Array, y: Array, z: Array, time: float = 0.0
    ) -> tuple[Array, Array, Array]:
        same = 0.0 * (x + y + z)
        return same + self.velocity[0], same + self.velocity[1], same + self.velocity[2]


def all_inflow(profile: Profile) -> Boundaries:
    """The same profile on all four sides of a slab."""
    side = BoundaryInflow(profile)
    return Boundaries(side, side, side, side)


def begin(world: World, coarser: World | None, field: Field) -> None:
    """Start from the flow on a coarser grid, or without one from a field."""
    if coarser is None:
        set_velocity(world, field)
    else:
        start_from(coarser, world)


def refined(
    grids: Iterable[int], build: Callable[[int], World], field: Field
) -> Iterator[tuple[int, World, bool]]:
    """A world for each grid, from coarse to fine.

    The first starts from a field, the others from the last flow on the coarser grid.

    yields  (cells, world, whether it is the first)
    """
    coarser = None
    for cells in grids:
        world = build(cells)
        begin(world, coarser, field)
        yield cells, world, coarser is None
        coarser = world


def whole_steps(duration: float, longest: float) -> tuple[int, float]:
    """Number and length of equal steps, at most `longest` each, of a duration."""
    count = max(1, int(np.ceil(duration / longest - 1e-9)))
    return count, duration / count

"""Why a world cannot be advanced any further."""

from __future__ import annotations

import numpy as np

from flowborne.coupling.report import Outcome, StepReport
from flowborne.coupling.world import World
from flowborne.fluid.boundary import SIDES
from flowborne.kernels.arrays import PRESCRIBED, Integers
from flowborne.kernels.faces import is_finite
from flowborne.runs.summary import BUDGET_OPEN
from flowborne.solids.flesh import inversion
from flowborne.solids.model import turning_dofs
from flowborne.solids.surfaces import geom_boxes

MAX_INVERTED = 0.02
"""Largest share of the elements of flesh that may be inside out for a while."""

LISTED = 4
"""Maximum number of dofs named in a message."""


def trouble(world: World, report: StepReport) -> str | None:
    """Why the world cannot be advanced after the step of `report`, or None."""
    if report.outcome is Outcome.PRESSURE_NOT_CONVERGED:
        detail = (
            f"relative residual {report.residual:.2g} after {report.solver_iterations} iterations"
        )
        return f"{report.outcome.value} ({detail})"
    if report.outcome is Outcome.NOT_SETTLED and report.unsettled.size:
        return f"{report.outcome.value} (at {_names(world, report.unsettled)})"
    if report.outcome is not Outcome.DONE:
        return report.outcome.value
    solid, fluid, properties = world.solid, world.fluid, world.setup.fluid
    if not (np.isfinite(solid.q).all() and np.isfinite(solid.v).all()):
        return "a joint's position or velocity is not a finite number"
    turn = np.abs(solid.v * report.dt) * turning_dofs(world.setup.solid)
    if turn.size and turn.max() > np.pi:
        name = world.setup.solid.dof_names[int(turn.argmax())]
        return f"{name} turns by {turn.max():.3g} rad in one step, more than half a turn"
    flesh = world.setup.solid.flesh
    torn = None if flesh is None else inversion(flesh, solid.q)
    if torn is not None and len(torn.elements) > MAX_INVERTED * torn.of:
        return torn.sentence()
    if fluid is None or properties is None:
        return None
    left = departed(world, report)
    if left:
        return left
    grid = properties.grid
    if not all(map(is_finite, (*fluid.velocity, fluid.pressure))):
        return Outcome.NOT_FINITE.value
    longest, moved = max(grid.shape) * grid.spacing, report.fastest * report.dt
    if moved > longest:
        return (
            f"the fluid moves {moved:.3g} m in one step, farther than the domain is long "
            f"({longest:.3g} m)"
        )
    return None


def departed(world: World, report: StepReport) -> str | None:
    """Which body is where there is no fluid, beyond a side that lets nothing through, or None.

    Its centre of mass is there, or it reaches there by more than a cell and momentum is lost.
    """
    model, fluid = world.setup.solid, world.setup.fluid
    if fluid is None or fluid.one_way:
        return None
    grid, h = fluid.grid, fluid.grid.spacing
    body, low = np.arange(model.nbody), report.centre
    high = low
    if report.momentum_budget_error > BUDGET_OPEN:
        first, last = geom_boxes(model, world.solid.q)
        body = np.append(body, model.geom_body)
        low, high = np.concatenate([low, first + h]), np.concatenate([high, last - h])
    met = (model.moving & (model.volume > 0.0))[body]
    for axis in grid.axes:
        gone = low[:, axis] < grid.origin[axis], high[:, axis] > grid.upper[axis]
        for end, side in enumerate(fluid.boundaries.pair(axis)):
            found = np.flatnonzero(met & gone[end])
            if found.size and side.normal == PRESCRIBED:
                return (
                    f"body '{model.body_names[body[found[0]]]}' has left the domain through its "
                    f"{side.kind} side {SIDES[2 * axis + end]}; enlarge [domain], or put a plane "
                    "with contact into the model where the side is"
                )
    return None


def _names(world: World, dofs: Integers) -> str:
    """Names of the first few of some dofs."""
    names = [world.setup.solid.dof_names[dof] for dof in dofs[:LISTED]]
    more = len(dofs) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")

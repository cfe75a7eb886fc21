"""The bodies of a step with driven dofs: a dense system of bones alone (`prescribed`), or a sparse
one of bones and flesh (`flesh_solve`).

Method: docs/method/bodies.md.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from flowborne.kernels.arrays import Array
from flowborne.solids.dynamics import assemble
from flowborne.solids.flesh_dynamics import assemble_flesh
from flowborne.solids.flesh_solve import prescribe_flesh
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.prescribed import Driven, prescribe
from flowborne.solids.trajectories import JointCommand

LIMIT_TOLERANCE = 1e-9
"""Relative excess of a drive over its limit, or of a dof over its velocity, that is ignored."""

SIMULTANEOUS_TURNS = 6
"""Turns in which all wrong drives change; after them only one changes per turn."""


def drive(
    model: SolidModel,
    state: SolidState,
    applied: Array,
    dt: float,
    before: SolidState | None,
    command: JointCommand,
    added: csr_array | None = None,
) -> Driven:
    """The bodies at `state` under generalised forces (nv,), with driven dofs.

    before   state before the positions moved; see `assemble`
    command  a drive with a torque limit may not reach its final velocity, so the first Coriolis
             forces do not assume that it does
    added    as in `assemble`
    raises   BreakdownError when the matrix of the free dofs is not positive definite
    """
    prescribed, hold = command.prescribed, command.final_velocity
    exact = prescribed & np.isinf(command.torque_limit)
    if model.flesh is not None:
        flesh = assemble_flesh(model, state, applied, dt, before, exact, added)
        return prescribe_flesh(flesh, prescribed, hold)
    guess = np.where(exact, hold, state.v)
    system = assemble(model, state, applied, dt, before, guess, exact, added)
    return prescribe(system, prescribed, hold)


def within_limits(driven: Driven, limit: Array, v_plus: Array, actuator: Array) -> Driven | None:
    """The bodies with the drives that a solution implies; None when they do not change.

    A drive either keeps its dof at `hold` with a force within its limit, or pushes with its limit
    towards a velocity that the dof does not reach. A drive that needs more is released; it is
    prescribed again when its dof passes `hold`. In the first turn, released drives push from the
    velocity before the step towards `hold`: the force that a drive needs while the others reach
    their velocities is a poor guide to its direction. This is a linear complementarity problem with
    a positive definite matrix. Changing only the first wrong drive always terminates (Murty 1974);
    changing all wrong drives usually takes fewer turns.

    limit     (nv,) largest |generalised force| of each drive, inf for none
    v_plus    (nv,) velocity of the solution
    actuator  (nv,) force of the drives in the solution, as `driven.actuator` returns it
    """
    if not np.isfinite(limit).any():
        return None
    over = driven.prescribed & (np.abs(actuator) > limit * (1.0 + LIMIT_TOLERANCE))
    past = driven.limited
    if past.any():
        room = LIMIT_TOLERANCE * (np.abs(v_plus) + np.abs(driven.hold))
        past = past & (np.sign(driven.push) * (v_plus - driven.hold) > room)
    wrong = (over | past).nonzero()[0]
    if wrong.size == 0:
        return None
    if driven.turns >= SIMULTANEOUS_TURNS:
        wrong = wrong[:1]
    prescribed, limited, push = driven.prescribed.copy(), driven.limited.copy(), driven.push.copy()
    prescribed[wrong], limited[wrong] = past[wrong], over[wrong]
    ahead = driven.hold - driven.system.v
    direction = np.sign(np.where((ahead == 0.0) | (driven.turns > 0), actuator, ahead))
    push[wrong] = np.where(over[wrong], direction[wrong] * limit[wrong], 0.0)
    return driven.redriven(prescribed, limited, push)

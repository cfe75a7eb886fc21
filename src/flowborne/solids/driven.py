"""The bodies of a step, some of whose dofs are driven: one contract for bones alone and with flesh.

Bones alone are a dense system (`prescribed`), bones and flesh a sparse one (`flesh_solve`).
"""

from __future__ import annotations

from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from flowborne.solids.dynamics import Kinematics, Rows, Zones, assemble
from flowborne.solids.flesh_dynamics import assemble_flesh
from flowborne.solids.flesh_solve import prescribe_flesh
from flowborne.solids.model import SolidModel
from flowborne.solids.prescribed import prescribe
from flowborne.solids.state import SolidState
from flowborne.solvers.answers import Answering
from flowborne.solvers.mobility import Mobility

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

OVER = 1e-9
"""Share by which a drive may exceed its limit, or a dof its velocity, before that counts."""

AT_ONCE = 6
"""Turns in which all drives that are wrong change; after them one at a time does."""


class System(Protocol):
    """The equations of motion of a step, A (v+ - v) = dt b."""

    @property
    def dt(self) -> float:
        """s."""
        ...

    @property
    def v(self) -> Array:
        """(nv,) velocity before the step."""
        ...

    @property
    def rows(self) -> Rows | None:
        """Constraint rows."""
        ...

    @property
    def zones(self) -> Zones:
        """(k,) the state of each row."""
        ...

    @property
    def contacts(self) -> int:
        """Number of contacts with an active row."""
        ...


class Driven(Protocol):
    """What bodies answer to an impulse when some dofs are prescribed; nothing of it changes."""

    @property
    def system(self) -> System:
        """The system it was made from."""
        ...

    @property
    def prescribed(self) -> Mask:
        """(nv,) dofs that end the step with velocity `hold`."""
        ...

    @property
    def hold(self) -> Array:
        """(nv,) rad/s or m/s; free dofs' entries are not used."""
        ...

    @property
    def velocity(self) -> Array:
        """(nv,) velocity after the step when there is no impulse."""
        ...

    @property
    def limited(self) -> Mask:
        """(nv,) dofs whose drive reached its limit; they are free and pushed by `push`."""
        ...

    @property
    def push(self) -> Array:
        """(nv,) generalised force of limited drives, already in `system`."""
        ...

    @property
    def turns(self) -> int:
        """Times that drives were released or taken up."""
        ...

    def after(self, impulse: Array) -> Array:
        """(nv,) velocity after the step with a generalised impulse (nv,), the fluid's for one."""
        ...

    def actuator(self, v_plus: Array, impulse: Array) -> Array:
        """(nv,) generalised force that the drives supplied; zero on dofs without a drive."""
        ...

    def updated(self, v_plus: Array) -> Self | None:
        """With the contacts, limits and Coriolis forces that `v_plus` implies; None when it has
        them already."""
        ...

    def redriven(self, prescribed: Mask, limited: Mask, push: Array) -> Self:
        """With other drives that keep their dofs, and others at their limits."""
        ...

    def answers_as(self, other: object) -> bool:
        """Whether both give the same answer to any impulse."""
        ...

    def mobility(self, pose: Kinematics) -> Mobility:
        """The motion that a unit impulsive push gives: M = T A^-1 T^T, v of eq. (9) eliminated."""
        ...

    def answering(self, pose: Kinematics, drag: csr_array) -> Answering:
        """How the bodies answer a drag (k, k), kg."""
        ...


def drive(
    model: SolidModel,
    state: SolidState,
    applied: Array,
    dt: float,
    before: SolidState | None,
    prescribed: Mask,
    hold: Array,
    limit: Array,
) -> Driven:
    """The bodies at `state` under generalised forces (nv,), with dofs (nv,) that end the step with
    velocities `hold` (nv,).

    before  state before the positions moved; see `assemble`
    limit   (nv,) largest |generalised force| of each drive, inf for none; one that has a limit may
            not reach `hold`, and the first forces of Coriolis are not made for it
    raises  BreakdownError when the free dofs' matrix is not positive definite
    """
    if model.flesh is not None:
        flesh = assemble_flesh(model, state, applied, dt, before)
        return prescribe_flesh(flesh, prescribed, hold)
    guess = np.where(prescribed & np.isinf(limit), hold, state.v)
    return prescribe(assemble(model, state, applied, dt, before, guess), prescribed, hold)


def within_limits(driven: Driven, limit: Array, v_plus: Array, actuator: Array) -> Driven | None:
    """The system with the drives that the solution implies; None when it has them already.

    A drive either keeps its dof at `hold` with a force within its limit, or pushes with all that
    it has towards a velocity that the dof does not reach: one that needs more is released, one
    whose dof runs past `hold` takes it up again. All that are released first push from the velocity
    before the step towards `hold`: what each needs alone, when the others reach theirs, says little
    of the way. Together it is a linear complementarity problem of a positive definite matrix;
    changing one drive at a time, the first, ends for certain (Murty 1974), and all at once ends
    sooner as a rule.

    limit     (nv,) largest |generalised force| of each drive, inf for none
    v_plus    (nv,) velocity of the solution
    actuator  (nv,) force that its drives supply, as `driven.actuator` gives it
    """
    over = driven.prescribed & (np.abs(actuator) > limit * (1.0 + OVER))
    past = driven.limited
    if past.any():
        room = OVER * (np.abs(v_plus) + np.abs(driven.hold))
        past = past & (np.sign(driven.push) * (v_plus - driven.hold) > room)
    wrong = (over | past).nonzero()[0]
    if wrong.size == 0:
        return None
    if driven.turns >= AT_ONCE:
        wrong = wrong[:1]
    prescribed, limited, push = driven.prescribed.copy(), driven.limited.copy(), driven.push.copy()
    prescribed[wrong], limited[wrong] = past[wrong], over[wrong]
    ahead = driven.hold - driven.system.v
    way = np.where((ahead == 0.0) | (driven.turns > 0), actuator, ahead)
    push[wrong] = np.where(over[wrong], np.sign(way[wrong]) * limit[wrong], 0.0)
    return driven.redriven(prescribed, limited, push)

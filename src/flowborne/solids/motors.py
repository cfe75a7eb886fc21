"""Forces of a model's actuators, computed by MuJoCo from controls and activations.

An actuator acts while it has a control. MuJoCo's transmission J_a gives the rate of its length,
l' = J_a v, and its force f(l, l', act, u) is J_a^T f in the bodies' equations. A step takes the
force at its end, with the mean of the velocities before and after, as those of springs and dampers
(see `dynamics.assemble`): with k = -df/dl and c = -df/dl', where these are positive,

    f = f(l, l', act, u) - w J_a (v+ - v) / dt,      w = dt/2 c + dt^2/4 k
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.sparse import csr_array, diags_array

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.model import FREE, SolidModel, SolidState
from flowborne.solids.pattern import Pattern
from flowborne.solids.scratch import Scratch, scratch

OFF = 30
"""MuJoCo's last group of actuators: those without a control are put there, and it is disabled."""

PROBE = 1e-6
"""m or rad, and m/s or rad/s, by which a length and its rate are changed for derivatives."""

ACTIVATION_STEP = 1e-3
"""s. A muscle's time constant falls to 5 ms, and MuJoCo's explicit rule overshoots in longer steps
than that."""

ON_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
"""Transmissions to a joint."""

BETWEEN = (int(mujoco.mjtTrn.mjTRN_TENDON), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK))
"""Transmissions that joints change the length of."""


@dataclass(frozen=True, eq=False)
class Controls:
    """Controls of the actuators in a frame.

    told    (nactuator,) which have one
    values  (nu,) MuJoCo's ctrl, within its range; 0 where there is none
    """

    told: Mask
    values: Array

    @classmethod
    def none(cls, model: SolidModel) -> Controls:
        """No actuator has one."""
        return cls(np.zeros(model.mj.nactuator, bool), np.zeros(model.mj.nu))


@dataclass(frozen=True, eq=False)
class Motors:
    """What the actuators do at the end of a step.

    force     (n,) of each output at the velocity before the step, N or N m
    onto      (nv,) their generalised force, N or N m
    moment    (n, nv) from v to the rates of their lengths
    yielding  (n,) w, kg or kg m^2
    dt        s
    """

    force: Array
    onto: Array
    moment: csr_array
    yielding: Array
    dt: float

    @property
    def matrix(self) -> csr_array | None:
        """(nv, nv) what the bodies' matrix has more by w, J^T w J; None where no force yields."""
        if not self.yielding.any():
            return None
        return csr_array(self.moment.T @ diags_array(self.yielding) @ self.moment)

    def through(self, change: Array) -> tuple[Array, Array]:
        """(n,) forces and (nv,) their generalised force in a step that changes v by `change`."""
        less = self.yielding * (self.moment @ change) / self.dt
        return self.force - less, self.onto - self.moment.T @ less


def outputs_of(model: SolidModel, actuator: int) -> slice:
    """Places of an actuator's forces: one, or three of a ball joint."""
    first = int(model.mj.actuator_outadr[actuator])
    return slice(first, first + int(model.mj.actuator_outnum[actuator]))


def inputs_of(model: SolidModel, actuator: int) -> slice:
    """Places of an actuator's controls among all."""
    first = int(model.mj.actuator_ctrladr[actuator])
    return slice(first, first + int(model.mj.actuator_ctrlnum[actuator]))


def control_range(model: SolidModel, actuator: int) -> tuple[Array, Array]:
    """(k,) least and largest controls of an actuator, infinite where there is no limit."""
    places, mj = inputs_of(model, actuator), model.mj
    limited = mj.actuator_ctrllimited[places].astype(bool)
    low, high = mj.actuator_ctrlrange[places].T
    return np.where(limited, low, -np.inf), np.where(limited, high, np.inf)


def activations_of(model: SolidModel, actuator: int) -> slice:
    """Places of an actuator's activations among all; none of one without."""
    first = max(0, int(model.mj.actuator_actadr[actuator]))
    return slice(first, first + int(model.mj.actuator_actnum[actuator]))


def joint_of(model: SolidModel, actuator: int) -> str | None:
    """The joint that an actuator acts on; None for one on a tendon, a site or a body."""
    if int(model.mj.actuator_trntype[actuator]) not in ON_JOINT:
        return None
    return model.joint_names[model.mj.actuator_trnid[actuator, 0]]


def driven_by(model: SolidModel, actuator: int) -> Integers:
    """Dofs of the joint that an actuator acts on; none of a free joint, or of other actuators."""
    joint = joint_of(model, actuator)
    if joint is None or model.mj.jnt_type[model.joint(joint)] == FREE:
        return np.zeros(0, np.int64)
    return model.dofs_of(joint)


def moved_by(model: SolidModel, actuator: int) -> Integers:
    """Dofs that an actuator moves at rest: of its joint, or those that change the length of its
    tendon or crank. One on a site or body moves whatever carries it, and drives none."""
    kind = int(model.mj.actuator_trntype[actuator])
    if kind not in BETWEEN:
        return driven_by(model, actuator)
    with _acting(model, model.rest(), Controls.none(model), model.mj.opt.timestep) as s:
        moment = _moment(s)[[outputs_of(model, actuator).start]]
    return np.flatnonzero(moment.toarray()[0])


def motors(model: SolidModel, state: SolidState, controls: Controls, dt: float) -> Motors:
    """Forces at `state`, at the end of a step of dt (s), of the actuators that have a control;
    others exert none."""
    with _acting(model, state, controls, dt) as s:
        data = s.data
        force, onto, moment = data.actuator_force.copy(), data.qfrc_actuator.copy(), _moment(s)
        stiff, damped = _yields(s, data.actuator_length), _yields(s, data.actuator_velocity)
        yielding = 0.5 * dt * damped + 0.25 * dt**2 * stiff
        cut = _cut_off(s, onto)
    if cut.size:
        yielding[np.unique(moment[:, cut].nonzero()[0])] = 0.0
    if model.flesh is not None:
        yielding[~_in_pattern(moment, model.flesh.pattern)] = 0.0
    return Motors(force, onto, moment, yielding, dt)


def advanced(model: SolidModel, state: SolidState, controls: Controls, dt: float) -> Array:
    """(na,) activations after dt (s), as MuJoCo integrates them in steps of at most
    ACTIVATION_STEP, with lengths and rates as they are; without a control it is 0."""
    every = Controls(np.ones(model.mj.nactuator, bool), controls.values)
    count = max(1, math.ceil(dt / ACTIVATION_STEP * (1.0 - 1e-9)))
    with _acting(model, state, every, dt / count) as s:
        s.data.qacc[:] = 0.0
        for _ in range(count):
            mujoco.mj_fwdActuation(s.mj, s.data)
            mujoco.mj_Euler(s.mj, s.data)
        return s.data.act.copy()


@contextmanager
def _acting(
    model: SolidModel, state: SolidState, controls: Controls, dt: float
) -> Iterator[Scratch]:
    """Working memory with MuJoCo's forces of the actuators that have a control at `state`; they
    are switched off again at the end."""
    s = scratch(model)
    s.set_time_step(dt)
    groups, flags = s.mj.actuator_group.copy(), int(s.mj.opt.disableflags)
    s.mj.actuator_group[:] = np.where(controls.told, 0, OFF)
    s.mj.opt.disableactuator = 1 << OFF
    s.mj.opt.disableflags = flags & ~int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    s.q[:], s.v[:], s.applied[:] = state.q, state.v, 0.0
    s.data.act[:], s.data.ctrl[:] = state.act, controls.values
    try:
        mujoco.mj_fwdPosition(s.mj, s.data)
        mujoco.mj_fwdVelocity(s.mj, s.data)
        mujoco.mj_fwdActuation(s.mj, s.data)
        yield s
    finally:
        s.mj.actuator_group[:] = groups
        s.mj.opt.disableactuator = 0
        s.mj.opt.disableflags = flags
        s.data.ctrl[:] = 0.0
        s.data.act[:] = 0.0
        s.data.time = 0.0


def _moment(s: Scratch) -> csr_array:
    """(n, nv) MuJoCo's sparse moments."""
    data, mj = s.data, s.mj
    starts, counts = data.moment_rowadr, data.moment_rownnz
    entries = np.concatenate(
        [np.zeros(0, np.int64), *map(np.arange, starts, starts + counts)], dtype=np.int64
    )
    pointers = np.concatenate([[0], np.cumsum(counts)])
    values, columns = data.actuator_moment.ravel()[entries], data.moment_colind.ravel()[entries]
    return csr_array((values, columns, pointers), (len(counts), mj.nv))


def _yields(s: Scratch, of: Array) -> Array:
    """(n,) -df/dx of all forces with a view x (n,) of lengths or rates, where it is positive."""
    here, forces = of.copy(), []
    for sign in (1.0, -1.0):
        of[:] = here + sign * PROBE
        mujoco.mj_fwdActuation(s.mj, s.data)
        forces.append(s.data.actuator_force.copy())
    of[:] = here
    return np.maximum((forces[1] - forces[0]) / (2.0 * PROBE), 0.0)


def _cut_off(s: Scratch, onto: Array) -> Integers:
    """Dofs of joints at their actuatorfrcrange, where forces do not yield."""
    mj = s.mj
    limited = mj.jnt_actfrclimited[mj.dof_jntid].astype(bool)
    least, most = mj.jnt_actfrcrange[mj.dof_jntid].T
    return np.flatnonzero(limited & ((onto <= least) | (onto >= most)))


def _in_pattern(moment: csr_array, pattern: Pattern) -> Mask:
    """(n,) whether the matrix of flesh has room for w J_a^T J_a. It lacks the entries between
    chains that a site and its reference site, or a slider and its crank, bring together."""
    known = pattern.matrix
    fits = np.zeros(moment.shape[0], bool)
    for n in range(fits.size):
        dofs = moment.indices[moment.indptr[n] : moment.indptr[n + 1]]
        fits[n] = known[dofs][:, dofs].nnz == dofs.size**2
    return fits

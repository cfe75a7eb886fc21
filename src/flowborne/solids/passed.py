"""How far joints are beyond their stops and equalities are open, at a state of the bodies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import mujoco
import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.solids.engine import row_jacobian
from flowborne.solids.geoms import element_name
from flowborne.solids.loops import active_equalities
from flowborne.solids.model import BALL, SLIDE, SolidModel, turning_dofs
from flowborne.solids.momentum import tendon_jacobian
from flowborne.solids.scratch import STOP_STEPS, posed, scratch, time_constant

DEGREE = float(np.radians(1.0))
"""rad that a joint may be beyond its range, and of its joints that a tendon may."""

SHARE = 0.01
"""Part of its range that a slide or a tendon may be beyond it; rad of its joints that an equality
may be off, whatever its softness."""


@dataclass(frozen=True)
class Passed:
    """A stop that is passed, or an equality that is open.

    name     of the element, after its kind
    amount   rad or m
    allowed  largest amount that is no reason for doubt
    turns    whether these are rad
    place    of a joint or tendon, rad or m; nan of an equality
    joint    number of a joint, else -1
    """

    name: str
    amount: float
    allowed: float
    turns: bool
    place: float = np.nan
    joint: int = -1

    @property
    def ratio(self) -> float:
        """Amount in parts of what is allowed."""
        return self.amount / self.allowed if self.allowed > 0.0 else np.inf

    def said(self, value: float) -> str:
        """An amount in the unit of a scene."""
        return f"{np.degrees(value):.3g} degrees" if self.turns else f"{value:.3g} m"


def passed_stops(model: SolidModel, q: Array) -> Iterator[Passed]:
    """Joints and tendons that are beyond their range at positions (nq,)."""
    mj = model.mj
    for j in np.flatnonzero(mj.jnt_limited).tolist():
        low, high = mj.jnt_range[j]
        place, turns = float(q[mj.jnt_qposadr[j]]), bool(mj.jnt_type[j] != SLIDE)
        if mj.jnt_type[j] == BALL:
            low, place = 0.0, float(2.0 * np.arccos(min(1.0, abs(place))))
        allowed = DEGREE if turns else SHARE * float(high - low)
        amount = float(max(low - place, place - high))
        if amount > 0.0:
            yield Passed(f"joint '{model.joint_names[j]}'", amount, allowed, turns, place, j)
    if not mj.tendon_limited.any():
        return
    lengths = _placed(model, q).ten_length
    turning = abs(tendon_jacobian(scratch(model)))[:, turning_dofs(model)].toarray()
    by_a_degree = DEGREE * turning.max(axis=1, initial=0.0)
    for t in np.flatnonzero(mj.tendon_limited).tolist():
        (low, high), place = mj.tendon_range[t], float(lengths[t])
        amount = float(max(low - place, place - high))
        if amount > 0.0:
            name = f"tendon '{element_name(mj, mujoco.mjtObj.mjOBJ_TENDON, t)}'"
            allowed = SHARE * float(high - low) + float(by_a_degree[t])
            yield Passed(name, amount, allowed, False, place)


@dataclass
class Equalities:
    """How far the equalities of a model are open, in one state after the other.

    An equality is a spring with a time constant T, at least of two steps, and an impedance d: it
    gives in by (1 - d) a T^2 to loads that would accelerate its bodies by a. Speeds that change
    within T and weight do so by

        a = V / T + g    so that    allowed = (1 - d) (V T + g T^2) + what SHARE rad of a joint do

    with V the largest speed so far at which the joints would open it together, rad/s or m/s.

    dt  of a step, s
    """

    model: SolidModel
    dt: float
    _fastest: dict[tuple[int, bool], float] = field(default_factory=dict)

    def at(self, q: Array, v: Array) -> Iterator[Passed]:
        """All of them at positions (nq,) and velocities (nv,)."""
        mj, turning = self.model.mj, turning_dofs(self.model)
        data = _placed(self.model, q)
        J = np.abs(row_jacobian(mj, data))
        of_equality = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        gravity = float(np.linalg.norm(self.model.gravity))
        for number, name in active_equalities(mj):
            T = max(time_constant(mj.eq_solref[number]), STOP_STEPS * self.dt)
            soft = 1.0 - float(mj.eq_solimp[number, 0])
            rows = np.flatnonzero(of_equality & (data.efc_id == number))
            for some, scale, turns in _parts(self.model, number, rows.tolist()):
                speed = float(np.linalg.norm(J[some] @ np.abs(v))) / scale
                V = self._fastest[number, turns] = max(
                    speed, self._fastest.get((number, turns), 0.0)
                )
                lever = float(J[some][:, turning].max(initial=0.0)) / scale
                allowed = soft * (V * T + (0.0 if turns else gravity * T**2)) + SHARE * lever
                amount = float(np.linalg.norm(data.efc_pos[some])) / scale
                yield Passed(f"equality '{name}'", amount, allowed, turns)


def _parts(
    model: SolidModel, number: int, rows: list[int]
) -> Iterator[tuple[list[int], float, bool]]:
    """Rows of an equality in one unit, what they are for 1 rad or 1 m, and whether it is rad."""
    mj, kinds = model.mj, mujoco.mjtEq
    kind = int(mj.eq_type[number])
    if kind == kinds.mjEQ_WELD:
        yield rows[:3], 1.0, False
        # these are the torque scale times the sine of half the angle
        scale = 0.5 * float(mj.eq_data[number, 10])
        if scale > 0.0:
            yield rows[3:], scale, True
    elif kind == kinds.mjEQ_JOINT:
        yield rows, 1.0, bool(mj.jnt_type[mj.eq_obj1id[number]] != SLIDE)
    elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_TENDON):
        yield rows, 1.0, False


def _placed(model: SolidModel, q: Array) -> mujoco.MjData:
    """MuJoCo's data with tendons and constraint rows at positions (nq,)."""
    s = posed(model, q)
    mujoco.mj_fwdPosition(s.mj, s.data)
    return s.data

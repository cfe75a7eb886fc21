"""Position, target, drive force and power of joints, for the history."""

from __future__ import annotations

import numpy as np

from flowborne.coupling.world import Setup
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.runs.frame_report import FrameReport
from flowborne.solids.model import HINGE, SLIDE, SolidModel

POSITION = {HINGE: ("angle", "rad"), SLIDE: ("position", "m")}
"""Kind of joint -> what its position is called, and its unit."""


class JointMeasures:
    """What a history says of joints.

    setup       of the world
    controlled  (n,) dofs of the controller
    chosen      joints with columns for their drive: True for all that are driven, or names
    told        joints that are told from outside

    angle_<joint>_rad, position_<joint>_m    of every hinge and slide
    target_<joint>_rad, target_<joint>_m     of those that are controlled, or chosen and prescribed
    torque_<joint>_Nm, force_<joint>_N       of the drive of a chosen joint, mean over the frame;
                                             with _x, _y, _z of a ball (axes of its body) and of a
                                             free joint (force: world axes, torque: its body's)
    power_<joint>_W                          of that drive, mean over the frame, so that power times
                                             frame time is the work that it did

    columns    names, in the order in which they are written
    positions  column -> place in q of every hinge and slide
    places     column of the position of each controlled joint -> its place among `controlled`
    """

    def __init__(
        self,
        setup: Setup,
        controlled: Integers,
        chosen: bool | tuple[str, ...],
        told: tuple[str, ...] = (),
    ) -> None:
        self._model, self._motions = setup.solid, setup.motions
        prescribed = _mask(self._model, [motion.dofs for motion in setup.motions])
        others = [self._model.dofs_of(joint) for joint in told]
        driven = prescribed | _mask(self._model, [controlled, *others])
        self.positions: dict[str, int] = {}
        self.places: dict[str, int] = {}
        self._decided: dict[str, int] = {}
        self._prescribed: dict[str, int] = {}
        self._force: list[tuple[str, int]] = []
        self._power: dict[str, Integers] = {}
        for name in _joints(self._model):
            dofs = self._model.dofs_of(name)
            named = driven[dofs].any() if isinstance(chosen, bool) else name in chosen
            named = bool(chosen and named)
            if (kind := _kind(self._model, name)) in POSITION:
                quantity, unit = POSITION[kind]
                position, target = f"{quantity}_{name}_{unit}", f"target_{name}_{unit}"
                self.positions[position] = int(self._model.positions_of(name)[0])
                if dofs[0] in controlled:
                    self.places[position] = int(np.flatnonzero(controlled == dofs[0])[0])
                    self._decided[target] = self.places[position]
                elif named and prescribed[dofs[0]]:
                    self._prescribed[target] = self.positions[position]
            if named:
                self._force += _components(self._model, name)
                self._power[f"power_{name}_W"] = dofs
        self.columns = (
            *self.positions,
            *self._decided,
            *self._prescribed,
            *(column for column, _ in self._force),
            *self._power,
        )

    def values(self, q: Array, time: float, report: FrameReport | None) -> dict[str, float]:
        """column -> number after the frame of `report`; before the first frame, targets of
        the controller, forces and powers are nan.

        q     (nq,) positions
        time  s
        """
        values = dict.fromkeys(self.columns, np.nan)
        values |= {column: float(q[place]) for column, place in self.positions.items()}
        if self._prescribed:
            target = self._target(q, time)
            values |= {column: float(target[place]) for column, place in self._prescribed.items()}
        if report is None:
            return values
        values |= {column: float(report.targets[n]) for column, n in self._decided.items()}
        if self._power:
            force, power = drive_means(report)
            values |= {column: float(force[dof]) for column, dof in self._force}
            values |= {column: float(power[dofs].sum()) for column, dofs in self._power.items()}
        return values

    def _target(self, q: Array, time: float) -> Array:
        """(nq,) `q` with the joints of prescribed motions where these are at `time`."""
        target = q.copy()
        for motion in self._motions:
            target[self._model.indices_of(motion.dofs)] = motion.position(time)
        return target


def drive_means(report: FrameReport) -> tuple[Array, Array]:
    """(nv,) generalised force (N or N m) and power (W) of the drives, means over a frame."""
    return report.mean(lambda step: step.actuator), report.mean(
        lambda step: step.actuator * step.velocity
    )


def _components(model: SolidModel, joint: str) -> list[tuple[str, int]]:
    """Column and dof of each component of a joint's drive; none that a slab locks."""
    dofs, kind = model.dofs_of(joint), _kind(model, joint)
    if kind in POSITION:
        column = f"torque_{joint}_Nm" if kind == HINGE else f"force_{joint}_N"
        return [(column, int(dofs[0]))]
    columns = [f"torque_{joint}_{axis}_Nm" for axis in "xyz"]
    if len(dofs) > len(columns):
        columns = [f"force_{joint}_{axis}_N" for axis in "xyz"] + columns
    found = zip(columns, dofs.tolist(), strict=True)
    return [(column, dof) for column, dof in found if not model.locked[dof]]


def _joints(model: SolidModel) -> list[str]:
    """Names of the joints that are not of flesh."""
    flesh, first = model.flesh, model.mj.jnt_dofadr
    names = enumerate(model.joint_names)
    return [name for j, name in names if flesh is None or not flesh.dofs[first[j]]]


def _kind(model: SolidModel, joint: str) -> int:
    return int(model.mj.jnt_type[model.joint(joint)])


def _mask(model: SolidModel, dofs: list[Integers]) -> Mask:
    mask = np.zeros(model.nv, bool)
    for some in dofs:
        mask[some] = True
    return mask

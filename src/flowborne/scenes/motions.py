"""Prescribed motions of joints: their tables, checks, trajectories and servos."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.base.tables import (
    ByKind,
    FileName,
    Number,
    Places,
    Positive,
    Table,
    Text,
    check_keyframes,
)
from flowborne.control.surroundings import Surroundings
from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.formula import RESERVED, Formula
from flowborne.motion.tracks import (
    Curve,
    TrajectoryConstant,
    TrajectoryFormula,
    TrajectoryKeyframes,
    TrajectorySinusoid,
)
from flowborne.solids.model import HINGE, JOINT_KINDS, SLIDE, SolidModel, joint_kind, joint_unit
from flowborne.solids.trajectories import ServoExact, ServoPD, Trajectory, driven


class ServoExactTable(Table):
    """The drive reaches every target exactly when it is due."""

    kind: Literal["exact"]

    def build(self, limit: float | tuple[float, ...]) -> ServoExact:
        """The servo, with drives of at most `limit`, N m or N; one for all dofs or one each."""
        return ServoExact(limit)


class ServoPDTable(Table):
    """Critically damped drive.

    frequency  Hz, its natural frequency
    """

    kind: Literal["pd"]
    frequency: Positive

    def build(self, limit: float | tuple[float, ...]) -> ServoPD:
        """The servo, with drives of at most `limit`, N m or N; one for all dofs or one each."""
        return ServoPD(2.0 * math.pi * self.frequency, limit)


ServoTable = Annotated[ServoExactTable | ServoPDTable, *ByKind]

EXACT = ServoExactTable(kind="exact")


class DrivenTable(Table):
    """Keys of every motion.

    joint         the joint
    servo         how the drive follows: "exact", or "pd" with its frequency, which lags a steady
                  motion by 1 / (pi frequency) s
    torque_limit  largest torque (N m) or force (N) of the drive, per m in a slab; unlimited unless
                  given
    """

    joint: Text
    servo: ServoTable = EXACT
    torque_limit: Positive | None = None

    def build(self, model: SolidModel, constants: Mapping[str, float]) -> Trajectory:
        """The motion in rad or m, with its servo; `constants` of its formula."""
        limit = math.inf if self.torque_limit is None else self.torque_limit
        unit, dofs = joint_unit(model, self.joint), model.dofs_of(self.joint)
        return driven(self._track(dofs, unit, constants), self.servo.build(limit))

    @property
    def rests(self) -> bool:
        """Whether the joint does not move."""
        return False

    def _track(self, dofs: Integers, unit: float, constants: Mapping[str, float]) -> Trajectory:
        raise NotImplementedError


class MotionConstantTable(DrivenTable):
    """Constant position or rate: position + rate * time.

    position  degrees or m
    rate      degrees/s or m/s
    """

    kind: Literal["constant"]
    position: Number = 0.0
    rate: Number = 0.0

    @property
    def rests(self) -> bool:
        return self.rate == 0.0

    def _track(self, dofs: Integers, unit: float, constants: Mapping[str, float]) -> Trajectory:
        return TrajectoryConstant(dofs, unit * self.position, unit * self.rate)


class MotionSinusoidTable(DrivenTable):
    """mean + amplitude * sin(360 degrees * time / period + phase).

    amplitude  degrees or m
    period     s
    mean       degrees or m
    phase      degrees
    """

    kind: Literal["sinusoid"]
    amplitude: Number
    period: Positive
    mean: Number = 0.0
    phase: Number = 0.0

    def _track(self, dofs: Integers, unit: float, constants: Mapping[str, float]) -> Trajectory:
        phase = math.radians(self.phase)
        return TrajectorySinusoid(dofs, unit * self.amplitude, self.period, unit * self.mean, phase)


class MotionKeyframesTable(DrivenTable):
    """Smooth curve through keyframes, still before the first and after the last.

    times   s, increasing
    values  degrees or m

    In a file, `file = "walk.csv"` (and `column`) may stand for times and values; see keyframe_file.
    """

    kind: Literal["keyframes"]
    times: tuple[Number, ...]
    values: tuple[Number, ...]

    @model_validator(mode="after")
    def _check(self) -> Self:
        check_keyframes(self.times, self.values, "values")
        return self

    def _track(self, dofs: Integers, unit: float, constants: Mapping[str, float]) -> Trajectory:
        return TrajectoryKeyframes(dofs, Curve(self.times, tuple(unit * v for v in self.values)))


class MotionFormulaTable(DrivenTable):
    """A formula in t (s), pi and the scene's [constants]; see `formula`.

    position  such as "amplitude * ramp(t) * sin(2*pi*t)", degrees or m. ramp(x, length) rises
              smoothly from 0 at x = 0 to 1 at x = length, which is 1 unless given; angles within a
              formula are radians
    """

    kind: Literal["formula"]
    position: Text

    def _track(self, dofs: Integers, unit: float, constants: Mapping[str, float]) -> Trajectory:
        return TrajectoryFormula(dofs, Formula(self.position, constants), unit)


class EarlierTable(Table):
    """[earlier]: an earlier run; joints repeat the motion that they had there.

    run     its folder, found from the folder of the scene file; in the folder of a run the file of
            what was taken from it
    joints  those that do; unless given all that were controlled there, or taken from a run before
            that, and that are neither controlled nor moved by a [[motion]] here
    """

    run: FileName
    joints: Annotated[tuple[Text, ...], Field(min_length=1)] | None = None


MotionTable = Annotated[
    MotionConstantTable | MotionSinusoidTable | MotionKeyframesTable | MotionFormulaTable, *ByKind
]


def check_motions(
    places: Places, tables: Sequence[MotionTable], around: Surroundings
) -> Iterator[str]:
    """Every motion moves a hinge or a slide of the model, and no other one moves it."""
    model = around.model
    seen: set[str] = set()
    for index, table in enumerate(tables):
        where = places.at("motion", index)
        unknown = [f"{where}: {problem}" for problem in around.unknown_joints([table.joint])]
        yield from unknown
        if table.joint in seen:
            yield f"{where}: joint '{table.joint}' has another [[motion]] above. Keep one of them."
        seen.add(table.joint)
        if unknown:
            continue
        kind = joint_kind(model, table.joint)
        if kind not in (HINGE, SLIDE):
            yield (
                f"{where}: joint '{table.joint}' is a {JOINT_KINDS[kind]}, and only hinges and "
                "slides follow a motion. Replace it by hinges in the model."
            )
        yield from (f"{where}: {problem}" for problem in out_of_plane(model, table.joint))


def out_of_plane(model: SolidModel, joint: str) -> Iterator[str]:
    """The problem when a joint of a slab has no motion within the plane."""
    if model.locked[model.dofs_of(joint)].all():
        yield (
            f"joint '{joint}' moves out of the plane of a scene of 2 "
            "dimensions. Turn its axis, or choose another joint."
        )


def check_formulas(
    places: Places, formulas: Mapping[str, str], constants: Mapping[str, float], times: Array
) -> Iterator[str]:
    """Names of constants, and formulas that are wrong, or not finite in a frame of the run.

    formulas  where each is, for messages -> its text
    times     (n,) of the frames, s
    """
    if not places.sound("constants"):
        return
    used: set[str] = set()
    wrong = []
    for where, text in formulas.items():
        try:
            formula = Formula(text, constants)
            used |= formula.names()
            for time in times:
                formula.at(float(time))
        except SceneError as error:
            wrong.append(f"{where}: {error}")
        except ArithmeticError as error:
            wrong.append(f"{where}: {error}. Change it, or end the run before.")
    yield from wrong
    for name in constants:
        if name in RESERVED or not name.isidentifier():
            yield f"{places.at('constants')}: '{name}' cannot be a constant's name. Change it."
        elif not (wrong or name in used) and places.sound(
            "motion", "actuator", "mouths", "force", "thruster"
        ):
            end = suggestion(name, used, "They use")
            yield f"{places.at('constants')}: no formula uses '{name}'{end}"

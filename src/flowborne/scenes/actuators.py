"""[[actuator]]: what the scene tells actuators of the model, their checks, and which tell none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Self

import numpy as np
from pydantic import model_validator

from flowborne.base.phrases import suggestion
from flowborne.base.tables import Number, Places, Table, Text, check_keyframes
from flowborne.control.commands import Control
from flowborne.control.surroundings import Surroundings
from flowborne.motion.formula import Formula
from flowborne.motion.tracks import Curve
from flowborne.solids.actuators import actuator_servos, unusable_actuator
from flowborne.solids.model import SolidModel
from flowborne.solids.motors import inputs_of, joint_of, moved_by


class ActuatorTable(Table):
    """[[actuator]]: control of an actuator of the model, as MuJoCo's `ctrl`; see `Control`.

    A frame holds the control of its middle; a position actuator that is a joint's servo gets that
    of the frame's end.

    name           of the actuator
    value          a number, or a formula in t (s), pi and the scene's [constants], such as
                   "20 * ramp(t) * sin(2*pi*t)"
    times, values  s, increasing, and controls of a smooth curve through keyframes in place of
                   `value`, still before the first and after the last

    In a file, `file = "thrust.csv"` (and `column`) may stand for times and values; see
    keyframe_file.
    """

    name: Text
    value: Number | Text | None = None
    times: tuple[Number, ...] = ()
    values: tuple[Number, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> Self:
        keyed = bool(self.times or self.values)
        if keyed == (self.value is not None):
            raise ValueError("has a value or times and values. Give one of the two")
        if keyed:
            check_keyframes(self.times, self.values, "values")
        return self

    @property
    def formula(self) -> str | None:
        """The text of its formula; None without one."""
        return self.value if isinstance(self.value, str) else None

    def control(self, constants: Mapping[str, float]) -> Callable[[float], float]:
        """Its control at a time (s)."""
        value = self.value
        if value is None:
            return Curve(self.times, self.values).value
        if isinstance(value, str):
            formula = Formula(value, constants)
            return lambda time: formula.at(time).value
        return lambda time: value


def scene_controls(
    tables: Sequence[ActuatorTable], model: SolidModel, constants: Mapping[str, float]
) -> Callable[[float, float], dict[str, Control]]:
    """Gives the controls by actuator of a frame that starts at a time (s) and takes a span (s)."""
    servos = (servo for servo in actuator_servos(model) if servo.even)
    at_end = {servo.number for servo in servos if servo.kind == "position"}
    parts = [
        (table.name, table.control(constants), 1.0 if model.actuator(table.name) in at_end else 0.5)
        for table in tables
    ]

    def controls(time: float, span: float) -> dict[str, Control]:
        return {name: Control(value(time + part * span)) for name, value, part in parts}

    return controls


def check_actuators(
    places: Places, tables: Sequence[ActuatorTable], moved: Mapping[str, str], around: Surroundings
) -> Iterator[str]:
    """Every table names another actuator that can act, and its joint is not moved otherwise.

    moved  joint -> what else moves it, in words
    """
    model, seen = around.model, set[str]()
    for index, table in enumerate(tables):
        where = places.at("actuator", index)
        unknown = list(unknown_actuators([table.name], around))
        yield from (f"{where}: {problem}" for problem in unknown)
        if table.name in seen:
            yield f"{where}: '{table.name}' has another [[actuator]] above. Keep one of them."
        seen.add(table.name)
        if unknown:
            continue
        number = model.actuator(table.name)
        inputs = inputs_of(model, number)
        if inputs.stop - inputs.start > 1:
            yield (
                f"{where}: '{table.name}' has {inputs.stop - inputs.start} controls, and a table "
                "gives one. Tell it by a [policy] or a script."
            )
        if (joint := joint_of(model, number)) is not None and joint in moved:
            yield (
                f"{where}: '{table.name}' drives joint '{joint}', which is {moved[joint]} as well. "
                "Keep one of the two."
            )


def unknown_actuators(names: Sequence[str], around: Surroundings) -> Iterator[str]:
    """A complaint for each actuator that the model lacks, or that cannot act."""
    model = around.model
    for name in names:
        if name not in model.actuator_names:
            end = suggestion(name, model.actuator_names, "Its actuators are")
            yield f"actuator '{name}' is not in {around.source}{end}"
        elif wrong := unusable_actuator(model, model.actuator(name)):
            yield wrong


def joints_of_actuators(model: SolidModel, names: Sequence[str]) -> tuple[str, ...]:
    """Joints that actuators drive: their own, or those that a tendon or crank spans."""
    dofs = [moved_by(model, model.actuator(name)) for name in names]
    numbers = np.unique(model.mj.dof_jntid[np.concatenate([np.zeros(0, np.int64), *dofs])])
    return tuple(model.joint_names[joint] for joint in numbers)

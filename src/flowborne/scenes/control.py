"""The controller of a scene: its tables, their checks and builder.

Angles are degrees, lengths metres, as everywhere in a scene.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from flowborne.base.phrases import suggestion
from flowborne.base.tables import Count, Places, Positive, Steps, StepsOrNone, Table, Text
from flowborne.control.controller import Controller, StrengthInPhase
from flowborne.control.executors import Mapper
from flowborne.control.gradients import AnyGradient, GradientCentralTable
from flowborne.control.objective_kinds import AnyObjective
from flowborne.control.objectives import ObjectiveSum
from flowborne.control.phases import PhaseTable
from flowborne.control.plan import Horizon
from flowborne.control.rules import AnyRule, RuleFixed
from flowborne.control.surroundings import Surroundings
from flowborne.control.trial import Hypothesis
from flowborne.scenes.motions import EXACT, ServoTable, out_of_plane
from flowborne.solids.model import FREE, SLIDE, SolidModel, joint_kind

MOST_STEPS_PER_DECISION = 1_000_000
"""Hypothetical steps; without a fluid they take a minute, with one hours."""

WHOLE = 1e-3
"""Part by which a number of steps may miss a whole one: times are written with a few digits."""


class StrengthInPhaseTable(Table):
    """An entry of in_phases of [[control]]: { strength = 75.0, phases = { ... } }.

    strength  as that of the table
    phases    when it counts, as of an objective
    """

    strength: Positive
    phases: PhaseTable


class ControlTable(Table):
    """[[control]]: joints that the controller moves.

    joints        their names
    strength      largest rate: degrees/s (hinge, ball) or m/s (slide)
    probe         displacement d of a trial: degrees or m
    torque_limit  largest torque (N m) or force (N) of the drive; unlimited by default
    in_phases     strengths that replace it at times; of several active ones the last counts
    """

    joints: Annotated[tuple[Text, ...], Field(min_length=1)]
    strength: Positive
    probe: Positive = 5.0
    torque_limit: Positive | None = None
    in_phases: tuple[StrengthInPhaseTable, ...] = ()

    @property
    def strengths(self) -> list[float]:
        """Its strength, and those of in_phases."""
        return [self.strength, *(other.strength for other in self.in_phases)]


class ControllerTable(Table):
    """[controller]: how the controlled joints decide.

    knots               number of decisions that a plan looks ahead, with a pose at each; a trial
                        simulates the plan, and objectives are means over it. Without it a decision
                        tries single poses
    gradient            "central" (2 trials a dof), "one-sided" (1 a dof and 1), or a registered one
    velocities          of the joints when a trial is measured: "removed" (steady state), "present"
                        (as now), or "probe" (of the trial's displacement)
    hypothetical_steps  steps of a trial's displacement
    hypothetical_time   s of one such step, or of one of a plan; the time of a frame unless given
    settle_steps        further steps of a trial in the fixed pose
    rule                "fixed", "resilient", "golden-section" or "quasi-newton" with their options,
                        or a registered one
    every               frames between decisions
    iterations          descent steps per decision, in the flow as it is then
    servo               "exact", or "pd" with its frequency
    """

    knots: Steps | None = None
    gradient: AnyGradient = GradientCentralTable(kind="central")
    velocities: Literal["removed", "present", "probe"] = "removed"
    hypothetical_steps: Steps = 1
    hypothetical_time: Positive | None = None
    settle_steps: StepsOrNone = 0
    rule: AnyRule = RuleFixed(kind="fixed")
    every: Count = 1
    iterations: Steps = 1
    servo: ServoTable = EXACT

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.knots is None:
            return self
        of_poses = ("velocities", "hypothetical_steps", "settle_steps")
        fields = type(self).model_fields  # a saved scene names all, with their defaults
        found = [key for key in of_poses if getattr(self, key) != fields[key].default]
        if found:
            raise ValueError(
                f"has knots, and {found[0]}, which is for trials of poses. Give one of the two"
            )
        return self

    def steps_between(self, frame_time: float) -> float:
        """Hypothetical steps from decision to decision, a whole number where there are knots."""
        return self.every * frame_time / (self.hypothetical_time or frame_time)

    def hypothesis(self, frame_time: float) -> Hypothesis | Horizon:
        """How a decision tries poses, or a plan."""
        if self.knots is None:
            dt = self.hypothetical_time or frame_time
            return Hypothesis(dt, self.hypothetical_steps, self.settle_steps, self.velocities)
        steps = round(self.steps_between(frame_time))
        return Horizon(self.every * frame_time / steps, steps, self.knots)

    def check(self, dofs: int, frame_time: float) -> Iterator[str]:
        """A plan's steps come out even with its knots, and a decision for `dofs` comes to its
        end."""
        between = self.steps_between(frame_time)
        steps = self.hypothetical_steps + self.settle_steps
        if self.knots is not None:
            number = round(between)
            if self.hypothetical_time and (number < 1 or abs(between - number) > WHOLE * between):
                interval = self.every * frame_time
                yield (
                    f"hypothetical_time is {self.hypothetical_time:g} s, and there are "
                    f"{interval:.4g} s from decision to decision, which is no whole number of "
                    f"steps. Give {interval / max(number, 1):.4g}, or leave it out to step by "
                    "frames."
                )
                return
            dofs, steps = dofs * self.knots, self.knots * number
        trials, gradients = self.gradient.trials(dofs), self.iterations * self.rule.estimates
        if gradients * trials * steps > MOST_STEPS_PER_DECISION:
            yield (
                f"a decision takes {gradients * trials * steps:.3g} steps ({trials:g} trials of "
                f"{steps:.3g} steps in each of {gradients} gradients), and "
                f"{MOST_STEPS_PER_DECISION:,} are the most. Give fewer knots, iterations or steps, "
                "or a longer hypothetical_time."
            )


def controller_of(
    controls: Sequence[ControlTable],
    objectives: Sequence[AnyObjective],
    how: ControllerTable,
    frame_time: float,
    around: Surroundings,
    executor: Mapper,
) -> Controller:
    """The controller that the tables describe; `executor` runs the trials."""
    each = [
        (table, around.unit(joint), int(dof))
        for table in controls
        for joint in table.joints
        for dof in around.dofs([joint])
    ]
    in_phases = [
        StrengthInPhase(
            tuple(n for n, (owner, _, _) in enumerate(each) if owner is table),
            tuple(unit * other.strength for owner, unit, _ in each if owner is table),
            other.phases.build(around),
        )
        for table in controls
        for other in table.in_phases
    ]
    limits = tuple(table.torque_limit or math.inf for table, _, _ in each)
    return Controller(
        np.array([dof for _, _, dof in each], dtype=np.int64),
        ObjectiveSum(tuple(table.term(around) for table in objectives)),
        how.hypothesis(frame_time),
        tuple(unit * table.strength for table, unit, _ in each),
        gradient=how.gradient.build(tuple(unit * table.probe for table, unit, _ in each)),
        rule=how.rule.build(around),
        every=how.every,
        iterations=how.iterations,
        servo=how.servo.build(limits),
        executor=executor,
        in_phases=tuple(in_phases),
    )


UNITS = {"velocity": "m^2/s^2", "speed": "m/s", "distance": "m"} | dict.fromkeys(
    ("wind-drag", "drag", "pressure-drag", "pressure-lift"), "N"
)
"""Kind of an objective -> unit of its value."""


def objective_unit(
    objectives: Sequence[AnyObjective], controlled: Sequence[str], model: SolidModel, *, slab: bool
) -> str:
    """Unit of the weighted sum of objectives of the controlled joints; "" where they have several,
    or one that is not known. In a slab forces are per metre of depth."""
    kinds = {joint_kind(model, joint) == SLIDE for joint in controlled}
    turning = {"effort": "N m s", "input-motion": "rad^2"} if kinds == {False} else {}
    sliding = {"effort": "N s", "input-motion": "m^2"} if kinds == {True} else {}
    known = UNITS | turning | sliding
    units = {known.get(table.kind, "") for table in objectives if table.weight}
    unit = units.pop() if len(units) == 1 else ""
    return "N/m" if slab and unit == "N" else unit


def check_control(
    places: Places,
    controls: Sequence[ControlTable],
    objectives: Sequence[AnyObjective],
    how: ControllerTable,
    frame_time: float,
    around: Surroundings,
) -> Iterator[str]:
    """Controlled joints and objectives against the model."""
    yield from _check_joints(places, controls, around)
    if controls and not objectives and places.sound("objectives"):
        yield (
            f"{places.at('control', 0)}: joints are controlled, but nothing is wanted of them. "
            "Add [[objectives]], or drop [[control]]."
        )
    if objectives and not controls and places.sound("control"):
        yield (
            f"{places.at('objectives', 0)}: something is wanted, but no joint is controlled. "
            "Add [[control]], or drop [[objectives]]."
        )
    for index, table in enumerate(objectives):
        where = places.at("objectives", index)
        yield from (f"{where}: {problem}" for problem in table.check(around))
        for problem in table.phases.check(around) if table.phases else ():
            yield f"{where}, phases: {problem}"
    if places.sound("control", "objectives"):
        yield from _check_wishes(places, objectives, around.controlled)
    if places.sound("controller", "time"):
        names, model = around.model.joint_names, around.model
        dofs = sum(len(model.dofs_of(joint)) for joint in around.controlled if joint in names)
        yield from (f"{places.at('controller')}: {said}" for said in how.check(dofs, frame_time))


def _check_wishes(
    places: Places, objectives: Sequence[AnyObjective], controlled: tuple[str, ...]
) -> Iterator[str]:
    """Only controlled joints have objectives, and every one has."""
    wishing: set[str] = set()
    for index, table in enumerate(objectives):
        wishing |= set(controlled if table.wanted_by is None else table.wanted_by)
        for joint in table.wanted_by or ():
            if joint not in controlled:
                end = suggestion(joint, controlled, "Controlled are")
                yield (
                    f"{places.at('objectives', index, 'wanted_by')}: joint '{joint}' is not "
                    f"controlled{end}"
                )
    for joint in controlled if wishing and wishing <= set(controlled) else ():
        if joint not in wishing:
            yield (
                f"{places.at('control')}: joint '{joint}' is controlled and wants nothing. Name it "
                "in wanted_by of an objective, or do not control it."
            )


def _check_joints(
    places: Places, controls: Sequence[ControlTable], around: Surroundings
) -> Iterator[str]:
    seen: set[str] = set()
    for index, table in enumerate(controls):
        where = places.at("control", index)
        for number, other in enumerate(table.in_phases, start=1):
            for problem in other.phases.check(around):
                yield f"{where}, in_phases {number}, phases: {problem}"
        for joint in table.joints:
            unknown = list(around.unknown_joints([joint]))
            yield from (f"{where}: {problem}" for problem in unknown)
            if joint in seen:
                yield f"{where}: joint '{joint}' is controlled twice. Name it once."
            seen.add(joint)
            if joint in around.followed:
                yield (
                    f"{where}: joint '{joint}' has a [[motion]] as well. "
                    "Take it out of one of the two."
                )
            if unknown:
                continue
            if joint_kind(around.model, joint) == FREE:
                yield (
                    f"{where}: joint '{joint}' is a free joint, and only hinges, slides and ball "
                    "joints have strength. Choose another joint."
                )
            else:
                yield from (f"{where}: {problem}" for problem in out_of_plane(around.model, joint))

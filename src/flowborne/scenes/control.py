"""Tables of a scene that describe the controller: joints, and how it decides.

Angles are degrees, lengths metres, as everywhere in a scene.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flowborne.base.tables import Count, Positive, Steps, StepsOrNone, Table, Text
from flowborne.control.gradients import AnyGradient, GradientCentralTable
from flowborne.control.phases import PhaseTable
from flowborne.control.rules import AnyRule, RuleFixed
from flowborne.scenes.motions import EXACT, ServoTable


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

    def steps_between(self, frame_time: float) -> float:
        """Hypothetical steps from decision to decision, a whole number where there are knots."""
        step = frame_time if self.hypothetical_time is None else self.hypothetical_time
        return self.every * frame_time / step

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

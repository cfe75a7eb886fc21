"""Tables of a scene that describe the controller: joints, objectives, how it decides.

Angles are degrees, lengths metres, as everywhere in a scene.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from flowborne.control.gradients import GRADIENTS
from flowborne.control.objectives import OBJECTIVES
from flowborne.control.rules import RULES
from flowborne.scenes.fields import (
    BUILT_IN,
    FUNCTION,
    OWN,
    ByKind,
    Count,
    Number,
    OwnTable,
    Parameters,
    Positive,
    Steps,
    StepsOrNone,
    Table,
    Text,
    Vector,
    by_kind_or_own,
)
from flowborne.scenes.schema_drives import EXACT, ServoTable


class PhaseIntervalsTable(Table):
    """On during intervals.

    intervals  [start, stop] of each, s; it is on at start and no longer at stop
    period     s after which they come again; they come once unless given
    """

    kind: Literal["intervals"]
    intervals: Annotated[tuple[tuple[Number, Number], ...], Field(min_length=1)]
    period: Positive | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        for start, stop in self.intervals:
            if stop <= start:
                raise ValueError(
                    f"has the interval [{start:g}, {stop:g}] s. Put the smaller time first"
                )
            if self.period is not None and stop - start > self.period:
                raise ValueError(
                    f"has the interval [{start:g}, {stop:g}] s, longer than its period of "
                    f"{self.period:g} s. Shorten it"
                )
        return self


class PhaseMotionTable(Table):
    """On while a prescribed motion moves, or is, on one side of a threshold.

    joint      whose [[motion]] it follows
    quantity   "velocity" (degrees/s or m/s) or "position" (degrees or m)
    side       "above" (threshold included) or "below"
    threshold  in the unit of the quantity
    """

    kind: Literal["motion"]
    joint: Text
    quantity: Literal["velocity", "position"] = "velocity"
    side: Literal["above", "below"] = "above"
    threshold: Number = 0.0


PhaseTable = Annotated[PhaseIntervalsTable | PhaseMotionTable, *ByKind]


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
    strength      fastest rate: degrees/s (hinge, ball) or m/s (slide)
    probe         displacement d of a hypothetical motion: degrees or m
    torque_limit  largest torque (N m) or force (N) of the drive; unlimited unless given
    in_phases     strengths in place of that one at times; where several are on, the last one counts
    """

    joints: Annotated[tuple[Text, ...], Field(min_length=1)]
    strength: Positive
    probe: Positive = 5.0
    torque_limit: Positive | None = None
    in_phases: tuple[StrengthInPhaseTable, ...] = ()


class ObjectiveTable(Table):
    """What every objective has.

    goal       "least" or "most" of it
    weight     its share in the sum
    phases     when it counts; always unless given
    wanted_by  controlled joints that want it; all of them unless given. Joints that want different
               things each follow their own sum
    """

    goal: Literal["least", "most"] = "least"
    weight: Positive = 1.0
    phases: PhaseTable | None = None
    wanted_by: Annotated[tuple[Text, ...], Field(min_length=1)] | None = None


class ObjectiveEffortTable(ObjectiveTable):
    """Effort of joints (eq. 1).

    joints  whose effort; that of every controlled joint unless given
    """

    kind: Literal["effort"]
    joints: Annotated[tuple[Text, ...], Field(min_length=1)] | None = None


class ObjectiveWindDragTable(ObjectiveTable):
    """Simple wind force (eqs. 2-4) on bodies along a direction.

    direction  of any length
    bodies     on which it acts; every body unless given
    """

    kind: Literal["wind-drag"]
    direction: Vector
    bodies: Annotated[tuple[Text, ...], Field(min_length=1)] | None = None


class ObjectiveDragTable(ObjectiveTable):
    """Force of the fluid and the winds on bodies along a direction.

    direction  of any length
    bodies     on which it acts; every body unless given
    """

    kind: Literal["drag"]
    direction: Vector
    bodies: Annotated[tuple[Text, ...], Field(min_length=1)] | None = None


class ObjectivePressureTable(ObjectiveTable):
    """Pressure force (eq. 10) on bodies along a direction; drag and lift differ by the name alone.

    direction  of any length
    bodies     on which it acts; every moving body unless given
    frame      body on which the direction rides; fixed in the world unless given
    """

    kind: Literal["pressure-drag", "pressure-lift"]
    direction: Vector
    bodies: Annotated[tuple[Text, ...], Field(min_length=1)] | None = None
    frame: Text | None = None


class ObjectiveInputMotionTable(ObjectiveTable):
    """Squared distance of a controlled joint from a motion that it would have on its own.

    joint          the joint
    times, values  keyframes of the motion of a hinge or slide, s and degrees or m; one value alone
                   is a fixed pose. Without them the motion is the clip's
    """

    kind: Literal["input-motion"]
    joint: Text
    times: Annotated[tuple[Number, ...], Field(min_length=1)] | None = None
    values: Annotated[tuple[Number, ...], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.values is None:
            if self.times is not None:
                raise ValueError("has times and no values. Give both, or neither")
            return self
        times = self.keyframe_times()
        if len(times) != len(self.values):
            raise ValueError(
                f"has {len(times)} times and {len(self.values)} values. Give as many of both"
            )
        for before, after in pairwise(times):
            if after <= before:
                raise ValueError(
                    f"has times that do not increase: {after:g} s after {before:g} s. "
                    "Put them in order, each once"
                )
        return self

    def keyframe_times(self) -> tuple[float, ...]:
        """s; 0 for a fixed pose."""
        return (0.0,) if self.times is None else self.times


class ObjectiveVelocityTable(ObjectiveTable):
    """Squared distance of a velocity from a target.

    body    whose velocity; that of the centre of mass of all bodies unless given
    target  m/s
    """

    kind: Literal["velocity"]
    body: Text | None = None
    target: Vector


class ObjectiveSpeedTable(ObjectiveTable):
    """Velocity along a direction; on a plan of several `knots`, the way made by its time.

    body       whose velocity; that of the centre of mass of all bodies unless given
    direction  of any length
    """

    kind: Literal["speed"]
    body: Text | None = None
    direction: Vector


class ObjectiveDistanceTable(ObjectiveTable):
    """Distance of a body from a point.

    body   whose; the origin of its frame counts
    point  m
    """

    kind: Literal["distance"]
    body: Text
    point: Vector


class ObjectivePythonTable(ObjectiveTable):
    """Python function that takes a Measurement and gives a number.

    function    "module:name"; the module is one that Python finds, or a file of `plugins`
    parameters  further arguments of the function, by name
    """

    kind: Literal["python"]
    function: Annotated[str, Field(pattern=FUNCTION)]
    parameters: Parameters = Field(default_factory=dict)


class ObjectiveOwnTable(ObjectiveTable, OwnTable):
    """An objective of the user's own; every further key is a parameter of it."""

    registry = OBJECTIVES


AnyObjective = Annotated[
    Annotated[
        ObjectiveEffortTable
        | ObjectiveWindDragTable
        | ObjectiveDragTable
        | ObjectivePressureTable
        | ObjectiveInputMotionTable
        | ObjectiveVelocityTable
        | ObjectiveSpeedTable
        | ObjectiveDistanceTable
        | ObjectivePythonTable,
        Field(discriminator="kind"),
        Tag(BUILT_IN),
    ]
    | Annotated[ObjectiveOwnTable, Tag(OWN)],
    *by_kind_or_own(OBJECTIVES),
]


class RuleFixed(Table):
    """The largest step down the gradient that strength allows."""

    kind: Literal["fixed"]


class RuleResilient(Table):
    """Steps and probes that halve where the descent turns back, and grow again where it goes on.

    least  part of strength and probe below which nothing shortens. In a fluid a probe that moves a
           body by less than a cell or so feels the grid
    """

    kind: Literal["resilient"]
    least: Annotated[float, Field(gt=0, le=1)] = 1.0 / 64.0


class RuleGoldenSection(Table):
    """Golden-section search along the gradient.

    reach      degrees or m that the joint that moves most may travel in the search; what strength
               allows unless given
    tolerance  part of the bracket at which the search ends
    """

    kind: Literal["golden-section"]
    reach: Positive | None = None
    tolerance: Annotated[float, Field(gt=0, lt=1)] = 0.02


class RuleQuasiNewton(Table):
    """Limited-memory BFGS over all joints that want the same.

    gradients  most in a decision, in as many poses
    """

    kind: Literal["quasi-newton"]
    gradients: Steps = 8


class RuleOwn(Table, OwnTable):
    """A rule of the user's own; every further key is a parameter of it."""

    registry = RULES


AnyRule = Annotated[
    Annotated[
        RuleFixed | RuleResilient | RuleGoldenSection | RuleQuasiNewton,
        Field(discriminator="kind"),
        Tag(BUILT_IN),
    ]
    | Annotated[RuleOwn, Tag(OWN)],
    *by_kind_or_own(RULES),
]


class GradientCentralTable(Table):
    """Central differences: two trials a dof."""

    kind: Literal["central"]


class GradientOneSidedTable(Table):
    """One-sided differences: a trial a dof and one of the present pose."""

    kind: Literal["one-sided"]


class GradientOwnTable(Table, OwnTable):
    """A gradient of the user's own; every further key is a parameter of it."""

    registry = GRADIENTS


AnyGradient = Annotated[
    Annotated[
        GradientCentralTable | GradientOneSidedTable, Field(discriminator="kind"), Tag(BUILT_IN)
    ]
    | Annotated[GradientOwnTable, Tag(OWN)],
    *by_kind_or_own(GRADIENTS),
]


class ControllerTable(Table):
    """[controller]: how the controlled joints decide.

    knots               decisions that a plan looks ahead, with a pose at each; a trial goes along
                        it, and objectives are their means on the way. Without it a decision tries
                        single poses
    gradient            "central" (2 trials a dof), "one-sided" (1 a dof and 1), or one's own
    velocities          during a trial's measurement: "removed" (steady state), "present" (as now),
                        or "probe" (those of the trial's own motion)
    hypothetical_steps  steps over which a trial makes its displacement
    hypothetical_time   s of one such step, or of one of a plan; the time of a frame unless given
    settle_steps        further steps of a trial in the fixed pose
    rule                "fixed", "resilient", "golden-section" or "quasi-newton" with their options,
                        or one's own
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

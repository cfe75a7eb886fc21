"""The built-in objectives, their keys in a scene, and the checks of these keys.

Paper: eq. (1) effort, eqs. (2)-(4) simple wind drag, eq. (10) pressure drag and lift. A new
objective is a class with `value` and a table with `build`, which is added to `BuiltInObjective`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, Tag, model_validator

from flowborne.base.tables import (
    BUILT_IN,
    FUNCTION,
    OWN,
    NotNegative,
    Number,
    OwnTable,
    Parameters,
    Table,
    Text,
    Vector,
    by_kind_or_own,
    check_keyframes,
    triple,
)
from flowborne.control.measurement import Measurement
from flowborne.control.objectives import OBJECTIVES, Objective, ObjectiveCallable
from flowborne.control.phases import PhaseTable
from flowborne.control.python_function import with_parameters
from flowborne.control.surroundings import Surroundings
from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.tracks import Curve, TrajectoryConstant, TrajectoryKeyframes
from flowborne.solids.model import HINGE, JOINT_KINDS, SLIDE, SolidModel, joint_kind
from flowborne.solids.trajectories import Trajectory

Direction = tuple[float, float, float]
Names = Annotated[tuple[Text, ...], Field(min_length=1)]


class ObjectiveTable(Table):
    """Keys of every objective.

    goal       "least" or "most"
    weight     its factor in the sum; 0 switches it off
    phases     when it is active; always by default
    wanted_by  controlled joints to which it applies; all by default. Joints with different
               objectives each follow their own sum
    """

    goal: Literal["least", "most"] = "least"
    weight: NotNegative = 1.0
    phases: PhaseTable | None = None
    wanted_by: Names | None = None

    @property
    def rests(self) -> bool:
        """Whether its optimum can be a pose at rest."""
        return True

    def check(self, around: Surroundings) -> Iterator[str]:
        """Everything that does not fit the scene."""
        yield from ()

    def build(self, around: Surroundings) -> Objective:
        """The objective; requires that `check` finds nothing."""
        raise NotImplementedError


def unit(direction: Direction) -> Array:
    """(3,) the unit vector of a direction. Raises ValueError for zero or infinite length."""
    vector = np.asarray(direction, dtype=np.float64)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
    if not 0.0 < length < np.inf:
        raise ValueError(f"direction is {direction}: give three finite numbers, not all zero")
    return vector / length


def velocity_of(body: int | None, measurement: Measurement) -> Array:
    """(3,) velocity of a body at the origin of its frame, or of the centre of mass of all, m/s."""
    return measurement.whole_velocity() if body is None else measurement.body_velocity(body)


@dataclass(frozen=True, eq=False)
class ObjectiveEffort:
    """Norm of the impulse of the drives of `dofs` in a step, eq. (1), N s or N m s.

    In a hypothetical step whose drives maintain the velocities of the joints it is the effort of
    section 2.3. In a real step it includes the impulse that changes the velocities.

    source  Lentine et al. 2011, section 2.3
    """

    dofs: Integers
    name: str = "effort"

    def value(self, measurement: Measurement) -> float:
        return float(np.linalg.norm(measurement.report.actuator[self.dofs])) * measurement.dt


class ObjectiveEffortTable(ObjectiveTable):
    """Effort of joints (eq. 1).

    joints  joints whose effort counts; all controlled joints by default
    """

    kind: Literal["effort"]
    joints: Names | None = None

    def check(self, around: Surroundings) -> Iterator[str]:
        for joint in self.joints or ():
            unknown = [*around.unknown_joints([joint])]
            yield from unknown
            if not unknown and joint not in around.driven and around.read("control", "motion"):
                yield (
                    f"joint '{joint}' makes no effort, being free. "
                    "Name joints of [[control]], [[motion]], [clip] or [earlier]."
                )

    def build(self, around: Surroundings) -> ObjectiveEffort:
        if self.joints is None:
            return ObjectiveEffort(around.dofs(around.controlled))
        return ObjectiveEffort(around.dofs(self.joints), f"effort_{'+'.join(self.joints)}")


def _no_direction(direction: tuple[float, ...]) -> Iterator[str]:
    if not any(direction):
        yield "direction is 0. Give a direction such as [1.0, 0.0, 0.0]."


class DirectedTable(ObjectiveTable):
    """A force on bodies along a direction.

    direction  of any length
    bodies     bodies on which it acts; every moving body by default
    """

    direction: Vector
    bodies: Names | None = None

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from around.unknown_bodies(self.bodies or ())
        yield from _no_direction(self.direction)


@dataclass(frozen=True, eq=False)
class ForceObjective:
    """A force on `bodies` along `direction`."""

    bodies: Integers
    direction: Direction

    def __post_init__(self) -> None:
        unit(self.direction)

    def component(self, wrench: Array, rotation: Array | None = None) -> float:
        """Component of the force of wrenches (nbody, 6) along the rotated direction, N."""
        along = unit(self.direction)
        along = along if rotation is None else rotation @ along
        return float(wrench[self.bodies, :3].sum(axis=0) @ along)


@dataclass(frozen=True, eq=False)
class ObjectiveWindDrag(ForceObjective):
    """Force of the simple winds on `bodies` along `direction`, eqs. (2)-(4), N.

    raises  ValueError for a direction of zero length
    source  Lentine et al. 2011, eqs. (2)-(4)
    """

    name: str = "wind-drag"

    def value(self, measurement: Measurement) -> float:
        return self.component(measurement.report.wind_wrench)


class ObjectiveWindDragTable(DirectedTable):
    """Simple wind force (eqs. 2-4) on bodies along a direction."""

    kind: Literal["wind-drag"]

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from super().check(around)
        if not around.has_wind and around.read("wind"):
            yield "there is no wind to drag. Add a [[wind]], or use 'pressure-drag'."

    def build(self, around: Surroundings) -> ObjectiveWindDrag:
        return ObjectiveWindDrag(around.bodies(self.bodies), triple(self.direction))


@dataclass(frozen=True, eq=False)
class ObjectiveDrag(ForceObjective):
    """Force of the winds and the moving fluid on `bodies` along `direction`, N; not buoyancy.

    raises  ValueError for a direction of zero length
    """

    name: str = "drag"

    def value(self, measurement: Measurement) -> float:
        report = measurement.report
        return self.component(report.wind_wrench + report.pressure_wrench + report.viscous_wrench)


class ObjectiveDragTable(DirectedTable):
    """Force of the fluid and the winds on bodies along a direction."""

    kind: Literal["drag"]

    def build(self, around: Surroundings) -> ObjectiveDrag:
        return ObjectiveDrag(around.bodies(self.bodies), triple(self.direction))


@dataclass(frozen=True, eq=False)
class ObjectivePressureDrag(ForceObjective):
    """Force of the fluid's pressure on `bodies` along `direction`, eq. (10), N.

    With a direction across the stream it is lift.

    frame   body in whose axes the direction is given; None: the world's axes
    raises  ValueError for a direction of zero length
    source  Lentine et al. 2011, section 4.3
    """

    frame: int | None = None
    name: str = "pressure-drag"

    def value(self, measurement: Measurement) -> float:
        rotation = None if self.frame is None else measurement.body_rotation(self.frame)
        return self.component(measurement.report.pressure_wrench, rotation)


class ObjectivePressureTable(DirectedTable):
    """Pressure force (eq. 10) on bodies along a direction; drag and lift differ by the name alone.

    frame      body in whose frame the direction is given; the world by default
    """

    kind: Literal["pressure-drag", "pressure-lift"]
    frame: Text | None = None

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from super().check(around)
        if not around.has_fluid and around.read("domain", "fluid"):
            yield "there is no fluid to press. Add a [domain], or use 'wind-drag'."
        if self.frame is not None:
            yield from around.unknown_bodies([self.frame])

    def build(self, around: Surroundings) -> ObjectivePressureDrag:
        frame = None if self.frame is None else around.model.body(self.frame)
        bodies = around.bodies(self.bodies)
        return ObjectivePressureDrag(bodies, triple(self.direction), frame, self.kind)


@dataclass(frozen=True, eq=False)
class ObjectiveInputMotion:
    """Sum of squared distances of joints from a given motion, rad^2 or m^2.

    The distance of a ball joint is the angle of the remaining rotation.

    dofs       (k,) all dofs of the joints, ascending
    reference  motion of these joints
    """

    dofs: Integers
    reference: Trajectory
    name: str = "input-motion"

    def value(self, measurement: Measurement) -> float:
        reference = self.reference.position(measurement.world.time)
        return float(np.sum(measurement.joints_away(self.dofs, reference) ** 2))


class ObjectiveInputMotionTable(ObjectiveTable):
    """Squared distance of a controlled joint from a given motion.

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
        if self.times is not None or self.values is not None:
            check_keyframes(self.keyframe_times(), self.values, "values", least=1)
        return self

    def keyframe_times(self) -> tuple[float, ...]:
        """s; 0 for a fixed pose."""
        return (0.0,) if self.times is None else self.times

    @property
    def rests(self) -> bool:
        return self.values is not None and len(set(self.values)) == 1

    def check(self, around: Surroundings) -> Iterator[str]:
        joint = self.joint
        unknown = [*around.unknown_joints([joint])]
        yield from unknown
        if unknown:
            return
        kind = joint_kind(around.model, joint)
        if self.values is None and joint not in around.in_clip:
            yield (
                f"there is no clip from which joint '{joint}' has a motion. Give times and values."
            )
        elif self.values is not None and kind not in (HINGE, SLIDE):
            yield (
                f"joint '{joint}' is a {JOINT_KINDS[kind]}, for which a table of values is too "
                "little. Name a hinge or a slide, or drop values to take the clip's motion."
            )
        if joint not in around.controlled and around.read("control", "motion"):
            yield (
                f"joint '{joint}' is not controlled. Add it to [[control]], or drop the objective."
            )

    def reference(self, around: Surroundings) -> Trajectory:
        """The given motion of the joint."""
        if self.values is None:
            return around.clip_of(self.joint)
        unit, dofs = around.unit(self.joint), around.model.dofs_of(self.joint)
        values = tuple(unit * value for value in self.values)
        if len(values) == 1:
            return TrajectoryConstant(dofs, values[0])
        return TrajectoryKeyframes(dofs, Curve(self.keyframe_times(), values))

    def build(self, around: Surroundings) -> ObjectiveInputMotion:
        return ObjectiveInputMotion(around.dofs([self.joint]), self.reference(around))


class MovingTable(ObjectiveTable):
    """A velocity.

    body  body whose velocity counts; by default the centre of mass of all bodies
    """

    body: Text | None = None

    @property
    def rests(self) -> bool:
        return False

    def body_in(self, model: SolidModel) -> int | None:
        """Number of the body, None for the centre of mass of all."""
        return None if self.body is None else model.body(self.body)

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from around.unknown_bodies(() if self.body is None else [self.body])


@dataclass(frozen=True, eq=False)
class ObjectiveVelocity:
    """Squared distance of a velocity from a target, m^2/s^2.

    body  its velocity is that of the origin of its frame. None: the centre of mass of all bodies,
          which only external forces accelerate: a trial changes it by the fluid's total impulse
    """

    body: int | None
    target: Direction
    name: str = "velocity"

    def value(self, measurement: Measurement) -> float:
        missing = velocity_of(self.body, measurement) - np.asarray(self.target)
        return float(missing @ missing)


class ObjectiveVelocityTable(MovingTable):
    """Squared distance of a velocity from a target.

    target  m/s
    """

    kind: Literal["velocity"]
    target: Vector

    def build(self, around: Surroundings) -> ObjectiveVelocity:
        return ObjectiveVelocity(self.body_in(around.model), triple(self.target))


@dataclass(frozen=True, eq=False)
class ObjectiveSpeed:
    """Velocity along a direction, m/s; the mean over a plan is the distance divided by its time.

    body    its velocity is that of the origin of its frame. None: the centre of mass of all bodies
    raises  ValueError for a direction of zero length
    """

    body: int | None
    direction: Direction
    name: str = "speed"

    def __post_init__(self) -> None:
        unit(self.direction)

    def value(self, measurement: Measurement) -> float:
        return float(velocity_of(self.body, measurement) @ unit(self.direction))


class ObjectiveSpeedTable(MovingTable):
    """Velocity along a direction; with several `knots`, the distance divided by the plan's time.

    direction  of any length
    """

    kind: Literal["speed"]
    direction: Vector

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from super().check(around)
        yield from _no_direction(self.direction)

    def build(self, around: Surroundings) -> ObjectiveSpeed:
        return ObjectiveSpeed(self.body_in(around.model), triple(self.direction))


@dataclass(frozen=True, eq=False)
class ObjectiveDistance:
    """Distance of the origin of a body's frame from a point, m.

    point  m, in the world
    """

    body: int
    point: Direction
    name: str = "distance"

    def value(self, measurement: Measurement) -> float:
        return float(np.linalg.norm(measurement.body_position(self.body) - np.asarray(self.point)))


class ObjectiveDistanceTable(ObjectiveTable):
    """Distance of a body from a point.

    body   the body; the origin of its frame counts
    point  m
    """

    kind: Literal["distance"]
    body: Text
    point: Vector

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from around.unknown_bodies([self.body])

    def build(self, around: Surroundings) -> ObjectiveDistance:
        return ObjectiveDistance(around.model.body(self.body), triple(self.point))


class ObjectivePythonTable(ObjectiveTable):
    """Python function that takes a Measurement and gives a number.

    function    "module:name"; the module is one that Python finds, or a file of `plugins`
    parameters  further arguments of the function, by name
    """

    kind: Literal["python"]
    function: Annotated[str, Field(pattern=FUNCTION)]
    parameters: Parameters = Field(default_factory=dict)

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from around.unusable_function(self.function, self.parameters)

    def build(self, around: Surroundings) -> ObjectiveCallable:
        return ObjectiveCallable(with_parameters(self.function, self.parameters), self.function)


class ObjectiveOwnTable(ObjectiveTable, OwnTable):
    """A user's objective; all further keys are its parameters."""

    registry = OBJECTIVES

    def build(self, around: Surroundings) -> Objective:
        return OBJECTIVES.make(self.kind, self.parameters)


BuiltInObjective = Annotated[
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

AnyObjective = Annotated[
    BuiltInObjective | Annotated[ObjectiveOwnTable, Tag(OWN)], *by_kind_or_own(OBJECTIVES)
]

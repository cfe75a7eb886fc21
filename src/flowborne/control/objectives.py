"""What the creature wants: objectives with a name and a scope that add, by weight and phase.

Every objective is minimised; to maximise one, give it a negative weight. Paper: eq. (1) effort,
eqs. (2)-(4) simple wind drag, eq. (10) pressure drag and lift.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from flowborne.control.measurement import Measurement
from flowborne.control.phases import PhaseAlways, Phases
from flowborne.coupling.motion import Trajectory
from flowborne.errors import PartError
from flowborne.registry import Registry

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Vector = tuple[float, float, float]


class Objective(Protocol):
    """A number that the creature wants small.

    One that has a `name` is written to the history under it, any other under its kind.
    """

    def value(self, measurement: Measurement) -> float:
        """The number in the measured state."""
        ...


OBJECTIVES: Registry[Objective] = Registry(
    "objective",
    methods=("value",),
    taken=(
        "effort",
        "wind-drag",
        "drag",
        "pressure-drag",
        "pressure-lift",
        "input-motion",
        "velocity",
        "speed",
        "distance",
        "python",
    ),
    keys=("goal", "weight", "phases", "wanted_by"),
)
"""Objectives of one's own."""


def name_of(objective: Objective) -> str:
    """Heading of an objective in the history: its `name`, else its kind, else its class."""
    given = type(objective).__name__
    return str(getattr(objective, "name", getattr(objective, "kind", given)))


def value_of(objective: Objective, measurement: Measurement) -> float:
    """The objective's number. Raises PartError when it fails, or gives anything else."""
    with PartError.guarding(f"objective '{name_of(objective)}'"):
        value = objective.value(measurement)
    if type(value) is float:
        return value
    if not isinstance(value, SupportsFloat) or np.ndim(value) != 0:
        raise PartError(
            f"objective '{name_of(objective)}' gave {value!r}, which is no number: return one"
        )
    return float(value)


def unit(direction: Vector) -> Array:
    """(3,) the direction with length one. Raises ValueError when it has no direction."""
    vector = np.asarray(direction, dtype=np.float64)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
    if not 0.0 < length < np.inf:
        raise ValueError(f"direction is {direction}: give three finite numbers, not all zero")
    return vector / length


def force(wrench: Array, bodies: Integers) -> Array:
    """(3,) total force on `bodies` of the wrenches (nbody, 6), N."""
    return wrench[bodies, :3].sum(axis=0)


def velocity_of(body: int | None, measurement: Measurement) -> Array:
    """(3,) velocity of a body at the origin of its frame, or of the centre of mass of all, m/s."""
    return measurement.whole_velocity() if body is None else measurement.body_velocity(body)


@dataclass(frozen=True, eq=False)
class ObjectiveEffort:
    """Impulse with which the drives of `dofs` hold their velocities, eq. (1), N s or N m s.

    The norm over the scope of actuator force times step. In a hypothetical step whose drives hold
    a velocity that the joints already have it is the effort of section 2.3; in a real step it is
    what the muscles did, the change of velocity included.

    source  Lentine et al. 2011, section 2.3
    """

    dofs: Integers
    name: str = "effort"

    def value(self, measurement: Measurement) -> float:
        return float(np.linalg.norm(measurement.report.actuator[self.dofs])) * measurement.dt


@dataclass(frozen=True, eq=False)
class ObjectiveWindDrag:
    """Force of the simple winds on `bodies` along `direction`, eqs. (2)-(4), N.

    raises  ValueError for a direction of no length
    source  Lentine et al. 2011, eqs. (2)-(4)
    """

    bodies: Integers
    direction: Vector
    name: str = "wind-drag"

    def __post_init__(self) -> None:
        unit(self.direction)

    def value(self, measurement: Measurement) -> float:
        return float(force(measurement.report.wind_wrench, self.bodies) @ unit(self.direction))


@dataclass(frozen=True, eq=False)
class ObjectiveDrag:
    """Force of the winds and the moving fluid on `bodies` along `direction`, N; not buoyancy.

    raises  ValueError for a direction of no length
    """

    bodies: Integers
    direction: Vector
    name: str = "drag"

    def __post_init__(self) -> None:
        unit(self.direction)

    def value(self, measurement: Measurement) -> float:
        report = measurement.report
        wrench = report.wind_wrench + report.pressure_wrench + report.viscous_wrench
        return float(force(wrench, self.bodies) @ unit(self.direction))


@dataclass(frozen=True, eq=False)
class ObjectivePressureDrag:
    """Force of the fluid's pressure on `bodies` along `direction`, eq. (10), N.

    With a direction across the stream it is lift.

    frame   body on which the direction rides (it is then given in that body's axes), or None
    raises  ValueError for a direction of no length
    source  Lentine et al. 2011, section 4.3
    """

    bodies: Integers
    direction: Vector
    frame: int | None = None
    name: str = "pressure-drag"

    def __post_init__(self) -> None:
        unit(self.direction)

    def value(self, measurement: Measurement) -> float:
        along = unit(self.direction)
        if self.frame is not None:
            along = measurement.body_rotation(self.frame) @ along
        return float(force(measurement.report.pressure_wrench, self.bodies) @ along)


@dataclass(frozen=True, eq=False)
class ObjectiveInputMotion:
    """Sum of squared distances of joints from a given motion, rad^2 or m^2.

    The distance of a ball joint is the angle of the rotation that is left.

    dofs       (k,) all dofs of the joints, ascending
    reference  motion of these joints
    """

    dofs: Integers
    reference: Trajectory
    name: str = "input-motion"

    def value(self, measurement: Measurement) -> float:
        wanted = self.reference.position(measurement.world.time)
        return float(np.sum(measurement.joints_away(self.dofs, wanted) ** 2))


@dataclass(frozen=True, eq=False)
class ObjectiveVelocity:
    """Squared distance of a velocity from a target, m^2/s^2.

    body  whose velocity it is, at the origin of its frame; None is the centre of mass of all, which
          outer forces alone can move: what a trial has won in it is the fluid's whole impulse
    """

    body: int | None
    target: Vector
    name: str = "velocity"

    def value(self, measurement: Measurement) -> float:
        missing = velocity_of(self.body, measurement) - np.asarray(self.target)
        return float(missing @ missing)


@dataclass(frozen=True, eq=False)
class ObjectiveSpeed:
    """Velocity along a direction, m/s. Over a plan it is the way made, by its time.

    body    whose velocity it is, at the origin of its frame; None is the centre of mass of all
    raises  ValueError for a direction of no length
    """

    body: int | None
    direction: Vector
    name: str = "speed"

    def __post_init__(self) -> None:
        unit(self.direction)

    def value(self, measurement: Measurement) -> float:
        return float(velocity_of(self.body, measurement) @ unit(self.direction))


@dataclass(frozen=True, eq=False)
class ObjectiveDistance:
    """Distance of the origin of a body's frame from a point, m.

    point  m, in the world
    """

    body: int
    point: Vector
    name: str = "distance"

    def value(self, measurement: Measurement) -> float:
        return float(np.linalg.norm(measurement.body_position(self.body) - np.asarray(self.point)))


@dataclass(frozen=True, eq=False)
class ObjectiveCallable:
    """Any function of the measurement (a picklable one, if the evaluations run in processes).

    A hypothetical world has no dye and no smoke.
    """

    function: Callable[[Measurement], float]
    name: str = "callable"

    def value(self, measurement: Measurement) -> float:
        return self.function(measurement)


@dataclass(frozen=True, eq=False)
class WeightedObjective:
    """An objective in a sum: its weight (negative to maximise), when it counts, and for whom.

    wanted_by  (k,) controlled dofs that want it; every one when None
    """

    objective: Objective
    weight: float = 1.0
    phases: Phases = field(default_factory=PhaseAlways)
    wanted_by: Integers | None = None


@dataclass(frozen=True, eq=False)
class ObjectiveSum:
    """Weighted sum of the terms that are on at the time of the decision.

    raises  ValueError when there is no term, or when a weight is not finite
    """

    terms: tuple[WeightedObjective, ...]

    def __post_init__(self) -> None:
        if not self.terms:
            raise ValueError("the objective has no term: give at least one")
        for term in self.terms:
            if not np.isfinite(term.weight):
                raise ValueError(
                    f"weight of objective '{name_of(term.objective)}' is {term.weight}: "
                    "give a finite number"
                )

    @classmethod
    def of(cls, objective: Objective, weight: float = 1.0) -> ObjectiveSum:
        """Sum of a single objective that always counts."""
        return cls((WeightedObjective(objective, weight),))

    def shared_out(self, dofs: Integers) -> list[tuple[Integers, ObjectiveSum]]:
        """Groups of places in `dofs` (n,) that want the same terms, each with their sum.

        raises  ValueError when a dof wants nothing
        """
        groups: dict[tuple[int, ...], list[int]] = {}
        for place, dof in enumerate(dofs):
            wanted = tuple(
                n
                for n, term in enumerate(self.terms)
                if term.wanted_by is None or dof in term.wanted_by
            )
            if not wanted:
                raise ValueError(f"controlled dof {dof} wants nothing: give it an objective")
            groups.setdefault(wanted, []).append(place)
        return [
            (np.array(places), ObjectiveSum(tuple(self.terms[n] for n in wanted)))
            for wanted, places in groups.items()
        ]

    def active(self, time: float) -> bool:
        """Whether any term counts at `time`."""
        return any(term.phases.active(time) for term in self.terms)

    def value(self, measurement: Measurement) -> float:
        """Sum of weight times value over the terms that are on."""
        now = measurement.phase_time
        return float(
            sum(
                term.weight * value_of(term.objective, measurement)
                for term in self.terms
                if term.phases.active(now)
            )
        )

    def values(self, measurement: Measurement) -> dict[str, float]:
        """Value of every term without its weight, on or off, under distinct names."""
        named: dict[str, float] = {}
        for term in self.terms:
            own, again = name_of(term.objective), 2
            name = own
            while name in named:
                name, again = f"{own}-{again}", again + 1
            named[name] = value_of(term.objective, measurement)
        return named

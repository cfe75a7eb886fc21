"""Objectives and their weighted sum, by phases and by joints.

Every objective is minimised; to maximise one, give it a negative weight. The built-in ones are in
`objective_kinds`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, SupportsFloat

import numpy as np

from flowborne.base.errors import PartError
from flowborne.control.measurement import Measurement
from flowborne.control.phases import PhaseAlways, Phases
from flowborne.kernels.arrays import Integers


class Objective(Protocol):
    """A number that the controller minimises.

    The history calls it by its `name`, or by its kind if it has none.
    """

    def value(self, measurement: Measurement) -> float:
        """Its value in the measured state."""
        ...


def name_of(objective: Objective) -> str:
    """Heading of an objective in the history: its `name`, else its kind, else its class."""
    given = type(objective).__name__
    return str(getattr(objective, "name", getattr(objective, "kind", given)))


def value_of(objective: Objective, measurement: Measurement) -> float:
    """The objective's number. Raises PartError if it fails, or returns anything else."""
    with PartError.guarding(f"objective '{name_of(objective)}'"):
        value = objective.value(measurement)
    if type(value) is float:
        return value
    if not isinstance(value, SupportsFloat) or np.ndim(value) != 0:
        raise PartError(
            f"objective '{name_of(objective)}' gave {value!r}, which is no number: return one"
        )
    return float(value)


@dataclass(frozen=True, eq=False)
class ObjectiveCallable:
    """Any function of the measurement; it must be picklable for evaluations in processes.

    A hypothetical world has no dye and no smoke.
    """

    function: Callable[[Measurement], float]
    name: str = "callable"

    def value(self, measurement: Measurement) -> float:
        return self.function(measurement)


@dataclass(frozen=True, eq=False)
class WeightedObjective:
    """An objective in a sum: its weight (negative to maximise), its phases and its joints.

    weight     0 switches it off
    wanted_by  (k,) controlled dofs to which it applies; all when None
    """

    objective: Objective
    weight: float = 1.0
    phases: Phases = field(default_factory=PhaseAlways)
    wanted_by: Integers | None = None

    def active(self, time: float) -> bool:
        """Whether it counts at `time`, s."""
        return self.weight != 0.0 and self.phases.active(time)


@dataclass(frozen=True, eq=False)
class ObjectiveSum:
    """Weighted sum of the terms that are active at the time of the decision.

    raises  ValueError if there is no term, or a weight is not finite
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
        """Sum of a single objective that is always active."""
        return cls((WeightedObjective(objective, weight),))

    def group_by_joints(self, dofs: Integers) -> list[tuple[Integers, ObjectiveSum]]:
        """Groups of indices into `dofs` (n,) with the same terms, each with the sum of these.

        raises  ValueError when a dof has no objective
        """
        groups: dict[tuple[int, ...], list[int]] = {}
        for index, dof in enumerate(dofs):
            numbers = tuple(
                n
                for n, term in enumerate(self.terms)
                if term.wanted_by is None or dof in term.wanted_by
            )
            if not numbers:
                raise ValueError(f"controlled dof {dof} has no objective: give it one")
            groups.setdefault(numbers, []).append(index)
        return [
            (np.array(indices), ObjectiveSum(tuple(self.terms[n] for n in numbers)))
            for numbers, indices in groups.items()
        ]

    def active(self, time: float) -> bool:
        """Whether any term is active at `time`."""
        return any(term.active(time) for term in self.terms)

    def value(self, measurement: Measurement) -> float:
        """Sum of weight times value over the active terms."""
        now = measurement.phase_time
        return float(
            sum(
                term.weight * value_of(term.objective, measurement)
                for term in self.terms
                if term.active(now)
            )
        )

    def values(self, measurement: Measurement) -> dict[str, float]:
        """Value of each term, active or not, without its weight, under distinct names."""
        named: dict[str, float] = {}
        for term in self.terms:
            own, again = name_of(term.objective), 2
            name = own
            while name in named:
                name, again = f"{own}-{again}", again + 1
            named[name] = value_of(term.objective, measurement)
        return named

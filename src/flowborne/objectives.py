"""What a creature may want, and how to add to it.

    @objectives.register("reach")
    @dataclass(frozen=True)
    class Reach:
        body: str
        height: float

        def value(self, measured: Measurement) -> float:
            return (measured.body(self.body).centre[2] - self.height) ** 2

A scene that names the file in `plugins` then has `[[objectives]]` of `kind = "reach"`, with `body`
and `height` as keys. Objectives are made small; `goal = "most"` in a scene, or a negative weight,
makes them large.
"""

from __future__ import annotations

from flowborne.control.measurement import Measurement
from flowborne.control.objective_kinds import (
    ObjectiveDistance,
    ObjectiveDrag,
    ObjectiveEffort,
    ObjectiveInputMotion,
    ObjectivePressureDrag,
    ObjectiveSpeed,
    ObjectiveVelocity,
    ObjectiveWindDrag,
)
from flowborne.control.objectives import (
    OBJECTIVES,
    Objective,
    ObjectiveCallable,
    ObjectiveSum,
    WeightedObjective,
)
from flowborne.control.phases import PhaseAlways, PhaseIntervals, Phases, PhaseTrack

__all__ = [
    "Measurement",
    "Objective",
    "ObjectiveCallable",
    "ObjectiveDistance",
    "ObjectiveDrag",
    "ObjectiveEffort",
    "ObjectiveInputMotion",
    "ObjectivePressureDrag",
    "ObjectiveSpeed",
    "ObjectiveSum",
    "ObjectiveVelocity",
    "ObjectiveWindDrag",
    "PhaseAlways",
    "PhaseIntervals",
    "PhaseTrack",
    "Phases",
    "WeightedObjective",
    "register",
]

register = OBJECTIVES.register

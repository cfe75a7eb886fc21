"""Parts of a creature's controller and output, and how to add your own.

    @parts.objective("reach")
    @dataclass(frozen=True)
    class Reach:
        body: str
        height: float

        def value(self, measured: Measurement) -> float:
            return (measured.body(self.body).centre[2] - self.height) ** 2

A scene that names the file in `plugins` can then use `[[objectives]]` of `kind = "reach"`, with
`body` and `height` as keys. Objectives are minimised; `goal = "most"` in a scene, or a negative
weight, maximises them.

A rule has `step` and `step_scale`; `FullStep` defines the latter for rules that always use the full
strength and probe. A gradient has a field `displacement`, which flowborne sets from the scene's
probes (rad or m for each dof), and `of` and `estimate`; `FiniteDifference` defines all except
`estimate`. An exporter has `write(run, path)` and is registered by the ending of its files; it
replaces a built-in one with the same ending. A shape has `distance(points)` and `half_extents()`;
in Python `PlacedShape(Torus(0.3, 0.1), "ring")` is one of the `shapes` of `SolidModel.from_string`.
"""

from __future__ import annotations

from flowborne.base.atomic import replaced_whole, write_atomically
from flowborne.control.gradients import (
    GRADIENTS,
    Estimate,
    FiniteDifference,
    Gradient,
    GradientCentral,
    GradientOneSided,
    Poses,
)
from flowborne.control.measurement import Measurement
from flowborne.control.objective_kinds import (
    OBJECTIVES,
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
    Objective,
    ObjectiveCallable,
    ObjectiveSum,
    WeightedObjective,
)
from flowborne.control.phases import PhaseAlways, PhaseIntervals, Phases, PhaseTrack
from flowborne.control.rules import (
    RULES,
    FixedStep,
    FullStep,
    GoldenSection,
    QuasiNewton,
    ResilientStep,
    Rule,
    descent,
)
from flowborne.control.station import keep_station
from flowborne.runs.exporters import EXPORTERS, Exporter, Written, endings
from flowborne.runs.states import StateArray
from flowborne.shapes.own import SHAPES, OwnGeometry, PlacedShape
from flowborne.view.open_run import OpenRun

__all__ = [
    "Estimate",
    "Exporter",
    "FiniteDifference",
    "FixedStep",
    "FullStep",
    "GoldenSection",
    "Gradient",
    "GradientCentral",
    "GradientOneSided",
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
    "OpenRun",
    "OwnGeometry",
    "PhaseAlways",
    "PhaseIntervals",
    "PhaseTrack",
    "Phases",
    "PlacedShape",
    "Poses",
    "QuasiNewton",
    "ResilientStep",
    "Rule",
    "StateArray",
    "WeightedObjective",
    "Written",
    "descent",
    "endings",
    "exporter",
    "gradient",
    "keep_station",
    "objective",
    "replaced_whole",
    "rule",
    "shape",
    "write_atomically",
]

__dir__ = __all__.copy

objective = OBJECTIVES.register
rule = RULES.register
gradient = GRADIENTS.register
exporter = EXPORTERS.register
shape = SHAPES.register

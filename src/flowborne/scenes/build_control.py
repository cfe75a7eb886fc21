"""The controller of a scene: dofs, objectives, gradient, rule, servo."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flowborne.control.controller import Controller, StrengthInPhase
from flowborne.control.executors import Mapper
from flowborne.control.objective_kinds import ObjectiveInputMotionTable
from flowborne.control.objectives import ObjectiveSum, WeightedObjective
from flowborne.control.phases import PhaseAlways
from flowborne.control.plan import Horizon
from flowborne.control.surroundings import Surroundings
from flowborne.control.trial import Hypothesis
from flowborne.coupling.motion import Trajectory
from flowborne.scenes.build_drives import servo_of
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_control import ControllerTable
from flowborne.scenes.surroundings import surroundings_of
from flowborne.solids.model import SolidModel

Integers = NDArray[np.int64]


def controller_of(scene: Scene, around: Surroundings, executor: Mapper) -> Controller:
    """The controller that the scene's tables describe.

    executor  runs the trials
    """
    dofs: list[int] = []
    strength: list[float] = []
    probe: list[float] = []
    limit: list[float] = []
    in_phases: list[StrengthInPhase] = []
    for table in scene.control:
        first, units = len(dofs), list[float]()
        for joint in table.joints:
            unit = around.unit(joint)
            for dof in around.dofs([joint]):
                dofs.append(int(dof))
                units.append(unit)
                strength.append(unit * table.strength)
                probe.append(unit * table.probe)
                limit.append(math.inf if table.torque_limit is None else table.torque_limit)
        in_phases += [
            StrengthInPhase(
                tuple(range(first, len(dofs))),
                tuple(unit * other.strength for unit in units),
                other.phases.build(around),
            )
            for other in table.in_phases
        ]
    how = scene.controller
    return Controller(
        np.array(dofs, dtype=np.int64),
        _objectives(scene, around),
        _hypothesis(how, scene.frame_time),
        tuple(strength),
        gradient=how.gradient.build(tuple(probe)),
        rule=how.rule.build(around),
        every=how.every,
        iterations=how.iterations,
        servo=servo_of(how.servo, tuple(limit)),
        executor=executor,
        in_phases=tuple(in_phases),
    )


def _hypothesis(table: ControllerTable, frame_time: float) -> Hypothesis | Horizon:
    """How a decision tries poses, or a plan."""
    if table.knots is None:
        dt = frame_time if table.hypothetical_time is None else table.hypothetical_time
        return Hypothesis(dt, table.hypothetical_steps, table.settle_steps, table.velocities)
    steps = round(table.steps_between(frame_time))
    return Horizon(table.every * frame_time / steps, steps, table.knots)


def _objectives(scene: Scene, around: Surroundings) -> ObjectiveSum:
    return ObjectiveSum(
        tuple(
            WeightedObjective(
                table.build(around),
                table.weight if table.goal == "least" else -table.weight,
                PhaseAlways() if table.phases is None else table.phases.build(around),
                None if table.wanted_by is None else around.dofs(table.wanted_by),
            )
            for table in scene.objectives
        )
    )


def input_motions(scene: Scene, model: SolidModel) -> dict[int, Trajectory]:
    """What joints are to be close to, by the number of the objective, from 0: keyframes or clip."""
    around = surroundings_of(scene, model)
    return {
        number: table.reference(around)
        for number, table in enumerate(scene.objectives)
        if isinstance(table, ObjectiveInputMotionTable)
    }

"""The controller of a scene: dofs, objectives, gradient, rule, servo."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flowborne.control.controller import Controller, StrengthInPhase
from flowborne.control.executors import Mapper
from flowborne.control.gradients import (
    GRADIENTS,
    Gradient,
    GradientCentral,
    GradientOneSided,
)
from flowborne.control.objectives import (
    OBJECTIVES,
    Objective,
    ObjectiveCallable,
    ObjectiveDistance,
    ObjectiveDrag,
    ObjectiveEffort,
    ObjectiveInputMotion,
    ObjectivePressureDrag,
    ObjectiveSpeed,
    ObjectiveSum,
    ObjectiveVelocity,
    ObjectiveWindDrag,
    WeightedObjective,
)
from flowborne.control.phases import PhaseAlways, PhaseIntervals, Phases, PhaseTrack
from flowborne.control.plan import Horizon
from flowborne.control.rules import (
    RULES,
    FixedStep,
    GoldenSection,
    QuasiNewton,
    ResilientStep,
    Rule,
)
from flowborne.control.trial import Hypothesis
from flowborne.coupling.motion import Trajectory
from flowborne.motion.clip_motion import TrajectoryPart
from flowborne.motion.tracks import Curve, TrajectoryConstant, TrajectoryKeyframes
from flowborne.scenes import schema_control as tables
from flowborne.scenes.bodies import joint_unit, posed
from flowborne.scenes.build_drives import servo_of
from flowborne.scenes.capture import clip_motion
from flowborne.scenes.fields import triple
from flowborne.scenes.python_function import with_parameters
from flowborne.scenes.schema import Scene
from flowborne.solids.model import SolidModel

Integers = NDArray[np.int64]


def controller_of(
    scene: Scene, model: SolidModel, motions: tuple[Trajectory, ...], executor: Mapper
) -> Controller:
    """The controller that the scene's tables describe.

    motions   the scene's prescribed motions, in its order
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
            unit = joint_unit(model, joint)
            for dof in _free_dofs(model, joint):
                dofs.append(dof)
                units.append(unit)
                strength.append(unit * table.strength)
                probe.append(unit * table.probe)
                limit.append(math.inf if table.torque_limit is None else table.torque_limit)
        in_phases += [
            StrengthInPhase(
                tuple(range(first, len(dofs))),
                tuple(unit * other.strength for unit in units),
                _phases(other.phases, scene, model, motions),
            )
            for other in table.in_phases
        ]
    how = scene.controller
    return Controller(
        np.array(dofs, dtype=np.int64),
        _objectives(scene, model, motions),
        _hypothesis(how, scene.frame_time),
        tuple(strength),
        gradient=_gradient(how.gradient, tuple(probe)),
        rule=_rule(how.rule, scene, model),
        every=how.every,
        iterations=how.iterations,
        servo=servo_of(how.servo, tuple(limit)),
        executor=executor,
        in_phases=tuple(in_phases),
    )


def _hypothesis(table: tables.ControllerTable, frame_time: float) -> Hypothesis | Horizon:
    """How a decision tries poses, or a plan."""
    if table.knots is None:
        dt = frame_time if table.hypothetical_time is None else table.hypothetical_time
        return Hypothesis(dt, table.hypothetical_steps, table.settle_steps, table.velocities)
    steps = round(table.steps_between(frame_time))
    return Horizon(table.every * frame_time / steps, steps, table.knots)


def _free_dofs(model: SolidModel, joint: str) -> list[int]:
    """Dofs of a joint that a slab does not lock."""
    return [int(dof) for dof in model.dofs_of(joint) if not model.locked[dof]]


def _dofs_of(model: SolidModel, joints: tuple[str, ...]) -> Integers:
    return np.array([dof for joint in joints for dof in _free_dofs(model, joint)], dtype=np.int64)


def _gradient(table: tables.AnyGradient, probe: tuple[float, ...]) -> Gradient:
    if isinstance(table, tables.GradientOwnTable):
        return GRADIENTS.make(table.kind, table.parameters, displacement=probe)
    central = isinstance(table, tables.GradientCentralTable)
    return GradientCentral(probe) if central else GradientOneSided(probe)


def _rule(table: tables.AnyRule, scene: Scene, model: SolidModel) -> Rule:
    if isinstance(table, tables.RuleOwn):
        return RULES.make(table.kind, table.parameters)
    if isinstance(table, tables.RuleFixed):
        return FixedStep()
    if isinstance(table, tables.RuleResilient):
        return ResilientStep(least=table.least)
    if isinstance(table, tables.RuleQuasiNewton):
        return QuasiNewton(table.gradients)
    unit = joint_unit(model, scene.controlled_joints()[0])
    reach = None if table.reach is None else unit * table.reach
    return GoldenSection(reach, table.tolerance)


def _objectives(scene: Scene, model: SolidModel, motions: tuple[Trajectory, ...]) -> ObjectiveSum:
    wanted, weighted = input_motions(scene, model), []
    for number, table in enumerate(scene.objectives):
        sign = 1.0 if table.goal == "least" else -1.0
        weighted.append(
            WeightedObjective(
                _objective(table, scene, model, wanted.get(number)),
                sign * table.weight,
                _phases(table.phases, scene, model, motions),
                None if table.wanted_by is None else _dofs_of(model, table.wanted_by),
            )
        )
    return ObjectiveSum(tuple(weighted))


def _objective(
    table: tables.AnyObjective, scene: Scene, model: SolidModel, wanted: Trajectory | None
) -> Objective:
    """wanted  what an input-motion is to be close to"""
    if isinstance(table, tables.ObjectiveEffortTable):
        if table.joints is None:
            return ObjectiveEffort(_dofs_of(model, scene.controlled_joints()))
        return ObjectiveEffort(_dofs_of(model, table.joints), f"effort_{'+'.join(table.joints)}")
    if isinstance(table, tables.ObjectiveWindDragTable):
        return ObjectiveWindDrag(_bodies(model, table.bodies), triple(table.direction))
    if isinstance(table, tables.ObjectiveDragTable):
        return ObjectiveDrag(_bodies(model, table.bodies), triple(table.direction))
    if isinstance(table, tables.ObjectivePressureTable):
        frame = None if table.frame is None else model.body(table.frame)
        bodies = _bodies(model, table.bodies)
        return ObjectivePressureDrag(bodies, triple(table.direction), frame, table.kind)
    if isinstance(table, tables.ObjectiveInputMotionTable):
        assert wanted is not None
        return ObjectiveInputMotion(_dofs_of(model, (table.joint,)), wanted)
    if isinstance(table, tables.ObjectiveVelocityTable):
        body = None if table.body is None else model.body(table.body)
        return ObjectiveVelocity(body, triple(table.target))
    if isinstance(table, tables.ObjectiveSpeedTable):
        body = None if table.body is None else model.body(table.body)
        return ObjectiveSpeed(body, triple(table.direction))
    if isinstance(table, tables.ObjectiveDistanceTable):
        return ObjectiveDistance(model.body(table.body), triple(table.point))
    if isinstance(table, tables.ObjectiveOwnTable):
        return OBJECTIVES.make(table.kind, table.parameters)
    function = with_parameters(table.function, table.parameters)
    return ObjectiveCallable(function, table.function)


def input_motions(scene: Scene, model: SolidModel) -> dict[int, Trajectory]:
    """What joints are to be close to, by the number of the objective, from 0: keyframes or clip."""
    tables_of = {
        number: table
        for number, table in enumerate(scene.objectives)
        if isinstance(table, tables.ObjectiveInputMotionTable)
    }
    of_clip = tuple(dict.fromkeys(t.joint for t in tables_of.values() if t.values is None))
    clip = clip_motion(scene, model, posed(scene, model).q, of_clip) if of_clip else None
    found: dict[int, Trajectory] = {}
    for number, table in tables_of.items():
        unit, dofs = joint_unit(model, table.joint), model.dofs_of(table.joint)
        if table.values is None:
            assert clip is not None
            found[number] = TrajectoryPart.of(clip, model, dofs)
        elif len(table.values) == 1:
            found[number] = TrajectoryConstant(dofs, unit * table.values[0])
        else:
            values = tuple(unit * value for value in table.values)
            found[number] = TrajectoryKeyframes(dofs, Curve(table.keyframe_times(), values))
    return found


def _bodies(model: SolidModel, names: tuple[str, ...] | None) -> Integers:
    """Numbers of the named bodies, or of all that can move."""
    if names is None:
        return np.flatnonzero(model.moving)
    return np.array([model.body(name) for name in names], dtype=np.int64)


def _phases(
    table: tables.PhaseIntervalsTable | tables.PhaseMotionTable | None,
    scene: Scene,
    model: SolidModel,
    motions: tuple[Trajectory, ...],
) -> Phases:
    if table is None:
        return PhaseAlways()
    if isinstance(table, tables.PhaseIntervalsTable):
        return PhaseIntervals(table.intervals, table.period)
    index = [motion.joint for motion in scene.motion].index(table.joint)
    sign = 1 if table.side == "above" else -1
    threshold = joint_unit(model, table.joint) * table.threshold
    return PhaseTrack(motions[index], table.quantity, sign, threshold)

"""The controller of a scene: its checks and builder."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from flowborne.base.phrases import suggestion
from flowborne.control.controller import Controller, StrengthInPhase
from flowborne.control.executors import Mapper
from flowborne.control.objective_kinds import ObjectiveInputMotionTable
from flowborne.control.objectives import ObjectiveSum, WeightedObjective
from flowborne.control.phases import PhaseAlways
from flowborne.control.plan import Horizon
from flowborne.control.surroundings import Surroundings
from flowborne.control.trial import Hypothesis
from flowborne.scenes.control import ControllerTable
from flowborne.scenes.draft import Draft
from flowborne.scenes.motions import out_of_plane
from flowborne.scenes.schema import Scene
from flowborne.solids.model import FREE, SolidModel, joint_kind
from flowborne.solids.trajectories import Trajectory


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
        units = [around.unit(joint) for joint in table.joints for _ in around.dofs([joint])]
        own = tuple(range(len(dofs), len(dofs) + len(units)))
        dofs += around.dofs(table.joints).tolist()
        strength += [unit * table.strength for unit in units]
        probe += [unit * table.probe for unit in units]
        limit += [math.inf if table.torque_limit is None else table.torque_limit] * len(units)
        in_phases += [
            StrengthInPhase(
                own, tuple(unit * other.strength for unit in units), other.phases.build(around)
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
        servo=how.servo.build(tuple(limit)),
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


def input_motions(scene: Scene, around: Surroundings) -> dict[int, Trajectory]:
    """The motions to which joints are to be close, by the number of the objective, from 0."""
    return {
        number: table.reference(around)
        for number, table in enumerate(scene.objectives)
        if isinstance(table, ObjectiveInputMotionTable)
    }


MOST_STEPS_PER_DECISION = 1_000_000
"""Hypothetical steps; without a fluid they take a minute, with one hours."""

WHOLE = 1e-3
"""Part by which a number of steps may miss a whole one: times are written with a few digits."""


def check_control(draft: Draft, around: Surroundings) -> Iterator[str]:
    """Controlled joints and objectives against the model."""
    scene = draft.scene
    yield from _check_joints(draft, around)
    if scene.control and not scene.objectives and draft.sound("objectives"):
        yield (
            f"{draft.at('control', 0)}: joints are controlled, but nothing is wanted of them. "
            "Add [[objectives]], or drop [[control]]."
        )
    if scene.objectives and not scene.control and draft.sound("control"):
        yield (
            f"{draft.at('objectives', 0)}: something is wanted, but no joint is controlled. "
            "Add [[control]], or drop [[objectives]]."
        )
    for index, table in enumerate(scene.objectives):
        where = draft.at("objectives", index)
        yield from (f"{where}: {problem}" for problem in table.check(around))
        for problem in table.phases.check(around) if table.phases else ():
            yield f"{where}, phases: {problem}"
    yield from _check_wishes(draft)
    if draft.sound("controller", "time"):
        yield from _check_horizon(draft) or _check_work(draft, around.model)


def _check_work(draft: Draft, model: SolidModel) -> list[str]:
    """A decision comes to its end."""
    scene, able = draft.scene, draft.scene.controller
    dofs = sum(len(model.dofs_of(j)) for j in scene.controlled_joints() if j in model.joint_names)
    steps = able.hypothetical_steps + able.settle_steps
    if able.knots is not None:
        dofs *= able.knots
        steps = able.knots * round(able.steps_between(scene.frame_time))
    trials, gradients = able.gradient.trials(dofs), able.rule.estimates
    asked = able.iterations * gradients * trials * steps
    if asked <= MOST_STEPS_PER_DECISION:
        return []
    return [
        f"{draft.at('controller')}: a decision takes {asked:.3g} steps ({trials:g} trials of "
        f"{steps:.3g} steps in each of {able.iterations * gradients} gradients), and "
        f"{MOST_STEPS_PER_DECISION:,} are the most. Give fewer knots, iterations or steps, or a "
        "longer hypothetical_time."
    ]


def _check_horizon(draft: Draft) -> list[str]:
    """The steps of a plan come out even with its knots."""
    able, frame_time = draft.scene.controller, draft.scene.frame_time
    if able.knots is None or able.hypothetical_time is None:
        return []
    interval, steps = able.every * frame_time, able.steps_between(frame_time)
    if round(steps) < 1 or abs(steps - round(steps)) > WHOLE * steps:
        number = max(round(steps), 1)
        return [
            f"{draft.at('controller')}: hypothetical_time is {able.hypothetical_time:g} s, and "
            f"there are {interval:.4g} s from decision to decision, which is no whole number of "
            f"steps. Give {interval / number:.4g}, or leave it out to step by frames."
        ]
    return []


def _check_wishes(draft: Draft) -> Iterator[str]:
    """Only controlled joints have objectives, and every one has."""
    scene, controlled = draft.scene, draft.scene.controlled_joints()
    if not draft.sound("control", "objectives"):
        return
    wishing: set[str] = set()
    for index, table in enumerate(scene.objectives):
        wishing |= set(controlled if table.wanted_by is None else table.wanted_by)
        for joint in table.wanted_by or ():
            if joint not in controlled:
                end = suggestion(joint, controlled, "Controlled are")
                yield (
                    f"{draft.at('objectives', index, 'wanted_by')}: joint '{joint}' is not "
                    f"controlled{end}"
                )
    for joint in () if wishing - set(controlled) else controlled:
        if scene.objectives and joint not in wishing:
            yield (
                f"{draft.at('control')}: joint '{joint}' is controlled and wants nothing. Name it "
                "in wanted_by of an objective, or do not control it."
            )


def _check_joints(draft: Draft, around: Surroundings) -> Iterator[str]:
    scene, model = draft.scene, around.model
    moved = {table.joint for table in scene.motion}
    seen: set[str] = set()
    for index, table in enumerate(scene.control):
        where = draft.at("control", index)
        for number, other in enumerate(table.in_phases, start=1):
            for problem in other.phases.check(around):
                yield f"{where}, in_phases {number}, phases: {problem}"
        for joint in table.joints:
            unknown = draft.unknown_joint(model, joint, "control", index)
            yield from unknown
            if joint in seen:
                yield f"{where}: joint '{joint}' is controlled twice. Name it once."
            seen.add(joint)
            if joint in moved:
                yield (
                    f"{where}: joint '{joint}' has a [[motion]] as well. "
                    "Take it out of one of the two."
                )
            if unknown:
                continue
            if joint_kind(model, joint) == FREE:
                yield (
                    f"{where}: joint '{joint}' is a free joint, and only hinges, slides and ball "
                    "joints have strength. Choose another joint."
                )
            else:
                yield from (f"{where}: {problem}" for problem in out_of_plane(model, joint))

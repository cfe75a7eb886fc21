"""Contradictions between the controller's tables, the model and the rest of a scene."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.errors import SceneError
from flowborne.phrases import suggestion
from flowborne.scenes.bodies import FREE, HINGE, JOINT_KINDS, SLIDE, joint_kind
from flowborne.scenes.capture import capture_of, followers
from flowborne.scenes.check_bodies import out_of_plane, unknown_body, unknown_joint
from flowborne.scenes.draft import Draft
from flowborne.scenes.earlier import earlier_joints
from flowborne.scenes.python_function import with_parameters
from flowborne.scenes.schema_control import (
    ObjectiveDistanceTable,
    ObjectiveDragTable,
    ObjectiveEffortTable,
    ObjectiveInputMotionTable,
    ObjectivePressureTable,
    ObjectivePythonTable,
    ObjectiveSpeedTable,
    ObjectiveVelocityTable,
    ObjectiveWindDragTable,
    PhaseIntervalsTable,
    PhaseMotionTable,
    RuleQuasiNewton,
)
from flowborne.solids.model import SolidModel

MOST_STEPS_PER_DECISION = 1_000_000
"""Hypothetical steps; without a fluid they take a minute, with one hours."""

WHOLE = 1e-3
"""Part by which a number of steps may miss a whole one: times are written with a few digits."""


def check_control(draft: Draft, model: SolidModel) -> Iterator[str]:
    """Controlled joints and objectives against the model."""
    scene = draft.scene
    yield from _check_joints(draft, model)
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
    for index in range(len(scene.objectives)):
        yield from _check_objective(draft, model, index)
    yield from _check_wishes(draft)
    if draft.sound("controller", "time"):
        yield from _check_horizon(draft) or _check_work(draft, model)


def _check_work(draft: Draft, model: SolidModel) -> list[str]:
    """A decision comes to its end."""
    scene, able = draft.scene, draft.scene.controller
    dofs = sum(len(model.dofs_of(j)) for j in scene.controlled_joints() if j in model.joint_names)
    steps = able.hypothetical_steps + able.settle_steps
    if able.knots is not None:
        dofs *= able.knots
        steps = able.knots * round(able.steps_between(scene.frame_time))
    trials = dofs + 1 if able.gradient.kind == "one-sided" else 2 * dofs
    gradients = able.rule.gradients if isinstance(able.rule, RuleQuasiNewton) else 1
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
    """Only controlled joints want something, and every one does."""
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


def _check_joints(draft: Draft, model: SolidModel) -> Iterator[str]:
    scene = draft.scene
    moved = {table.joint for table in scene.motion}
    seen: set[str] = set()
    for index, table in enumerate(scene.control):
        where = draft.at("control", index)
        for number, other in enumerate(table.in_phases, start=1):
            yield from _check_phases(draft, f"{where}, in_phases {number}", other.phases)
        for joint in table.joints:
            unknown = unknown_joint(draft, model, joint, "control", index)
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
                yield from out_of_plane(draft, model, joint, "control", index)


def _check_objective(draft: Draft, model: SolidModel, index: int) -> Iterator[str]:
    scene, table = draft.scene, draft.scene.objectives[index]
    where = draft.at("objectives", index)
    driven = {*scene.told_joints(), *earlier_joints(scene)}
    capture = capture_of(scene)
    if capture is not None:
        driven |= set(followers(scene, capture, model))
    whole = draft.sound("control", "motion")
    if isinstance(table, ObjectiveEffortTable):
        for joint in table.joints or ():
            unknown = unknown_joint(draft, model, joint, "objectives", index)
            yield from unknown
            if not unknown and joint not in driven and whole:
                yield (
                    f"{where}: joint '{joint}' makes no effort, being free. "
                    "Name joints of [[control]], [[motion]], [clip] or [earlier]."
                )
    directed = ObjectiveWindDragTable | ObjectiveDragTable | ObjectivePressureTable
    if isinstance(table, directed):
        for body in table.bodies or ():
            yield from unknown_body(draft, model, body, "objectives", index)
    if isinstance(table, directed | ObjectiveSpeedTable) and not any(table.direction):
        yield f"{where}: direction is 0. Give a direction such as [1.0, 0.0, 0.0]."
    if isinstance(table, ObjectiveWindDragTable) and not scene.wind and draft.sound("wind"):
        yield f"{where}: there is no wind to drag. Add a [[wind]], or use 'pressure-drag'."
    if isinstance(table, ObjectivePressureTable):
        if not scene.has_fluid and draft.sound("domain", "fluid"):
            yield f"{where}: there is no fluid to press. Add a [domain], or use 'wind-drag'."
        if table.frame is not None:
            yield from unknown_body(draft, model, table.frame, "objectives", index, "frame")
    if isinstance(table, ObjectiveInputMotionTable):
        unknown = unknown_joint(draft, model, table.joint, "objectives", index)
        yield from unknown
        if not unknown and table.values is None:
            if capture is None or table.joint not in capture.mapping:
                yield (
                    f"{where}: there is no clip from which joint '{table.joint}' has a motion. "
                    "Give times and values."
                )
        elif not unknown and joint_kind(model, table.joint) not in (HINGE, SLIDE):
            kind = JOINT_KINDS[joint_kind(model, table.joint)]
            yield (
                f"{where}: joint '{table.joint}' is a {kind}, for which a table of values is too "
                "little. Name a hinge or a slide, or drop values to take the clip's motion."
            )
        if not unknown and table.joint not in scene.controlled_joints() and whole:
            yield (
                f"{where}: joint '{table.joint}' is not controlled. "
                "Add it to [[control]], or drop the objective."
            )
    of_body = ObjectiveVelocityTable | ObjectiveSpeedTable | ObjectiveDistanceTable
    if isinstance(table, of_body) and table.body is not None:
        yield from unknown_body(draft, model, table.body, "objectives", index)
    if isinstance(table, ObjectivePythonTable) and draft.sound("plugins"):
        try:
            with_parameters(table.function, table.parameters)
        except SceneError as error:
            yield f"{where}: {error}"
    yield from _check_phases(draft, where, table.phases)


def _check_phases(
    draft: Draft, where: str, phases: PhaseIntervalsTable | PhaseMotionTable | None
) -> Iterator[str]:
    """A motion that phases follow is there."""
    followed = {motion.joint for motion in draft.scene.motion}
    if (
        isinstance(phases, PhaseMotionTable)
        and draft.sound("motion")
        and phases.joint not in followed
    ):
        yield (
            f"{where}, phases: joint '{phases.joint}' has no [[motion]] to follow. "
            "Add one, or give phases as intervals."
        )

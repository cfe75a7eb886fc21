"""Contradictions between a scene and its model: names, initial state, motions, winds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flowborne.control.surroundings import Surroundings
from flowborne.phrases import suggestion
from flowborne.scenes.bodies import initial_state, keyframes
from flowborne.scenes.draft import Draft
from flowborne.scenes.earlier import earlier_joints
from flowborne.scenes.flesh import check_flesh_places
from flowborne.scenes.motions import MotionFormulaTable, check_formulas, check_motions
from flowborne.solids.dynamics import kinematics
from flowborne.solids.joint_kinds import (
    BALL,
    FREE,
    HINGE,
    JOINT_KINDS,
    SLIDE,
    joint_kind,
    joint_unit,
)
from flowborne.solids.model import SolidModel

Array = NDArray[np.float64]

NEEDS_BODIES = (
    "clip",
    "earlier",
    "constants",
    "flesh",
    "shapes",
    "initial",
    "motion",
    "wind",
    "mouths",
    "control",
    "objectives",
    "controller",
)


def check_without_bodies(draft: Draft) -> Iterator[str]:
    """Tables that speak of bodies need bodies."""
    if draft.scene.has_bodies or not draft.sound("solids", "human"):
        return
    for table in NEEDS_BODIES:
        if draft.gives(table):
            yield (
                f"{draft.at(table)}: there are no bodies. "
                "Add [solids] with a model, or drop this table."
            )
    output = draft.scene.output
    for key, named in (("bodies", output.bodies), ("joints", output.joints)):
        if named and named is not True:
            yield (
                f"{draft.at('output', key)}: there are no bodies. "
                "Add [solids] with a model, or drop this key."
            )


PLACED = "Place the clip by offset and heading in [clip]"
"""What to do about a creature outside the domain that a clip moves."""


def check_bodies(draft: Draft, around: Surroundings) -> Iterator[str]:
    """Names, initial state, motions and winds against the model."""
    scene, model = draft.scene, around.model
    if scene.shapes and scene.solids is None:
        yield (
            f"{draft.at('shapes')}: they are on bodies of a model file. "
            "Add [solids] with a model, or drop [[shapes]]."
        )
    named = []
    for body in () if scene.solids is None else scene.solids.densities:
        named += draft.unknown_body(model, body, "solids", "densities")
    named += _unheld(draft, model)
    for body in scene.output.bodies:
        named += draft.unknown_body(model, body, "output", "bodies")
    joints = scene.output.joints
    for joint in () if isinstance(joints, bool) else joints:
        named += draft.unknown_joint(model, joint, "output", "joints")
    if scene.film.camera.follow not in ("bodies", "nothing"):
        named += draft.unknown_body(model, scene.film.camera.follow, "film", "camera", "follow")
    for index, wind in enumerate(scene.wind):
        named += [f"{draft.at('wind', index)}: {problem}" for problem in wind.check(around)]
    yield from named
    state = [
        *check_initial(draft, model),
        *check_motions(draft, draft.scene.motion, around),
        *check_formulas(draft, _formulas(draft), scene.constants, scene.frame_times()),
    ]
    yield from state
    if not named and not state and draft.sound("initial", "motion", "constants"):
        yield from _check_ranges(draft, model)
        yield from _check_places(draft, model)


def _unheld(draft: Draft, model: SolidModel) -> list[str]:
    """Joints of [solids] hold that cannot be held."""
    scene = draft.scene
    hold = () if scene.solids is None or scene.solids.hold is True else scene.solids.hold or ()
    where, problems = draft.at("solids", "hold"), []
    moved = {table.joint: "a [[motion]]" for table in scene.motion}
    moved |= dict.fromkeys(scene.controlled_joints(), "[[control]]")
    for joint in hold:
        unknown = draft.unknown_joint(model, joint, "solids", "hold")
        problems += unknown
        if not unknown and joint_kind(model, joint) == FREE:
            problems.append(f"{where}: '{joint}' is a free joint, by which a body floats. Drop it.")
        elif joint in moved:
            problems.append(f"{where}: joint '{joint}' has {moved[joint]}. Keep one of them.")
    return problems


def check_initial(draft: Draft, model: SolidModel) -> Iterator[str]:
    """The pose and the velocities that a scene starts with against the model's joints."""
    initial = draft.scene.initial
    if initial.keyframe is not None:
        own, where = keyframes(draft.scene, model), draft.at("initial", "keyframe")
        keys = [own.key(n).name for n in range(own.nkey)]
        if initial.keyframe not in keys:
            end = suggestion(initial.keyframe, keys, "Its keyframes are")
            yield f"{where}: the model has no '{initial.keyframe}'{end}"
            return
        if own is not model.mj and not all(own.joint(j).name for j in range(own.njnt)):
            yield (
                f"{where}: the model has nameless joints, which with flesh and floating bodies are "
                "not found in a keyframe. Name them."
            )
            return
    if initial.impulse == "none" and not any(
        joint_kind(model, joint) == FREE for joint in model.joint_names
    ):
        yield (
            f"{draft.at('initial', 'impulse')}: 'none' is for creatures that float, and the model "
            "has no free joint. Drop it."
        )
    moved = {table.joint: "a [[motion]]" for table in draft.scene.motion}
    moved |= dict.fromkeys(earlier_joints(draft.scene), "a motion of the [earlier] run")
    for key, values in (("positions", initial.positions), ("velocities", initial.velocities)):
        for joint, numbers in values.items():
            where = draft.at("initial", key)
            unknown = draft.unknown_joint(model, joint, "initial", key)
            yield from unknown
            if unknown:
                continue
            kind = joint_kind(model, joint)
            places = model.positions_of(joint) if key == "positions" else model.dofs_of(joint)
            if len(numbers) != len(places):
                yield (
                    f"{where}: joint '{joint}' is a {JOINT_KINDS[kind]} and has {len(numbers)} "
                    f"numbers. Give {len(places)}."
                )
            elif joint in moved:
                yield (
                    f"{where}: joint '{joint}' has {moved[joint]}, which says where it starts. "
                    "Drop one of them."
                )
            elif key == "positions" and kind in (BALL, FREE) and not any(numbers[-4:]):
                yield f"{where}: the quaternion of joint '{joint}' is 0. Give (1, 0, 0, 0) or so."


def _check_ranges(draft: Draft, model: SolidModel) -> Iterator[str]:
    state = initial_state(draft.scene, model)
    for joint in model.joint_names:
        kind = joint_kind(model, joint)
        if kind not in (HINGE, SLIDE):
            continue
        dof = model.dofs_of(joint)[0]
        low, high = model.dof_range[dof]
        here = state.q[model.dof_position[dof]]
        if not low - 1e-9 <= here <= high + 1e-9:
            unit, mark = joint_unit(model, joint), " degrees" if kind == HINGE else " m"
            yield (
                f"{draft.at('initial')}: joint '{joint}' starts at {here / unit:g}{mark}, outside "
                f"its range from {low / unit:g} to {high / unit:g}{mark}. Start it within."
            )


def _check_places(draft: Draft, model: SolidModel) -> Iterator[str]:
    """No moving body may start outside the domain."""
    scene, domain = draft.scene, draft.scene.domain
    if domain is None or not scene.has_fluid or not draft.sound("domain", "solids"):
        return
    start = initial_state(scene, model)
    yield from check_flesh_places(draft, model, start, domain)
    low, high = geom_boxes(model, start.q)
    axes = min(len(domain.lower), scene.dimensions)
    moving = model.moving[model.geom_body] & np.isfinite(low).all(axis=1)
    outside = (low[:, :axes] < domain.lower[:axes]) | (high[:, :axes] > domain.upper[:axes])
    outside &= moving[:, None]
    if not outside.any():
        return
    geom, axis = np.argwhere(outside)[0]
    bodies = np.unique(model.geom_body[outside.any(axis=1)])
    more = f", and so do {bodies.size - 1} more bodies" if bodies.size > 1 else ""
    creature = " and ".join(
        f"{low[moving, k].min():.4g} to {high[moving, k].max():.4g} m in {'xyz'[k]}"
        for k in range(axes)
    )
    how = "Move it" if scene.clip is None else PLACED
    yield (
        f"{draft.at('domain')}: body '{model.body_names[model.geom_body[geom]]}' reaches from "
        f"{low[geom, axis]:g} to {high[geom, axis]:g} m in {'xyz'[axis]} at the start, outside the "
        f"domain from {domain.lower[axis]:g} to {domain.upper[axis]:g} m{more}. The creature takes "
        f"{creature}. {how} or enlarge the domain."
    )


def geom_boxes(model: SolidModel, q: Array) -> tuple[Array, Array]:
    """(ngeom, 3) lowest and highest corners of boxes around the geometries at `q` (nq,), m."""
    pose, reach = kinematics(model, q), model.mj.geom_aabb[model.geom_id]
    centre = pose.geom_position + np.einsum("gij,gj->gi", pose.geom_rotation, reach[:, :3])
    half = np.einsum("gij,gj->gi", np.abs(pose.geom_rotation), reach[:, 3:])
    return centre - half, centre + half


def _formulas(draft: Draft) -> dict[str, str]:
    """Where each formula is, for a message -> its text."""
    found = {}
    for index, motion in enumerate(draft.scene.motion):
        if isinstance(motion, MotionFormulaTable):
            found[draft.at("motion", index, "position")] = motion.position
    for index, mouth in enumerate(draft.scene.mouths):
        if mouth.factor is not None:
            found[draft.at("mouths", index, "factor")] = mouth.factor
    return found

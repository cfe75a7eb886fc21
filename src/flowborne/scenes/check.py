"""All checks that hold the tables of a scene against each other and against its model."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.control.surroundings import Surroundings
from flowborne.coupling.world import Setup
from flowborne.scenes.bodies import check_initial, initial_state, load_model
from flowborne.scenes.build import mouths_of, surroundings_of
from flowborne.scenes.check_clip import check_clip, check_followers
from flowborne.scenes.controller import check_control
from flowborne.scenes.draft import Draft
from flowborne.scenes.earlier import check_earlier, check_earlier_joints
from flowborne.scenes.flesh import check_flesh, check_flesh_places
from flowborne.scenes.fluid import check_dimensions, check_fluid, fluid_of
from flowborne.scenes.motions import MotionFormulaTable, check_formulas, check_motions
from flowborne.scenes.mouths import check_mouth_cells, check_mouths
from flowborne.scenes.window import check_followed
from flowborne.solids.model import FREE, HINGE, SLIDE, SolidModel, joint_kind, joint_unit
from flowborne.solids.surfaces import geom_boxes

FLOAT32_ROUNDING = float(np.finfo(np.float32).eps)
"""Relative error of the vertices of a mesh, which MuJoCo keeps in single precision."""


def cross_check(draft: Draft) -> list[str]:
    """Everything that is wrong with a scene that the schema accepts."""
    scene = draft.scene
    problems = [*check_dimensions(draft), *check_fluid(draft), *check_without_bodies(draft)]
    has_model = scene.solids is not None
    flesh = check_flesh(draft, scene.flesh, slab=scene.is_slab, has_model=has_model)
    unusable = [*check_earlier(draft), *check_clip(draft), *flesh]
    problems += unusable
    readable = draft.sound("dimensions", "gravity", "clip", "shapes")
    if unusable or not (readable and scene.has_bodies):
        return problems
    try:
        model = load_model(scene)
    except SceneError as error:
        table = "human" if scene.human is not None else "flesh" if scene.flesh else "solids"
        return problems + [f"{draft.at(table)}: {problem}" for problem in error.problems]
    lost = [*check_earlier_joints(draft, model), *check_followers(draft, model)]
    if lost:
        return problems + lost
    around = surroundings_of(scene, model, draft.broken)
    coupling = scene.fluid.coupling if scene.fluid is not None else "two-way"
    mouths = check_mouths(draft, scene.mouths, coupling, around)
    problems += [*check_bodies(draft, around), *mouths, *check_control(draft, around)]
    if problems or not scene.mouths or draft.broken:
        return problems
    setup, start = Setup(model, fluid_of(scene)), initial_state(scene, model)
    return list(check_mouth_cells(draft, mouths_of(scene, model), setup, start))


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
    "policy",
)


def check_without_bodies(draft: Draft) -> Iterator[str]:
    """Tables in NEEDS_BODIES, and keys of [output], of a scene without bodies."""
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
    named += check_followed(draft, model)
    for index, wind in enumerate(scene.wind):
        named += [f"{draft.at('wind', index)}: {problem}" for problem in wind.check(around)]
    if scene.policy is not None:
        named += [f"{draft.at('policy')}: {problem}" for problem in scene.policy.check(around)]
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
    """No moving body may start outside the domain, or be longer than it between periodic sides."""
    scene, domain = draft.scene, draft.scene.domain
    if domain is None or not scene.has_fluid or not draft.sound("domain", "solids"):
        return
    start = initial_state(scene, model)
    assert scene.boundaries is not None
    yield from check_flesh_places(draft, model, start, domain, scene.boundaries)
    low, high = geom_boxes(model, start.q)
    axes = min(len(domain.lower), scene.dimensions)
    moving = model.moving[model.geom_body] & np.isfinite(low).all(axis=1)
    slack = FLOAT32_ROUNDING * np.array(domain.extent()[:axes])
    outside = low[:, :axes] < domain.lower[:axes] - slack
    outside |= high[:, :axes] > domain.upper[:axes] + slack
    outside &= moving[:, None]
    for axis in (axis for axis in range(axes) if scene.boundaries.periodic(axis)):
        for body in np.unique(model.geom_body[outside[:, axis]]):
            own = model.geom_body == body
            length = high[own, axis].max() - low[own, axis].min()
            outside[own, axis] &= length >= domain.extent()[axis]
    if not outside.any():
        return
    geom, axis = np.argwhere(outside)[0]
    bodies = np.unique(model.geom_body[outside.any(axis=1)])
    more = f", and so do {bodies.size - 1} more bodies" if bodies.size > 1 else ""
    creature = " and ".join(
        f"{low[moving, k].min():.4g} to {high[moving, k].max():.4g} m in {'xyz'[k]}"
        for k in range(axes)
    )
    how = "Move it" if scene.clip is None else "Place the clip by offset and heading in [clip]"
    yield (
        f"{draft.at('domain')}: body '{model.body_names[model.geom_body[geom]]}' reaches from "
        f"{low[geom, axis]:g} to {high[geom, axis]:g} m in {'xyz'[axis]} at the start, outside the "
        f"domain from {domain.lower[axis]:g} to {domain.upper[axis]:g} m{more}. The creature takes "
        f"{creature}. {how} or enlarge the domain."
    )


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

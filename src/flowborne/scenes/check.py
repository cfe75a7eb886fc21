"""All checks that hold the tables of a scene against each other and against its model."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.base.phrases import suggestion
from flowborne.control.surroundings import Surroundings
from flowborne.coupling.world import Setup
from flowborne.motion.clip import Clip
from flowborne.scenes.actuators import check_actuators
from flowborne.scenes.bodies import check_initial, initial_state, load_model, posed
from flowborne.scenes.build import mouths_of, surroundings_of
from flowborne.scenes.capture import capture_of, clip_motion
from flowborne.scenes.control import check_control
from flowborne.scenes.draft import Draft
from flowborne.scenes.earlier import check_earlier_joints, earlier_joints, earlier_of
from flowborne.scenes.flesh import check_flesh, check_flesh_places
from flowborne.scenes.fluid import check_dimensions, check_fluid, check_followed, fluid_of
from flowborne.scenes.motions import MotionFormulaTable, check_formulas, check_motions
from flowborne.scenes.mouths import check_mouth_cells, check_mouths
from flowborne.scenes.schema_bodies import ROOT, ClipTable, named_holds
from flowborne.scenes.thrusters import check_discs, check_thrusters, thrusters_of
from flowborne.scenes.warn import KINDS
from flowborne.solids.loops import tied_joints
from flowborne.solids.model import HINGE, SLIDE, SolidModel, joint_kind, joint_unit
from flowborne.solids.surfaces import geom_boxes

FLOAT32_ROUNDING = float(np.finfo(np.float32).eps)
"""Relative error of the vertices of a mesh, which MuJoCo keeps in single precision."""

JUMP = np.radians(15.0)
"""Least turn of a joint from the first frame to the second that is looked at."""

JUMPS = 3.0
"""How much more all joints then turn than between any two later frames, if it is a T-pose."""

MANY = 10
"""Frames of a clip from which on that can be told."""


def cross_check(draft: Draft) -> list[str]:
    """Everything that is wrong with a scene that the schema accepts."""
    scene = draft.scene
    problems = [
        *check_accepted(draft),
        *check_dimensions(draft),
        *check_fluid(draft),
        *check_without_bodies(draft),
        *check_ellipsoids(draft),
    ]
    has_model = scene.solids is not None
    flesh = check_flesh(draft, scene.flesh, slab=scene.is_slab, has_model=has_model)
    earlier = draft.failing(lambda: earlier_of(scene), "earlier")
    unusable = [*earlier, *check_clip(draft), *flesh]
    problems += unusable
    readable = draft.sound("dimensions", "gravity", "clip", "shapes")
    if unusable or not (readable and scene.has_bodies):
        return problems
    table = "human" if scene.human is not None else "flesh" if scene.flesh else "solids"
    if unusable := draft.failing(lambda: load_model(scene), table):
        return problems + unusable
    model = load_model(scene)
    around = surroundings_of(scene, model, draft.broken)
    lost = [*check_earlier_joints(draft, around), *check_followers(draft, around)]
    if lost:
        return problems + lost
    coupling = scene.fluid.coupling if scene.fluid is not None else "two-way"
    mouths = check_mouths(draft, scene.mouths, coupling, around)
    tables = scene.control, scene.objectives, scene.controller
    control = check_control(draft, *tables, scene.frame_time, around)
    thrusters = check_thrusters(draft, scene.thruster, coupling, around)
    problems += [*check_bodies(draft, around), *mouths, *thrusters, *control]
    if problems or not (scene.mouths or scene.thruster) or draft.broken:
        return problems
    setup, start = Setup(model, fluid_of(scene)), initial_state(scene, model)
    discs = thrusters_of(scene.thruster, model, scene.constants)
    return [
        *check_mouth_cells(draft, mouths_of(scene, model), setup, start),
        *check_discs(draft, discs, setup, start),
    ]


def check_accepted(draft: Draft) -> Iterator[str]:
    """Warnings that the scene accepts and that are none."""
    for kind in draft.scene.accepted_warnings:
        if kind not in KINDS:
            end = suggestion(kind, KINDS, "Give one of")
            yield f"{draft.at('accepted_warnings')}: there is no warning '{kind}'{end}"


NEEDS_BODIES = (
    "clip",
    "earlier",
    "constants",
    "flesh",
    "shapes",
    "initial",
    "motion",
    "actuator",
    "wind",
    "force",
    "mouths",
    "thruster",
    "control",
    "objectives",
    "controller",
    "policy",
)


def check_without_bodies(draft: Draft) -> Iterator[str]:
    """Tables in NEEDS_BODIES, and keys of [output], of a scene without bodies."""
    if draft.scene.has_bodies or not draft.sound("solids", "human"):
        return
    found = [(draft.at(table), "table") for table in NEEDS_BODIES if draft.gives(table)]
    defaults = type(draft.scene.output)()
    for key in ("bodies", "joints", "ellipsoid_model"):
        if getattr(draft.scene.output, key) not in (getattr(defaults, key), False):
            found.append((draft.at("output", key), "key"))
    for where, what in found:
        yield f"{where}: there are no bodies. Add [solids] with a model, or drop this {what}."


def check_ellipsoids(draft: Draft) -> Iterator[str]:
    """What MuJoCo's ellipsoid fluid model does not know."""
    scene = draft.scene
    if not scene.output.ellipsoid_model or not draft.sound("domain", "fluid", "flesh"):
        return
    wrong = [
        *(["no fluid that acts on bodies"] if not scene.has_fluid else []),
        *(["2 dimensions"] if scene.is_slab else []),
        *(["[[flesh]]"] if scene.flesh else []),
    ]
    if scene.has_bodies and wrong:
        yield (
            f"{draft.at('output', 'ellipsoid_model')}: MuJoCo's model is of rigid bodies in a "
            f"fluid in three dimensions, and the scene has {' and '.join(wrong)}. Drop this key."
        )


def check_bodies(draft: Draft, around: Surroundings) -> Iterator[str]:
    """Names, initial state, motions and winds against the model."""
    scene, model = draft.scene, around.model
    if scene.shapes and scene.solids is None:
        yield (
            f"{draft.at('shapes')}: they are on bodies of a model file. "
            "Add [solids] with a model, or drop [[shapes]]."
        )
    named, output, followed = [], scene.output, {scene.film.camera.follow} - {"bodies", "nothing"}
    if scene.solids is not None:
        named += draft.said(around.unknown_bodies(scene.solids.densities), "solids", "densities")
        named += _unheld(draft, around)
    named += draft.said(around.unknown_bodies(output.bodies), "output", "bodies")
    if not isinstance(output.joints, bool):
        named += draft.said(around.unknown_joints(output.joints), "output", "joints")
    named += draft.said(around.unknown_bodies(followed), "film", "camera", "follow")
    named += check_followed(draft, around)
    for index, wind in enumerate(scene.wind):
        named += draft.said(wind.check(around), "wind", index)
    for index, force in enumerate(scene.force):
        named += draft.said(force.check(around), "force", index)
    if scene.policy is not None:
        thrusters = [t.named(number) for number, t in enumerate(scene.thruster, start=1)]
        named += draft.said(scene.policy.check(around, thrusters), "policy")
    yield from named
    state = [
        *check_initial(draft, around),
        *check_motions(draft, draft.scene.motion, around),
        *check_actuators(draft, scene.actuator, _moved(draft, model), around),
        *check_formulas(draft, _formulas(draft), scene.constants, scene.frame_times()),
    ]
    yield from state
    if not named and not state and draft.sound("initial", "motion", "constants"):
        yield from _check_ranges(draft, model)
        yield from _check_places(draft, model)


def _unheld(draft: Draft, around: Surroundings) -> list[str]:
    """Joints of [solids] hold that cannot be held."""
    scene, model = draft.scene, around.model
    where, problems = draft.at("solids", "hold"), []
    moved = {table.joint: "a [[motion]]" for table in scene.motion}
    moved |= dict.fromkeys(scene.controlled_joints(), "[[control]]")
    moved |= dict.fromkeys(earlier_joints(scene), "a motion of the [earlier] run")
    tied = tied_joints(model)
    for joint in named_holds(scene.solids, model):
        if joint in moved:
            problems.append(f"{where}: joint '{joint}' has {moved[joint]}. Keep one of them.")
        elif joint in tied:
            problems.append(
                f"{where}: joint '{joint}' is {tied[joint]}, which a held joint would pull open. "
                "Take it out: what ties it moves it."
            )
        elif joint == ROOT and ROOT not in model.joint_names:
            problems.append(f"{where}: there is no free joint to hold as '{ROOT}'. Drop it.")
        else:
            problems += draft.said(around.unknown_joints([joint]), "solids", "hold")
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
    motions, mouths = enumerate(draft.scene.motion), enumerate(draft.scene.mouths)
    positions = [(n, m.position) for n, m in motions if isinstance(m, MotionFormulaTable)]
    factors = [(n, mouth.factor) for n, mouth in mouths if mouth.factor is not None]
    controls = [(n, table.formula) for n, table in enumerate(draft.scene.actuator)]
    forces = [
        (n, *formula) for n, force in enumerate(draft.scene.force) for formula in force.formulas()
    ]
    thrusts = [(n, *thruster.setting) for n, thruster in enumerate(draft.scene.thruster)]
    return (
        {draft.at("motion", n, "position"): text for n, text in positions}
        | {draft.at("mouths", n, "factor"): text for n, text in factors}
        | {draft.at("actuator", n, "value"): text for n, text in controls if text is not None}
        | {draft.at("force", n, key, place): text for n, key, place, text in forces}
        | {draft.at("thruster", n, key): text for n, key, text in thrusts if isinstance(text, str)}
    )


def _moved(draft: Draft, model: SolidModel) -> dict[str, str]:
    """Joints that something else than an actuator moves -> what does, in words."""
    scene = draft.scene
    held = dict.fromkeys(named_holds(scene.solids, model), "in [solids] hold")
    earlier = dict.fromkeys(earlier_joints(scene), "moved by the [earlier] run")
    return held | earlier | scene.moved_joints()


def check_clip(draft: Draft) -> Iterator[str]:
    """The tables human and clip, and the clip's file, before there is a model."""
    scene = draft.scene
    if scene.human is not None and scene.solids is not None:
        yield f"{draft.at('human')}: there is a [solids] as well. Keep one of the two."
    if scene.human is not None and scene.is_slab:
        yield f"{draft.at('human')}: a human needs 3 dimensions, and the scene has 2. Drop one."
    if scene.clip is None:
        return
    if scene.clip.file is None and scene.human is None:
        if draft.sound("human"):
            yield (
                f"{draft.at('clip')}: there is no file, and a walk without one needs a [human]. "
                "Add clip.file or [human]."
            )
        return
    unusable = draft.failing(lambda: capture_of(scene), "clip")
    yield from unusable
    if not unusable and scene.clip.file is not None and (capture := capture_of(scene)):
        yield from _check_first_pose(draft, capture.clip, scene.clip)


def _check_first_pose(draft: Draft, clip: Clip, table: ClipTable) -> Iterator[str]:
    """A clip that begins with a T-pose, which a recording jumps out of, cannot be followed."""
    begun = table.start > 0.5 * clip.frame_time or table.smooth is not None
    if begun or clip.frames < MANY:
        return
    turns = clip.rotation_steps()
    first, later = turns[0], turns[1:]
    if first.max() > JUMP and first.sum() > JUMPS * later.sum(axis=1).max():
        joint = clip.names[int(first.argmax())]
        yield (
            f"{draft.at('clip')}: from the first frame that is used of {table.file} to the second "
            f"'{joint}' turns by {np.degrees(first.max()):.3g} degrees, and no joint by more than "
            f"{np.degrees(later.max()):.3g} between any two after that: the first is a T-pose or "
            f"the like. Drop it by skip = {table.skip + 1}."
        )


def check_followers(draft: Draft, around: Surroundings) -> Iterator[str]:
    """Joints that follow the clip against the model, and against what else moves them; the clip's
    motion where it can be entered from a pose without fault."""
    scene, model = draft.scene, around.model
    if scene.clip is None:
        return
    capture = capture_of(scene)
    assert capture is not None
    others = scene.moved_joints() | dict.fromkeys(scene.clip.free, "free")
    others |= dict.fromkeys(earlier_joints(scene), "moved by the [earlier] run")
    others |= dict.fromkeys(named_holds(scene.solids, model), "held")
    named = (*scene.clip.mapping, *(scene.clip.joints or ()), *scene.clip.free)
    unknown = draft.said(around.unknown_joints(named), "clip")
    yield from unknown
    found = bool(unknown)
    for joint in scene.clip.joints or ():
        if joint in others:
            yield (
                f"{draft.at('clip', 'joints')}: joint '{joint}' is {others[joint]} as well. "
                "Take it out of one of the two."
            )
        if joint not in capture.mapping and joint in model.joint_names:
            yield (
                f"{draft.at('clip', 'joints')}: joint '{joint}' has no counterpart in the clip, "
                f"whose joints are {', '.join(capture.clip.names)}. Add it to clip.mapping."
            )
            found = True
    if not set(capture.mapping) & set(model.joint_names):
        yield (
            f"{draft.at('clip')}: the model has no joint with the name of one of the clip's, which "
            f"are {', '.join(capture.clip.names)}. Say in clip.mapping which of them each follows."
        )
        found = True
    if found or any(check_initial(draft, around)):
        return
    yield from draft.failing(lambda: clip_motion(scene, model, posed(scene, model).q), "clip")

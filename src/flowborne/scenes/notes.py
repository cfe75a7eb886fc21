"""Notes on a scene: facts that are neither wrong nor implausible, but useful before it runs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.base.phrases import listed
from flowborne.control.rules import RuleFixed
from flowborne.coupling.creeping import CREEPING, viscous_number
from flowborne.motion.bvh import MAX_BONE_STRETCH
from flowborne.motion.clip_reading import (
    MIN_STANDING_COSINE,
    Capture,
    leg_length,
    standing_axis,
    unit_text,
)
from flowborne.motion.human.clip_skeleton import lost_bones
from flowborne.motion.human.skeleton import PARENTS
from flowborne.scenes.bodies import (
    given_of,
    held_joints,
    in_centimetres,
    left_free,
    own_pose,
    posed,
    spec_of,
    steps_of_contacts,
    trajectories_of,
)
from flowborne.scenes.capture import capture_of
from flowborne.scenes.dye import DyeBox
from flowborne.scenes.earlier import earlier_of
from flowborne.scenes.schema import Scene
from flowborne.solids.actuators import actuator_servos
from flowborne.solids.geoms import floors
from flowborne.solids.mending import joined_pairs, mended_meshes
from flowborne.solids.mjcf import MjSpec
from flowborne.solids.model import HINGE, SLIDE, SolidModel, joint_kind, joint_unit
from flowborne.solids.model_checks import bodies_with_own_inertia, disabled_parts, replaced_options
from flowborne.solids.sensors import late_sensors, unread_sensors


def notes_of(scene: Scene, model: SolidModel) -> Iterator[str]:
    """Sentences for people, without a full stop."""
    yield from _model_file(scene, model)
    if mended := mended_meshes(model.mj):
        yield f"[solids]: open meshes: {mended}"
    if joined := joined_pairs(model.mj):
        yield (
            "[solids]: no contact between fixed bodies and those jointed to them that they overlap "
            f"at rest: {listed(joined)}"
        )
    yield from _moved_into_range(scene, model)
    yield from _held(scene, model)
    yield from clip_notes(scene)
    yield from _standing_still(scene)
    yield from _wide_probes(scene, model)
    yield from _longer_sides(scene)
    yield from window_notes(scene)
    yield from _creeping(scene)
    if scene.dye and scene.film.field != "dye":
        yield (f'[[dye]]: the film shows {scene.film.field}; [film] field = "dye" shows the dye')
    if in_centimetres(scene):
        yield (
            "gravity: it is the Earth's in cm/s^2, in the model as well, so the scene is taken to "
            "be in cm, g and s, and no warning compares it with metres and kilograms"
        )
    steps = scene.time.steps_per_frame
    if steps > 1 and steps == steps_of_contacts(scene, model):
        yield (
            f"[time]: a frame has {steps} steps, as contacts of the model with its floor are as "
            "stiff as that (solref); time.steps_per_frame gives another number"
        )


def _creeping(scene: Scene) -> Iterator[str]:
    """That viscosity and pressure are solved for several times a step."""
    if scene.fluid is None or scene.domain is None:
        return
    dt, h = scene.step_time, scene.domain.grid().spacing
    number = viscous_number(scene.fluid.viscosity, scene.fluid.density, dt, h)
    if number >= CREEPING:
        yield (
            f"[fluid]: creeping: nu dt / h^2 is {number:.3g}, so a step takes about 8 solves of "
            "viscosity and pressure"
        )


def _longer_sides(scene: Scene) -> Iterator[str]:
    """Sides of the domain that whole cells make longer than the scene says."""
    domain = scene.domain
    if domain is None:
        return
    sides = zip("xyz", domain.lower, domain.upper, domain.grid().upper, strict=False)
    longer = [
        f"{axis} to {end:.6g} m for {high:.6g}"
        for axis, low, high, end in sides
        if end - low > (high - low) * (1.0 + 1e-9)
    ]
    if longer:
        yield f"[domain]: whole cells make it longer: {listed(longer)}"


def _moved_into_range(scene: Scene, model: SolidModel) -> Iterator[str]:
    """Joints whose own pose is outside their range."""
    own, start = own_pose(scene, model).q, posed(scene, model).q
    moved = []
    for joint in model.joint_names:
        if joint_kind(model, joint) not in (HINGE, SLIDE) or joint in scene.initial.positions:
            continue
        place, unit = model.positions_of(joint)[0], joint_unit(model, joint)
        if own[place] != start[place]:
            mark = "m" if joint_kind(model, joint) == SLIDE else "degrees"
            moved.append(f"{joint} ({own[place] / unit:.4g} to {start[place] / unit:.4g} {mark})")
    if moved:
        yield (
            "[initial]: joints that the model has outside their ranges start within: "
            f"{listed(moved)}"
        )


def _held(scene: Scene, model: SolidModel) -> Iterator[str]:
    """Which joints hold = true holds, and which it leaves free."""
    if scene.solids is None or scene.solids.hold is not True:
        return
    motions = trajectories_of(scene, model, posed(scene, model).q)
    if held := held_joints(model, motions):
        free = left_free(scene, model, motions)
        yield f"[solids]: hold = true holds {listed(held)}" + (
            f", and not {listed(free)} on the world" if free else ""
        )


def _standing_still(scene: Scene) -> Iterator[str]:
    """A clip that does not loop ends before the run, or the earlier run does."""
    earlier, run = earlier_of(scene), scene.time.frames * scene.frame_time
    if earlier is not None and earlier.length < run - 0.5 * scene.frame_time:
        yield (
            f"[earlier]: that run is {earlier.length:.3g} s long and this one {run:.3g} s; its "
            "joints stand still from there. It goes on when it is resumed with more frames"
        )
    table, capture = scene.clip, capture_of(scene)
    if table is None or capture is None or table.file is None or table.loop:
        return
    end = min(capture.clip.duration, np.inf if table.stop is None else table.stop)
    left = end - table.start
    if left < run - 0.5 * scene.frame_time:
        yield (
            f"[clip]: {table.file} goes on for {left:.3g} s of the run's {run:.3g} s, and stands "
            "still from there; loop = true lets it begin again, and fewer frames end with it"
        )


def _wide_probes(scene: Scene, model: SolidModel) -> Iterator[str]:
    """Probes that are wider than a step of the rule.

    A descent of fixed steps comes to rest where the objective is the same at both ends of a probe:
    half a probe off an optimum that is a kink, at most, and never nearer than its step.
    """
    if not isinstance(scene.controller.rule, RuleFixed):
        return
    time = scene.controller.every * scene.frame_time
    for number, table in enumerate(scene.control, start=1):
        step = min(table.strengths) * time
        if table.probe > step:
            unit = "m" if joint_kind(model, table.joints[0]) == SLIDE else "degrees"
            yield (
                f"[[control]] {number}: probes of {table.probe:g} {unit} are wider than steps of "
                f"{step:.3g}, so that a sharp optimum is met to half a probe only; rule "
                "'resilient' of [controller] narrows both"
            )


def _model_file(scene: Scene, model: SolidModel) -> Iterator[str]:
    """Settings of the model file that have no effect, and parts that it switches off."""
    if scene.model_path is None or scene.solids is None:
        return
    spec, step = spec_of(scene), scene.step_time
    name, on_floors = scene.model_path.name, bool(floors(model.mj))
    options = replaced_options(spec, scene.gravity, step, on_floors)
    unused = [*options, *_elements(scene, spec, model), *_densities(scene, spec)]
    if unused:
        yield f"[solids]: of {name} these have no effect: {'; '.join(unused)}"
    if off := disabled_parts(spec):
        yield f"[solids]: {name} itself switches off its {listed(off)} by <flag>"


def _elements(scene: Scene, spec: MjSpec, model: SolidModel) -> Iterator[str]:
    keys = [key.name or f"keyframe {n}" for n, key in enumerate(spec.keys)]
    if keys and scene.initial.keyframe is None:
        yield f"keyframes {listed(keys)}, of which [initial] keyframe takes one"
    for key in spec.keys:
        parts = ("ctrl", "controls"), ("mpos", "mocap positions"), ("mquat", "mocap orientations")
        unused = [words for part, words in parts if len(getattr(key, part))]
        if unused and key.name == scene.initial.keyframe:
            yield f"{listed(unused)} of keyframe '{key.name}'"
    assert scene.solids is not None
    hold, told = scene.solids.hold, scene.told_actuators()
    servos = {
        model.actuator_names[servo.number]: servo.joint
        for servo in actuator_servos(model)
        if servo.kind == "position"
    }
    taken = [name for name, joint in servos.items() if hold is True or (hold and joint in hold)]
    idle = [name for name in model.actuator_names if name not in (*told, *taken)]
    if idle:
        one = len(idle) == 1
        yield (
            f"actuator{'s' * (not one)} {listed(idle)}, which nothing tells: [[actuator]], "
            f"[policy] or a script tells {'it' if one else 'them'}"
        ) + (f", and [solids] hold = true takes {listed([*servos])}" if servos and not hold else "")
    if unread := unread_sensors(model):
        yield f"sensors {listed(unread)}, which a plugin or callback would compute"
    if late := late_sensors(model):
        yield f"delay and interval of sensors {listed(late)}, which are read at each frame's end"


def _densities(scene: Scene, spec: MjSpec) -> Iterator[str]:
    """Densities of the scene that an inertia or a mass in the file overrules, and densities of the
    file that the scene's replace."""
    given, default = given_of(scene), MjSpec().default.geom.density
    dense = {b.name for b in spec.bodies[1:] if given.density_of(b.name) is not None}
    own = [name for name in bodies_with_own_inertia(spec) if name in dense]
    if own:
        yield (
            f"[solids] density for {listed(own)}, whose <inertial> in the file says what they weigh"
        )
    others = [g for g in spec.geoms if g.parent.name in dense - {*own}]
    heavy = dict.fromkeys(g.parent.name for g in others if not np.isnan(g.mass))
    if heavy:
        yield (
            f"[solids] density for geoms of {listed([*heavy])} that have a mass in the file, which "
            "wins over any density"
        )
    lost = [g for g in others if np.isnan(g.mass) and g.density != default]
    replaced = dict.fromkeys(g.parent.name for g in lost)
    if replaced:
        yield f"the density of geoms of {listed([*replaced])}, which [solids] density replaces"


def clip_notes(scene: Scene) -> Iterator[str]:
    """How a clip's file and its person were read, and which parts it lacks."""
    table, capture = scene.clip, capture_of(scene)
    if table is None or capture is None or table.file is None:
        return
    if capture.note:
        yield f"[clip]: {table.file} {capture.note}"
    if capture.skeleton is None or capture.posture is None:
        return
    found = []
    if table.unit == "auto":
        legs = leg_length(capture.clip, capture.mapping)
        found.append(f"unit = {unit_text(capture.unit)}, which makes legs of {legs:.2f} m")
    if table.up == "auto" and capture.up != "y":
        found.append(f"up = '{capture.up}'")
    if found:
        yield f"[clip]: {table.file} is read with {', and '.join(found)}"
    if capture.held:
        yield f"[clip]: not in {table.file}, held: {', '.join(capture.held)}"
    links = [f"{name} turns as '{capture.mapping[name]}'" for name in sorted(capture.links)]
    if links:
        yield f"[clip]: {table.file} has joints between the human's: {', '.join(links)}"
    stray, bone = max(
        (capture.clip.deviations.get(b, (0.0, 0))[0], b) for b in capture.mapping.values()
    )
    if stray > MAX_BONE_STRETCH:
        yield (
            f"[clip]: bones of {table.file} stretch, that to '{bone}' by {2e3 * stray:.3g} mm; "
            "each has its middle length here"
        )
    if (
        capture.posture[2] < MIN_STANDING_COSINE
        and standing_axis(capture.posture, capture.up) is None
    ):
        yield f"[clip]: the person of {table.file} lies rather than stands, whichever axis is up"
    yield from _inserted_bones(table.file, capture)


def _inserted_bones(file: str, capture: Capture) -> Iterator[str]:
    """Bones that are put in between joints of a clip at the same place."""
    assert capture.skeleton is not None
    for joint in lost_bones(capture.clip, capture.mapping):
        bone = capture.skeleton[joint] - capture.skeleton[PARENTS[joint]]
        yield (
            f"[clip]: {file} has no bone above '{capture.mapping[joint]}', as BVH files of the CMU "
            f"database; one of {100.0 * float(np.linalg.norm(bone)):.2g} cm is put in, so that "
            "head and shoulders are where anatomy has them, higher than in the file"
        )


def window_notes(scene: Scene) -> Iterator[str]:
    """What a domain that moves leaves behind."""
    domain = scene.domain
    if domain is None or not domain.follows:
        return
    axes = domain.axes
    along = "" if len(axes) == scene.dimensions else f" along {listed(['xyz'[a] for a in axes])}"
    yield (
        f"[domain]: it follows {domain.follow}{along}, and vortices and dye that it leaves behind "
        "are lost"
    )
    fixed = [f"[[sources]] {n}" for n, _ in enumerate(scene.sources, start=1)]
    fixed += [
        f"[[dye]] {n}"
        for n, dye in enumerate(scene.dye, start=1)
        if isinstance(dye, DyeBox) or dye.axis in axes
    ]
    if fixed:
        yield (
            f"[domain]: {listed(fixed)} {'stays' if len(fixed) == 1 else 'stay'} in place, and "
            f"{'acts' if len(fixed) == 1 else 'act'} only while the domain is there"
        )

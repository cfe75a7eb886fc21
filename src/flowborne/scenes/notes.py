"""What is neither wrong nor implausible in a scene, and worth knowing before it runs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.control.rules import RuleFixed
from flowborne.phrases import listed
from flowborne.scenes.bodies import own_pose, posed, spec_of
from flowborne.scenes.capture import capture_of
from flowborne.scenes.earlier import earlier_of
from flowborne.scenes.notes_clip import clip_notes
from flowborne.scenes.schema import Scene
from flowborne.solids.compiler import MjSpec
from flowborne.solids.geoms import floors
from flowborne.solids.joint_kinds import HINGE, SLIDE, joint_kind, joint_unit
from flowborne.solids.mending import joined_pairs, mended_meshes
from flowborne.solids.model import SolidModel
from flowborne.solids.options import bodies_with_own_inertia, disabled_parts, replaced_options


def notes_of(scene: Scene, model: SolidModel) -> Iterator[str]:
    """Sentences for people, without a full stop."""
    left_out = not_taken(scene, model)
    if left_out is not None:
        yield left_out
    off = switched_off(scene)
    if off is not None:
        yield off
    if mended := mended_meshes(model.mj):
        yield f"[solids]: open meshes: {mended}"
    if joined := joined_pairs(model.mj):
        yield (
            "[solids]: no contact between fixed bodies and those jointed to them that they overlap "
            f"at rest: {listed(joined)}"
        )
    yield from _moved_into_range(scene, model)
    yield from clip_notes(scene)
    yield from _standing_still(scene)
    yield from _wide_probes(scene, model)


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


def _standing_still(scene: Scene) -> Iterator[str]:
    """A clip that does not loop ends before the run, or the earlier run does."""
    earlier, run = earlier_of(scene), scene.time.frames * scene.frame_time
    if earlier is not None and earlier.length < run - 0.5 * scene.frame_time:
        yield (
            f"[earlier]: that run is {earlier.length:.3g} s long and this one {run:.3g} s; its "
            "joints stand still from there. It goes on with --resume and --frames"
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
        step = min([table.strength, *(other.strength for other in table.in_phases)]) * time
        if table.probe > step:
            unit = "m" if joint_kind(model, table.joints[0]) == SLIDE else "degrees"
            yield (
                f"[[control]] {number}: probes of {table.probe:g} {unit} are wider than steps of "
                f"{step:.3g}, so that a sharp optimum is met to half a probe only; rule "
                "'resilient' of [controller] narrows both"
            )


def not_taken(scene: Scene, model: SolidModel) -> str | None:
    """One sentence on what of the model file has no effect, None where all of it has."""
    if scene.model_path is None or scene.solids is None:
        return None
    spec, step = spec_of(scene), scene.frame_time / scene.time.steps_per_frame
    options = replaced_options(spec, scene.gravity, step, bool(floors(model.mj)))
    said = [*options, *_elements(scene, spec), *_densities(scene, spec)]
    if not said:
        return None
    return f"[solids]: of {scene.model_path.name} these have no effect: {'; '.join(said)}"


def switched_off(scene: Scene) -> str | None:
    """One sentence on what the model file itself switches off, None where it leaves all on."""
    if scene.model_path is None:
        return None
    off = disabled_parts(spec_of(scene))
    if not off:
        return None
    return f"[solids]: {scene.model_path.name} itself switches off its {listed(off)} by <flag>"


def _elements(scene: Scene, spec: MjSpec) -> Iterator[str]:
    keys = [key.name or f"keyframe {n}" for n, key in enumerate(spec.keys)]
    if keys and scene.initial.keyframe is None:
        yield f"keyframes {listed(keys)}, of which [initial] keyframe takes one"
    assert scene.solids is not None
    hold = bool(scene.solids.hold)
    servos = sum(bool(actuator.biasprm[1] < 0.0) for actuator in spec.actuators)
    others = len(spec.actuators) - servos * hold
    if others:
        yield f"{others} actuator{'s' * (others > 1)}" + (
            f", of which [solids] hold = true takes {servos}" if servos and not hold else ""
        )
    if spec.sensors:
        yield f"{len(spec.sensors)} sensor{'s' * (len(spec.sensors) > 1)}"


def _densities(scene: Scene, spec: MjSpec) -> Iterator[str]:
    """Bodies whose own inertia counts, and not the densities of the scene."""
    assert scene.solids is not None
    given = scene.solids
    own = [
        name
        for name in bodies_with_own_inertia(spec)
        if given.densities.get(name, given.density) is not None
    ]
    if own:
        yield (
            f"[solids] density for {listed(own)}, whose <inertial> in the file says what they weigh"
        )

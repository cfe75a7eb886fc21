"""The solved motion of a run as BVH, on the skeleton of the clip that it followed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.bvh import write_bvh, write_clip
from flowborne.motion.clip import Clip
from flowborne.motion.clip_curves import UP
from flowborne.motion.clip_reading import Capture
from flowborne.motion.quaternions import inverse, product, rotated
from flowborne.runs.run_folder import STATE_NAME, RunFolder
from flowborne.scenes.bodies import load_model
from flowborne.scenes.capture import capture_of, followers
from flowborne.scenes.earlier import poses_of
from flowborne.scenes.load import load_scene
from flowborne.scenes.schema import Scene
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import FREE, SolidModel, joint_kind


def export_bvh(run: Path, path: Path) -> str:
    """Write the motion of the run in folder `run` as a BVH file.

    If the scene's clip has a file, the result is that file over the simulated time (of a loop: the
    first round) with the same frames and text. Only the joints that did not follow the clip have
    their simulated motion. The generated walk is written anew, with the frames of the run.

    returns a sentence on joints that moved and are not in the clip's file; "" without any
    raises  SceneError when the run has no clip or no motion; OSError when a file is missing or
            cannot be written
    """
    folder = RunFolder(run)
    scene = load_scene(folder.scene)
    capture = capture_of(scene)
    if capture is None or scene.clip is None:
        raise SceneError(
            f"{run} follows no clip, so there is no skeleton to export. Add [clip] to its scene."
        )
    states = sorted(p for p in folder.states.iterdir() if STATE_NAME.fullmatch(p.name))
    if len(states) < 2:
        raise SceneError(f"{run} has no motion yet. Continue the run with resume=True.")
    times, q = poses_of(states)
    model = load_model(scene)
    if scene.clip.file is None:
        write_clip(path, _walked(scene, capture, model, q), 0.01)
        return ""
    following = followers(scene, capture, model)
    own = {j: bone for j, bone in capture.mapping.items() if j not in capture.held}
    capture, added = replace(capture, mapping=own), set(capture.mapping) - set(own)
    moved = [joint for joint in model.joint_names if joint in added - set(following)]
    carried = {joint: _carried(model, capture, joint) for joint in moved}
    free = set(own) - set(following) | {joint for below in carried.values() for joint in below}
    frames, first = _frames(scene, capture.clip, float(times[-1]))
    at = (frames - scene.clip.start / capture.clip.frame_time) * capture.clip.frame_time
    relative = _relative(model, capture, q)
    replaced = {}
    for joint in sorted(free & set(model.joint_names)):
        turning = RotationSpline(times, relative[joint])(at)
        between = _between(capture, model, joint, frames)
        local = (between.inv() * turning).as_quat(scalar_first=True)
        replaced[own[joint]] = _in_file(capture, own[joint], local)
    root = None
    bone = capture.clip.names[0]
    joint = next((joint for joint in free if own[joint] == bone), "")
    if joint in model.joint_names and joint_kind(model, joint) == FREE:
        places = CubicSpline(times, q[:, model.positions_of(joint)[:3]])(at)
        root = (bone, *_unplaced(scene, capture, frames, places, replaced.pop(bone)))
    write_bvh(
        path,
        scene.folder / scene.clip.file,
        replaced,
        root=root,
        unit=capture.unit,
        up=capture.up,
        first=first,
        last=first + len(frames),
    )
    return _left_out(scene.clip.file, {j: [own[k] for k in below] for j, below in carried.items()})


def _in_file(capture: Capture, bone: str, rotations: Array) -> Array:
    """(frames, 4) rotations of a joint relative to its parent as counted by the clip's file."""
    if capture.rest is None:
        return rotations
    number = capture.clip.names.index(bone)
    result = product(rotations, capture.rest[number])
    parent = int(capture.clip.parents[number])
    return result if parent < 0 else product(inverse(capture.rest[parent]), result)


def _unplaced(
    scene: Scene, capture: Capture, frames: Integers, places: Array, rotations: Array
) -> tuple[Array, Array]:
    """(frames, 3) and (frames, 4) a root's places, m, and rotations where the clip's file has it,
    before heading, offset and floor."""
    assert scene.clip is not None
    offset, start = np.array(scene.clip.offset), capture.clip.translation[0]
    half = 0.5 * np.radians(scene.clip.heading)
    back = np.array([np.cos(half), 0.0, 0.0, -np.sin(half)])
    places = start - offset + rotated(back, places - start)
    if capture.lift is not None:
        places = places - capture.lift[frames, None] * UP
    return places, product(back, rotations)


def _carried(model: SolidModel, capture: Capture, joint: str) -> list[str]:
    """Joints that the clip has and that hang on one that it lacks."""
    known = _known(model, capture) | {_body(model, joint): joint}
    names = [name for name in capture.mapping if name in model.joint_names]
    return [name for name in names if _above(model, known, name) == joint]


def _left_out(file: str, carried: Mapping[str, Sequence[str]]) -> str:
    """A sentence on joints that a file lacks -> its joints that hang on them."""
    if not carried:
        return ""
    turned = [bone for bones in carried.values() for bone in bones]
    how = f"turns {', '.join(turned)} there and moves nothing" if turned else "is left out"
    return f"{file} has no joint for {', '.join(carried)}: its motion {how}; .usd and .glb have it"


def _frames(scene: Scene, clip: Clip, simulated: float) -> tuple[Integers, int]:
    """Frames of the clip that were simulated, and the file's number of the first."""
    assert scene.clip is not None
    start, stop = scene.clip.start, scene.clip.stop
    end = min(start + simulated, clip.duration if stop is None else stop)
    first = int(np.ceil(start / clip.frame_time - 1e-6))
    last = int(np.floor(end / clip.frame_time + 1e-6))
    return np.arange(first, last + 1), first + scene.clip.skip


def _relative(model: SolidModel, capture: Capture, q: Array) -> dict[str, Rotation]:
    """Joint -> rotation over the run from the nearest joint above it that the clip has.

    Both are counted from the rest pose, so that they are the clip's own.
    """
    rest = Rotation.from_matrix(kinematics(model, model.rest().q).body_rotation)
    turns = [Rotation.from_matrix(kinematics(model, row).body_rotation) * rest.inv() for row in q]
    matrices = np.array([turn.as_matrix() for turn in turns])
    found, known = {}, _known(model, capture)
    for joint in capture.mapping:
        if joint in model.joint_names:
            above = _above(model, known, joint)
            turn = Rotation.from_matrix(matrices[:, _body(model, joint)])
            if above is not None:
                turn = Rotation.from_matrix(matrices[:, _body(model, above)]).inv() * turn
            found[joint] = turn
    return found


def _body(model: SolidModel, joint: str) -> int:
    return int(model.mj.jnt_bodyid[model.joint(joint)])


def _known(model: SolidModel, capture: Capture) -> dict[int, str]:
    """Body -> its first joint that the clip has."""
    names = [name for name in model.joint_names if name in capture.mapping]
    return {_body(model, name): name for name in reversed(names)}


def _above(model: SolidModel, known: Mapping[int, str], joint: str) -> str | None:
    """The known joint of the nearest body above that of a joint."""
    parents = model.mj.body_parentid
    body = int(parents[_body(model, joint)])
    while body > 0 and body not in known:
        body = int(parents[body])
    return known.get(body)


def _between(capture: Capture, model: SolidModel, joint: str, frames: Integers) -> Rotation:
    """What the clip's joints between a joint and the one above it turn by together."""
    clip, above = capture.clip, _above(model, _known(model, capture), joint)
    stop = -1 if above is None else clip.names.index(capture.mapping[above])
    turn = Rotation.identity(len(frames))
    parent = int(clip.parents[clip.names.index(capture.mapping[joint])])
    while parent not in (stop, -1):
        rotations = clip.rotations[frames, parent]
        turn = Rotation.from_quat(rotations, scalar_first=True) * turn
        parent = int(clip.parents[parent])
    return turn


def _walked(scene: Scene, capture: Capture, model: SolidModel, q: Array) -> Clip:
    """The generated walk as it was simulated."""
    clip, relative = capture.clip, _relative(model, capture, q)
    rotations = np.stack(
        [relative[name].as_quat(scalar_first=True, canonical=True) for name in clip.names], axis=1
    )
    places = model.positions_of(clip.names[0])[:3]
    return Clip(
        clip.names, clip.parents, clip.offsets, clip.ends, scene.frame_time, rotations, q[:, places]
    )

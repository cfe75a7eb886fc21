"""The solved motion of a run as BVH, on the skeleton of the clip that it followed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, RotationSpline

from flowborne.errors import SceneError
from flowborne.io.arrays_file import read_state
from flowborne.io.bvh import write_bvh, write_clip
from flowborne.io.clip import Clip
from flowborne.io.run_folder import STATE_NAME, RunFolder
from flowborne.scenes.bodies import load_model
from flowborne.scenes.capture import Capture, capture_of, followers
from flowborne.scenes.load import load_scene
from flowborne.scenes.schema import Scene
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel

Array = NDArray[np.float64]


def export_bvh(run: Path, path: Path) -> None:
    """Write the motion of the run in folder `run` as a BVH file.

    With a clip of its own the file is that clip, frame for frame, over the time that was
    simulated (a loop: over its first round), in which the joints that did not follow it have the
    motion that was found for them; all else stays to the letter. The generated walk is written
    anew, a frame per frame of the run.

    raises  SceneError when the run has no clip or no motion; OSError when a file is missing or
            cannot be written
    """
    folder = RunFolder(run)
    scene = load_scene(folder.scene)
    capture = capture_of(scene)
    if capture is None or scene.clip is None:
        raise SceneError(
            f"{run} follows no clip, and there is none to give back. Add [clip] to its scene."
        )
    states = sorted(p for p in folder.states.iterdir() if STATE_NAME.fullmatch(p.name))
    if len(states) < 2:
        raise SceneError(f"{run} has no motion yet. Let the run go on with --resume.")
    times, q = _poses(states)
    model = load_model(scene)
    if scene.clip.file is None:
        write_clip(path, _walked(scene, capture, model, q), 0.01)
        return
    free = set(capture.mapping) - set(followers(scene, capture, model))
    frames, first = _frames(scene, capture.clip, float(times[-1]))
    at = (frames - scene.clip.start / capture.clip.frame_time) * capture.clip.frame_time
    relative = _relative(model, capture, q)
    replaced = {}
    for joint in sorted(free & set(model.joint_names)):
        turning = RotationSpline(times, relative[joint])(at)
        between = _between(capture, model, joint, frames)
        replaced[capture.mapping[joint]] = (between.inv() * turning).as_quat(scalar_first=True)
    write_bvh(
        path,
        scene.folder / scene.clip.file,
        replaced,
        up=scene.clip.up,
        first=first,
        last=first + len(frames),
    )


def _poses(states: list[Path]) -> tuple[Array, Array]:
    """(n,) s and (n, nq) of all states."""
    times, q = [], []
    for state in states:
        arrays = read_state(state, ("time", "q"))
        times.append(float(arrays["time"]))
        q.append(arrays["q"].astype(np.float64))
    return np.array(times), np.array(q)


def _frames(scene: Scene, clip: Clip, simulated: float) -> tuple[NDArray[np.int64], int]:
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
    found = {}
    for joint in capture.mapping:
        if joint in model.joint_names:
            body = _body(model, joint)
            above = _above(model, capture, joint)
            turn = Rotation.from_matrix(matrices[:, body])
            if above is not None:
                turn = Rotation.from_matrix(matrices[:, _body(model, above)]).inv() * turn
            found[joint] = turn
    return found


def _body(model: SolidModel, joint: str) -> int:
    return int(model.mj.jnt_bodyid[model.joint(joint)])


def _above(model: SolidModel, capture: Capture, joint: str) -> str | None:
    """The nearest joint above that the clip has too."""
    body = int(model.mj.body_parentid[_body(model, joint)])
    while body > 0:
        first = int(model.mj.body_jntadr[body])
        names = model.joint_names[first : first + int(model.mj.body_jntnum[body])]
        for name in names:
            if name in capture.mapping:
                return name
        body = int(model.mj.body_parentid[body])
    return None


def _between(
    capture: Capture, model: SolidModel, joint: str, frames: NDArray[np.int64]
) -> Rotation:
    """What the clip's joints between a joint and the one above it turn by together."""
    clip, above = capture.clip, _above(model, capture, joint)
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
        clip.names,
        clip.parents,
        clip.offsets,
        clip.ends,
        scene.frame_time,
        rotations,
        q[:, places],
    )

"""Joint motions of an earlier run as prescribed motions of the next run."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from flowborne.base.errors import SceneError
from flowborne.base.given import read_arrays, read_json
from flowborne.base.phrases import suggestion
from flowborne.control.surroundings import Surroundings
from flowborne.kernels.arrays import Array
from flowborne.motion.clip_curves import columns_of, row_of
from flowborne.motion.clip_motion import TrajectoryClip
from flowborne.motion.quaternions import continuous
from flowborne.runs.run_folder import RunFolder, RunFolderError, reading
from flowborne.runs.states import read_state
from flowborne.scenes.draft import Draft
from flowborne.scenes.schema import Scene
from flowborne.solids.model import SolidModel

EARLIER_FILE = "earlier.npz"
"""File in a run folder with the motion from an earlier run."""

TIME = "time"
"""Name of the times in that file; all other names are of joints."""

LEAST = 2
"""Poses that make a motion."""


@dataclass(frozen=True, eq=False)
class Earlier:
    """Motion of joints in an earlier run.

    times  (n,) s
    poses  joint -> (n, m) its entries of q in MuJoCo's order, rad and m
    """

    times: Array
    poses: Mapping[str, Array]

    @property
    def length(self) -> float:
        """s from its first frame to its last."""
        return float(self.times[-1] - self.times[0])

    def to_bytes(self) -> bytes:
        """An archive of arrays, of which `earlier_of` makes the same."""
        file = io.BytesIO()
        np.savez(file, **{TIME: self.times}, **self.poses)  # type: ignore[arg-type]
        return file.getvalue()


def earlier_of(scene: Scene) -> Earlier | None:
    """Motion of the joints in the scene's earlier run; None in a scene without one.

    raises  SceneError when there is no such run, or it cannot be read
    """
    table = scene.earlier
    if table is None:
        return None
    path = scene.folder / table.run
    try:
        if path.is_file():
            return _read_file(path, path.stat().st_mtime_ns)
        files = RunFolder.existing(path).state_files()
        stamp = (len(files), max((file.stat().st_mtime_ns for file in files), default=0))
        return _read_run(path.resolve(), stamp)
    except RunFolderError as error:
        raise SceneError(f"{error}.") from None
    except (OSError, ValueError) as error:
        raise SceneError(f"{error}. Give the folder of a run.") from None


def earlier_joints(scene: Scene) -> tuple[str, ...]:
    """Names of the joints that repeat their motion of the earlier run; none without one.

    raises  as `earlier_of`
    """
    earlier, table = earlier_of(scene), scene.earlier
    if earlier is None or table is None:
        return ()
    if table.joints is not None:
        return table.joints
    moved = scene.moved_joints()
    return tuple(joint for joint in earlier.poses if joint not in moved)


def earlier_motion(scene: Scene, model: SolidModel) -> TrajectoryClip | None:
    """The motion that the earlier run gives to joints; None without one, or without joints.

    A cubic spline through the poses of its frames, extrapolated by one frame, because the velocity
    at the end of a run is that of the middle of the next step. After that joints stand still.
    """
    earlier, joints = earlier_of(scene), earlier_joints(scene)
    if earlier is None or not joints:
        return None
    columns = columns_of(model, sorted(model.joint(joint) for joint in joints))
    poses = np.concatenate([earlier.poses[name] for name in columns.names], axis=1)
    rows = np.stack([row_of(columns, pose) for pose in poses])
    quaternions = columns.quaternions(rows)
    for ball in range(columns.balls):
        quaternions[:, ball] = continuous(quaternions[:, ball])
    times = earlier.times - earlier.times[0]
    length = float(times[-1] + (times[-1] - times[-2]))
    spline = CubicSpline(times, rows)
    return TrajectoryClip(columns.dofs, columns, spline, 0.0, length, 0.0, rows[0], None, 0.0)


@lru_cache(maxsize=4)
def _read_file(path: Path, stamp: int) -> Earlier:
    """The motion in a file; cached until the file's time stamp changes."""
    poses = {name: np.asarray(values, float) for name, values in read_arrays(path).items()}
    return _whole(path, Earlier(poses.pop(TIME, np.zeros(0)), poses))


@lru_cache(maxsize=4)
def _read_run(path: Path, stamp: tuple[int, int]) -> Earlier:
    """Motion of the joints that a run controlled, or took from an earlier run."""
    folder = RunFolder(path)
    with reading(path):
        model = read_json(folder.model)
        places = {name: slice(*model["places"][name]) for name in model["decided"]}
        times, q = poses_of(sorted(folder.state_files()))
        found = Earlier(times, {name: q[:, at] for name, at in places.items()})
    return _whole(path, found)


def poses_of(states: list[Path]) -> tuple[Array, Array]:
    """(n,) times, s, and (n, nq) positions of saved states."""
    found = [read_state(state, ("time", "q")) for state in states]
    times = np.array([float(state["time"]) for state in found])
    return times, np.array([state["q"] for state in found], float)


def _whole(path: Path, earlier: Earlier) -> Earlier:
    """The motion that was read. Raises ValueError if it is incomplete."""
    times, poses = earlier.times, earlier.poses
    if not poses:
        raise ValueError(f"{path} has no joint that was controlled")
    alike = all(values.ndim == 2 and len(values) == len(times) for values in poses.values())
    finite = all(np.isfinite(values).all() for values in (times, *poses.values()))
    if not (times.ndim == 1 and alike and finite):
        raise ValueError(f"{path} does not hold what joints did in a run")
    if len(times) < LEAST or not np.all(np.diff(times) > 0.0):
        raise ValueError(f"{path} has no frame yet, or frames that do not follow each other")
    return earlier


def check_earlier_joints(draft: Draft, around: Surroundings) -> Iterator[str]:
    """Joints of the earlier run against the model, and against what else moves them."""
    scene, earlier = draft.scene, earlier_of(draft.scene)
    if earlier is None:
        return
    others, joints = scene.moved_joints(), earlier_joints(scene)
    if not joints:
        yield (
            f"{draft.at('earlier')}: what was controlled there is so here, or has a [[motion]]: "
            f"{', '.join(earlier.poses)}. Take a joint out of [[control]], or the table away."
        )
    for joint in joints:
        where = draft.at("earlier", "joints")
        unknown = draft.said(around.unknown_joints([joint]), "earlier")
        yield from unknown
        if joint in others:
            yield (
                f"{where}: joint '{joint}' is {others[joint]} as well. Take it out of one of the "
                "two."
            )
        if unknown:
            continue
        if joint not in earlier.poses:
            end = suggestion(joint, earlier.poses, "They are")
            yield f"{where}: joint '{joint}' was not controlled in the earlier run{end}"
        else:
            there, here = earlier.poses[joint].shape[1], len(around.model.positions_of(joint))
            if there != here:
                yield (
                    f"{where}: joint '{joint}' has {there} numbers in the earlier run and {here} "
                    "in this model. Take the same model, or leave the joint out."
                )

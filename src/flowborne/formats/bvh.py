"""The motion of a run as BVH: on the clip's own skeleton, or on that of the bodies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.errors import SceneError
from flowborne.formats.creature import Array, Creature
from flowborne.motion.bvh import write_clip
from flowborne.motion.clip import Clip
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import OpenRun
from flowborne.scenes.motion_out import export_bvh

UNIT = 0.01
"""m per length of the file."""

SLIDING = 1e-6
"""Part of the creature's size by which a joint moves in its parent's frame before the file says so,
with channels of its own for it; and below which a bone has no length."""


@provided(".bvh")
@dataclass(frozen=True)
class ExporterBvh:
    """The clip's own file where the run follows one, else a joint for each body.

    Without a clip rotations are counted from the model's own pose, a frame of the file is a state
    of the run, lengths are centimetres, y is up.
    """

    def write(self, run: OpenRun, path: Path) -> Written | None:
        if len(run) < 2:
            raise SceneError(f"{run.folder} has no motion yet. Let the run go on with --resume.")
        if "clip" in run.scene:
            return Written((path,), export_bvh(run.folder, path))
        creature = Creature(run)
        clip, places = clip_of(creature)
        write_clip(path, clip, UNIT, places)
        return None


def clip_of(creature: Creature) -> tuple[Clip, dict[str, Array]]:
    """The motion of a skeleton, and joint -> (frames, 3) places in its parent's axes, m, of those
    that slide in it."""
    skeleton = creature.skeleton
    names = tuple("_".join(name.split()) for name in skeleton.names)  # a space ends a name
    place, frame = skeleton.rest
    parents = skeleton.parents
    turn = np.einsum("fnij,nkj->fnik", skeleton.rotation, frame)
    offsets = place - np.where(parents[:, None] < 0, place, place[parents])
    above = np.where((parents < 0)[None, :, None, None], np.eye(3), turn[:, parents])
    apart = skeleton.position - skeleton.position[:, parents]
    local = np.einsum("fnji,fnj->fni", above, apart)
    strays = np.linalg.norm(local - offsets, axis=2).max(axis=0) > SLIDING * creature.size
    sliding = np.flatnonzero(strays & (parents >= 0))
    turns = np.einsum("fnji,fnjk->fnik", above, turn)
    quaternions = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    clip = Clip(
        names=names,
        parents=parents,
        offsets=offsets,
        ends={names[bone]: end for bone, end in _ends(creature).items()},
        frame_time=1.0 / creature.run.frames_per_second,
        rotations=quaternions.reshape(*turns.shape[:2], 4),
        translation=skeleton.position[:, 0],
    )
    return clip, {names[joint]: local[:, joint] for joint in sliding}


def _ends(creature: Creature) -> dict[int, Array]:
    """Bone -> (3,) m, where a last bone ends: twice as far as its surfaces' middle, or at their
    farthest place where that is the joint itself."""
    skeleton, ends = creature.skeleton, {}
    for bone in set(range(len(skeleton.names))) - set(skeleton.parents.tolist()):
        own = [surface.vertices for surface in creature.surfaces if surface.bone == bone]
        start = skeleton.rest[0][bone]
        if not own:
            continue
        away = np.concatenate(own) - start
        ends[bone] = 2.0 * away.mean(axis=0)
        if np.linalg.norm(ends[bone]) < SLIDING * creature.size:
            ends[bone] = away[np.linalg.norm(away, axis=1).argmax()]
    return ends

"""The motion of a run as BVH: on the skeleton of its clip, or on that of the bodies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.formats.creature import Creature, quaternions, relative_to_parents
from flowborne.kernels.arrays import Array
from flowborne.motion.bvh import write_clip
from flowborne.motion.clip import Clip
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import StoredRun
from flowborne.scenes.motion_out import export_bvh

UNIT = 0.01
"""m per unit of length in the file."""

MIN_LENGTH = 1e-6
"""In sizes of the creature: a joint that moves farther in its parent's frame has position
channels; a shorter bone counts as having no length."""


@provided(".bvh")
@dataclass(frozen=True)
class ExporterBvh:
    """The skeleton of the clip if the run follows one, else a joint for each body.

    Without a clip, rotations are relative to the model's rest pose, a frame of the file is a state
    of the run, lengths are in centimetres and y is up.
    """

    def write(self, run: StoredRun, path: Path) -> Written | None:
        if len(run) < 2:
            raise SceneError(f"{run.folder} has no motion yet. Continue the run with resume=True.")
        if "clip" in run.tables:
            return Written((path,), export_bvh(run.folder, path))
        creature = Creature(run)
        clip, positions = _clip_of(creature)
        write_clip(path, clip, UNIT, positions)
        return None


def _clip_of(creature: Creature) -> tuple[Clip, dict[str, Array]]:
    """The motion of a skeleton, and sliding joint -> (frames, 3) m, position in its parent."""
    skeleton = creature.skeleton
    names = tuple("_".join(name.split()) for name in skeleton.names)  # a space ends a name
    rest, parents = skeleton.rest[0], skeleton.parents
    rotation, _ = skeleton.carried
    offsets = rest - np.where(parents[:, None] < 0, rest, rest[parents])
    position, relative = relative_to_parents(parents, skeleton.position, rotation)
    slides = np.linalg.norm(position - offsets, axis=2).max(axis=0) > MIN_LENGTH * creature.size
    sliding = np.flatnonzero(slides & (parents >= 0))
    clip = Clip(
        names=names,
        parents=parents,
        offsets=offsets,
        ends={names[bone]: end for bone, end in _ends(creature).items()},
        frame_time=1.0 / creature.run.frames_per_second,
        rotations=np.roll(quaternions(relative), 1, axis=-1),
        translation=skeleton.position[:, 0],
    )
    return clip, {names[joint]: position[:, joint] for joint in sliding}


def _ends(creature: Creature) -> dict[int, Array]:
    """End (3,) of each bone without children, relative to its joint, m.

    It is at twice the mean of the bone's vertices, or at the farthest vertex if that mean is the
    joint itself.
    """
    skeleton, ends = creature.skeleton, {}
    for bone in set(range(len(skeleton.names))) - set(skeleton.parents.tolist()):
        own = [surface.vertices for surface in creature.surfaces if surface.bone == bone]
        start = skeleton.rest[0][bone]
        if not own:
            continue
        offset = np.concatenate(own) - start
        ends[bone] = 2.0 * offset.mean(axis=0)
        if np.linalg.norm(ends[bone]) < MIN_LENGTH * creature.size:
            ends[bone] = offset[np.linalg.norm(offset, axis=1).argmax()]
    return ends

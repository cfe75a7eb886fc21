"""A motion clip: a skeleton of rigid bones and how it moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.quaternions import product, rotated


@dataclass(frozen=True, eq=False)
class Clip:
    """Motion of a skeleton of rigid bones; z up, x forward, y left.

    names        (n) joints, parents before children; the first is the root
    parents      (n,) int64 number of the parent, -1 for the root
    offsets      (n, 3) m, from the parent joint with all rotations zero; root: 0
    ends         joint name -> (3,) m, end site of a last bone, from its joint
    frame_time   s
    rotations    (frames, n, 4) unit quaternions, joint relative to parent (root: to the world)
    translation  (frames, 3) m, position of the root
    deviations   joint name -> its largest distance in the file from the end of its rigid bone, m,
                 and the frame where it occurs
    """

    names: tuple[str, ...]
    parents: Integers
    offsets: Array
    ends: Mapping[str, Array]
    frame_time: float
    rotations: Array
    translation: Array
    deviations: Mapping[str, tuple[float, int]] = field(default_factory=dict)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.rotations)

    @property
    def duration(self) -> float:
        """s from the first frame to the last."""
        return (self.frames - 1) * self.frame_time

    @property
    def rest(self) -> Array:
        """(n, 3) m, positions of the joints with all rotations zero and the root at the origin."""
        positions = self.offsets.copy()
        for joint, parent in enumerate(self.parents[1:], start=1):
            positions[joint] += positions[parent]
        return positions

    def rotation_steps(self) -> Array:
        """(frames - 1, n) rotation angle of each joint from a frame to the next, rad."""
        same = np.abs(np.einsum("fnk,fnk->fn", self.rotations[1:], self.rotations[:-1]))
        return 2.0 * np.arccos(np.minimum(same, 1.0))

    def placed(self, offset: tuple[float, ...], heading: float) -> Clip:
        """The clip rotated to the left by `heading` (rad) about the vertical through the start of
        the root, then moved by `offset` (3,) m."""
        if not any(offset) and heading == 0.0:
            return self
        left = np.array([np.cos(0.5 * heading), 0.0, 0.0, np.sin(0.5 * heading)])
        begin = self.translation[0]
        rotations = self.rotations.copy()
        rotations[:, 0] = product(left, rotations[:, 0])
        translation = begin + rotated(left, self.translation - begin) + np.array(offset)
        return replace(self, rotations=rotations, translation=translation)

    def lineage(self, joint: str) -> list[int]:
        """Numbers of a joint and all its ancestors, up to the root."""
        numbers = [self.names.index(joint)]
        while self.parents[numbers[-1]] >= 0:
            numbers.append(int(self.parents[numbers[-1]]))
        return numbers

    def poses(self, frame: int | slice | Integers = slice(None)) -> tuple[Array, Array]:
        """World poses of the joints, in one frame or in several.

        returns  (..., n, 3) positions, m, and (..., n, 4) rotations, unit quaternions; without the
                 leading axis for a single frame
        """
        local, root = self.rotations[frame], self.translation[frame]
        positions, rotations = np.empty((*local.shape[:-1], 3)), np.empty(local.shape)
        positions[..., 0, :], rotations[..., 0, :] = root, local[..., 0, :]
        for joint, parent in enumerate(self.parents[1:], start=1):
            above = rotations[..., parent, :]
            rotations[..., joint, :] = product(above, local[..., joint, :])
            step = rotated(above, self.offsets[joint])
            positions[..., joint, :] = positions[..., parent, :] + step
        return positions, rotations

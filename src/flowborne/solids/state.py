"""The creature's part of the state."""

from __future__ import annotations

from dataclasses import dataclass

from flowborne.kernels.arrays import Array


@dataclass
class SolidState:
    """Positions and velocities of the articulated bodies in generalised coordinates.

    q  (nq,) MuJoCo's qpos: m, rad, unit quaternions
    v  (nv,) MuJoCo's qvel: m/s, rad/s
    """

    q: Array
    v: Array

    def copy(self) -> SolidState:
        return SolidState(self.q.copy(), self.v.copy())

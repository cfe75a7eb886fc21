"""Where the outermost places of all geometries are, for any pose and at little cost."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from flowborne.solids.model import SolidModel

Array = NDArray[np.float64]


class Outline:
    """Places on the bodies that lie farthest out, without those of flesh.

    body  (n,) body of each place
    mass  (n,) share of its body's mass, kg
    """

    def __init__(self, model: SolidModel) -> None:
        self._mj, self._data = model.mj, mujoco.MjData(model.mj)
        self._local = [shape.outermost() for shape in model.geom_shape]
        self._geom = model.geom_id
        counts = [len(places) for places in self._local]
        self.body: NDArray[np.int64] = np.repeat(model.geom_body, counts)
        shared = np.bincount(self.body, minlength=model.nbody)[self.body]
        self.mass: Array = model.body_mass[self.body] / shared

    def at(self, q: Array) -> Array:
        """(n, 3) the places in the world, m, with the joints at `q` (nq,)."""
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self._mj, self._data)
        position, rotation = self._data.geom_xpos, self._data.geom_xmat.reshape(-1, 3, 3)
        placed = [
            position[g] + local @ rotation[g].T
            for g, local in zip(self._geom, self._local, strict=True)
        ]
        return np.concatenate(placed) if placed else np.zeros((0, 3))

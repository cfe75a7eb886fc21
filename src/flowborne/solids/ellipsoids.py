"""What MuJoCo's ellipsoid fluid model would give: an estimate without a flow, to compare with.

Source: MuJoCo, Computation, Fluid forces, Ellipsoid model. It is stateless: a body's force follows
from its velocity relative to a uniform stream, as a sum over geoms, each as the ellipsoid with its
semi-axes.
"""

from __future__ import annotations

import mujoco
import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.geoms import kind_of, quaternion_of
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import cross

COEFFICIENTS = slice(1, 6)
"""Of `fluidcoef`, in a row of MuJoCo's `geom_fluid` after the switch."""


class EllipsoidModel:
    """The forces of the model on the bodies of `model` that displace fluid.

    Each moves freely in a model of its own, so that the force on bodies that are held is known,
    too. Coefficients are those of geoms with `fluidshape="ellipsoid"`, and MuJoCo's for all others.

    density    kg/m^3
    viscosity  Pa s
    stream     (3,) velocity of the fluid, m/s
    """

    def __init__(
        self, model: SolidModel, density: float, viscosity: float, stream: tuple[float, ...]
    ) -> None:
        spec = mujoco.MjSpec()
        spec.option.density, spec.option.viscosity = density, viscosity
        spec.option.wind = stream
        open_geoms = ~model.geom_covered & (model.geom_body > 0)
        self.bodies = np.unique(model.geom_body[open_geoms])
        for b in self.bodies:
            body = spec.worldbody.add_body(mass=1.0, inertia=(1.0,) * 3, explicitinertial=True)
            body.add_freejoint()
            for n in np.flatnonzero(open_geoms & (model.geom_body == b)):
                g = int(model.geom_id[n])
                geom = body.add_geom(
                    type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
                    size=semi_axes(model.mj, g),
                    pos=model.mj.geom_pos[g],
                    quat=model.mj.geom_quat[g],
                    fluid_ellipsoid=1,
                    contype=0,
                    conaffinity=0,
                )
                if model.mj.geom_fluid[g, 0] > 0.0:
                    geom.fluid_coefs = model.mj.geom_fluid[g, COEFFICIENTS]
        self._mj = spec.compile()
        self._data = mujoco.MjData(self._mj)

    def force_and_power(self, pose: Kinematics, velocity: Array) -> tuple[Array, float]:
        """(3,) force of the fluid on all bodies, N, and the power that they give to it, W.

        velocity  (nv,) of the joints at `pose`
        """
        data, at = self._data, pose.body_position[self.bodies]
        rotation = pose.body_rotation[self.bodies]
        twist = pose.twist_jacobian[self.bodies] @ velocity
        turn = twist[:, 3:]
        linear = twist[:, :3] + cross(turn, at)
        quaternions = [quaternion_of(own) for own in rotation]
        data.qpos[:] = np.hstack([at, np.reshape(quaternions, (-1, 4))]).ravel()
        data.qvel[:] = np.hstack([linear, np.einsum("bji,bj->bi", rotation, turn)]).ravel()
        mujoco.mj_kinematics(self._mj, data)
        mujoco.mj_comPos(self._mj, data)
        mujoco.mj_comVel(self._mj, data)
        mujoco.mj_passive(self._mj, data)
        force = data.qfrc_fluid.reshape(-1, 6)[:, :3].sum(axis=0)
        return force, -float(data.qfrc_fluid @ data.qvel)


def semi_axes(mj: mujoco.MjModel, geom: int) -> Array:
    """(3,) those of the ellipsoid by which MuJoCo replaces a geom, m (mju_geomSemiAxes)."""
    radius, height, _ = size = np.array(mj.geom_size[geom])
    return {
        "sphere": np.full(3, radius),
        "capsule": np.array([radius, radius, height + radius]),
        "cylinder": np.array([radius, radius, height]),
    }.get(kind_of(mj, geom), size)

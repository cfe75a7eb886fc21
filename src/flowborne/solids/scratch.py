"""MuJoCo's working memory: one per thread and model, never part of the state.

Nothing in it carries over: every use sets positions, velocities and applied forces anew, and
warm starts are off, so results depend on arguments only. What is remembered of momenta is found by
these arguments, to the last bit.
"""

from __future__ import annotations

import copy
import logging
import threading
import weakref
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from flowborne.kernels.momentum import about_origin

Array = NDArray[np.float64]
# MuJoCo would leave a file of warnings where the user works: of its own solution, a mere start here
mujoco.set_mju_user_warning(logging.getLogger(__name__).debug)


class Compiled(Protocol):
    """A model of which MuJoCo's is known, whatever else of it is still to be built.

    mj  MuJoCo's model
    """

    mj: mujoco.MjModel


class Scratch:
    """MjData and a private MjModel, whose time step may be set without other threads seeing it.

    mj, data    MuJoCo's model and data
    q, v, ...   lasting views into `data`
    momenta     the last few half-way momenta by their state, see solids.momentum
    """

    def __init__(self, model: Compiled) -> None:
        self.mj = copy.copy(model.mj)
        self.data = data = mujoco.MjData(self.mj)
        self.dt = float(self.mj.opt.timestep)
        self._mass: Array | None = None
        self.momenta: dict[tuple[bytes, bytes, float], Array] = {}
        self.q, self.v = data.qpos, data.qvel
        self.applied = data.qfrc_applied
        self.smooth, self.bias = data.qfrc_smooth, data.qfrc_bias
        self.cdof = data.cdof
        self.subtree_com = data.subtree_com
        self.subtree_linvel, self.subtree_angmom = data.subtree_linvel, data.subtree_angmom
        self.xpos, self.xmat, self.xipos = data.xpos, data.xmat, data.xipos
        self.geom_xpos, self.geom_xmat = data.geom_xpos, data.geom_xmat

    def set_time_step(self, dt: float) -> None:
        """Time step that implicit terms and constraint references are made for, s."""
        if dt != self.dt:
            self.mj.opt.timestep = self.dt = dt

    def place(self, q: Array, v: Array | None = None) -> None:
        """Poses of everything at `q`, and velocities of everything when `v` is given."""
        self.q[:] = q
        mujoco.mj_kinematics(self.mj, self.data)
        mujoco.mj_comPos(self.mj, self.data)
        if v is not None:
            self.v[:] = v
            mujoco.mj_comVel(self.mj, self.data)

    def forward(self, q: Array, v: Array, applied: Array) -> None:
        """Everything up to the acceleration, with constraints."""
        self.q[:] = q
        self.v[:] = v
        self.applied[:] = applied
        mujoco.mj_forward(self.mj, self.data)

    def smooth_forces(self, q: Array, v: Array, applied: Array) -> None:
        """Everything up to the forces other than those of constraints, without solving for them."""
        self.q[:] = q
        self.v[:] = v
        self.applied[:] = applied
        mujoco.mj_fwdPosition(self.mj, self.data)
        mujoco.mj_fwdVelocity(self.mj, self.data)
        mujoco.mj_fwdActuation(self.mj, self.data)
        mujoco.mj_fwdAcceleration(self.mj, self.data)

    def mass_matrix(self) -> Array:
        """(nv, nv) mass matrix at the present pose; overwritten by the next call."""
        if self._mass is None:  # gigabytes where there is much flesh, which does not ask for it
            self._mass = np.zeros((self.mj.nv, self.mj.nv))
        if self._mass.size:
            mujoco.mj_fullM(self.mj, self.data, self._mass)
        return self._mass


_local = threading.local()


def scratch(model: Compiled) -> Scratch:
    """This thread's working memory for `model`."""
    known: weakref.WeakKeyDictionary[Compiled, Scratch] | None = getattr(_local, "known", None)
    if known is None:
        known = _local.known = weakref.WeakKeyDictionary()
    found = known.get(model)
    if found is None:
        found = known[model] = Scratch(model)
    return found


def cross(a: Array, b: Array) -> Array:
    """(k, 3) vector products of rows; np.cross takes ten times as long for few rows."""
    product = np.empty((len(b), 3))
    product[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    product[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    product[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def twists_about_origin(cdof: Array, centre: Array) -> Array:
    """(nv, 6) velocity of the point at the world origin, and angular velocity, of unit velocity of
    each dof.

    cdof    (nv, 6) angular velocity, and velocity of the point at `centre`
    centre  (nv, 3) m
    """
    turn, speed = np.ascontiguousarray(cdof[:, :3]), np.ascontiguousarray(cdof[:, 3:])
    return np.concatenate([about_origin(turn, speed, centre)[:, 3:], turn], axis=1)

"""MuJoCo's working memory, one per thread and model, and twists of its dofs; not part of the state.

Every use sets positions, velocities and applied forces, and warm starts are off, so results depend
on arguments only. Cached momenta are looked up by the exact bits of these arguments.
"""

from __future__ import annotations

import copy
import logging
import threading
import weakref
from typing import Protocol

import mujoco
import numpy as np

from flowborne.kernels.arrays import Array, Mask
from flowborne.kernels.momentum import about_origin

# MuJoCo would write a file of warnings about its own solution into the working folder
mujoco.set_mju_user_warning(logging.getLogger(__name__).debug)


DEFAULT_SOLREF = 0.02, 1.0
"""MuJoCo's default time constant, s, and damping ratio of a constraint."""

STOP_STEPS = 2.0
"""Steps in the time constant of a stop at that default: as stiff as MuJoCo lets one be."""

ONE_AXIS = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
"""Kinds of joints with one dof."""


class Compiled(Protocol):
    """A model with at least its compiled MuJoCo model.

    mj  MuJoCo's model
    """

    mj: mujoco.MjModel


class Scratch:
    """MjData and a private MjModel; its time step can be set without effect on other threads.

    mj, data    MuJoCo's model and data
    stiff       (njnt,) joints that stop as stiffly as the step allows, see `stiffen`
    q, v, ...   views into `data`
    momenta     cached half-way momenta by state, see solids.momentum
    """

    def __init__(self, model: Compiled) -> None:
        self.mj = copy.copy(model.mj)
        self.data = data = mujoco.MjData(self.mj)
        self.dt = float(self.mj.opt.timestep)
        at_default = (model.mj.jnt_solref == DEFAULT_SOLREF).all(axis=1)
        self._stops = np.flatnonzero(at_default & (model.mj.jnt_limited != 0))
        self._scalar = np.isin(model.mj.jnt_type[self._stops], ONE_AXIS)
        self._margin = model.mj.jnt_margin[self._stops]
        self.stiff: Mask = np.zeros(model.mj.njnt, bool)
        self._root = self.mj.body_rootid[self.mj.dof_bodyid]
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
        """Set the time step of implicit terms and constraint references, s."""
        if dt != self.dt:
            self.mj.opt.timestep = self.dt = dt

    def stiffen(self, v: Array, exact: Mask | None) -> None:
        """Make stops as stiff as the step allows which the model leaves at MuJoCo's default, and
        give a hinge or slide its row from where the velocity v (nv,) brings it there in two steps.

        At the default of 20 ms a wing that beats 34 times a second passes a stop at 45 degrees by
        more than 180. Stops of drives that nothing holds up stay as they are, as they add to the
        drives' forces only.

        exact  (nv,) dofs with such a drive; None without any
        """
        stops = self._stops
        if not stops.size:
            return
        first = self.mj.jnt_dofadr[stops]
        free = np.ones(stops.size, bool) if exact is None else ~exact[first]
        self.stiff[stops] = free
        self.mj.jnt_solref[stops, 0] = np.where(free, STOP_STEPS * self.dt, DEFAULT_SOLREF[0])
        way = STOP_STEPS * self.dt * np.abs(v[first])
        self.mj.jnt_margin[stops] = self._margin + np.where(free & self._scalar, way, 0.0)

    def place(self, q: Array, v: Array | None = None) -> None:
        """Compute all poses at `q`, and all velocities when `v` is given."""
        self.q[:] = q
        mujoco.mj_kinematics(self.mj, self.data)
        mujoco.mj_comPos(self.mj, self.data)
        if v is not None:
            self.v[:] = v
            mujoco.mj_comVel(self.mj, self.data)

    def forward(self, q: Array, v: Array, applied: Array) -> None:
        """Compute everything up to the acceleration, with constraints."""
        self.q[:], self.v[:], self.applied[:] = q, v, applied
        mujoco.mj_forward(self.mj, self.data)

    def smooth_forces(self, q: Array, v: Array, applied: Array) -> None:
        """Compute everything up to the forces, without solving for constraint forces."""
        self.q[:], self.v[:], self.applied[:] = q, v, applied
        mujoco.mj_fwdPosition(self.mj, self.data)
        mujoco.mj_fwdVelocity(self.mj, self.data)
        mujoco.mj_fwdActuation(self.mj, self.data)
        mujoco.mj_fwdAcceleration(self.mj, self.data)

    def dof_centre(self) -> Array:
        """(nv, 3) points to which `cdof` refers, m: the centre of mass of each dof's tree."""
        return self.subtree_com[self._root]

    def mass_matrix(self) -> Array:
        """(nv, nv) mass matrix at the present pose; overwritten by the next call."""
        if self._mass is None:  # gigabytes for models with flesh, which never call this
            self._mass = np.zeros((self.mj.nv, self.mj.nv))
        if self._mass.size:
            mujoco.mj_fullM(self.mj, self.data, self._mass)
        return self._mass


def time_constant(solref: Array) -> float:
    """s of a constraint; that of a stiffness k is 1 / sqrt(k)."""
    first, ratio = float(solref[0]), float(solref[1])
    return first * ratio if first > 0.0 else 1.0 / max(-first, 1e-12) ** 0.5


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


def posed(model: Compiled, q: Array) -> Scratch:
    """This thread's working memory for `model`, with all poses at `q`."""
    s = scratch(model)
    s.place(q)
    return s


def cross(a: Array, b: Array) -> Array:
    """a x b over the last axis; np.cross takes ten times as long for few rows."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    product[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    product[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def twists_about_origin(cdof: Array, centre: Array) -> Array:
    """(nv, 6) velocity of the point at the world origin, and angular velocity, for unit velocity of
    each dof.

    cdof    (nv, 6) angular velocity, and velocity of the point at `centre`
    centre  (nv, 3) m
    """
    turn, speed = np.ascontiguousarray(cdof[:, :3]), np.ascontiguousarray(cdof[:, 3:])
    return np.concatenate([about_origin(turn, speed, centre)[:, 3:], turn], axis=1)

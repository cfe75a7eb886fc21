"""Growing flesh onto the bones of an MJCF model: elastic tetrahedra, held by bones at points.

A point that no bone holds becomes a body of its own that hangs on the world by three slides. Under
a bone, as MuJoCo's own flexcomp has it, it would ride in that bone's frame, and the bone's row and
column would be full in both the mass and the stiffness matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import mujoco
import numpy as np
from numpy.typing import NDArray

from flowborne.solids.mjcf import compiled_quietly

Array = NDArray[np.float64]
Tetrahedra = NDArray[np.int64]

WORLD = "world"

LEAST_INERTIA = 1e-12
"""MuJoCo refuses moving bodies of less than 1e-15 kg m^2, even those that only slide."""


class Law(IntEnum):
    """How stress follows strain, numbered as MuJoCo's `elastic3d`; small strains see no difference.

    SAINT_VENANT_KIRCHHOFF  gives way when crushed, and may stay inside out
    STABLE_NEO_HOOKEAN      turns right side out again
    """

    SAINT_VENANT_KIRCHHOFF = 0
    STABLE_NEO_HOOKEAN = 1


@dataclass(frozen=True)
class Tissue:
    """An elastic material.

    young    N/m^2
    poisson  from 0 to below 0.5
    density  kg/m^3
    damping  s, Rayleigh's: the damping matrix is this times the stiffness matrix
    """

    young: float
    poisson: float
    density: float
    damping: float = 0.0
    law: Law = Law.SAINT_VENANT_KIRCHHOFF


def volumes(points: Array, tetrahedra: Tetrahedra) -> Array:
    """(m,) signed volumes of tetrahedra (m, 4) of points (n, 3), m^3."""
    corners = points[tetrahedra]
    return np.asarray(np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0)


def right_handed(points: Array, tetrahedra: Tetrahedra) -> Tetrahedra:
    """(m, 4) the same tetrahedra, those of negative volume with two corners exchanged."""
    left = volumes(points, tetrahedra) < 0.0
    return np.where(left[:, None], tetrahedra[:, [0, 1, 3, 2]], tetrahedra)


def add_flesh(
    spec: mujoco.MjSpec,
    name: str,
    points: Array,
    tetrahedra: Tetrahedra,
    tissue: Tissue,
    holders: Sequence[str],
) -> None:
    """Add flesh to a model; its mass is lumped to its points by volume.

    points      (n, 3) at rest, in world axes, m
    tetrahedra  (m, 4) points of each element, of positive volume
    holders     n names: the body that holds the point, "" for none. The mass of held points is
                given to the body that holds them
    raises      ValueError for an element without volume, and for a holder that is no body
    """
    volume = volumes(points, tetrahedra)
    if not volume.min() > 0.0:
        worst = int(volume.argmin())
        place = ", ".join(f"{x:.4g}" for x in points[tetrahedra[worst]].mean(axis=0))
        raise ValueError(
            f"flesh '{name}': element {worst} at ({place}) m has the volume {volume[worst]:g} m^3. "
            "Order its corners right-handed, or leave it out."
        )
    mass = np.bincount(
        tetrahedra.ravel(), np.repeat(0.25 * tissue.density * volume, 4), len(points)
    )
    inertia = 0.4 * mass * (0.75 * mass / (np.pi * tissue.density)) ** (2.0 / 3.0)
    frames = _frames(spec, name, holders)
    bodies, offsets = [], np.zeros_like(points)
    for i, holder in enumerate(holders):
        if holder:
            position, rotation = frames[holder]
            offsets[i] = rotation.T @ (points[i] - position)
        bodies.append(holder or _hang(spec, f"{name}:{i}", points[i], mass[i], inertia[i]))
    for holder in sorted(frames.keys() - {WORLD}):
        held = np.array([h == holder for h in holders])
        _load(spec, holder, offsets[held], mass[held], inertia[held])
    _flex(spec, name, tissue, bodies, offsets, tetrahedra)


def _frames(
    spec: mujoco.MjSpec, name: str, holders: Sequence[str]
) -> dict[str, tuple[Array, Array]]:
    """Position and rotation at rest of the bodies that hold flesh."""
    mj = compiled_quietly(spec.copy())
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    frames = {}
    for holder in {h for h in holders if h}:
        body = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_BODY, holder)
        if body < 0:
            raise ValueError(
                f"flesh '{name}': there is no body '{holder}' to hold it. Name a body of the model."
            )
        frames[holder] = (data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy())
    return frames


def _hang(spec: mujoco.MjSpec, name: str, place: Array, mass: float, inertia: float) -> str:
    """A point of flesh that moves freely."""
    body = spec.worldbody.add_body(name=name, pos=place)
    body.mass, body.explicitinertial = mass, True
    body.inertia = np.full(3, max(inertia, LEAST_INERTIA))
    body.ipos = np.zeros(3)  # left out, it becomes the body's own place, once more
    for axis, direction in zip("xyz", np.eye(3), strict=True):
        joint = body.add_joint(name=f"{name}:{axis}", type=mujoco.mjtJoint.mjJNT_SLIDE)
        joint.axis, joint.limited = direction, mujoco.mjtLimited.mjLIMITED_FALSE
        # the model's defaults for its own joints are none of flesh's
        joint.stiffness[:] = joint.damping[:] = joint.armature = joint.frictionloss = 0.0
    return name


def _load(spec: mujoco.MjSpec, holder: str, offsets: Array, mass: Array, inertia: Array) -> None:
    """Give a bone the mass of the points that it holds, at `offsets` (n, 3) in its frame."""
    mj = compiled_quietly(spec.copy())
    b = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_BODY, holder)
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, mj.body_iquat[b])
    axes = turn.reshape(3, 3)
    masses = np.append(mass, mj.body_mass[b])
    places = np.concatenate([offsets, mj.body_ipos[b][None]])
    centre = masses @ places / masses.sum()
    arms = places - centre
    about = np.eye(3) * (masses @ (arms**2).sum(axis=1) + inertia.sum()) - (arms.T * masses) @ arms
    about += axes @ np.diag(mj.body_inertia[b]) @ axes.T
    body = spec.body(holder)
    body.mass, body.ipos, body.explicitinertial = masses.sum(), centre, True
    body.iquat, body.inertia = (1.0, 0.0, 0.0, 0.0), np.zeros(3)
    body.fullinertia = about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def _flex(
    spec: mujoco.MjSpec,
    name: str,
    tissue: Tissue,
    bodies: Sequence[str],
    offsets: Array,
    tetrahedra: Tetrahedra,
) -> None:
    flex = spec.add_flex(name=name)
    flex.dim, flex.vertbody = 3, list(bodies)
    flex.vert, flex.elem = offsets.ravel().tolist(), tetrahedra.ravel().tolist()
    flex.young, flex.poisson, flex.damping = tissue.young, tissue.poisson, tissue.damping
    flex.elastic3d = int(tissue.law)
    flex.contype = flex.conaffinity = 0
    flex.selfcollide = mujoco.mjtFlexSelf.mjFLEXSELF_NONE

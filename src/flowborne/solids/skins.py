"""The skins of a model: drawn surfaces that follow several bodies and do not displace fluid."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.geoms import element_name, rest_poses


@dataclass(frozen=True, eq=False)
class ModelSkin:
    """A <skin> of an MJCF model.

    name      of the skin
    vertices  (k, 3) m in the model's own pose
    faces     (m, 3) of them, outward
    weights   (k, bodies) share of each body in the motion of a vertex, sum 1
    rgba      (4,) colour
    """

    name: str
    vertices: Array
    faces: Integers
    weights: Array
    rgba: Array


def skinned(vertices: Array, weights: Array, turn: Array, shift: Array) -> Array:
    """(k, 3) vertices of a surface that follows bodies, m: linear blend skinning.

    vertices     (k, 3) m before the bodies move
    weights      (k, n) share of each body in the motion of a vertex, sum 1
    turn, shift  (n, 3, 3) R and (n, 3) t of the motion x -> R x + t of each body, m
    """
    blended = np.einsum("kn,nij->kij", weights, turn)
    return np.asarray(np.einsum("kij,kj->ki", blended, vertices) + weights @ shift)


def clad_bodies(mj: mujoco.MjModel) -> Mask:
    """(nbody,) bodies that a skin covers: it follows them, or bodies that are rigid with them."""
    carrying = np.zeros(mj.nbody, bool)
    for skin in skins_of(mj):
        carrying |= skin.weights.any(axis=0)
    carrying[0] = False
    found: Mask = np.isin(mj.body_weldid, mj.body_weldid[carrying])
    found[0] = False
    return found


def skins_of(mj: mujoco.MjModel) -> tuple[ModelSkin, ...]:
    """The skins at the model's rest pose, moved from the pose in which they were bound."""
    position, rotation, _, _ = rest_poses(mj)
    return tuple(_skin(mj, skin, position, rotation) for skin in range(mj.nskin))


def _skin(mj: mujoco.MjModel, skin: int, position: Array, rotation: Array) -> ModelSkin:
    given = mj.skin_vert[_entries(mj.skin_vertadr, mj.skin_vertnum, skin)].astype(float)
    vertices, weights = np.zeros_like(given), np.zeros((len(given), mj.nbody))
    first = int(mj.skin_boneadr[skin])
    for bone in range(first, first + int(mj.skin_bonenum[skin])):
        carried = _entries(mj.skin_bonevertadr, mj.skin_bonevertnum, bone)
        chosen, share = mj.skin_bonevertid[carried], mj.skin_bonevertweight[carried]
        body = int(mj.skin_bonebodyid[bone])
        bind = Rotation.from_quat(mj.skin_bonebindquat[bone], scalar_first=True).as_matrix()
        local = (given[chosen] - mj.skin_bonebindpos[bone]) @ bind
        vertices[chosen] += share[:, None] * (position[body] + local @ rotation[body].T)
        weights[chosen, body] += share
    total = weights.sum(axis=1, keepdims=True)
    return ModelSkin(
        element_name(mj, mujoco.mjtObj.mjOBJ_SKIN, skin),
        vertices / total,
        mj.skin_face[_entries(mj.skin_faceadr, mj.skin_facenum, skin)].astype(np.int64),
        weights / total,
        mj.skin_rgba[skin].astype(float),
    )


def _entries(starts: Integers, counts: Integers, number: int) -> slice:
    """Entries of one element in an array of MuJoCo."""
    return slice(int(starts[number]), int(starts[number] + counts[number]))

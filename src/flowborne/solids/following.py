"""Flesh that goes where its bones go: the velocity that bones give to the flesh they carry."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.model import SolidModel

Array = NDArray[np.float64]


def follow(model: SolidModel, q: Array, change: Array) -> Array:
    """(nv,) change of velocity of bones (nv,), and of the flesh that they carry, at pose q (nq,).

    Every point of flesh takes its share of the motion of each bone (`Flesh.carried`): bones that
    are moved or stopped at once would otherwise leave it behind for a step, and tear it.
    """
    if model.flesh is None or not change.any():
        return change
    return _followed(model, kinematics(model, q), change)


def posed_flesh(model: SolidModel, q: Array) -> Array:
    """(nq,) the pose q with flesh brought from rest to where its bones are.

    Each point goes to the mean of where its bones would carry it, by its shares of them.
    """
    flesh = model.flesh
    if flesh is None:
        return q
    rest, now = kinematics(model, model.rest().q), kinematics(model, q)
    turn = now.body_rotation @ np.swapaxes(rest.body_rotation, 1, 2)
    carried = np.einsum("bij,bnj->bni", turn, flesh.rest - rest.body_position[:, None])
    carried += now.body_position[:, None]
    return model.integrate(
        np.where(flesh.places, model.rest().q, q),
        flesh.of_vertices(np.einsum("nb,bni->ni", flesh.carried, carried) - flesh.rest),
        1.0,
    )


def follow_each(model: SolidModel, q: Array) -> tuple[NDArray[np.int64], Array]:
    """The dofs (k,) of bones, and (nv, k) the velocities that go with unit velocity of each."""
    if model.flesh is None:
        return np.arange(model.nv), np.eye(model.nv)
    bones = np.flatnonzero(~model.flesh.dofs)
    pose, unit = kinematics(model, q), np.zeros((bones.size, model.nv))
    unit[np.arange(bones.size), bones] = 1.0
    return bones, np.stack([_followed(model, pose, row) for row in unit], axis=1)


def _followed(model: SolidModel, pose: Kinematics, change: Array) -> Array:
    assert model.flesh is not None
    twist = model.flesh.carried @ (pose.twist_jacobian @ change)
    moving = twist[:, :3] + np.cross(twist[:, 3:], pose.vertices)
    return np.where(model.flesh.dofs, model.flesh.of_vertices(moving), change)

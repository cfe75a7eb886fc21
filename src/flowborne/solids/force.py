"""Forces on single bodies from outside: a tow, a gust, a thruster that acts on no water."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.kernels.arrays import Array
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import cross

Frame = Literal["world", "body"]
Components = tuple[float, float, float] | Callable[[float], Array]
"""Three components, or a function of the time in s that gives them."""


@dataclass(frozen=True)
class Force:
    """A force and a torque on a body; a `Wind` (`solids.wind`) on one point.

    body    its name
    force   (3,) N (N/m in a slab)
    torque  (3,) N m about the point
    point   (3,) where the force acts, in the body's frame, m; its centre of mass when None
    frame   of force and torque: "world", or "body", with which they turn
    """

    body: str
    force: Components = (0.0, 0.0, 0.0)
    torque: Components = (0.0, 0.0, 0.0)
    point: tuple[float, float, float] | None = None
    frame: Frame = "world"

    def wrench(self, model: SolidModel, kinematics: Kinematics, v: Array, time: float) -> Array:
        """(nbody, 6) force and torque about the world origin on each body."""
        body, wrench = model.body(self.body), np.zeros((model.nbody, 6))
        turn = kinematics.body_rotation[body]
        force, torque = (
            np.asarray(given(time) if callable(given) else given, dtype=np.float64)
            for given in (self.force, self.torque)
        )
        if self.frame == "body":
            force, torque = turn @ force, turn @ torque
        at = kinematics.mass_centre[body]
        if self.point is not None:
            at = kinematics.body_position[body] + turn @ np.array(self.point)
        wrench[body] = np.concatenate([force, torque + cross(at, force)])
        return wrench


def check_force(force: Force, model: SolidModel, name: str) -> None:
    """Raise SceneError unless a force of constant components, which messages call `name`, fits the
    model."""
    where = f"the force '{name}'"
    if not isinstance(force.body, str) or force.body not in model.body_names:
        end = suggestion(str(force.body), model.body_names[1:], "The bodies are")
        raise SceneError(f"{where} is on body '{force.body}', which is not in the model{end}")
    if not isinstance(force.frame, str) or force.frame not in get_args(Frame):
        raise SceneError(f"{where} has frame {force.frame!r:.60}: give 'world' or 'body'")
    vectors = {"force": force.force, "torque": force.torque, "point": force.point}
    for key, given in vectors.items():
        if not (_is_vector(given) or (key == "point" and given is None)):
            raise SceneError(f"{where} has {key} {given!r:.60}: give 3 finite numbers")
    problems = immovable(model, force.body)
    problems += [f"it {problem}" for problem in beyond_plane(model, force.force, force.torque)]
    if problems:
        raise SceneError(f"{where}: {problems[0]}")


def immovable(model: SolidModel, body: str) -> list[str]:
    """That a body stays where it is, whatever pushes it; none for an unknown one."""
    known = model.body_names
    if body not in known or model.moving[known.index(body)]:
        return []
    return [f"body '{body}' is fixed, and no force moves it. Take one that can move."]


def beyond_plane(model: SolidModel, force: Any, torque: Any) -> list[str]:
    """What a slab has no place for in a force and a torque; components are 0 or anything else."""
    if not model.slab:
        return []
    return [
        f"has a {key} {axis} of {value}, which a scene of 2 dimensions does not have. Make it 0."
        for key, axes, vector in (("force", "z", force), ("torque", "xy", torque))
        for axis in axes
        if (value := vector["xyz".index(axis)]) != 0
    ]


def _is_vector(given: Any) -> bool:
    try:
        found = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        return False
    return found.shape == (3,) and bool(np.isfinite(found).all())

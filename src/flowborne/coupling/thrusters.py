"""Thrusters: actuator discs, which push a body and the water apart.

A thruster of thrust T along the unit vector n gives in a step

    T n dt                       to the body, at the middle of its disc
   -T n dt                       to the water of the disc

so that both together gain nothing. The water of a disc of radius R is that of the faces near it,

    phi_f = (1 - |s| / h)+  min(1, (1/2 + (R - r) / h)+)       s along n, r across
    u_f  -= T n dt / (rho sum of phi M) phi_f                  M_f the volume that moves with a face

of each component on its own: all of it is accelerated alike, and the sum is exact wherever the
disc lies in its cells. Faces within bodies have no M, and what is left has the whole thrust. With
u and v the velocities of that water and of the body there, the power of the jet is T n . (v - u).

Method: docs/method/thrusters.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flowborne.base.errors import BreakdownError
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import ControlVolumes
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.far import Strength
from flowborne.kernels.arrays import Array, Faces, Integers
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.scratch import cross


@dataclass(frozen=True)
class Thruster:
    """An actuator disc that rides on a body.

    name         for columns, commands and messages
    body         the body
    position     middle of the disc in the body's frame, m
    axis         (3,) unit vector along which the body is pushed, in its frame
    radius       m; a disc of less than half a cell is one of half a cell
    setting      over time: the thrust in N (N/m in a slab), or the speed in 1/s
    coefficient  C of T = C rho n |n| D^4 (D^3 in a slab) with the speed n and the diameter D; None
                 where the setting is the thrust
    limits       of the setting
    """

    name: str
    body: int
    position: tuple[float, float, float]
    axis: tuple[float, float, float]
    radius: float
    setting: Strength
    coefficient: float | None = None
    limits: tuple[float, float] = (-np.inf, np.inf)

    def thrust(self, setting: float, density: float, slab: bool) -> float:
        """N (N/m in a slab) of a setting, kept within its limits."""
        low, high = self.limits
        kept = min(max(setting, low), high)
        scale = self._scale(density, slab)
        return kept if scale is None else scale * kept * abs(kept)

    def setting_of(self, thrust: float, density: float, slab: bool) -> float:
        """The setting that gives a thrust, whatever the limits."""
        scale = self._scale(density, slab)
        return thrust if scale is None else float(np.copysign(np.sqrt(abs(thrust) / scale), thrust))

    def _scale(self, density: float, slab: bool) -> float | None:
        """T / (n |n|); None where the setting is the thrust."""
        if self.coefficient is None:
            return None
        return self.coefficient * density * (2.0 * self.radius) ** (3 if slab else 4)


@dataclass(frozen=True)
class Disc:
    """What a thruster does in a step.

    thrust  T, N
    centre  (3,) m
    along   (3,) n
    faces   by axis (k,) flat indices of the faces of its water
    shares  by axis (k,) part of T on each; their sum is 1
    water   part of the disc that is neither in a body nor beyond the domain
    """

    thruster: Thruster
    thrust: float
    centre: Array
    along: Array
    faces: tuple[Integers, ...]
    shares: tuple[Array, ...]
    water: float

    def power(self, velocity: Faces, pose: Kinematics, v: Array) -> float:
        """W that the water and the body get, with this velocity of the fluid (m/s), and that of the
        bodies (nv,)."""
        twist = pose.twist_jacobian[self.thruster.body] @ v
        through = self.along @ (twist[:3] + cross(twist[3:], self.centre))
        for axis, (faces, shares) in enumerate(zip(self.faces, self.shares, strict=True)):
            through -= self.along[axis] * (shares @ velocity[axis].reshape(-1)[faces])
        return float(self.thrust * through)


def discs_of(
    thrusters: tuple[Thruster, ...],
    told: Mapping[str, float],
    pose: Kinematics,
    volumes: ControlVolumes,
    sides: Boundaries,
    grid: Grid,
    density: float,
    time: float,
) -> tuple[Disc, ...]:
    """What thrusters do at `time` (s) with bodies in a pose.

    told    settings from outside by name, in place of their own
    raises  BreakdownError when there is no water at one of them
    """
    discs = []
    for thruster in thrusters:
        turn = pose.body_rotation[thruster.body]
        centre = pose.body_position[thruster.body] + turn @ np.array(thruster.position)
        setting = told.get(thruster.name)
        given = thruster.setting.at(time) if setting is None else setting
        thrust = thruster.thrust(given, density, grid.is_slab)
        along = turn @ np.array(thruster.axis)
        found = water_of(thruster.radius, centre, along, volumes, sides, grid)
        if found is None:
            raise BreakdownError(
                f"thruster '{thruster.name}' has no water in its disc at {centre.round(6).tolist()}"
                f" m, {time:g} s. Put it out of the body that it is in and inside the domain, or "
                "take a [[force]], which needs no water"
            )
        discs.append(Disc(thruster, thrust, centre, along, *found))
    return tuple(discs)


def water_of(
    radius: float,
    centre: Array,
    along: Array,
    volumes: ControlVolumes,
    sides: Boundaries,
    grid: Grid,
) -> tuple[tuple[Integers, ...], tuple[Array, ...], float] | None:
    """The faces of a disc by axis, their shares, and which part of it is water; None without any.

    Faces on the sides of the domain are not of it: what prescribes their velocity would take their
    part of the momentum.
    """
    h, radius = grid.spacing, max(radius, 0.5 * grid.spacing)
    reach, period = (radius + h) / h, np.array(grid.shape) * np.array(sides.periodic())
    offset = np.where(np.eye(3), 0.0, 0.5)[list(grid.axes)]
    middle = (centre - np.array(grid.origin)) / h - offset
    ends = np.floor(middle.min(axis=0) - reach), np.ceil(middle.max(axis=0) + reach)
    spans = [np.arange(low, high + 1.0) for low, high in zip(*ends, strict=True)]
    if grid.is_slab:
        spans[2], middle[:, 2] = np.zeros(1), 0.0
    near = np.stack(np.meshgrid(*spans, indexing="ij"), axis=-1).reshape(-1, 3)
    gap = h * (near - middle[:, None])
    height = gap @ along
    across = np.linalg.norm(gap - height[..., None] * along, axis=-1)
    parts = (1.0 - np.abs(height) / h).clip(0.0) * (0.5 + (radius - across) / h).clip(0.0, 1.0)
    high, least = np.array(grid.shape) - 1, np.where(offset == 0.0, 1, 0)
    faces, shares, whole, wet = [], [], 0.0, 0.0
    for axis, part, low in zip(grid.axes, parts, least, strict=True):
        at, part = near[part > 0.0].astype(np.int64), part[part > 0.0]
        whole += grid.cell_volume * part.sum()
        inside = ((period > 0) | ((at >= low) & (at <= high))).all(axis=1)
        at, part = np.where(period > 0, at % np.maximum(period, 1), at)[inside], part[inside]
        flat = np.ravel_multi_index(tuple(at.T), grid.face_shape(axis))
        share = part * volumes.moving[axis].reshape(-1)[flat]
        if not share.any():
            return None
        wet += share.sum()
        faces.append(flat)
        shares.append(share / share.sum())
    return tuple(faces), tuple(shares), wet / whole


def push_water(
    velocity: Faces, discs: tuple[Disc, ...], volumes: ControlVolumes, density: float, dt: float
) -> None:
    """Take the impulse of thrusters on bodies from the water of their discs, in place."""
    for disc in discs:
        for axis, (faces, shares) in enumerate(zip(disc.faces, disc.shares, strict=True)):
            moving = volumes.moving[axis].reshape(-1)[faces]
            change = np.divide(shares, moving, out=np.zeros(shares.size), where=shares > 0.0)
            scale = dt * disc.thrust * disc.along[axis] / density
            np.subtract.at(velocity[axis].reshape(-1), faces, scale * change)


def thrust_wrench(discs: tuple[Disc, ...], nbody: int) -> Array:
    """(nbody, 6) of thrusters on the bodies about the world origin, N and N m."""
    wrench = np.zeros((nbody, 6))
    for disc in discs:
        force = disc.thrust * disc.along
        wrench[disc.thruster.body] += np.concatenate([force, cross(disc.centre, force)])
    return wrench

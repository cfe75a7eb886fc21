"""Joint positions of a model from a clip, frame by frame, and the stride of its loops.

Bodies of a model may be rotated at rest. With B0 the world rotation of a joint's body at rest and L
the clip's rotation of the mapped joint relative to that of the nearest mapped ancestor, the
quaternion of a ball joint is B0^-1 L B0: the body rotates from its rest pose as the bone of the
clip rotates from its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.clip import Clip
from flowborne.motion.quaternions import about, angle, continuous, inverse, product, rotated, twist
from flowborne.solids import geoms
from flowborne.solids.model import BALL, FREE, HINGE, SLIDE, SolidModel

UP = np.array([0.0, 0.0, 1.0])

MAX_CYCLE_MISMATCH = 1e-4
"""Largest difference between the ends of a clip that counts as one whole cycle, rad or m."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Layout of a row of joint positions: quaternions, positions of free joints, then scalars.

    The scalars are angles of hinges and displacements of slides.

    names     of the joints, in the model's order
    owners    index in `names` of the joint of each quaternion, position and scalar
    balls     number of quaternions
    free      indices of the quaternions of free joints, in the order of the positions
    q         (m,) column of each entry of q of these joints, in MuJoCo's order
    v         (k,) column of each entry of v in a row of velocities: 3 per quaternion, then
              positions and scalars
    dofs      (k,) ascending
    """

    names: tuple[str, ...]
    owners: tuple[int, ...]
    balls: int
    free: Integers
    q: Integers
    v: Integers
    dofs: Integers

    def quaternions(self, rows: Array) -> Array:
        """(..., balls, 4) view of the quaternions of rows."""
        return rows[..., : 4 * self.balls].reshape(*rows.shape[:-1], self.balls, 4)

    def positions(self, rows: Array) -> Array:
        """(..., free, 3) view of the positions in rows."""
        first, count = 4 * self.balls, len(self.free)
        return rows[..., first : first + 3 * count].reshape(*rows.shape[:-1], count, 3)

    def scalars(self, rows: Array) -> Array:
        """(..., scalars) view of the scalars in rows."""
        return rows[..., 4 * self.balls + 3 * len(self.free) :]

    def moved(self, rows: Array, turn: Array, shift: Array) -> Array:
        """Rows with free joints rotated (4,) about the world origin, then shifted (..., 3)."""
        result = rows.copy()
        quaternions = self.quaternions(result)
        quaternions[..., self.free, :] = product(turn, quaternions[..., self.free, :])
        self.positions(result)[...] = rotated(turn, self.positions(rows)) + shift
        return result


def curves_of(
    model: SolidModel, clip: Clip, mapping: Mapping[str, str], joints: Sequence[str]
) -> tuple[Columns, Array]:
    """Rows of joint positions, one per frame; quaternions and angles are continuous.

    mapping  model joint -> clip joint; joints that the model lacks are ignored
    joints   model joints that follow the clip
    returns  the layout, and (frames, columns) rows
    raises   SceneError when a joint cannot follow
    """
    followed = _numbers(model, mapping, joints)
    bodies = _mapped_bodies(model, clip, mapping)
    places, rotations = clip.poses()
    rest = Rotation.from_matrix(geoms.rest_poses(model.mj)[1]).as_quat(scalar_first=True)
    quaternions, positions, angles = [], [], []
    for joint in followed:
        kind, body = int(model.mj.jnt_type[joint]), int(model.mj.jnt_bodyid[joint])
        bone = bodies[body]
        if kind == FREE:
            quaternions.append(product(rotations[:, bone], rest[body]))
            positions.append(places[:, bone])
            continue
        local = rotations[:, bone]
        above = _ancestor(model, bodies, body)
        if above is not None:
            local = product(inverse(rotations[:, above]), local)
        local = product(inverse(rest[body]), product(local, rest[body]))
        if kind == BALL:
            quaternions.append(local)
        else:
            turn = np.unwrap(twist(local, np.array(model.mj.jnt_axis[joint])))
            angles.append(turn[:, None] + model.mj.qpos0[model.mj.jnt_qposadr[joint]])
    rows = [*map(continuous, quaternions), *positions, *angles]
    return columns_of(model, followed), np.concatenate(rows, axis=1)


def row_of(columns: Columns, q: Array) -> Array:
    """(columns,) row of the joints' entries of q, in MuJoCo's order."""
    row = np.empty(len(columns.q))
    row[columns.q] = q
    return row


def _numbers(model: SolidModel, mapping: Mapping[str, str], joints: Sequence[str]) -> list[int]:
    """Numbers of the joints that follow the clip, checked."""
    for name in joints:
        if name not in model.joint_names:
            end = suggestion(name, model.joint_names, "Its joints are")
            raise SceneError(f"joint '{name}' is not in the model{end}")
        if name not in mapping:
            raise SceneError(
                f"joint '{name}' follows the clip, but is not mapped to one of its joints. "
                "Map it, or leave it out."
            )
        kind = int(model.mj.jnt_type[model.joint(name)])
        if kind not in (FREE, BALL, HINGE):
            raise SceneError(
                f"joint '{name}' is a slide, but a clip only rotates bones. Leave it out."
            )
    return sorted({model.joint(name) for name in joints})


def _mapped_bodies(model: SolidModel, clip: Clip, mapping: Mapping[str, str]) -> dict[int, int]:
    """Body -> number of the clip joint that one of its joints is mapped to."""
    bodies: dict[int, int] = {}
    names: dict[int, str] = {}
    for name, bone in mapping.items():
        if name not in model.joint_names:
            continue
        body = int(model.mj.jnt_bodyid[model.joint(name)])
        if body in names:
            raise SceneError(
                f"joints '{names[body]}' and '{name}' belong to one body. Map one of them: "
                "a ball joint takes the whole rotation."
            )
        names[body] = name
        bodies[body] = clip.names.index(bone)
    return bodies


def _ancestor(model: SolidModel, bodies: Mapping[int, int], body: int) -> int | None:
    """Number of the clip joint of the nearest mapped ancestor of a body."""
    while body > 0:
        body = int(model.mj.body_parentid[body])
        if body in bodies:
            return bodies[body]
    return None


def columns_of(model: SolidModel, joints: Sequence[int]) -> Columns:
    """Layout of the positions of joints, given by numbers in ascending order."""
    kinds = [int(model.mj.jnt_type[joint]) for joint in joints]
    turning = [n for n, kind in enumerate(kinds) if kind in (FREE, BALL)]
    free = [n for n, kind in enumerate(kinds) if kind == FREE]
    scalars = [n for n, kind in enumerate(kinds) if kind in (HINGE, SLIDE)]
    q: list[int] = []
    v: list[int] = []
    for n, kind in enumerate(kinds):
        if kind in (HINGE, SLIDE):
            after = 3 * len(free) + scalars.index(n)
            q.append(4 * len(turning) + after)
            v.append(3 * len(turning) + after)
            continue
        if kind == FREE:
            place = 3 * free.index(n) + np.arange(3)
            q += list(4 * len(turning) + place)
            v += list(3 * len(turning) + place)
        q += list(4 * turning.index(n) + np.arange(4))
        v += list(3 * turning.index(n) + np.arange(3))
    names = tuple(model.joint_names[joint] for joint in joints)
    return Columns(
        names=names,
        owners=(*turning, *free, *scalars),
        balls=len(turning),
        free=np.array([turning.index(n) for n in free], dtype=np.int64),
        q=np.array(q, dtype=np.int64),
        v=np.array(v, dtype=np.int64),
        dofs=np.concatenate([model.dofs_of(name) for name in names]),
    )


@dataclass(frozen=True)
class Stride:
    """The motion from one cycle to the next: a rotation about the vertical and a level shift.

    It leaves the height unchanged: over many cycles on level ground, a small height difference
    between the ends of the clip would lift or sink the feet.

    turn   rad
    shift  m, the horizontal vector x + iy, applied after the rotation about the world origin
    """

    turn: float = 0.0
    shift: complex = 0.0j

    def repeated(self, cycles: int) -> tuple[Array, Array]:
        """(4,) rotation and (3,) shift, m, of `cycles` strides; negative numbers go backward."""
        if abs(np.sin(self.turn / 2.0)) < 1e-12:
            total = self.shift * cycles
        else:
            ratio = np.sin(cycles * self.turn / 2.0) / np.sin(self.turn / 2.0)
            total = self.shift * np.exp(0.5j * (cycles - 1) * self.turn) * ratio
        turn = about(UP, np.array(cycles * self.turn))
        return turn, np.array([total.real, total.imag, 0.0])


def stride_between(columns: Columns, begin: Array, end: Array) -> Stride:
    """The stride that moves the first free joint of row `begin` closest to row `end`."""
    if not len(columns.free):
        return Stride()
    first = columns.free[0]
    last, initial = columns.quaternions(end)[first], columns.quaternions(begin)[first]
    turn = float(twist(product(last, inverse(initial)), UP))
    shift = columns.positions(end)[0] - rotated(
        about(UP, np.array(turn)), columns.positions(begin)[0]
    )
    return Stride(turn, complex(shift[0], shift[1]))


def mismatch(columns: Columns, begin: Array, end: Array, stride: Stride) -> tuple[float, str]:
    """Largest difference, rad or m, of row `end` from row `begin` after a stride, and its joint."""
    moved = columns.moved(begin, *stride.repeated(1))
    angles = angle(product(inverse(columns.quaternions(moved)), columns.quaternions(end)))
    distances = np.abs(columns.positions(end) - columns.positions(moved)).max(axis=-1)
    scalars = np.abs(columns.scalars(end) - columns.scalars(moved))
    differences = np.concatenate([angles, distances, scalars])
    worst = int(np.argmax(differences))
    return float(differences[worst]), columns.names[columns.owners[worst]]

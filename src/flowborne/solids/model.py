"""The articulated body: immutable, shared by all copies of a world; and its state."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path

import mujoco
import numpy as np

from flowborne.base.arguments import PATH, POSITIVE, TEXT, VECTOR, or_none, takes
from flowborne.base.one_line import one_line
from flowborne.base.phrases import suggestion
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.kernels.triangles import distances_to_mesh
from flowborne.shapes.own import PlacedShape
from flowborne.solids import displaced, geoms, mjcf
from flowborne.solids.flesh import flesh_of, points_of_flesh
from flowborne.solids.geoms import own_by_mesh
from flowborne.solids.mjcf import NOTHING, Given
from flowborne.solids.tissue.growth import Grown
from flowborne.solvers.cholesky import Ordering

FREE, BALL, SLIDE, HINGE = (
    int(mujoco.mjtJoint.mjJNT_FREE),
    int(mujoco.mjtJoint.mjJNT_BALL),
    int(mujoco.mjtJoint.mjJNT_SLIDE),
    int(mujoco.mjtJoint.mjJNT_HINGE),
)
SUFFIXES = {
    FREE: (":x", ":y", ":z", ":rx", ":ry", ":rz"),
    BALL: (":rx", ":ry", ":rz"),
    SLIDE: ("",),
    HINGE: ("",),
}
JOINT_KINDS = {HINGE: "hinge", SLIDE: "slide", BALL: "ball joint", FREE: "free joint"}


@dataclass
class SolidState:
    """Positions and velocities of the articulated bodies in generalised coordinates.

    q    (nq,) MuJoCo's qpos: m, rad, unit quaternions
    v    (nv,) MuJoCo's qvel: m/s, rad/s
    act  (na,) activations of muscles and other actuators that have some
    """

    __repr__ = one_line

    q: Array
    v: Array
    act: Array = field(default_factory=partial(np.zeros, 0))

    def copy(self) -> SolidState:
        return SolidState(self.q.copy(), self.v.copy(), self.act.copy())


class SolidModel:
    """Bodies, joints and geometries. Build with `from_file` or `from_string`; never changed after.

    Geometries here are those that displace fluid, see `displacing`; others take part in contact
    only. In a slab all quantities are per unit depth.

    mj             MuJoCo's model
    slab           whether the solids are cross-sections at z = 0
    gravity        (3,) m/s^2
    nq, nv         numbers of positions and velocities
    outputs        number of forces of actuators
    nbody, ngeom   numbers of bodies (0 is the world), without nodes of flesh, and of geometries
    flesh          the flesh of the model, or None
    body_names, joint_names, dof_names, geom_names
                   nameless elements get their kind and number; the dofs of a free joint have the
                   name of the joint with :x :y :z (world axes) :rx :ry :rz (body axes)
    actuator_names, sensor_names
                   likewise
    locked         (nv,) dofs of a slab that would leave the plane
    dof_position   (nv,) index in q of the position of a hinge or slide, -1 for other dofs
    dof_range      (nv, 2) limits of hinges and slides, rad or m; infinite without limits
    dof_body       (nv,) body that the dof moves
    dof_root       (nv,) ancestor of that body that is a child of the world
    moves          (nbody, nv) whether a dof moves a body
    conserved      (nv,) dofs along which only external forces change the momentum of the bodies
    armature       (nv,) inertia of the joints and of actuators on them, kg m^2 or kg
    body_mass      (nbody + nodes,) kg; nodes of flesh come after the bodies
    subtree_mass   (nbody + nodes,) kg, of the body and all below
    volume         (nbody,) displaced volume, m^3 (area in a slab); overlaps of geometries of a
                   body count once, see displaced.united and geoms.said_to_displace. 0 for the
                   world and for bones in flesh
    centroid       (nbody, 3) centroid of that volume in the body's frame, m
    geom_id        (ngeom,) MuJoCo's number
    geom_shape     (ngeom,) each in its own frame
    geom_size      (ngeom, 3) MuJoCo's half sizes, m
    geom_body      (ngeom,) body
    geom_offset    (ngeom, 3) centre in the body's frame, m
    geom_rotation  (ngeom, 3, 3) geometry's frame to the body's
    geom_rgba      (ngeom, 4) colour
    geom_covered   (ngeom,) whether flesh encloses it at rest, so that no fluid touches it
    orderings      elimination orders by free dofs; see `flesh_solve.ordered`
    """

    def __init__(
        self,
        mj: mujoco.MjModel,
        slab: bool,
        grown: Sequence[Grown] = (),
        shapes: Sequence[PlacedShape] = (),
    ) -> None:
        self.mj = mj
        self._own = own_by_mesh(shapes)
        self.orderings: dict[bytes, Ordering] = {}
        self.slab = slab
        self.gravity: Array = np.array(mj.opt.gravity)
        self.nq, self.nv, self.nbody = int(mj.nq), int(mj.nv), _bones(mj, grown)
        self.outputs = int(mj.actuator_outnum.sum())
        self.body_mass: Array = np.array(mj.body_mass)
        self.subtree_mass: Array = np.array(mj.body_subtreemass)
        self.body_names = _names(mj, mujoco.mjtObj.mjOBJ_BODY, self.nbody)
        self._bodies = {name: b for b, name in enumerate(self.body_names)}
        self.actuator_names = _names(mj, mujoco.mjtObj.mjOBJ_ACTUATOR, mj.nactuator)
        self._actuators = {name: a for a, name in enumerate(self.actuator_names)}
        self.sensor_names = _names(mj, mujoco.mjtObj.mjOBJ_SENSOR, mj.nsensor)
        self._rest = geoms.rest_poses(mj)
        self._set_dofs()
        self.flesh = flesh_of(self, slab, grown) if grown else None
        self._set_geoms()
        self._set_displaced()

    @classmethod
    @takes(path=PATH, gravity=VECTOR)
    def from_file(
        cls,
        path: str | Path,
        *,
        slab: bool = False,
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
        given: Given = NOTHING,
    ) -> SolidModel:
        """Model of an MJCF or URDF file.

        slab     use the cross-sections at z = 0, per unit depth
        gravity  (3,) m/s^2, replaces that of the file
        given    densities, shapes and choices in addition to the file
        raises   ValueError when the model is bad, SceneError for a wrong argument
        """
        return cls(mjcf.bones_of(Path(path), slab, gravity, given)[1], slab, shapes=given.shapes)

    @classmethod
    @takes(xml=TEXT, gravity=VECTOR, density=or_none(POSITIVE))
    def from_string(
        cls,
        xml: str,
        *,
        slab: bool = False,
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
        density: float | None = None,
        shapes: Sequence[PlacedShape] = (),
    ) -> SolidModel:
        """Model of an MJCF text; as `from_file`."""
        given = Given(density, shapes=shapes)
        return cls(mjcf.bones_of(xml, slab, gravity, given)[1], slab, shapes=shapes)

    @classmethod
    def with_flesh(
        cls,
        spec: mujoco.MjSpec,
        grown: Sequence[Grown],
        *,
        slab: bool = False,
        gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
        shapes: Sequence[PlacedShape] = (),
    ) -> SolidModel:
        """Model of bones and flesh, for `assemble_flesh`.

        grown   the results of `add_flesh` for each flesh of `spec`
        slab    flesh is made of triangles in the plane z = 0, per unit depth
        shapes  the user's geometries that `add_shapes` has added
        raises  ValueError when it is bad
        """
        corners = {g.elements.shape[1] for g in grown}
        if corners != {6 if slab else 10}:
            made = "triangles at z = 0" if slab else "tetrahedra"
            raise ValueError(f"flesh is made of {made} here. Give add_flesh such elements.")
        damping = sorted({g.tissue.damping for g in grown})
        if len(damping) > 1:
            raise ValueError(f"the fleshes have damping times of {damping} s. Give all the same.")
        return cls(mjcf.compiled_with_flesh(spec, gravity), slab, grown, shapes)

    @classmethod
    def empty(cls, gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> SolidModel:
        """Model without bodies, for a fluid alone."""
        return cls.from_string("<mujoco/>", slab=True, gravity=gravity)

    def rest(self) -> SolidState:
        """The rest pose of the model, without velocity."""
        return SolidState(np.array(self.mj.qpos0), np.zeros(self.nv), np.zeros(self.mj.na))

    def at_keyframe(self, mj: mujoco.MjModel, name: str) -> SolidState:
        """State at a keyframe of `mj`, a model that has some of these joints; others rest."""
        state, key = self.rest(), mj.key(name)
        for j, joint in enumerate(_names(mj, mujoco.mjtObj.mjOBJ_JOINT, mj.njnt)):
            indices, dofs = self.positions_of(joint), self.dofs_of(joint)
            first, speed = mj.jnt_qposadr[j], mj.jnt_dofadr[j]
            state.q[indices] = key.qpos[first : first + len(indices)]
            state.v[dofs] = key.qvel[speed : speed + len(dofs)]
        if mj.na == self.mj.na:  # flesh and floating bodies add no actuators
            state.act[:] = key.act
        return state

    def integrate(self, q: Array, velocity: Array, dt: float) -> Array:
        """(nq,) positions after moving with constant velocity (nv,) for dt s. Raises ValueError for
        other shapes."""
        try:
            moved = np.array(q, dtype=np.float64)
            mujoco.mj_integratePos(self.mj, moved, velocity, dt)
        except (TypeError, ValueError) as error:
            raise ValueError(f"give ({self.nq},) positions and ({self.nv},) velocities") from error
        return moved

    def difference(self, start: Array, end: Array) -> Array:
        """(nv,) displacement from positions `start` to `end`, both (nq,).

        It is the inverse of `integrate`: that of a ball is a rotation vector in its own frame.
        Raises ValueError for other shapes.
        """
        displacement = np.zeros(self.nv)
        try:
            mujoco.mj_differentiatePos(self.mj, displacement, 1.0, start, end)
        except TypeError as error:
            raise ValueError(f"give ({self.nq},) positions") from error
        return displacement

    @cached_property
    def moving(self) -> Mask:
        """(nbody,) whether any dof moves a body."""
        return np.asarray(self.moves.any(axis=1))

    @cached_property
    def met(self) -> Mask:
        """(nbody,) whether a body has a geometry that displaces fluid."""
        return np.isin(np.arange(self.nbody), self.geom_body)

    @cached_property
    def outboard(self) -> Mask:
        """(m, m) whether a dof (column) belongs to a descendant of the body that another dof (row)
        moves, for the dofs of bones, which are the first m."""
        on = self.dof_body[self.dof_body < self.nbody]
        return np.ascontiguousarray(self.moves[on, : len(on)].T & (on[:, None] != on))

    @cached_property
    def scalar_dofs(self) -> Integers:
        """(k,) dofs of hinges and slides, ascending."""
        return np.flatnonzero(self.dof_position >= 0)

    @cached_property
    def limited_balls(self) -> tuple[tuple[int, int, float], ...]:
        """First index in q, first dof and largest angle (rad) of each ball joint with a limit."""
        mj = self.mj
        return tuple(
            (int(mj.jnt_qposadr[j]), int(mj.jnt_dofadr[j]), float(mj.jnt_range[j, 1]))
            for j in np.flatnonzero((mj.jnt_type == BALL) & (mj.jnt_limited != 0))
        )

    def indices_of(self, dofs: Integers) -> Integers:
        """(m,) indices in q of the joints of `dofs`, ascending."""
        named = np.zeros(self.mj.njnt, bool)
        named[self._joint_of_dof[dofs]] = True
        return named[self._joint_of_index].nonzero()[0]

    def dofs_of(self, joint: str) -> Integers:
        """Dofs of a joint. Raises ValueError for an unknown name."""
        return (self._joint_of_dof == self.joint(joint)).nonzero()[0]

    def positions_of(self, joint: str) -> Integers:
        """Indices in q of a joint: 7 for a free joint, 4 for a ball, else 1."""
        return (self._joint_of_index == self.joint(joint)).nonzero()[0]

    def joint(self, name: str) -> int:
        """Number of a joint. Raises ValueError for an unknown name."""
        return _number(self._joints, name, "joint")

    def actuator(self, name: str) -> int:
        """Number of an actuator. Raises ValueError for an unknown name."""
        return _number(self._actuators, name, "actuator")

    def __repr__(self) -> str:
        return f"SolidModel(bodies={self.nbody - 1}, joints={len(self.joint_names)})"

    def body(self, name: str) -> int:
        """Number of a body. Raises ValueError for an unknown name."""
        return _number(self._bodies, name, "body")

    def rest_pose(self, geom: int) -> tuple[Array, float]:
        """A geometry at rest: (3, 3) its frame to the world's, and the height of its centre, m."""
        _, _, position, rotation = self._rest
        g = int(self.geom_id[geom])
        return rotation[g], float(position[g, 2])

    def _set_dofs(self) -> None:
        mj = self.mj
        self.joint_names = _names(mj, mujoco.mjtObj.mjOBJ_JOINT, mj.njnt)
        self._joints = {name: j for j, name in enumerate(self.joint_names)}
        widths = np.diff(mj.jnt_qposadr, append=mj.nq)
        self._joint_of_index = np.repeat(np.arange(mj.njnt), widths)
        self._joint_of_dof = np.array(mj.dof_jntid, dtype=np.int64)
        named = zip(self.joint_names, mj.jnt_type, strict=True)
        self.dof_names = tuple(name + suffix for name, kind in named for suffix in SUFFIXES[kind])
        scalar = np.isin(mj.jnt_type, (SLIDE, HINGE))
        limited = scalar & (mj.jnt_limited != 0)
        self.dof_position: Integers = np.full(self.nv, -1)
        self.dof_position[mj.jnt_dofadr[scalar]] = mj.jnt_qposadr[scalar]
        self.dof_range: Array = np.tile([-np.inf, np.inf], (self.nv, 1))
        self.dof_range[mj.jnt_dofadr[limited]] = mj.jnt_range[limited]
        self.dof_body: Integers = np.array(mj.dof_bodyid, dtype=np.int64)
        self.dof_root: Integers = mj.body_rootid[self.dof_body].astype(np.int64)
        self.moves: Mask = np.zeros((self.nbody, self.nv), bool)
        for body in range(1, self.nbody):
            self.moves[body] = self.moves[mj.body_parentid[body]] | (self.dof_body == body)
        self.armature: Array = _armature(mj)
        self.conserved = _conserved(mj)
        self.locked: Mask = np.zeros(self.nv, bool)
        if self.slab:
            self.locked = _locked(mj, self.dof_names)

    def _set_geoms(self) -> None:
        mj = self.mj
        chosen = geoms.displacing_geoms(mj)
        self.geom_id: Integers = np.array(chosen, dtype=np.int64)
        self.ngeom = len(chosen)
        names = _names(mj, mujoco.mjtObj.mjOBJ_GEOM, mj.ngeom)
        self.geom_names = tuple(names[g] for g in chosen)
        self.geom_shape = tuple(geoms.geom_shape(mj, g, self._own) for g in chosen)
        self.geom_size: Array = np.array(mj.geom_size[self.geom_id])
        self.geom_body: Integers = mj.geom_bodyid[self.geom_id].astype(np.int64)
        self.geom_offset: Array = np.array(mj.geom_pos[self.geom_id])
        rotations = [geoms.rotation_of(mj.geom_quat[g]) for g in chosen]
        self.geom_rotation: Array = np.array(rotations).reshape(-1, 3, 3)
        self.geom_rgba: Array = mj.geom_rgba[self.geom_id].astype(np.float64)
        self.geom_covered: Mask = np.zeros(self.ngeom, bool)
        if self.flesh is not None:
            _, _, position, rotation = self._rest
            for n, (shape, g) in enumerate(zip(self.geom_shape, chosen, strict=True)):
                points = position[g] + shape.landmarks() @ rotation[g].T
                outside = distances_to_mesh(points, self.flesh.rest, self.flesh.surface)
                self.geom_covered[n] = (outside < 0.0).all()

    def _set_displaced(self) -> None:
        self.volume: Array = np.zeros(self.nbody)
        self.centroid: Array = np.zeros((self.nbody, 3))
        body_position, body_rotation, position, rotation = self._rest
        for body in range(self.nbody):
            solids = [
                self._solid(int(g), position[self.geom_id[g]], rotation[self.geom_id[g]])
                for g in np.flatnonzero((self.geom_body == body) & ~self.geom_covered)
            ]
            if solids and body > 0:
                given = None if self.slab else geoms.said_to_displace(self.mj, body)
                if given is not None:
                    self.volume[body], self.centroid[body] = given
                    continue
                self.volume[body], centre = displaced.united(solids, self.slab)
                self.centroid[body] = body_rotation[body].T @ (centre - body_position[body])

    def _solid(self, geom: int, position: Array, rotation: Array) -> displaced.Solid:
        """The geometry at rest, in world axes. Raises ValueError for a bad one in a slab."""
        g, shape = int(self.geom_id[geom]), self.geom_shape[geom]
        if self.slab:
            cut = mjcf.slab_section(self.mj, g, position, rotation)
            volume, centre = cut.area, cut.centroid
        else:
            volume, centre = shape.volume, shape.centroid
        box = geoms.box_of(self.mj, g, position, rotation)
        centroid = position + rotation @ centre
        return displaced.Solid(shape, position, rotation, *box, volume, centroid)


def joint_kind(model: SolidModel, joint: str) -> int:
    """MuJoCo's number of the joint's kind."""
    return int(model.mj.jnt_type[model.joint(joint)])


def joint_unit(model: SolidModel, joint: str) -> float:
    """SI value of one unit in a scene: pi / 180 rad of a degree, or 1 m for a slide."""
    return 1.0 if joint_kind(model, joint) == SLIDE else math.pi / 180.0


def turning_dofs(model: SolidModel) -> Mask:
    """(nv,) which dofs are rotations: hinges, balls and the last three of free joints."""
    kind, first = model.mj.jnt_type[model.mj.dof_jntid], model.mj.jnt_dofadr[model.mj.dof_jntid]
    of_free = np.arange(model.nv) - first >= 3
    return np.asarray(np.where(kind == FREE, of_free, kind != SLIDE))


def _bones(mj: mujoco.MjModel, grown: Sequence[Grown]) -> int:
    """Number of bodies before the nodes of flesh. Raises ValueError when some come after."""
    flesh = np.flatnonzero(points_of_flesh(mj, grown))
    bones = int(flesh[0]) if flesh.size else int(mj.nbody)
    if flesh.size and flesh.size != mj.nbody - bones:
        later = next(b for b in range(bones, mj.nbody) if b not in flesh)
        name = geoms.element_name(mj, mujoco.mjtObj.mjOBJ_BODY, later)
        raise ValueError(f"body '{name}' comes after nodes of flesh. Put all flesh after it.")
    return bones


def _names(mj: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> tuple[str, ...]:
    return tuple(geoms.element_name(mj, kind, i) for i in range(count))


def _number(numbers: Mapping[str, int], name: str, what: str) -> int:
    if not isinstance(name, str) or name not in numbers:
        end = suggestion(str(name), numbers, "It has")
        raise ValueError(f"the model has no {what} '{name}'{end}")
    return numbers[name]


def _armature(mj: mujoco.MjModel) -> Array:
    """(nv,) inertia that turns with a joint and is not that of a body."""
    armature = np.array(mj.dof_armature)
    for actuator in np.flatnonzero(mj.actuator_armature):
        joint = int(mj.actuator_trnid[actuator, 0])
        if mj.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT:
            gear = float(mj.actuator_gear[actuator, 0])
            armature[mj.jnt_dofadr[joint]] += gear**2 * mj.actuator_armature[actuator]
    return armature


def _conserved(mj: mujoco.MjModel) -> Mask:
    """Dofs whose motion carries a whole tree rigidly along a symmetry of its kinetic energy.

    They are, on children of the world: free joints, a first ball or hinge, slides that follow only
    slides, and a ball or hinge after slides that span all directions that it rotates. Along them
    the equation of motion states that only external impulses change the momentum.
    """
    conserved = np.zeros(mj.nv, bool)
    for body in range(1, mj.nbody):
        if mj.body_weldid[mj.body_parentid[body]] != 0:
            continue
        slides: list[Array] = []
        for joint in range(mj.body_jntadr[body], mj.body_jntadr[body] + mj.body_jntnum[body]):
            kind, first = int(mj.jnt_type[joint]), int(mj.jnt_dofadr[joint])
            axis = np.array(mj.jnt_axis[joint])
            if kind == SLIDE:
                slides.append(axis)
                conserved[first] = True
                continue
            spanned = np.linalg.matrix_rank(np.array(slides), tol=1e-9) if slides else 0
            if kind == HINGE and slides:
                across = np.array(slides) - np.outer(np.array(slides) @ axis, axis)
                turned = bool(np.linalg.matrix_rank(across, tol=1e-9) == 2)
                turned &= spanned == 3 or bool(np.abs(np.array(slides) @ axis).max() < 1e-9)
            else:
                turned = not slides or spanned == 3
            conserved[first : first + len(SUFFIXES[kind])] = turned
            break
    return conserved


def _locked(mj: mujoco.MjModel, names: tuple[str, ...]) -> Mask:
    """Dofs that leave the plane z = 0. Raises ValueError when one leaves it partly.

    A hinge must be along z and a slide across z to be free. A ball or free joint rotates about the
    axes of its body, one of which must be along z.
    """
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    mujoco.mj_comPos(mj, data)
    locked = np.zeros(mj.nv, bool)
    for dof in range(mj.nv):
        kind = int(mj.jnt_type[mj.dof_jntid[dof]])
        within = dof - int(mj.jnt_dofadr[mj.dof_jntid[dof]])
        turn, slide = data.cdof[dof, :3], data.cdof[dof, 3:]
        if kind == SLIDE or (kind == FREE and within < 3):
            locked[dof] = abs(slide[2]) > 1e-9
        else:
            tilt = float(np.hypot(turn[0], turn[1]))
            locked[dof] = tilt > 1e-6
            if kind in (BALL, FREE) and 1e-6 < tilt < 1.0 - 1e-6:
                raise ValueError(
                    f"dof '{names[dof]}' turns about an axis that is neither along z nor across "
                    "it. In a slab the body of a ball or free joint has a local axis along z."
                )
    return locked

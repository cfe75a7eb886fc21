"""The bodies of a scene: their model, initial state, motions, and steps for their contacts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.control.surroundings import Surroundings
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.scenes.actuators import joints_of_actuators
from flowborne.scenes.capture import clip_motion, human_of, pose_controlled
from flowborne.scenes.draft import Draft
from flowborne.scenes.earlier import earlier_joints, earlier_motion
from flowborne.scenes.flesh import grow
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_bodies import named_holds
from flowborne.solids import mjcf
from flowborne.solids.actuators import actuator_servos
from flowborne.solids.following import follow, posed_flesh
from flowborne.solids.geoms import floors
from flowborne.solids.loops import tied_joints
from flowborne.solids.mjcf import Given, MjModel, MjSpec, compiled_quietly
from flowborne.solids.model import (
    BALL,
    FREE,
    HINGE,
    JOINT_KINDS,
    SLIDE,
    SolidModel,
    SolidState,
    joint_kind,
    joint_unit,
)
from flowborne.solids.trajectories import (
    Servo,
    ServoExact,
    ServoPD,
    Trajectory,
    TrajectoryServo,
    driven,
)

CENTIMETRES = 970.0, 990.0
"""cm/s^2, about gravity on the Earth (978 to 983)."""

MODEL = "gravity", "dimensions", "plugins", "solids", "shapes", "flesh", "human", "clip", "earlier"
"""Keys of a scene on which its model depends."""


def load_model(scene: Scene) -> SolidModel:
    """The model of a scene, its human or its file: made once for a scene as it was loaded.

    raises  SceneError when a file is missing or MuJoCo refuses it
    """
    parts = scene.folder, *(getattr(scene, key) for key in MODEL)
    if scene.kept.get("parts") != parts:
        scene.kept.update(parts=parts, model=_loaded(scene))
    model: SolidModel = scene.kept["model"]
    return model


def _loaded(scene: Scene) -> SolidModel:
    x, y, z = scene.gravity
    if scene.human is not None:
        try:
            return SolidModel.from_string(human_of(scene), gravity=(x, y, z))
        except ValueError as error:
            raise SceneError(
                f"no person of {scene.human.mass:g} kg can be made of these bones. "
                "Correct the mass."
            ) from error
    path = scene.model_path
    assert path is not None
    assert scene.solids is not None
    if not path.exists():
        raise SceneError(f"there is no model file {path}. Correct solids.model.")
    try:
        if scene.flesh:
            spec, shapes = bones_of(scene), tuple(table.build() for table in scene.shapes)
            grown = grow(spec, scene.flesh, scene.folder)
            return SolidModel.with_flesh(
                spec, grown, slab=scene.is_slab, gravity=(x, y, z), shapes=shapes
            )
        return SolidModel.from_file(
            path, slab=scene.is_slab, gravity=(x, y, z), given=given_of(scene)
        )
    except ValueError as error:
        raise SceneError(" ".join(str(error).split()).removesuffix(".") + ".") from None


def given_of(scene: Scene) -> Given:
    """Settings of a scene's model in addition to the model file."""
    solids = scene.solids
    assert solids is not None
    return Given(
        solids.density,
        solids.densities,
        tuple(table.build() for table in scene.shapes),
        solids.floating,
        solids.displace.build(),
        packages_of(scene),
        solids.mend == "hull",
    )


def bones_of(scene: Scene) -> MjSpec:
    """The model file of a scene before flesh grows on it. Raises ValueError when it is bad."""
    x, y, z = scene.gravity
    assert scene.model_path is not None
    return mjcf.bones_of(scene.model_path, scene.is_slab, (x, y, z), given_of(scene))[0]


def spec_of(scene: Scene) -> MjSpec:
    """The model file of a scene as it is. Raises ValueError when it is bad."""
    assert scene.model_path is not None
    return mjcf.read_spec(scene.model_path, packages_of(scene))


def packages_of(scene: Scene) -> list[Path]:
    """Folders that are searched for the ROS packages that the model names."""
    assert scene.solids is not None
    return [scene.folder / folder for folder in scene.solids.packages]


def trajectories_of(scene: Scene, model: SolidModel, start: Array) -> tuple[Trajectory, ...]:
    """All prescribed motions: of [[motion]] in their order, [clip], [earlier], and held joints.

    start   (nq,) pose from which a clip is entered
    raises  SceneError when the clip or the earlier run cannot be used
    """
    motions: list[Trajectory] = [table.build(model, scene.constants) for table in scene.motion]
    found = clip_motion(scene, model, start), earlier_motion(scene, model)
    motions += [motion for motion in found if motion is not None]
    return (*motions, *held(scene, model, motions, start))


def own_pose(scene: Scene, model: SolidModel) -> SolidState:
    """The model's own pose, or its keyframe that [initial] names."""
    name = scene.initial.keyframe
    return model.rest() if name is None else model.at_keyframe(keyframes(scene, model), name)


def keyframes(scene: Scene, model: SolidModel) -> MjModel:
    """A model with the file's keyframes: those of `model` do not fit the joints that flesh and
    floating bodies add."""
    if scene.model_path is None or not (scene.flesh or (scene.solids and scene.solids.floating)):
        return model.mj
    return compiled_quietly(spec_of(scene))


def posed(scene: Scene, model: SolidModel) -> SolidState:
    """The model's own pose within the ranges of its joints, and `initial`, before any motion."""
    state = own_pose(scene, model)
    dofs = model.scalar_dofs
    places = model.dof_position[dofs]
    state.q[places] = np.clip(state.q[places], *model.dof_range[dofs].T)
    for joint, values in scene.initial.positions.items():
        numbers = np.array(values)
        if joint_kind(model, joint) in (HINGE, SLIDE):
            numbers *= joint_unit(model, joint)
        else:
            numbers[-4:] /= np.linalg.norm(numbers[-4:])
        state.q[model.positions_of(joint)] = numbers
    for joint, values in scene.initial.velocities.items():
        units = np.full(len(values), joint_unit(model, joint))
        if joint_kind(model, joint) == FREE:
            units[:3] = 1.0
        state.v[model.dofs_of(joint)] = units * values
    return state


def initial_state(scene: Scene, model: SolidModel) -> SolidState:
    """State at the start: the model's own pose, [initial], and the prescribed motions."""
    state = posed(scene, model)
    motions = trajectories_of(scene, model, state.q.copy())
    pose_controlled(scene, model, state.q)
    for motion in motions:
        state.q[model.indices_of(motion.dofs)] = motion.position(0.0)
        state.v[motion.dofs] = motion.velocity(0.0)
    state.q = posed_flesh(model, state.q)
    state.v = follow(model, state.q, state.v)
    return state


def check_initial(draft: Draft, around: Surroundings) -> Iterator[str]:
    """Problems of [initial] with the model's keyframes and joints."""
    initial, model = draft.scene.initial, around.model
    if initial.keyframe is not None:
        own, where = keyframes(draft.scene, model), draft.at("initial", "keyframe")
        keys = [own.key(n).name for n in range(own.nkey)]
        if initial.keyframe not in keys:
            end = suggestion(initial.keyframe, keys, "Its keyframes are")
            yield f"{where}: the model has no '{initial.keyframe}'{end}"
            return
        if own is not model.mj and not all(own.joint(j).name for j in range(own.njnt)):
            yield (
                f"{where}: the model has nameless joints, which with flesh and floating bodies are "
                "not found in a keyframe. Name them."
            )
            return
    if initial.impulse == "none" and not any(
        joint_kind(model, joint) == FREE for joint in model.joint_names
    ):
        yield (
            f"{draft.at('initial', 'impulse')}: 'none' is for creatures that float, and the model "
            "has no free joint. Drop it."
        )
    kept = named_holds(draft.scene.solids, model)
    for joint in kept:
        floats = joint in model.joint_names and joint_kind(model, joint) == FREE
        if floats and initial.impulse == "none":
            yield (
                f"{draft.at('initial', 'impulse')}: 'none' is for creatures that float, and "
                f"[solids] holds '{joint}'. Drop one of them."
            )
        if any(initial.velocities.get(joint, ())):
            yield (
                f"{draft.at('initial', 'velocities')}: [solids] holds joint '{joint}', which has "
                "no velocity then. Drop one of them."
            )
    moved = {table.joint: "a [[motion]]" for table in draft.scene.motion}
    moved |= dict.fromkeys(earlier_joints(draft.scene), "a motion of the [earlier] run")
    for key, values in (("positions", initial.positions), ("velocities", initial.velocities)):
        for joint, numbers in values.items():
            where = draft.at("initial", key)
            unknown = draft.said(around.unknown_joints([joint]), "initial", key)
            yield from unknown
            if unknown:
                continue
            kind = joint_kind(model, joint)
            places = model.positions_of(joint) if key == "positions" else model.dofs_of(joint)
            if len(numbers) != len(places):
                yield (
                    f"{where}: joint '{joint}' is a {JOINT_KINDS[kind]} and has {len(numbers)} "
                    f"numbers. Give {len(places)}."
                )
            elif joint in moved:
                yield (
                    f"{where}: joint '{joint}' has {moved[joint]}, which says where it starts. "
                    "Drop one of them."
                )
            elif key == "positions" and kind in (BALL, FREE) and not any(numbers[-4:]):
                yield f"{where}: the quaternion of joint '{joint}' is 0. Give (1, 0, 0, 0) or so."


def gravity_in_centimetres(scene: Scene) -> float:
    """The gravity of the model file if it is the Earth's in cm/s^2, else 0."""
    if scene.model_path is None or scene.solids is None:
        return 0.0
    own = float(np.linalg.norm(spec_of(scene).option.gravity))
    return own if CENTIMETRES[0] < own < CENTIMETRES[1] else 0.0


def in_centimetres(scene: Scene) -> bool:
    """Whether a scene is in cm, g and s: with the gravity of a model that is."""
    return gravity_in_centimetres(scene) == float(np.linalg.norm(scene.gravity)) != 0.0


def with_steps(scene: Scene) -> Scene:
    """The scene with enough steps a frame for stiff contact with floors, unless it gives them.

    A contact of MuJoCo is a critically damped spring with the time constant of `solref`, and steps
    longer than half of that soften it (`refsafe`): the feet of a humanoid rest 12 mm deep with one
    step of 42 ms, and 0.8 mm with five. If `solref` is a stiffness, the file's timestep counts.
    """
    if "steps_per_frame" in scene.time.model_fields_set or scene.model_path is None:
        return scene
    steps = steps_of_contacts(scene, load_model(scene))
    if steps == scene.time.steps_per_frame:
        return scene
    time = scene.time.model_copy(update={"steps_per_frame": steps})
    return scene.model_copy(update={"time": time})


def steps_of_contacts(scene: Scene, model: SolidModel) -> int:
    """Fewest steps in a frame of the scene with which contacts with floors are stiff."""
    return max(1, math.ceil(scene.frame_time / longest_step(model) * (1.0 - 1e-9)))


def longest_step(model: SolidModel) -> float:
    """Longest step, s, in which contacts of moving bodies with floors are stiff."""
    mj = model.mj
    types, affinities = mj.geom_contype, mj.geom_conaffinity
    moving = np.flatnonzero(model.moving[mj.geom_bodyid]).tolist()
    longest = np.inf
    for floor in floors(mj):
        for geom in moving:
            collide = types[floor] & affinities[geom] or types[geom] & affinities[floor]
            if collide:
                constant = mj.geom_solref[[floor, geom], 0].min()
                longest = min(longest, 0.5 * constant if constant > 0.0 else mj.opt.timestep)
    return longest


@dataclass(frozen=True)
class TrajectoryHeld:
    """A joint that stays where it is.

    dofs   (k,)
    place  (m,) rad, m, or a unit quaternion
    """

    dofs: Integers
    place: Array

    def position(self, time: float) -> Array:
        """(m,) as `place`."""
        return self.place

    def velocity(self, time: float) -> Array:
        """(k,) zeros."""
        return np.zeros(len(self.dofs))


def driven_dofs(scene: Scene, model: SolidModel, motions: Iterable[Trajectory]) -> Mask:
    """(nv,) which dofs motions, actuators, the controller or the policy move, or a slab locks."""
    moved = model.locked.copy()
    for motion in motions:
        moved[motion.dofs] = True
    told = joints_of_actuators(model, scene.told_actuators())
    told += () if scene.policy is None else scene.policy.joints
    for joint in (*scene.controlled_joints(), *told):
        moved[model.dofs_of(joint)] = True
    return moved


def undriven(scene: Scene, model: SolidModel, motions: Iterable[Trajectory]) -> list[str]:
    """Joints between bodies without a drive and without stiffness.

    Joints on the world are left out, as creatures float or swing on them, and so are joints between
    bones of the same flesh, which stiffens them, and those that an equality ties to others.
    """
    mj, moved, limp = model.mj, driven_dofs(scene, model, motions), []
    tied = tied_joints(model)
    for j, name in enumerate(model.joint_names):
        body = int(mj.jnt_bodyid[j])
        if body >= model.nbody or mj.jnt_type[j] not in (HINGE, SLIDE, BALL):
            continue
        parent = int(mj.body_parentid[body])
        ends = {model.body_names[body], model.body_names[parent]}
        if (
            parent > 0
            and name not in tied
            and mj.jnt_stiffness[j] == 0.0
            and not moved[model.dofs_of(name)].all()
            and not any(ends <= set(flesh.bones) for flesh in scene.flesh)
        ):
            limp.append(name)
    return limp


def held_joints(model: SolidModel, motions: Iterable[Trajectory]) -> list[str]:
    """Joints that [solids] hold keeps, of all motions of a scene."""
    inner = (m.trajectory if isinstance(m, TrajectoryServo) else m for m in motions)
    first = [int(m.dofs[0]) for m in inner if isinstance(m, TrajectoryHeld)]
    return [model.joint_names[model.mj.dof_jntid[dof]] for dof in first]


def left_free(scene: Scene, model: SolidModel, motions: Iterable[Trajectory]) -> list[str]:
    """Joints on the world that nothing drives or ties: bodies float, slide or swing on them."""
    moved, tied = driven_dofs(scene, model, motions), tied_joints(model)
    return [
        name
        for j, name in enumerate(model.joint_names)
        if model.mj.body_parentid[model.mj.jnt_bodyid[j]] == 0
        and name not in tied
        and model.mj.jnt_bodyid[j] < model.nbody
        and not moved[model.dofs_of(name)].all()
    ]


def held(
    scene: Scene, model: SolidModel, motions: Iterable[Trajectory], start: Array
) -> Iterator[Trajectory]:
    """Motions of the joints that [solids] hold keeps at `start` (nq,).

    A joint's position actuator becomes its servo; without one the servo is exact.
    """
    hold = named_holds(scene.solids, model)
    if scene.solids is not None and scene.solids.hold is True:
        hold = tuple(undriven(scene, model, motions))
    servos: dict[str, Servo] = {
        a.joint: ServoPD(a.frequency, a.limit)
        for a in actuator_servos(model)
        if a.kind == "position"
    }
    for joint in hold:
        servo = servos.get(joint, ServoExact())
        place = start[model.positions_of(joint)]
        yield driven(TrajectoryHeld(model.dofs_of(joint), place), servo)

"""The bodies of a scene: their model, and the state in which they start."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.motion import Trajectory
from flowborne.errors import SceneError
from flowborne.scenes.capture import clip_motion, human_of, pose_controlled
from flowborne.scenes.earlier import earlier_motion
from flowborne.scenes.holding import held
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_solids import SolidsTable
from flowborne.solids import mjcf
from flowborne.solids.compiler import MjModel, MjSpec, compiled_quietly
from flowborne.solids.displacing import Displace
from flowborne.solids.following import follow, posed_flesh
from flowborne.solids.joint_kinds import FREE, HINGE, SLIDE, joint_kind, joint_unit
from flowborne.solids.mjcf import Given
from flowborne.solids.model import SolidModel
from flowborne.solids.state import SolidState
from flowborne.solids.tissue.growth import Grown

Array = NDArray[np.float64]


def load_model(scene: Scene) -> SolidModel:
    """The model of a scene, its human or its file: made once for a scene as it was loaded.

    raises  SceneError when a file is missing or MuJoCo refuses it
    """
    return scene.kept.get(scene, _loaded)


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
            spec, grown = fleshed(scene)
            return SolidModel.with_flesh(
                spec,
                grown,
                slab=scene.is_slab,
                gravity=(x, y, z),
                shapes=tuple(table.build() for table in scene.shapes),
            )
        return SolidModel.from_file(
            path, slab=scene.is_slab, gravity=(x, y, z), given=given_of(scene)
        )
    except ValueError as error:
        raise SceneError(_sentence(str(error))) from None


def displace_of(solids: SolidsTable) -> Displace:
    table = solids.displace
    return Displace(table.groups, table.classes, table.names, table.without)


def given_of(scene: Scene) -> Given:
    """What a scene with a model file says about its model besides."""
    solids = scene.solids
    assert solids is not None
    return Given(
        solids.density,
        solids.densities,
        tuple(table.build() for table in scene.shapes),
        solids.floating,
        displace_of(solids),
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
    """Folders in which packages of ROS are looked for that the model names."""
    assert scene.solids is not None
    return [scene.folder / folder for folder in scene.solids.packages]


def fleshed(scene: Scene) -> tuple[MjSpec, list[Grown]]:
    """The model of a scene with its flesh. Raises ValueError when it cannot be made."""
    from flowborne.scenes.flesh import grow

    spec = bones_of(scene)
    return spec, grow(spec, scene.flesh, scene.folder)


def _sentence(text: str) -> str:
    text = " ".join(text.split())
    return text if text.endswith(".") else f"{text}."


def trajectories_of(scene: Scene, model: SolidModel, start: Array) -> tuple[Trajectory, ...]:
    """All prescribed motions: those of [[motion]] in their order, then that of [clip], then that of
    [earlier], then joints that are held.

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
    """A model with the keyframes as the file has them: MuJoCo does not make room in them for the
    joints of flesh and of floating bodies."""
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
        places = model.positions_of(joint)
        kind = joint_kind(model, joint)
        if kind in (HINGE, SLIDE):
            state.q[places] = joint_unit(model, joint) * values[0]
            continue
        numbers = np.array(values)
        numbers[-4:] /= np.linalg.norm(numbers[-4:])
        state.q[places] = numbers
    for joint, values in scene.initial.velocities.items():
        units = np.full(len(values), joint_unit(model, joint))
        if joint_kind(model, joint) == FREE:
            units[:3] = 1.0
        state.v[model.dofs_of(joint)] = units * values
    return state


def initial_state(scene: Scene, model: SolidModel) -> SolidState:
    """Where the bodies start: the model's own pose, `initial`, and the prescribed motions."""
    state = posed(scene, model)
    motions = trajectories_of(scene, model, state.q.copy())
    pose_controlled(scene, model, state.q)
    for motion in motions:
        state.q[model.indices_of(motion.dofs)] = motion.position(0.0)
        state.v[motion.dofs] = motion.velocity(0.0)
    state.q = posed_flesh(model, state.q)
    state.v = follow(model, state.q, state.v)
    return state

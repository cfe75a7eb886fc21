"""From a scene to the world that it describes and the controller that moves it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

from flowborne.control.controller import Controller
from flowborne.control.executors import Mapper, Serial
from flowborne.control.objective_kinds import ObjectiveInputMotionTable
from flowborne.control.surroundings import Surroundings
from flowborne.coupling.mouths import Mouth
from flowborne.coupling.world import Setup, World
from flowborne.motion.clip_motion import TrajectoryClip, TrajectoryPart
from flowborne.scenes.bodies import initial_state, load_model, posed, trajectories_of
from flowborne.scenes.capture import capture_of, clip_motion, followers
from flowborne.scenes.control import controller_of
from flowborne.scenes.earlier import earlier_joints
from flowborne.scenes.fluid import fluid_of, with_window
from flowborne.scenes.schema import Scene
from flowborne.scenes.thrusters import thrusters_of
from flowborne.solids.model import SolidModel
from flowborne.solids.wind import Wind


def surroundings_of(
    scene: Scene, model: SolidModel, unread: frozenset[str] = frozenset()
) -> Surroundings:
    """What tables may look at; see `Surroundings`.

    unread  tables that had wrong entries, which were left out
    """
    capture = capture_of(scene)
    driven = {*scene.moved_joints(), *earlier_joints(scene)}
    driven |= set() if capture is None else set(followers(scene, capture, model))
    tables = {table.joint: table for table in scene.motion}

    @cache
    def clip() -> TrajectoryClip:
        wanted = [t for t in scene.objectives if isinstance(t, ObjectiveInputMotionTable)]
        joints = tuple(dict.fromkeys(table.joint for table in wanted if table.values is None))
        found = clip_motion(scene, model, posed(scene, model).q, joints)
        assert found is not None
        return found

    return Surroundings(
        model=model,
        source=scene.model_source,
        controlled=scene.controlled_joints(),
        driven=frozenset(driven),
        followed=tuple(tables),
        in_clip=frozenset(() if capture is None else capture.mapping),
        motion_of=lambda joint: tables[joint].build(model, scene.constants),
        clip_of=lambda joint: TrajectoryPart.of(clip(), model, model.dofs_of(joint)),
        has_wind=bool(scene.wind),
        has_fluid=scene.has_fluid,
        is_one_way=scene.fluid is not None and scene.fluid.coupling == "one-way",
        is_slab=scene.is_slab,
        unread=unread,
    )


class Built(NamedTuple):
    """World of a scene in its initial state, and its controller: None when no joint is
    controlled."""

    world: World
    controller: Controller | None


def build(scene: Scene, executor: Mapper | None = None) -> Built:
    """The world and the controller of a scene from `load_scene`.

    executor  runs the controller's trials; serial by default
    raises    SceneError when the model file cannot be read
    """
    model = load_model(scene) if scene.has_bodies else SolidModel.empty()
    motions = trajectories_of(scene, model, posed(scene, model).q)
    start = initial_state(scene, model)
    winds, controller = _acting(scene, model, executor or Serial())
    fluid = with_window(fluid_of(scene), scene, model, start.q)
    forces = tuple(table.build(scene.constants) for table in scene.force)
    thrusters = thrusters_of(scene.thruster, model, scene.constants)
    setup = Setup(model, fluid, motions, winds, forces, mouths_of(scene, model), thrusters)
    world = World.at_rest(setup)
    world.solid = start
    if world.fluid is not None and scene.fluid is not None:
        for values, component in zip(world.fluid.velocity, scene.fluid.velocity, strict=True):
            values.fill(component)
    return Built(world, controller)


def changed(scene: Scene, setup: Setup, executor: Mapper) -> tuple[Setup, Controller | None]:
    """Setup and controller of a scene whose winds, sides, objectives or strengths have changed,
    with the bodies, the motions and the grid of `setup`."""
    winds, controller = _acting(scene, setup.solid, executor)
    fluid = setup.fluid
    if fluid is not None and (other := fluid_of(scene)) is not None:
        fluid = replace(fluid, boundaries=other.boundaries)
    return setup.but(winds=winds, fluid=fluid), controller


def _acting(
    scene: Scene, model: SolidModel, executor: Mapper
) -> tuple[tuple[Wind, ...], Controller | None]:
    """The winds, and the controller where joints are controlled."""
    around = surroundings_of(scene, model)
    winds = tuple(wind for table in scene.wind if (wind := table.build(around)) is not None)
    if not scene.control:
        return winds, None
    tables = scene.control, scene.objectives, scene.controller
    return winds, controller_of(*tables, scene.frame_time, around, executor)


def mouths_of(scene: Scene, model: SolidModel) -> tuple[Mouth, ...]:
    """The mouths, in the order of the file; none without a fluid."""
    tables = enumerate(scene.mouths if scene.has_fluid else (), start=1)
    return tuple(table.build(model, number, scene.constants) for number, table in tables)

"""Gymnasium environments: a policy of one's own moves the controlled joints of a scene.

    import gymnasium
    import flowborne.play.gym

    env = gymnasium.make("flowborne/eel-v0")

The environment has the scene's joints, strengths, time and objectives, so that a learned policy
stands beside the gradient controller on the same task.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.extras import optional
from flowborne.base.phrases import listed, suggestion
from flowborne.control.commands import (
    Command,
    Control,
    Position,
    Torque,
    Velocity,
    servo_of,
    torque_limits,
)
from flowborne.control.measurement import Measurement
from flowborne.kernels.arrays import Array
from flowborne.scenes.actuators import joints_of_actuators
from flowborne.scenes.load import scene_of
from flowborne.scenes.schema import Scene
from flowborne.sim.columns import sensor_values
from flowborne.sim.frame import FrameReport
from flowborne.sim.simulation import BlowUpError, Simulation
from flowborne.solids.geoms import quaternion_of
from flowborne.solids.model import SLIDE
from flowborne.solids.motors import control_range, joint_of
from flowborne.solids.sensed import BodyState
from flowborne.solids.sensors import sensor_columns

__all__ = ["ENVIRONMENTS", "SceneEnv"]

__dir__ = __all__.copy

gymnasium = optional("gymnasium", "Gymnasium", "gym", "environments")

ENVIRONMENTS = {
    "eel": "eel-free",
    "block": "ns-block-drag-max",
    "walker": "human-wind-drag",
    "swimmer": "swimmer",
    "eel-sea": "eel-sea",
    "swimmer-sea": "swimmer-sea",
    "flyer": "flyer-air",
    "rov": "rov",
}
"""Name of an environment -> its scene."""

Kind = Literal["velocity", "position", "torque"]
Reward = Callable[[Simulation, FrameReport], float]


class SceneEnv(gymnasium.Env):  # type: ignore[name-defined]
    """A scene whose controlled joints, actuators and thrusters, or some, are told by a policy.

    An action has a number from -1 to 1 for each dof of these joints: part of its strength in the
    scene ("velocity"), a place in its range ("position"), or part of its torque limit ("torque").
    After them it has one for each control of the actuators, then one for each thruster that has a
    range: a place in its range.
    An observation has, for each of the joints and of those that the actuators drive, position
    (scalar joints), velocity and drive force, then activations and forces of the actuators,
    velocity and angular velocity of the body that carries the creature in its own axes, with such
    thrusters how far it is from where it started, in its own axes, and its orientation
    (w, x, y, z), and the model's sensors; see `observed`. It is zero before the first frame where
    only a step can tell.

    scene        a Scene, the name of a built-in one, or the path of a scene file
    joints       those that the policy tells; all controlled ones when None. The controller decides
                 for the others
    actuators    those of the model that the policy tells, by Control; when None all of the model's
                 in a scene that controls no joint and has no [[actuator]], else none
    kind         what an action means
    every        frames for which an action holds
    reward       of a frame; by default minus the scene's objectives, and in a scene of thrusters
                 without joints minus the distance in m from where the vehicle started; in the mean
                 over the frames of an action
    observe      another observation, (n,) numbers
    render_mode  "rgb_array", or None
    raises       SceneError for a wrong scene, joints without a limit that `kind` needs, without
                 anything to tell, and without objectives or a reward

    simulation  the Simulation
    observed    names of the numbers of an observation
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012, as Gymnasium has it

    def __init__(
        self,
        scene: Scene | str | Path,
        *,
        joints: tuple[str, ...] | None = None,
        actuators: tuple[str, ...] | None = None,
        kind: Kind = "velocity",
        every: int = 1,
        reward: Reward | None = None,
        observe: Callable[[Simulation], Array] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.scene = scene_of(scene)
        self.simulation = Simulation(self.scene, workers=1)
        ranged = (t for t in self.simulation.setup.thrusters if np.isfinite(t.limits).all())
        self._thrusters = {thruster.name: thruster.limits for thruster in ranged}
        self._actuators = self._told_actuators(joints, actuators)
        self._joints = self._told(joints)
        self._check_told_once()
        self._kind, self._every, self.render_mode = kind, every, render_mode
        controlled = self.simulation.controller is not None
        if reward is None and not (controlled or self._thrusters):
            raise SceneError(
                f"scene {self.scene.name} has no [[objectives]], so an environment of it has no "
                "reward. Give one: reward = a function of the simulation and the frame's report."
            )
        own = self._minus_objectives if controlled else self._minus_distance
        self._objective, self._own_observe = reward or own, observe
        self._low, self._high = self._limits()
        self._start = self.simulation.snapshot()
        self._place = self._root().centre
        self.observed = tuple(self._observed())
        rate = self.scene.time.frames_per_second / every
        self.metadata = {**self.metadata, "render_fps": rate}
        box, inf = gymnasium.spaces.Box, np.inf
        self.action_space = box(-1.0, 1.0, self._low.shape, np.float32)
        self.observation_space = box(-inf, inf, self._observation().shape, np.float32)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start again; `options` are ignored. A scene has no chance in it, so `seed` is only that
        of `np_random`."""
        super().reset(seed=seed)
        self.simulation.restore(self._start)
        return self._observation(), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Tell the joints, for `every` frames. `terminated` says that the run broke down, for the
        cause in the info; `truncated` that the scene is at its end.

        raises  ValueError for an action of another shape
        """
        if np.shape(action) != self._low.shape:
            model = self.simulation.setup.solid
            told = [model.dof_names[dof] for j in self._joints for dof in model.dofs_of(j)]
            told += [*self._actuators, *self._thrusters]
            raise ValueError(
                f"an action has the shape {self._low.shape}, a number for each of {listed(told)}, "
                f"and this one {np.shape(action)}. Give it that shape."
            )
        simulation, rewards, info = self.simulation, list[float](), dict[str, Any]()
        terminated = False
        try:
            for _ in range(self._every):
                report = simulation.advance_frame(self._commands(np.asarray(action, np.float64)))
                rewards.append(float(self._objective(simulation, report)))
                info["beyond"] = report.beyond
        except BlowUpError as error:
            terminated, info["broke_down"] = True, str(error)
        truncated = simulation.frame >= self.scene.time.frames
        reward = float(np.mean(rewards)) if rewards else 0.0
        return self._observation(), reward, terminated, truncated, info

    def render(self) -> Any:
        """(height, width, 3) uint8 picture of the state, as in the scene's film without curves;
        None without a render mode."""
        return None if self.render_mode is None else picture_of(self.simulation)

    def close(self) -> None:
        self.simulation.close()

    def _told(self, joints: tuple[str, ...] | None) -> tuple[str, ...]:
        controlled = self.scene.controlled_joints()
        found = controlled if joints is None else tuple(joints)
        others = [joint for joint in found if joint not in controlled]
        if others or not (found or self._actuators or self._thrusters):
            which = f"joint '{others[0]}'" if others else "what a policy is to move"
            raise SceneError(
                f"scene {self.scene.name}: {which} is not among the controlled ones. "
                "Name in [[control]] the joints that a policy is to move, give actuators, "
                "or give a [[thruster]] a range."
            )
        return found

    def _told_actuators(
        self, joints: tuple[str, ...] | None, named: tuple[str, ...] | None
    ) -> tuple[str, ...]:
        model = self.simulation.setup.solid
        if named is None:
            others = joints or self.scene.controlled_joints() or self.scene.actuator
            return () if others else model.actuator_names
        for name in named:
            if name not in model.actuator_names:
                end = suggestion(name, model.actuator_names, "Its actuators are")
                raise SceneError(f"scene {self.scene.name}: no actuator '{name}' in the model{end}")
        return tuple(named)

    def _check_told_once(self) -> None:
        """Raise SceneError where two numbers of an action would tell the same joint or name."""
        model, told = self.simulation.setup.solid, [*self._joints, *self._actuators]
        for name in told:
            if told.count(name) > 1:
                raise SceneError(
                    f"scene {self.scene.name}: the policy tells two of the name '{name}'. Give it "
                    "one of them, or another name in the model."
                )
        for name in self._actuators:
            if (joint := joint_of(model, model.actuator(name))) in self._joints:
                raise SceneError(
                    f"scene {self.scene.name}: actuator '{name}' drives joint '{joint}', which is "
                    "among the joints of the policy. Keep one of the two."
                )

    def _limits(self) -> tuple[Array, Array]:
        """(n,) what -1 and 1 mean."""
        setup, controller = self.simulation.setup, self.simulation.controller
        model, ends = setup.solid, list[Array]()
        for joint in self._joints:
            assert controller is not None
            dofs = model.dofs_of(joint)
            own = np.isin(controller.dofs, dofs)
            if self._kind == "velocity":
                high = controller.greatest_strength()[own]
                low = -high
            elif self._kind == "position":
                low, high = model.dof_range[dofs].T
            else:
                servo = servo_of(dofs, [(controller.dofs, controller.servo)])
                low, high = np.broadcast_arrays(*torque_limits(model, joint, servo), dofs)[:2]
            if not (np.isfinite(low).all() and np.isfinite(high).all()):
                key = "range" if self._kind == "position" else "actuatorfrcrange"
                raise SceneError(
                    f"scene {self.scene.name}: joint '{joint}' has no limit for actions of kind "
                    f"'{self._kind}'. Give it a {key} in the model, or take another kind."
                )
            ends.append(np.array([low, high]))
        for name in self._actuators:
            ends.append(np.array(control_range(model, model.actuator(name))))
            if not np.isfinite(ends[-1]).all():
                raise SceneError(
                    f"scene {self.scene.name}: actuator '{name}' has no limit for actions. Give it "
                    "a ctrlrange in the model, or name others in actuators."
                )
        ends += [np.array(limits)[:, None] for limits in self._thrusters.values()]
        both = np.concatenate(ends, axis=1)
        return both[0], both[1]

    def _commands(self, action: Array) -> dict[str, Command]:
        """Commands of an action, clipped to [-1, 1]."""
        part = 0.5 * (1.0 + np.clip(action, -1.0, 1.0))
        wanted = self._low + part * (self._high - self._low)
        commands, first = dict[str, Command](), 0
        make = {"velocity": Velocity, "position": Position, "torque": Torque}[self._kind]
        model = self.simulation.setup.solid
        for joint in self._joints:
            count = model.dofs_of(joint).size
            commands[joint] = make(wanted[first : first + count])
            first += count
        for name in self._actuators:
            count = control_range(model, model.actuator(name))[0].size
            commands[name] = Control(wanted[first : first + count])
            first += count
        commands |= zip(self._thrusters, map(Control, wanted[first:].tolist()), strict=True)
        return commands

    def _observed(self) -> dict[str, float]:
        """The numbers of an observation by their names."""
        simulation, model = self.simulation, self.simulation.setup.solid
        found: dict[str, float] = {}
        driven = joints_of_actuators(model, self._actuators)
        for joint in dict.fromkeys([*self._joints, *driven]):
            state, dofs = simulation.joint(joint), model.dofs_of(joint)
            if state.position.size == 1:
                unit = "m" if model.mj.jnt_type[model.joint(joint)] == SLIDE else "rad"
                found[f"position_{joint}_{unit}"] = state.position[0]
            for name in ("velocity", "drive"):
                names = [f"{name}_{model.dof_names[dof]}" for dof in dofs]
                found |= zip(names, getattr(state, name), strict=True)
        for name in self._actuators:
            acting = simulation.actuator(name)
            for word, values in (("activation", acting.activation), ("force", acting.force)):
                for place, value in enumerate(values):
                    found[f"{word}_{name}" + f"_{place}" * (len(values) > 1)] = value
        root = self._root()
        velocity, turn = root.velocity @ root.rotation, root.angular_velocity @ root.rotation
        found |= {f"velocity_{axis}_m/s": v for axis, v in zip("xyz", velocity, strict=True)}
        found |= {f"turn_{axis}_rad/s": v for axis, v in zip("xyz", turn, strict=True)}
        if self._thrusters:
            offset = (root.centre - self._place) @ root.rotation
            found |= {f"offset_{axis}_m": x for axis, x in zip("xyz", offset, strict=True)}
            found |= zip(("qw", "qx", "qy", "qz"), quaternion_of(root.rotation), strict=True)
        columns = sensor_columns(model)
        return found | dict(zip(columns, sensor_values(simulation.snapshot()), strict=True))

    def _root(self) -> BodyState:
        """The body that carries the creature."""
        model = self.simulation.setup.solid
        return self.simulation.body(model.body_names[int(model.moving.argmax())])

    def _observation(self) -> Array:
        if self._own_observe is not None:
            return np.asarray(self._own_observe(self.simulation), np.float32)
        return np.nan_to_num([*self._observed().values()]).astype(np.float32)

    def _minus_distance(self, simulation: Simulation, report: FrameReport) -> float:
        return -float(np.linalg.norm(self._root().centre - self._place))

    def _minus_objectives(self, simulation: Simulation, report: FrameReport) -> float:
        controller = simulation.controller
        assert controller is not None
        return -controller.objective.value(Measurement(simulation.world, report.step))


def picture_of(simulation: Simulation) -> Any:
    """(height, width, 3) uint8 picture of the state of a simulation."""
    from flowborne.runs.run_folder import RunFolder
    from flowborne.sim.running import write_state_alone
    from flowborne.view.pictures import Picture
    from flowborne.view.run import Run

    with TemporaryDirectory() as folder:
        write_state_alone(RunFolder(Path(folder) / "run"), simulation)
        run = Run(Path(folder) / "run")
        with closing(Picture(run, 1.0, run.shot.model_copy(update={"plots": False}))) as picture:
            return picture.draw(len(run) - 1)[:, :, :3].copy()


for _name, _scene in ENVIRONMENTS.items():
    gymnasium.register(
        f"flowborne/{_name}-v0", "flowborne.play.gym:SceneEnv", kwargs={"scene": _scene}
    )

"""The simulation of a scene, frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from functools import cached_property, lru_cache
from math import prod
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import ThreadpoolController

from flowborne.base.arguments import (
    COUNT,
    NOT_NEGATIVE,
    TEXT,
    VALUES,
    numbers,
    one_of,
    or_none,
    several,
    takes,
)
from flowborne.base.errors import PartError, SceneError, described
from flowborne.base.phrases import suggestion
from flowborne.control.commands import Commands, Drives, drives_of, told_by
from flowborne.coupling.report import BREAKDOWNS, StepReport
from flowborne.coupling.stream import FlowState, flow_at
from flowborne.coupling.world import Setup, World
from flowborne.kernels.arrays import Array
from flowborne.kernels.jit import LARGE, cores, kernel_threads
from flowborne.scenes.actuators import joints_of_actuators, scene_controls
from flowborne.scenes.changes import ChangeTable, plain, values_at
from flowborne.sim.columns import Columns, Outside
from flowborne.sim.frame import PARTS, FrameReport, Snapshot
from flowborne.sim.trouble import trouble
from flowborne.sim.turn import Turn
from flowborne.solids.model import FREE
from flowborne.solids.motors import activations_of, driven_by, outputs_of
from flowborne.solids.sensed import ActuatorState, BodyState, JointState
from flowborne.solids.sensors import readings
from flowborne.solids.trajectories import NOTHING_TOLD

if TYPE_CHECKING:
    from flowborne.scenes.schema import Scene
    from flowborne.solids.trajectories import JointCommand

Step = Callable[[World, float, "JointCommand | None"], StepReport]

FIELDS = 4
"""Elements per cell of a kernel's largest array: all levels of a solve, with their ghosts."""


class BlowUpError(Exception):
    """The simulation cannot go on.

    frame  the frame that could not be finished, counted from 1
    step   the step in it, counted from 1
    cause  what happened, a sentence without a full stop
    fault  whether that was an internal error
    """

    def __init__(self, frame: int, step: int, cause: str, fault: bool = False) -> None:
        super().__init__(f"frame {frame}, step {step}: {cause}")
        self.frame, self.step, self.cause, self.fault = frame, step, cause, fault

    def __reduce__(self) -> tuple[type[BlowUpError], tuple[int, int, str, bool]]:
        return BlowUpError, (self.frame, self.step, self.cause, self.fault)


class Simulation:
    """A world and its controller, advanced frame by frame.

    scene     a Scene, or the name of a built-in one, or the path of a scene file
    workers   number of trials of the controller that run at once; by default that of the trials,
              at most that of the cores. Results do not depend on it
    executor  "serial", "threads" (default), "processes", or an object with submit() or map()
    raises    SceneError if the scene or another argument is wrong, or it does not fit into memory

    scene            the Scene
    controller       the Controller, or None
    frame_time       duration of a frame, s
    step_time        duration of a step, s
    steps_per_frame  physics steps in a frame
    frames           number of frames of the scene; `advance_frame` does not stop there
    columns          of the history
    """

    @takes(workers=or_none(COUNT))
    def __init__(
        self,
        scene: Scene | str | Path,
        workers: int | None = None,
        executor: str | object | None = None,
    ) -> None:
        from flowborne.control.executors import mapper
        from flowborne.coupling.step import step
        from flowborne.scenes.build import build
        from flowborne.scenes.load import scene_of

        self._turn = Turn()
        self.scene: Scene = scene_of(scene)
        count = workers or default_workers(
            len(self.scene.controlled_joints()), self.scene.has_fluid
        )
        kind = ("serial" if count == 1 else "threads") if executor is None else executor
        with _enough_memory(self.scene):
            self._executor = mapper(kind, count)
            world, self.controller = build(self.scene, self._executor)
        self.frame_time, self.step_time = self.scene.frame_time, self.scene.step_time
        self.steps_per_frame, self.frames = self.scene.time.steps_per_frame, self.scene.time.frames
        output, model = self.scene.output, world.setup.solid
        actuators, policy = self.scene.told_actuators(), self.scene.policy
        told, pushed = ((), ()) if policy is None else (policy.joints, policy.bodies)
        told += joints_of_actuators(model, actuators)
        self.columns = Columns(
            world.setup,
            self.controller,
            self.scene.stream(),
            output.bodies,
            output.joints,
            Outside(told, actuators, pushed),
            self.scene.fluid_velocity() if output.ellipsoid_model else None,
        )
        self._controls = scene_controls(self.scene.actuator, model, self.scene.constants)
        self._changes: tuple[ChangeTable, ...] = self.scene.changes
        self._values: dict[str, Any] = {}
        self._policy = None if policy is None else policy.build()
        self._moment = Snapshot(world, 0, None)
        self._started = False
        self._step: Step = step

    def __repr__(self) -> str:
        fluid = self.setup.fluid
        return (
            f"Simulation '{self.scene.name}': frame {self.frame} of {self.frames}, t = "
            f"{self._moment.world.time:.4g} s, {'no fluid' if fluid is None else fluid.grid}"
        )

    @property
    def world(self) -> World:
        """The state after `frame` frames, a new World for each.

        raises  SceneError if the bodies and the fluid cannot be started, on the first use
        """
        return self.snapshot().world

    @property
    def setup(self) -> Setup:
        """The constant part of the world."""
        return self._moment.world.setup

    @property
    def frame(self) -> int:
        """Number of frames done."""
        return self._moment.frame

    @property
    def time(self) -> float:
        """s since the start."""
        return self.world.time

    @property
    def report(self) -> FrameReport | None:
        """Report of the last frame; None before the first, and when going on from a checkpoint."""
        return self._moment.report

    @property
    def changes(self) -> tuple[ChangeTable, ...]:
        """All changes of keys so far and to come: those of the scene, and those of `change`. In
        [[changes]] of the scene they give the same run."""
        return self._changes

    @takes(values=VALUES, over=NOT_NEGATIVE)
    def change(self, values: Mapping[str, Any], over: float = 0.0) -> None:
        """Give keys of the scene other values from now on: winds, streams, objectives, weights,
        strengths.

        values  dotted key -> value, as {"wind.0.velocity": [0.0, 5.0, 0.0]}
        over    s in which numbers go there evenly
        raises  SceneError for a key that is unknown or cannot change, or a wrong value or time
        """
        from flowborne.scenes.load import with_values

        change = ChangeTable(time=self.time, over=over, values=plain(values))
        with_values(self.scene, change.values)
        earlier = (change for change in self._changes if change.time <= self.time)
        self._changes = (*earlier, change)

    def snapshot(self) -> Snapshot:
        """The state now. A frame makes a new one, so it costs nothing to keep."""
        if not self._started:
            self._start()
        return self._moment

    @takes(
        snapshot=one_of(Snapshot, wanted="what `snapshot` gave"),
        changes=or_none(several(one_of(ChangeTable), "what `changes` gave")),
    )
    def restore(self, snapshot: Snapshot, changes: Iterable[ChangeTable] | None = None) -> None:
        """Continue from a state of the same scene, to the same bits.

        changes  all changes of keys, in place of those known now, of which later ones stay
        raises   SceneError for what is no snapshot, or one of another scene
        """
        if unlike := snapshot.unlike(self._moment):
            raise SceneError(
                f"the snapshot is of another scene than {self.scene.name}: {unlike}; give one of "
                "this scene"
            )
        if changes is not None:
            self._changes = tuple(changes)
        world = replace(snapshot.world, setup=self.setup.where(snapshot.world.setup))
        self._moment, self._started = replace(snapshot, world=world), True

    def advance_frame(self, commands: Commands | None = None) -> FrameReport:
        """Decide, then take the steps of one frame, on all cores unless a context allows fewer.

        commands  what joints are told by their names: Position, Velocity or Torque; thrusters:
                  Control; and a Force by a name of its own. The scene's motions and its controller
                  move the other joints. By default the scene's policy tells
        raises    BlowUpError if a step or the policy fails or a measure is not a finite number;
                  SceneError for a wrong command; RuntimeError while another thread advances it.
                  After any error the state is that before the frame
        """
        with self._turn:
            return self._next_frame(commands)

    def _next_frame(self, commands: Commands | None) -> FrameReport:
        self._apply_changes()
        world = self.world.for_step()
        splits = self.report is not None and self.report.step.added_mass.done
        if splits != world.setup.splits:  # asked for once, asked for again
            world.setup = world.setup.but(splits=splits)
        beyond = self._command(world, commands)
        with _one_blas_thread(), kernel_threads(_threads(world.setup)):
            report = self._advance(world, self.frame + 1, beyond)
        world.told = NOTHING_TOLD
        moment = Snapshot(world, report.frame, report)
        lost = self.columns.lost(self.columns.values(moment, split=False))
        if lost:
            raise BlowUpError(report.frame, self.steps_per_frame, f"{lost} is not a finite number")
        self._moment = moment
        return report

    @takes(points=numbers(None, 3, wanted="(n, 3) finite numbers"))
    def flow_at(self, body: str, points: Array) -> FlowState:
        """The fluid now at points (n, 3) that ride on a body, in m from the origin of its frame and
        along its axes.

        raises  SceneError for points of another shape or outside the domain; ValueError for an
                unknown name, and without a fluid
        """
        state = self.body(body)
        return flow_at(self.world, state.position + points @ state.rotation.T)

    def body(self, name: str) -> BodyState:
        """Pose and velocity of a body now and the frame's mean force, in SI units; see `BodyState`.

        raises  ValueError for an unknown name
        """
        return self.snapshot().sensed.body(name)

    def joint(self, name: str) -> JointState:
        """Position, velocity and drive force of a joint now, in SI units; see `JointState`.

        raises  ValueError for an unknown name
        """
        return self.snapshot().sensed.joint(name)

    def actuator(self, name: str) -> ActuatorState:
        """Force and activation of an actuator of the model now; see `ActuatorState`.

        raises  ValueError for an unknown name
        """
        moment = self.snapshot()
        model, number = moment.sensed.model, moment.sensed.model.actuator(name)
        return ActuatorState(
            moment.sensed.output[outputs_of(model, number)],
            moment.world.solid.act[activations_of(model, number)],
        )

    @takes(name=TEXT)
    def sensor(self, name: str) -> Array:
        """(k,) reading of a sensor of the model now, in SI units; nan before the first frame for
        what only a step gives. Raises ValueError for an unknown name."""
        known = readings(self.snapshot().sensed, self.time)
        if name not in known:
            raise ValueError(f"no sensor '{name}' in the model{suggestion(name, known, 'It has')}")
        return known[name]

    def _apply_changes(self) -> None:
        """Remake setup and controller where the coming frame has other values than the last one."""
        from flowborne.scenes.build import changed
        from flowborne.scenes.load import at, with_values

        if not (self._changes or self._values):
            return
        start = {key: at(self._raw, key) for change in self._changes for key in change.values}
        values = values_at(self._changes, start, self.time, self.frame_time)
        if values == self._values:
            return
        scene = with_values(self.scene, values, check=False)
        setup, controller = changed(scene, self.setup, self._executor)
        self._moment = replace(self._moment, world=replace(self.world, setup=setup))
        self.controller, self._values = controller, values

    @cached_property
    def _raw(self) -> dict[str, Any]:
        """The scene as its file has it."""
        from flowborne.scenes.load import raw_of

        return raw_of(self.scene)

    def _command(self, world: World, commands: Commands | None) -> tuple[str, ...]:
        """Give the world commands for the frame, by default those of the policy; what was beyond
        limits. Raises as `advance_frame`."""
        policy = self.scene.policy if commands is None else None
        try:
            if policy is not None and self._policy is not None:
                commands = self._policy(self)
            if not (commands := self._with_controls({} if commands is None else commands)):
                return ()
            world.told, beyond = told_by(commands, world, self.frame_time, self._drives())
            return beyond
        except PartError as error:
            raise BlowUpError(self.frame + 1, 1, str(error)) from error
        except SceneError as error:
            if policy is None:
                raise
            cause = f"policy '{policy.function}': {error}"
            raise BlowUpError(self.frame + 1, 1, cause) from error

    def _with_controls(self, commands: Commands) -> Commands:
        """Commands with the scene's [[actuator]]s, but for those that they tell otherwise."""
        if not isinstance(commands, Mapping):
            raise SceneError(
                f"commands is {commands!r:.60}; give a dict, as {{'hinge': Torque(1.0)}}"
            )
        model = self.setup.solid
        told = [model.dofs_of(name) for name in commands if name in model.joint_names]
        controls = {
            name: control
            for name, control in self._controls(self.time, self.frame_time).items()
            if not any(np.isin(driven_by(model, model.actuator(name)), dofs).any() for dofs in told)
        }
        return {**controls, **commands}

    def _drives(self) -> Drives:
        """Those of the scene itself."""
        controller = self.controller
        own = [] if controller is None else [(controller.dofs, controller.servo)]
        return drives_of(self.setup, own)

    def measure(self) -> dict[str, float]:
        """A row of the history for the present state: column -> value.

        Values that only a step can give are nan before the first frame.
        """
        with _one_blas_thread(), kernel_threads(_threads(self.setup)):
            return self.columns.values(self.snapshot())

    def close(self) -> None:
        """Stop the controller's workers."""
        if self.controller is not None:
            self.controller.close()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def _start(self) -> None:
        """Start bodies and fluid; controlled joints keep their velocity until a decision."""
        from flowborne.coupling.start import start
        from flowborne.solids.trajectories import JointCommand

        world, scene = self._moment.world, self.scene
        model = world.setup.solid
        free = model.mj.jnt_type[model.mj.dof_jntid] == FREE
        given = np.ones(free.size, bool) if scene.initial.impulse == "given" else ~free
        held = JointCommand.none(free.size)
        if self.controller is not None:
            dofs = np.asarray(self.controller.dofs)
            held.set(dofs, world.solid.v[dofs], world.solid.v[dofs])
        if controls := self._controls(0.0, self.frame_time):
            told, _ = told_by(controls, world, self.frame_time, self._drives())
            world.told = replace(NOTHING_TOLD, controls=told.controls)
        try:
            with _one_blas_thread(), kernel_threads(), _enough_memory(scene):
                start(world, self.step_time, given, held)
        except PartError as error:
            raise SceneError(f"scene {scene.name}: {error}") from error
        except BREAKDOWNS as error:
            raise SceneError(
                f"scene {scene.name}, [initial]: {error}. Look for bodies that are in each other "
                "or in a side of the domain, for velocities that are too large, and refine the "
                "grid where bodies close off a pocket of few cells."
            ) from error
        world.told, self._started = NOTHING_TOLD, True

    def _advance(self, world: World, frame: int, beyond: tuple[str, ...]) -> FrameReport:
        """Advance `world` by a frame, in place; `beyond` as in its report."""
        started = perf_counter()
        controller, dt = self.controller, self.step_time
        end = world.time + self.frame_time
        seconds = dict.fromkeys(PARTS, 0.0)
        nothing = np.zeros(0)
        gradient, targets, objective, decided = nothing, nothing, np.nan, False
        terms: dict[str, float] = {}
        reports = []
        splitting: tuple[Callable[[], Array], ...] = ()
        number = 1
        try:
            if controller is not None:
                decision = controller.decide(world, self.frame_time, self._step)
                gradient, decided = decision.gradient, decision.decided
                objective = decision.objective
                seconds["control"] = perf_counter() - started
            for number in range(1, self.steps_per_frame + 1):
                command = None if controller is None else controller.command(world, end, dt)
                reports.append(self._step(world, dt, command))
                splitting += world.splitting
                cause = trouble(world, reports[-1])
                if cause:
                    raise BlowUpError(frame, number, cause)
            if controller is not None:
                terms, targets = controller.measure(world, reports[-1]), controller.targets(world)
        except BREAKDOWNS as error:
            raise BlowUpError(frame, number, str(error)) from error
        except ValueError as error:
            raise BlowUpError(frame, number, described(error), fault=True) from error
        except MemoryError as error:
            cause = f"the memory is full ({error})" if str(error) else "the memory is full"
            raise BlowUpError(frame, number, cause) from error
        world.splitting = splitting
        for report in reports:
            for part, spent in report.seconds.items():
                seconds[part] = seconds.get(part, 0.0) + spent
        seconds["total"] = perf_counter() - started
        return FrameReport(
            frame=frame,
            time=world.time,
            steps=tuple(reports),
            objective=objective,
            terms=terms,
            gradient=gradient,
            targets=targets,
            decided=decided,
            seconds=seconds,
            beyond=beyond,
            controls=np.zeros(0) if world.told.controls is None else world.told.controls.values,
            values=self._values,
        )


@contextmanager
def _enough_memory(scene: Scene) -> Iterator[None]:
    """Context in which a lack of memory is a SceneError."""
    try:
        yield
    except MemoryError as error:
        raise SceneError(
            f"scene {scene.name} does not fit into the memory of this machine ({error}). "
            "Make its grid coarser: lower [domain] resolution or cells."
        ) from error


def default_workers(joints: int, fluid: bool) -> int:
    """Number of workers: that of the trials of a controller of some joints, at most that of cores.

    Without a fluid it is 1, as a trial takes less time than passing it to a thread.
    """
    return max(1, min(2 * joints, cores())) if fluid else 1


@lru_cache(maxsize=1)
def _blas() -> ThreadpoolController:
    """The loaded BLAS libraries: all of them, once a simulation has been built."""
    return ThreadpoolController()


def _threads(setup: Setup) -> int | None:
    """Most threads of a frame's kernels; None for as many as there are cores. With one, no call
    searches its arguments for arrays that are LARGE."""
    cells = 0 if setup.fluid is None else prod(setup.fluid.grid.shape)
    small = setup.solid.flesh is None and FIELDS * cells < LARGE
    return 1 if small else None


def _one_blas_thread() -> AbstractContextManager[object]:
    """Context in which BLAS uses one thread: small solves are faster, and sums reproducible."""
    limit: AbstractContextManager[object] = _blas().limit(limits=1, user_api="blas")
    return limit

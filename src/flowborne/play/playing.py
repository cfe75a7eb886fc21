"""A simulation that is played: advanced with settings, taken back to any frame, and recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from flowborne.base.progress import RunProgress
from flowborne.coupling.world import Setup
from flowborne.play.controls import Controls, Settings, Values
from flowborne.play.groups import with_choices
from flowborne.runs.checkpoint import load_checkpoint
from flowborne.runs.recorder import Recorder
from flowborne.runs.run_folder import RunFolder, RunFolderError
from flowborne.scenes.bodies import initial_state
from flowborne.scenes.capture import capture_of, clip_motion
from flowborne.scenes.changes import ChangeTable
from flowborne.scenes.save import with_frames
from flowborne.scenes.schema import Scene
from flowborne.sim.endings import RunOutcome
from flowborne.sim.frame import Snapshot
from flowborne.sim.running import run
from flowborne.sim.simulation import Simulation
from flowborne.solids.dynamics import kinematics
from flowborne.view.run import PLOTTED, State


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame that was played.

    snapshot  from which the simulation can go on
    changes   all changes of keys until then
    settings  with which it was played
    values    of the keys that the settings determine
    state     as in a state file of a run
    ghost     geom_position and geom_rotation of the input motion; None without one
    row       plotted columns of the history
    """

    snapshot: Snapshot
    changes: tuple[ChangeTable, ...]
    settings: Settings
    values: Values
    state: State
    ghost: State | None
    row: Mapping[str, float]

    @property
    def frame(self) -> int:
        return self.snapshot.frame

    @cached_property
    def bytes(self) -> int:
        """Memory that it takes."""
        kept = [*self.snapshot.world.arrays().values(), *self.state.values()]
        return sum(values.nbytes for values in kept)

    def without_cut(self) -> Moment:
        """The same without what can be made of the state again: cuts of the grid are large."""
        world = replace(self.snapshot.world, cut=None, volumes=None, splitting=())
        return replace(self, snapshot=replace(self.snapshot, world=world))


class Play:
    """A simulation that is played. All calls that advance or record must come from one thread.

    raises  SceneError as `Simulation` does

    simulation  of the scene with the objectives that can be chosen
    controls    what can be set
    """

    def __init__(self, scene: Scene, workers: int | None = None) -> None:
        chosen, groups = with_choices(scene)
        self.simulation = Simulation(chosen, workers=workers)
        model = self.simulation.setup.solid
        self.controls = Controls(chosen, groups, model)
        self._last: Moment | None = None
        self._recorder = Recorder(RunFolder(Path()))
        self._input = input_motion(chosen, self.simulation.setup)

    @cached_property
    def first(self) -> Moment:
        """The moment before the first frame.

        raises  SceneError if the bodies and the fluid cannot be started
        """
        settings = self.controls.settings()
        values = self.controls.values(settings) | {
            flow.key: list(flow.vector) for flow in self.controls.flows
        }
        return self._moment(settings, values)

    def advance(self, after: Moment, settings: Settings) -> Moment:
        """The moment one frame after another one, with these settings.

        raises  BlowUpError if the frame cannot be finished, SceneError if settings cannot be; the
                simulation is then at `after`
        """
        simulation = self.simulation
        if after is not self._last:
            simulation.restore(after.snapshot, after.changes)
            self._last = after
        values = self._change(after, settings)
        simulation.advance_frame()
        self._last = self._moment(settings, values)
        return self._last

    def record(
        self, until: Moment, folder: Path, progress: Callable[[RunProgress], None] | None = None
    ) -> str:
        """Write what was played until a moment to a run folder; a sentence about it.

        The scene with all changes is run anew, and its last state compared with the one played.

        raises  RunFolderError if the folder cannot be written, or nothing was played
        """
        if until.frame == 0:
            raise RunFolderError("nothing has been played yet; run some frames, then save")
        scene = self.simulation.scene.model_copy(update={"changes": until.changes})
        result = run(with_frames(scene, until.frame), folder, film=False, progress=progress)
        if result.outcome not in (RunOutcome.DONE, RunOutcome.DOUBTFUL):
            raise RunFolderError(result.message)
        if not self._repeats(until, folder):
            raise RunFolderError(
                f"{folder} has the frames, but not the bits that were played; play the scene again"
            )
        return f"{result.message}; they repeat what was played, bit for bit"

    def close(self) -> None:
        """Stop the simulation's workers."""
        self.simulation.close()

    def _change(self, after: Moment, settings: Settings) -> Values:
        """Change the keys whose values differ from those of a moment; their values now."""
        time, simulation = self.simulation.time, self.simulation
        values = self.controls.values(settings)
        due: dict[float, Values] = {}
        for key, value in values.items():
            if value != after.values.get(key):
                due.setdefault(0.0, {})[key] = value
        for flow in self.controls.flows:
            values[flow.key], over = flow.next(settings, time)
            if values[flow.key] != after.values[flow.key]:
                due.setdefault(over, {})[flow.key] = values[flow.key]
        for over, changed in due.items():
            simulation.change(changed, over=over)
        return values

    def _moment(self, settings: Settings, values: Values) -> Moment:
        simulation = self.simulation
        report = simulation.report
        row = simulation.measure()
        return Moment(
            simulation.snapshot(),
            simulation.changes,
            dict(settings),
            values,
            self._recorder.arrays(simulation.world, None if report is None else report.drag()),
            None if self._input is None else self._input(simulation.time),
            {c: row[c] for c in row if c in ("frame", "time_s") or c.startswith(PLOTTED)},
        )

    def _repeats(self, until: Moment, folder: Path) -> bool:
        """Whether the last state in a run folder is that of a moment, bit for bit."""
        simulation = self.simulation
        controller, setup = simulation.controller, simulation.setup
        memory = None if controller is None else controller.memory_shapes(setup.solid.nq)
        world, frame, _ = load_checkpoint(RunFolder(folder).checkpoint, setup, memory)
        ours, theirs = until.snapshot.world.arrays(), world.arrays()
        return (
            frame == until.frame
            and ours.keys() == theirs.keys()
            and all(np.array_equal(ours[n], theirs[n], equal_nan=True) for n in ours)
        )


def input_motion(scene: Scene, setup: Setup) -> Callable[[float], State] | None:
    """Function of a time (s) that gives geom_position (ng, 3) m and geom_rotation (ng, 3, 3) in the
    motion that a scene is given; None if it has none.

    The joints that follow a motion do so, and the controlled ones follow their clip. Others stay
    where they start.
    """
    model = setup.solid
    if not setup.motions or not scene.controlled_joints():
        return None
    start, motions = initial_state(scene, model).q, list(setup.motions)
    capture = capture_of(scene)
    if capture is not None:
        own = set(scene.controlled_joints()) & set(capture.mapping)
        joints = tuple(joint for joint in model.joint_names if joint in own)
        whole = clip_motion(scene, model, start, joints)
        motions += [] if whole is None else [whole]

    def poses(time: float) -> State:
        q = start.copy()
        for motion in motions:
            q[model.indices_of(motion.dofs)] = motion.position(time)
        found = kinematics(model, q)
        return {
            "geom_position": found.geom_position.astype(np.float32),
            "geom_rotation": found.geom_rotation.astype(np.float32),
        }

    return poses

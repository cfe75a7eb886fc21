"""A run from its scene to its folder: begin or resume, record, stop cleanly."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from enum import Enum
from math import prod
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from flowborne.base.arguments import COUNT, PATH, PROGRESS, or_none, takes
from flowborne.base.errors import PartError, SceneError, WorkerError
from flowborne.base.extras import missing_to_draw
from flowborne.base.progress import Progress, RunProgress, Stage, displayed
from flowborne.kernels.jit import compilation_watched
from flowborne.runs.checkpoint import load_checkpoint, save_checkpoint, state_bytes
from flowborne.runs.history import History
from flowborne.runs.recorder import Recorder, write_model
from flowborne.runs.run_folder import RunFolder, RunFolderError, cannot_write, check_space
from flowborne.runs.states import check_states
from flowborne.runs.strained import strained
from flowborne.runs.summary import doubts_of, peak_memory, summarise, versions
from flowborne.scenes.bodies import driven_dofs
from flowborne.scenes.control import objective_unit
from flowborne.scenes.creature import creature_of
from flowborne.scenes.earlier import earlier_joints
from flowborne.scenes.notes import notes_of
from flowborne.scenes.save import scene_to_resume, with_frames, write_scene
from flowborne.scenes.seen import seen_bodies
from flowborne.scenes.warn import accepted_of, warnings_of
from flowborne.sim.frame import PARTS, FrameReport, Snapshot
from flowborne.sim.simulation import BlowUpError, Simulation
from flowborne.view.embedded import run_html
from flowborne.view.open_run import OpenRun

if TYPE_CHECKING:
    from flowborne.scenes.schema import Scene

log = logging.getLogger("flowborne")

FILM_BYTES = 20_000_000
"""Disc space reserved for the picture, the film and the history."""


class RunOutcome(Enum):
    """How a run ended, as a sentence."""

    DONE = "the run is complete"
    DOUBTFUL = "the run is complete, and its numbers are in doubt"
    BLEW_UP = "the simulation blew up"
    NOT_WRITTEN = "the run could not be written any further"
    INTERRUPTED = "the run was interrupted"


COMPLETE = (RunOutcome.DONE.name.lower(), RunOutcome.DOUBTFUL.name.lower())
"""Outcomes of runs with all frames, as in their summaries."""


@dataclass(frozen=True)
class RunResult:
    """Result of a run.

    folder   of the run
    outcome  how it ended
    message  for the user
    frames   frames done, including those of earlier runs in the same folder
    summary  content of summary.json
    """

    folder: Path
    outcome: RunOutcome
    message: str
    frames: int
    summary: dict[str, Any]

    def __repr__(self) -> str:
        return f"RunResult in {self.folder}: {self.outcome.value}, {self.frames} frames"

    def _repr_html_(self) -> str:
        return run_html(repr(self), self.folder)

    def open(self) -> OpenRun:
        """The run, to read, plot and view it."""
        return OpenRun(self.folder)


class RunInterrupted(KeyboardInterrupt):
    """The run was interrupted; everything up to its last whole frame is saved.

    result  of the run so far
    """

    def __init__(self, result: RunResult) -> None:
        super().__init__(result.message)
        self.result = result


@takes(out=PATH, frames=or_none(COUNT), workers=or_none(COUNT), progress=or_none(PROGRESS))
def run(
    scene: Scene | str | Path,
    out: str | Path,
    *,
    frames: int | None = None,
    workers: int | None = None,
    resume: bool = False,
    replace: bool = False,
    film: bool = True,
    progress: Progress | bool | None = None,
) -> RunResult:
    """Run a scene and write the files listed in `flowborne.runs.run_folder`.

    scene     a Scene, or the name of a built-in one, or the path of a scene file
    out       folder to write
    frames    number of frames; the scene's by default
    workers   trials of the controller at once; changes no number
    resume    continue the run in `out` from its checkpoint
    replace   replace an earlier run in `out`
    film      draw preview.png and preview.mp4 at the end
    progress  called with the progress of the run; True shows it as the command line does
    returns   the result, also of a run that blew up or filled the disc: see its outcome
    raises    RunFolderError if `out` cannot be used or another run is being written there,
              SceneError if the scene or an argument is wrong, or it does not fit into memory;
              nothing is then written. RunInterrupted (a KeyboardInterrupt) after Ctrl-C or SIGTERM,
              when everything has been saved; KeyboardInterrupt if there was nothing to save yet
    """
    from flowborne.scenes.load import scene_of
    from flowborne.scenes.save import scene_files

    if resume and replace:
        raise RunFolderError("resume=True and replace=True exclude each other; give one of them")
    wanted = scene_of(scene)
    folder = RunFolder.existing(Path(out)) if resume else RunFolder(Path(out))
    if resume:
        folder.check_writable()
        wanted = scene_to_resume(folder, wanted)
    else:
        folder.check_new(replace=replace)
    wanted = with_frames(wanted, frames)
    with folder.locked(), _Signals() as signals, ExitStack() as open_until_the_end:
        show = open_until_the_end.enter_context(displayed(progress))
        try:
            with signals.interruptible():
                files = scene_files(wanted)
                simulation = open_until_the_end.enter_context(Simulation(wanted, workers=workers))
                job = _Run(simulation, folder, files, signals, show)
                if wanted.has_fluid:
                    open_until_the_end.enter_context(
                        compilation_watched(lambda kernels: job.show("compiling", kernels=kernels))
                    )
                if not resume:
                    _ = simulation.world  # starts bodies and fluid, which may take long
        except KeyboardInterrupt as stop:
            raise KeyboardInterrupt("stopped before anything was written") from stop
        if resume:
            job.resume()
        else:
            job.begin(replace=replace)
        return job.finish(*job.go_on(), film=film)


class _Run:
    """A simulation being written into a folder."""

    def __init__(
        self,
        simulation: Simulation,
        folder: RunFolder,
        files: dict[str, bytes],
        signals: _Signals,
        progress: Progress | None,
    ) -> None:
        self.simulation = simulation
        self.folder = folder
        self.files = files
        self.frames = simulation.frames
        self.taken = earlier_joints(simulation.scene)  # the run may take the earlier one's place
        self.warnings = warnings_of(simulation.scene, simulation.setup)
        scene, model = simulation.scene, simulation.setup.solid
        self.unit = objective_unit(scene.objectives, scene.controlled_joints(), model)
        self.columns = (*simulation.columns.names, *(f"seconds_{p}" for p in ("total", *PARTS)))
        self.recorder = Recorder(folder)
        self.history: History | None = None
        self._signals = signals
        self._progress = progress
        self._started = perf_counter()

    def begin(self, *, replace: bool) -> None:
        """Prepare the folder for a new run. Raises RunFolderError; nothing is then written."""
        self._check_space(freed=self.folder.bytes_used() if replace else 0)
        RunFolder.create(self.folder.path, replace=replace)
        try:
            write_scene(self.folder, self.files)
            self._write_start()
        except SceneError:
            self.folder.remove()
            raise
        except OSError as error:
            self.folder.remove()
            raise cannot_write(self.folder.path, error) from error

    def resume(self) -> None:
        """Restore the checkpoint, and drop everything written after it."""
        folder, simulation = self.folder, self.simulation
        try:
            if folder.checkpoint.exists():
                controller, setup = simulation.controller, simulation.setup
                memory = None if controller is None else controller.memory_shapes(setup.solid.nq)
                world, frame, kept = load_checkpoint(folder.checkpoint, setup, memory)
                simulation.restore(Snapshot(world, frame, None, kept))
            if simulation.frame > self.frames:
                raise RunFolderError(
                    f"{folder.path} has {simulation.frame} frames already; ask for more of them, "
                    "or start again with replace=True"
                )
            self._check_space(freed=0)
            check_states(folder, simulation.frame)
            write_scene(folder, self.files)
            if simulation.frame == 0:
                self._write_start()
                return
            self.history = History.reopen(folder.history, self.columns, simulation.frame)
            folder.drop_states_after(simulation.frame)
        except (OSError, ValueError) as error:
            raise RunFolderError(
                f"{folder.path} cannot be resumed: {error}; start again with replace=True"
            ) from error

    def go_on(self) -> tuple[RunOutcome, str]:
        """Advance and record to the last frame, or until the run stops; outcome and message."""
        simulation, signals = self.simulation, self._signals
        self.show("start")
        while simulation.frame < self.frames and not signals.asked:
            try:
                with signals.interruptible():
                    report = simulation.advance_frame()
            except KeyboardInterrupt:
                if simulation.report is None or simulation.frame == self._rows():
                    break
                report = simulation.report
            except BlowUpError as error:
                return RunOutcome.BLEW_UP, self._blown_up(error)
            try:
                values = self._record(report)
            except OSError as error:
                return RunOutcome.NOT_WRITTEN, self._not_written(error)
            joints = tuple((c, values[c]) for c in simulation.columns.controlled)
            self.show("frame", objective=report.objective, unit=self.unit, joints=joints)
        try:
            self._save()
        except OSError as error:
            return RunOutcome.NOT_WRITTEN, self._not_written(error)
        if simulation.frame < self.frames:
            return RunOutcome.INTERRUPTED, f"stopped after frame {simulation.frame}; {self._how()}"
        message, doubts = f"{simulation.frame} frames are in {self.folder.path}", self._doubts()
        if not doubts:
            return RunOutcome.DONE, message
        return RunOutcome.DOUBTFUL, f"{message}, but not to be trusted: {'. '.join(doubts)}"

    def finish(self, outcome: RunOutcome, message: str, *, film: bool) -> RunResult:
        """Write exports, summary and film; the result. Raises RunInterrupted after a signal."""
        assert self.history is not None
        self.history.close()
        folder = self.folder
        exported: list[str] = []
        whole = outcome in (RunOutcome.DONE, RunOutcome.DOUBTFUL)
        if whole:
            exported, failed = self._export()
            message += failed
        summary = self._summary(outcome, message)
        summary["model_files"] += exported
        try:
            folder.write_summary(summary)
            if film and (whole or outcome is RunOutcome.BLEW_UP):
                message += self._draw()
        except OSError as error:
            if whole:
                outcome, message = RunOutcome.NOT_WRITTEN, self._not_written(error)
        result = RunResult(folder.path, outcome, message, self.simulation.frame, summary)
        if outcome is RunOutcome.INTERRUPTED or self._signals.asked:
            raise RunInterrupted(result)
        return result

    def _draw(self) -> str:
        """Draw the picture and the film; an addition to the message if that fails."""
        missing = missing_to_draw()
        if missing is not None:
            return f"; no film: {missing}"
        from flowborne.view.film import make_preview

        try:
            with self._signals.interruptible():
                make_preview(
                    self.folder.path,
                    lambda drawn, frames: self.show("film", frame=drawn, frames=frames),
                )
        except (RunFolderError, ValueError) as error:
            return f"; no film: {error}"
        except KeyboardInterrupt:
            return f"; stopped while drawing; draw with: flowborne film {self.folder.path}"
        return ""

    def _export(self) -> tuple[list[str], str]:
        """Write the exports of the scene; their names, and an addition to the message about those
        that failed."""
        from flowborne.formats.exporting import export

        exported: list[str] = []
        failed = ""
        for table in self.simulation.scene.output.exports:
            try:
                out = self.folder.path / table.file
                with self._signals.interruptible():
                    written = export(self.folder.path, out, table.parameters)
                exported += (str(file.relative_to(self.folder.path)) for file in written.files)
            except (OSError, PartError, RunFolderError, SceneError) as error:
                failed += f"; no {table.file}: {error}"
            except KeyboardInterrupt:
                how = f"flowborne export {self.folder.path} --out {out}"
                failed += f"; stopped before {table.file} was written; write it with: {how}"
        return exported, failed

    def _write_start(self) -> None:
        """Write all files of frame 0, the checkpoint last."""
        simulation, folder = self.simulation, self.folder
        _write_model_of(folder, simulation, self.taken)
        folder.drop_states_after(-1)
        self.history = History.create(folder.history, self.columns)
        self.recorder.write(0, simulation.world, None)
        self._save()

    def _record(self, report: FrameReport) -> dict[str, float]:
        """Write a frame: its row, its state, and a checkpoint when one is due."""
        assert self.history is not None
        simulation = self.simulation
        values = simulation.measure()
        seconds = {f"seconds_{part}": spent for part, spent in report.seconds.items()}
        length = self.history.length
        self.history.append(values | seconds)
        try:
            self.recorder.write(report.frame, simulation.world, report.drag())
        except BaseException:
            self.history.drop_last(length)
            raise
        if report.frame % simulation.scene.output.checkpoint_every == 0:
            self._save()
        return values

    def _save(self) -> None:
        """Write the checkpoint, once the rows and states before it are on the disc."""
        assert self.history is not None
        self.history.sync()
        self.recorder.sync()
        now = self.simulation.snapshot()
        save_checkpoint(self.folder.checkpoint, now.world, now.frame, now.sensed)

    def _check_space(self, freed: int) -> None:
        """Raise RunFolderError if the remaining frames do not fit on the disc."""
        simulation = self.simulation
        states = (self.frames - simulation.frame) * self.recorder.bytes_per_frame(simulation.world)
        needed = states + 2 * state_bytes(simulation.world) + FILM_BYTES
        check_space(self.folder.path, needed - freed)

    def _summary(self, outcome: RunOutcome, message: str) -> dict[str, Any]:
        simulation = self.simulation
        world, scene = simulation.world, simulation.scene
        strength = simulation.columns.strength_steps(simulation.frame_time)
        every = scene.controller.every if scene.can_settle else None
        creature = creature_of(scene, world.setup)
        cells = None if world.setup.fluid is None else prod(world.setup.fluid.grid.shape)
        return {
            "scene": scene.name,
            "outcome": outcome.name.lower(),
            "message": message,
            "doubts": self._doubts(),
            **summarise(self.folder.history, strength, every),
            "objective_unit": self.unit,
            "cells": cells,
            "creature": None if creature is None else asdict(creature),
            "warnings": self.warnings,
            "notes": [*notes_of(scene, world.setup.solid), *accepted_of(scene, world.setup)],
            "bodies_as_seen": [asdict(seen) for seen in seen_bodies(world.setup)],
            "state_bytes": state_bytes(world),
            "bytes_per_cell": None if cells is None else state_bytes(world) / cells,
            "peak_memory_bytes": peak_memory(),
            "versions": versions(),
            "model_files": self.folder.model_files(),
        }

    def _blown_up(self, error: BlowUpError) -> str:
        """Save the last good frame; returns the message."""
        kept = f"everything up to frame {self.simulation.frame} is kept"
        try:
            self._save()
        except OSError as full:
            kept += f", but its checkpoint could not be written ({full.strerror})"
        log.debug("the blow-up", exc_info=error)
        if isinstance(error.__cause__, PartError | WorkerError):
            return f"the run stopped in {error}; {kept}; then {self._how()}"
        if error.fault:
            return (
                f"the run stopped in {error}; {kept}; try more steps per frame. If that does not "
                "help, it is a fault of flowborne: flowborne --debug run shows where"
            )
        return f"the simulation blew up in {error}; {kept}; {self._remedy()}"

    def _remedy(self) -> str:
        """What may keep the run from blowing up."""
        world, report = self.simulation.world, self.simulation.report
        fluid = world.setup.fluid
        if fluid is None or report is None or not any(step.contacts for step in report.steps):
            return "try more steps per frame"
        return (
            "bodies touched in the fluid, which squeezes it out between them: give their geoms a "
            f"contact margin of a cell, margin = {fluid.grid.spacing:.2g} m in the model, or try "
            "more steps per frame"
        )

    def _not_written(self, error: OSError) -> str:
        return (
            f"writing into {self.folder.path} failed after frame {self._rows()} "
            f"({error.strerror or error}); what was written before is kept; make room, then "
            f"{self._how()}"
        )

    def _doubts(self) -> list[str]:
        """Reasons not to trust the frames so far, including those of earlier runs in the folder."""
        simulation = self.simulation
        setup, scene = simulation.setup, simulation.scene
        model, dt = setup.solid, simulation.frame_time / simulation.steps_per_frame
        bodies = [model.body_names[body] for body in np.flatnonzero(model.met & model.moving)]
        found = doubts_of(self.folder.history, bodies, setup.fluid)
        driven = driven_dofs(scene, model, setup.motions)
        return [*found, *strained(self.folder.state_files(), model, driven, dt)]

    def _rows(self) -> int:
        """Number of frames in the history."""
        return 0 if self.history is None else self.history.rows

    def _how(self) -> str:
        """How to continue the run."""
        path = self.folder.path
        return f"continue with: flowborne run {self.folder.scene} --out {path} --resume"

    def show(self, stage: Stage, **news: Any) -> None:
        """Report progress; by default of the simulation's frame."""
        if self._progress is None:
            return
        news = {"frame": self.simulation.frame, "frames": self.frames, **news}
        seconds, warnings = perf_counter() - self._started, len(self.warnings)
        self._progress(RunProgress(stage=stage, seconds=seconds, warnings=warnings, **news))


class _Signals:
    """Ctrl-C and SIGTERM during a run: recorded, and raised only where that is safe.

    asked  whether one has arrived
    """

    def __init__(self) -> None:
        self.asked = False
        self._safe = False
        self._earlier: dict[signal.Signals, Any] = {}

    def __enter__(self) -> _Signals:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._earlier[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *raised: object) -> None:
        for number, handler in self._earlier.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: object) -> None:
        self.asked = True
        if self._safe:
            self._safe = False
            raise KeyboardInterrupt

    @contextmanager
    def interruptible(self) -> Iterator[None]:
        """Context that a signal ends by KeyboardInterrupt, also one that arrived before."""
        if self.asked:
            raise KeyboardInterrupt
        self._safe = True
        try:
            yield
        except Exception as error:
            # an interrupt becomes a SystemError while a kernel returns its result, and a
            # TypingError while Numba compiles it
            if not self.asked:
                raise
            raise KeyboardInterrupt from error
        finally:
            self._safe = False


def write_state_alone(folder: RunFolder, simulation: Simulation) -> None:
    """A run folder of the present state of a simulation, to be drawn."""
    from flowborne.scenes.save import scene_files

    RunFolder.create(folder.path)
    write_scene(folder, scene_files(simulation.scene))
    _write_model_of(folder, simulation)
    History.create(folder.history, simulation.columns.names).close()
    report = simulation.report
    force = None if report is None else report.drag()
    Recorder(folder).write(simulation.frame, simulation.world, force)


def _write_model_of(folder: RunFolder, simulation: Simulation, taken: tuple[str, ...] = ()) -> None:
    write_model(
        folder,
        simulation.setup,
        controlled=list(simulation.scene.controlled_joints()),
        frames_per_second=1.0 / simulation.frame_time,
        wind=[list(stream)] if (stream := simulation.scene.stream()) else [],
        taken=taken,
    )

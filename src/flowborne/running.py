"""A run from its scene to its folder: begin or go on, record, stop well."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import asdict, dataclass
from enum import Enum
from math import nan, prod
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from flowborne.coupling.seen import seen_bodies
from flowborne.errors import PartError, SceneError, WorkerError
from flowborne.extras import missing_to_draw
from flowborne.kernels.compilation import compilation_watched
from flowborne.progress import RunProgress, Stage
from flowborne.runs.checkpoint import load_checkpoint, save_checkpoint, state_bytes
from flowborne.runs.frame_report import PARTS, FrameReport
from flowborne.runs.history import History
from flowborne.runs.recorder import Recorder, write_model
from flowborne.runs.run_folder import RunFolder, RunFolderError, cannot_write, check_space
from flowborne.runs.states import check_states
from flowborne.runs.summary import doubts_of, peak_memory, summarise, versions
from flowborne.scenes.creature import creature_of
from flowborne.scenes.earlier import earlier_joints
from flowborne.scenes.notes import notes_of
from flowborne.scenes.scene_copy import scene_to_resume, with_frames, write_scene
from flowborne.scenes.warn import warnings_of
from flowborne.simulation import BlowUpError, Simulation

if TYPE_CHECKING:
    from flowborne.scenes.schema import Scene

log = logging.getLogger("flowborne")

FILM_BYTES = 20_000_000
"""Room that is kept for the picture, the film and the history."""


class RunOutcome(Enum):
    """How a run ended, as a sentence."""

    DONE = "the run is complete"
    DOUBTFUL = "the run is complete, and its numbers are in doubt"
    BLEW_UP = "the simulation blew up"
    NOT_WRITTEN = "the run could not be written any further"
    INTERRUPTED = "the run was interrupted"


@dataclass(frozen=True)
class RunResult:
    """What came of a run.

    folder   where it is
    outcome  how it ended
    message  what to tell a person about it
    frames   frames done, those of earlier runs in the same folder included
    summary  what summary.json says
    """

    folder: Path
    outcome: RunOutcome
    message: str
    frames: int
    summary: dict[str, Any]


class RunInterrupted(KeyboardInterrupt):
    """The run was asked to stop; everything up to its last whole frame is saved.

    result  what there is of the run
    """

    def __init__(self, result: RunResult) -> None:
        super().__init__(result.message)
        self.result = result


def run(
    scene: Scene | str | Path,
    out: str | Path,
    *,
    frames: int | None = None,
    workers: int | None = None,
    resume: bool = False,
    replace: bool = False,
    film: bool = True,
    progress: Callable[[RunProgress], None] | None = None,
) -> RunResult:
    """Run a scene and leave behind what is listed in `flowborne.runs.run_folder`.

    scene     a Scene, or the name of a built-in one, or the path of a scene file
    out       folder to write
    frames    how many; by default what the scene says
    workers   trials of the controller at once; changes no number
    resume    go on with the run in `out` from its checkpoint
    replace   take the place of an earlier run in `out`
    film      draw preview.png and preview.mp4 at the end
    progress  called with news of the run
    returns   the result; a run that blew up or filled the disc returns, too: see its outcome
    raises    RunFolderError when `out` or the arguments are wrong or another run is being written
              there, SceneError when the scene is wrong or does not fit into memory; nothing is then
              written. RunInterrupted (a KeyboardInterrupt) after Ctrl-C or SIGTERM, when everything
              has been saved; KeyboardInterrupt when there was nothing to save yet
    """
    from flowborne.scenes.load import load_scene
    from flowborne.scenes.save import scene_files

    if resume and replace:
        raise RunFolderError("--resume and --replace exclude each other; give one of them")
    for name, count in (("frames", frames), ("workers", workers)):
        if count is not None and count < 1:
            raise RunFolderError(f"{name} is {count}; give 1 or more")
    wanted = load_scene(scene) if isinstance(scene, str | Path) else scene
    folder = RunFolder.existing(Path(out)) if resume else RunFolder(Path(out))
    if resume:
        folder.check_writable()
        wanted = scene_to_resume(folder, wanted)
    else:
        folder.check_new(replace=replace)
    wanted = with_frames(wanted, frames)
    with folder.locked(), _Signals() as signals, ExitStack() as open_until_the_end:
        try:
            with signals.interruptible():
                files = scene_files(wanted)
                simulation = open_until_the_end.enter_context(Simulation(wanted, workers=workers))
                job = _Run(simulation, folder, files, signals, progress)
                open_until_the_end.enter_context(job.compilation_told())
                if not resume:
                    job.start()
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
        progress: Callable[[RunProgress], None] | None,
    ) -> None:
        self.simulation = simulation
        self.folder = folder
        self.files = files
        self.checkpoint_every = simulation.scene.output.checkpoint_every
        self.frames = simulation.frames
        self.taken = earlier_joints(simulation.scene)
        self.warnings = warnings_of(simulation.scene, simulation.setup)
        self.notes = list(notes_of(simulation.scene, simulation.setup.solid))
        creature = creature_of(simulation.scene, simulation.setup)
        self.creature = None if creature is None else asdict(creature)
        self.columns = (*simulation.measures.columns, *(f"seconds_{p}" for p in ("total", *PARTS)))
        self.recorder = Recorder(folder)
        self.history: History | None = None
        self._signals = signals
        self._progress = progress
        self._started = perf_counter()

    def start(self) -> None:
        """Set bodies and fluid going, which may take long. Raises SceneError."""
        _ = self.simulation.world

    def begin(self, *, replace: bool) -> None:
        """Make the folder ready for a new run. Raises RunFolderError; then nothing is written."""
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
        """Stand where the checkpoint is, and drop what was written after it."""
        folder, simulation = self.folder, self.simulation
        try:
            if folder.checkpoint.exists():
                controller, setup = simulation.controller, simulation.setup
                memory = None if controller is None else controller.memory_shapes(setup.solid.nq)
                simulation.restore(*load_checkpoint(folder.checkpoint, setup, memory))
            if simulation.frame > self.frames:
                raise RunFolderError(
                    f"{folder.path} has {simulation.frame} frames already; ask for more of them, "
                    "or start again with --replace"
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
                f"{folder.path} cannot be gone on with: {error}; start again with --replace"
            ) from error

    def go_on(self) -> tuple[RunOutcome, str]:
        """Advance and record to the last frame, or to what stops the run."""
        simulation, signals = self.simulation, self._signals
        self._tell("start")
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
            self._tell("frame", report.objective, values)
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
        """Write the summary and the film, and say what came of the run."""
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
        """Draw the picture and the film; what to tell when they are not, or not whole."""
        missing = missing_to_draw()
        if missing is not None:
            return f"; no film: {missing}"
        from flowborne.view.film import make_preview

        try:
            with self._signals.interruptible():
                make_preview(self.folder.path, self._tell_drawn)
        except (RunFolderError, ValueError) as error:
            return f"; no film: {error}"
        except KeyboardInterrupt:
            return f"; stopped while drawing; draw with: flowborne film {self.folder.path}"
        return ""

    def _export(self) -> tuple[list[str], str]:
        """Write the files that the scene asks for; their names, and what to tell of the others."""
        from flowborne.exporting import export

        exported: list[str] = []
        failed = ""
        for table in self.simulation.scene.output.exports:
            try:
                out = self.folder.path / table.file
                with self._signals.interruptible():
                    written = export(self.folder.path, out, table.parameters)
                names = (str(file.relative_to(self.folder.path)) for file in written.files)
                exported += names
            except (OSError, PartError, RunFolderError, SceneError) as error:
                failed += f"; no {table.file}: {error}"
            except KeyboardInterrupt:
                how = f"flowborne export {self.folder.path} --out {out}"
                failed += f"; stopped before {table.file} was written; write it with: {how}"
        return exported, failed

    def compilation_told(self) -> AbstractContextManager[None]:
        """Context in which news is given of every kernel that is compiled."""
        if not self.simulation.scene.has_fluid:
            return nullcontext()
        return compilation_watched(lambda kernels: self._tell("compiling", kernels=kernels))

    def _write_start(self) -> None:
        """Everything that a run has at frame 0; the checkpoint last."""
        simulation, folder = self.simulation, self.folder
        write_model(
            folder,
            simulation.setup,
            controlled=list(simulation.scene.controlled_joints()),
            frames_per_second=1.0 / simulation.frame_time,
            wind=[list(stream)] if (stream := simulation.scene.stream()) else [],
            taken=self.taken,
        )
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
        if report.frame % self.checkpoint_every == 0:
            self._save()
        return values

    def _save(self) -> None:
        """Write the checkpoint, after the rows and states that it speaks of are on the disc."""
        assert self.history is not None
        self.history.sync()
        self.recorder.sync()
        save_checkpoint(self.folder.checkpoint, self.simulation.world, self.simulation.frame)

    def _check_space(self, freed: int) -> None:
        """Raise RunFolderError when the frames still to come do not fit on the disc."""
        simulation = self.simulation
        states = (self.frames - simulation.frame) * self.recorder.bytes_per_frame(simulation.world)
        needed = states + 2 * state_bytes(simulation.world) + FILM_BYTES
        check_space(self.folder.path, needed - freed)

    def _summary(self, outcome: RunOutcome, message: str) -> dict[str, Any]:
        simulation = self.simulation
        world = simulation.world
        strength = simulation.measures.strength_steps(simulation.frame_time)
        every = simulation.scene.controller.every if simulation.scene.can_settle else None
        cells = None if world.setup.fluid is None else prod(world.setup.fluid.grid.shape)
        return {
            "scene": simulation.scene.name,
            "outcome": outcome.name.lower(),
            "message": message,
            "doubts": self._doubts(),
            **summarise(self.folder.history, strength, every),
            "cells": cells,
            "creature": self.creature,
            "warnings": self.warnings,
            "notes": self.notes,
            "bodies_as_seen": [asdict(seen) for seen in seen_bodies(world.setup)],
            "state_bytes": state_bytes(world),
            "bytes_per_cell": None if cells is None else state_bytes(world) / cells,
            "peak_memory_bytes": peak_memory(),
            "versions": versions(),
            "model_files": self.folder.model_files(),
        }

    def _blown_up(self, error: BlowUpError) -> str:
        """Save the last good frame; the message."""
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
        return f"the simulation blew up in {error}; {kept}; try more steps per frame"

    def _not_written(self, error: OSError) -> str:
        return (
            f"writing into {self.folder.path} failed after frame {self._rows()} "
            f"({error.strerror or error}); what was written before is kept; make room, then "
            f"{self._how()}"
        )

    def _doubts(self) -> list[str]:
        """Reasons not to trust the frames so far, those of earlier runs in the folder included."""
        model, fluid = self.simulation.setup.solid, self.simulation.setup.fluid
        bodies = [model.body_names[body] for body in np.flatnonzero(model.met & model.moving)]
        return doubts_of(self.folder.history, bodies, fluid)

    def _rows(self) -> int:
        """Frames that are in the history."""
        return 0 if self.history is None else self.history.rows

    def _how(self) -> str:
        """How to go on."""
        path = self.folder.path
        return f"go on with: flowborne run {self.folder.scene} --out {path} --resume"

    def _tell_drawn(self, drawn: int, frames: int) -> None:
        if self._progress is not None:
            seconds = perf_counter() - self._started
            self._progress(RunProgress("film", drawn, frames, seconds))

    def _tell(
        self,
        stage: Stage,
        objective: float = nan,
        values: dict[str, float] | None = None,
        kernels: int = 0,
    ) -> None:
        if self._progress is None:
            return
        joints = self.simulation.measures.controlled
        self._progress(
            RunProgress(
                stage=stage,
                frame=self.simulation.frame,
                frames=self.frames,
                seconds=perf_counter() - self._started,
                kernels=kernels,
                warnings=len(self.warnings),
                objective=objective,
                joints=() if values is None else tuple((c, values[c]) for c in joints),
            )
        )


class _Signals:
    """Ctrl-C and SIGTERM during a run: noted, and raised only where that is safe.

    asked  whether one has come
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
        """Context that a signal ends at once, by KeyboardInterrupt, also one that came before."""
        if self.asked:
            raise KeyboardInterrupt
        self._safe = True
        try:
            yield
        except Exception as error:
            # what an interrupt becomes within a library: a SystemError while a kernel hands back
            # its result, a TypingError while Numba compiles it
            if not self.asked:
                raise
            raise KeyboardInterrupt from error
        finally:
            self._safe = False

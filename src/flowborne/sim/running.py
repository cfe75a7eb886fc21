"""A run from its scene to its folder: begin or resume, record, stop cleanly."""

from __future__ import annotations

import logging
from contextlib import ExitStack, suppress
from dataclasses import asdict
from math import prod
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from flowborne.base.arguments import COUNT, PATH, PROGRESS, or_none, takes
from flowborne.base.errors import PartError, SceneError, described
from flowborne.base.extras import missing_to_draw
from flowborne.base.given import said_of
from flowborne.base.progress import Progress, RunProgress, Stage, displayed
from flowborne.kernels.jit import compilation_watched
from flowborne.runs.checkpoint import load_checkpoint, save_checkpoint, state_bytes
from flowborne.runs.history import History
from flowborne.runs.recorder import Recorder, write_model
from flowborne.runs.run_folder import (
    UNREADABLE,
    RunFolder,
    RunFolderError,
    cannot_write,
    check_space,
    is_damage,
    write_remedy,
)
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
from flowborne.sim.endings import RunInterrupted, RunOutcome, RunResult, stopped
from flowborne.sim.frame import PARTS, FrameReport, Snapshot
from flowborne.sim.signals import Signals
from flowborne.sim.simulation import BlowUpError, Simulation

if TYPE_CHECKING:
    from flowborne.scenes.schema import Scene

log = logging.getLogger("flowborne")

FILM_BYTES = 20_000_000
"""Disc space reserved for the picture, the film and the history."""


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
    returns   the result, also of a run that blew up, filled the disc or was stopped by a policy or
              another part of its scene: see its outcome
    raises    RunFolderError if `out` cannot be used or another run is being written there,
              SceneError if the scene or an argument is wrong, or it does not fit into memory;
              nothing is then written. RunInterrupted (a KeyboardInterrupt) after Ctrl-C or SIGTERM,
              when everything has been saved; KeyboardInterrupt if there was nothing to save yet.
              What `progress` raises, with a note on the frame and how to continue, when everything
              has been saved
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
    with folder.locked(), Signals() as signals, ExitStack() as open_until_the_end:
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
        try:
            ended = job.go_on()
        except BaseException as error:  # of progress, or a fault of flowborne
            error.add_note(job.finish(*job.broken_off(error), film=False).message)
            raise
        return job.finish(*ended, film=film)


class _Run:
    """A simulation being written into a folder."""

    def __init__(
        self,
        simulation: Simulation,
        folder: RunFolder,
        files: dict[str, bytes],
        signals: Signals,
        progress: Progress | None,
    ) -> None:
        self.simulation = simulation
        self.folder = folder
        self.files = files
        self.frames = simulation.frames
        self.taken = earlier_joints(simulation.scene)  # the run may take the earlier one's place
        self.warnings = warnings_of(simulation.scene, simulation.setup)
        scene, model = simulation.scene, simulation.setup.solid
        wanted = scene.objectives, scene.controlled_joints()
        self.unit = objective_unit(*wanted, model, slab=scene.is_slab)
        self.columns = (*simulation.columns.names, *(f"seconds_{p}" for p in ("total", *PARTS)))
        self.recorder = Recorder(folder)
        self.history: History | None = None
        self._recorded: Snapshot | None = None  # state of the last row
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
        except OSError as error:
            self.folder.remove()
            raise cannot_write(self.folder.path, error) from error
        except BaseException:
            self.folder.remove()
            raise

    def resume(self) -> None:
        """Restore the checkpoint, and drop everything written after it."""
        folder, simulation = self.folder, self.simulation
        ended = folder.read_summary()
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
            self._recorded = simulation.snapshot()
        except (OSError, ValueError) as error:
            remedy = "start again with replace=True"
            if not is_damage(error):
                remedy = f"{write_remedy(error)}, then the same command resumes it"
                with suppress(OSError):
                    folder.write_summary(ended)
            raise RunFolderError(f"{folder.path} cannot be resumed: {error}; {remedy}") from error

    def go_on(self) -> tuple[RunOutcome, str]:
        """Advance and record to the last frame, or until the run stops; outcome and message.

        raises  what `progress` raises, and faults of flowborne
        """
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
            except (BlowUpError, MemoryError, SceneError) as error:
                return self._stopped(error)
            try:
                values = self._record(report)
            except MemoryError as error:
                return self._stopped(error)
            except OSError as error:
                return RunOutcome.NOT_WRITTEN, self._not_written(error)
            joints = tuple((c, values[c]) for c in simulation.columns.controlled)
            self.show("frame", objective=report.objective, unit=self.unit, joints=joints)
        try:
            self._save()
        except OSError as error:
            return RunOutcome.NOT_WRITTEN, self._not_written(error)
        if simulation.frame < self.frames:
            return self._interrupted()
        message, doubts = f"{simulation.frame} frames are in {self.folder.path}", self._doubts()
        if not doubts:
            return RunOutcome.DONE, message
        return RunOutcome.DOUBTFUL, f"{message}, but not to be trusted: {'. '.join(doubts)}"

    def broken_off(self, error: BaseException) -> tuple[RunOutcome, str]:
        """Save the last whole frame after what `go_on` raised; outcome and message."""
        kept = self._keep()
        if isinstance(error, KeyboardInterrupt):
            return self._interrupted()
        cause = f"the run stopped after frame {self._rows()} ({described(error)})"
        return RunOutcome.FAILED, f"{cause}; {kept}; {self._how()}"

    def finish(self, outcome: RunOutcome, message: str, *, film: bool) -> RunResult:
        """Write summary, exports and film; the result. Raises RunInterrupted after a signal."""
        assert self.history is not None
        self.history.close()
        folder = self.folder
        whole = outcome in (RunOutcome.DONE, RunOutcome.DOUBTFUL)
        facts: dict[str, Any] = {}
        try:
            facts = self._facts()
        except (MemoryError, *UNREADABLE) as error:  # the files are gone
            log.debug("no summary", exc_info=error)
            if whole:
                outcome, whole = RunOutcome.FAILED, False
                message += f", but cannot be read ({said_of(error)})"
        summary = {
            "scene": self.simulation.scene.name,
            "outcome": outcome.name.lower(),
            "message": message,
            **facts,
            "versions": versions(),
            "model_files": folder.model_files(),
        }
        try:
            folder.write_summary(summary)
            if whole and self.simulation.scene.output.exports:
                exported, failed = self._export()
                message += failed
                summary |= {"message": message}
                summary["model_files"] += exported
                folder.write_summary(summary)
            if film and outcome not in (RunOutcome.NOT_WRITTEN, RunOutcome.INTERRUPTED):
                message += self._draw()
        except OSError as error:
            if whole:
                outcome, message = RunOutcome.NOT_WRITTEN, self._not_written(error)
            try:
                folder.mark_ended(outcome.name.lower(), message)
            except OSError:
                message += "; summary.json could not be written and has an earlier state"
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

        how = f"draw with: flowborne film {self.folder.path}"
        try:
            with self._signals.interruptible():
                make_preview(
                    self.folder.path,
                    lambda drawn, frames: self.show("film", frame=drawn, frames=frames),
                )
        except (RunFolderError, ValueError) as error:
            return f"; no film: {error}"
        except MemoryError:
            return f"; no film: the memory is full; {how}"
        except KeyboardInterrupt:
            return f"; stopped while drawing; {how}"
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
            except MemoryError:
                failed += f"; no {table.file}: the memory is full"
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
        self._recorded = simulation.snapshot()
        self._save()

    def _record(self, report: FrameReport) -> dict[str, float]:
        """Write a frame: its row, its state, and a checkpoint when one is due.

        raises  OSError and MemoryError; unless the checkpoint failed, nothing of the frame is left
        """
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
        self._recorded = simulation.snapshot()
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

    def _facts(self) -> dict[str, Any]:
        """What the summary says of scene, history and states."""
        simulation = self.simulation
        world, scene = simulation.world, simulation.scene
        strength = simulation.columns.strength_steps(simulation.frame_time)
        every = scene.controller.every if scene.can_settle else None
        creature = creature_of(scene, world.setup)
        cells = None if world.setup.fluid is None else prod(world.setup.fluid.grid.shape)
        return {
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
        }

    def _interrupted(self) -> tuple[RunOutcome, str]:
        return RunOutcome.INTERRUPTED, f"stopped after frame {self._rows()}; {self._how()}"

    def _keep(self) -> str:
        """Save the last frame that has been recorded; a part of the message."""
        if self.simulation.frame > self._rows() and self._recorded is not None:
            self.simulation.restore(self._recorded)
        kept = f"everything up to frame {self._rows()} is kept"
        try:
            self._save()
        except (MemoryError, OSError) as error:
            said = getattr(error, "strerror", None) or "the memory is full"
            kept += f", but its checkpoint could not be written ({said})"
        return kept

    def _stopped(self, error: BlowUpError | MemoryError | SceneError) -> tuple[RunOutcome, str]:
        """Save the last whole frame after an error in the next one; outcome and message."""
        log.debug("the end of the run", exc_info=error)
        return stopped(error, self.simulation, self.folder, self._keep(), self._how())

    def _not_written(self, error: OSError) -> str:
        """Save the last recorded frame if that is possible; the message."""
        failed = f"writing into {self.folder.path} failed after frame {self._rows()}"
        why, remedy = error.strerror or error, write_remedy(error)
        return f"{failed} ({why}); {self._keep()}; {remedy}, then {self._how()}"

    def _doubts(self) -> list[str]:
        """Reasons not to trust the frames so far, including those of earlier runs in the folder."""
        simulation = self.simulation
        setup, scene = simulation.setup, simulation.scene
        model, dt = setup.solid, simulation.step_time
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

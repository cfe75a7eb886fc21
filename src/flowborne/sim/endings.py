"""How a run ends: its outcome, its result, and what a message says of an error in a frame."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from flowborne.base.errors import PartError, SceneError, WorkerError
from flowborne.base.phrases import listed
from flowborne.runs.run_folder import RunFolder
from flowborne.sim.simulation import BlowUpError, Simulation
from flowborne.view.embedded import run_html
from flowborne.view.open_run import OpenRun


class RunOutcome(Enum):
    """How a run ended, as a sentence."""

    DONE = "the run is complete"
    DOUBTFUL = "the run is complete, and its numbers are in doubt"
    BLEW_UP = "the simulation blew up"
    FAILED = "the run was stopped by an error"
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


def stopped(
    error: BlowUpError | MemoryError | SceneError,
    simulation: Simulation,
    folder: RunFolder,
    kept: str,
    how: str,
) -> tuple[RunOutcome, str]:
    """Outcome and message of a run whose next frame failed by an error.

    simulation  after its last whole frame
    kept, how   parts of the message: what has been saved, and how to continue
    """
    if isinstance(error, BlowUpError):
        cause, said = error.__cause__, str(error)
    else:
        cause = error
        said = f"frame {simulation.frame + 1}: {str(error).rstrip('.') or 'the memory is full'}"
    said, message = f"{said}; {kept}", f"the run stopped in {said}; {kept}"
    if isinstance(cause, MemoryError):
        return RunOutcome.FAILED, f"{message}; free some memory, then {how}"
    if isinstance(cause, WorkerError):
        return RunOutcome.FAILED, f"{message}; then {how}"
    if isinstance(cause, PartError | SceneError):
        plugins = [str(folder.path / Path(name).name) for name in simulation.scene.plugins]
        where = listed(plugins or [str(folder.scene)])
        return RunOutcome.FAILED, f"{message}; correct {where}, then {how}"
    if isinstance(error, BlowUpError) and error.fault:
        return RunOutcome.FAILED, (
            f"{message}; try more steps per frame. If that does not help, it is a fault of "
            "flowborne: flowborne --debug run shows where"
        )
    return RunOutcome.BLEW_UP, f"the simulation blew up in {said}; {_remedy(simulation)}"


def _remedy(simulation: Simulation) -> str:
    """What may keep a run from blowing up."""
    report, fluid = simulation.report, simulation.setup.fluid
    if fluid is None or report is None or not any(step.contacts for step in report.steps):
        return "try more steps per frame"
    return (
        "bodies touched in the fluid, which squeezes it out between them: give their geoms a "
        f"contact margin of a cell, margin = {fluid.grid.spacing:.2g} m in the model, or try "
        "more steps per frame"
    )

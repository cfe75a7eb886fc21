"""What commands print: results and complaints."""

from __future__ import annotations

import sys
from math import prod
from typing import TYPE_CHECKING

from flowborne.base.phrases import listed

if TYPE_CHECKING:
    from flowborne.coupling.world import Setup
    from flowborne.scenes.schema import Scene
    from flowborne.sim.endings import RunResult
    from flowborne.studies.batch_page import Batch


LONGEST = 1000
"""Letters of a message, of which more are left out in its middle."""


MOST_STARTED = 4_000_000
"""Cells of the largest grid that `check` cuts and on which it starts bodies and fluid: that takes
some seconds and 2 GB."""


def is_started(setup: Setup) -> bool:
    """Whether `check` starts the bodies and the fluid of a scene."""
    return setup.fluid is None or prod(setup.fluid.grid.shape) <= MOST_STARTED


def run_lines(result: RunResult) -> str:
    """A finished run in a few lines."""
    summary = result.summary
    lines = [result.message]
    for column, value in summary["final_mean"].items():
        lines.append(f"  {column}: {value:.4f} (mean of the last frames)")
    if summary["final_objective"] is not None:
        lines.append(f"  objective: {summary['final_objective']:.4g} (mean of the last decisions)")
    if summary["converged_frame"] is not None:
        lines.append(f"  converged at frame {summary['converged_frame']}")
    pace = f"  {summary['seconds_per_frame']:.3g} s per frame"
    if summary["bytes_per_cell"] is not None:
        pace += f", {summary['bytes_per_cell']:.0f} bytes per cell"
    if summary["peak_memory_bytes"] is not None:
        pace += f", {summary['peak_memory_bytes'] / 1e6:.0f} MB at most"
    return "\n".join([*lines, pace])


def batch_lines(batch: Batch) -> list[str]:
    """The efforts of a batch of clips, its page, and what was skipped."""
    from flowborne.studies.batch_page import effort_text

    lines = [
        f"{done.clip.name}: {done.frames} frames, effort {effort_text(done)}"
        + (f", not to be trusted: {'. '.join(done.doubts)}" if done.doubts else "")
        for done in batch.clips
        if not done.failure
    ]
    skipped = [f"skipped, not BVH: {listed(batch.skipped)}"] if batch.skipped else []
    return [*lines, *skipped, f"page: {batch.page}"]


def check_lines(scene: Scene, setup: Setup, warnings: list[str]) -> str:
    """What there is to say of a scene that can be run."""
    from flowborne.scenes.creature import creature_of
    from flowborne.scenes.notes import notes_of
    from flowborne.scenes.seen import seen_bodies
    from flowborne.scenes.warn import headline

    started = is_started(setup)
    creature = creature_of(scene, setup, on_grid=started)
    later = (
        f"  not started, as the grid has more than {MOST_STARTED:,} cells; a run starts bodies and "
        "fluid first"
    )
    return "\n".join(
        [
            *([] if creature is None else creature.lines()),
            headline(warnings),
            *([] if started else [later]),
            *(f"  warning: {warning}" for warning in warnings),
            *(f"  {note}" for note in notes_of(scene, setup.solid)),
            *(f"  {seen.sentence()}" for seen in seen_bodies(setup)),
        ]
    )


def sentence_of(error: Exception) -> str:
    """What typer says, in one line without its full stop."""
    text = error.format_message() if hasattr(error, "format_message") else str(error)
    return " ".join(text.split()).rstrip(".")


def complain(message: str) -> None:
    """Say what is wrong in one line that can be read, whatever the input has put into it."""
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in message)
    if len(line) > LONGEST:
        line = f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"
    print(f"flowborne: {line}", file=sys.stderr)

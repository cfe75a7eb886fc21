"""What commands print: results and complaints."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING

from flowborne.base.phrases import listed
from flowborne.runs.run_folder import RunFolder

if TYPE_CHECKING:
    from flowborne.sim.endings import RunResult
    from flowborne.studies.batch_page import Batch


LONGEST = 1000
"""Letters of a message, of which more are left out in its middle."""


def run_lines(result: RunResult, *, film: bool) -> str:
    """A finished run in a few lines; `film`: whether one was to be drawn."""
    summary = result.summary
    lines = [result.message]
    for column, value in summary["final_mean"].items():
        lines.append(f"  {column}: {value:.4f} (mean of the last frames)")
    if summary["final_objective"] is not None:
        value = f"{summary['final_objective']:.4g} {summary['objective_unit']}".rstrip()
        lines.append(f"  objective: {value} (mean of the last decisions)")
    if summary["converged_frame"] is not None:
        lines.append(f"  converged at frame {summary['converged_frame']}")
    pace = f"  {summary['seconds_per_frame']:.3g} s per frame"
    if summary["bytes_per_cell"] is not None:
        pace += f", {summary['bytes_per_cell']:.0f} bytes per cell"
    if summary["peak_memory_bytes"] is not None:
        pace += f", {summary['peak_memory_bytes'] / 1e6:.0f} MB at most"
    path = RunFolder(result.folder).film
    drawn = [f"  film: {path}"] if film and path.exists() else []
    return "\n".join([*lines, pace, *drawn, f"  look at it: flowborne view {result.folder}"])


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


def sentence_of(error: Exception) -> str:
    """What typer says, in one line without its full stop."""
    text = error.format_message() if hasattr(error, "format_message") else str(error)
    return " ".join(text.split()).rstrip(".")


def complain(message: str) -> None:
    """Say what is wrong in one line that can be read, whatever the input has put into it, with the
    switches of Python as options."""
    message = re.sub(r"\b(fill|replace|resume|trust)=True\b", r"--\1", message)
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in message)
    if len(line) > LONGEST:
        line = f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"
    print(f"flowborne: {line}", file=sys.stderr)

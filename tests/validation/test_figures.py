"""Tables and plot of Fig. 2 and Fig. 10, from short runs."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from flowborne_validation import controller_in_flow, figures
from flowborne_validation.figures import blocked_rows


def test_figures_are_written_and_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arrived = controller_in_flow.judged(np.concatenate([np.arange(30.0), np.full(20, 30.0)]), 1.0)
    wandering = controller_in_flow.judged(np.linspace(0.0, 90.0, 51), 1.0)
    found = {scene: arrived for scene in controller_in_flow.SCENES.values()}
    found["ns-block-effort"] = wandering
    monkeypatch.setattr(figures, "course", found.__getitem__)
    monkeypatch.setattr(figures, "blocked_rows", lambda: blocked_rows(frames=12))
    monkeypatch.setattr(figures, "frame_seconds", lambda joints, workers: 0.1 * joints / workers)
    text = io.StringIO()
    figures.make_figures(tmp_path / "new", ["2", "9b", "10"], Console(file=text, width=200))
    with (tmp_path / "new" / "figure-2.csv").open(newline="") as file:
        rows = {row["scene"]: row for row in csv.DictReader(file)}
    assert rows["ns-block-drag-max"]["reached in frame"] == "29"
    assert rows["ns-block-drag-max"]["stays from frame"] == "29"
    assert rows["ns-block-drag-max"]["frames in the paper"] == "56"
    assert rows["ns-block-effort"]["reached in frame"] == "45"
    assert rows["ns-block-effort"]["stays from frame"] == "never"
    with (tmp_path / "new" / "figure-10.csv").open(newline="") as file:
        serial = [float(row["serial s"]) for row in csv.DictReader(file)]
    assert serial == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert (tmp_path / "new" / "figure-10.png").stat().st_size > 1000
    assert "ns-block-drag-max" in text.getvalue()


def test_time_of_a_frame_is_measured() -> None:
    assert figures.frame_seconds(1, 1, frames=1) > 0.0

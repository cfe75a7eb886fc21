"""A mass on a spring, whose runs take milliseconds, and a study of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from ..made_runs import spring_scene

STUDY = """
scene = "spring.toml"

[settings]
time.frames = 4

[[vary]]
key = "initial.positions.along"
lower = 0.5
upper = 2.0

[[vary]]
key = "time.frames_per_second"
values = [10.0, 20.0]

[[measure]]
name = "end"
column = "position_along_m"
take = "last"
goal = "least"

[sample]
kind = "latin-hypercube"
count = 12
seed = 3
"""


@pytest.fixture
def study_file(tmp_path: Path) -> Path:
    """Path of a study of twelve short runs, in a folder with its scene."""
    spring_scene(tmp_path)
    path = tmp_path / "swing.toml"
    path.write_text(STUDY)
    return path

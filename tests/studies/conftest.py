"""A mass on a spring, whose runs take milliseconds, and a study of it."""

from __future__ import annotations

from pathlib import Path

import pytest

MASS = (
    '<mujoco><worldbody><body name="mass"><joint name="along" type="slide" axis="1 0 0" '
    'stiffness="4"/><geom type="sphere" size="0.1" mass="1"/></body></worldbody></mujoco>'
)

SPRING = """
[time]
frames_per_second = 10.0
frames = 5
[solids]
model = "spring.xml"
[initial]
positions = { along = 1.0 }
"""

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
    (tmp_path / "spring.xml").write_text(MASS)
    (tmp_path / "spring.toml").write_text(SPRING)
    path = tmp_path / "swing.toml"
    path.write_text(STUDY)
    return path

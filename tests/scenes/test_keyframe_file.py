"""Keyframes from a CSV file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flowborne.scenes.load import check_scene, load_scene
from flowborne.scenes.motions import MotionKeyframesTable

Write = Callable[..., Path]

MOTION = """
[[motion]]
kind = "keyframes"
joint = "rail"
file = "walk.csv"
"""
GOOD = "time,rail,other\n0.0,0.0,0.1\n0.5,0.1,0.2\n\n2.0,-0.2,0.3\n"


def test_a_motion_takes_the_column_of_its_joint(write: Write, tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text(GOOD)
    motion = load_scene(write(append=MOTION)).motion[1]
    assert isinstance(motion, MotionKeyframesTable)
    assert motion.times == (0.0, 0.5, 2.0)
    assert motion.values == (0.0, 0.1, -0.2)


def test_a_motion_takes_the_column_that_it_names(write: Write, tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text(GOOD)
    motion = load_scene(write(append=MOTION + 'column = "other"')).motion[1]
    assert isinstance(motion, MotionKeyframesTable)
    assert motion.values == (0.1, 0.2, 0.3)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "[[motion]] 2: there is no file"),
        ("", "[[motion]] 2: walk.csv has no column 'time'"),
        ("time,rial\n0,1\n1,2\n", "walk.csv has no column 'rail'; did you mean 'rial'?"),
        (
            "time,rail\n0,1\n1,abc\n",
            "walk.csv, line 3, column 'rail': 'abc' is not a finite number",
        ),
        ("time,rail\n0,1\n1\n", "walk.csv, line 3, column 'rail': '' is not a finite number"),
        (
            "time,rail\n0,1\n1,nan\n",
            "walk.csv, line 3, column 'rail': 'nan' is not a finite number",
        ),
        ("time,rail\n1,1\n0,2\n", "[[motion]] 2 has times that do not increase"),
        ("time,rail\n1,1\n", "[[motion]] 2 has 1 times. Give at least 2"),
    ],
)
def test_a_bad_file_is_told(
    write: Write, tmp_path: Path, content: str | None, message: str
) -> None:
    if content is not None:
        (tmp_path / "walk.csv").write_text(content)
    problems = check_scene(write(append=MOTION))
    assert len(problems) == 1
    assert message in problems[0]


def test_file_and_table_exclude_each_other(write: Write, tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text(GOOD)
    problems = check_scene(write(append=MOTION + "times = [0.0, 1.0]\nvalues = [0.0, 1.0]"))
    assert problems == [
        "scene swim.toml, [[motion]] 2 has both a file and a table. Keep one of them."
    ]

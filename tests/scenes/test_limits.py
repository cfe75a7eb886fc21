"""What cannot finish, or does not fit, is refused with what it asks for and the limit."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from flowborne.scenes.load import check_scene, load_scene

from .conftest import MODEL

Write = Callable[..., Path]

PLAN = "[controller]\nknots = 10000\nevery = 1000\n"
TRIALS = "[controller]\niterations = 10000\nhypothetical_steps = 10000\n"
SHORT = "[controller]\nknots = 4\nhypothetical_time = 1e-12\n"
KEYFRAMES = '[[motion]]\nkind = "keyframes"\njoint = "rail"\nfile = "{}"\n'
BANDS = '[[dye]]\nkind = "bands"\nside = "x_min"\nwidth = 0.1\ncount = {}\n'
PHASE = 'in_phases = [{strength = 1e-323, phases = {kind = "intervals", intervals = [[0.0, 1.0]]}}]'


@pytest.mark.parametrize(
    ("added", "said"),
    [
        (PLAN, "a decision takes 2e+11 steps (20000 trials of 1e+07 steps in each of 1"),
        (TRIALS, "a decision takes 2e+08 steps (2 trials of 1e+04 steps in each of 10000"),
        (SHORT, "and 1,000,000 are the most"),
        ("[film]\nsize = [100000, 100000]", "a picture of 37.3 GB, and 0.25 GB is the most"),
        (
            "[film]\nframes_per_second = 1e18",
            "[film] frames_per_second: 1e+18 is greater than 1000",
        ),
        (BANDS.format(10**9), "count: 1000000000 is greater than 1000. Give a smaller number."),
        (BANDS.format("9" * 4000), "is greater than 1000. Give a smaller number."),
        (KEYFRAMES.format("pipe"), "pipe cannot be read (it is a pipe, and no file)"),
        (KEYFRAMES.format("/dev/zero"), "/dev/zero cannot be read (it is a device, and no file)"),
        (KEYFRAMES.format("n" * 300), "file is no name that a file can have. Shorten it"),
        (KEYFRAMES.format("a/" * 3000), "file is no name that a file can have. Shorten it"),
        (f'[output]\nexports = ["{"n" * 300}.csv"]', "has 304 bytes, and a run calls its own"),
        (f'[earlier]\nrun = "{"n" * 300}"', "is no name that a file can have. Shorten it"),
    ],
)
def test_limits(write: Write, added: str, said: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    problems = check_scene(write(append=added))
    assert any(said in problem for problem in problems), problems
    assert all(len(problem) < 500 for problem in problems)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("frames = 3", "frames = 100000000000", "frames: 100000000000 is greater than 1e+06."),
        ("resolution = 16", f"resolution = {'9' * 400}", "is greater than 1e+06. Give a smaller"),
        ("resolution = 16", f"cells = [{'9' * 30}, 16]", "is greater than 1e+06. Give a smaller"),
        (
            "strength = 20.0",
            "strength = 5e-324",
            "is 4.94066e-324. Give a number of a size between",
        ),
        ("strength = 20.0", f"strength = 20.0\n{PHASE}", "strength is 9.88131e-324. Give a number"),
        ("frames = 3", "frames = 3\nframes_per_second = 1e300", "is 1e+300. Give a number of"),
        ("density = 1000.0", "density = 1e-200", "is 1e-200. Give a number of a size between"),
        ("gravity = [0.0,", "gravity = [1e200,", "is 1e+200. Give a number of a size between"),
    ],
)
def test_numbers_beyond_all_sizes(write: Write, before: str, after: str, said: str) -> None:
    (problem,) = check_scene(write({before: after}))
    assert said in problem


@pytest.mark.parametrize("size", [1e-100, 1e100])
def test_a_direction_of_any_size_is_one(write: Write, size: float) -> None:
    drag = f'kind = "pressure-drag"\ndirection = [{size}, {size}]\n'
    load_scene(write({'kind = "effort"\n': drag}))


def nested(depth: int) -> str:
    bodies = "".join(
        f'<body name="b{n}" pos="0 0.01 0"><geom type="sphere" size="0.01"/>' for n in range(depth)
    )
    return MODEL.replace("</worldbody>", bodies + "</body>" * depth + "</worldbody>")


def test_models_nested_too_deep(write: Write) -> None:
    (problem,) = check_scene(write(model=nested(2000)))
    assert "its elements are nested 2003 deep, and 500 is the most." in problem


@pytest.mark.parametrize(
    "element", ['<asset><mesh file="given.stl"/></asset>', '<include file="given.stl"/>']
)
@pytest.mark.parametrize("kind", ["pipe", "folder"])
def test_files_of_a_model_that_are_none(
    write: Write, element: str, kind: str, tmp_path: Path
) -> None:
    (os.mkfifo if kind == "pipe" else os.mkdir)(tmp_path / "given.stl")
    (problem,) = check_scene(write(model=MODEL.replace("<worldbody>", f"{element}<worldbody>", 1)))
    assert f"given.stl cannot be read: it is a {kind}, and no file. Mend that." in problem


@pytest.mark.parametrize("kind", ["pipe", "folder"])
def test_a_model_that_is_no_file(write: Write, kind: str, tmp_path: Path) -> None:
    (os.mkfifo if kind == "pipe" else os.mkdir)(tmp_path / "given.xml")
    (problem,) = check_scene(write({'"squid.xml"': '"given.xml"'}))
    assert f"given.xml cannot be read: it is a {kind}, and no file. Mend that." in problem


def test_a_model_that_includes_itself_comes_to_an_end(write: Write) -> None:
    include = '<include file="squid.xml"/><worldbody>'
    (problem,) = check_scene(write(model=MODEL.replace("<worldbody>", include, 1)))
    assert "squid.xml includes squid.xml once more. Include it once." in problem

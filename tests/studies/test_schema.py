"""Wrong studies are refused with file, place and remedy, before anything runs."""

from __future__ import annotations

from pathlib import Path

import pytest

import flowborne as fb
from flowborne.studies.running import Plan
from flowborne.studies.schema import load_study, toml_text


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[sample]", "[smaple]", "study swing.toml: unknown key 'smaple'; did you mean 'sample'?"),
        ("lower = 0.5", "lwer = 0.5", "study swing.toml, [[vary]] 1: unknown key 'lwer'; did you"),
        ("lower = 0.5", "", "study swing.toml, [[vary]] 1 needs either values, or lower and upper"),
        ("lower = 0.5", "lower = 3.0", "[[vary]] 1 has lower 3 and upper 2. Exchange them."),
        ("upper = 2.0", "upper = nan", "[[vary]] 1, upper is nan. Give a finite number"),
        ('"latin-hypercube"', '"latin"', "[sample] kind: 'latin' is not known. Give one of"),
        ('"latin-hypercube"', '"grid"', "[sample] has a count, but its kind is a grid"),
        ("count = 12", "", "[sample] of kind 'latin-hypercube' has no count"),
        ("count = 12", "count = 0", "[sample] count: 0 is less than 1. Give a larger number."),
        ("count = 12", "count = 200000", "has 200000 runs, and 100000 are the most"),
        ('"initial.positions.along"', '"intial.positions.along"', "did you mean 'initial'?"),
        ("positions.along", "positions.alone", "joint 'alone' is not in model spring.xml"),
        ('key = "time.frames_per_second"', 'key = "time.frames"', "the key 'time.frames' twice"),
        ("[10.0, 20.0]", "[10.0, -20.0]", "= -20.0: scene spring.toml, [time] frames_per_second"),
        ('"time.frames_per_second"', '"constants.speed"', "the scene has no constant 'speed'"),
        ('"position_along_m"', '"position_alon_m"', "did you mean 'position_along_m'?"),
        ('"position_along_m"', '"*"', "[[measure]] 1, column: '*' is the sum of columns in diff"),
        ('take = "last"', 'take = "lost"', "[[measure]] 1, take: 'lost' is not known; did you"),
        ("spring.toml", "sprung.toml", "there is no scene file"),
        ("spring.toml", "eeel", "there is no scene 'eeel'; did you mean 'eel'?"),
        (
            "time.frames = 4",
            "time.frames = 0",
            "its scene or [settings]: scene spring.toml, [time]",
        ),
        ("[sample]", "[sample", "study swing.toml, line 22, column 8: this is not TOML"),
        ('goal = "least"', "", ""),
    ],
)
def test_each_problem_has_its_place_and_remedy(
    study_file: Path, old: str, new: str, said: str
) -> None:
    study_file.write_text(study_file.read_text().replace(old, new, 1))
    if not said:
        Plan.of(study_file)
        return
    with pytest.raises(fb.SceneError) as raised:
        Plan.of(study_file)
    assert said in str(raised.value)
    assert len(raised.value.problems) == 1, raised.value.problems


def test_an_optimisation_needs_a_goal(study_file: Path) -> None:
    text = study_file.read_text().replace('goal = "least"', "").replace("latin-hypercube", "tpe")
    study_file.write_text(text)
    with pytest.raises(fb.SceneError, match=r"\[sample\] kind 'tpe' and no goal"):
        load_study(study_file)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(fb.SceneError, match="there is no study file"):
        load_study(tmp_path / "none.toml")


def test_the_number_of_runs_is_stated(study_file: Path) -> None:
    repeat = '[[repeat]]\nkey = "time.steps_per_frame"\nvalues = [1, 2, 4]\n[sample]'
    study_file.write_text(study_file.read_text().replace("[sample]", repeat))
    assert str(Plan.of(study_file)) == (
        "study swing: 12 samples x 3 resolutions = 36 runs of scene spring, 4 frames each unless "
        "a key changes it"
    )


@pytest.mark.parametrize("value", [0.1, 1e-300, 3, True, "text", [1.0, 2.0], 2.0 / 3.0])
def test_values_read_back_exactly(value: object) -> None:
    import tomllib

    assert tomllib.loads(f"x = {toml_text(value)}")["x"] == value

"""Parts of one's own: each a file of a few lines, used in Python and from a scene file alike."""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flowborne as fb
from flowborne.scenes.load import check_scene, library
from flowborne.scenes.plugins import LOADED
from flowborne.scenes.wind import WindFunction

PARTS = Path(__file__).parent / "own_parts"

SCENE = """
dimensions = 2
plugins = ["level.py", "share.py", "track.py"]

[time]
frames = 4

[solids]
model = "block.xml"

[initial]
positions = { hinge = 34.0 }

[[control]]
joints = ["hinge"]
strength = 24.0

[[objectives]]
kind = "level"
body = "block"
height = -9.0

[controller]
rule = { kind = "share", part = 0.25 }

[film]
field = "none"

[output]
exports = [{ file = "block.track", body = "block", every = 2 }]
"""


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Path]:
    """The scene in a folder with its model and its parts, forgotten afterwards."""
    for path in (*PARTS.glob("*.py"), library() / "block.xml"):
        shutil.copy(path, tmp_path)
    file = tmp_path / "own.toml"
    file.write_text(SCENE)
    file.with_name("sound.toml").write_text(SCENE)
    yield file
    for path in PARTS.glob("*.py"):
        forget(path.stem)


def forget(name: str) -> None:
    """Let a plugin of this name be imported anew."""
    sys.modules.pop(name, None)
    LOADED.pop(name, None)


@pytest.mark.parametrize("path", sorted(PARTS.glob("*.py")), ids=lambda path: path.stem)
def test_a_part_takes_few_lines(path: Path) -> None:
    code = [line for line in path.read_text().splitlines() if line.strip()]
    assert len(code) < 15


def test_parts_work_from_a_scene_file(scene: Path, tmp_path: Path) -> None:
    """The objective is measured, the rule goes a quarter of the way, the exporter writes."""
    result = fb.run(scene, tmp_path / "run", film=False)
    assert result.outcome.name == "DONE"
    assert result.message.endswith("run")
    run = fb.OpenRun(tmp_path / "run")
    angles = np.degrees(run.history["angle_hinge_rad"])
    assert_allclose(np.abs(np.diff(angles, prepend=34.0)), 0.25)
    centre = fb.Simulation(scene)
    for _ in range(4):
        centre.advance_frame()
    away = abs(centre.body("block").centre[1] + 9.0)
    assert run.history["measured_level"][-1] == pytest.approx(away)
    assert np.loadtxt(tmp_path / "run" / "block.track").shape == (3, 3)


def test_parts_are_found_where_python_looks_in_the_working_folder(
    scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in an interactive session in the scene's folder, where sys.path begins with ''."""
    for name in ("level", "share", "track"):
        forget(name)
    monkeypatch.chdir(scene.parent)
    monkeypatch.syspath_prepend("")
    assert check_scene(scene.name) == []


def test_the_run_folder_stands_on_its_own(scene: Path, tmp_path: Path) -> None:
    fb.run(scene, tmp_path / "run", film=False)
    assert {"level.py", "share.py", "track.py"} <= {p.name for p in (tmp_path / "run").iterdir()}
    again = fb.load_scene(tmp_path / "run" / "scene.toml")
    assert again.objectives == fb.load_scene(scene).objectives
    fb.export(tmp_path / "run", tmp_path / "again.track", {"body": "block"})
    assert np.loadtxt(tmp_path / "again.track").shape == (5, 3)
    fb.run(scene, tmp_path / "run", film=False, replace=True)


def test_parts_work_in_python(scene: Path) -> None:
    fb.load_scene(scene)
    level, share = sys.modules["level"].Level, sys.modules["share"].Share
    world = fb.Simulation(scene).world
    controller = fb.Controller(
        np.array([0]),
        fb.parts.ObjectiveSum.of(level("block", -9.0)),
        fb.Hypothesis(0.04),
        strength=1.0,
        rule=share(0.5),
        executor=fb.machine.Serial(),
    )
    decision = controller.decide(world, 0.1, fb.step)
    assert abs(decision.displacement[0]) == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("height = -9.0", "", "[[objectives]] 1 of kind 'level': key 'height' is missing. Add it."),
        ("height =", "heigth =", "unknown key 'heigth'. Its keys are: body, height"),
        ("height = -9.0", 'height = "up"', "height is 'up' (input should be a valid number"),
        ('"level"\n', '"levle"\n', "'levle' is not known; did you mean 'level'?"),
        ("part = 0.25", "parts = 0.25", "[controller] rule of kind 'share': unknown key 'parts'"),
        ("every = 2", "every = 2.5", "[output] exports, entry 1 of kind '.track': every is 2.5"),
        ('"block.track"', '"block.trak"', "nothing writes '.trak' files. End it with one of .abc"),
        ('"level.py"', '"no.py"', "plugins 1: file "),
        ('"level.py"', '"level.txt"', "plugins 1: 'level.txt' is no Python module"),
        ('"level.py"', '"broken.py"', "plugin 'broken.py' failed in broken.py, line 2 (ZeroDiv"),
        ('"level.py"', '"leaver.py"', "plugin 'leaver.py' failed in leaver.py, line 1 (SystemExit"),
        ('"level.py"', '"other/level.py"', "another file level.py is in use already"),
        ('"level.py"', '"json.py"', "'json' is the name of another Python module, too"),
    ],
)
def test_what_is_wrong_is_one_message(scene: Path, before: str, after: str, said: str) -> None:
    scene.with_name("broken.py").write_text("one = 1\none / 0\n")
    scene.with_name("leaver.py").write_text("raise SystemExit(0)\n")
    scene.with_name("json.py").write_text("")
    (scene.parent / "other").mkdir()
    (scene.parent / "other" / "level.py").write_text("one = 1\n")
    scene.write_text(SCENE.replace(before, after, 1))
    fb.load_scene(scene.with_name("sound.toml"))
    problems = check_scene(scene)
    assert len(problems) == 1 or before == '"level.py"', problems
    assert said in problems[0]


PLACE = "rule Share failed in share.py, line 14 "


@pytest.mark.parametrize(
    ("part", "statement", "said"),
    [
        ("level", "return 'high'", "'level' gave 'high', which is no number: return one"),
        ("level", "return 1 / 0", "'level' failed in level.py, line 15 (ZeroDivisionError"),
        ("level", "return None", "'level' gave None, which is no number"),
        ("level", "raise SystemExit(0)", "'level' failed in level.py, line 15 (SystemExit: 0)"),
        ("share", "raise SystemExit(0)", f"{PLACE}(SystemExit: 0)"),
        ("share", "raise BaseException()", f"{PLACE}(BaseException: )"),
        ("share", "raise TypeError()", f"{PLACE}(TypeError: )"),
        ("share", "raise MemoryError()", "frame 1, step 1: the memory is full"),
    ],
)
def test_a_part_that_fails_stops_the_run_with_its_place(
    scene: Path, tmp_path: Path, part: str, statement: str, said: str
) -> None:
    forget(part)
    path = scene.with_name(f"{part}.py")
    text = path.read_text()
    path.write_text(text[: text.index("return")] + f"{statement}\n")
    result = fb.run(scene, tmp_path / "run", film=False)
    forget(part)
    assert result.outcome.name == "FAILED"
    assert said in result.message
    assert part == "share" or "more steps" not in result.message


class Odd:
    """A rule and a gradient that give what they are made with."""

    def __init__(self, given: object) -> None:
        self.given = given

    def step_scale(self, scale: object, before: object, gradient: object) -> object:
        return self.given

    def step(self, poses: object, gradient: object, limit: object) -> object:
        return self.given

    def of(self, indices: object, scale: object) -> Odd:
        return self

    def estimate(self, poses: object) -> object:
        return self.given


@pytest.mark.parametrize("given", [None, "x", 1j, [0.5, 0.5], [float("nan")], [[-1.0]], 10**400])
@pytest.mark.parametrize("kind", ["rule", "gradient"])
def test_what_a_rule_or_gradient_gives_is_looked_at(scene: Path, kind: str, given: object) -> None:
    world = fb.Simulation(scene.with_name("sound.toml")).world
    controller = fb.Controller(
        np.array([0]),
        fb.parts.ObjectiveSum.of(fb.parts.ObjectiveCallable(lambda m: 0.0, name="none")),
        fb.Hypothesis(0.04),
        strength=1.0,
        executor=fb.machine.Serial(),
        **{kind: Odd(given)},
    )
    with pytest.raises(fb.PartError, match=rf"{kind} Odd gave .*: return .* for each of 1 dofs"):
        controller.decide(world, 0.1, fb.step)


def test_an_error_that_cannot_say_what_it_is_is_named() -> None:
    class MuteError(Exception):
        def __str__(self) -> str:
            raise ValueError

    def blow(x: object, time: float) -> None:
        raise MuteError

    with pytest.raises(
        fb.PartError, match=r"wind 'blow' failed in .* \(MuteError\): mend it there"
    ):
        WindFunction(blow, "blow")(np.zeros((2, 3)), 0.0)


@pytest.mark.parametrize("raised", [SystemExit(0), GeneratorExit(), ZeroDivisionError()])
def test_a_wind_that_ends_the_interpreter_is_a_part_that_failed(raised: BaseException) -> None:
    def blow(x: object, time: float) -> None:
        raise raised

    with pytest.raises(fb.PartError, match=r"wind 'blow' failed in test_own_parts\.py"):
        WindFunction(blow, "blow")(np.zeros((2, 3)), 0.0)


def test_ctrl_c_in_a_part_is_no_fault_of_it() -> None:
    def blow(x: object, time: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        WindFunction(blow, "blow")(np.zeros((2, 3)), 0.0)


def test_a_name_of_ours_a_class_without_its_method_and_a_taken_key_are_refused() -> None:
    from dataclasses import dataclass

    with pytest.raises(ValueError, match="'effort' is flowborne's own"):
        fb.parts.objective("effort")(object)
    with pytest.raises(ValueError, match="'thing' is no dataclass"):
        fb.parts.objective("thing")(object)

    @dataclass
    class Weighty:
        weight: float

        def value(self, measured: fb.Measurement) -> float:
            return self.weight

    with pytest.raises(ValueError, match="has a field 'weight', which is a key of every objective"):
        fb.parts.objective("weighty")(Weighty)
    with pytest.raises(ValueError, match=r"has no method step_scale\(\): add it"):
        fb.parts.rule("weighty")(Weighty)


WIND = """
dimensions = 2
plugins = ["breeze.py"]

[time]
frames = 2

[solids]
model = "block.xml"

[[wind]]
kind = "python"
function = "breeze:rising"
parameters = { speed = 3.0 }
"""


@pytest.fixture
def windy(scene: Path) -> Iterator[Callable[[str], Path]]:
    """A scene file whose wind is a function with the body that is given."""

    def write(body: str) -> Path:
        forget("breeze")
        code = f"import numpy as np\ndef rising(x, time, speed):\n    {body}\n"
        scene.with_name("breeze.py").write_text(code)
        file = scene.with_name("wind.toml")
        file.write_text(WIND)
        return file

    yield write
    forget("breeze")


def test_a_wind_takes_parameters(windy: Callable[[str], Path], tmp_path: Path) -> None:
    file = windy("return speed * np.ones_like(x)")
    assert fb.run(file, tmp_path / "run", film=False).outcome.name == "DONE"
    assert fb.OpenRun(tmp_path / "run").history["drag_N"][0] > 1.0
    file.write_text(WIND.replace("speed", "pace"))
    assert "function 'breeze:rising': got an unexpected keyword argument 'pace'" in str(
        check_scene(file)
    )


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return [1.0, 2.0]", "wind 'breeze:rising' gave an array of shape (2,)"),
        ("return x.gusts", "wind 'breeze:rising' failed in breeze.py, line 3 (AttributeError"),
    ],
)
def test_a_wind_that_fails_is_told_before_the_run_or_keeps_what_was_done(
    windy: Callable[[str], Path], tmp_path: Path, body: str, said: str
) -> None:
    with pytest.raises(fb.SceneError, match=re.escape(said)):
        fb.run(windy(body), tmp_path / "run", film=False)
    assert not (tmp_path / "run").exists()
    file = windy(body.replace("return", "return np.zeros_like(x) if time < 0.02 else"))
    result = fb.run(file, tmp_path / "run", film=False)
    assert said in result.message
    assert result.frames == 1


def test_a_gradient_of_ones_own_gets_the_probes_of_the_scene(scene: Path) -> None:
    from dataclasses import dataclass

    @fb.parts.gradient("doubled")
    @dataclass(frozen=True)
    class Doubled(fb.parts.GradientCentral):
        factor: float = 2.0

    scene.write_text(
        SCENE.replace("[controller]", '[controller]\ngradient = { kind = "doubled", factor = 3.0 }')
    )
    controller = fb.Simulation(scene).controller
    assert controller is not None
    assert controller.gradient == Doubled((np.radians(5.0),), factor=3.0)

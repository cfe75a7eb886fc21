import json
import re
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter
from types import ModuleType

import pytest

from flowborne.base.progress import ProgressDisplay, RunProgress
from flowborne.cli import main as cli
from flowborne.cli.app import WARNED
from flowborne.motion.bvh import write_clip
from flowborne.motion.human.gait import gait_clip
from flowborne.motion.human.skeleton import standard_skeleton
from flowborne.scenes.load import scene_names


@pytest.fixture
def command(capsys, monkeypatch, tmp_path):
    """Run the command line in an empty folder: (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)
    for name in cli.BLAS_THREADS:
        monkeypatch.setenv(name, "1")

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            cli.main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        return left.value.code, said.out, said.err

    return run


def test_a_run_tells_what_it_found(command, small_scene, tmp_path):
    code, out, err = command("run", small_scene, "--no-film", "--frames", 5, "--workers", 1)
    assert code == 0
    assert (tmp_path / "runs" / "small" / "history.csv").exists()
    assert "5 frames are in runs/small" in out
    assert "angle_hinge_rad: 0." in out
    assert out.count("s per frame") == 1
    assert re.search(r"objective: [\d.]+ N/m \(mean of the last decisions\)\n", out)
    assert out.endswith("  look at it: flowborne view runs/small\n")
    assert "film" not in out
    assert "s/frame" not in err
    assert re.search(r"frame 5/5  objective [\d.]+ N/m  hinge", err)
    assert "hinge 47.5°" in err


def test_a_film_tells_how_far_it_is(command, small_scene):
    options = ("--frames", 2, "--workers", 1, "--out", "run")
    _, out, err = command("run", small_scene, *options)
    assert out.endswith("  film: run/preview.mp4\n  look at it: flowborne view run\n")
    assert "drawing the film …  frame 3/3" in err
    code, out, err = command("film", "run", "--set", "size=[160, 96]", "--out", "films/shot.mp4")
    assert code == 0
    assert "drawing the film …  frame 3/3" in err
    assert "drawn: films/shot.mp4" in out


def test_settings_change_the_scene_and_are_written_out(command, small_scene, tmp_path):
    settings = ("--set", "solids.density=50", "--set", "initial.positions.hinge = 30")
    code, _, err = command("run", small_scene, "--no-film", "--frames", 1, *settings)
    assert code == 0, err
    written = (tmp_path / "runs" / "small" / "scene.toml").read_text()
    assert "density = 50.0" in written
    assert "hinge = 30.0" in written
    assert "frames = 1\n" in written


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run"], "Missing argument 'SCENE'"),
        (["run", "SMALL", "--frames", "0"], "frames is 0; give a whole number from 1"),
        (["run", "SMALL", "--frames", "two"], "Invalid value for '--frames'"),
        (["run", "SMALL", "--workers", "0"], "workers is 0"),
        (["run", "SMALL", "--set", "fluid.density"], "--set fluid.density has no KEY=VALUE"),
        (["run", "SMALL", "--set", "=3"], "has no KEY=VALUE"),
        (["run", "SMALL", "--set", "solids.density=-3"], "density"),
        (["run", "SMALL", "--set", "solids.densty=3"], "densty"),
        (["run", "SMALL", "--fames", "3"], "No such option"),
        (["run", "SMALL", "--resume"], "there is no folder runs/small"),
        (["run", "SMALL", "--resume", "--replace"], "exclude each other"),
        (["run", "SMALL", "--clips", "nowhere"], "there is no folder nowhere; give a"),
        (["run", "SMALL", "--clips", "taken"], "taken has only notes.txt and no BVH file"),
        (["run", "SMALL", "--clips", "taken", "--resume", "--replace"], "exclude each other"),
        (["run", "SMALL", "--out", "taken.txt"], "taken.txt is a file"),
        (["run", "SMALL", "--out", "taken"], "taken is not empty and was not made by a run"),
        (["run", "block-drag-mx"], "block-drag-max"),
        (["run", "nowhere/scene.toml"], "nowhere/scene.toml"),
        (["check", "nowhere.toml"], "nowhere.toml"),
        (["film", "nowhere"], "there is no folder nowhere"),
        (["film", "taken"], "taken is not the folder of a run"),
        (["figures", "--out", "taken.txt"], "taken.txt cannot be written (File exists)"),
        (["figures", "--out", "taken.txt/new"], "taken.txt/new cannot be written"),
        (["fly"], "there is no command 'fly'. The commands are: "),
        (["rn"], "there is no command 'rn'; did you mean 'run'?"),
        (["valdate"], "there is no command 'valdate'; did you mean 'validate'?"),
        (["figures", "3"], "NAME 3: there is no such figure; there are 2, 7, 9b, 10, 11"),
        (["export", "taken", "--out", "walk.bvh"], "taken is not the folder of a run"),
    ],
)
def test_bad_input_is_one_message_and_writes_nothing(
    command, small_scene, tmp_path, arguments, said
):
    (tmp_path / "taken.txt").write_text("mine")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "notes.txt").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    given = [str(small_scene) if argument == "SMALL" else argument for argument in arguments]
    code, out, err = command(*given)
    assert code == 2
    assert out == ""
    assert said in err
    assert err.startswith("flowborne: ")
    assert err.count("\n") == 1, err
    assert sorted(tmp_path.rglob("*")) == before


WET = """
dimensions = 2
[time]
frames = 4
[domain]
lower = [-1.0, -1.0]
upper = [1.0, 1.0]
resolution = 16
[fluid]
density = 1000.0
[boundaries]
x_min = { kind = "inflow", velocity = [1.0, 0.0] }
x_max = "open"
[solids]
model = "block.xml"
density = 1200.0
[[motion]]
kind = "keyframes"
joint = "hinge"
times = [0.0, 1.0]
values = [0.0, 30.0]
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"block.xml"', '"brick.xml"', "[solids]: there is no model file"),
        ("density = 1000.0", "densty = 1000.0", "unknown key 'densty'; did you mean 'density'?"),
        ("density = 1200.0", "density = -1.0", "[solids] density: -1.0 is not greater than 0"),
        ('"hinge"', '"hnige"', "joint 'hnige' is not in model block.xml; did you mean 'hinge'?"),
        ("upper = [1.0", "upper = [0.5", "reaches from 0 to 1 m in x at the start, outside"),
        ("resolution = 16", "resolution = 0", "resolution: 0 is less than 1"),
        ("30.0]", "nan]", "values, entry 2: nan is not a finite number"),
        ('x_max = "open"', 'y_min = "periodic"', "y_min is periodic and y_max is closed"),
        ('x_max = "open"', 'x_max = "closed"', "no side is open"),
        ("[fluid]", "[fluid", "line 9, column 7: this is not TOML"),
    ],
)
def test_a_faulty_scene_is_refused_by_name_and_place(command, small_scene, old, new, said):
    path = small_scene.with_name("wet.toml")
    before = sorted([*small_scene.parent.iterdir(), path])
    assert old in WET
    path.write_text(WET.replace(old, new, 1))
    code, out, err = command("run", path, "--out", path.with_name("run"))
    assert (code, out) == (2, "")
    assert said in err
    for line in err.splitlines():
        assert line.startswith("flowborne: scene wet.toml, "), err
    assert sorted(small_scene.parent.iterdir()) == before


def test_a_disc_without_room_is_found_before_the_run(command, small_scene, monkeypatch, tmp_path):
    from collections import namedtuple

    from flowborne.runs import run_folder

    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(run_folder.shutil, "disk_usage", lambda path: usage(10**9, 10**9, 10**6))
    code, out, err = command("run", small_scene, "--out", "run")
    assert (code, out) == (2, "")
    assert "MB in run and 1 MB are free; make room, run fewer frames" in err
    assert not (tmp_path / "run").exists()


SOUND = """creature: 20 kg/m, 0.673 x 0.966 m
geoms that displace fluid: all 1
moving bodies without one: none
fluid: none
no warnings
"""


def test_check_tells_every_problem_at_once(command, small_scene):
    narrow = ("--set", "control.0.probe=2.0")
    assert command("check", small_scene, *narrow) == (0, SOUND, "")
    text = small_scene.read_text().replace("density = 100.0", "density = -1.0")
    small_scene.write_text(text.replace("frames = 12", "frames = 0"))
    code, out, err = command("check", small_scene)
    assert (code, out) == (2, "")
    assert err.count("\n") == 2
    assert "density" in err
    assert "frames" in err


def test_check_of_a_large_grid_starts_nothing_and_says_so(command, tmp_path):
    """16.8 million cells: 160 s where they were cut and the fluid was started on them."""
    (tmp_path / "box.xml").write_text(
        '<mujoco><worldbody><body name="box" pos="0.3 0.3 0.3"><freejoint/>'
        '<geom type="box" size="0.05 0.05 0.05"/></body></worldbody></mujoco>'
    )
    (tmp_path / "box.toml").write_text(
        "[time]\nframes_per_second = 50.0\nframes = 6\n[domain]\nsize = [0.6, 0.6, 0.6]\n"
        'resolution = 16\n[fluid]\n[solids]\nmodel = "box.xml"\n'
    )
    _, out, _ = command("check", "box.toml")
    assert "not started" not in out
    began = perf_counter()
    code, out, _ = command("check", "box.toml", "--set", "domain.resolution=256")
    assert perf_counter() - began < 10.0
    assert code == 0
    assert "  not started, as the grid has more than 4,000,000 cells; a run starts bodies" in out
    assert "creature: 1 kg, displaces 1 kg of fluid, 0.1 x 0.1 x 0.1 m" in out


def test_cables_of_mujoco_3_are_chains_by_the_command_that_the_refusal_names(command, tmp_path):
    (tmp_path / "rope.xml").write_text(
        '<mujocoinclude><composite prefix="r" type="cable" curve="s" count="6" size="0.3">'
        '<geom type="capsule" size="0.02"/></composite></mujocoinclude>'
    )
    (tmp_path / "box.xml").write_text(
        '<mujoco><worldbody><body name="box" pos="0.1 0.3 0.3"><geom size="0.05"/>'
        '<include file="rope.xml"/></body></worldbody></mujoco>'
    )
    (tmp_path / "box.toml").write_text(
        "[time]\nframes_per_second = 50.0\nframes = 6\n[domain]\nsize = [0.6, 0.6, 0.6]\n"
        'resolution = 16\n[fluid]\n[solids]\nmodel = "box.xml"\n'
    )
    code, _, err = command("check", "box.toml")
    assert code == 2
    assert err.count("\n") == 1
    named = re.search(r"by `flowborne (chains .*rope\.xml)`, and give rope-chains\.xml\.", err)
    assert named, err
    code, out, _ = command(*named[1].split(" ", 1))
    assert code == 0
    assert "cable 'r': 5 bodies" in out
    model = (tmp_path / "box.xml").read_text()
    (tmp_path / "box.xml").write_text(model.replace("rope.xml", "rope-chains.xml"))
    code, out, err = command("check", "box.toml")
    assert code == 0, err
    assert "geoms that displace fluid: all 6" in out
    code, _, err = command("chains", "box.xml")
    assert (code, err) == (
        2,
        "flowborne: box.xml has no <composite>. Give the file that has one.\n",
    )


def test_check_counts_its_warnings_and_strictly_ends_with_3(command, small_scene):
    narrow = ("--set", "control.0.probe=2.0")
    slow = ("check", small_scene, *narrow, "--set", "control.0.strength=0.5")
    code, out, err = command(*slow)
    assert (code, err) == (0, "")
    warning = "1 warning, 1 note\n  warning: [[control]] 1: a strength of 0.5 degrees/s takes"
    assert out.startswith(SOUND.replace("no warnings\n", warning))
    assert command(*slow, "--strict") == (WARNED, out, "")
    assert WARNED == 3
    assert command("check", small_scene, *narrow, "--strict") == (0, SOUND, "")


def test_a_run_says_how_many_warnings_there_are_and_keeps_them(command, small_scene, tmp_path):
    radians = ("--set", "control.0.strength=0.5", "--set", "control.0.probe=0.02")
    code, _, err = command("run", small_scene, "--no-film", "--frames", 1, "--out", "run", *radians)
    assert code == 0
    assert "warnings: 2; flowborne check lists them\n" in err
    kept = json.loads((tmp_path / "run" / "summary.json").read_text())["warnings"]
    assert [warning.split(" of ")[0] for warning in kept] == [
        "[[control]] 1: a strength",
        "[[control]] 1: a probe",
    ]


def test_scenes_are_listed_with_their_figures(command):
    code, out, _ = command("scenes")
    assert code == 0
    rows = [line.split() for line in out.splitlines() if line.startswith("  ")][1:]
    assert sorted(row[0] for row in rows) == sorted(scene_names())
    of = {name: tuple(row) for name, *row in rows}
    assert of["eel"][:3] == ("2D", "14884", "4")
    assert of["eel-room"][:3] == ("3D", "595360", "4")
    assert of["block-effort-wind"][:3] == ("2D", "none", "3.33")
    assert of["block-effort-wind"][-3:] == ("(Fig.", "4", "a)")
    first = out.splitlines()[0].removeprefix("To begin with, a minute or two each: ").split(", ")
    assert len(set(first) & set(scene_names())) == 3
    gallery = (Path(__file__).parents[2] / "docs" / "gallery.md").read_text()
    headings = [line for line in out.splitlines()[2:] if not line.startswith(" ")]
    assert headings == re.findall(r"^## (.*)$", gallery, flags=re.M)


def test_a_clip_goes_in_by_one_option_and_comes_out(command, tmp_path):
    write_clip(tmp_path / "walk.bvh", gait_clip(standard_skeleton()))
    code, _, err = command(
        *("run", "human-gravity-back", "--set", "clip.file=walk.bvh", "--frames", 5),
        *("--out", "run", "--no-film"),
    )
    assert code == 0, err
    assert {"walk.bvh", "human.xml", "scene.toml"} < {p.name for p in (tmp_path / "run").iterdir()}
    code, out, _ = command("export", "run", "--out", "out.bvh")
    assert (code, out) == (0, "written: out.bvh\n")
    assert (tmp_path / "out.bvh").read_text().count("JOINT") == 22


def test_an_interrupted_command_says_how_to_go_on(command, small_scene, monkeypatch, tmp_path):
    from flowborne.sim.simulation import Simulation

    advance = Simulation.advance_frame

    def interrupted(simulation):
        if simulation.frame == 3:
            raise KeyboardInterrupt
        return advance(simulation)

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, "advance_frame", interrupted)
        code, _, err = command("run", small_scene, "--out", "run", "--no-film")
    assert code == 130
    assert "stopped after frame 3; continue with: flowborne run run/scene.toml --out run" in err
    code, out, _ = command("run", "run/scene.toml", "--out", "run", "--resume", "--no-film")
    assert (code, out.splitlines()[0]) == (0, "12 frames are in run")


def test_a_blow_up_ends_with_exit_code_1(command, small_scene, monkeypatch):
    from flowborne.coupling import step as stepping

    step = stepping.step

    def blow_up(world, dt, drive=None):
        report = step(world, dt, drive)
        world.solid.v[:] = float("nan") if world.steps == 6 else world.solid.v
        return report

    monkeypatch.setattr(stepping, "step", blow_up)
    code, out, err = command("run", small_scene, "--no-film", "--workers", 1)
    assert (code, out) == (1, "")
    assert "the simulation blew up in frame 3, step 2" in err
    assert "Traceback" not in err


@dataclass
class Result:
    """A result as the validation and the benches give it."""

    id: str
    verdict: str
    name: str = ""
    title: str = "a case"
    value: float = 1.5
    reference: float = 1.0
    target: float = 1.0
    tolerance: float = 0.1
    lines: list[str] = field(default_factory=lambda: ["32: 1.4", "64: 1.5"])

    def as_dict(self):
        return asdict(self)


@pytest.fixture
def cases(monkeypatch):
    """Stand-ins for the validation and the benches; what was asked of them."""
    asked = []
    results = {"K1": Result("K1", "pass", "K1"), "K2": Result("K2", "fail", "K2")}
    results["B1"] = Result("B1", "coarse", "B1")

    def run_all(names, tier=None, on_result=None, report=None):
        asked.append((names, tier))
        chosen = [results[name] for name in names or results]
        for result in chosen:
            if on_result:
                on_result(result)
        return chosen

    for module, name, stands_in in (
        (".cases", "case_ids", lambda: tuple(results)),
        (".running", "run_cases", run_all),
        (".bench", "bench_names", lambda: tuple(results)),
        (".bench", "run_benches", run_all),
    ):
        monkeypatch.setattr(f"flowborne_validation{module}.{name}", stands_in)
    return asked


def test_validate_prints_rows_and_fails_when_a_case_does(command, cases):
    code, out, _ = command("validate")
    assert code == 1
    assert out.splitlines()[0] == "PASS  K1  a case  value 1.5  reference 1  tolerance 0.1"
    assert out.splitlines()[1] == "        32: 1.4"
    assert out.splitlines()[6].startswith("COARSE  B1  a case")
    code, _, _ = command("validate", "--case", "K1", "--case", "B1", "--tier", "half-hour")
    assert code == 0, "a grid too coarse is no failure"
    assert cases == [(None, "minute"), (["K1", "B1"], "half-hour")]


def test_an_unknown_tier_is_refused(command, cases):
    code, out, err = command("validate", "--tier", "hour")
    assert (code, out, cases) == (2, "", [])
    assert "--tier hour: there is no such tier; did you mean half-hour?" in err


def test_an_interrupted_validation_says_how_it_goes_on(command, cases, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("flowborne_validation.running.run_cases", interrupted)
    code, out, err = command("validate", "--report", "kept")
    assert (code, out) == (130, "")
    assert err == "flowborne: interrupted; kept has the finished cases; run again to continue\n"


def test_a_validation_says_which_cases_of_its_report_are_of_other_code(command, cases, monkeypatch):
    monkeypatch.setattr("flowborne_validation.report.of_other_code", lambda _: ["B1 (all)", "B2"])
    code, _, err = command("validate", "--case", "K1", "--report", "kept")
    assert (code, err) == (0, "kept: measured with other code: B1 (all), B2\n")


@pytest.mark.parametrize("arguments", [["validate", "--case", "K2"], ["bench", "K2"]])
def test_json_is_all_that_is_printed(command, cases, arguments):
    code, out, _ = command(*arguments, "--json")
    assert code == 1
    (result,) = json.loads(out)
    assert (result["id"], result["verdict"]) == ("K2", "fail")


@pytest.mark.parametrize("arguments", [["validate", "--case", "K3"], ["bench", "K3"]])
def test_an_unknown_case_is_refused(command, cases, arguments):
    code, out, err = command(*arguments)
    assert (code, out, cases) == (2, "", [])
    assert "K3: there is no such" in err
    assert "did you mean K" in err


@pytest.fixture
def figures(monkeypatch):
    """Stand-in for the figures; what is asked of it."""
    asked = []

    def make_figures(out, names=None, console=None):
        asked.append((out, names))
        if out.name == "wild":
            raise ArithmeticError("ns-block-effort: frame 3, step 1: the fluid blew up")
        (out / "figure-2.csv").write_text("run\n")

    stand_in = ModuleType("flowborne_validation.figures")
    stand_in.make_figures = make_figures
    stand_in.figure_names = lambda: ("2", "10")
    monkeypatch.setitem(sys.modules, "flowborne_validation.figures", stand_in)
    return asked


def test_figures_are_put_into_a_folder(command, figures, tmp_path):
    code, out, err = command("figures", "--out", "new/one")
    assert (code, err) == (0, "")
    assert out == "written: new/one/figure-2.csv\n"
    assert (tmp_path / "new" / "one" / "figure-2.csv").exists()


def test_figures_of_a_run_that_blows_up_end_with_exit_code_1(command, figures):
    code, out, err = command("figures", "--out", "wild")
    assert (code, out) == (1, "")
    assert err == "flowborne: ns-block-effort: frame 3, step 1: the fluid blew up\n"


HEAVY = ("numpy", "scipy", "numba", "mujoco", "pydantic", "matplotlib", "pyvista", "rich")
"""Libraries that take longer to import than the command may take to start."""


@pytest.mark.parametrize("module", ["flowborne", "flowborne.cli.main"])
def test_nothing_heavy_is_imported_at_the_start(module):
    code = f"import sys, {module}; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout == "[]\n"


def test_help_is_told_without_anything_heavy():
    code = (
        "import sys; from flowborne.cli.main import main\n"
        f"try: main(['--help'])\nfinally: sys.exit(bool(set({HEAVY}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0
    assert "Creatures that react to the fluid" in done.stdout


def test_public_names_are_found_and_others_are_not():
    import flowborne

    for name in flowborne.__all__:
        assert getattr(flowborne, name) is not None
        assert name in dir(flowborne)
    with pytest.raises(AttributeError, match="no attribute 'fly'"):
        _ = flowborne.fly


def test_progress_says_that_it_compiles_and_how_long_the_first_frame_took(capsys):
    with ProgressDisplay() as display:
        display(RunProgress("start", 0, 3, 0.0))
        for kernels in (1, 2):
            display(RunProgress("compiling", 0, 3, float(kernels), kernels=kernels))
        joints = (("angle_hinge_rad", 0.5), ("position_slide_m", 0.25))
        for frame in (1, 2, 3):
            news = RunProgress("frame", frame, 3, 9.0 + frame, objective=0.125, joints=joints)
            display(news)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "compiling kernels (first run only) …"
    assert lines[1] == "first frame after 10.0 s"
    assert lines[2] == "frame 1/3  objective 0.125  hinge 28.6°  slide 0.25 m"
    assert lines[3] == "frame 3/3  objective 0.125  hinge 28.6°  slide 0.25 m  0 s left"
    assert len(lines) == 4


def test_a_full_memory_is_said_with_what_helps(command, small_scene, monkeypatch):
    def fail(*_, **__):
        raise MemoryError("Unable to allocate 530. MiB")

    monkeypatch.setattr("flowborne.scenes.load.load_scene", fail)
    code, _, told = command("check", small_scene)
    assert code == cli.WRONG
    assert "memory of this machine is full (Unable to allocate 530. MiB). Make the grid" in told


def test_an_error_that_nobody_expected_is_one_line_and_its_traceback_with_debug(
    command, small_scene, monkeypatch
):
    def fail(*_, **__):
        raise KeyError("a slip")

    monkeypatch.setattr(cli.log, "handlers", [])
    monkeypatch.setattr(cli.log, "level", cli.log.level)
    monkeypatch.setattr("flowborne.scenes.load.load_scene", fail)
    said = r"flowborne: a fault of flowborne \(KeyError: 'a slip', in test_main.py, line \d+\); "
    code, out, err = command("check", small_scene)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert re.match(said, err)
    code, _, err = command("--debug", "check", small_scene)
    assert code == 1
    assert "Traceback (most recent call last)" in err
    assert re.search(said, err)


def test_help_is_in_groups_with_whole_sentences_and_an_example(command):
    code, out, _ = command("--help")
    assert code == 0
    assert re.findall(r"^([A-Z][a-z ]+):$", out, flags=re.M) == [
        *("Options", "Make", "Look", "Take away", "Trust")
    ]
    assert "..." not in out.split("Options:")[1]
    assert " ".join(out.split()).endswith("flowborne view runs/ns-block-drag-max")
    assert command("-h") == (0, out, "")
    code, out, _ = command("film", "-h")
    assert code == 0
    assert out.endswith(
        "  Example:\n    flowborne film runs/eel --out eel.webp --set camera.orbit=30\n"
    )


@pytest.mark.parametrize("name", ["view", "film"])
def test_a_scene_in_place_of_a_run_has_to_run_first(command, small_scene, tmp_path, name):
    said = f"flowborne: {small_scene} is a scene, not the folder of a run; "
    code, out, err = command(name, small_scene)
    assert (code, out, err) == (2, "", f"{said}run it first: flowborne run {small_scene}\n")
    assert command("run", small_scene, "--no-film", "--frames", 1)[0] == 0
    code, _, err = command(name, small_scene)
    assert (code, err) == (2, f"{said}give runs/small\n")
    code, _, err = command(name, "eel")
    assert code == 2
    assert "eel is a scene, not the folder of a run; run it first: flowborne run eel\n" in err


def test_a_duration_is_refused_with_the_frames_that_it_is(command, small_scene):
    text = small_scene.read_text()
    small_scene.write_text(text.replace("frames = 12", "duration = 3"))
    code, _, err = command("check", small_scene)
    assert code == 2
    assert "[time]: unknown key 'duration'; give frames = 72, which is 3 s at frames_per" in err
    small_scene.write_text(text.replace("frames = 12", "duration = 'long'"))
    _, _, err = command("check", small_scene)
    assert "unknown key 'duration'; give frames = duration times frames_per_second.\n" in err


def test_a_warning_that_a_scene_accepts_is_a_note_with_the_reason(command, small_scene):
    slow = ("--set", "control.0.probe=2.0", "--set", "control.0.strength=0.5")
    text = small_scene.read_text()
    small_scene.write_text(text + '\n[accepted_warnings]\nangles_in_radians = "it creeps"\n')
    code, out, _ = command("check", small_scene, *slow, "--strict")
    assert code == 0
    assert "\nno warnings, 2 notes\n" in out
    assert re.search(r"  note: .* 1: a strength of 0\.5 .*\. Accepted: it creeps\n", out)
    small_scene.write_text(text + '\n[accepted_warnings]\nangles_in_radian = "it creeps"\n')
    code, _, err = command("check", small_scene)
    assert code == 2
    assert "accepted_warnings: there is no warning 'angles_in_radian'; did you mean" in err

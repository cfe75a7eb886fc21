"""Exports by the command line and from a scene."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import flowborne as fb
from flowborne.cli.main import main
from flowborne.runs.exporters import EXPORTERS, can_write
from flowborne.runs.run_folder import RunFolder

WATER = """
dimensions = 2
[time]
frames = 2
[domain]
lower = [0, 0]
upper = [1, 1]
resolution = 8
[fluid]
[[dye]]
kind = "bands"
side = "x_min"
count = 2
width = 0.2
[boundaries]
x_min = { kind = "inflow", velocity = [1.0, 0.0] }
x_max = "open"
[output]
exports = ["water.vdb", "table.csv"]
"""


def told(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    """Exit code of a command, what it prints, and what it complains of."""
    with pytest.raises(SystemExit) as leaving:
        main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return int(str(leaving.value.code)), captured.out, captured.err


@pytest.fixture
def water(tmp_path: Path) -> Path:
    """Run of a scene that asks for volumes and a table."""
    (tmp_path / "water.toml").write_text(WATER)
    fb.run(tmp_path / "water.toml", tmp_path / "run", film=False)
    return tmp_path / "run"


def test_files_that_a_scene_asks_for_belong_to_its_run(water: Path) -> None:
    files = [f"water_{n:04d}.vdb" for n in range(3)]
    names = {path.name for path in water.iterdir()}
    assert {"table.csv", *files} <= names
    assert {"table.csv", *files} <= set(RunFolder(water).model_files())
    fb.run(water.with_name("water.toml"), water, frames=1, film=False, replace=True)
    assert (water / "water_0001.vdb").exists()
    assert not (water / "water_0002.vdb").exists(), "of the run before"


def test_the_command_says_what_it_wrote(
    water: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    said = told(capsys, "export", water, "--out", tmp_path / "new" / "out.csv")
    assert said == (0, f"written: {tmp_path / 'new' / 'out.csv'}\n", "")
    code, out, _ = told(capsys, "export", water, "--out", tmp_path / "out.vdb")
    first, last = tmp_path / "out_0000.vdb", tmp_path / "out_0002.vdb"
    assert (code, out) == (0, f"written: {first} to {last}\n")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("out.fbx", "out.fbx: nothing writes '.fbx' files. End its name with one of .abc, .bvh"),
        ("out.glb", "has no bodies. Add [solids] or [human] to its scene."),
        ("file/out.csv", "cannot be written (File exists)"),
    ],
)
def test_what_is_wrong_is_one_message(
    name: str, said: str, water: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    code, out, err = told(capsys, "export", water, "--out", tmp_path / name)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_a_scene_with_a_parameter_that_is_none_is_refused(tmp_path: Path) -> None:
    scene = WATER.replace('"table.csv"', '{ file = "out.glb", target = 3 }')
    (tmp_path / "water.toml").write_text(scene)
    with pytest.raises(fb.SceneError, match=r"of kind '.glb': unknown key 'target'. Its keys are"):
        fb.load_scene(tmp_path / "water.toml")


def test_ones_own_takes_the_place_of_ours(water: Path, tmp_path: Path) -> None:
    assert can_write(".csv")
    ours = EXPORTERS._kinds[".csv"]

    @fb.parts.exporter(".csv")
    @dataclass(frozen=True)
    class Own:
        def write(self, run: fb.OpenRun, path: Path) -> None:
            path.write_text(run.name)

    @fb.parts.exporter(".odd")
    @dataclass(frozen=True)
    class Odd:
        def write(self, run: fb.OpenRun, path: Path) -> float:
            return 3.0

    try:
        with pytest.raises(fb.PartError, match=r"exporter of '\.odd' files gave 3\.0: return no"):
            fb.export(water, tmp_path / "x.odd")
        fb.export(water, tmp_path / "ours.parquet")  # of the module that has our .csv, too
        fb.export(water, tmp_path / "own.csv")
        assert (tmp_path / "own.csv").read_text() == "water"
    finally:
        EXPORTERS._kinds[".csv"] = ours
        EXPORTERS._kinds.pop(".odd")


def test_exporters_are_listed_without_their_libraries() -> None:
    listing = (
        "import sys; "
        "sys.modules |= dict.fromkeys(['alembic3d', 'h5py', 'pxr', 'pyarrow', 'pygltflib']); "
        "from flowborne.runs.exporters import endings; print(*endings())"
    )
    done = subprocess.run([sys.executable, "-c", listing], capture_output=True, text=True)
    assert done.stdout.split() == [
        ".abc", ".bvh", ".csv", ".glb", ".parquet", ".usd", ".usda", ".usdc", ".vdb", ".vtkhdf"
    ], done.stderr  # fmt: skip

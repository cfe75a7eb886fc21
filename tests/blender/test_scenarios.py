"""Scenarios of the Blender extension, each in a process of Blender's Python: `make blender`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.blender

ROOT = Path(__file__).parents[2]
FILES = sorted((Path(__file__).parent / "scenarios").glob("*.py"))


@pytest.mark.parametrize("scenario", [path.stem for path in FILES if path.stem != "stage"])
def test_scenario(scenario: str, tmp_path: Path) -> None:
    python = os.environ.get("FLOWBORNE_BPY")
    assert python, "FLOWBORNE_BPY names no Python with bpy; run `make blender`"
    own = {
        "BLENDER_USER_RESOURCES": str(tmp_path / "user"),
        "FLOWBORNE_ENGINE": os.environ.get("FLOWBORNE_ENGINE", sys.executable),
        "PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
    }
    file, folder = Path(__file__).parent / "scenarios" / f"{scenario}.py", tmp_path / "files"
    folder.mkdir()
    done = subprocess.run(
        [python, str(file), str(folder)],
        capture_output=True,
        text=True,
        env=os.environ | own,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]

"""Wheel and sdist hold what a user needs, and work where no source tree is.

`make dist` does the same with dependencies of their own, for every Python.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from dist import ROOT, SUPPORTED, build, environment, flowborne, install, interpreters, members

DATA = {
    path.relative_to(ROOT / "src").as_posix()
    for path in (ROOT / "src" / "flowborne").rglob("*")
    if path.is_file() and path.suffix in (".toml", ".xml", ".npz", ".json", ".gz")
}
"""Scenes, models, meshes, references and measurements."""

FOUND = interpreters()
PRESENT = f"{sys.version_info.major}.{sys.version_info.minor}"


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """sdist and wheel of this tree."""
    return build(tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def fresh(archives: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> str:
    """Python of an environment that has the wheel, and the libraries of this one but no flowborne.

    What is installed here in editable form is not found from there: a path in a .pth file brings
    packages, and no .pth files of its own.
    """
    folder = tmp_path_factory.mktemp("fresh")
    python = environment(sys.executable, folder)
    (packages,) = folder.rglob("site-packages")
    here = [path for path in sys.path if path.endswith("site-packages")]
    (packages / "libraries.pth").write_text("\n".join(here))
    install(python, archives[1], "--no-deps", "--no-index", "--no-compile")
    return python


def test_the_wheel_holds_the_package_and_its_data(archives: tuple[Path, Path]) -> None:
    held = members(archives[1])
    assert len(DATA) > 40
    assert held >= DATA
    code = {path.relative_to(ROOT / "src").as_posix() for path in ROOT.glob("src/**/*.py")}
    assert held >= code
    described = {name for name in held if ".dist-info/" in name}
    packed = {f"flowborne/validation/{robot}/LICENSE" for robot in ("fishrobot", "rexeel")}
    assert held - described == code | DATA | packed
    licences = {name.partition("/licenses/")[2] for name in described if "/licenses/" in name}
    assert licences == {"LICENSE", *(f"src/{name}" for name in packed)}


def test_the_sdist_holds_the_sources_and_no_tests(archives: tuple[Path, Path]) -> None:
    held = members(archives[0])
    assert held >= {f"src/{name}" for name in DATA}
    assert held >= {"pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "CITATION.cff"}
    assert not {name for name in held if "__pycache__" in name or name.startswith("tests/")}


def test_the_wheel_works_in_a_fresh_environment(
    archives: tuple[Path, Path], fresh: str, tmp_path: Path
) -> None:
    version = archives[1].name.split("-")[1]
    assert flowborne(fresh, tmp_path, "--version") == f"{version}\n"
    assert "eel-room" in flowborne(fresh, tmp_path, "scenes")
    assert "\nnothing wrong\n" in flowborne(fresh, tmp_path, "check", "block-effort-wind")
    assert f"flowborne {version}" in flowborne(fresh, tmp_path, "doctor")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("version", [v for v in SUPPORTED if v != PRESENT])
def test_the_wheel_suits_other_pythons(
    archives: tuple[Path, Path], tmp_path: Path, version: str
) -> None:
    """It installs, all of it compiles without a warning, and its first module says the version."""
    if version not in FOUND:
        pytest.skip(f"this machine has no Python {version}")
    python = environment(FOUND[version], tmp_path / "environment")
    install(python, archives[1], "--no-deps", "--no-index", "--no-compile")
    (package,) = (tmp_path / "environment").rglob("site-packages/flowborne")
    compiling = [python, "-W", "error", "-m", "compileall", "-q", str(package)]
    done = subprocess.run(compiling, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    telling = [python, "-I", "-c", "import flowborne; print(flowborne.__version__)"]
    told = subprocess.run(telling, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert told.stdout.strip() == archives[1].name.split("-")[1]

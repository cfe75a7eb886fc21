"""Wheel and sdist hold what a user needs, and work where no source tree is.

`make dist` does the same with dependencies of their own, for every Python.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from dist import (
    ROOT,
    SUPPORTED,
    VALIDATION,
    build,
    environment,
    flowborne,
    install,
    interpreters,
    members,
)


def files(source: Path, *kinds: str) -> set[str]:
    """Files of a source tree with these suffixes, by their paths in its package."""
    return {
        path.relative_to(source / "src").as_posix()
        for path in (source / "src").rglob("*")
        if path.is_file() and path.suffix in kinds
    }


DATA = files(ROOT, ".toml", ".xml", ".npz", ".js")
"""Scenes, models, meshes and the script of a page."""

PRESENT = f"{sys.version_info.major}.{sys.version_info.minor}"


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """sdist and wheel of this tree."""
    return build(tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def validation(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """sdist and wheel of the validation."""
    return build(tmp_path_factory.mktemp("validation"), VALIDATION)


@pytest.fixture(scope="module")
def fresh(archives: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> str:
    """Python of an environment that has the wheel, and the libraries of this one but no flowborne.

    What is installed here in editable form is not found from there: .pth files and descriptions of
    flowborne stay behind.
    """
    folder = tmp_path_factory.mktemp("fresh")
    python = environment(sys.executable, folder)
    (packages,) = folder.rglob("site-packages")
    libraries = tmp_path_factory.mktemp("libraries")
    for here in map(Path, sys.path):
        for found in here.glob("*") if here.name == "site-packages" else ():
            if "flowborne" not in found.name:
                (libraries / found.name).symlink_to(found)
    (packages / "libraries.pth").write_text(f"{libraries}\n")
    install(python, archives[1], "--no-deps", "--no-index", "--no-compile")
    return python


def test_the_wheel_holds_the_package_and_its_data(archives: tuple[Path, Path]) -> None:
    held = members(archives[1])
    assert len(DATA) > 40
    assert held >= DATA
    described = {name for name in held if ".dist-info/" in name}
    assert held - described == files(ROOT, ".py") | DATA | {"flowborne/py.typed"}
    assert licences(held) == {"LICENSE"}


def test_the_wheel_of_the_validation_holds_its_cases(validation: tuple[Path, Path]) -> None:
    held = members(validation[1])
    described = {name for name in held if ".dist-info/" in name}
    packed = {f"flowborne_validation/{robot}/LICENSE" for robot in ("fishrobot", "rexeel")}
    data = files(VALIDATION, ".json", ".toml", ".gz")
    assert len(data) > 5
    assert held - described == files(VALIDATION, ".py") | data | packed
    assert licences(held) == {"LICENSE", *(f"src/{name}" for name in packed)}


def licences(held: set[str]) -> set[str]:
    """Those that a wheel's description lists."""
    return {found for name in held if (found := name.partition("/licenses/")[2])}


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
    assert "\nno warnings\n" in flowborne(fresh, tmp_path, "check", "block-effort-wind")
    assert f"flowborne {version}" in flowborne(fresh, tmp_path, "doctor")
    assert not list(tmp_path.iterdir())


def test_the_validation_is_found_when_it_is_installed(
    validation: tuple[Path, Path], fresh: str, tmp_path: Path
) -> None:
    """Without it the command says in one line what to install."""
    with pytest.raises(RuntimeError, match=r"flowborne: validate is a command of .*\n$") as missing:
        flowborne(fresh, tmp_path, "validate")
    assert missing.value.args[0].endswith("with: pip install ./validation\n")
    install(fresh, validation[1], "--no-deps", "--no-index", "--no-compile")
    with pytest.raises(RuntimeError, match="flowborne: --case F0: there is no such case; did you"):
        flowborne(fresh, tmp_path, "validate", "--case", "F0")
    assert "Measure the speed" in flowborne(fresh, tmp_path, "bench", "--help")


@pytest.fixture(scope="module")
def found() -> dict[str, str]:
    """Version of each Python of this machine -> its interpreter."""
    return interpreters()


@pytest.mark.parametrize("version", [v for v in SUPPORTED if v != PRESENT])
def test_the_wheel_suits_other_pythons(
    archives: tuple[Path, Path], found: dict[str, str], tmp_path: Path, version: str
) -> None:
    """It installs, all of it compiles without a warning, and its first module says the version."""
    if version not in found:
        pytest.skip(f"this machine has no Python {version}")
    python = environment(found[version], tmp_path / "environment")
    install(python, archives[1], "--no-deps", "--no-index", "--no-compile")
    (package,) = (tmp_path / "environment").rglob("site-packages/flowborne")
    compiling = [python, "-W", "error", "-m", "compileall", "-q", str(package)]
    done = subprocess.run(compiling, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    telling = [python, "-I", "-c", "import flowborne; print(flowborne.__version__)"]
    told = subprocess.run(telling, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert told.stdout.strip() == archives[1].name.split("-")[1]

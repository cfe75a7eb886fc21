"""MuJoCo's equations of a step hold here, and a version with others is refused at import."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import mujoco
import pytest

from flowborne.base.errors import SceneError
from flowborne.solids import engine


def test_both_identities_hold_to_rounding() -> None:
    assert engine.identity_error() < 1e-13


def test_a_new_version_that_keeps_them_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mujoco, "__version__", "4.7.0")
    engine.check_engine()


def without_springs(*given: object) -> None:
    """In place of `add_springs`: as in a version that treats springs in another way."""


def test_a_new_version_with_other_equations_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mujoco, "__version__", "4.7.0")
    monkeypatch.setattr(engine, "add_springs", without_springs)
    with pytest.raises(SceneError, match=r"^MuJoCo 4\.7\.0 solves other .* off by .*4\.0\.1'\.$"):
        engine.check_engine()


def test_a_new_version_without_an_array_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def gone(*given: object) -> None:
        raise AttributeError("'MjData' object has no attribute 'efm_ts'")

    monkeypatch.setattr(mujoco, "__version__", "4.7.0")
    monkeypatch.setattr(engine, "add_springs", gone)
    with pytest.raises(SceneError, match=r"no attribute 'efm_ts'"):
        engine.check_engine()


def test_a_known_version_is_not_tested_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mujoco, "__version__", engine.KNOWN[-1])
    monkeypatch.setattr(engine, "add_springs", without_springs)
    engine.check_engine()


@pytest.mark.parametrize("arguments", [("check", "eel"), ("doctor",)])
def test_a_mujoco_that_cannot_be_imported_is_a_message(
    tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    """As where `mujoco` was uninstalled beside `mujoco-core`, or has another version."""
    (tmp_path / "mujoco").mkdir()
    (tmp_path / "mujoco/__init__.py").write_text("raise ImportError('Version mismatch between')\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from flowborne.cli.main import main"
    call = [sys.executable, "-c", f"{code}; main({[*arguments]})"]
    done = subprocess.run(call, capture_output=True, text=True)
    assert done.returncode in (1, 2)
    said = done.stdout + done.stderr
    assert "MuJoCo cannot be imported (Version mismatch between)" in said
    assert "pip uninstall --yes mujoco mujoco-core" in said
    assert "Traceback" not in said
    assert "fault of flowborne" not in said

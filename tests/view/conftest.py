"""Run folders made by hand, for the tests of this folder."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def synthetic() -> ModuleType:
    """The module beside this file that writes run folders."""
    place = Path(__file__).with_name("synthetic.py")
    spec = importlib.util.spec_from_file_location("synthetic", place)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def write_run(synthetic: ModuleType, tmp_path: Path) -> Callable[..., Path]:
    """Writes a run folder; options as those of `synthetic.write_run`."""

    def write(**options: object) -> Path:
        folder: Path = synthetic.write_run(tmp_path / "run", **options)
        return folder

    return write

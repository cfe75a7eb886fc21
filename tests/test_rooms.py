"""Who may import whom."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import flowborne

SOURCE = Path(flowborne.__file__).parent

BELOW = {
    "kernels": set(),
    "solvers": {"kernels"},
    "fluid": {"kernels", "solvers"},
    "coupling": {"kernels", "solvers", "fluid", "solids"},
}
"""Rooms that each of these may import from, besides itself; single modules are free."""


def imported(path: Path) -> set[str]:
    """Full names of the modules that a file imports, wherever in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("room", BELOW)
def test_imports_run_downward(room: str) -> None:
    rooms = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    for path in (SOURCE / room).rglob("*.py"):
        ours = {name.split(".")[1] for name in imported(path) if name.startswith("flowborne.")}
        assert ours & rooms <= BELOW[room] | {room}, path


def test_kernels_and_solvers_import_nothing_else_of_ours() -> None:
    for room in ("kernels", "solvers"):
        for path in (SOURCE / room).rglob("*.py"):
            ours = {name.split(".")[1] for name in imported(path) if name.startswith("flowborne")}
            assert ours <= {"kernels", room}, path


def test_numba_is_imported_by_kernels_alone() -> None:
    for path in SOURCE.rglob("*.py"):
        uses = any(name.split(".")[0] == "numba" for name in imported(path))
        assert not uses or path.is_relative_to(SOURCE / "kernels"), path

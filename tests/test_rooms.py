"""Who may import whom."""

from __future__ import annotations

from pathlib import Path

import pytest

import flowborne
from imports import PAGE, in_order, of_modules, of_rooms, page, room_of

SOURCE = Path(flowborne.__file__).parent
ROOMS = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
MODULES = of_modules()

BELOW = {
    "base": set(),
    "kernels": set(),
    "solvers": {"kernels"},
    "fluid": {"base", "kernels", "solvers"},
    "shapes": {"base", "kernels"},
    "solids": {"base", "kernels", "solvers", "shapes"},
    "coupling": {"base", "kernels", "solvers", "fluid", "shapes", "solids"},
    "motion": {"base", "kernels", "shapes", "solids"},
    "runs": {"base", "kernels", "fluid", "shapes", "solids", "coupling"},
}
"""Rooms that each of these may import from, besides itself; single modules are free."""


def crossings(room: str) -> set[tuple[str, str]]:
    """(module of the room, module of ours elsewhere that it imports)."""
    return {
        (module, other)
        for module, others in MODULES.items()
        if room_of(module) == room
        for other in others
        if room_of(other) not in (None, room)
    }


def test_no_circle_between_modules() -> None:
    assert len(in_order(MODULES)) > 200


def test_no_circle_between_rooms() -> None:
    assert set(in_order(of_rooms(MODULES))) > ROOMS


def test_picture_is_of_today() -> None:
    assert PAGE.read_text() == page(MODULES), "docs/imports.md is out of date: run `make imports`"


@pytest.mark.parametrize("room", BELOW)
def test_imports_run_downward(room: str) -> None:
    barred = ROOMS - BELOW[room]
    assert not [(ours, other) for ours, other in crossings(room) if room_of(other) in barred]


def test_kernels_and_solvers_import_nothing_else_of_ours() -> None:
    assert not crossings("kernels")
    assert not [
        (ours, other) for ours, other in crossings("solvers") if room_of(other) != "kernels"
    ]


@pytest.mark.parametrize(("package", "room"), [("numba", "kernels"), ("mujoco", "solids")])
def test_only_one_room_imports(package: str, room: str) -> None:
    users = {module for module, others in MODULES.items() if package in others}
    assert {room_of(module) for module in users} == {room}

"""A world that is turned by a right angle or mirrored takes the same steps, turned or mirrored."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne import step
from flowborne_validation.worlds import start_at_once

from .worlds import (
    DT,
    MIRRORS,
    QUARTER,
    SAME,
    SPEED,
    UNSHRUNK,
    Case,
    H,
    Piece,
    Turn,
    cases,
    turned_faces,
)

STEPS = 3
TOLERANCE = 1e-11
"""Of the pressure; small control volumes make up to ten thousand times as much of velocities."""

FLOW, FORCE = 1e-6, 1e-4
"""Bounds of an asymmetry of the flow, relative to the speed, and of the forces on bodies, relative
to the largest of them."""


def asymmetry(case: Case, turn: Turn) -> tuple[float, float]:
    """Largest differences of flow and forces between a world, turned, and the turned world."""
    worlds = [case.world(other, tolerance=TOLERANCE) for other in (SAME, turn)]
    for world in worlds:
        start_at_once(world, 1e-6)
    flow = force = 0.0
    for _ in range(STEPS):
        first, second = (step(world, DT) for world in worlds)
        flows = [world.flow()[1].velocity for world in worlds]
        for axis, values in turned_faces(list(flows[0]), turn).items():
            flow = max(flow, float(np.abs(flows[1][axis] - values).max()) / SPEED)
        forces = first.pressure_wrench[:, :3] @ turn.T
        apart = float(np.abs(second.pressure_wrench[:, :3] - forces).max())
        force = max(force, apart / max(float(np.abs(forces).max()), SPEED**2))
    return flow, force


@pytest.mark.parametrize("turn", [*MIRRORS.values(), QUARTER], ids=["x", "y", "z", "quarter"])
@settings(max_examples=10, phases=UNSHRUNK)
@given(data=st.data())
def test_a_room_turned(turn: Turn, data: st.DataObject) -> None:
    flow, force = asymmetry(data.draw(cases(slab=False)), turn)
    assert flow < FLOW
    assert force < FORCE


@pytest.mark.parametrize("turn", [MIRRORS[0], MIRRORS[1], QUARTER], ids=["x", "y", "quarter"])
@settings(max_examples=25, phases=UNSHRUNK)
@given(data=st.data())
def test_a_slab_turned(turn: Turn, data: st.DataObject) -> None:
    flow, force = asymmetry(data.draw(cases(slab=True)), turn)
    assert flow < FLOW
    assert force < FORCE


def test_cells_that_a_body_covers_mirrored() -> None:
    """What the leak-proof solve leaves in them, 1e-13 of a cell, decides nothing."""
    ball = Piece(
        kind="sphere",
        size=np.full(3, 0.17263271),
        place=np.array([0.0054625, 0.0088875, 0.0696625]),
        turn=np.array([0.82168163, 0.30980136, 0.05842156, 0.47481505]),
        joint="ball",
        axis=np.array([-1.0, 0.0, 1.0]),
    )
    capsule = Piece(
        kind="capsule",
        size=np.array([0.1475, 0.16103772, 0.075]),
        place=np.array([0.032775, 0.0266625, 0.0839875]),
        turn=np.array([0.99491496, 0.04347778, 0.07073845, 0.05700863]),
        joint="slide",
        axis=np.array([0.0, -1.0, 1.0]),
    )
    case = Case((11, 8, 9), ("no-slip", "open", "far"), (ball, capsule), 0.1, 0.001, 8373)
    flow, force = asymmetry(case, MIRRORS[2])
    assert flow < FLOW
    assert force < FORCE


def test_edges_of_two_boxes_mirrored() -> None:
    """Those that go through two opposite faces of a cell are not one edge."""
    places = np.array([[0.01848, -0.17861, 0.19466], [-0.11407, -0.06203, 0.20183]])
    pieces = tuple(
        Piece(
            kind="box",
            size=np.array([0.1235, 0.0867, 0.10388]),
            place=place,
            turn=np.array([0.6973, -0.6279, 0.2701, 0.2157]),
            joint=joint,
            axis=np.array([0.0, 1.0, 1.0]),
        )
        for place, joint in zip(places, ("ball", "none"), strict=True)
    )
    case = Case((10, 11, 11), ("closed", "closed", "closed"), pieces, 1.0, 0.001, 3671)
    flow, force = asymmetry(case, MIRRORS[2])
    assert flow < FLOW
    assert force < FORCE


def test_a_disc_in_the_middle_of_two_cells_mirrored() -> None:
    disc = Piece(
        kind="cylinder",
        size=0.95 * H * np.ones(3),
        place=H * np.array([1.5, 0.1, 0.0]),
        turn=np.array([1.0, 0.0, 0.0, 0.0]),
        joint="none",
        axis=np.array([0.0, 0.0, 1.0]),
    )
    case = Case((11, 13, 1), ("closed", "closed", "closed"), (disc,), 1.0, 0.0, 347)
    flow, _ = asymmetry(case, MIRRORS[0])
    assert flow < FLOW

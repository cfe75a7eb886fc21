"""The built-in vehicle holds its place in a current by its own thrusters."""

from __future__ import annotations

import numpy as np
import pytest

import flowborne as fb
from flowborne.parts import keep_station
from flowborne.sim.simulation import Simulation

PLACE = np.array([0.0, 0.0, -0.03])
GAINS = {"stiffness": 800.0, "damping": 300.0, "turn_stiffness": 20.0, "turn_damping": 8.0}


def test_the_vehicle_holds_its_place_in_half_its_top_speed() -> None:
    """Its thrusts are the drag in the mean, by which the PD law is off, and its jets are in the
    balance of momentum."""
    rows, centres = [], []
    with Simulation("rov", workers=1) as simulation:
        for _ in range(150):
            simulation.advance_frame()
            rows.append(simulation.measure())
            centres.append(simulation.body("hull").centre)
    late = {name: np.array([row[name] for row in rows[100:]]) for name in rows[0]}
    off = np.array(centres) - PLACE
    assert np.linalg.norm(off, axis=1).max() < 0.05
    drag = late["drag_N"].mean()
    assert drag > 5.0
    assert late["applied_force_hull_x_N"].mean() == pytest.approx(-drag, rel=0.15)
    assert off[100:, 0].mean() == pytest.approx(drag / GAINS["stiffness"], rel=0.25)
    assert max(row["momentum_budget_error"] for row in rows) < 1e-10
    assert (late["thrust_front_left_N"] < 0.0).all()
    assert (late["jet_power_front_left_W"] > 0.0).all()


def test_it_goes_back_to_its_place_and_heading() -> None:
    """Set off by 10 cm and 20 degrees in water at rest."""
    half = np.radians(10.0)
    start = [0.1, 0.0, 0.0, float(np.cos(half)), 0.0, 0.0, float(np.sin(half))]
    still = {f"boundaries.{axis}_{end}": '"far"' for axis in "xyz" for end in ("min", "max")}
    scene = fb.load_scene("rov", {"initial.positions.free": str(start), **still})
    with Simulation(scene, workers=1) as simulation:
        for _ in range(90):
            simulation.advance_frame()
        state = simulation.body("hull")
        told = keep_station(simulation, "hull", PLACE, **GAINS)
    assert np.linalg.norm(state.centre - PLACE) < 0.01
    assert abs(np.degrees(np.arctan2(state.rotation[1, 0], state.rotation[0, 0]))) < 2.0
    assert max(abs(control.value) for control in told.values()) < 1.0


def test_thrusts_are_those_of_the_law() -> None:
    """The least thrusts with its sum, whatever the heading; a propeller is told its speed."""
    with Simulation("rov", workers=1) as simulation:
        told = keep_station(simulation, "hull", PLACE + np.array([0.1, 0.0, 0.0]), **GAINS)
        turned = keep_station(simulation, "hull", PLACE, 90.0, **GAINS)
        own = simulation.setup.thrusters
        with pytest.raises(ValueError, match="body 'world' has no thrusters"):
            keep_station(simulation, "world", PLACE, **GAINS)
    along = sum(told[t.name].value * np.array(t.axis) for t in own)
    assert along == pytest.approx([80.0, 0.0, 0.0], abs=1e-9)
    arms = sum(turned[t.name].value * np.cross(np.array(t.position) - PLACE, t.axis) for t in own)
    assert arms == pytest.approx([0.0, 0.0, 20.0], abs=1e-9)  # the sine of the turn

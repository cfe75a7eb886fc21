"""Station keeping: a vehicle holds its place by its thrusters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from flowborne.control.commands import Control
from flowborne.coupling.world import Setup
from flowborne.solids.sensed import BodyState


class Sensing(Protocol):
    """What a policy knows of a Simulation here."""

    @property
    def setup(self) -> Setup: ...

    def body(self, name: str) -> BodyState: ...


def keep_station(
    simulation: Sensing,
    body: str,
    place: Sequence[float],
    heading: float = 0.0,
    *,
    stiffness: float,
    damping: float,
    turn_stiffness: float,
    turn_damping: float,
) -> dict[str, Control]:
    """Thrusts of the thrusters of a body that bring it upright to a place, for `[policy]`.

    A PD law gives force and torque, f = k (place - x) - d v and the same of turns, and the
    pseudo-inverse of the thrusters' arms the least thrusts that have this sum. A thruster with a
    coefficient is told the speed of its thrust. Under a steady load F it stays F / k off.

    place           of the body's centre of mass, m
    heading         turn about z, degrees
    stiffness       k, N/m
    damping         d, N s/m
    turn_stiffness  N m/rad
    turn_damping    N m s/rad
    raises          ValueError for an unknown body and one without thrusters
    """
    setup, state = simulation.setup, simulation.body(body)
    number, turn = setup.solid.body(body), state.rotation
    own = [thruster for thruster in setup.thrusters if thruster.body == number]
    if not own:
        raise ValueError(f"body '{body}' has no thrusters: give it some as [[thruster]]")
    velocity, spin = np.nan_to_num(state.velocity), np.nan_to_num(state.angular_velocity)
    c, s = np.cos(np.radians(heading)), np.sin(np.radians(heading))
    goal = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    away = 0.5 * np.cross(turn, goal, axis=0).sum(axis=1)  # sine of the turn, along its axis
    force = stiffness * (np.asarray(place) - state.centre) - damping * velocity
    wrench = np.append(turn.T @ force, turn.T @ (turn_stiffness * away - turn_damping * spin))
    axes = np.array([thruster.axis for thruster in own])
    arms = np.array([thruster.position for thruster in own]) + turn.T @ (
        state.position - state.centre
    )
    thrusts = np.linalg.pinv(np.hstack([axes, np.cross(arms, axes)]).T) @ wrench
    fluid = setup.fluid
    assert fluid is not None
    return {
        thruster.name: Control(thruster.setting_of(thrust, fluid.density, fluid.grid.is_slab))
        for thruster, thrust in zip(own, thrusts.tolist(), strict=True)
    }

"""Forces as the time step gets shorter."""

from __future__ import annotations

import numpy as np

from flowborne import Grid, Simulation, load_scene
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    advance,
    make_world,
    set_velocity,
)
from flowborne_validation.controller_in_flow import hold_all
from flowborne_validation.shedding import cylinder
from flowborne_validation.worlds import Uniform


def drag(steps: int) -> float:
    """N, on a cylinder askew in its cells, after two times D/U in so many steps."""
    stream = Uniform((1.0, 0.0, 0.0))
    world = make_world(
        cylinder(1.0, 0.031, 0.017),
        Grid.slab(48, 32, 1.0 / 8.0, (-2.0, -2.0)),
        viscosity=0.02,
        boundaries=Boundaries(BoundaryInflow(stream), BoundaryOpen()),
    )
    set_velocity(world, stream)
    report = advance(world, 2.0 / steps, steps)
    return float((report.pressure_wrench + report.viscous_wrench)[1, 0])


def test_drag_converges_as_steps_are_halved() -> None:
    """Mixing small control volumes as often as there are steps would let it grow without end."""
    changes = np.abs(np.diff([drag(n) for n in (64, 128, 256)]))
    assert changes[1] < 0.6 * changes[0]


def fastest(steps: int) -> float:
    """m/s in a second, the mean over frames, of an ideal stream of 1 m/s past a block across it,
    with so many steps a frame."""
    settings = {"initial.positions.hinge": "0", "domain.resolution": "128"}
    world = Simulation(load_scene("ns-block-drag-max", settings)).world
    speeds = [
        advance(world, 1.0 / 24 / steps, command=hold_all(1)).fastest for _ in range(24 * steps)
    ]
    return float(np.reshape(speeds, (24, steps)).max(axis=1).mean())


def test_jets_on_small_faces_do_not_grow_as_steps_are_halved() -> None:
    """Eddies of two cells made beside a body stay there where nothing damps them: with four steps a
    frame the fluid was twice as fast as with one."""
    assert fastest(4) < 1.5 * fastest(1)

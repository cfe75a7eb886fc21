"""What bodies gain in a coupled step is what the fluid and the walls lose."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flowborne import Array, Grid, Simulation, World, load_scene, step
from flowborne.bodies import TrajectorySinusoid, momentum
from flowborne.coupling.cut import volumes_of
from flowborne.fluid.control_volumes import face_masses, fluid_momentum
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    advance,
    cut_by_bodies,
    make_world,
    set_velocity,
)
from flowborne_validation.worlds import RING, mjcf

SQUARE = Grid.slab(32, 32, 1.0 / 32, (0.0, 0.0))
CUBE = Grid((16, 16, 16), 1.0 / 16, (0.0, 0.0, 0.0))

DISC = '<body name="disc{n}" pos="{x} {y} 0"><freejoint/><geom type="sphere" size="{size}"/></body>'
CHAIN = """
<body name="a" pos="0.3 0.45 0"><freejoint/>
  <geom type="box" size="0.1 0.03 0.1"/>
  <body name="b" pos="0.1 0 0"><joint type="hinge" axis="0 0 1"/>
    <geom type="box" size="0.1 0.03 0.1" pos="0.1 0 0"/>
    <body name="c" pos="0.2 0 0"><joint type="hinge" axis="0 0 1"/>
      <geom type="box" size="0.08 0.03 0.1" pos="0.08 0 0"/>
    </body>
  </body>
</body>"""
PADDLE = """
<body name="paddle" pos="0.4 0.5 0"><joint name="turn" type="hinge" axis="0 0 1"/>
  <geom type="box" size="0.12 0.04 0.1" pos="0.12 0 0"/></body>"""
BALL = '<body name="ball" pos="0.4 0.55 0.45"><freejoint/><geom type="sphere" size="0.2"/></body>'


def swirl(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Vortices in the unit box, unequal in x and y, that no wall cuts."""
    u = np.sin(np.pi * x) * np.cos(np.pi * y) + 0.5 * np.sin(2 * np.pi * x) * np.cos(np.pi * y)
    v = -np.cos(np.pi * x) * np.sin(np.pi * y) - np.cos(2 * np.pi * x) * np.sin(np.pi * y)
    return u, v, 0.0 * z


def paddling(**options: object) -> World:
    turn = TrajectorySinusoid(np.array([0]), 0.6, 0.7)
    return make_world(mjcf(PADDLE), SQUARE, solid_density=2.0, motions=(turn,), **options)


def of_discs(*density_and_place: tuple[float, float], density: float, **options: object) -> World:
    discs = [DISC.format(n=n, x=x, y=y, size=0.11) for n, (x, y) in enumerate(density_and_place)]
    return make_world(mjcf(*discs), SQUARE, solid_density=density, **options)


def channel() -> Boundaries:
    def profile(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
        return 0.5 + 0 * x, 0 * x, 0 * x

    return Boundaries(x_min=BoundaryInflow(profile), x_max=BoundaryOpen())


WORLDS: dict[str, Callable[[], World]] = {
    "free disc": lambda: of_discs((0.37, 0.44), density=0.5),
    "light disc": lambda: of_discs((0.37, 0.44), density=0.01),
    "free disc, viscous": lambda: of_discs((0.37, 0.44), density=0.5, viscosity=0.01),
    "free disc in a ring": lambda: of_discs((0.37, 0.44), density=0.5, boundaries=RING),
    "free disc in a channel": lambda: of_discs((0.37, 0.44), density=0.5, boundaries=channel()),
    "two discs": lambda: of_discs((0.37, 0.44), (0.6, 0.5), density=1.5),
    "two discs that touch": lambda: of_discs((0.37, 0.44), (0.59, 0.44), density=1.5),
    "chain": lambda: make_world(mjcf(CHAIN), SQUARE, solid_density=1.2),
    "chain that falls": lambda: make_world(
        mjcf(CHAIN), SQUARE, solid_density=1.2, gravity=(0.0, -1.0, 0.0)
    ),
    "prescribed paddle": paddling,
    "prescribed paddle, viscous": lambda: paddling(viscosity=0.02),
    "sphere": lambda: make_world(mjcf(BALL), CUBE, solid_density=0.3),
}


def momentum_of(world: World) -> Array:
    """(3,) of the fluid, N s."""
    fluid, state = world.flow()
    mass = face_masses(volumes_of(world, cut_by_bodies(world)), fluid.density)
    return fluid_momentum(state.velocity, mass, fluid.grid, fluid.boundaries)


@pytest.mark.parametrize("name", WORLDS)
def test_bodies_gain_what_fluid_and_walls_lose(name: str) -> None:
    world = WORLDS[name]()
    set_velocity(world, swirl)
    for _ in range(12):
        report = step(world, 1.0 / 64)
        assert report.outcome.name == "DONE"
        assert np.linalg.norm(report.momentum_exchanged) > 1e-6
        assert report.momentum_exchange_error < 1e-10


@pytest.mark.parametrize(
    "name", ["free disc", "light disc", "free disc in a ring", "two discs", "sphere"]
)
def test_free_bodies_gain_the_impulse_that_is_reported(name: str) -> None:
    """Mass times change of velocity, against the pressure's wrench, body by body."""
    world = WORLDS[name]()
    set_velocity(world, swirl)
    mass = world.setup.solid.body_mass[1:, None]
    for _ in range(6):
        before = world.solid.v.reshape(-1, 6)[:, :3].copy()
        report = step(world, 1.0 / 64)
        gained = mass * (world.solid.v.reshape(-1, 6)[:, :3] - before)
        impulse = report.dt * report.pressure_wrench[1:, :3]
        scale = np.abs(impulse).max()
        np.testing.assert_allclose(gained, impulse, atol=1e-11 * scale)
        np.testing.assert_allclose(report.momentum_exchanged, gained.sum(axis=0), atol=1e-11)
        np.testing.assert_allclose(
            report.momentum_solid, momentum(world.setup.solid, world.solid)[0], rtol=1e-12
        )


@pytest.mark.parametrize(
    "name", ["free disc", "free disc in a ring", "two discs", "prescribed paddle", "sphere"]
)
def test_the_fluids_budget_closes(name: str) -> None:
    """Momentum of the fluid changes by walls and bodies, and nothing else."""
    world = WORLDS[name]()
    set_velocity(world, swirl)
    last = momentum_of(world)
    for _ in range(6):
        report = step(world, 1.0 / 64)
        now = momentum_of(world)
        assert not report.momentum_advection.any()
        assert not report.momentum_forces.any()
        change = report.momentum_boundary - report.momentum_exchanged
        np.testing.assert_allclose(now - last, change, atol=1e-13)
        np.testing.assert_allclose(now, report.momentum_fluid, atol=1e-13)
        last = now


def test_without_walls_nothing_is_lost() -> None:
    """Fluid and disc together drift on as they did, however the flow goes around the disc."""
    world, dt = WORLDS["free disc in a ring"](), 1.0 / 64
    set_velocity(world, swirl)
    solid = world.setup.solid
    advance(world, dt)
    whole = momentum_of(world) + momentum(solid, world.solid)[0]
    assert np.abs(whole[:2]).min() > 1e-6
    for _ in range(8):
        report = advance(world, dt)
        assert not report.momentum_boundary.any()
        later = momentum_of(world) + momentum(solid, world.solid)[0]
        np.testing.assert_allclose(later, whole, atol=1e-14)


def test_a_world_in_balance_has_no_exchange_error() -> None:
    """By symmetry nothing is given to the disc: rounding is no error."""
    world = of_discs((0.5, 0.5), density=0.5)

    def vortex(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        u = np.sin(np.pi * x) * np.cos(np.pi * y)
        return u, -np.cos(np.pi * x) * np.sin(np.pi * y), 0.0 * z

    set_velocity(world, vortex)
    for _ in range(5):
        report = advance(world, 1.0 / 64)
        assert np.abs(report.momentum_exchanged).max() < 1e-14
        assert report.momentum_exchange_error < 1e-10


def test_the_budget_of_a_flow_closes() -> None:
    """What the fluid gains is what came through the sides, by forces, from bodies and advection."""
    for settings in ({}, {"fluid.viscosity": "2.0", "fluid.body_force": "[0.1, -0.2]"}):
        scene = load_scene("ns-block-drag-max", {"domain.resolution": "24", **settings})
        with Simulation(scene, workers=1) as simulation:
            for _ in range(6):
                report = simulation.advance_frame().step
                assert report.momentum_budget_error < 1e-10
            assert np.linalg.norm(report.momentum_exchanged) > 1.0
            assert (np.linalg.norm(report.momentum_forces) > 0.0) == bool(settings)
            row = simulation.measure()
    assert row["momentum_budget_error"] < 1e-10
    assert 0.0 < row["dye_budget_error"] < 1e-12
    assert row["momentum_forces_x_Ns"] == pytest.approx(report.momentum_forces[0])

"""Momentum in flux form, through whole steps: uniform flow, budget, energy, saved states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from flowborne import (
    Array,
    Fluid,
    Grid,
    Outcome,
    Setup,
    SolidModel,
    StepReport,
    Tissue,
    World,
    step,
)
from flowborne.bodies import JointCommand, TrajectorySinusoid, kinetic_energy
from flowborne.coupling.bodies_step import move_bodies
from flowborne.coupling.cut import departure, volumes_of
from flowborne.coupling.flow import advect, leak_proof_transport
from flowborne.coupling.mouths import Mouth
from flowborne.fluid import control_volumes as of_fluid
from flowborne.fluid.control_volumes import face_masses
from flowborne.motion.inflow import FactorSteady
from flowborne.solids.tissue.growth import Law, add_flesh
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    Passage,
    cut_by_bodies,
    make_world,
    set_velocity,
)
from flowborne_validation.flesh_bars import bar_mesh
from flowborne_validation.worlds import PERIODIC, RING, mjcf

from ..kernels.references.faces import face_means

SQUARE = Grid.slab(32, 32, 1.0 / 32, (0.0, 0.0))
CUBE = Grid((16, 16, 16), 1.0 / 16, (0.0, 0.0, 0.0))
OPEN = BoundaryOpen()
AROUND = Boundaries(*(PERIODIC,) * 6)
ROUND_AND_THROUGH = Boundaries(y_min=PERIODIC, y_max=PERIODIC, z_max=OPEN)
DT = 1.0 / 64

DISC = '<body pos="{x} 0.44 {z}">{joint}<geom type="sphere" size="{size}"/></body>'
BLOCK = '<body pos="0.37 0.44 {z}"><freejoint/><geom type="box" size="0.17 0.06 0.11"/></body>'
PADDLE = """
<body name="paddle" pos="0.4 0.5 0"><joint name="turn" type="hinge" axis="0 0 1"/>
  <geom type="box" size="0.12 0.04 0.1" pos="0.12 0 0"/></body>"""


def swirl(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Vortices in the unit box, unequal in x and y, that no wall cuts."""
    u = np.sin(np.pi * x) * np.cos(np.pi * y) + 0.5 * np.sin(2 * np.pi * x) * np.cos(np.pi * y)
    v = -np.cos(np.pi * x) * np.sin(np.pi * y) - np.cos(2 * np.pi * x) * np.sin(np.pi * y)
    return u, v, 0.0 * z


def stream(x: Array, y: Array, z: Array, time: float = 0.0) -> tuple[Array, Array, Array]:
    return 0.7 + 0 * x, 0 * x, 0 * x


CHANNEL = Boundaries(BoundaryInflow(stream), OPEN)


def disc(grid: Grid, x: float = 0.37, size: float = 0.15, held: bool = False) -> str:
    """A disc in the plane of a slab, or a ball in a room."""
    joint = "" if held else "<freejoint/>"
    return DISC.format(x=x, z=0.0 if grid.is_slab else 0.55, joint=joint, size=size)


def free(grid: Grid, sides: Boundaries | None = None, density: float = 0.5) -> World:
    body = mjcf(disc(grid))
    return swirling(make_world(body, grid, solid_density=density, boundaries=sides or Boundaries()))


def swirling(world: World) -> World:
    set_velocity(world, swirl)
    return world


def paddling() -> World:
    turn = TrajectorySinusoid(np.array([0]), 0.6, 0.7)
    return swirling(make_world(mjcf(PADDLE), SQUARE, solid_density=2.0, motions=(turn,)))


def channel(grid: Grid, viscosity: float = 0.0) -> World:
    """A held disc or ball in a stream."""
    body = mjcf(disc(grid, held=True))
    world = make_world(body, grid, boundaries=CHANNEL, viscosity=viscosity)
    set_velocity(world, stream)
    return world


def mouthed(grid: Grid, rate: float, held: bool) -> World:
    """A disc or ball with a mouth, askew, in still and open surroundings."""
    body = mjcf(disc(grid, held=held))
    sides = Boundaries(*(OPEN,) * (4 if grid.is_slab else 6))
    world = make_world(body, grid, solid_density=3.0, boundaries=sides)
    x, y = np.cos(0.7), np.sin(0.7)
    place = (0.15 * x, 0.15 * y, 0.0)
    mouth = Mouth("the mouth", 1, place, (x, y, 0.0), 0.08, rate, FactorSteady())
    return World.at_rest(replace(world.setup, mouths=(mouth,)))


def fleshy() -> World:
    """A soft cube of flesh, half as dense as the swirling fluid around it."""
    points, elements = bar_mesh((4, 4, 4), (0.35, 0.35, 0.35))
    points += np.array([0.42, 0.46, 0.52]) - points.mean(axis=0)
    spec = mujoco.MjSpec()
    tissue = Tissue(2e3, 0.3, 500.0, damping=0.02, law=Law.STABLE_NEO_HOOKEAN)
    grown = add_flesh(spec, "cube", points, elements, tissue, [""] * len(points))
    model = SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.0, 0.0))
    return swirling(World.at_rest(Setup(model, Fluid(CUBE, 1000.0))))


WORLDS: dict[str, Callable[[], World]] = {
    "free disc": lambda: free(SQUARE),
    "free disc in a ring": lambda: free(SQUARE, RING),
    "free disc in a ring between open sides": lambda: free(
        SQUARE, Boundaries(PERIODIC, PERIODIC, OPEN, OPEN)
    ),
    "sphere in a room": lambda: free(CUBE),
    "sphere in a room without sides": lambda: free(CUBE, AROUND),
    "prescribed paddle": paddling,
    "held disc in a channel": lambda: channel(SQUARE),
    "held disc in a channel, viscous": lambda: channel(SQUARE, 0.01),
    "held sphere in a channel": lambda: channel(CUBE),
    "mouth that expels": lambda: mouthed(SQUARE, 0.1, held=True),
    "mouth that drinks": lambda: mouthed(SQUARE, -0.1, held=True),
    "free mouth that expels": lambda: mouthed(SQUARE, 0.1, held=False),
    "free mouth that drinks": lambda: mouthed(SQUARE, -0.1, held=False),
    "free mouth in a room that expels": lambda: mouthed(CUBE, 0.02, held=False),
    "free mouth in a room that drinks": lambda: mouthed(CUBE, -0.02, held=False),
    "flesh": fleshy,
}
EACH = pytest.mark.parametrize("name", WORLDS)


def taken(world: World, dt: float = DT) -> StepReport:
    report = step(world, dt)
    assert report.outcome is Outcome.DONE, f"step {world.steps}"
    return report


@pytest.mark.parametrize("sides", ["ring", "channel"])
@pytest.mark.parametrize("grid", [SQUARE, CUBE], ids=["slab", "room"])
@pytest.mark.parametrize("shape", ["round", "block"])
def test_a_stream_past_a_body_that_goes_with_it_stays_uniform(
    shape: str, grid: Grid, sides: str
) -> None:
    """While the body turns about, as fast as a cell in a step at its ends."""
    speed = np.array([0.7, -0.3 if sides == "ring" else 0.0, 0.0 if grid.is_slab else 0.2])
    turn = [0.0, 0.0, 2.0] if grid.is_slab else [1.1, -0.8, 1.7]
    if sides == "channel":
        speed[2] = 0.0
    around = RING if grid.is_slab else AROUND
    body = disc(grid) if shape == "round" else BLOCK.format(z=0.0 if grid.is_slab else 0.55)
    world = make_world(mjcf(body), grid, boundaries=around if sides == "ring" else CHANNEL)
    world.solid.v[:] = [*speed, *turn]
    fluid, state = world.flow()
    for _ in range(15):
        set_velocity(world, lambda x, y, z: tuple(0 * x + component for component in speed))
        start = departure(world)
        move_bodies(world, JointCommand.none(6), DT)
        transport = leak_proof_transport(world, start, cut_by_bodies(world), DT)
        advected, _ = advect(world, start, state.velocity, transport)
        for axis in grid.axes:
            volume = face_means(advected.volumes.cells, axis, fluid.boundaries.periodic()[axis])
            holds = volume > 1e-9 * grid.cell_volume
            drift = np.abs(advected.velocity[axis][holds] - speed[axis]).max()
            assert drift < 1e-12, f"{drift} across {axis}"
        state.cell_volume, state.pose = advected.volumes.cells, world.solid.q.copy()


@EACH
def test_the_budget_of_momentum_closes(name: str) -> None:
    """The fluid's changes by what bodies, sides and mouths give, and advection makes none of it."""
    world = WORLDS[name]()
    taken(world)
    for _ in range(10):
        report = taken(world)
        assert not report.momentum_advection.any()
        assert report.momentum_budget_error < 1e-10
        assert np.linalg.norm(report.momentum_exchanged) > 0.0


@pytest.mark.parametrize("name", ["free disc", "sphere in a room", "held disc in a channel"])
def test_the_budget_closes_from_a_flow_that_was_put_in(name: str) -> None:
    """In the first step, in which closed faces do not go with others yet."""
    assert taken(WORLDS[name]()).momentum_budget_error < 1e-10


def energy(world: World) -> float:
    """Kinetic energy of fluid and bodies, J."""
    fluid, state = world.flow()
    mass = face_masses(volumes_of(world, cut_by_bodies(world)), fluid.density)
    moving = of_fluid.kinetic_energy(state.velocity, mass, fluid.grid, fluid.boundaries)
    return moving + kinetic_energy(world.setup.solid, world.solid)


@pytest.mark.parametrize("density", [0.01, 0.5, 2.0])
@pytest.mark.parametrize("shape", ["round", "block"])
@pytest.mark.parametrize("grid", [SQUARE, CUBE], ids=["slab", "room"])
def test_energy_never_grows_in_a_closed_box(grid: Grid, shape: str, density: float) -> None:
    body = disc(grid) if shape == "round" else BLOCK.format(z=0.0 if grid.is_slab else 0.55)
    world = swirling(make_world(mjcf(body), grid, solid_density=density))
    taken(world)
    last = first = energy(world)
    for _ in range(100):
        taken(world)
        now = energy(world)
        assert now <= last * (1.0 + 1e-12), f"step {world.steps}: {now / last - 1.0:.1e} more"
        last = now
    assert last > 0.1 * first


@EACH
def test_a_saved_state_goes_on_to_the_same_bits(name: str) -> None:
    world = WORLDS[name]()
    for _ in range(3):
        taken(world)
    saved = {key: values.copy() for key, values in world.arrays().items()}
    other = World.from_arrays(world.setup, saved)
    for _ in range(3):
        taken(world)
        taken(other)
    for key, values in world.arrays().items():
        np.testing.assert_array_equal(other.arrays()[key], values, err_msg=key)


def with_dye(world: World) -> World:
    """The same with a dye that fills the right half, and one that is everywhere."""
    fluid, state = world.flow()
    fluid = replace(fluid, scalars=("half", "even"))
    x, _, _ = np.meshgrid(*fluid.grid.cell_coordinates(), indexing="ij")
    state.scalars = {"half": (x > 0.45).astype(float), "even": np.full(fluid.grid.shape, 0.7)}
    mouths = [replace(m, scalars={"half": 0.9, "even": 0.7}) for m in world.setup.mouths]
    world.setup = replace(world.setup, fluid=fluid, mouths=tuple(mouths))
    return world


@EACH
def test_dye_keeps_its_amount_and_its_bounds(name: str) -> None:
    world = with_dye(WORLDS[name]())
    for _ in range(12):
        assert taken(world).dye_budget_error < 1e-12
        for values in world.flow()[1].scalars.values():
            assert values.min() >= 0.0
            assert values.max() <= 1.0


@EACH
def test_dye_that_is_everywhere_stays_so(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also without the bounds that would hold it there."""
    monkeypatch.setattr(Passage, "bounds", lambda *_: (-1e9, 1e9))
    world = with_dye(WORLDS[name]())
    fluid, state = world.flow()
    for _ in range(12):
        taken(world)
        filled = state.cell_volume > 1e-6 * fluid.grid.cell_volume
        assert np.abs(state.scalars["even"][filled] - 0.7).max() < 1e-12

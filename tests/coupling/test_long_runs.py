"""Many steps: a body far lighter than the fluid, a plate thinner than a cell, a fast stream."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Array, Grid, Simulation, World, load_scene, step
from flowborne.bodies import TrajectoryConstant, TrajectorySinusoid, kinetic_energy
from flowborne.coupling.cut import volumes_of
from flowborne.coupling.fractions import Geometry
from flowborne.fluid import control_volumes as of_fluid
from flowborne.fluid.control_volumes import face_masses
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    cut_by_bodies,
    make_world,
    set_velocity,
)
from flowborne_validation.worlds import mjcf

from .meshes import Model, meshed_mjcf

STEPS = 1000
CELLS = 32
H = 1.0 / CELLS
SQUEEZED = 9.0
"""Fluid over flow, in speed, between a body and a side that are less than a cell apart."""

SQUARE = Grid.slab(CELLS, CELLS, H, (0.0, 0.0))
OPEN = BoundaryOpen()

DISC = '<body pos="0.35 0.45 0"><freejoint/><geom type="sphere" size="0.12"/></body>'
BLOCK = '<body pos="0.35 0.45 0"><freejoint/><geom type="box" size="0.15 0.05 0.1"/></body>'
FLAG = """<body pos="0.3 0.5 0"><joint type="hinge" axis="0 0 1"/>
  <geom type="box" pos="0.15 0 0" size="0.15 0.04 0.1"/></body>"""


def plate(half_length: float) -> str:
    """A plate of thickness h/4 across the stream, moved along x and turned about its middle."""
    return f"""<body pos="0.5 0.5 0"><joint type="slide" axis="1 0 0"/>
      <joint type="hinge" axis="0 0 1"/>
      <geom type="box" size="{H / 8} {half_length} 0.1"/></body>"""


def swirl(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Vortices in the unit box, unequal in x and y, that no wall cuts."""
    u = np.sin(np.pi * x) * np.cos(np.pi * y) + 0.5 * np.sin(2 * np.pi * x) * np.cos(np.pi * y)
    v = -np.cos(np.pi * x) * np.sin(np.pi * y) - np.cos(2 * np.pi * x) * np.sin(np.pi * y)
    return u, v, 0.0 * z


def stream(x: Array, y: Array, z: Array, time: float = 0.0) -> tuple[Array, Array, Array]:
    return 1.0 + 0.0 * x, 0.0 * x, 0.0 * x


CHANNEL = Boundaries(x_min=BoundaryInflow(stream), x_max=OPEN)


def energy(world: World) -> float:
    """Kinetic energy of fluid and bodies, J per metre of depth."""
    fluid, state = world.flow()
    mass = face_masses(volumes_of(world, cut_by_bodies(world)), fluid.density)
    moving = of_fluid.kinetic_energy(state.velocity, mass, fluid.grid, fluid.boundaries)
    return moving + kinetic_energy(world.setup.solid, world.solid)


def fastest(world: World, cut: Geometry, least_open: float = 0.5) -> float:
    """Largest speed on faces that are open for more than a part, m/s."""
    _, state = world.flow()
    speeds = [
        np.abs(u[o > least_open]).max()
        for u, o in zip(state.velocity, cut.open, strict=True)
        if u[o > least_open].size
    ]
    return float(max(speeds))


@pytest.mark.parametrize(("body", "reach"), [(DISC, 0.12), (BLOCK, 0.158)], ids=["disc", "block"])
def test_a_body_of_a_hundredth_of_the_density_is_carried_for_1000_steps(
    body: str, reach: float
) -> None:
    """Nothing drives the closed box: its energy never grows. A body without mass answers a
    change of the flow with at most twice that change, and is nowhere faster than the flow was.
    In an ideal fluid the sides draw it in: there it squeezes out what is between."""
    world = make_world(mjcf(body), SQUARE, solid_density=0.01)
    set_velocity(world, swirl)
    at_start = energy(world)
    largest = max(float(np.abs(u).max()) for u in world.flow()[1].velocity)
    for number in range(STEPS):
        report = step(world, 1.0 / 64)
        assert report.outcome.name == "DONE", world.steps
        assert report.momentum_exchange_error < 1e-10
        assert np.linalg.norm(world.solid.v[:2]) < largest
        beside = np.abs(world.solid.q[:2] - 0.5).max() > 0.5 - reach - H
        most = SQUEEZED if beside else 1.5
        assert max(float(np.abs(u).max()) for u in world.flow()[1].velocity) < most * largest
        if number % 10 == 0:  # cutting the grid for it takes as long as the step
            assert energy(world) < at_start
    assert np.all(np.abs(world.solid.q[:2] - 0.5) < 0.5), "it is still in the box"
    assert energy(world) > 0.2 * at_start, "and still moves"


def test_a_flag_of_a_hundredth_of_the_density_settles_along_the_stream() -> None:
    """Its tip is never faster than the flow around a blunt body, twice the stream, and it ends
    where a weathercock does."""
    world = make_world(mjcf(FLAG), SQUARE, solid_density=0.01, boundaries=CHANNEL, viscosity=0.005)
    set_velocity(world, stream)
    world.solid.q[0] = 0.5
    angles = []
    for _ in range(STEPS):
        report = step(world, 1.0 / 64)
        assert report.outcome.name == "DONE", world.steps
        assert report.momentum_exchange_error < 1e-10
        assert abs(world.solid.v[0]) * 0.3 < 2.0
        angles.append(float(world.solid.q[0]))
    assert np.abs(angles[STEPS // 2 :]).max() < 0.15
    assert max(float(np.abs(u).max()) for u in world.flow()[1].velocity) < 2.0


def in_plate_frame(world: World, x: Array, y: Array) -> tuple[Array, Array]:
    """Distance across the plate's mid-plane and along it from its middle, m."""
    place, angle = world.solid.q
    dx, dy = x - 0.5 - place, y - 0.5
    return np.cos(angle) * dx + np.sin(angle) * dy, np.cos(angle) * dy - np.sin(angle) * dx


def through_plate(world: World, cut: Geometry, half_length: float) -> tuple[float, float]:
    """Volume per time through the faces between cells on two sides of a plate, relative to it.

    Faces that reach beyond the plate's ends are left out: what passes there goes around the plate.

    returns  what the fluid does, and what an undisturbed stream would do without the plate
    """
    _, state = world.flow()
    move, turn = world.solid.v
    angle = world.solid.q[1]
    cx, cy = np.meshgrid(*SQUARE.cell_coordinates()[:2], indexing="ij")
    across, along = in_plate_frame(world, cx, cy)
    found = silhouette = 0.0
    for axis in (0, 1):
        low, high = np.delete(across, -1, axis), np.delete(across, 0, axis)
        middle = 0.5 * (np.delete(along, -1, axis) + np.delete(along, 0, axis))
        reach = half_length - 0.5 * H * abs((np.cos(angle), np.sin(angle))[axis])
        between = (low * high < 0.0) & (np.abs(middle) < reach)
        inner = [
            np.delete(np.delete(f[axis][:, :, 0], -1, axis), 0, axis)
            for f in (state.velocity, cut.open)
        ]
        x, y, _ = np.meshgrid(*SQUARE.face_coordinates(axis), indexing="ij")
        body = (move - turn * (y - 0.5), turn * (x - 0.5 - world.solid.q[0]))[axis]
        body = np.delete(np.delete(body[:, :, 0], -1, axis), 0, axis)
        sign = np.sign(high - low)[between]
        free = 1.0 if axis == 0 else 0.0
        found += H * float((sign * inner[1][between] * (inner[0] - body)[between]).sum())
        silhouette += H * float((sign * (free - body[between])).sum())
    return found, silhouette


@pytest.mark.parametrize("model", [mjcf, meshed_mjcf], ids=["box", "mesh"])
def test_less_than_a_hundredth_leaks_through_a_thin_plate_in_a_stream(model: Model) -> None:
    """Thickness h/4, moving and turning for 1000 steps."""
    half_length = 0.2
    world = make_world(
        model(plate(half_length)),
        SQUARE,
        boundaries=CHANNEL,
        motions=(
            TrajectorySinusoid(np.array([0]), 0.1, 1.0),
            TrajectoryConstant(np.array([1]), 0.0, 2.0),
        ),
    )
    set_velocity(world, stream)
    leaked = passed = 0.0
    for _ in range(STEPS):
        report = step(world, 1.0 / 128)
        assert report.outcome.name == "DONE", world.steps
        cut = cut_by_bodies(world)
        found, silhouette = through_plate(world, cut, half_length)
        leaked, passed = leaked + abs(found), passed + abs(silhouette)
        assert fastest(world, cut) < 6.0
    assert passed > 0.1 * STEPS * 2.0 * half_length
    assert leaked < 0.01 * passed


def test_a_fast_stream_makes_no_noise_on_the_grid() -> None:
    """Behind a block, where the stream crosses three to five cells in a step, no strong vortex of
    one cell turns against all four beside it."""
    held = '[{kind = "constant", joint = "hinge", position = -5.0}]'
    settings = {"control": "[]", "objectives": "[]", "initial.positions": "{}", "motion": held}
    coarse = {"domain.resolution": "64", "time.frames_per_second": "12"}
    specks, behind = 0, 0.6
    with Simulation(load_scene("ns-block-drag-max", {**settings, **coarse})) as simulation:
        for _ in range(70):
            simulation.advance_frame()
            grid = simulation.world.flow()[0].grid
            u, v = (faces[..., 0] for faces in simulation.world.flow()[1].velocity[:2])
            turning = (np.diff(v, axis=0)[:, 1:-1] - np.diff(u, axis=1)[1:-1]) / grid.spacing
            own = turning[1:-1, 1:-1]
            beside = turning[2:, 1:-1], turning[:-2, 1:-1], turning[1:-1, 2:], turning[1:-1, :-2]
            alone = (np.abs(own) > 5.0) & np.all([own * other < 0.0 for other in beside], axis=0)
            x = grid.origin[0] + grid.spacing * (2.0 + np.arange(len(own)))
            specks += int(alone[x > behind].sum())
    assert specks == 0

"""Dye beside bodies that move: it never crosses them, and does not thin out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flowborne import Array, Faces, Grid, World, step
from flowborne.bodies import TrajectorySinusoid
from flowborne.coupling import flow
from flowborne.coupling.leak_proof import leak_proof_flux
from flowborne.coupling.mouths import Mouth
from flowborne.motion.inflow import FactorSteady
from flowborne.worlds import Boundaries, BoundaryOpen, cut_by_bodies, make_world
from flowborne_validation.worlds import mjcf

from .meshes import Model, meshed_mjcf

CELLS = 32
H = 1.0 / CELLS
SQUARE = Grid.slab(CELLS, CELLS, H, (0.0, 0.0))
ROOM = Grid((16, 16, 4), 1.0 / 16.0, (0.0, 0.0, -0.125))
PLATE = '<geom type="box" size="{thin} {long} 0.2"/>'
MODELS = pytest.mark.parametrize("model", [mjcf, meshed_mjcf], ids=["box", "mesh"])
DISC = '<geom type="sphere" size="0.12"/>'


def moved(
    geom: str,
    shift: float,
    turn: float,
    boundaries: Boundaries | None = None,
    model: Model = mjcf,
    grid: Grid = SQUARE,
) -> World:
    """A body that moves along x and turns, by sinusoids of 1 s and 0.77 s; dye wherever it is."""
    body = f"""<body pos="0.5 0.5 0"><joint type="slide" axis="1 0 0"/>
      <joint type="hinge" axis="0 0 1"/>{geom}</body>"""
    motions = (
        TrajectorySinusoid(np.array([0]), shift, 1.0),
        TrajectorySinusoid(np.array([1]), turn, 0.77),
    )
    return make_world(
        model(body),
        SQUARE,
        boundaries=boundaries or Boundaries(),
        motions=motions,
        scalars=("dye",),
    )


def ahead_of(world: World) -> Array:
    """(nx, ny, 1) distance of the cells' centres in front of the plate's mid-plane, m."""
    x, y, _ = np.meshgrid(*world.flow()[0].grid.cell_coordinates(), indexing="ij")
    place, angle = world.solid.q
    return np.cos(angle) * (x - 0.5 - place) + np.sin(angle) * (y - 0.5)


def outside(world: World) -> Array:
    """(nx, ny) whether a cell's centre is outside the body."""
    d = cut_by_bodies(world).distance[:, :, 0]
    return d[1:, 1:] + d[1:, :-1] + d[:-1, 1:] + d[:-1, :-1] > 0.0


def piston(model: Model, solid: bool = False) -> World:
    """A piston of thickness h/4 that moves and turns between two open sides, dye on its right."""
    sides = Boundaries(x_min=BoundaryOpen(), x_max=BoundaryOpen())
    grid = ROOM if solid else SQUARE
    plate = PLATE.format(thin=grid.spacing / 8, long=0.8)
    world = moved(plate, 0.1, 0.35, sides, model, grid)
    world.flow()[1].scalars["dye"][:] = ahead_of(world) > 0.0
    return world


@pytest.mark.parametrize(
    ("steps", "dt"), [(1000, 1 / 128), (100, 1 / 32)], ids=["0.6 cells a step", "2.4 cells a step"]
)
@MODELS
def test_dye_never_crosses_a_thin_plate_from_wall_to_wall(
    steps: int, dt: float, model: Model
) -> None:
    """But for what is left of the leak-proof solve."""
    world = piston(model)
    _, state = world.flow()
    for _ in range(steps):
        report = step(world, dt)
        assert report.outcome.name == "DONE", world.steps
        amount = state.cell_volume * state.scalars["dye"]
        assert amount[ahead_of(world) < 0.0].sum() < 1e-6 * amount.sum(), world.steps
        opened = cut_by_bodies(world).open
        for u, o in zip(state.velocity[:2], opened[:2], strict=True):
            assert np.abs(u[o > 0.5]).max() < 15.0, world.steps
    assert state.scalars["dye"][ahead_of(world) > 2.0 * H].mean() > 0.95


@MODELS
@pytest.mark.parametrize("solid", [False, True], ids=["slab", "room"])
def test_no_fluid_crosses_a_thin_plate_from_wall_to_wall(
    monkeypatch: pytest.MonkeyPatch, model: Model, solid: bool
) -> None:
    """What is before it changes by what leaves through the side there."""
    kept = {}

    def remembered(*given: object) -> tuple[Faces, Array]:
        kept["flux"], kept["cells"] = leak_proof_flux(*given)
        return kept["flux"], kept["cells"]

    monkeypatch.setattr(flow, "leak_proof_flux", remembered)
    world, dt = piston(model, solid), 1 / 128
    volume = world.flow()[0].grid.cell_volume
    step(world, dt)
    for _ in range(60):
        there = kept["cells"][ahead_of(world) > 0.0].sum()
        step(world, dt)
        left = there - kept["cells"][ahead_of(world) > 0.0].sum()
        assert abs(left - dt * kept["flux"][0][-1].sum()) < 1e-8 * volume, world.steps


@pytest.mark.parametrize(
    ("geom", "turn"),
    [
        (DISC, 0.0),
        (PLATE.format(thin=0.1, long=0.2), 0.7),
        (PLATE.format(thin=H / 8, long=0.2), 0.7),
    ],
    ids=["disc", "block", "plate"],
)
def test_dye_that_is_everywhere_stays_everywhere(geom: str, turn: float) -> None:
    """Whatever a moving body leaves behind is filled from beside it."""
    world = moved(geom, 0.1, turn)
    _, state = world.flow()
    state.scalars["dye"][:] = 1.0
    for _ in range(100):
        step(world, 1.0 / 64)
        values = state.scalars["dye"][:, :, 0][outside(world)]
        assert np.abs(values - 1.0).max() < 1e-12, world.steps


def test_the_dye_of_a_jet_in_space_is_as_much_as_was_blown_and_never_more_than_that_dense() -> None:
    """In eddies of a few cells overshoots would feed on themselves."""
    grid = Grid((20, 20, 20), 1.0 / 20.0, (-0.5, -0.5, -0.5))
    sides = Boundaries(*(BoundaryOpen(),) * 6)
    ball = mjcf('<body><geom type="sphere" size="0.2"/></body>')
    plain = make_world(ball, grid, boundaries=sides, scalars=("dye",))
    place, along = (0.2, 0.0, 0.0), (1.0, 0.0, 0.0)
    mouth = Mouth("a mouth", 1, place, along, 0.1, 0.1, FactorSteady(), {"dye": 1.0})
    world = World.at_rest(replace(plain.setup, mouths=(mouth,)))
    _, state = world.flow()
    for _ in range(12):
        assert step(world, 0.01).dye_budget_error < 1e-13
        dye = state.scalars["dye"]
        assert 0.0 <= dye.min() < dye.max() <= 1.0
        if not dye[-1].any():
            assert np.vdot(state.cell_volume, dye) == pytest.approx(0.1 * world.time, rel=1e-12)
    assert np.vdot(state.cell_volume, dye) == pytest.approx(0.1 * world.time, rel=2e-4)

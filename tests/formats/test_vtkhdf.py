"""VTKHDF, read back by VTK's own reader: every number is the run's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from vtkmodules.util.numpy_support import vtk_to_numpy

import flowborne as fb
from flowborne.formats.creature import Creature
from flowborne.runs.states import cell_velocity, cell_vorticity
from flowborne.view.open_run import OpenRun

read_back = pytest.importorskip("read_back", exc_type=ImportError)

FAR = 1e-5
"""Distance from the run that is accepted, in sizes of the creature."""


@pytest.fixture
def opened(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[OpenRun, Any]:
    """The run of the parameter, and its file."""
    folder = request.getfixturevalue(request.param)
    fb.export(folder, tmp_path / "run.vtkhdf")
    return fb.open_run(folder), read_back.VtkHdf(tmp_path / "run.vtkhdf")


Opened = tuple[OpenRun, Any]
every = pytest.mark.parametrize("opened", ["chain", "fish", "walk"], indirect=True)
wet = pytest.mark.parametrize("opened", ["chain", "fish"], indirect=True)
drifting = pytest.mark.parametrize("opened", ["drift"], indirect=True)


@every
def test_times_and_blocks_are_the_runs(opened: Opened) -> None:
    run, read = opened
    assert_allclose(read.times, run.times, rtol=1e-12)
    wanted = {"bodies", "forces"}
    wanted |= {"fluid"} if run.grid is not None else set()
    wanted |= {"flesh"} if run.skin is not None else set()
    assert set(read.blocks(0)) == wanted


@wet
def test_fields_are_exact(opened: Opened) -> None:
    run, read = opened
    grid = run.grid
    assert grid is not None
    for number in range(len(run)):
        block, state = read.blocks(number)["fluid"], run.state(number)
        assert_allclose(block.GetBounds()[::2], grid.origin)
        assert_allclose(block.GetBounds()[1::2], grid.upper)
        wanted = {"velocity": cell_velocity(grid, state)}
        wanted |= {"vorticity": cell_vorticity(grid, state).astype(np.float32)}
        wanted |= {name: state[name] for name in ("pressure", "open")}
        wanted |= {dye: state[f"scalar_{dye}"] for dye in run.dyes}
        assert block.GetCellData().GetNumberOfArrays() == len(wanted)
        for name, field in wanted.items():
            flat = (
                field.reshape(*grid.shape, -1)
                .transpose(2, 1, 0, 3)
                .reshape(-1, field[0, 0, 0].size)
            )
            assert_array_equal(read_back.cells_of(block, name).reshape(flat.shape), flat)


@drifting
def test_a_domain_that_moves_is_at_its_place_and_the_rest_is_hidden(opened: Opened) -> None:
    run, read = opened
    for number in range(len(run)):
        block, state = read.blocks(number)["fluid"], run.state(number)
        grid = run.grid_at(state)
        shown = np.array([block.IsCellVisible(n) for n in range(block.GetNumberOfCells())], bool)
        middles = centres_of(block)
        inside = ((middles > grid.origin) & (middles < grid.upper)).all(axis=1)
        assert_array_equal(shown, inside)
        assert inside.sum() == np.prod(grid.shape)
        pressure = read_back.cells_of(block, "pressure")
        assert_array_equal(pressure[inside], state["pressure"].transpose(2, 1, 0).ravel())
        assert np.isnan(pressure[~inside]).all()
    assert not inside.all()


def centres_of(block: Any) -> np.ndarray:
    """(n, 3) middles of the cells of an image."""
    low, h = np.array(block.GetOrigin()), np.array(block.GetSpacing())
    nx, ny, nz = np.array(block.GetDimensions()) - 1
    k, j, i = np.meshgrid(*(np.arange(n) for n in (nz, ny, nx)), indexing="ij")
    return np.asarray(low + h * (np.stack([i, j, k], axis=-1).reshape(-1, 3) + 0.5))


@every
def test_bodies_are_where_the_run_has_them(opened: Opened) -> None:
    run, read = opened
    creature = Creature(run)
    model = creature.model
    for number in range(len(run)):
        block, state = read.blocks(number)["bodies"], run.state(number)
        wanted = [
            shape.triangles()[0] @ state["geom_rotation"][n].T + state["geom_position"][n]
            for n, shape in enumerate(model.geom_shape)
        ]
        assert_allclose(
            read_back.points_of(block), np.concatenate(wanted), atol=FAR * creature.size
        )
        geometry = read_back.cells_of(block, "geometry")
        assert_array_equal(read_back.cells_of(block, "body"), model.geom_body[geometry])
        assert block.GetNumberOfPolys() == sum(len(s.triangles()[1]) for s in model.geom_shape)


@every
def test_forces_are_the_runs(opened: Opened) -> None:
    run, read = opened
    for number in range(len(run)):
        block, state = read.blocks(number)["forces"], run.state(number)
        force = vtk_to_numpy(block.GetPointData().GetArray("force"))
        assert_array_equal(force, state["fluid_force"][1:])
        assert_array_equal(read_back.points_of(block), state["fluid_centre"][1:])


@pytest.mark.parametrize("opened", ["fish"], indirect=True)
def test_flesh_is_where_the_run_has_it_with_its_stresses(opened: Opened) -> None:
    run, read = opened
    creature = Creature(run)
    flesh = creature.model.flesh
    assert flesh is not None
    for number in range(len(run)):
        block, state = read.blocks(number)["flesh"], run.state(number)
        found = read_back.points_of(block)
        skin = found[np.unique(flesh.surface)]
        assert_allclose(skin, state["flesh_vertices"], atol=FAR * creature.size)
        assert block.GetNumberOfCells() == len(flesh.elements)
        stress = read_back.cells_of(block, "stress").reshape(-1, 3, 3)
        assert_allclose(stress, np.swapaxes(stress, 1, 2), atol=1e-5 * np.abs(stress).max() + 1e-6)
        least = run.history["flesh_least_detF"][number - 1] if number else 1.0
        assert read_back.cells_of(block, "volume_ratio").min() == pytest.approx(least, abs=1e-5)
        pull = read_back.cells_of(block, "von_mises")
        assert pull.max() < 1.0 if number == 0 else pull.max() > 100.0


@pytest.mark.parametrize("opened", ["fish"], indirect=True)
def test_vtk_knows_the_nodes_of_the_elements(opened: Opened) -> None:
    """Middles of edges lie between their ends at rest, in VTK's order."""
    _, read = opened
    block = read.blocks(0)["flesh"]
    cell = block.GetCell(0)
    for edge in range(cell.GetNumberOfEdges()):
        ends = [np.array(cell.GetEdge(edge).GetPoints().GetPoint(n)) for n in range(3)]
        assert_allclose(ends[2], 0.5 * (ends[0] + ends[1]), atol=1e-6)

"""OpenVDB volumes, read back by tinyvdb: every number is the run's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import flowborne as fb
from flowborne.formats.vdb import VdbGrid, vdb_bytes
from flowborne.runs.states import cell_velocity

tinyvdb = pytest.importorskip("tinyvdb")
read_back = pytest.importorskip("read_back", exc_type=ImportError)

BALL = (
    "<mujoco><worldbody><body name='ball' pos='0.5 0.5 0'><freejoint/>"
    "<geom type='sphere' size='0.1'/></body></worldbody></mujoco>"
)

LEFT_OUT = """
name = "ball"
dimensions = 2
[time]
frames_per_second = 10.0
frames = 1
[domain]
lower = [0.0, 0.0]
upper = [1.0, 1.0]
resolution = 16
[fluid]
coupling = "none"
[boundaries]
[solids]
model = "ball.xml"
"""


@pytest.mark.parametrize(("name", "dye"), [("chain", "dye"), ("fish", "smoke"), ("drift", "dye")])
def test_volumes_are_exact(
    name: str, dye: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    run = fb.open_run(request.getfixturevalue(name))
    assert run.grid is not None
    written = fb.export(run.folder, tmp_path / "water.vdb")
    assert [path.name for path in written.files] == [f"water_{n:04d}.vdb" for n in range(len(run))]
    for number, path in enumerate(written.files):
        with tinyvdb.open(str(path)) as file:
            file.read_grids()
            grids = {file.grid(n).name: file.grid(n) for n in range(file.grid_count)}
            assert set(grids) == {dye, "velocity"}
            state = run.state(number)
            wanted = state[f"scalar_{dye}"]
            assert_array_equal(read_back.voxels_of(grids[dye], wanted != 0.0), wanted.squeeze())
            everywhere = np.ones(run.grid.shape, bool)
            velocity = read_back.voxels_of(grids["velocity"], everywhere, 3)
            assert_array_equal(velocity, cell_velocity(run.grid, state).squeeze())
            for grid in grids.values():
                assert_allclose(grid.transform["voxel_size"], run.grid.spacing)
                first = [along[0] for along in run.grid_at(state).cell_coordinates()]
                assert_allclose(grid.transform["translation"], first)


def test_fields_of_many_nodes_are_exact(tmp_path: Path) -> None:
    """Several nodes of each kind, leaves that are full, empty and cut by the end of the field."""
    random = np.random.default_rng(7)
    values = random.normal(size=(150, 9, 131)).astype(np.float32)
    active = random.random(values.shape) < 0.01
    active[:8, :8, :8], active[64:96] = True, False
    kept = np.where(active, values, np.float32(0.0))
    grid = VdbGrid("noise", "fog volume", kept, active, 0.25, (1.0, 2.0, 3.0))
    (tmp_path / "noise.vdb").write_bytes(vdb_bytes([grid]))
    with tinyvdb.open(str(tmp_path / "noise.vdb")) as file:
        file.read_grids()
        assert_array_equal(read_back.voxels_of(file.grid(0), active), kept)


def test_a_run_without_fluid_is_refused(walk: Path, tmp_path: Path) -> None:
    with pytest.raises(fb.SceneError, match=r"has no fluid\. Add \[domain\] and \[fluid\]"):
        fb.export(walk, tmp_path / "water.vdb")
    assert not list(tmp_path.iterdir())


def test_a_run_that_leaves_its_fluid_out_says_so(tmp_path: Path) -> None:
    (tmp_path / "ball.xml").write_text(BALL)
    (tmp_path / "ball.toml").write_text(LEFT_OUT)
    fb.run(tmp_path / "ball.toml", tmp_path / "run", film=False)
    with pytest.raises(fb.SceneError, match=r"fluid\.coupling = 'none'\. Run it with 'one-way' or"):
        fb.export(tmp_path / "run", tmp_path / "water.vdb")

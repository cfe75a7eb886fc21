"""A run as lazy arrays, by NumPy and by xarray."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import flowborne as fb
from flowborne.runs.states import StateArray

DRIFTER = """<mujoco><worldbody><body name="drifter">
<joint name="x" type="slide" axis="1 0 0"/><geom type="cylinder" size="0.1 1" density="1000"/>
</body></worldbody></mujoco>"""

DRIFT = """
dimensions = 2
[time]
frames_per_second = 20.0
frames = 4
[domain]
lower = [-0.4, -0.3]
upper = [0.4, 0.3]
resolution = 16
follow = "bodies"
along = ["x"]
[fluid]
[boundaries]
x_min = "far"
x_max = "far"
y_min = "far"
y_max = "far"
[solids]
model = "drifter.xml"
[initial]
velocities = { x = 1.0 }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A chain of two links in a slab with dye."""
    out = tmp_path_factory.mktemp("runs") / "chain"
    fb.run(fb.load_scene("ns-chain-2", {"domain.resolution": "24"}), out, frames=3, film=False)
    return out


def test_arrays_are_those_of_the_states(folder: Path) -> None:
    run = fb.open_run(folder)
    assert run.frames == (0, 1, 2, 3)
    assert run.name == "ns-chain-2"
    assert run.is_slab
    assert_allclose(run.times, np.arange(4) / 24.0)
    assert set(run.arrays) == set(run.state(0))
    for name, array in run.arrays.items():
        assert array.shape == (4, *run.state(2)[name].shape)
        assert len(array.quantity.dimensions) == len(array.shape) - 1
        assert_array_equal(array[2], run.state(2)[name])
        assert_array_equal(array[-1], run.state(3)[name])
        assert_array_equal(np.asarray(array)[1], array[1])
        assert_array_equal(array[1:3], np.stack([array[1], array[2]]))
        assert array[4:].shape == (0, *array.shape[1:])


def test_only_what_is_asked_for_is_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("xarray")
    run = fb.open_run(folder)
    read: list[tuple[str, int]] = []
    of_state = StateArray._read

    def counted(self: StateArray, number: int) -> np.ndarray:
        read.append((self._name, number))
        return of_state(self, number)

    found = run.dataset()
    monkeypatch.setattr(StateArray, "_read", counted)
    pressure = found["pressure"].isel(time=2, x=slice(3, 7))
    assert read == []
    assert_array_equal(pressure.values, run.state(2)["pressure"][3:7])
    assert set(read) == {("pressure", 2)}


def test_a_data_set_has_units_and_places(folder: Path) -> None:
    pytest.importorskip("xarray")
    run = fb.open_run(folder)
    found = run.dataset()
    assert run.grid is not None
    for name, array in run.arrays.items():
        assert_array_equal(found[name].values, np.asarray(array))
        assert name == "time" or found[name].attrs["units"] == array.quantity.unit
    assert_array_equal(found["x"], run.grid.cell_coordinates()[0])
    assert_array_equal(found["y_face"], run.grid.face_coordinates(1)[1])
    assert found["velocity_y"].dims == ("time", "x", "y_face", "z")
    assert list(found["body"].values) == list(run.bodies)
    turned = found["body_position"].sel(body="block2", axis="y").values
    assert_array_equal(turned, run.every("body_position")[:, run.bodies.index("block2"), 1])
    assert float(found["pressure"].sel(time=1 / 24, method="nearest").max()) == pytest.approx(
        float(run.state(1)["pressure"].max())
    )


def test_cells_of_a_domain_that_moves_are_counted_from_its_corner(tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    (tmp_path / "drifter.xml").write_text(DRIFTER)
    (tmp_path / "drift.toml").write_text(DRIFT)
    fb.run(tmp_path / "drift.toml", tmp_path / "out", film=False)
    run = fb.open_run(tmp_path / "out")
    assert run.window_axes == (0,)
    assert run.grid is not None
    found, origins = run.dataset(), run.origins()
    assert len(set(origins[:, 0])) > 2
    assert found["x"].attrs == {"units": "m", "long_name": "offset from grid_origin"}
    assert found["y"].attrs == {"units": "m"}
    assert_array_equal(found["y_face"], run.grid.face_coordinates(1)[1])
    for number in range(len(run)):
        now, grid = found.isel(time=number), run.grid_at(run.state(number))
        corner = float(now["grid_origin"].sel(axis="x"))
        assert_allclose(now["x"] + corner, grid.cell_coordinates()[0], atol=1e-12)
        assert_allclose(now["x_face"] + corner, grid.face_coordinates(0)[0], atol=1e-12)


def test_a_data_set_has_the_drives_of_joints_by_name(folder: Path) -> None:
    pytest.importorskip("xarray")
    run = fb.open_run(folder)
    found = run.dataset()
    assert list(found["joint"].values) == list(run.joints)
    joint = run.joints[-1]
    assert found["torque"].dims == ("time", "joint")
    assert found["torque"].attrs["units"] == "N m"
    for name, column in (
        ("torque", f"torque_{joint}_Nm"),
        ("power", f"power_{joint}_W"),
        ("target_angle", f"target_{joint}_rad"),
    ):
        values = found[name].sel(joint=joint).values
        assert np.isnan(values[0])
        assert_array_equal(values[1:], run.history[column])
    assert_array_equal(found["drag"].values[1:], run.history["drag_N"])
    assert found["time"].attrs["units"] == "s"


def test_a_run_without_drives_in_its_history_opens(folder: Path, tmp_path: Path) -> None:
    """As runs were written before there were such columns; its history lags a frame behind."""
    pytest.importorskip("xarray")
    old = tmp_path / "old"
    shutil.copytree(folder, old)
    rows = [line.split(",") for line in (old / "history.csv").read_text().splitlines()]
    kept = [n for n, name in enumerate(rows[0]) if not name.startswith(("torque_", "power_"))]
    lines = [",".join(row[n] for n in kept) + "\n" for row in rows[:-1]]
    (old / "history.csv").write_text("".join(lines))
    found = fb.open_run(old).dataset()
    assert "torque" not in found
    assert "power" not in found
    angle = found["angle"].isel(joint=0).values
    assert_array_equal(np.isnan(angle), [True, False, False, True])
    with pytest.raises(fb.RunFolderError, match="other columns than this version writes; start"):
        fb.run(fb.load_scene(old / "scene.toml"), old, resume=True, film=False)


def test_a_missing_xarray_is_one_message(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    with pytest.raises(fb.SceneError, match=r"pip install 'flowborne\[xarray\]'"):
        fb.open_run(folder).dataset()

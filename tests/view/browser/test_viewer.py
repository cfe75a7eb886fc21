"""What of a run goes into the scene and the panel."""

from __future__ import annotations

import json
import shutil
import socket
import sys
import tomllib
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flowborne as fb
from flowborne.base.colours import to_linear
from flowborne.base.errors import SceneError
from flowborne.cli.main import main
from flowborne.runs.run_folder import RunFolder, RunFolderError
from flowborne.runs.states import cell_velocity
from flowborne.view import style
from flowborne.view.browser.fluid import velocity_arrows
from flowborne.view.browser.page import CSS
from flowborne.view.browser.panel import room_for
from flowborne.view.browser.surroundings import Surroundings
from flowborne.view.browser.viewer import GrowingRun, Viewer, open_viewer
from flowborne.view.browser.viewpoint import FilmView, Viewpoint, camera_text
from flowborne.view.framing import windows
from flowborne.view.run import Run
from flowborne.view.shot import Shot

from ...made_runs import drift_scene

pytest.importorskip("viser", reason="the viewer needs viser: pip install 'flowborne[view]'")

Write = Callable[..., Path]


@pytest.fixture
def folder(write_run: Write) -> Path:
    """Folder of a block in a stream, 12 frames."""
    return write_run(frames=12)


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@pytest.fixture
def viewer(folder: Path) -> Iterator[Viewer]:
    opened = open_viewer(folder, "127.0.0.1", free_port())
    opened.tick(0.0)
    yield opened
    opened.server.stop()


def placed(viewer: Viewer, geom: int) -> np.ndarray:
    """(n, 3) vertices of a geometry where the scene has them, m."""
    mesh = viewer._bodies.meshes[geom]
    turn = Rotation.from_quat(mesh.wxyz, scalar_first=True).as_matrix()
    return np.asarray(mesh.vertices @ turn.T + mesh.position)


def distance_to_block(state: dict[str, np.ndarray], points: np.ndarray) -> np.ndarray:
    """(n,) m, of points in the plane from the outline of the block of 1 m x 0.18 m."""
    local = (points - state["geom_position"][1]) @ state["geom_rotation"][1]
    return np.asarray(np.maximum(np.abs(local[:, 0]) - 0.5, np.abs(local[:, 1]) - 0.09))


def luminance(colour: str) -> float:
    """Relative luminance of "#rrggbb", as WCAG 2.2 has it."""
    return float(to_linear(style.rgb(colour)) @ [0.2126, 0.7152, 0.0722])


def test_words_stand_out_from_their_ground() -> None:
    """WCAG 2.2, 1.4.3: 4.5:1, on the panel of viser and on what films are drawn on."""
    assert style.MUTED in CSS
    for ground in ("#242424", style.WATER, style.PAPER):
        for words in (style.MUTED, style.TEXT):
            assert (luminance(words) + 0.05) / (luminance(ground) + 0.05) > 4.5


@pytest.mark.parametrize(
    ("low", "high", "longest"),
    [(-263_900.0, 100_000.0, "-263,900"), (-1.2e-4, 3e-5, "-0.00012"), (0.0, 0.0, "0.000")],
)
def test_numbers_at_an_axis_have_room(low: float, high: float, longest: str) -> None:
    assert room_for(low, high) >= 6.0 * len(longest) + 14


@pytest.mark.parametrize("slab", [True, False])
def test_marks_stand_in_the_water_where_the_view_goes_along(viewer: Viewer, slab: bool) -> None:
    scene, run, view = viewer.server.scene, viewer.run, viewer._view
    run.is_slab = slab
    assert run.grid is not None
    for path, there in ((view.path, False), (np.outer(np.arange(13.0), [1.0, 0.0, 0.0]), True)):
        Surroundings(scene, run, replace(view, path=path))
        assert ("/run/marks" in scene._handle_from_node_name) == there
    handle = scene._handle_from_node_name["/run/marks"]
    places = np.asarray(handle.points).reshape(-1, 3)[:, :2]
    low, high = np.array(run.grid.origin[:2]), np.array(run.grid.upper[:2])
    assert len(places) > 50
    assert ((places > low - 0.1) & (places < high + 0.1)).all()


@pytest.fixture
def moving(write_run: Write) -> Iterator[Viewer]:
    """Viewer of a slab past whose water the domain moves."""
    opened = open_viewer(write_run(frames=24, window=(0.6, -0.4)), "127.0.0.1", free_port())
    yield opened
    opened.server.stop()


def test_a_domain_that_moves_is_where_it_is(moving: Viewer) -> None:
    run, scene = moving.run, moving.server.scene
    assert run.grid is not None
    for number in (0, 24):
        moving.timeline.seek(run.times[number])
        moving.tick(0.0)
        grid = run.grid_at(run.state(number))
        middle = 0.5 * (np.array(grid.origin) + grid.upper)[:2]
        image = scene._handle_from_node_name["/run/slice"]
        assert image.position[:2] == pytest.approx(middle)
        marks = np.asarray(scene._handle_from_node_name["/run/marks"].points).reshape(-1, 3)
        assert np.abs(0.5 * (marks.min(axis=0) + marks.max(axis=0))[:2] - middle).max() < 0.5
        root = scene._handle_from_node_name["/run"].position[:2]
        moved = np.array(grid.origin[:2]) - run.grid.origin[:2]
        assert np.abs(root + moved).max() < 2.0 * grid.spacing


def test_a_domain_that_moves_in_space_is_where_it_is(tmp_path: Path) -> None:
    fb.run(drift_scene(tmp_path), tmp_path / "run", film=False)
    viewer = open_viewer(tmp_path / "run", "127.0.0.1", free_port())
    run, scene = viewer.run, viewer.server.scene
    controls = viewer.panel._controls
    controls["field"].value, controls["slice"].value = "dye", "speed"
    assert run.grid is not None
    for number in (1, len(run) - 1):
        viewer.timeline.seek(run.times[number])
        viewer.tick(0.0)
        state = run.state(number)
        grid = run.grid_at(state)
        moved = np.array(grid.origin) - run.grid.origin
        edges = scene._handle_from_node_name["/run/domain"]
        assert np.abs(edges.position - moved).max() < 1.6 * grid.spacing
        image = scene._handle_from_node_name["/run/slice"]
        wanted = 0.5 * (np.array(grid.origin) + grid.upper)
        wanted[1] = controls["coordinate"].value
        assert image.position == pytest.approx(wanted)
        dye = scene._handle_from_node_name["/run/dye"]
        cells = np.stack(np.meshgrid(*grid.cell_coordinates(), indexing="ij"), axis=-1)
        weight = state["scalar_dye"][..., None]
        middle = (weight * cells).sum(axis=(0, 1, 2)) / weight.sum()
        assert np.abs(dye.centers.mean(axis=0) - middle).max() < 1.5 * grid.spacing
    assert moved[0] > 0.1
    viewer.server.stop()


def test_walls_of_a_slab_are_thicker_than_sides_that_fluid_passes(viewer: Viewer) -> None:
    """The block's stream enters at x_min and leaves at x_max, between walls."""
    run, scene = viewer.run, viewer.server.scene
    assert run.grid is not None
    run.tables["boundaries"] = {"x_min": {"kind": "inflow"}, "x_max": "open", "y_max": "closed"}
    Surroundings(scene, run, viewer._view)
    walls = scene._handle_from_node_name["/run/domain/walls"]
    others = scene._handle_from_node_name["/run/domain/open"]
    assert walls.thickness > 2.0 * others.thickness
    low, high = np.array(run.grid.origin), np.array(run.grid.upper)
    for handle, axis in ((walls, 1), (others, 0)):
        across = np.asarray(handle.points)[:, :, axis]
        assert across == pytest.approx(np.array([[low[axis]] * 2, [high[axis]] * 2]))


def test_scale_bar_has_the_length_that_it_says(viewer: Viewer) -> None:
    scene = viewer.server.scene
    bar = np.asarray(scene._handle_from_node_name["/scale"].points)
    said = scene._handle_from_node_name["/scale/length"].text
    assert said == f"{np.linalg.norm(bar[0, 1] - bar[0, 0]):g} m"


class Page:
    """A client with a camera of its own."""

    def __init__(self, width: int, height: int) -> None:
        self.camera = SimpleNamespace(image_width=width, image_height=height)

    def atomic(self) -> nullcontext[None]:
        return nullcontext()


@pytest.mark.parametrize(("width", "height"), [(1080, 900), (390, 844), (300, 1500)])
def test_home_shows_the_whole_view_on_every_page(viewer: Viewer, width: int, height: int) -> None:
    page: Any = Page(width, height)
    viewer._show_home(page)
    camera = page.camera
    half = np.linalg.norm(camera.position - camera.look_at) * np.tan(0.5 * camera.fov)
    low, high = windows(viewer.run, viewer.run.shot)[0].reshape(2, 2).T
    assert camera.look_at[:2] == pytest.approx(0.5 * (low + high), abs=0.02)
    shown = 2.0 * half * np.array([width / height, 1.0]) / (high - low)
    assert 1.0 < shown.min() < 1.3


def test_bodies_are_where_the_run_has_them(viewer: Viewer) -> None:
    for number in (0, 7):
        viewer.timeline.seek(viewer.run.times[number])
        viewer.tick(0.0)
        points = placed(viewer, 1)
        assert np.abs(distance_to_block(viewer.run.state(number), points)).max() < 1e-5


def test_slider_seeks(viewer: Viewer) -> None:
    viewer.panel._slider.value = 0.31
    viewer.tick(0.0)
    assert viewer.timeline.number == 7
    assert "frame 7 of 12" in viewer.panel._clock.content


def test_slider_goes_along_while_it_plays(viewer: Viewer) -> None:
    viewer.timeline.play()
    viewer.tick(0.25)
    assert viewer.timeline.playing
    assert viewer.panel._slider.value == pytest.approx(0.25)


def test_curves_follow_the_time(viewer: Viewer) -> None:
    viewer.timeline.seek(0.25)
    viewer.tick(0.0)
    times, whole, past = viewer.panel.curves.plots[-1].data
    assert np.allclose(whole, np.degrees(viewer.run.history["angle_hinge_rad"]))
    assert np.array_equal(np.isfinite(past), times <= 0.25 + 1e-9)


def test_new_frames_appear(viewer: Viewer, folder: Path) -> None:
    states = folder / "states"
    with np.load(states / "000012.npz") as last:
        arrays = dict(last)
    arrays["time"] = np.float64(13 / 24)
    arrays["geom_position"] = arrays["geom_position"] + np.float32(0.125)
    np.savez(states / "000013.npz", **arrays)
    with (folder / "history.csv").open("a") as history:
        history.write("13,0.541667,0.5,0.5,-0.7\n")
    viewer.timeline.seek(viewer.run.times[-1])
    viewer.tick(0.0)
    before = placed(viewer, 1)
    viewer.timeline.show_newest()
    viewer.look()
    viewer.tick(0.0)
    assert len(viewer.run) == 14
    assert viewer.timeline.number == 13
    assert np.allclose(placed(viewer, 1) - before, 0.125, atol=1e-6)
    assert viewer.panel.curves.plots[-1].data[0][-1] == pytest.approx(13 / 24, abs=1e-5)


def test_run_that_starts_again_is_seen_from_its_start(viewer: Viewer, folder: Path) -> None:
    viewer.timeline.show_newest()
    for path in sorted((folder / "states").iterdir())[3:]:
        path.unlink()
    viewer.look()
    viewer.tick(0.0)
    assert len(viewer.run) == 3
    assert viewer.timeline.number == 0


def test_run_that_goes_on_is_seen_at_its_newest_frame(folder: Path) -> None:
    RunFolder(folder).mark([])
    viewer = open_viewer(folder, "127.0.0.1", free_port())
    assert viewer.timeline.newest
    viewer.server.stop()


def test_states_are_read_once(folder: Path) -> None:
    run = GrowingRun(folder)
    assert run.grown() is None
    first = run.every("geom_position")
    (folder / "states" / "000005.npz").write_bytes(b"")
    assert np.array_equal(run.every("geom_position"), first)


def test_fields_of_a_slab(viewer: Viewer) -> None:
    """Every choice is shown with its legend."""
    for field, said in (("vorticity", "vorticity (1/s)"), ("speed", "speed (m/s)"), ("dye", "dye")):
        viewer.panel._controls["field"].value = field
        viewer.tick(0.0)
        assert said in viewer.panel.legend.content
        assert viewer.server.scene.get_handle_by_name("/run/slice") is not None


def test_velocity_arrows_point_along_the_velocity(folder: Path) -> None:
    run = Run(folder)
    assert run.grid is not None
    state = run.state(3)
    vertices, _faces = velocity_arrows(run.grid, state, 2, 0.0, 1.0)
    arrow = vertices.reshape(-1, 7, 3)[0]
    middle = 0.5 * (arrow[3] + 0.5 * (arrow[0] + arrow[6]))
    along = arrow[3] - 0.5 * (arrow[0] + arrow[6])
    cell = (*tuple(np.floor((middle - run.grid.origin) / run.grid.spacing).astype(int)[:2]), 0)
    velocity = cell_velocity(run.grid, state)[cell]
    assert np.dot(along, velocity) > 0.999 * np.linalg.norm(along) * np.linalg.norm(velocity)


def test_camera_of_a_slab_gives_the_same_film(folder: Path) -> None:
    run = Run(folder)
    view = FilmView.of(run)
    keys = tomllib.loads(camera_text("run", view.first, True).split("\n\n")[0])["film"]
    shot = Shot.model_validate(keys)
    seen = windows(run, shot)[0]
    wanted = windows(run, run.shot)[0]
    assert seen[2:] == pytest.approx(wanted[2:], abs=0.01)


def test_camera_keys_are_those_of_a_scene() -> None:
    seen_from = Viewpoint(np.array([7.0, -2.5, 1.25]), np.array([0.1, 0.0, 0.9]), 26.0)
    keys = tomllib.loads(camera_text("run", seen_from, False).split("\n\n")[0])["film"]
    camera = Shot.model_validate(keys).camera
    assert camera.position == (7.0, -2.5, 1.25)
    assert camera.target == (0.1, 0.0, 0.9)
    assert camera.lens == 26.0


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (shutil.rmtree, "there is no folder"),
        (lambda path: (path / "summary.json").unlink(), "is not the folder of a run"),
        (lambda path: shutil.rmtree(path / "states"), "has no frame yet"),
        (lambda path: (path / "model.json").write_text("{"), "cannot be read"),
    ],
)
def test_folder_with_nothing_to_view(
    folder: Path, spoil: Callable[[Path], object], said: str
) -> None:
    spoil(folder)
    with pytest.raises(RunFolderError, match=said):
        GrowingRun(folder)


def test_port_in_use_is_said(folder: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = int(other.getsockname()[1])
        with pytest.raises(SceneError, match=f"port {port} cannot be used .* --port"):
            open_viewer(folder, "127.0.0.1", port)


def test_command_says_what_is_missing(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(SystemExit) as left:
        main(["view", str(folder)])
    assert left.value.code == 2
    assert "pip install 'flowborne[view]'" in capsys.readouterr().err
    assert json.loads((folder / "summary.json").read_text())["outcome"] == "done"

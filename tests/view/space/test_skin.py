"""Flesh in space: a smooth skin over bones that are seen through it only when asked for."""

from __future__ import annotations

import colorsys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import pyvista as pv

from flowborne.coupling.report import Outcome
from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Pixels
from flowborne.runs.history import History
from flowborne.runs.recorder import Recorder, write_model
from flowborne.runs.run_folder import RunFolder
from flowborne.shapes.primitives import ShapeBox
from flowborne.solids.elements import surface_of
from flowborne.solids.model import SolidModel
from flowborne.solids.tissue.growth import Tissue, add_flesh
from flowborne.solids.trajectories import JointCommand
from flowborne.view import style
from flowborne.view.pictures import Picture
from flowborne.view.run import Flesh, Geom, Run
from flowborne.view.space.camera import FILLED, camera_of
from flowborne.view.space.lighting import KEY
from flowborne.view.space.opengl import off_screen
from flowborne.view.space.stage import MapSpace
from flowborne.view.space.surfaces import Outside, SkinSurface, creased, exit_distance, normals
from flowborne.view.space.surroundings import stands_on_ground
from flowborne_validation.flesh_bars import bar_mesh

from .projecting import project

Make = Callable[..., Run]

BALL = ("sphere", (0.1, 0.0, 0.0))

ARM = """<mujoco><worldbody><body name="upper" pos="-.2 0 0"><joint name="shoulder" axis="0 1 0"/>
<geom type="capsule" fromto=".05 0 0 .15 0 0" size=".025"/><body name="lower" pos=".2 0 0">
<joint name="elbow" axis="0 1 0"/><geom type="capsule" fromto=".05 0 0 .15 0 0" size=".025"/>
</body></body></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run of two bones in flesh that bend in a fluid; two frames of one step each."""
    spec = mujoco.MjSpec.from_string(ARM)
    points, elements = bar_mesh((8, 2, 2), (0.4, 0.1, 0.1))
    points[:, 0] -= 0.2
    held = (np.hypot(*points[:, 1:].T) < 0.01) & (np.abs(points[:, 0]) > 0.04)
    bones = [("upper", "lower")[int(x > 0.0)] for x in points[:, 0]]
    holders = [bone if h else "" for bone, h in zip(bones, held, strict=True)]
    grown = add_flesh(spec, "arm", points, elements, Tissue(3e4, 0.3, 1000.0, 0.01), holders)
    model = SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.0, 0.0))
    world = World.at_rest(Setup(model, Fluid(Grid((16, 12, 16), 0.05, (-0.4, -0.3, -0.4)), 1000.0)))
    folder = RunFolder.create(tmp_path_factory.mktemp("runs") / "arm")
    folder.scene.write_text('name = "arm"\n[film]\nfield = "none"\n')
    write_model(folder, world.setup, controlled=["elbow"], frames_per_second=24.0, wind=[])
    History.create(folder.history, ["frame", "time_s"]).close()
    recorder = Recorder(folder)
    recorder.write(0, world, None)
    command = JointCommand.none(model.nv)
    for joint, speed in (("shoulder", 1.0), ("elbow", -3.0)):
        command.set(model.dofs_of(joint), speed, speed)
    for frame in (1, 2):
        report = step(world, 0.02, command)
        assert report.outcome is Outcome.DONE
        recorder.write(frame, world, report.fluid_wrench()[:, :3])
    return folder.path


@pytest.fixture
def ball_of_flesh(run_of: Make) -> Callable[..., Run]:
    """Makes a run of a ball that lies on the ground and of flesh, wherever that is."""

    def make(vertices: np.ndarray, triangles: np.ndarray, **options: object) -> Run:
        """`vertices` (frames, k, 3) of flesh."""
        run = run_of([BALL], np.full((len(vertices), 1, 3), [0.0, 0.0, 0.1]), **options)
        for path, places in zip(run._states, vertices, strict=True):
            with np.load(path) as file:
                arrays = dict(file)
            np.savez(path, **arrays, flesh_vertices=places.astype(np.float32))
        geoms = tuple(replace(geom, covered=True) for geom in run.geoms)
        vars(run).update(geoms=geoms, flesh=Flesh(triangles, (1,)))
        return run

    return make


def ball(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a ball about the origin."""
    mesh = pv.Icosphere(radius=radius, nsub=4)
    return np.asarray(mesh.points, float), mesh.regular_faces.astype(np.int64)


def drawn(picture: Picture, number: int) -> Pixels:
    """(h, w, 3) the map of a frame."""
    box = picture.layout.map
    pixels = picture.draw(number)[box.top : box.top + box.height, box.left : box.left + box.width]
    return pixels[:, :, :3].astype(int)


def up_of(picture: Picture) -> np.ndarray:
    """(3,) upwards on the map."""
    assert isinstance(picture.map, MapSpace)
    return picture.map.camera.axes(0)[1]


def pixel_of(picture: Picture, number: int, place: np.ndarray) -> tuple[int, int]:
    """(row, column) in the map of a place in m."""
    assert isinstance(picture.map, MapSpace)
    x, y = project(picture.map.camera, number, np.asarray(place, float)[None])[0]
    box = picture.layout.map
    return int((1.0 - y) * box.height), int(x * box.width)


def hue(colour: Pixels) -> float:
    return colorsys.rgb_to_hsv(*(colour / 255.0))[0]


def lit(pixels: Pixels) -> Pixels:
    """Where there is something other than water."""
    return np.abs(pixels - np.rint(255.0 * style.rgb(style.WATER))).max(axis=-1) > 6


def hue_of(colour: str) -> float:
    return hue(255.0 * style.rgb(colour))


def test_the_skin_stands_where_its_vertices_are(ball_of_flesh: Make) -> None:
    places, triangles = ball(0.3)
    middles = np.array([[0.0, 0.0, 0.0], [0.4, 0.3, 0.5]])
    run = ball_of_flesh(middles[:, None] + places, triangles)
    with closing(Picture(run)) as picture:
        for number, middle in enumerate(middles):
            seen = lit(drawn(picture, number))
            row, column = np.argwhere(seen).mean(axis=0)
            expected = pixel_of(picture, number, middle)
            assert (row, column) == pytest.approx(expected, abs=5.0)
            radius = expected[0] - pixel_of(picture, number, middle + 0.3 * up_of(picture))[0]
            assert seen.sum() == pytest.approx(np.pi * radius**2, rel=0.05)


def test_the_skin_is_shaded_smoothly(ball_of_flesh: Make) -> None:
    """Of its own colour; on a line across its middle it darkens without steps from face to face."""
    places, triangles = ball(0.3)
    run = ball_of_flesh(np.broadcast_to(places, (2, *places.shape)), triangles)
    with closing(Picture(run)) as picture:
        pixels = drawn(picture, 0)
        row, column = pixel_of(picture, 0, np.zeros(3))
        radius = row - pixel_of(picture, 0, 0.3 * up_of(picture))[0]
    down = pixels[row - int(0.9 * radius) : row + int(0.9 * radius), column].astype(float)
    assert hue(down[len(down) // 4]) == pytest.approx(hue_of(style.FLESH), abs=0.02)
    light = down.sum(axis=1)
    assert light.max() > 2.5 * light.min()
    assert np.abs(np.diff(light)).max() < 0.03 * np.ptp(light)


def test_a_state_whose_numbers_are_lost_shows_no_skin(ball_of_flesh: Make) -> None:
    places, triangles = ball(0.3)
    vertices = np.array([places, places])
    vertices[1, 5] = np.nan
    with closing(Picture(ball_of_flesh(vertices, triangles))) as picture:
        assert lit(drawn(picture, 0)).any()
        assert not lit(drawn(picture, 1)).any()


def test_flesh_casts_its_shadow_on_the_ground(ball_of_flesh: Make) -> None:
    """A ring lets light through its hole."""
    ring = pv.ParametricTorus(ringradius=0.5, crosssectionradius=0.1).triangulate()
    places = np.array([0.0, 0.0, 1.0]) + np.asarray(ring.points, float)
    triangles = ring.regular_faces.astype(np.int64)
    down = np.array([0.0, 0.0, -9.81])
    run = ball_of_flesh(np.array([places, places]), triangles, gravity=down)
    fallen = np.array(KEY)[:2] / -KEY[2]
    with closing(Picture(run)) as picture:
        pixels = drawn(picture, 0)
        hole, shade = (
            pixels[pixel_of(picture, 0, np.append(fallen + aside, 0.0))].sum()
            for aside in ([0.0, 0.0], [0.5, 0.0])
        )
    assert hole > shade + 40


def test_flesh_alone_may_stand_on_the_ground(ball_of_flesh: Make) -> None:
    places, triangles = ball(0.3)
    for height, expected in ((0.3, True), (1.0, False), (0.0, False)):
        lifted = np.array([places, places]) + np.array([0.0, 0.0, height])
        run = ball_of_flesh(lifted, triangles, gravity=np.array([0.0, 0.0, -9.81]))
        run.geoms = ()
        assert stands_on_ground(run) == expected


def test_bones_are_hidden_until_they_are_asked_for(arm: Path) -> None:
    run = Run(arm)
    lower = run.state(2)["geom_position"][1].astype(float)
    loose = run.state(2)["flesh_vertices"].astype(float)
    assert [geom.covered for geom in run.geoms] == [True, True]
    with (
        closing(Picture(run)) as picture,
        closing(Picture(run, shot=run.shot.model_copy(update={"bones": True}))) as inside,
    ):
        at = pixel_of(picture, 2, lower)
        skin, bone = drawn(picture, 2)[at], drawn(inside, 2)[at]
        assert hue(skin) == pytest.approx(hue_of(style.FLESH), abs=0.02)
        assert hue(bone) == pytest.approx(hue_of(style.ACCENT), abs=0.03)
        assert bone[0] > 150, "bright, as a body is"
        joint = pixel_of(picture, 2, loose.mean(axis=0))
        before, through = drawn(picture, 2)[joint], drawn(inside, 2)[joint]
        assert through.sum() < 0.8 * before.sum(), "the water behind is seen between the bones"


def test_arrows_of_forces_start_on_the_skin(arm: Path) -> None:
    run = Run(arm)
    assert run.flesh is not None
    assert run.flesh.bodies == (1, 2)
    state = run.state(2)
    skin = Outside(run.geoms, run.skins)
    around = skin.around(state)
    for body in run.flesh.bodies:
        middle = state["fluid_centre"][body].astype(float)
        assert 0.045 < skin.reach(body, middle, np.array([0.0, 3.0, 0.0]), state, around) < 0.055


def test_the_camera_sees_all_of_the_skin(ball_of_flesh: Make) -> None:
    places, triangles = ball(0.2)
    growing = np.array([places * [1.0, 1.0, 1.0 + 0.5 * n] for n in range(6)])
    run = ball_of_flesh(growing, triangles)
    camera = camera_of(run, run.shot)
    seen = np.stack([project(camera, n, points) for n, points in enumerate(growing)])
    low, high = 0.5 - 0.5 * FILLED, 0.5 + 0.5 * FILLED
    assert low - 0.01 < seen.min() < low + 0.02
    assert high - 0.02 < seen.max() < high + 0.01


def test_only_creases_have_two_normals() -> None:
    points, elements = bar_mesh((3, 3, 3), (1.0, 1.0, 1.0))
    skin = surface_of(elements)
    vertex, faces = creased(points, skin)
    assert len(vertex) == 6 * 4**2
    np.testing.assert_array_equal(vertex[faces], skin)
    found = normals(points[vertex], faces)
    np.testing.assert_allclose(np.abs(found).max(axis=1), 1.0)
    middle = [0.5, 0.0, 0.0]
    assert ((points[vertex] - middle) * found).sum(axis=1) == pytest.approx(0.5)
    places, triangles = ball(0.3)
    assert len(creased(places, triangles)[0]) == len(places)


def test_normals_follow_the_skin_as_it_deforms() -> None:
    places, triangles = ball(1.0)
    plotter = off_screen(64, 64)
    first = {"flesh_vertices": places}
    surface = SkinSurface(plotter, Flesh(triangles, ()), first, seen_through=False)
    surface.show({"flesh_vertices": places * [3.0, 1.0, 0.5]})
    (actor,) = plotter.actors.values()
    shown = actor.mapper.dataset
    plotter.close()
    expected = np.asarray(shown.points) / [9.0, 1.0, 0.25]
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    found = shown.point_data.active_normals
    assert np.einsum("ij,ij->i", found, expected).min() > 0.99


def test_the_way_out_ends_where_the_line_first_leaves_the_skin() -> None:
    ring = pv.ParametricTorus(
        ringradius=1.0, crosssectionradius=0.3, u_res=80, v_res=40, w_res=40
    ).triangulate()
    corners = np.asarray(ring.points, float)[ring.regular_faces]
    volume = np.linalg.det(corners).sum() / 6.0
    corners = corners if volume > 0.0 else corners[:, ::-1]
    across = np.array([1.0, 0.0, 0.0])
    inside = np.array([-1.0, 1e-3, 2e-3])
    assert exit_distance(inside, across, corners) == pytest.approx(0.3, rel=0.02)
    assert exit_distance(inside, -across, corners) == pytest.approx(0.3, rel=0.02)
    assert exit_distance(inside - across, across, corners) == 0.0
    assert exit_distance(inside + across, across, corners) == 0.0
    assert exit_distance(inside, across, corners[:0]) == 0.0


def test_a_part_of_a_body_outside_flesh_still_counts() -> None:
    places, triangles = ball(0.2)
    box = Geom(ShapeBox(np.array([0.5, 0.1, 0.1])), 1, np.ones(4))
    skin = Outside([box], [Flesh(triangles, (1,))])
    state = {
        "geom_position": np.zeros((1, 3)),
        "geom_rotation": np.eye(3)[None],
        "flesh_vertices": places,
    }
    tilted, around = np.array([1e-4, 2e-4, 3e-4]), skin.around(state)
    across, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    assert skin.reach(1, tilted, across, state, around) == pytest.approx(0.5, rel=1e-3)
    assert skin.reach(1, tilted, up, state, around) == pytest.approx(0.2, rel=0.02)
    assert skin.reach(7, tilted, up, state, around) == pytest.approx(0.2, rel=0.02)

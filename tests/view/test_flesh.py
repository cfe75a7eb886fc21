"""Flesh in a slab: the section of its skin, drawn over the bones or, when asked for, below them."""

from __future__ import annotations

import shutil
from pathlib import Path

import imageio.v3 as imageio
import mujoco
import numpy as np
import pytest

from flowborne.cli.main import main
from flowborne.coupling.world import Setup, World
from flowborne.kernels.arrays import Pixels
from flowborne.runs.history import History
from flowborne.runs.recorder import Recorder, write_model
from flowborne.runs.run_folder import RunFolder
from flowborne.solids.elements import surface_of
from flowborne.solids.model import SolidModel
from flowborne.solids.tissue.growth import Tissue, add_flesh
from flowborne.view import style
from flowborne.view.maps import MapSlab
from flowborne.view.outlines import skin_loops
from flowborne.view.pictures import Picture
from flowborne.view.run import Run
from flowborne.view.shot import Shot
from flowborne_validation.flesh_bars import bar_mesh, flat_mesh

BONE = """<mujoco><worldbody><body name="bone"><joint name="turn" axis="0 0 1"/>
<geom type="box" size=".15 .03 .3" pos=".3 0 0"/></body></worldbody></mujoco>"""

RISE = 0.3
"""m by which the loose end of the flesh stands higher in the second frame."""


@pytest.fixture(scope="module")
def fin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run of two frames: flesh 0.9 m x 0.2 m around a bone. Not to be written into."""
    spec = mujoco.MjSpec.from_string(BONE)
    points, elements = flat_mesh((18, 4), (0.9, 0.2))
    held = (np.abs(points[:, 1]) < 0.01) & (np.abs(points[:, 0] - 0.3) < 0.12)
    tissue = Tissue(young=1e4, poisson=0.3, density=1000.0)
    grown = add_flesh(spec, "fin", points, elements, tissue, ["bone" if h else "" for h in held])
    model = SolidModel.with_flesh(spec, [grown], slab=True)
    folder = RunFolder.create(tmp_path_factory.mktemp("runs") / "fin")
    folder.scene.write_text('name = "fin"\ndimensions = 2\n')
    History.create(folder.history, ["frame", "time_s"]).close()
    world = World(Setup(model), model.rest())
    write_model(folder, world.setup, controlled=["turn"], frames_per_second=24.0, wind=[])
    recorder = Recorder(folder)
    recorder.write(0, world, None)
    assert model.flesh is not None
    velocity = np.zeros_like(model.flesh.rest)
    velocity[:, 1] = RISE * np.clip((model.flesh.rest[:, 0] - 0.45) / 0.45, 0.0, 1.0)
    world.solid.q[:] = model.integrate(world.solid.q, model.flesh.of_vertices(velocity), 1.0)
    recorder.write(1, world, None)
    return folder.path


def colour_at(picture: Picture, number: int, x: float, y: float) -> list[int]:
    """The map's colour at a place in m."""
    assert isinstance(picture.map, MapSlab)
    x0, x1, y0, y1 = picture.map.views[number]
    box = picture.layout.map
    row = box.top + int((y1 - y) / (y1 - y0) * box.height)
    column = box.left + int((x - x0) / (x1 - x0) * box.width)
    return [int(c) for c in picture.draw(number)[row, column, :3]]


def rgb(colour: str) -> Pixels:
    return 255.0 * style.rgb(colour)


def test_flesh_is_drawn_where_its_skin_is(fin: Path) -> None:
    picture = Picture(Run(fin))
    flesh, water = (pytest.approx(rgb(c), abs=2) for c in (style.FLESH, style.WATER))
    for number, rise in ((0, 0.0), (1, RISE)):
        for x, y in ((0.02, 0.0), (0.3, 0.08), (0.44, -0.08), (0.88, 0.95 * rise)):
            assert colour_at(picture, number, x, y) == flesh
        for x, y in ((-0.02, 0.0), (0.3, 0.12), (0.92, rise), (0.88, RISE - rise)):
            assert colour_at(picture, number, x, y) == water


def test_the_map_holds_all_of_the_flesh_of_all_frames(fin: Path) -> None:
    x0, x1, y0, y1 = MapSlab(Run(fin), Shot()).views[0]
    assert x0 < -0.2
    assert x1 > 1.1
    assert y0 < -0.1 - 0.1
    assert y1 > 0.1 + RISE + 0.1


def test_bones_are_hidden_until_they_are_asked_for(fin: Path) -> None:
    run = Run(fin)
    assert colour_at(Picture(run), 0, 0.3, 0.0) == pytest.approx(rgb(style.FLESH), abs=2)
    picture = Picture(run, shot=run.shot.model_copy(update={"bones": True}))
    assert colour_at(picture, 0, 0.3, 0.0) == pytest.approx(rgb(style.ACCENT), abs=2)
    share = style.SEEN_THROUGH
    dim = share * rgb(style.FLESH) + (1.0 - share) * rgb(style.WATER)
    assert colour_at(picture, 0, 0.3, 0.08) == pytest.approx(dim, abs=2)


def test_a_state_whose_numbers_are_lost_shows_neither_skin_nor_bones(
    fin: Path, tmp_path: Path
) -> None:
    run = Run(Path(shutil.copytree(fin, tmp_path / "fin")))
    state = run.state(1)
    state["flesh_vertices"][7] = np.nan
    np.savez(run._states[1], **state)
    assert colour_at(Picture(run), 1, 0.3, 0.0) == pytest.approx(rgb(style.WATER), abs=2)


def test_the_command_draws_bones_when_asked_to(fin: Path) -> None:
    stills = []
    for switch in ([], ["--set", "bones=true"]):
        with pytest.raises(SystemExit) as left:
            main(["film", str(fin), *switch])
        assert left.value.code == 0
        stills.append(imageio.imread(fin / "preview.png"))
        film = imageio.imread(fin / "preview.mp4", plugin="FFMPEG")
        run = Run(fin)
        shot = run.shot.model_copy(update={"bones": bool(switch)})
        expected = Picture(run, shot=shot).draw(1)[:, :, :3].astype(int)
        assert np.abs(film[1] - expected).mean() < 4.0
    for still, bones in zip(stills, (False, True), strict=True):
        run = Run(fin)
        expected = Picture(run, 1.5, run.shot.model_copy(update={"bones": bones})).draw(1)[:, :, :3]
        np.testing.assert_array_equal(still, expected)


def area(loop: Pixels) -> float:
    x, y = loop.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("layers", [1, 2])
def test_the_section_of_a_skin_has_its_area(layers: int) -> None:
    """Also where vertices lie in the plane itself."""
    points, elements = bar_mesh((6, 3, layers), (0.6, 0.3, 1.0))
    points[:, 1] *= 1.0 + points[:, 0]
    (loop,) = skin_loops(points, surface_of(elements))
    assert area(loop) == pytest.approx(0.3 * (0.6 + 0.5 * 0.6**2), rel=1e-9)


def test_a_hole_in_flesh_is_an_outline_the_other_way_round() -> None:
    points, elements = bar_mesh((4, 4, 4), (0.4, 0.4, 0.4))
    apart = points + np.array([1.0, 0.0, 0.0])
    middle = np.abs(points[elements].mean(axis=1) - [0.2, 0.0, 0.0]).max(axis=1) > 0.1
    skin = surface_of(elements[middle])
    both = np.concatenate([skin, surface_of(elements) + len(points)])
    loops = skin_loops(np.concatenate([points, apart]) + np.array([0.0, 0.0, 0.03]), both)
    assert sorted(map(area, loops)) == pytest.approx([-0.04, 0.16, 0.16])

"""What a picture shows is what the run folder holds, where it holds it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from flowborne.kernels.arrays import Pixels
from flowborne.view import style
from flowborne.view.fields import (
    FieldDye,
    FieldVorticity,
    field_of,
    full_strength,
    over,
    slab_vorticity,
    vorticity_limit,
)
from flowborne.view.layout import Box
from flowborne.view.pictures import Picture
from flowborne.view.plots import shortened
from flowborne.view.run import Run

Write = Callable[..., Path]


def rgb(colour: str) -> Pixels:
    return np.rint(255.0 * style.rgb(colour)).astype(int)


def cut_out(pixels: Pixels, box: Box) -> Pixels:
    """(h, w, 3) the part of a picture at scale 1 in a box."""
    rows, columns = slice(box.top, box.top + box.height), slice(box.left, box.left + box.width)
    return pixels[rows, columns, :3].astype(int)


def pixel_of(picture: Picture, x: float, y: float) -> tuple[int, int]:
    """(row, column) in the map of a place in m."""
    x0, x1, y0, y1 = picture.map.views[0]
    box = picture.layout.map
    return int((y1 - y) / (y1 - y0) * box.height), int((x - x0) / (x1 - x0) * box.width)


def like(pixels: Pixels, colour: str, within: int = 12) -> Pixels:
    return np.abs(pixels - rgb(colour)).max(axis=-1) <= within


def at_cells(picture: Picture, pixels: Pixels) -> Pixels:
    """(ny, nx, 3) the map's pixels at the centres of the cells, lowest row first."""
    grid = picture.run.grid
    assert grid is not None
    x, y, _ = grid.cell_coordinates()
    places = [[pixel_of(picture, float(a), float(b)) for a in x] for b in y]
    rows, columns = np.moveaxis(np.array(places), -1, 0)
    return pixels[rows, columns]


@pytest.mark.parametrize("wanted", ["dye", "vorticity"])
def test_the_map_shows_every_cell_where_it_is(write_run: Write, wanted: str) -> None:
    """Cell by cell the field's own colour; not so upside down or mirrored."""
    run = Run(write_run(field=wanted))
    picture, field = Picture(run), field_of(run, run.shot)
    assert isinstance(field, FieldDye if wanted == "dye" else FieldVorticity)
    fine = over(field.image(run.state(6)), style.WATER).astype(int)
    parts = fine.shape[0] // 96
    middle = slice((parts - 1) // 2, parts // 2 + 1)
    expected = fine.reshape(96, parts, 96, parts, 3)[:, middle, :, middle].mean(axis=(1, 3))
    found = at_cells(picture, cut_out(picture.draw(6), picture.layout.map))
    free = np.ones(found.shape[:2], bool)
    free[35:75, 20:70] = False  # the bodies and the arrow
    apart = np.abs(found - expected).mean(axis=-1)
    assert apart[free].mean() < 6.0
    for other in (expected[::-1], expected[:, ::-1]):
        assert np.abs(found - other).mean(axis=-1)[free].mean() > 2.0 * apart[free].mean() + 5.0


def test_dye_has_its_colour_where_dye_is_and_water_its_own_elsewhere(write_run: Write) -> None:
    run = Run(write_run())
    picture = Picture(run)
    pixels = cut_out(picture.draw(6), picture.layout.map)
    dye = run.state(6)["scalar_dye"][:, :, 0].T
    colours = at_cells(picture, pixels)
    inside = np.zeros(dye.shape, bool)
    inside[2:20, 2:-2] = True  # below the bodies, away from the edge
    for strength, colour in ((1.0, rgb(style.DYES[0]) * 0.75 + 64), (0.0, rgb(style.WATER))):
        here = np.abs(dye - strength) < 1e-6
        middle = here & np.roll(here, 1, 0) & np.roll(here, -1, 0) & inside
        assert middle.sum() > 100
        assert np.abs(colours[middle] - colour).max() < 20
    darkest = pixels.reshape(-1, 3).min(axis=0)
    assert np.all(np.minimum(rgb(style.EDGE), rgb(style.WATER)) - 1 <= darkest)


def test_two_dyes_have_two_colours_and_mix(write_run: Write) -> None:
    run = Run(write_run(dyes=("dye", "smoke")))
    field = FieldDye(run)
    assert field.legend == [("dye", style.DYES[0]), ("smoke", style.DYES[1])]
    state = dict(run.state(0))
    one, nothing = np.ones_like(state["open"]), np.zeros_like(state["open"])
    state["open"] = one
    alone = field.image(state | {"scalar_dye": one, "scalar_smoke": nothing})[0, 0].astype(int)
    other = field.image(state | {"scalar_dye": nothing, "scalar_smoke": one})[0, 0].astype(int)
    both = field.image(state | {"scalar_dye": one, "scalar_smoke": one})[0, 0].astype(int)
    assert np.abs(alone - other).max() > 60
    assert np.abs(both - (alone + other) // 2).max() <= 2


def test_full_colour_is_that_of_most_dye_and_not_of_a_swing() -> None:
    bands = np.repeat([0.0, 1.0], 500)
    assert full_strength([bands]) == 1.0
    bands[500:520], bands[:20] = 1.4, -0.3
    assert full_strength([bands, bands]) == pytest.approx(1.0)
    assert full_strength([np.zeros(9)]) == 1.0
    assert full_strength([np.array([np.nan, 0.5, 0.5])]) == 0.5


@pytest.mark.parametrize("force", [(30.0, 12.0), (-8.0, 25.0), (5.0, -30.0)])
def test_the_arrow_points_along_the_force_from_the_bodys_middle(
    write_run: Write, synthetic: ModuleType, force: tuple[float, float]
) -> None:
    picture = Picture(Run(write_run(force=force)))
    box = picture.layout.map
    assert not like(cut_out(picture.draw(0), box), style.FORCE).any(), "there is no force yet"
    rows, columns = np.nonzero(like(cut_out(picture.draw(4), box), style.FORCE))
    start = np.array(pixel_of(picture, *synthetic.CENTRE))
    away = np.stack([columns - start[1], start[0] - rows], axis=-1).astype(float)
    along = np.array(force) / np.hypot(*force)
    length = (away @ along).max()
    assert length > 60.0
    assert (away @ along).min() > -4.0
    assert np.abs(away @ [-along[1], along[0]]).max() < 0.15 * length


def test_arrows_are_as_long_as_forces_are_large(write_run: Write) -> None:
    """Half the force in one frame: half the length, on the film's one scale."""
    folder = write_run(force=(40.0, 0.0))
    path = folder / "states" / "000003.npz"
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    np.savez(path, **arrays | {"fluid_force": 0.5 * arrays["fluid_force"]})
    picture = Picture(Run(folder))
    lengths = []
    for frame in (3, 4):
        shown = like(cut_out(picture.draw(frame), picture.layout.map), style.FORCE)
        lengths.append(np.ptp(np.nonzero(shown)[1]))
    assert lengths[0] / lengths[1] == pytest.approx(0.5, abs=0.05)


def test_bodies_stand_where_they_are_in_their_colours(
    write_run: Write, synthetic: ModuleType
) -> None:
    picture = Picture(Run(write_run(force=(0.0, 0.0))))
    for frame in (1, 6):
        pixels = cut_out(picture.draw(frame), picture.layout.map)
        turn = synthetic.angle_at(frame)
        along = np.array([np.cos(turn), np.sin(turn)])
        across = np.array([-along[1], along[0]])
        for s, inside in ((0.0, True), (0.45, True), (0.55, False)):
            row, column = pixel_of(picture, *(synthetic.CENTRE + s * along))
            assert like(pixels[row, column], style.ACCENT) == inside
        row, column = pixel_of(picture, *(synthetic.CENTRE + 0.12 * across))
        assert not like(pixels[row, column], style.ACCENT)
        row, column = pixel_of(picture, *(synthetic.CENTRE - 0.5 * along - [0.1, -0.1]))
        assert like(pixels[row, column], style.FIXED)


def test_strips_are_drawn_over_time(write_run: Write) -> None:
    """Brightly up to the frame's own time, where the cursor stands; faintly after it."""
    picture = Picture(Run(write_run(frames=24)))
    assert len(picture.layout.strips) == 2
    for box in picture.layout.strips:
        reached, area = [], []
        for frame in (6, 12, 24):
            shown = cut_out(picture.draw(frame), box)
            bright = like(shown, style.CURVES[0], 40)
            reached.append(int(np.nonzero(bright.any(axis=0))[0].max()))
            area.append(int(bright.sum()))
        np.testing.assert_allclose(np.array(reached) / box.width, [0.25, 0.5, 0.99], atol=0.02)
        assert area[0] < area[1] < area[2]
        assert not like(cut_out(picture.draw(0), box), style.CURVES[0], 40).any()


def test_a_curve_has_the_shape_of_its_numbers(write_run: Write) -> None:
    run = Run(write_run(frames=24))
    picture = Picture(run)
    box = picture.layout.strips[1]
    bright = like(cut_out(picture.draw(24), box), style.CURVES[0], 40)
    angle = run.history["angle_hinge_rad"]
    columns = np.linspace(0.1, 0.9, 9)
    heights = [np.nonzero(bright[:, int(c * box.width)])[0].mean() for c in columns]
    expected = np.interp(1.01 * columns, run.history["time_s"], angle)
    assert np.corrcoef(heights, -expected)[0, 1] > 0.999


@pytest.mark.parametrize("wind", [(5.0, 0.0), (0.0, -3.0)])
def test_a_run_without_fluid_shows_its_wind(write_run: Write, wind: tuple[float, float]) -> None:
    picture = Picture(Run(write_run(fluid=False, wind=wind)))
    shown = like(cut_out(picture.draw(2), picture.layout.map), style.WIND)
    assert 0.005 < shown.mean() < 0.1
    across, down = (np.abs(np.diff(shown.astype(int), axis=axis)).sum() for axis in (1, 0))
    assert (down > 2 * across) == (wind[1] == 0.0), "long edges lie along the wind"


def test_nothing_to_show_is_left_out(write_run: Write) -> None:
    run = Run(write_run(fluid=False, objective=False, force=(0.0, 0.0)))
    picture = Picture(run)
    pixels = picture.draw(3)
    assert len(picture.layout.strips) == 1
    assert field_of(run, run.shot) is None
    assert not like(pixels[:, :, :3].astype(int), style.FORCE).any()


def test_a_state_with_numbers_lost_is_still_drawn(write_run: Write) -> None:
    """What a run that blew up leaves: not a number in velocity, dye and force."""
    folder = write_run()
    path = folder / "states" / "000006.npz"
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    for name in ("velocity_x", "scalar_dye"):
        arrays[name][40:44, 30:33] = np.nan
    arrays["fluid_force"][1] = np.nan
    np.savez(path, **arrays)
    for wanted in ("dye", "vorticity"):
        scene = folder / "scene.toml"
        scene.write_text(f'name = "lost"\n[film]\nfield = "{wanted}"\n')
        picture = Picture(Run(folder))
        assert not like(cut_out(picture.draw(6), picture.layout.map), style.FORCE).any()


def test_strong_vorticity_keeps_the_colour_of_its_sense(write_run: Write) -> None:
    """At both ends of the scale one of red and blue is far above the other, and none is white."""
    table = FieldVorticity(Run(write_run()), style.WATER).table.astype(int)
    for rows, first, last in ((table[: len(table) // 3], 2, 0), (table[-len(table) // 3 :], 0, 2)):
        assert (rows[:, first] - rows[:, last]).min() > 60
    strong = table[[0, -1], :3].max(axis=1) - table[[0, -1], :3].min(axis=1)
    assert strong.min() > 120


def test_a_scale_of_vorticity_does_not_depend_on_the_still_water_around() -> None:
    wake = np.array([5.0, -4.0, 3.0, -2.0, 1.0])
    assert vorticity_limit([wake, np.zeros(20)]) == vorticity_limit([wake, np.zeros(20_000)]) == 4.0
    assert vorticity_limit([np.array([np.nan])]) == 1.0


def test_faces_of_cut_cells_carry_no_vorticity(write_run: Write) -> None:
    """Whatever velocity they have; what is around a body is continued up to its edge."""
    run = Run(write_run())
    assert run.grid is not None
    state = dict(run.state(3))
    cut = state["open"] < 1.0
    wild = {name: values.copy() for name, values in state.items()}
    for axis, name in enumerate(("velocity_x", "velocity_y")):
        for side in (slice(None, -1), slice(1, None)):
            part = (slice(None),) * axis + (side,)
            wild[name][part][cut] = 1e3
    found, expected = slab_vorticity(wild, run.grid), slab_vorticity(state, run.grid)
    np.testing.assert_allclose(found, expected)
    edge = cut & (state["open"] > 0.0)
    assert np.count_nonzero(found[edge[:, :, 0]]) == edge.sum()


def test_vorticity_of_a_rigid_rotation_is_twice_its_rate(write_run: Write) -> None:
    run = Run(write_run())
    assert run.grid is not None
    state = dict(run.state(0))
    y, x = run.grid.face_coordinates(0)[1], run.grid.face_coordinates(1)[0]
    state["velocity_x"] = np.broadcast_to(-1.5 * y[None, :, None], state["velocity_x"].shape)
    state["velocity_y"] = np.broadcast_to(1.5 * x[:, None, None], state["velocity_y"].shape)
    np.testing.assert_allclose(
        slab_vorticity(state, run.grid)[state["open"][:, :, 0] > 0.5], 3.0, rtol=1e-9
    )


def test_a_bare_picture_has_a_bar_of_the_length_that_it_says(write_run: Write) -> None:
    run = Run(write_run())
    bare = run.shot.model_copy(update={"plots": False, "size": (480, 480)})
    with_bar = Picture(run, shot=bare).draw(2)[:, :, :3].astype(int)
    without = (
        Picture(run, shot=bare.model_copy(update={"scale_bar": False}))
        .draw(2)[:, :, :3]
        .astype(int)
    )
    rows, columns = np.nonzero(like(with_bar, style.TEXT, 4) & ~like(without, style.TEXT, 4))
    low = rows > 480 * 0.9
    row = np.bincount(rows[low]).argmax()
    bar = columns[rows == row]
    longest = max(np.split(bar, np.flatnonzero(np.diff(bar) > 1) + 1), key=len)
    # 1 m of the 4 m across
    assert len(longest) == pytest.approx(120, abs=3)


def test_long_names_of_curves_lose_their_middle():
    assert shortened("hinge", 10) == "hinge"
    assert shortened("rx_head_Armature", 10) == "rx_he…ture"
    assert all(len(shortened("a" * n, 7)) == min(n, 7) for n in range(1, 20))


def test_forces_of_rounding_have_no_arrow(write_run: Write) -> None:
    """A body in water at rest has forces of some 1e-11 N from rounding."""
    run = Run(write_run(force=(2e-11, 5e-12)))
    picture = Picture(run)
    assert picture.map.forces.large == 0.0
    assert picture.map.forces.arrows(run.state(3), 1e-3) == []


def test_an_image_that_fills_its_map_is_drawn_at_any_size(write_run: Write) -> None:
    """Rounding once took the shown part beyond the image's edge: 187 (96 / 187) > 96."""
    run = Run(write_run(field="dye"))
    shot = run.shot.model_copy(update={"plots": False, "size": (187, 187)})
    assert Picture(run, shot=shot).draw(1).any()

"""How thick the fluid sees bodies."""

import numpy as np
import pytest

from flowborne import Grid, load_scene
from flowborne.coupling.seen import seen_bodies
from flowborne.scenes.build import build
from flowborne.validation.worlds import mjcf
from flowborne.worlds import make_world

CUBE = Grid((20, 20, 20), 0.05, (-0.5, -0.5, -0.5))
TILE = np.array([[x, y, z] for x in (-0.3, 0.3) for y in (-0.3, 0.3) for z in (-0.01, 0.01)])


def seen_in(grid: Grid, *geoms: str) -> list:
    body = f'<body name="fin"><joint type="slide"/>{"".join(geoms)}</body>'
    return seen_bodies(make_world(mjcf(body), grid, solid_density=1000.0).setup)


def test_a_thick_body_is_seen_as_it_is():
    (fin,) = seen_in(CUBE, '<geom type="box" size="0.1 0.2 0.3"/>')
    assert (fin.name, fin.thickness, fin.seen, fin.cells, fin.tight) == (
        "fin",
        pytest.approx(0.2),
        pytest.approx(0.2),
        pytest.approx(4.0),
        True,
    )
    assert fin.sentence() == "fin: 0.2 m thick, 4 cells"


@pytest.mark.parametrize(
    "geom", ['type="box" size="0.2 0.01 0.2"', 'type="cylinder" size="0.2 0.01"']
)
def test_a_thin_one_as_thick_as_the_diagonal_of_a_cell(geom: str):
    (fin,) = seen_in(CUBE, f"<geom {geom}/>")
    assert fin.thickness == pytest.approx(0.02)
    assert 0.05 * np.sqrt(3.0) < fin.seen < 0.05 * 1.8
    assert fin.tight
    assert fin.sentence() == "fin: 0.02 m thick, seen as 0.0875 m, 1.7 cells: fewer than 3"


def test_of_several_parts_the_thinnest_counts_and_a_slab_has_no_thickness_across_it():
    slab = Grid.slab(20, 20, 0.05, (-0.5, -0.5))
    rod, block = '<geom type="sphere" size="0.09"/>', '<geom type="box" size="0.2 0.2 0.001"/>'
    (fin,) = seen_in(slab, rod, block)
    assert fin.thickness == fin.seen == pytest.approx(0.18)


def test_a_thin_mesh_as_a_thin_box():
    vertices = " ".join(f"{x:g}" for x in TILE.ravel())
    model = (
        f'<mujoco><asset><mesh name="tile" vertex="{vertices}"/></asset><worldbody>'
        '<body name="tile"><joint type="slide"/><geom type="mesh" mesh="tile" contype="0" '
        'conaffinity="0"/></body></worldbody></mujoco>'
    )
    (tile,) = seen_bodies(make_world(model, CUBE, solid_density=1000.0).setup)
    assert tile.thickness == pytest.approx(0.02)
    assert tile.tight
    assert tile.sentence() == "tile: 0.02 m thick, seen as 0.0875 m, 1.7 cells: fewer than 3"


def test_flesh_hides_the_bones_in_it():
    seen = {one.name: one for one in seen_bodies(build(load_scene("swimmer-jet-only")).world.setup)}
    assert all(one.tight for one in seen.values())
    assert len(seen) == 1


def test_nothing_is_seen_without_a_fluid():
    assert seen_bodies(build(load_scene("block-drag-max")).world.setup) == []

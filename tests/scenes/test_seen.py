"""How thick the fluid sees bodies."""

import numpy as np
import pytest

from flowborne import Grid, load_scene
from flowborne.scenes.build import build
from flowborne.scenes.seen import Seen, seen_bodies
from flowborne.worlds import make_world
from flowborne_validation.worlds import mjcf

CUBE = Grid((20, 20, 20), 0.05, (-0.5, -0.5, -0.5))
FINE = Grid((64, 64, 64), 1.0 / 64.0, (-0.5, -0.5, -0.5))
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
    rod = '<geom type="sphere" size="0.09" pos="0.2 0 0"/>'
    block = '<geom type="box" size="0.2 0.2 0.001"/>'
    (fin,) = seen_in(slab, rod, block)
    assert fin.thickness == fin.seen == pytest.approx(0.18)
    (fin,) = seen_in(slab, rod.replace("0.2 0 0", "0.1 0 0"), block)
    assert fin.thickness == fin.seen == pytest.approx(0.4)  # no fluid meets the rod


def mesh_seen_in(grid: Grid, corners: np.ndarray, name: str = "fin") -> Seen:
    """The convex hull of corners (k, 3), as the mesh of a body."""
    vertices = " ".join(f"{x:g}" for x in corners.ravel())
    model = (
        f'<mujoco><asset><mesh name="{name}" vertex="{vertices}"/></asset><worldbody>'
        f'<body name="{name}"><joint type="slide"/><geom type="mesh" mesh="{name}" contype="0" '
        'conaffinity="0"/></body></worldbody></mujoco>'
    )
    (body,) = seen_bodies(make_world(model, grid, solid_density=1000.0).setup)
    return body


def test_a_thin_mesh_as_a_thin_box():
    tile = mesh_seen_in(CUBE, TILE, "tile")
    assert tile.thickness == pytest.approx(0.02)
    assert tile.tight
    assert tile.sentence() == "tile: 0.02 m thick, seen as 0.0875 m, 1.7 cells: fewer than 3"


def wedge(high: float) -> np.ndarray:
    """Corners of a wedge 0.6 m long whose back is `high` m high."""
    ends = ((-0.3, 0.0), (0.3, -0.5 * high), (0.3, 0.5 * high))
    return np.array([(x, y, z) for z in (-0.3, 0.3) for x, y in ends])


@pytest.mark.parametrize("grid", [FINE, Grid.slab(64, 64, 1.0 / 64.0, (-0.5, -0.5))])
def test_of_a_wedge_the_edge_is_lost_as_far_as_a_cell_fits_not_in(grid: Grid):
    """Half a cell over half its angle's tangent of 1/6 is 3 cells."""
    fin = mesh_seen_in(grid, wedge(0.2))
    assert fin.tip_cells == pytest.approx(3.0, abs=0.4)
    assert fin.tips == pytest.approx(fin.tip_cells / 64.0)
    assert fin.sentence().endswith(
        f"; {fin.tips:.3g} m of a tip, {fin.tip_cells:.2g} cells, are thinner than a cell and seen "
        "rounded off. Blunt it or refine the grid"
    )


def test_a_blunt_wedge_and_a_plate_have_no_tips_to_tell_of():
    for corners in (wedge(0.9), TILE):
        fin = mesh_seen_in(CUBE, corners)
        assert fin.tip_cells < 1.0
        assert "tip" not in fin.sentence()


def test_the_rim_of_a_flat_ellipsoid_is_lost_and_told_of_beside_its_thickness():
    """It is seen as 1.75 cells thick; a cell fits in where half of that is half a cell."""
    (fin,) = seen_in(CUBE, '<geom type="ellipsoid" size="0.4 0.4 0.01"/>')
    assert fin.tip_cells == pytest.approx(8.0 * (1.0 - np.sqrt(1.0 - 0.25 / 0.875**2)), abs=0.4)
    said = "fin: 0.02 m thick, seen as 0.0875 m, 1.7 cells: fewer than 3; "
    assert fin.sentence().startswith(said + f"{fin.tips:.3g} m of a tip")


def test_of_several_parts_the_longest_tip_counts():
    flat, rod = (
        '<geom type="ellipsoid" size="0.45 0.45 0.045"/>',
        '<geom type="capsule" size="0.0445 0.1"/>',
    )
    (alone,), (both,) = seen_in(CUBE, flat), seen_in(CUBE, flat, rod)
    assert both.thickness == pytest.approx(0.089)
    assert both.tips == alone.tips > 0.05


def test_flesh_hides_the_bones_in_it():
    seen = {one.name: one for one in seen_bodies(build(load_scene("swimmer-jet-only")).world.setup)}
    assert all(one.tight and one.tip_cells < 1.0 for one in seen.values())
    assert len(seen) == 1


def test_nothing_is_seen_without_a_fluid():
    assert seen_bodies(build(load_scene("block-drag-max")).world.setup) == []

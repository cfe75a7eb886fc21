import numpy as np
import pytest

import flowborne as fb
from flowborne.coupling.stream import flow_at
from flowborne.worlds import make_world, set_velocity
from flowborne_validation.worlds import mjcf

BLOCK = '<body name="block"><geom type="box" size=".2 .2 .2"/></body>'


@pytest.mark.parametrize(
    "grid",
    [fb.Grid.slab(24, 20, 0.1, (-1.2, -1.0)), fb.Grid((14, 12, 13), 0.1, (-0.7, -0.6, -0.65))],
    ids=["slab", "room"],
)
def test_linear_fields_are_read_exactly_and_bodies_have_no_pressure(grid):
    world = make_world(mjcf(BLOCK), grid)
    set_velocity(world, lambda x, y, z, *_: (1.0 + 2.0 * y, 0.5 * x, 0.0 * x))
    _, state = world.flow()
    x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    state.pressure[:] = 3.0 * x - 4.0 * y
    points = np.array([[0.43, 0.11, 0.0], [-0.37, 0.4, 0.0], [0.0, 0.0, 0.0]])
    found = flow_at(world, points)
    px, py, _ = points[:2].T
    np.testing.assert_allclose(found.velocity[:2, 0], 1.0 + 2.0 * py, atol=1e-12)
    np.testing.assert_allclose(found.velocity[:2, 1], 0.5 * px, atol=1e-12)
    np.testing.assert_allclose(found.pressure[:2], 3.0 * px - 4.0 * py, atol=1e-12)
    assert np.isnan(found.pressure[2])

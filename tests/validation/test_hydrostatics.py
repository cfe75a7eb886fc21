"""F5: fluid at rest around cut cells, over fewer steps."""

import numpy as np
import pytest

from flowborne import Grid
from flowborne.validation import case
from flowborne.validation.hydrostatics import BOX, SLAB, displaced, fixed_bodies
from flowborne.worlds import make_world


def test_F5_fluid_and_bodies_stay_at_rest():
    results = case("F5").run(quick=True)
    assert len(results) == 10
    for result in results:
        assert result.verdict == "pass", (result.quantity, result.value)


def finer(grid):
    """The same box with half the spacing."""
    nx, ny, nz = grid.shape
    if grid.is_slab:
        return Grid.slab(2 * nx, 2 * ny, 0.5 * grid.spacing, grid.origin[:2])
    return Grid((2 * nx, 2 * ny, 2 * nz), 0.5 * grid.spacing, grid.origin)


@pytest.mark.parametrize(
    ("grid", "exact"),
    [
        (SLAB, (np.pi * 0.123**2, 4.0 * 0.131 * 0.083, np.pi * 0.151 * 0.092)),
        (
            BOX,
            (
                4.0 / 3.0 * np.pi * 0.123**3,
                8.0 * 0.131 * 0.083 * 0.11,
                4.0 / 3.0 * np.pi * 0.151 * 0.092 * 0.11,
            ),
        ),
    ],
)
def test_F5_discrete_volume_is_the_bodies_own(grid, exact):
    """The volume of Archimedes' force on cut cells comes to that of the shapes at order 2."""
    errors = []
    for g in (grid, finer(grid)):
        volume, _ = displaced(make_world(fixed_bodies(g), g))
        wrong = volume[1:4, list(g.axes)] / np.array(exact)[:, None] - 1.0
        errors.append(np.abs(wrong).max())
    order = np.log2(errors[0] / errors[1])
    assert order > 1.9, (order, errors)
    assert errors[1] < 0.03, errors

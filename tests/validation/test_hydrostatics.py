"""F5: fluid at rest around cut cells, over fewer steps."""

from dataclasses import replace

import numpy as np
import pytest

from flowborne import Grid
from flowborne.worlds import make_world
from flowborne_validation.cases import case
from flowborne_validation.hydrostatics import BOX, SLAB, displaced, fixed_bodies


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
    """The volume of Archimedes' force on cut cells comes to that of the shapes in the root mean
    square over nine places in the cell.

    Closed faces are the trapezoidal rule over the shape's sections, exact ones, of order 1.5 at the
    round end of a shape in a slab.
    """
    errors = []
    for g in (grid, finer(grid)):
        wrong = []
        for place in np.ndindex(3, 3):
            x, y, z = g.origin
            moved = g.spacing * (np.array(place) - 0.9) / 3.0
            there = replace(g, origin=(x + moved[0], y + moved[1], z))
            volume, _ = displaced(make_world(fixed_bodies(g), there))
            wrong.append(volume[1:4, list(g.axes)] / np.array(exact)[:, None] - 1.0)
        errors.append(float(np.sqrt(np.square(wrong).mean(axis=0)).max()))
    order = np.log2(errors[0] / errors[1])
    assert order > 1.5, (order, errors)
    assert errors[1] < 0.03, errors

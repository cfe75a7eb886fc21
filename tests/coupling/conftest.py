"""Grids cut by bodies, for the tests of this folder."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flowborne import Grid
from flowborne.coupling.fractions import Geometry
from flowborne.worlds import Boundaries, cut_by_bodies, make_world
from flowborne_validation.worlds import mjcf

from .meshes import meshed_mjcf

Cut = Callable[..., Geometry]


def cut_grid(
    grid: Grid,
    *bodies: str,
    q: np.ndarray | None = None,
    boundaries: Boundaries | None = None,
    meshes: bool = False,
) -> Geometry:
    """The grid cut by bodies (MJCF elements) in their rest pose, or at q; `meshes` in place of
    boxes."""
    model = (meshed_mjcf if meshes else mjcf)(*bodies)
    world = make_world(model, grid, boundaries=boundaries or Boundaries())
    if q is not None:
        world.solid.q[:] = q
    return cut_by_bodies(world)


@pytest.fixture(scope="session")
def cut() -> Cut:
    return cut_grid

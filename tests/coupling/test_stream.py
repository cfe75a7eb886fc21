"""A fluid that does not feel the bodies blows on them as a simple wind does."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.coupling.step import step
from flowborne.coupling.stream import Sampled, WindStream
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.kinds import BoundaryInflow, BoundaryOpen
from flowborne.kernels.arrays import Array
from flowborne.solids.model import SolidModel
from flowborne.solids.wind import WindFaces

FLAG = """
<mujoco><worldbody><body name="flag"><joint name="pole" type="ball"/>
  <geom type="box" size="0.2 0.01 0.1" pos="0.2 0 0" density="400"/>
</body></worldbody></mujoco>
"""


def stream(x: Array, y: Array, z: Array, time: float = 0.0) -> tuple[Array, Array, Array]:
    return 1.5 + 0 * x, 0.5 + 0 * x, 0 * x


def flag(grid: Grid, *, one_way: bool) -> World:
    model = SolidModel.from_string(FLAG, slab=grid.is_slab, gravity=(0.0, 0.0, 0.0))
    sides = Boundaries(BoundaryInflow(stream), BoundaryOpen(), BoundaryInflow(stream))
    sides = Boundaries(sides.x_min, sides.x_max, sides.y_min, BoundaryOpen())
    fluid = Fluid(grid, 1.2, boundaries=sides, one_way=one_way)
    world = World.at_rest(Setup(model, fluid, winds=(WindStream(1.2),)))
    for axis, speed in enumerate((1.5, 0.5)):
        world.flow()[1].velocity[axis][:] = speed
    return world


@pytest.mark.parametrize(
    "grid",
    [Grid.slab(16, 16, 0.1, (-0.8, -0.8)), Grid((12, 10, 8), 0.1, (-0.6, -0.5, -0.4))],
    ids=["slab", "3D"],
)
def test_the_stream_pushes_as_a_wind_and_does_not_feel_the_body(grid: Grid) -> None:
    world = flag(grid, one_way=True)
    alone = World.at_rest(Setup(world.setup.solid, winds=(WindFaces((1.5, 0.5, 0.0), 1.2),)))
    for _ in range(10):
        report, plain = step(world, 0.02), step(alone, 0.02)
        assert np.abs(report.pressure_wrench).max() == 0.0
        assert report.wind_wrench == pytest.approx(plain.wind_wrench, rel=1e-9)
    assert np.abs(world.solid.v).max() > 0.01
    for axis, speed in enumerate((1.5, 0.5)):
        assert world.flow()[1].velocity[axis] == pytest.approx(speed, rel=1e-8)


def test_velocities_between_faces_are_linear() -> None:
    grid = Grid((6, 5, 4), 0.25, (-0.5, 0.0, 1.0))
    faces = grid.zeros_faces()
    for axis in range(3):
        x, y, z = np.meshgrid(*grid.face_coordinates(axis), indexing="ij")
        faces[axis][:] = (axis + 1.0) + 2.0 * x - 0.5 * y + 3.0 * z
    places = np.random.default_rng(2).uniform([-0.3, 0.2, 1.2], [0.8, 1.0, 1.8], (50, 3))
    found = Sampled(faces, grid)(places, 0.0)
    expected = places @ [2.0, -0.5, 3.0]
    assert found == pytest.approx(expected[:, None] + [1.0, 2.0, 3.0])
    assert Sampled(faces, grid)(np.array([[9.0, 9.0, 9.0]]), 0.0).max() <= faces[2].max()


def test_a_stream_needs_a_fluid() -> None:
    world = World.at_rest(Setup(SolidModel.from_string(FLAG), winds=(WindStream(1.2),)))
    with pytest.raises(ValueError, match="needs a world with a fluid"):
        step(world, 0.02)

"""The MAC grid's coordinates and sizes."""

import numpy as np

from flowborne.fluid.grid import Grid


def test_slab_is_per_unit_depth() -> None:
    grid = Grid.slab(4, 3, 0.5, (-1.0, 2.0))
    assert grid.is_slab
    assert grid.axes == (0, 1)
    assert grid.cell_volume == 0.25
    assert grid.face_area == 0.5
    assert grid.upper[:2] == (1.0, 3.5)
    assert grid.cell_coordinates()[2].tolist() == [0.0]


def test_faces_lie_between_cells() -> None:
    grid = Grid((3, 4, 5), 0.25, (1.0, 2.0, 3.0))
    centres = grid.cell_coordinates()
    for axis in range(3):
        faces = grid.face_coordinates(axis)
        assert [c.size for c in faces] == list(grid.face_shape(axis))
        np.testing.assert_allclose(0.5 * (faces[axis][1:] + faces[axis][:-1]), centres[axis])

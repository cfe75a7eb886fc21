"""A step on two threads gives the bits of one thread."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Array, step
from flowborne.kernels import jit
from flowborne.kernels.jit import kernel_threads

from .worlds import DT, Case, Piece


@pytest.mark.parametrize("slab", [True, False], ids=["slab", "room"])
def test_threads_change_no_bit_of_a_step(slab: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """All kernels run as they do on large grids."""
    boxes = tuple(
        Piece(
            kind="box",
            size=np.array([0.1235, 0.0867, 0.10388]),
            place=np.array(place),
            turn=np.array([0.6973, 0.0, 0.0, 0.2157]),
            joint=joint,
            axis=np.array([0.0, 0.0, 1.0]),
        )
        for place, joint in (((0.0185, -0.1786, 0.0), "hinge"), ((-0.114, -0.062, 0.0), "slide"))
    )
    sides = ("through", "no-slip", "closed" if slab else "periodic")
    case = Case((12, 13, 1 if slab else 9), sides, boxes, 2.0, 0.001, 7)

    def stepped() -> list[Array]:
        world = case.world()
        for _ in range(2):
            step(world, DT)
        state = world.flow()[1]
        return [*state.velocity, state.pressure, world.solid.q, world.solid.v]

    one = stepped()
    monkeypatch.setattr(jit, "LARGE", 0)
    with kernel_threads(2):
        two = stepped()
    for first, second in zip(one, two, strict=True):
        np.testing.assert_array_equal(first, second)

"""V5: how the cylinder on its spring sets out."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.validation.induced_vibration import MASS, sprung
from flowborne.worlds import advance


def test_V5_the_spring_moves_the_cylinder_and_its_added_mass():
    """Of six cells across it, which give 1.2 % too much acceleration."""
    world = sprung(6, 5.0)
    world.solid.q[0] = 0.2
    advance(world, 1e-3)
    stiffness = MASS * (2.0 * np.pi / 5.0) ** 2
    free = -stiffness * 0.2 / (MASS + 0.25 * np.pi)
    assert world.solid.v[0] / 1e-3 == pytest.approx(1.0122 * free, rel=2e-3)

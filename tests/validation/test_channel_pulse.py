"""B3, its first instants."""

from __future__ import annotations

import numpy as np

from flowborne.validation.channel_pulse import DURATION, Pulse, pulse
from flowborne.validation.fixed_bodies import DIAMETER, HEIGHT


def test_B3_the_inflow_swells_and_dies_away():
    y = np.array([0.0, 0.5 * HEIGHT, HEIGHT])
    for time, peak in ((0.0, 0.0), (0.5 * DURATION, 1.5), (DURATION, 0.0)):
        u, v, _ = Pulse()(np.zeros(3), y, np.zeros(3), time)
        np.testing.assert_allclose(u, [0.0, peak, 0.0], atol=1e-12)
        assert not v.any()


def test_B3_begins_as_an_ideal_fluid_that_is_set_going():
    """The stream's own pressure gradient and the added mass: 2 rho pi D^2 / 4 dU/dt. The parabola
    comes in and evens out downstream: U lies between its mean and its peak."""
    _, drag, lift, _ = pulse(10, duration=0.1)[1]
    force = 2.0 * 0.25 * np.pi * DIAMETER**2 * 1.5 * np.pi / DURATION
    assert 2.0 / 3.0 < drag / (2.0 * force / DIAMETER) < 1.0
    assert abs(lift) < 0.02 * drag

"""K11 in short: the upstroke of the flyer, with and without twist, on a coarse grid."""

from __future__ import annotations

import numpy as np

from flowborne.validation.flyer import COARSE, Flight, fly

UPSTROKE = {**COARSE, "motion.0.phase": "-90.0", "motion.1.phase": "-90.0"}
"""Both wings start at the bottom."""


def test_K11_twisted_wings_are_drawn_up_with_less_drag() -> None:
    base, twist = (fly(scene, 0.5, UPSTROKE) for scene in ("flyer-base", "flyer-twist"))
    assert np.all(np.diff(base.stroke) > 0.0)
    ((_, pressed),), ((_, feathered),) = base.impulses(), twist.impulses()
    assert pressed < -60.0
    assert feathered > 0.8 * pressed


def test_impulses_are_those_of_half_strokes() -> None:
    time = np.arange(1, 81) * 0.05
    stroke = np.cos(np.pi * time)
    down = np.gradient(stroke) < 0.0
    found = Flight(time, stroke, np.where(down, 3.0, -1.0), 2.0).impulses()
    np.testing.assert_allclose(found, [[3.0, -1.0], [3.0, -1.0]], atol=0.16)

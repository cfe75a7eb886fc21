"""K11 in short: upstrokes of the flyers, with and without control, on a coarse grid."""

from __future__ import annotations

import numpy as np

from flowborne.validation.flyer import COARSE, Flight, fly

UPSTROKE = {**COARSE, "motion.0.phase": "-90.0", "motion.1.phase": "-90.0"}
"""Both wings start at the bottom."""


def test_K11_twisted_wings_are_drawn_up_with_less_drag() -> None:
    fine = {**UPSTROKE, "domain.resolution": "24"}  # on 16 cells hinges close more than wings do
    base, twist = (fly(scene, 0.5, fine) for scene in ("flyer-base", "flyer-twist"))
    assert np.all(np.diff(base.stroke) > 0.0)
    ((_, pressed),), ((_, feathered),) = base.impulses(), twist.impulses()
    assert pressed < -60.0
    assert feathered > 0.8 * pressed


def test_K11_wings_of_flesh_fold_on_their_way_up() -> None:
    brief = {**UPSTROKE, "domain.resolution": "26"}
    straight, bent = (fly("flyer-flesh", 0.1, brief, controlled) for controlled in (False, True))
    ((_, pressed),), ((_, folded),) = straight.impulses(), bent.impulses()
    assert pressed < -8.0
    assert folded > 0.5 * pressed


def test_impulses_are_those_of_half_strokes() -> None:
    time = np.arange(1, 81) * 0.05
    stroke = np.cos(np.pi * time)
    down = np.gradient(stroke) < 0.0
    found = Flight(time, stroke, np.where(down, 3.0, -1.0), 2.0).impulses()
    np.testing.assert_allclose(found, [[3.0, -1.0], [3.0, -1.0]], atol=0.16)

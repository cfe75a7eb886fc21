"""Cases I4, I6, I7, I8 and I9, short and on coarse grids."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.worlds import Boundaries, BoundaryOpen
from flowborne_validation import cases
from flowborne_validation import inviscid as case
from flowborne_validation.worlds import PERIODIC


def test_I4_neutrally_buoyant_bodies_stay() -> None:
    for result in cases.case("I4").run(quick=True):
        assert result.verdict == "pass", f"{result.quantity}: {result.value}"


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.3, 0.1), (0.5, 0.5)])
def test_I6_moment_converges_to_munk_and_force_to_none(place: tuple[float, float]) -> None:
    """With second order: off by less than 36/n^2, and so less than 4, 1, 0.25 %, wherever the
    ellipse is in its cell."""
    for cells in (32, 64, 128):
        moment, force = case.held_ellipse(cells, np.radians(30.0), place)
        assert abs(moment / np.sin(np.radians(60.0)) - 1.0) < 36.0 / cells**2
        assert force < 0.006 * (128 / cells) ** 2


@pytest.mark.parametrize("ratio", [2.0, 0.5])
def test_I7_period_hanging_and_standing(ratio: float) -> None:
    exact = case.small_period(ratio, 2.0)
    assert case.swing(2.0, case.ROD, 48, ratio, 5.0, exact) == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize("solid", [False, True])
def test_I8_plug_moves_all_the_fluid(solid: bool) -> None:
    ends = BoundaryOpen()
    for sides in (Boundaries(ends, ends), Boundaries(PERIODIC, PERIODIC)):
        assert case.slug(8, 0.5, 0.1, sides, 5, solid) == pytest.approx(1.0, abs=1e-9)


def test_I9_a_free_body_never_gains_energy_and_loses_less_on_a_finer_grid() -> None:
    coarse, fine = case.turning(8), case.turning(16)
    for energies in (coarse, fine):
        assert (np.diff(energies) < 0.0).all()
    assert 1.0 - coarse[-1] < 0.07
    assert 1.0 - fine[-1] < 0.022

"""Error bars from known numbers, and from the runs of a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import flowborne as fb
import flowborne.studies.error_bars as error_bars
from flowborne import Refinement
from flowborne.sim.endings import RunOutcome

from ..made_runs import spring_scene


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("cells", [(10, 20, 40), (10, 14, 30), (24, 61, 90)])
def test_order_and_limit_of_a_power_law_are_found(order: float, cells: tuple[int, ...]) -> None:
    values = [3.0 - 50.0 * (1.0 / n) ** order for n in cells]
    found = Refinement.of(cells, values)
    assert found.convergence == "monotone"
    assert found.order == pytest.approx(order, rel=1e-9)
    assert found.extrapolated == pytest.approx(3.0, rel=1e-9)
    assert found.value == values[-1]
    assert found.spread == pytest.approx(values[-1] - values[0])
    factor = 1.25 if order == 2.0 else 3.0
    remaining = abs(values[-1] - values[-2]) / ((cells[2] / cells[1]) ** min(order, 2.0) - 1.0)
    assert found.uncertainty == pytest.approx(factor * remaining)
    assert found.uncertainty > abs(3.0 - values[-1])


def test_celik_s_example_has_his_order_and_extrapolated_value() -> None:
    """Celik et al. 2008, table 1, first column: reattachment length on 4,500 to 18,000 cells."""
    cells = np.sqrt([4500.0, 8000.0, 18000.0])
    found = Refinement.of(cells, [5.863, 5.972, 6.063])
    assert found.order == pytest.approx(1.53, abs=0.005)
    assert found.extrapolated == pytest.approx(6.1685, abs=5e-5)
    grid_convergence_index = 1.25 * (found.extrapolated - 6.063) / 6.063
    assert grid_convergence_index == pytest.approx(0.022, abs=5e-4)


@pytest.mark.parametrize("values", [(1.0, 3.0, 2.5), (1.0, 1.1, 1.4), (1.0, 1.0, 2.0), (1.0, 2, 3)])
def test_without_an_order_the_bar_is_how_far_values_are_apart(values: tuple[float, ...]) -> None:
    found = Refinement.of((8, 16, 32), values)
    assert found.convergence == "none"
    assert math.isnan(found.order)
    assert math.isnan(found.extrapolated)
    assert found.uncertainty == max(values) - min(values)


def test_a_very_low_order_has_a_wide_bar_and_no_limit() -> None:
    found = Refinement.of((8, 16, 32), (1.0, 2.0, 2.95))
    assert 0.0 < found.order < 0.1
    assert math.isnan(found.extrapolated)
    assert found.uncertainty == pytest.approx(3.0 * 0.95 / (math.sqrt(2.0) - 1.0))


def test_a_change_that_only_looks_monotone_on_uneven_grids_has_no_order() -> None:
    """The second refinement is by less, and the difference is no smaller than that explains."""
    assert Refinement.of((10, 40, 50), (0.0, 1.0, 1.3)).convergence == "none"


def test_of_more_than_three_values_the_last_three_count_and_the_spread_is_of_all() -> None:
    found = Refinement.of((4, 8, 16, 32), (9.0, 1.0, 1.5, 1.625))
    assert found.order == pytest.approx(2.0)
    assert found.spread == 8.0


def test_two_values_show_no_order() -> None:
    found = Refinement.of((1, 2), (1.0, 1.3))
    assert (found.convergence, math.isnan(found.order)) == ("unknown", True)
    assert found.uncertainty == pytest.approx(3.0 * 0.3 / 3.0)


def test_values_that_are_all_the_same_have_no_error() -> None:
    found = Refinement.of((8, 16, 32), (2.0, 2.0, 2.0))
    assert (found.convergence, found.extrapolated, found.uncertainty) == ("equal", 2.0, 0.0)


@pytest.mark.parametrize(
    ("resolutions", "values", "problem"),
    [
        ((8,), (1.0,), "there are 1 values at 1 resolutions"),
        ((8, 16), (1.0, 2.0, 3.0), "there are 3 values at 2 resolutions"),
        ((16, 8), (1.0, 2.0), r"resolutions are \[16, 8\]"),
        ((0, 8), (1.0, 2.0), r"resolutions are \[0, 8\]"),
        ((8, 16), (1.0, math.nan), r"values are \[1.0, nan\]"),
    ],
)
def test_what_no_bar_can_be_put_on_is_refused(
    resolutions: tuple[int, ...], values: tuple[float, ...], problem: str
) -> None:
    with pytest.raises(ValueError, match=problem):
        Refinement.of(resolutions, values)


@dataclass
class Runs:
    """Stands in for runs, whose number would be 3 - 50 / cells^2 - 4 / steps^2, and 0.01 more with
    the eel's domain half a cell aside."""

    outcome: RunOutcome = RunOutcome.DONE
    scenes: list[fb.Scene] = field(default_factory=list)

    def run(self, scene: fb.Scene, out: Path, **options: object) -> SimpleNamespace:
        self.scenes.append(scene)
        return SimpleNamespace(outcome=self.outcome, message="it blew up in frame 3, step 1")

    def number(self, run: object) -> float:
        domain, time = self.scenes[-1].domain, self.scenes[-1].time
        assert domain is not None
        assert domain.resolution is not None
        aside = domain.lower[0] / domain.spacing()
        assert domain.lower == pytest.approx((aside * domain.spacing(),) * 2)
        assert np.subtract(domain.upper, domain.lower) == pytest.approx((1.22, 1.22))
        return 3.0 + 0.02 * aside - 50.0 / domain.resolution**2 - 4.0 / time.steps_per_frame**2


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Runs:
    made = Runs()
    monkeypatch.setattr(error_bars, "run", made.run)
    monkeypatch.setattr(error_bars, "OpenRun", lambda folder: None)
    return made


def test_bars_of_grid_step_and_place_are_added_and_no_run_is_made_twice(runs: Runs) -> None:
    found = fb.error_bar("eel", runs.number, (20, 40, 80), (1, 2, 4))
    assert len(runs.scenes) == 6
    assert found.grids is not None
    assert found.steps is not None
    assert (found.grids.order, found.steps.order) == pytest.approx((2.0, 2.0))
    assert found.value == pytest.approx(3.0 - 50.0 / 6400.0 - 0.25)
    assert found.shifted == pytest.approx(found.value + 0.01)
    assert found.uncertainty == pytest.approx(1.25 * (50.0 / 6400.0 + 0.25) + 0.01)
    assert found.spread == pytest.approx(4.0 - 0.25 + 0.01)
    assert str(found) == "2.742 ± 0.33 (grid 0.0098, step 0.31, place 0.01)"
    assert str(found.grids) == "2.742 ± 0.0098 (order 2)"


def test_a_run_that_ends_early_has_no_error_bar(runs: Runs) -> None:
    runs.outcome = RunOutcome.BLEW_UP
    with pytest.raises(
        fb.SceneError, match=r"bar of eel with domain\.resolution=20: it blew up in"
    ):
        fb.error_bar("eel", runs.number, (20, 40))


def test_steps_of_a_scene_show_the_order_of_its_scheme(tmp_path: Path) -> None:
    """A mass on a spring of 2 rad/s, let go, after half a second."""
    scene = spring_scene(tmp_path)

    def final(run: fb.OpenRun) -> float:
        return float(run.history["position_along_m"][-1])

    found = fb.error_bar(scene, final, steps=(8, 16, 32))
    assert (found.grids, found.shifted) == (None, None)
    assert found.steps is not None
    exact = math.cos(2.0 * 0.5)
    assert abs(found.value - exact) < found.uncertainty < 0.05
    assert found.steps.extrapolated == pytest.approx(exact, abs=1e-3)
    with pytest.raises(ValueError, match="no column 'position_along'"):
        fb.error_bar(scene, "position_along", steps=(2, 4), frames=1)
    with pytest.raises(ValueError, match="needs two grids or two steps"):
        fb.error_bar(scene, final, steps=(2,))

"""Cases K12 and K13 in short: the measure of scatter, and block and capsule on coarse grids."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Array
from flowborne_validation import controller_in_flow, scatter
from flowborne_validation.cases import case


def test_K12_scatter_is_what_no_smooth_curve_has() -> None:
    x = np.linspace(-1.0, 1.0, scatter.POSES)
    smooth = 500.0 + 200.0 * x - 90.0 * x**4
    assert scatter.scatter(smooth) < 1e-12
    noise = np.random.default_rng(1).normal(0.0, 0.05, x.size)
    assert scatter.scatter(smooth + 500.0 * noise) == pytest.approx(0.05, rel=0.3)


def test_K12_arcs_are_next_to_each_other() -> None:
    second, first = map(scatter.arc, scatter.ARCS)
    assert np.diff(np.concatenate([first, second])) == pytest.approx(scatter.APART)


def test_K12_the_box_drags_more_than_the_capsule_and_the_drag_falls_along_the_stream() -> None:
    """Each over five poses: on 32 cells single ones scatter by a tenth."""
    angles = np.add.outer(np.linspace(-4.0, 4.0, 5), [20.0, 45.0, 70.0])
    box, capsule = (
        -scatter.settled(shape, 10.0, 32, angles.ravel()).reshape(angles.shape).mean(axis=0)
        for shape in scatter.SHAPES
    )
    assert np.all(np.diff(box) < 0.0)
    assert np.all(np.diff(capsule) < 0.0)
    assert np.all(box > capsule)


@pytest.mark.parametrize(
    ("fine", "passed"), [(0.02, [True] * 4), (0.04, [True, True, False, False])]
)
def test_K12_a_capsule_scatters_less_on_the_finer_grid(
    fine: float, passed: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    def alternating(shape: str, viscosity: float, cells: int, angles: Array) -> Array:
        return -500.0 * (1.0 + (0.03 if cells == 64 else fine) * (-1.0) ** np.arange(angles.size))

    monkeypatch.setattr(scatter, "settled", alternating)
    found = case("K12").run()
    assert [result.verdict == "pass" for result in found] == passed
    assert found[0].value == pytest.approx(fine, rel=0.05)


def test_K13_the_final_pose_may_be_on_either_side_but_not_anywhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def ending(scene: str, resolution: int, start: float) -> controller_in_flow.AngleHistory:
        across = 8.0 if start < 45.0 else -8.0
        final = across if resolution == 128 else start
        return controller_in_flow.judged(np.full(20, final), 1.0)

    monkeypatch.setattr(scatter, "course", ending)
    mean, deviation = case("K13").run()
    assert (mean.value, deviation.value) == (pytest.approx(82.0), pytest.approx(0.0))
    assert (mean.verdict, deviation.verdict) == ("pass", "pass")
    mean, deviation = case("K13").run(quick=True)
    assert (mean.value, deviation.value) == (pytest.approx(45.0), pytest.approx(10.5, abs=0.1))
    assert (mean.verdict, deviation.verdict) == ("coarse", "coarse")


def test_K13_starts_where_asked() -> None:
    found = controller_in_flow.course("ns-block-drag-max", 3, resolution=24, start=55.0)
    assert found.angles[0] == pytest.approx(55.0)
    assert np.abs(np.diff(found.angles)).max() <= found.step * (1.0 + 1e-9)

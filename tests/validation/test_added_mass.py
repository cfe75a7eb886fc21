"""Cases I1 and I2, on coarse grids."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from flowborne_validation import added_mass as case
from flowborne_validation import cases
from flowborne_validation.case import Result, table
from flowborne_validation.findings import over
from flowborne_validation.worlds import square


@pytest.mark.parametrize("ratio", [0.25, 0.5])
def test_I2_cylinder_in_a_square(ratio: float) -> None:
    exact = table("I2", "cylinder in closed square, Ca vs D/L")[ratio]
    errors = [
        case.coefficient(square(round(n / ratio)), case.round_body(ratio)) / exact - 1.0
        for n in (16, 32)
    ]
    assert abs(errors[1]) < 0.01
    assert abs(errors[1]) < 0.5 * abs(errors[0])


def test_I2_sphere_in_a_cube() -> None:
    exact = table("I2", "sphere in closed cube, Ca vs D/L")[0.3333]
    errors = [
        case.coefficient(case.cube(3 * n), case.round_body(1.0 / 3.0)) / exact - 1.0
        for n in (8, 16)
    ]
    assert abs(errors[1]) < 0.01
    assert abs(errors[1]) < 0.5 * abs(errors[0])


def test_I2_concentric_shell() -> None:
    for result in cases.case("I2").judge(over((8, 16, 32), partial(case.shells, ratios=[2.0]))):
        assert result.verdict == "pass", f"{result.quantity}: {result.value}"


@pytest.fixture(scope="module")
def found() -> list[Result]:
    """I1 in its short form."""
    return cases.case("I1").run(quick=True)


@pytest.mark.parametrize(("name", "count"), [("a/g of a", 11), ("of an ellipse", 3)])
def test_I1_accelerations_and_ellipses(found: list[Result], name: str, count: int) -> None:
    """At every density ratio; an ellipse along both axes and turning."""
    some = [result for result in found if name in result.quantity]
    assert len(some) == count
    for result in some:
        assert result.verdict == "pass", f"{result.quantity}: {result.value}"


def test_I1_added_mass_of_plates_falls_towards_the_exact_one_and_repeats_its_own(
    found: list[Result],
) -> None:
    """A plate is a cell thick: 64 cells across it are 4 % off, where the source asks for 1."""
    across, turning, along = (result for result in found if "of a plate" in result.quantity)
    assert across.series is not None
    assert along.series is not None
    assert across.series.falls
    assert [across.value, turning.value] == pytest.approx([1.0350, 1.0308], abs=5e-4)
    assert along.series.falls
    assert float(along.value) < 0.002


def test_I1_added_mass_of_a_disc_continued_to_no_thickness(found: list[Result]) -> None:
    raw, limit = (result for result in found if "of a disc" in result.quantity)
    assert limit.verdict == "pass", f"{limit.quantity}: {limit.value}"
    assert raw.value == pytest.approx(1.0362, abs=5e-4)


def test_continuation_to_no_thickness_finds_the_limit() -> None:
    grids = (16, 32, 64)
    values = [1.3 - 2.0 / n * np.log(1.0 / n) + 0.7 / n for n in grids]
    assert case.without_thickness(grids, values) == pytest.approx(1.3, rel=1e-12)


def test_box_correction_undoes_the_box() -> None:
    """I2's own numbers, corrected, are the unbounded ones, for round and for long bodies."""
    for ratio, boxed in table("I2", "cylinder in closed square, Ca vs D/L").items():
        area = np.pi * (1.0 / round(1.0 / ratio)) ** 2 / 4.0
        assert case.unbounded(boxed * area, area) / area == pytest.approx(1.0, abs=5e-4)
    area = np.pi * case.LONG * case.SHORT
    assert case.unbounded(0.51952 * area, area) / area == pytest.approx(0.5, abs=5e-4)
    assert case.unbounded(2.07972 * area, area) / area == pytest.approx(2.0, abs=5e-4)

"""Samples cover what they are of, and repeat themselves."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.studies.sampling import Sample, count_samples, repeats_of, samples_of
from flowborne.studies.schema import Study

RANGES = [
    {"key": "a", "lower": 1.0, "upper": 100.0, "log": True, "count": 3},
    {"key": "b", "lower": 1, "upper": 4, "count": 4},
    {"key": "c", "values": ["x", "y"]},
]


def made(kind: str, count: int | None = None, **more: object) -> Study:
    how = {"kind": kind, "count": count, "seed": 1}
    return Study.model_validate(
        {"name": "n", "scene": "eel", "vary": RANGES, "sample": how, **more}
    )


def column(samples: list[Sample], key: str) -> list[object]:
    return [sample[key] for sample in samples]


def test_a_grid_has_all_combinations() -> None:
    samples = samples_of(made("grid"))
    assert len(samples) == count_samples(made("grid")) == 24
    assert sorted(set(column(samples, "a"))) == pytest.approx([1.0, 10.0, 100.0])
    assert set(column(samples, "b")) == {1, 2, 3, 4}
    assert len({tuple(sample.values()) for sample in samples}) == 24


@pytest.mark.parametrize("kind", ["random", "latin-hypercube"])
def test_random_samples_fill_their_ranges_evenly_and_repeat_themselves(kind: str) -> None:
    samples = samples_of(made(kind, 400))
    assert samples == samples_of(made(kind, 400))
    exponents = np.log10(column(samples, "a"))
    assert (exponents >= 0.0).all()
    assert (exponents <= 2.0).all()
    assert exponents.mean() == pytest.approx(1.0, abs=0.1)
    whole = np.array(column(samples, "b"))
    assert np.bincount(whole)[1:] == pytest.approx(np.full(4, 100), abs=30)
    assert column(samples, "c").count("x") == pytest.approx(200, abs=40)


def test_a_latin_hypercube_has_one_sample_in_each_part_of_every_range() -> None:
    exponents = np.log10(column(samples_of(made("latin-hypercube", 50)), "a"))
    assert sorted(np.floor(exponents / 2.0 * 50.0).astype(int)) == list(range(50))


def test_each_resolution_is_refined_with_the_others_at_their_finest() -> None:
    repeat = [{"key": "g", "values": [8, 16, 32]}, {"key": "t", "values": [1, 2]}]
    found = repeats_of(made("random", 5, repeat=repeat))
    assert found == [{"g": 8, "t": 2}, {"g": 16, "t": 2}, {"g": 32, "t": 1}, {"g": 32, "t": 2}]
    assert repeats_of(made("random", 5)) == [{}]

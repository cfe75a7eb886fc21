"""Case I10 on coarse grids, and I12 without the sphere in a stream, which takes minutes."""

from __future__ import annotations

import pytest

from flowborne_validation.cases import case


@pytest.mark.parametrize(("name", "count"), [("I10", 11), ("I12", 4)])
def test_case_is_met(name: str, count: int) -> None:
    results = case(name).run(quick=True)
    assert len(results) == count
    assert all(result.verdict == "pass" for result in results)

"""K8 to K10 in short: a standing human in gravity and wind."""

from __future__ import annotations

import pytest

from flowborne.validation import run_cases


@pytest.mark.parametrize("name", ["K8", "K9", "K10"])
def test_every_finding_passes(name: str) -> None:
    found = run_cases([name], quick=True)
    assert found
    assert [result.title for result in found if result.verdict != "pass"] == []

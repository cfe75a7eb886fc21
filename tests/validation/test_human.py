"""K8 to K10 in short: a standing human in gravity and wind."""

from __future__ import annotations

import pytest

from flowborne.validation import case


@pytest.mark.parametrize("name", ["K8", "K9", "K10"])
def test_every_finding_passes(name: str) -> None:
    found = case(name).measure(True)
    assert found
    assert [f.quantity for f in found if not f.passed] == []

"""Cases K1 to K4, short."""

from __future__ import annotations

import pytest

from flowborne_validation.cases import case


@pytest.mark.parametrize("name", ["K1", "K2", "K3", "K4"])
def test_case_passes_in_its_short_form(name: str) -> None:
    for result in case(name).run(quick=True):
        assert result.verdict == "pass", f"{result.title}: {result.value}"

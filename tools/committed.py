"""Where the repository and its committed validation report are, and how their numbers are shown."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[1]
REPORT = ROOT / "docs" / "validation"


def number(value: float | str) -> str:
    """A value for people."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)

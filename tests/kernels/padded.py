"""Padded arrays."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray


def cells_of(padded: NDArray[Any]) -> tuple[slice, slice, slice]:
    """Index of the cells of a padded array, without its ghosts."""
    i, j, k = (slice(1, -1) if n > 1 else slice(None) for n in padded.shape)
    return i, j, k

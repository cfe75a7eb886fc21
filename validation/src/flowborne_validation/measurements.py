"""Packed tables of measured runs."""

from __future__ import annotations

import gzip
from importlib.resources import files


def rows_of(folder: str, name: str) -> list[list[str]]:
    """Entries of a table in a folder of this package, row by row; the first has the names."""
    packed = files("flowborne_validation").joinpath(folder, f"{name}.csv.gz").read_bytes()
    return [row.split(",") for row in gzip.decompress(packed).decode().split()]

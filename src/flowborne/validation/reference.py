"""The reference list: what each case is compared with."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any


@dataclass(frozen=True)
class Entry:
    """A case of the list.

    quantities  name -> value as the list has it: a number, a formula in words, or a table
    memory      names of those that were quoted from memory and not checked at their source
    """

    id: str
    name: str
    source: str
    provenance: str
    quantities: dict[str, Any]
    memory: Sequence[str] = ()


@cache
def _entries() -> dict[str, Entry]:
    text = files("flowborne.validation").joinpath("references.json").read_text(encoding="utf-8")
    return {case["id"]: Entry(**case) for case in json.loads(text)["cases"]}


def entry(case: str) -> Entry:
    """The entry of a case. Raises KeyError for an unknown id."""
    return _entries()[case]


def reference(case: str, quantity: str) -> Any:
    """A quantity's value in the list. Raises KeyError when there is none."""
    return entry(case).quantities[quantity]


def table(case: str, quantity: str) -> dict[float, Any]:
    """A table of the list whose keys are numbers."""
    return {float(key): value for key, value in reference(case, quantity).items()}


def confirmed(case: str, quantity: str) -> bool:
    """Whether a quantity's value was checked at its source, or derived."""
    return quantity not in entry(case).memory

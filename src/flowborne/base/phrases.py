"""Parts of sentences for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Sized
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from difflib import get_close_matches

LISTED = 30
"""Most names that a sentence lists."""


def suggestion(name: str, known: Iterable[str], what: str) -> str:
    """The end of a sentence: what was probably meant, or what there is to choose from."""
    known = list(known)
    close = get_close_matches(name, known, n=1, cutoff=0.6)
    if close:
        return f"; did you mean '{close[0]}'?"
    return f". {what}: {listed(known) if known else 'none'}."


def listed(names: Sequence[str]) -> str:
    """The first LISTED names, and how many more there are."""
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more


def and_more(names: Sequence[str]) -> str:
    """The first of some names, and how many more there are."""
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"


def more_too(found: Sized) -> str:
    """After the first of what was found, that there are more: " (2 more too)", or nothing."""
    return f" ({len(found) - 1} more too)" if len(found) > 1 else ""


def location(point: Iterable[float]) -> str:
    """A point (3,) in m: "(0.1, 2, -3) m"."""
    return f"({', '.join(f'{x:.4g}' for x in point)}) m"


def rounded_up(value: float) -> str:
    """A number of three digits, no smaller than `value` up to its ninth digit."""
    return _rounded(value, ROUND_CEILING)


def rounded_down(value: float) -> str:
    """A number of three digits, no larger than `value` up to its ninth digit."""
    return _rounded(value, ROUND_FLOOR)


def _rounded(value: float, rounding: str) -> str:
    plain = Context(prec=9).create_decimal(value)
    return f"{float(Context(prec=3, rounding=rounding).plus(plain)):.6g}"

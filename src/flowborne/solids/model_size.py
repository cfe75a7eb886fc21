"""What a model file asks for before anything is made of it."""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from xml.etree.ElementTree import Element

LARGEST = 1 << 30
"""Bytes that one element of a model may take."""

BODIES = 20_000
"""Copies that a model may make of its parts."""

UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40, "P": 1 << 50, "E": 1 << 60}
"""MuJoCo's letters after a size of memory."""

NUMBER = 8
"""Bytes of a number."""


def too_large(model: Element) -> Iterator[str]:
    """What of a model takes more memory than LARGEST, or more copies than BODIES."""
    for field in model.iter("hfield"):
        size = NUMBER * _count(field, "nrow") * _count(field, "ncol")
        yield from _said("hfield", field.get("name", ""), size)
    for flex in model.iter("flexcomp"):
        size = NUMBER * 3 * prod(_whole(n) for n in flex.get("count", "1").split())
        yield from _said("flexcomp", flex.get("name", ""), size)
    for asked in model.iter("size"):
        for key in asked.attrib:
            if key == "memory":
                yield from _said("size memory", "", _bytes(asked.get(key, "")))
            elif key.startswith("nuser") or key in ("njmax", "nconmax", "nkey"):
                yield from _said(f"size {key}", "", NUMBER * _count(asked, key))
    copies = _copies(model)
    if copies > BODIES:
        yield f"<replicate> makes {copies:.2g} copies, and {BODIES} are the most. Take fewer."


def _said(tag: str, name: str, size: int) -> Iterator[str]:
    if size > LARGEST:
        called = f"<{tag}>" + (f" '{name}'" if name else "")
        yield (
            f"{called} asks for {size / 2**30:.3g} GB, and {LARGEST / 2**30:g} GB is the most. "
            "Make it smaller."
        )


def _copies(element: Element) -> int:
    """How many copies of parts replicates make, those in each other multiplied."""
    inside = 0
    for child in element:
        inside += _copies(child)
    return _count(element, "count") * max(inside, 1) if element.tag == "replicate" else inside


def _count(element: Element, key: str) -> int:
    return _whole(element.get(key, "0"))


def _whole(text: str) -> int:
    """A whole number; 0 where MuJoCo will say that it is none."""
    try:
        return max(int(float(text)), 0)
    except (ValueError, OverflowError):
        return 0


def _bytes(text: str) -> int:
    letter = text[-1:].upper()
    return _whole(text[:-1]) * UNITS[letter] if letter in UNITS else _whole(text)

"""The part of a page that a tool writes, between two marks."""

from __future__ import annotations


def with_part(text: str, name: str, part: str) -> str:
    """The page with another part of this name; `make NAME` writes it."""
    begin, end = f"<!-- {name}: made by `make {name}` -->\n", f"<!-- end of {name} -->\n"
    before, rest = text.split(begin)
    return before + begin + part + end + rest.split(end)[1]

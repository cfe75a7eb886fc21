"""Docstrings as flowborne writes them: paragraphs, some of them columns of names and meanings.

name, name  what they are, which may go on
            in lines that stand further in
"""

from __future__ import annotations

import inspect
import re

COLUMN = re.compile(r"(?P<names>[\w*]+(?:, [\w*]+)*)  +(?P<meaning>\S.*)")
"""A line that begins an entry of columns."""

Entries = list[tuple[str, str]]
"""Names, and what they mean."""


def paragraphs(docstring: str | None) -> list[str]:
    """Paragraphs of a docstring, with what is further in left as it is; columns that follow prose
    at once are one of their own."""
    text = inspect.cleandoc(docstring or "")
    parts = [part.strip("\n") for part in re.split(r"\n\s*\n", text) if part.strip()]
    return [piece for part in parts for piece in _parted(part.splitlines())]


def _parted(lines: list[str]) -> list[str]:
    """The prose, and the columns below it, of the lines of a paragraph."""
    for start in range(1, len(lines)):
        columns = "\n".join(lines[start:])
        if entries(columns) is not None and entries("\n".join(lines)) is None:
            return ["\n".join(lines[:start]), columns]
    return ["\n".join(lines)]


def entries(paragraph: str) -> Entries | None:
    """What a paragraph of columns says; None where it is none."""
    found: Entries = []
    for line in paragraph.splitlines():
        column = COLUMN.fullmatch(line)
        if column:
            found.append((column["names"], column["meaning"]))
        elif found and line.startswith("  "):
            names, meaning = found[-1]
            found[-1] = names, f"{meaning} {line.strip()}"
        else:
            return None
    return found or None


def meanings(docstring: str | None) -> dict[str, str]:
    """Name -> what the columns of a docstring say of it."""
    told: dict[str, str] = {}
    for paragraph in paragraphs(docstring):
        for names, meaning in entries(paragraph) or ():
            told.update(dict.fromkeys(names.split(", "), meaning))
    return told


def prose(docstring: str | None) -> list[str]:
    """The paragraphs that are no columns, each in one line."""
    return [" ".join(p.split()) for p in paragraphs(docstring) if entries(p) is None]

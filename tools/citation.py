"""How to cite flowborne and its method: CITATION.cff as BibTeX, for docs/index.md."""

from __future__ import annotations

from typing import Any

import yaml  # type: ignore[import-untyped]

from committed import ROOT


def bibtex() -> str:
    """A block with the software and the article that it implements."""
    data = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    articles = [entry("article", key_of(one), one) for one in data["references"]]
    return "\n".join(["```bibtex", entry("software", data["title"], data), "", *articles, "```"])


def key_of(reference: dict[str, Any]) -> str:
    """Family name of the first author and year: lentine2011."""
    return f"{reference['authors'][0]['family-names'].lower()}{reference['year']}"


def entry(kind: str, key: str, data: dict[str, Any]) -> str:
    """One entry, with what is given of title, journal and year."""
    names = [
        f"{{{one['name']}}}" if "name" in one else f"{one['family-names']}, {one['given-names']}"
        for one in data["authors"]
    ]
    given = {name: data.get(name) for name in ("title", "journal", "year")}
    fields = {"author": " and\n            ".join(names), **given}
    lines = [f"  {name} = {{{value}}}," for name, value in fields.items() if value]
    return "\n".join([f"@{kind}{{{key},", *lines, "}"])

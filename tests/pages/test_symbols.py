"""One letter has one meaning in the chapters of the method, and leads to the table of symbols."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import chapters
import symbols

METHOD = Path(__file__).parents[2] / "docs" / "method"
CHAPTERS = sorted(set(METHOD.glob("*.md")) - {METHOD / "index.md"})

FORMULA = re.compile(r"\$\$(.+?)\$\$|\$([^$\n]+)\$", flags=re.S)
WORDS = re.compile(r"\\(?:text|mathrm|operatorname|begin|end)\{[^}]*\}")
SUBSCRIPT = re.compile(r"_(?:\\\w+(?:\{[^}]*\})?|\{[^}]*\}|\w)")
GREEK = (
    "alpha|beta|eta|theta|kappa|lambda|mu|nu|rho|phi|psi|omega|Gamma|Omega|ell|varepsilon|tau|pi"
)
LETTER = re.compile(rf"\\(?:{GREEK})(?![a-z])|(?<![\\A-Za-z])[A-Za-z](?![A-Za-z])")
"""A letter of a formula, without subscript and accent."""

NOT_SYMBOLS = {r"\pi", "e", "i", "d", "T"}
"""Numbers, an index, the differential and the transpose."""


def letters_of(formula: str) -> set[str]:
    """The letters of a formula."""
    return set(LETTER.findall(SUBSCRIPT.sub(" ", WORDS.sub(" ", formula))))


KNOWN = {letter for one in symbols.SYMBOLS for letter in letters_of(one.latex)} | NOT_SYMBOLS


def test_no_letter_is_there_twice() -> None:
    letters = [one.latex for one in symbols.SYMBOLS]
    assert len(letters) == len(set(letters))


def test_symbols_name_chapters_that_are_there() -> None:
    assert {one.chapter for one in symbols.SYMBOLS} - {""} <= {page.stem for page in CHAPTERS}


@pytest.mark.parametrize("page", CHAPTERS, ids=[page.stem for page in CHAPTERS])
def test_every_letter_of_a_chapter_is_in_the_table(page: Path) -> None:
    formulas = FORMULA.findall(page.read_text(encoding="utf-8"))
    found = {letter for formula in formulas for letter in letters_of(" ".join(formula))}
    assert found - KNOWN == set()


def test_a_symbol_is_known_at_any_time_of_a_step() -> None:
    found = [symbols.symbol_of(latex) for latex in ("u", "u^*", r"u^{n+1/2}", "u^n", "u^2", "2 u")]
    assert [one and one.latex for one in found] == ["u", "u", "u", "u", None, None]


def test_letters_are_read() -> None:
    assert letters_of(
        r"\frac{m_f}{\Delta t} \left( u_f^+ - \bar\eta\, x \right) \text{ in } M^{-1}"
    ) == {"m", "t", "u", r"\eta", "x", "M"}


def test_brackets_around_fractions_grow() -> None:
    """A bracket without \\left keeps the height of a letter."""
    for page in CHAPTERS:
        for block in re.findall(r"\$\$(.*?)\$\$", page.read_text(encoding="utf-8"), flags=re.S):
            plain = re.sub(r"\\(?:left|right)\s*[()\[\]|]", "", block)
            plain = re.sub(r"\\operatorname\{sign\}\([^)]*\)", "", plain)
            assert not re.search(r"[()\[\]]", plain), f"{page.name}: {block}"


def test_every_chapter_has_a_picture_near_its_title() -> None:
    for page in [*CHAPTERS, METHOD / "index.md"]:
        head = page.read_text(encoding="utf-8").split("\n## ")[0]
        shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", head)
        assert shown, page.name
        assert all((METHOD / path).is_file() for path in shown), page.name


def test_pictures_of_chapters_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chapters, "FOLDER", tmp_path)
    for name in chapters.PICTURES:
        chapters.write(name)
        text = (tmp_path / f"{name}.svg").read_text(encoding="utf-8")
        assert text.count("<path") > 3
    assert "0.16" in (tmp_path / "cut-cells.svg").read_text(encoding="utf-8")

"""The documentation is built without a warning, and its tables say what the code has."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from docutils.utils.math.latex2mathml import tex2mathml
from pydantic import BaseModel

import flowborne
import scene_keys
from docstrings import entries, meanings, prose
from flowborne.scenes.json_schema import json_schema
from flowborne.scenes.load import scene_names
from flowborne.scenes.schema import Scene

DOCS = Path(__file__).parents[2] / "docs"

SPHINX = (
    "import gc, sys; from sphinx.cmd.build import main; gc.disable(); sys.exit(main(sys.argv[1:]))"
)
"""Pages stay until the last one is written: looking for garbage among them takes a third of the
time."""

SAID = """What a table is.

lower, upper  corners, m; they
              may be anywhere
kind          of it

    V' - V = 0

More of it.
raises  ValueError when it is wrong
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the pages, made with warnings as errors."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-c", SPHINX, "-W", "-q", "-b", "html"]
    made = subprocess.run(
        [*command, "-d", str(folder / "doctrees"), str(DOCS), str(folder / "html")],
        capture_output=True,
        text=True,
    )
    assert made.returncode == 0, made.stderr
    return folder / "html"


def test_every_page_is_made(site: Path) -> None:
    pages = {path.relative_to(DOCS).with_suffix(".html") for path in DOCS.rglob("*.md")}
    assert pages <= {path.relative_to(site) for path in site.rglob("*.html")}


def test_no_page_asks_a_network_for_anything(site: Path) -> None:
    """Nothing that a browser loads by itself lies elsewhere."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|iframe|source)[^>]*\ssrc=\"([^\"]+)\"", text)
        loaded += re.findall(r"<link[^>]*rel=\"stylesheet\"[^>]*href=\"([^\"]+)\"", text)
        assert not [address for address in loaded if "//" in address], page.name


def test_formulas_are_mathematics_in_the_page(site: Path) -> None:
    text = (site / "method" / "coupled-solve.html").read_text(encoding="utf-8")
    assert text.count("<math") > 10
    assert tex2mathml(r"\hat p").splitlines()[1].strip() in text


def test_a_symbol_of_a_chapter_leads_to_its_row(site: Path) -> None:
    chapter = (site / "method" / "viscosity.html").read_text(encoding="utf-8")
    places = re.findall(r'<a class="symbol" href="index.html#(symbol-\d+)"', chapter)
    table = (site / "method" / "index.html").read_text(encoding="utf-8")
    assert len(places) > 10
    assert all(f'id="{place}"' in table for place in places)


def test_every_public_module_has_a_page_and_simulation_is_first(site: Path) -> None:
    for name in ("flowborne", *(f"flowborne.{page}" for page in flowborne.PAGES)):
        text = (site / "api" / f"{name}.html").read_text(encoding="utf-8")
        found = re.findall(r'class="sig sig-object py" id="([^"]+)"', text)
        assert found
        assert all(one.startswith(f"{name}.") for one in found)
        if name == "flowborne":
            assert found[0] == "flowborne.Simulation"


def tables_below(model: type[BaseModel]) -> set[type[BaseModel]]:
    """A table of the schema, and all that stand in it."""
    inner = {
        one for hint in scene_keys.hints_of(model).values() for one in scene_keys.tables_in(hint)
    }
    return {model}.union(*(tables_below(one) for one in inner))


def test_reports_stand_in_an_appendix(site: Path) -> None:
    text = (site / "index.html").read_text(encoding="utf-8")
    handbook, appendix = text.split(">Appendix</span>")
    for page in ("attack", "strangers", "learning"):
        entry = f'class="reference internal" href="{page}.html"'
        assert entry in appendix
        assert entry not in handbook


def test_every_key_of_a_scene_is_there_with_its_meaning(site: Path) -> None:
    text = (site / "scene-keys.html").read_text(encoding="utf-8")
    found = tables_below(Scene)
    assert len(found) > 50
    for model in found:
        for name, hint in scene_keys.hints_of(model).items():
            is_section = model is Scene and list(scene_keys.tables_in(hint))
            if name != "kind" and not is_section:
                assert f">{name}</span>" in text, f"{model.__name__}.{name}"
                assert scene_keys.meaning_of(model, name), f"{model.__name__}.{name}"
            elif is_section:
                assert f"[{name}]" in text


def test_the_schema_of_scenes_is_published(site: Path) -> None:
    assert json.loads((site / "scene.schema.json").read_text("utf-8")) == json_schema()
    assert 'href="scene.schema.json"' in (site / "scene-keys.html").read_text("utf-8")


def test_every_built_in_scene_is_listed(site: Path) -> None:
    text = (site / "parts.html").read_text(encoding="utf-8")
    assert all(f">{name}</span>" in text for name in scene_names())


def test_columns_of_a_docstring_are_read() -> None:
    assert meanings(SAID) == {
        "lower": "corners, m; they may be anywhere",
        "upper": "corners, m; they may be anywhere",
        "kind": "of it",
        "raises": "ValueError when it is wrong",
    }
    assert prose(SAID) == ["What a table is.", "V' - V = 0", "More of it."]
    assert entries("no columns at all") is None


def test_types_and_limits_are_told_in_words() -> None:
    rows = {row[0]: row[1:3] for row in scene_keys.rows(scene_keys.Scene)}
    assert rows["`dimensions`"] == ["`2` or `3`", "`3`"]
    assert rows["`gravity`"] == ["`[x, y]` or `[x, y, z]`", "`[0, 0, 0]`"]
    fluid = next(scene_keys.tables_in(scene_keys.hints_of(Scene)["fluid"]))
    rows = {row[0]: row[1:3] for row in scene_keys.rows(fluid)}
    assert rows["`tolerance`"] == ["number > 0, < 1", "`1e-07`"]
    assert rows["`coupling`"][1] == '`"two-way"`'

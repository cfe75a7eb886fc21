"""Sphinx extension of the documentation: parts made of the code, formulas without a network.

A line `<!-- made by MODULE.FUNCTION ARGUMENTS -->` of a page becomes the Markdown that the function
of a module in tools/ gives. Formulas become MathML, which browsers draw by themselves, and symbols
of the method lead to their table. Docstrings are read as they are written: single backticks,
columns of names and meanings, indented formulas.
"""

from __future__ import annotations

import json
import re
from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from pydantic import BaseModel
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import accuracy
import api_pages
import citation
import command_help
import flapping
import heaving
import notebooks
import parts
import scene_keys
import symbols
import validation_table
import viewer_script
import waterlily
from docstrings import entries, paragraphs
from flowborne.scenes.json_schema import json_schema

MAKERS = {
    module.__name__: module
    for module in (
        accuracy,
        api_pages,
        citation,
        command_help,
        flapping,
        heaving,
        notebooks,
        parts,
        scene_keys,
        symbols,
        validation_table,
        waterlily,
    )
}
"""Modules whose functions give parts of pages. They are imported before autodoc imports anything:
it does so as type checkers do, which pydantic does not bear."""

NOTE = "*(`make docs` writes this part into `build/docs`.)*"
"""What a page says below such a line where it is read as it is."""

MADE = re.compile(
    rf"^<!-- made by (\w+)\.(\w+)(.*) -->(?:\n{re.escape(NOTE)})?$", flags=re.MULTILINE
)

MARKUP = re.compile(r"(`[^`]+`)|([*|_\\])")
"""What stays as it is between backticks, and what would be markup elsewhere."""

OF_METHOD = ("method/", "momentum")
"""Beginnings of the names of pages whose formulas have the method's symbols."""

PYDANTIC = ("model_config", "model_post_init")

ALIAS = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")


def made_parts(app: Sphinx, name: str, source: list[str]) -> None:
    """Put what the code makes into a page."""

    def made(found: re.Match[str]) -> str:
        return str(getattr(MAKERS[found[1]], found[2])(*found[3].split()))

    source[0] = MADE.sub(made, source[0])


def inline_formula(self: Any, node: nodes.math) -> None:
    """A formula; one that is a symbol of the method leads to the table of symbols."""
    made, page = tex2mathml(node.astext()), self.builder.current_docname
    symbol = symbols.symbol_of(node.astext())
    if symbol is not None and page.startswith(OF_METHOD) and page != symbols.PAGE:
        place = f"{self.builder.get_relative_uri(page, symbols.PAGE)}#{symbols.anchor(symbol)}"
        said = escape(symbol.meaning.replace("$", ""))
        made = f'<a class="symbol" href="{place}" title="{said}">{made}</a>'
    self.body.append(made)
    raise nodes.SkipNode


def block_formula(self: Any, node: nodes.math_block) -> None:
    formula = tex2mathml(node.astext(), as_block=True)
    self.body.append(f'<div class="math" tabindex="0">{formula}</div>')
    raise nodes.SkipNode


def structured(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """A docstring as reStructuredText."""
    made: list[str] = []
    for paragraph in paragraphs("\n".join(lines)):
        columns = entries(paragraph)
        if columns is not None:
            made += [line for name, said in columns for line in (f"``{name}``", f"   {safe(said)}")]
        elif all(line.startswith("  ") for line in paragraph.splitlines()):
            made += ["::", "", *paragraph.splitlines()]
        else:
            made += lines_of(paragraph)
        made.append("")
    lines[:] = made


def readable(
    app: Any, what: str, name: str, obj: Any, options: Any, signature: str | None, returned: str
) -> tuple[str | None, str | None]:
    """A signature with the names of our types, and no name for a default that is made anew; none
    for a table of a scene, whose keys have a page of their own."""
    if isinstance(obj, type) and issubclass(obj, BaseModel):
        return "", None

    def shown(text: str | None) -> str | None:
        return text and ALIAS.sub(r"\1", text.replace("<factory>", "..."))

    return shown(signature), shown(returned)


def skipped(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool:
    """Whether a member is left out: what pydantic gives to every table is."""
    return skip or name in PYDANTIC


def lines_of(paragraph: str) -> list[str]:
    """A paragraph; lines of it that stand further in are shown as they are."""
    made: list[str] = []
    for line in paragraph.splitlines():
        further = line.startswith("  ")
        if made and further != made[-1].startswith("  "):
            made += ["", "::", ""] if further else [""]
        made.append(line if further else safe(line))
    return made


def safe(text: str) -> str:
    """Text without markup but for its backticks."""
    return MARKUP.sub(lambda m: f"`{m[1]}`" if m[1] else "\\" + m[2], text)


def accessible(app: Sphinx, page: str, template: str, context: dict[str, Any], tree: Any) -> None:
    """Give the captions of the sidebar the level that a heading has to have."""
    role = 'role="heading"'
    shown = context["furo_navigation_tree"]
    context["furo_navigation_tree"] = shown.replace(role, f'{role} aria-level="2"')


def lazily(app: Sphinx, tree: nodes.document, page: str) -> None:
    """Load pictures and films in lists when they come into view."""
    for item in tree.findall(nodes.list_item):
        for image in item.findall(nodes.image):
            image["loading"] = "lazy"


class Diagram(SphinxDirective):
    """A block of Mermaid, which needs a script to be drawn: its text, folded away."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        begin = "<details><summary>The picture, as Mermaid</summary>"
        text = "\n".join(self.content)
        return [
            nodes.raw("", begin, format="html"),
            nodes.literal_block(text, text, language="text"),
            nodes.raw("", "</details>", format="html"),
        ]


def published(app: Sphinx, error: Exception | None) -> None:
    """Put the JSON schema of scenes beside the pages, and what recorded runs are turned with."""
    if error is None:
        out = Path(app.outdir)
        text = json.dumps(json_schema(), indent=2)
        (out / "scene.schema.json").write_text(text, encoding="utf-8")
        script = out / "_static" / "turn" / "three.js"
        script.write_text(viewer_script.three(), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", made_parts)
    app.connect("build-finished", published)
    app.connect("autodoc-process-docstring", structured)
    app.connect("autodoc-process-signature", readable)
    app.connect("autodoc-skip-member", skipped)
    app.connect("doctree-resolved", lazily)
    app.connect("html-page-context", accessible, priority=900)
    app.add_directive("mermaid", Diagram)
    app.add_html_math_renderer("mathml", (inline_formula, None), (block_formula, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}

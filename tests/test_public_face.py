"""What a user can import is all that the validation, the benches and the texts use."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

import flowborne

SOURCE = Path(flowborne.__file__).parent
ROOT = SOURCE.parents[1]
PUBLIC = {"flowborne", *(f"flowborne.{page}" for page in flowborne.PAGES)}
VALIDATION = ROOT / "validation" / "src" / "flowborne_validation"


def imports_of(code: str) -> Iterator[str]:
    """Modules of flowborne that a piece of Python imports."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def private(code: str) -> list[str]:
    """Those that are not public."""
    return [
        module
        for module in imports_of(code)
        if module.split(".")[0] == "flowborne" and module not in PUBLIC
    ]


def test_validation_and_benches_use_the_public_face_only() -> None:
    found = {p.name: private(p.read_text()) for p in sorted(VALIDATION.rglob("*.py"))}
    assert len(found) > 30
    assert not {name: modules for name, modules in found.items() if modules}


@pytest.mark.parametrize("page", [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))])
def test_texts_use_the_public_face_only(page: Path) -> None:
    for block in re.findall(r"```python\n(.*?)```", page.read_text(), flags=re.S):
        assert not private(block)


@pytest.mark.parametrize("module", sorted(PUBLIC))
def test_every_public_name_is_there_and_says_what_it_is(module: str) -> None:
    page = import_module(module)
    assert page.__doc__
    for name in page.__all__:
        thing = getattr(page, name)
        if callable(thing) and getattr(thing, "__module__", "").startswith("flowborne"):
            assert thing.__doc__, f"{module}.{name}"


def test_importing_flowborne_is_light() -> None:
    assert set(flowborne.__all__) <= set(dir(flowborne))
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = flowborne.nothing

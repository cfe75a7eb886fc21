"""How much a function asks for."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import flowborne

SOURCE = Path(flowborne.__file__).parent

MOST = 8
"""Parameters of a function, `self` and `cls` aside; what belongs together comes as one."""

LONGER = {
    "cli/make.py run": 9,
    "kernels/dye.py bend_row": 10,
    "kernels/dye.py cross_row": 10,
    "kernels/flux.py side_row": 12,
}
"""Those that still have more, and how many; nothing is added here but the options of a command.
What is called for every row of a field takes its arrays one by one: with tuples of them it needs
half as long again, or more."""


def parameters(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Every function, at whatever depth, and its number of parameters; *args count as one."""
    for node in ast.walk(tree):
        for inner in ast.iter_child_nodes(node):
            if isinstance(inner, ast.FunctionDef | ast.AsyncFunctionDef):
                given = inner.args
                named = [a.arg for a in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
                if isinstance(node, ast.ClassDef) and named[:1] in (["self"], ["cls"]):
                    del named[0]
                rest = [a for a in (given.vararg, given.kwarg) if a is not None]
                yield inner.name, len(named) + len(rest)


def test_functions_have_few_parameters() -> None:
    """The list is exact, so that whoever shortens one of it takes it off."""
    longer = {
        f"{path.relative_to(SOURCE).as_posix()} {name}": count
        for path in SOURCE.rglob("*.py")
        for name, count in parameters(ast.parse(path.read_text(encoding="utf-8")))
        if count > MOST
    }
    assert longer == LONGER

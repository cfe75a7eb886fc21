"""How much a function asks for."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import flowborne

SOURCE = Path(flowborne.__file__).parent

MOST = 8
"""Parameters of a function, `self` and `cls` aside; what belongs together comes as one."""

LONGER = {"coupling/solve.py solve_together": 9}
"""Those that still have more, and how many; nothing is added here."""


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


def test_functions_outside_kernels_have_few_parameters() -> None:
    """The list is exact, so that whoever shortens one of it takes it off."""
    longer = {
        f"{path.relative_to(SOURCE).as_posix()} {name}": count
        for path in SOURCE.rglob("*.py")
        if not path.is_relative_to(SOURCE / "kernels")
        for name, count in parameters(ast.parse(path.read_text(encoding="utf-8")))
        if count > MOST
    }
    assert longer == LONGER

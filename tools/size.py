"""How large the package is: `make size` prints modules and lines of each room, and what stands out.

A room is as in tools/imports.py. Complexity is McCabe's, as Ruff counts it.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

from imports import PACKAGE, in_order, of_modules, of_rooms

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / PACKAGE

SHORT = 60
"""Lines below which a module is short."""

CORE = ("fluid", "coupling", "kernels", "solvers")
"""Rooms whose constants are counted."""

LEVELS = (15, 20)
"""Complexities above which functions are counted."""

MOST_PARAMETERS = 8
"""Parameters above which functions are counted, those of kernels too."""


def room_of(path: Path) -> str:
    """Room of a module by its file."""
    inner = path.relative_to(SOURCE)
    return inner.parts[0] if len(inner.parts) > 1 else "beside the rooms"


def wide(path: Path) -> int:
    """Functions of a module with more than MOST_PARAMETERS, `self` among them."""
    functions = (
        node
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    )
    return sum(
        len([*f.args.posonlyargs, *f.args.args, *f.args.kwonlyargs]) > MOST_PARAMETERS
        for f in functions
    )


def is_number(value: ast.expr) -> bool:
    """Whether an expression is made of numbers alone."""
    parts = tuple(ast.walk(value))
    kinds = ast.Constant | ast.UnaryOp | ast.BinOp | ast.Tuple | ast.operator | ast.unaryop
    numbers = [part for part in parts if isinstance(part, ast.Constant)]
    made = all(isinstance(part, kinds | ast.expr_context) for part in parts)
    return made and bool(numbers) and all(type(n.value) in (int, float) for n in numbers)


def constants(path: Path) -> int:
    """Names that a module binds to numbers; those bound in one line count as one."""
    lines = ast.parse(path.read_text("utf-8")).body
    return sum(isinstance(line, ast.Assign) and is_number(line.value) for line in lines)


def complex_functions(above: int) -> list[str]:
    """Functions of greater complexity, with their place."""
    ruff = [sys.executable, "-m", "ruff", "check", "--isolated", "--exit-zero", "--select", "C901"]
    options = ["--config", f"lint.mccabe.max-complexity={above}", "--output-format", "json"]
    done = subprocess.run([*ruff, *options, str(SOURCE)], capture_output=True, check=True)
    return [
        f"{Path(found['filename']).relative_to(SOURCE).as_posix()}: {found['message']}"
        for found in json.loads(done.stdout)
    ]


def main() -> None:
    """Print everything."""
    lines = {path: path.read_text("utf-8").count("\n") for path in sorted(SOURCE.rglob("*.py"))}
    modules, total = Counter(map(room_of, lines)), Counter[str]()
    for path, count in lines.items():
        total[room_of(path)] += count
    for room in sorted(modules):
        print(f"{room:18}{modules[room]:5} modules {total[room]:7} lines")
    print(f"{'all':18}{len(lines):5} modules {sum(lines.values()):7} lines")
    core = [path for path in lines if room_of(path) in CORE]
    print(f"constants of {', '.join(CORE)}: {sum(map(constants, core))}")
    print(f"below {SHORT} lines: {sum(count < SHORT for count in lines.values())} modules")
    print(f"more than {MOST_PARAMETERS} parameters: {sum(map(wide, lines))} functions")
    for above in LEVELS:
        found = complex_functions(above)
        print(f"complexity above {above}: {len(found)} functions", *found, sep="\n  ")
    rooms = of_rooms(of_modules())
    print(f"imports from room to room: {sum(map(len, rooms.values()))}, in this order:")
    print("  " + ", ".join(name for name in in_order(rooms) if (SOURCE / name).is_dir()))


if __name__ == "__main__":
    main()

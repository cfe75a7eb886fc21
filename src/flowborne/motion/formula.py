"""Formulas of a scene in the time t, with their exact derivative.

A formula is written as in Python and never run as Python: its syntax tree may hold numbers, names,
arithmetic and calls of a few functions, and nothing else.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from textwrap import shorten

from flowborne.errors import SceneError
from flowborne.motion import dual
from flowborne.motion.dual import Dual
from flowborne.phrases import suggestion

OPERATORS: Mapping[type[ast.operator], Callable[[Dual, Dual], Dual]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
SIGNS: Mapping[type[ast.unaryop], Callable[[Dual], Dual]] = {
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
FUNCTIONS: Mapping[str, tuple[Callable[..., Dual], int, float]] = {
    "sin": (dual.sine, 1, 1),
    "cos": (dual.cosine, 1, 1),
    "tan": (dual.tangent, 1, 1),
    "exp": (dual.exponential, 1, 1),
    "log": (dual.logarithm, 1, 1),
    "sqrt": (dual.square_root, 1, 1),
    "tanh": (dual.hyperbolic_tangent, 1, 1),
    "abs": (dual.absolute, 1, 1),
    "min": (dual.least, 2, math.inf),
    "max": (dual.most, 2, math.inf),
    "ramp": (dual.ramp, 1, 2),
}
"""Name -> function, fewest and most arguments. Angles of sin, cos and tan are radians."""

RESERVED = ("t", "pi", *FUNCTIONS)
"""Names that no constant may have."""

LONGEST = 80
"""Letters of a formula in a message."""

GRAMMAR = (
    "A formula has numbers, t, pi, constants, + - * / % ** and the functions "
    + ", ".join(FUNCTIONS)
    + "."
)


@dataclass(frozen=True)
class Formula:
    """A number that depends on time.

    text       such as "amplitude * ramp(t) * sin(2*pi*t)"
    constants  name -> value
    raises     SceneError when it is no formula
    """

    text: str
    constants: Mapping[str, float] = field(default_factory=dict)
    _tree: ast.expr = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        try:
            tree = ast.parse(" ".join(self.text.split()), mode="eval").body
            self._check(tree)
        except SyntaxError:
            raise SceneError(f"{self} cannot be read. {GRAMMAR}") from None
        except (RecursionError, MemoryError, OverflowError):
            raise SceneError(
                f"{self} is too deep, or has too large a number. Simplify it."
            ) from None
        object.__setattr__(self, "_tree", tree)

    def __str__(self) -> str:
        return f"formula '{shorten(self.text, LONGEST)}'"

    def names(self) -> set[str]:
        """Constants that it uses."""
        found = {node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name)}
        return found - set(RESERVED)

    def at(self, time: float) -> Dual:
        """Value and derivative at `time` (s). Raises ArithmeticError where one is not finite."""
        known = {name: Dual(value) for name, value in self.constants.items()}
        known |= {"t": Dual(time, 1.0), "pi": Dual(math.pi)}
        try:
            found = _value(self._tree, known)
        except (ArithmeticError, ValueError):
            found = Dual(math.nan)
        if not (math.isfinite(found.value) and math.isfinite(found.slope)):
            raise ArithmeticError(f"{self} or its derivative is not finite at t = {time:g} s")
        return found

    def _check(self, node: ast.expr) -> None:
        """Raise SceneError for anything that is not of the grammar."""
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            float(node.value)  # type: ignore[arg-type]
        elif isinstance(node, ast.Name):
            self._check_name(node.id)
        elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            self._check(node.left)
            self._check(node.right)
        elif isinstance(node, ast.UnaryOp) and type(node.op) in SIGNS:
            self._check(node.operand)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            self._check_call(node.func.id, len(node.args))
            for argument in node.args:
                self._check(argument)
        else:
            raise SceneError(f"{self} cannot have '{ast.unparse(node)}'. {GRAMMAR}")

    def _check_name(self, name: str) -> None:
        if name in FUNCTIONS:
            raise SceneError(f"{self} has function '{name}' without an argument. Add it.")
        known = (*self.constants, *RESERVED)
        if name not in known:
            end = suggestion(name, known, "Add it to [constants], or take one of")
            raise SceneError(f"{self}: name '{name}' is not known{end}")

    def _check_call(self, name: str, count: int) -> None:
        if name not in FUNCTIONS:
            end = suggestion(name, FUNCTIONS, "Take one of")
            raise SceneError(f"{self}: function '{name}' is not known{end}")
        _, fewest, most = FUNCTIONS[name]
        if not fewest <= count <= most:
            wanted = f"{fewest}" if most == fewest else f"{fewest} or more"
            wanted = f"{fewest} or {most:g}" if fewest < most < math.inf else wanted
            raise SceneError(f"{self} gives '{name}' {count} arguments. Give it {wanted}.")


def _value(node: ast.expr, known: Mapping[str, Dual]) -> Dual:
    """Value of a checked tree; `known` are its names."""
    match node:
        case ast.BinOp():
            return OPERATORS[type(node.op)](_value(node.left, known), _value(node.right, known))
        case ast.UnaryOp():
            return SIGNS[type(node.op)](_value(node.operand, known))
        case ast.Call(func=ast.Name(id=name)):
            return FUNCTIONS[name][0](*(_value(argument, known) for argument in node.args))
        case ast.Name():
            return known[node.id]
        case ast.Constant():
            return Dual(float(node.value))  # type: ignore[arg-type]
    raise AssertionError(ast.dump(node))

"""Formulas of a scene in the time t, with their exact derivative.

A formula has Python syntax but is never executed as Python: its syntax tree may contain only
numbers, names, arithmetic and calls of a few functions. It becomes functions of dual numbers.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from textwrap import shorten

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion


@dataclass(frozen=True)
class Dual:
    """A dual number value + slope e with e^2 = 0: a number and its time derivative.

    At a kink (`absolute`, `minimum`, `maximum`) the slope is the one-sided derivative for later
    times.
    """

    value: float
    slope: float = 0.0

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __pos__(self) -> Dual:
        return self

    def __add__(self, other: Dual) -> Dual:
        return Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Dual) -> Dual:
        return Dual(self.value - other.value, self.slope - other.slope)

    def __mul__(self, other: Dual) -> Dual:
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __truediv__(self, other: Dual) -> Dual:
        ratio = self.value / other.value
        return Dual(ratio, (self.slope - ratio * other.slope) / other.value)

    def __mod__(self, other: Dual) -> Dual:
        whole = math.floor(self.value / other.value)
        return Dual(self.value % other.value, self.slope - whole * other.slope)

    def __pow__(self, other: Dual) -> Dual:
        base, exponent = self.value, other.value
        power = math.pow(base, exponent)
        slope = 0.0
        if self.slope and exponent:
            slope += exponent * math.pow(base, exponent - 1.0) * self.slope
        if other.slope:
            slope += power * math.log(base) * other.slope
        return Dual(power, slope)


def elementary(
    function: Callable[[float], float], derivative: Callable[[float], float]
) -> Callable[[Dual], Dual]:
    """A function of one number for dual numbers, by the chain rule."""
    return lambda x: Dual(function(x.value), derivative(x.value) * x.slope)


def logarithm(x: Dual) -> Dual:
    return Dual(math.log(x.value), x.slope / x.value)


def square_root(x: Dual) -> Dual:
    value = math.sqrt(x.value)
    return Dual(value, 0.5 * x.slope / value if x.slope else 0.0)


def absolute(x: Dual) -> Dual:
    return maximum(x, -x)


def minimum(*numbers: Dual) -> Dual:
    return min(numbers, key=_at_later_time)


def maximum(*numbers: Dual) -> Dual:
    return max(numbers, key=_at_later_time)


def _at_later_time(x: Dual) -> tuple[float, float]:
    """Sort key: by value, and equal values by their slope, which orders them later."""
    return x.value, x.slope


def ramp(x: Dual, length: Dual = Dual(1.0)) -> Dual:
    """Smooth step 3 s^2 - 2 s^3 with s = x / length from 0 to 1."""
    s = minimum(maximum(x / length, Dual(0.0)), Dual(1.0))
    return s * s * (Dual(3.0) - Dual(2.0) * s)


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
    "sin": (elementary(math.sin, math.cos), 1, 1),
    "cos": (elementary(math.cos, lambda x: -math.sin(x)), 1, 1),
    "tan": (elementary(math.tan, lambda x: 1.0 + math.tan(x) ** 2), 1, 1),
    "exp": (elementary(math.exp, math.exp), 1, 1),
    "log": (logarithm, 1, 1),
    "sqrt": (square_root, 1, 1),
    "tanh": (elementary(math.tanh, lambda x: 1.0 - math.tanh(x) ** 2), 1, 1),
    "abs": (absolute, 1, 1),
    "min": (minimum, 2, math.inf),
    "max": (maximum, 2, math.inf),
    "ramp": (ramp, 1, 2),
}
"""Name -> function, minimum and maximum number of arguments. Angles are in radians."""

RESERVED = ("t", "pi", *FUNCTIONS)
"""Names that are not allowed for constants."""

MAX_TIMES = 2
"""Times for which a formula caches its value: a step needs those at its end and a step later."""

MAX_SHOWN = 80
"""Largest number of characters of a formula in a message."""

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
    raises     SceneError for a text that is not a formula
    """

    text: str
    constants: Mapping[str, float] = field(default_factory=dict)
    _tree: ast.expr = field(init=False, repr=False, compare=False)
    _value: Callable[[float], Dual] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        try:
            tree = ast.parse(" ".join(self.text.split()), mode="eval").body
            self._check(tree)
            known = {name: Dual(value) for name, value in self.constants.items()}
            value = _function(tree, known | {"pi": Dual(math.pi)})
        except SyntaxError:
            raise SceneError(f"{self} cannot be read. {GRAMMAR}") from None
        except (RecursionError, MemoryError, OverflowError):
            raise SceneError(
                f"{self} is nested too deep, or has too large a number. Simplify it."
            ) from None
        object.__setattr__(self, "_tree", tree)
        object.__setattr__(self, "_value", lru_cache(MAX_TIMES)(value))

    def __reduce__(self) -> tuple[type[Formula], tuple[str, Mapping[str, float]]]:
        return Formula, (self.text, self.constants)

    def __str__(self) -> str:
        return f"formula '{shorten(self.text, MAX_SHOWN)}'"

    def names(self) -> set[str]:
        """Names of the constants in the formula."""
        names = {node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name)}
        return names - set(RESERVED)

    def at(self, time: float) -> Dual:
        """Value and derivative at `time` (s). Raises ArithmeticError if one is not finite."""
        try:
            result = self._value(time)
        except (ArithmeticError, ValueError):
            result = Dual(math.nan)
        if not (math.isfinite(result.value) and math.isfinite(result.slope)):
            raise ArithmeticError(f"{self} or its derivative is not finite at t = {time:g} s")
        return result

    def _check(self, node: ast.expr) -> None:
        """Raise SceneError for anything outside the grammar."""
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
            raise SceneError(f"{self} cannot contain '{ast.unparse(node)}'. {GRAMMAR}")

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
            other = "" if most == fewest else " or more" if most == math.inf else f" or {most:g}"
            raise SceneError(f"{self} gives '{name}' {count} arguments. Give it {fewest}{other}.")


def _function(node: ast.expr, known: Mapping[str, Dual]) -> Callable[[float], Dual]:
    """A checked tree as a function of time (s); `known` holds the values of all names but t."""
    match node:
        case ast.BinOp():
            combine = OPERATORS[type(node.op)]
            left, right = _function(node.left, known), _function(node.right, known)
            return lambda time: combine(left(time), right(time))
        case ast.UnaryOp():
            sign, operand = SIGNS[type(node.op)], _function(node.operand, known)
            return lambda time: sign(operand(time))
        case ast.Call(func=ast.Name(id=name)):
            apply = FUNCTIONS[name][0]
            arguments = [_function(argument, known) for argument in node.args]
            return lambda time: apply(*[argument(time) for argument in arguments])
        case ast.Name(id="t"):
            return lambda time: Dual(time, 1.0)
        case ast.Name():
            value = known[node.id]
            return lambda _: value
        case ast.Constant():
            number = Dual(float(node.value))  # type: ignore[arg-type]
            return lambda _: number
    raise AssertionError(ast.dump(node))

"""Formulas of a scene: what they give, their derivative, and what they refuse."""

from __future__ import annotations

import math
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flowborne.base.errors import SceneError
from flowborne.motion.formula import Formula

CONSTANTS = {"amplitude": 20.0, "rate": -0.7}
STEP = 1e-6

SMOOTH = (
    "3",
    "-t + 2.5",
    "amplitude * ramp(t) * sin(2*pi*(0.5*t - 0.14*1))",
    "ramp(t - 0.5, 3) / (1 + t**2)",
    "exp(rate * t) * cos(t)**2 - tan(0.1 * t)",
    "sqrt(1 + t * t) * tanh(t) + log(2 + t**2)",
    "(1.5 + tanh(t))**sin(t)",
    "2**-t",
)


@pytest.mark.parametrize("text", SMOOTH)
@given(time=st.floats(-6.0, 6.0))
def test_slope_is_the_derivative_of_the_value(text: str, time: float) -> None:
    formula = Formula(text, CONSTANTS)
    change = formula.at(time + STEP).value - formula.at(time - STEP).value
    assert formula.at(time).slope == pytest.approx(change / (2.0 * STEP), rel=1e-6, abs=1e-4)


@pytest.mark.parametrize(
    ("text", "time", "value", "slope"),
    [
        ("2 + 3 * t - t / 4", 2.0, 7.5, 2.75),
        ("-t**2", 3.0, -9.0, -6.0),
        ("t**0", 0.0, 1.0, 0.0),
        ("ramp(t)", 0.25, 3 / 16 - 2 / 64, 1.5 * 0.75),
        ("ramp(t)", -1.0, 0.0, 0.0),
        ("ramp(t, 4)", 1.0, 3 / 16 - 2 / 64, 1.5 * 0.75 / 4),
        ("ramp(t, 4)", 9.0, 1.0, 0.0),
        ("sqrt(0) + sin(pi / 2)", 1.0, 1.0, 0.0),
        ("amplitude + rate * t", 10.0, 13.0, -0.7),
        ("abs(rate * t)", 2.0, 1.4, 0.7),
        ("min(t, 1, 2 - t)", 1.5, 0.5, -1.0),
        ("abs(t - 1)", 1.0, 0.0, 1.0),
        ("abs(1 - t)", 1.0, 0.0, 1.0),
        ("min(t, 1)", 1.0, 1.0, 0.0),
        ("max(t, 1)", 1.0, 1.0, 1.0),
        ("t % 1.75", 4.0, 0.5, 1.0),
        ("t % 1.75", 3.5, 0.0, 1.0),
        ("-t % 1.75", 0.5, 1.25, -1.0),
        ("7 % t", 2.0, 1.0, -3.0),
        ("sin(2*pi*min(t % 1.75, 1))", 2.0, 1.0, 0.0),
    ],
)
def test_formula_at_known_times(text: str, time: float, value: float, slope: float) -> None:
    """At a kink the slope is that of later times."""
    found = Formula(text, CONSTANTS).at(time)
    assert (found.value, found.slope) == pytest.approx((value, slope), abs=1e-14)


@pytest.mark.parametrize(
    "text", ["sqrt(t)", "1 / t", "1 % t", "log(t)", "t**-1", "exp(1000 - t)", "1e999"]
)
def test_a_formula_that_is_not_finite_says_when(text: str) -> None:
    with pytest.raises(ArithmeticError, match=r"derivative is not finite at t = 0 s$"):
        Formula(text).at(0.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("amplitud * t", "name 'amplitud' is not known; did you mean 'amplitude'?"),
        ("x * t", "name 'x' is not known. Add it to [constants], or take one of: amplitude, "),
        ("sinn(t)", "function 'sinn' is not known; did you mean 'sin'?"),
        ("amplitude(t)", "function 'amplitude' is not known. Take one of: sin, cos, "),
        ("sin * t", "has function 'sin' without an argument. Add it."),
        ("ramp(t, 1, 2)", "gives 'ramp' 3 arguments. Give it 1 or 2."),
        ("min(t)", "gives 'min' 1 arguments. Give it 2 or more."),
        ("sin(t, t)", "gives 'sin' 2 arguments. Give it 1."),
        ("2pi", "cannot be read. A formula has numbers, t, pi, constants, + - * / % ** and"),
        ("t^2", "cannot contain 't ^ 2'. A formula has numbers"),
        ("t if t > 1 else 0", "cannot contain 't if t > 1 else 0'."),
        ("t.real", "cannot contain 't.real'."),
        ("__import__('os')", "function '__import__' is not known."),
        ("(lambda: t)()", "cannot contain '(lambda: t)()'."),
        ("sin(x=t)", "cannot contain 'sin(x=t)'."),
        ("[t][0]", "cannot contain '[t][0]'."),
        ("True", "cannot contain 'True'."),
        ("'t'", "cannot contain ''t''."),
        ("1j", "cannot contain '1j'."),
        ("1" + "0" * 400, "is nested too deep, or has too large a number. Simplify it."),
        ("+".join("t" * 3000), "Simplify it."),
    ],
)
def test_what_is_no_formula_is_refused(text: str, said: str) -> None:
    with pytest.raises(SceneError) as caught:
        Formula(text, CONSTANTS)
    assert said in str(caught.value)
    assert len(str(caught.value)) < 400


def test_a_formula_knows_its_constants_and_survives_pickling() -> None:
    formula = Formula("amplitude * sin(pi * t)", CONSTANTS)
    assert formula.names() == {"amplitude"}
    again = pickle.loads(pickle.dumps(formula))
    assert again == formula
    assert again.at(0.5).value == 20.0
    assert math.isclose(again.at(1.0).slope, -20.0 * math.pi)

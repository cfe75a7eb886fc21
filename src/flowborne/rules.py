"""How far to go down a gradient, and how to add a rule.

A rule is a dataclass with `step` and `pace`; `WholePace` brings the latter for rules that always
use the whole of strength and probe.
"""

from __future__ import annotations

from flowborne.control.gradients import Poses
from flowborne.control.rules import (
    RULES,
    FixedStep,
    GoldenSection,
    QuasiNewton,
    ResilientStep,
    Rule,
    WholePace,
    descent,
)

__all__ = [
    "FixedStep",
    "GoldenSection",
    "Poses",
    "QuasiNewton",
    "ResilientStep",
    "Rule",
    "WholePace",
    "descent",
    "register",
]

register = RULES.register

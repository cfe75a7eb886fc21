"""How far to go down a gradient, and how to add a rule.

A rule is a dataclass with `step` and `step_scale`. `FullStep` has the latter for rules that always
use the full strength and probe.
"""

from __future__ import annotations

from flowborne.control.gradients import Poses
from flowborne.control.rules import (
    RULES,
    FixedStep,
    FullStep,
    GoldenSection,
    QuasiNewton,
    ResilientStep,
    Rule,
    descent,
)

__all__ = [
    "FixedStep",
    "FullStep",
    "GoldenSection",
    "Poses",
    "QuasiNewton",
    "ResilientStep",
    "Rule",
    "descent",
    "register",
]

register = RULES.register

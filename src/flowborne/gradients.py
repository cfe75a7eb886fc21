"""How the gradient of an objective is estimated, and how to add a way.

A gradient is a dataclass with a field `displacement`, which flowborne fills with what the scene's
probes say (rad or m for each dof), and with `of` and `estimate`; `FiniteDifference` brings all but
the latter.
"""

from __future__ import annotations

from flowborne.control.gradients import (
    GRADIENTS,
    Estimate,
    FiniteDifference,
    Gradient,
    GradientCentral,
    GradientOneSided,
    Poses,
)

__all__ = [
    "Estimate",
    "FiniteDifference",
    "Gradient",
    "GradientCentral",
    "GradientOneSided",
    "Poses",
    "register",
]

register = GRADIENTS.register

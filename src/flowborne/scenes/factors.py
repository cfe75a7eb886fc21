"""Tables of a scene with an amount that may change in time."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from flowborne.base.tables import NotNegative, Number, Table, check_keyframes
from flowborne.motion.inflow import Factor, FactorKeyframes, FactorRamp, FactorSteady
from flowborne.motion.tracks import Curve


class FactorsTable(Table):
    """A table whose amount may change in time.

    times    s, keyframes between which `factors` of the amount change smoothly
    factors  of it at these times
    """

    times: tuple[Number, ...] | None = None
    factors: tuple[Number, ...] | None = None

    @model_validator(mode="after")
    def _check_factors(self) -> Self:
        if self.times is not None or self.factors is not None:
            check_keyframes(self.times, self.factors, "factors")
        return self

    def keyframes(self) -> FactorKeyframes | None:
        """The factor in time; None where there are no keyframes."""
        if self.times is None or self.factors is None:
            return None
        return FactorKeyframes(Curve(self.times, self.factors))


class RampTable(FactorsTable):
    """A table whose amount may rise from rest, or change otherwise.

    ramp  s over which it rises smoothly from rest
    """

    ramp: NotNegative = 0.0

    @model_validator(mode="after")
    def _check_ramp(self) -> Self:
        if self.ramp > 0.0 and self.times is not None:
            raise ValueError("has both a ramp and keyframes. Keep one of them")
        return self

    def factor(self) -> Factor:
        """The part of the amount there is, over time."""
        ramp = FactorRamp(self.ramp) if self.ramp > 0.0 else FactorSteady()
        return self.keyframes() or ramp

    def strongest(self) -> float:
        """Largest size of that part at any time."""
        return max(map(abs, self.factors)) if self.factors else 1.0

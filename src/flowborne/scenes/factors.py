"""Tables of a scene with an amount that may change in time."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from flowborne.motion.inflow import FactorKeyframes
from flowborne.motion.tracks import Curve
from flowborne.tables import Number, Table, check_keyframes


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

"""Tables of a scene that describe mouths: patches of skin through which fluid is expelled."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from flowborne.scenes.fields import Number, Positive, Table, Text, Vector
from flowborne.scenes.schema_fluid import check_table


class PulseTable(Table):
    """Half a sine wave that comes again every period.

    period    s
    duration  s for which it lasts in each period
    start     s at which the first one begins
    """

    period: Positive
    duration: Positive
    start: Number = 0.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.duration > self.period:
            raise ValueError(
                f"lasts for {self.duration:g} s of every {self.period:g} s. "
                "Make the duration no longer than the period"
            )
        return self


class MouthTable(Table):
    """[[mouths]]: a patch of a body's skin through which fluid of the domain is expelled.

    body         the body
    position     centre of the patch in the body's frame, m
    direction    out of the body, in its frame; of any length
    radius       m; half the width of a slit in two dimensions
    volume_rate  m^3/s (m^2/s in two dimensions); negative is taken in
    times        s, keyframes between which `factors` of the volume rate change smoothly
    pulse        instead of keyframes: a pulse with volume_rate at its height
    dye          name -> value of a dye in what is expelled
    """

    body: Text
    position: Vector
    direction: Vector
    radius: Positive
    volume_rate: Number
    times: tuple[Number, ...] | None = None
    factors: tuple[Number, ...] | None = None
    pulse: PulseTable | None = None
    dye: dict[str, Number] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not any(self.direction):
            raise ValueError("has a direction of length 0. Point it out of the body")
        if self.times is None and self.factors is None:
            return self
        if self.pulse is not None:
            raise ValueError("has both a pulse and keyframes. Keep one of them")
        check_table(self.times, self.factors, "times", "factors")
        return self

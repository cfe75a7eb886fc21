"""Tables of a scene that describe mouths: patches of skin that let fluid out, or in."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from flowborne.scenes.schema_fluid import check_table
from flowborne.tables import Number, Positive, Table, Text, Vector


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
    """[[mouths]]: a patch of a body's skin through which fluid is expelled, or taken in.

    body         the body
    position     centre of the patch in the body's frame, m
    direction    out of the body, in its frame; of any length
    radius       m; half the width of a slit in two dimensions
    volume_rate  m^3/s (m^2/s in two dimensions); negative is taken in
    times        s, keyframes between which `factors` of the volume rate change smoothly
    factors      of the volume rate at these times
    pulse        instead of keyframes: a pulse with volume_rate at its height
    factor       instead of both: a formula of the factor; negative turns the flow about
    dye          name -> value of a dye in what is expelled; what is taken in has the fluid's own
    """

    body: Text
    position: Vector
    direction: Vector
    radius: Positive
    volume_rate: Number
    times: tuple[Number, ...] | None = None
    factors: tuple[Number, ...] | None = None
    pulse: PulseTable | None = None
    factor: Text | None = None
    dye: dict[str, Number] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not any(self.direction):
            raise ValueError("has a direction of length 0. Point it out of the body")
        keyframed = self.times is not None or self.factors is not None
        given = {
            "keyframes": keyframed,
            "a pulse": self.pulse is not None,
            "a formula": self.factor is not None,
        }
        found = [what for what, there in given.items() if there]
        if len(found) > 1:
            raise ValueError(f"has {' and '.join(found)}. Keep one of them")
        if keyframed:
            check_table(self.times, self.factors, "times", "factors")
        return self

"""An objective: how far a body's centre of mass is from a height, m."""

from dataclasses import dataclass

from flowborne.parts import Measurement, objective


@objective("level")
@dataclass(frozen=True)
class Level:
    body: str
    height: float

    def value(self, measured: Measurement) -> float:
        return abs(measured.body(self.body).centre[1] - self.height)

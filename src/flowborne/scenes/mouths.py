"""The mouths of a scene's bodies: their tables, checks and builder."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Self

from pydantic import Field, model_validator

from flowborne.base.tables import Number, Places, Positive, Table, Text, Vector
from flowborne.control.surroundings import Surroundings
from flowborne.coupling.cut import cut_by_bodies, jets_at
from flowborne.coupling.mouths import Mouth
from flowborne.coupling.world import Setup, World
from flowborne.fluid.sides.far import Strength
from flowborne.motion.formula import Formula
from flowborne.motion.inflow import FactorFormula, FactorPulse, FactorSteady
from flowborne.scenes.factors import FactorsTable
from flowborne.solids.model import SolidModel, SolidState


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


class MouthTable(FactorsTable):
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
    dye          name -> value of a dye in the expelled fluid
    """

    body: Text
    position: Vector
    direction: Vector
    radius: Positive
    volume_rate: Number
    pulse: PulseTable | None = None
    factor: Text | None = None
    dye: dict[str, Number] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not any(self.direction):
            raise ValueError("has a direction of length 0. Point it out of the body")
        given = {"keyframes": self.times, "a pulse": self.pulse, "a formula": self.factor}
        found = [what for what, value in given.items() if value is not None]
        if len(found) > 1:
            raise ValueError(f"has {' and '.join(found)}. Keep one of them")
        return self

    def build(self, model: SolidModel, number: int, constants: Mapping[str, float]) -> Mouth:
        """The mouth, `number` from 1 in messages; `constants` of its formula."""
        x, y, z = self.position
        length = math.hypot(*self.direction)
        a, b, c = (component / length for component in self.direction)
        return Mouth(
            f"mouth {number} of body '{self.body}'",
            model.body_names.index(self.body),
            (x, y, z),
            (a, b, c),
            self.radius,
            self.volume_rate,
            self._strength(constants),
            dict(self.dye),
        )

    def _strength(self, constants: Mapping[str, float]) -> Strength:
        if self.factor is not None:
            return FactorFormula(Formula(self.factor, constants))
        if self.pulse is not None:
            return FactorPulse(self.pulse.period, self.pulse.duration, self.pulse.start)
        return self.keyframes() or FactorSteady()


def check_mouths(
    places: Places, mouths: Sequence[MouthTable], coupling: str, around: Surroundings
) -> Iterator[str]:
    """The bodies of mouths exist, and the fluid is coupled two-way."""
    unknown = []
    for index, mouth in enumerate(mouths):
        where = places.at("mouths", index)
        unknown += [f"{where}: {problem}" for problem in around.unknown_bodies([mouth.body])]
    yield from unknown
    if mouths and coupling != "two-way" and places.sound("fluid"):
        yield (
            f"{places.at('fluid', 'coupling')}: the fluid does not feel bodies with mouths when it "
            f"is '{coupling}'. Make it 'two-way', or drop [[mouths]]."
        )


def check_mouth_cells(
    places: Places, mouths: Sequence[Mouth], setup: Setup, start: SolidState
) -> Iterator[str]:
    """Every mouth must cover cells of the grid at the start; for a scene with no other fault."""
    world = World.at_rest(setup)
    world.solid = start
    cut_by_bodies(world)
    for index, mouth in enumerate(mouths):
        world.setup = Setup(setup.solid, setup.fluid, mouths=(mouth,))
        try:
            jets_at(world, 0.0)
        except ValueError as error:
            yield f"{places.at('mouths', index)}: {error}."

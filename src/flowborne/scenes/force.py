"""The forces of a scene on single bodies: their table, check and builder."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import AfterValidator

from flowborne.base.tables import Number, Text, Vector, triple
from flowborne.control.surroundings import Surroundings
from flowborne.kernels.arrays import Array
from flowborne.motion.formula import Formula
from flowborne.motion.inflow import Factor, FactorSteady
from flowborne.scenes.factors import FactorsTable
from flowborne.solids.force import Components, Force, Frame, beyond_plane, immovable

Component = Number | Text
"""A number, or a formula of the time t."""


def _three(components: tuple[Component, ...]) -> tuple[Component, ...]:
    if len(components) not in (2, 3):
        raise ValueError(f"has {len(components)} entries. Give x, y and z, or x and y")
    return (*components, 0.0)[:3]


Formulas = Annotated[tuple[Component, ...], AfterValidator(_three)]
"""(x, y, z), each a number or a formula; z may be left out and is then 0."""


@dataclass(frozen=True)
class Varying:
    """Components times a factor, which change in time."""

    components: tuple[Formula | float, ...]
    factor: Factor

    def __call__(self, time: float) -> Array:
        """(3,) at `time` (s)."""
        values = [c.at(time).value if isinstance(c, Formula) else c for c in self.components]
        return self.factor.at(time) * np.array(values)


class ForceTable(FactorsTable):
    """[[force]]: a force on a body from outside: a tow, a gust, a thruster that acts on no water.

    body     on which it acts
    force    N (N/m in two dimensions), numbers or formulas of the time t in s
    torque   N m about the point, numbers or formulas
    point    where it acts, in the body's frame, m; the body's centre of mass unless given
    frame    of force and torque: "world", or "body", with which they turn
    times    s, keyframes between which `factors` of both change smoothly
    factors  of both at these times
    """

    body: Text
    force: Formulas = (0.0, 0.0, 0.0)
    torque: Formulas = (0.0, 0.0, 0.0)
    point: Vector | None = None
    frame: Frame = "world"

    def check(self, around: Surroundings) -> Iterator[str]:
        """Everything that does not fit the scene around it."""
        yield from around.unknown_bodies([self.body])
        yield from immovable(around.model, self.body)
        yield from beyond_plane(around.model, self.force, self.torque)

    @property
    def rests(self) -> bool:
        """Whether it does not change in time."""
        return self.times is None and not any(self.formulas())

    def formulas(self) -> Iterator[tuple[str, int, str]]:
        """Key, entry and text of each formula."""
        for key, components in (("force", self.force), ("torque", self.torque)):
            for place, component in enumerate(components):
                if isinstance(component, str):
                    yield key, place, component

    def build(self, constants: Mapping[str, float]) -> Force:
        """The force; `constants` of its formulas."""
        force, torque = (self._varying(given, constants) for given in (self.force, self.torque))
        point = None if self.point is None else triple(self.point)
        return Force(self.body, force, torque, point, self.frame)

    def _varying(self, given: tuple[Component, ...], constants: Mapping[str, float]) -> Components:
        found = [Formula(c, constants) if isinstance(c, str) else c for c in given]
        numbers = [c for c in found if not isinstance(c, Formula)]
        if self.times is None and len(numbers) == 3:
            return triple(tuple(numbers))
        return Varying(tuple(found), self.keyframes() or FactorSteady())

"""The simple winds of a scene: their tables, checks and winds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from flowborne.base.errors import PartError
from flowborne.base.tables import (
    FUNCTION,
    ByKind,
    NotNegative,
    Parameters,
    Positive,
    Table,
    Text,
    Vector,
    triple,
)
from flowborne.control.surroundings import Surroundings, with_parameters
from flowborne.coupling.stream import WindStream
from flowborne.kernels.arrays import Array
from flowborne.motion.inflow import Factor, FactorSteady
from flowborne.scenes.factors import FactorsTable
from flowborne.solids.wind import Wind, WindFaces, WindForce


@dataclass(frozen=True)
class Gusts:
    """Wind over the ground: velocity (z / height)^exponent times a factor in time.

    velocity  (3,) m/s at `height` (m)
    """

    velocity: tuple[float, float, float]
    exponent: float
    height: float
    factor: Factor

    def __call__(self, x: Array, time: float) -> Array:
        """(n, 3) velocity in m/s at the places x (n, 3)."""
        share = np.maximum(x[:, 2] / self.height, 0.0) ** self.exponent
        return self.factor.at(time) * share[:, None] * np.array(self.velocity)


@dataclass(frozen=True)
class WindFunction:
    """A wind by a function of the user's own; see `WindField`.

    function  (x (n, 3) in m, time in s) -> (n, 3) m/s
    name      for messages
    """

    function: Callable[..., Any]
    name: str

    def __call__(self, x: Array, time: float) -> Array:
        """(n, 3) velocity in m/s at the places x (n, 3). Raises PartError when it is not that."""
        with PartError.guarding(f"wind '{self.name}'"):
            given = self.function(x, time)
        try:
            velocity = np.asarray(given, dtype=np.float64)
        except (TypeError, ValueError):
            raise PartError(
                f"wind '{self.name}' gave a {type(given).__name__} that is no array of numbers: "
                "return velocities, a row (3,) for each place"
            ) from None
        if velocity.shape not in ((3,), x.shape) or not np.isfinite(velocity).all():
            raise PartError(
                f"wind '{self.name}' gave an array of shape {velocity.shape}, or numbers that are "
                f"not finite, for {len(x)} places: return finite velocities, a row (3,) for each"
            )
        return np.broadcast_to(velocity, x.shape)


class AnyWindTable(Table):
    """What every wind has.

    bodies  on which it acts; every body unless given
    """

    bodies: tuple[Text, ...] | None = Field(default=None, min_length=1)

    def check(self, around: Surroundings) -> Iterator[str]:
        """Everything that does not fit the scene around it."""
        yield from around.unknown_bodies(self.bodies or ())

    def build(self, around: Surroundings) -> Wind | None:
        """The wind, where `check` finds nothing; None where the fluid itself acts on the bodies."""
        raise NotImplementedError


class WindFacesTable(AnyWindTable, FactorsTable):
    """Simple wind of the paper's eq. (2): the force on a face depends on its exposure.

    velocity  of the wind, m/s; with an exponent, at `height`
    density   kg/m^3
    exponent  of the wind over the ground: it grows as (z / height)^exponent; 0 is uniform
    height    m
    times     s, keyframes of gusts between which `factors` of the velocity change smoothly
    factors   of the velocity at these times
    """

    kind: Literal["faces"]
    velocity: Vector
    density: Positive = 1.2
    exponent: NotNegative = 0.0
    height: Positive = 10.0

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from super().check(around)
        if self.exponent > 0.0 and around.is_slab:
            yield (
                "an exponent makes the wind grow with z, which a scene of 2 dimensions does not "
                "have. Drop it."
            )

    def build(self, around: Surroundings) -> WindFaces:
        velocity = triple(self.velocity)
        if self.exponent == 0.0 and self.times is None:
            return WindFaces(velocity, self.density, self.bodies)
        gusts = Gusts(velocity, self.exponent, self.height, self.keyframes() or FactorSteady())
        return WindFaces(gusts, self.density, self.bodies)


class WindStreamTable(AnyWindTable):
    """The fluid as a simple wind of eq. (2), for a fluid without two-way coupling.

    It has the fluid's velocity if fluid.coupling is "one-way", and `velocity` if that is "none" or
    there is no fluid. With "two-way" the fluid itself acts on the bodies, and this wind does not.

    velocity  m/s
    density   kg/m^3
    """

    kind: Literal["stream"]
    velocity: Vector
    density: Positive = 1.2

    def build(self, around: Surroundings) -> Wind | None:
        if not around.has_fluid:
            return WindFaces(triple(self.velocity), self.density, self.bodies)
        return WindStream(self.density, self.bodies) if around.is_one_way else None


class WindPythonTable(AnyWindTable):
    """Simple wind of eq. (2) from a Python function "module:name".

    function    takes places (n, 3) in m and a time in s, and gives velocities (n, 3) in m/s
    parameters  further arguments of the function, by name
    density     kg/m^3
    """

    kind: Literal["python"]
    function: Annotated[str, Field(pattern=FUNCTION)]
    parameters: Parameters = Field(default_factory=dict)
    density: Positive = 1.2

    def check(self, around: Surroundings) -> Iterator[str]:
        yield from super().check(around)
        yield from around.unusable_function(self.function, self.parameters)

    def build(self, around: Surroundings) -> WindFaces:
        function = with_parameters(self.function, self.parameters)
        return WindFaces(WindFunction(function, self.function), self.density, self.bodies)


class WindForceTable(AnyWindTable):
    """The same force at each body's centre of mass.

    force   N, or N per unit depth in two dimensions
    """

    kind: Literal["force"]
    force: Vector

    def build(self, around: Surroundings) -> WindForce:
        return WindForce(triple(self.force), self.bodies)


WindTable = Annotated[WindFacesTable | WindStreamTable | WindPythonTable | WindForceTable, *ByKind]

"""The simple winds of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.stream import WindStream
from flowborne.fluid.grid import Array
from flowborne.motion.inflow import Factor, FactorKeyframes, FactorSteady
from flowborne.motion.tracks import Curve
from flowborne.python_function import WindFunction, with_parameters
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_solids import (
    WindFacesTable,
    WindForceTable,
    WindPythonTable,
    WindStreamTable,
    WindTable,
)
from flowborne.solids.wind import Wind, WindFaces, WindForce
from flowborne.tables import triple


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


def winds_of(scene: Scene) -> tuple[Wind, ...]:
    """The winds that blow on the bodies themselves; a two-way coupled fluid needs none for it."""
    return tuple(wind for table in scene.wind if (wind := _wind(table, scene)) is not None)


def _wind(table: WindTable, scene: Scene) -> Wind | None:
    if isinstance(table, WindForceTable):
        return WindForce(triple(table.force), table.bodies)
    if isinstance(table, WindPythonTable):
        function = with_parameters(table.function, table.parameters)
        return WindFaces(WindFunction(function, table.function), table.density, table.bodies)
    if isinstance(table, WindStreamTable):
        return _stream(table, scene)
    velocity = triple(table.velocity)
    if table.exponent == 0.0 and table.times is None:
        return WindFaces(velocity, table.density, table.bodies)
    gusts = Gusts(velocity, table.exponent, table.height, _factor(table))
    return WindFaces(gusts, table.density, table.bodies)


def _stream(table: WindStreamTable, scene: Scene) -> Wind | None:
    if scene.fluid is None or scene.fluid.coupling == "none":
        return WindFaces(triple(table.velocity), table.density, table.bodies)
    one_way = scene.fluid.coupling == "one-way"
    return WindStream(table.density, table.bodies) if one_way else None


def _factor(table: WindFacesTable) -> Factor:
    if table.times is None or table.factors is None:
        return FactorSteady()
    return FactorKeyframes(Curve(table.times, table.factors))

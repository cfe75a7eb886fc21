"""The mouths of a scene's bodies."""

from __future__ import annotations

import math
from collections.abc import Mapping

from flowborne.coupling.mouths import Mouth, Strength
from flowborne.motion.formula import Formula
from flowborne.motion.inflow import FactorFormula, FactorKeyframes, FactorPulse, FactorSteady
from flowborne.motion.tracks import Curve
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_mouths import MouthTable
from flowborne.solids.model import SolidModel


def mouths_of(scene: Scene, model: SolidModel) -> tuple[Mouth, ...]:
    """The mouths, in the order of the file; none where the fluid is left out."""
    if not scene.has_fluid:
        return ()
    return tuple(
        _mouth(table, n, model, scene.constants) for n, table in enumerate(scene.mouths, start=1)
    )


def _mouth(
    table: MouthTable, number: int, model: SolidModel, constants: Mapping[str, float]
) -> Mouth:
    x, y, z = table.position
    length = math.hypot(*table.direction)
    a, b, c = (component / length for component in table.direction)
    return Mouth(
        f"mouth {number} of body '{table.body}'",
        model.body_names.index(table.body),
        (x, y, z),
        (a, b, c),
        table.radius,
        table.volume_rate,
        _strength(table, constants),
        dict(table.dye),
    )


def _strength(table: MouthTable, constants: Mapping[str, float]) -> Strength:
    if table.factor is not None:
        return FactorFormula(Formula(table.factor, constants))
    if table.pulse is not None:
        return FactorPulse(table.pulse.period, table.pulse.duration, table.pulse.start)
    if table.times is not None and table.factors is not None:
        return FactorKeyframes(Curve(table.times, table.factors))
    return FactorSteady()

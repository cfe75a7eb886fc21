"""A cylinder in a channel whose inflow swells and dies away: B3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne import Array
from flowborne.validation.case import Case, Curve, Finding, Plot, Tier
from flowborne.validation.fixed_bodies import (
    CFL,
    SHEDDING,
    SHEDDING_GRIDS,
    Parabola,
    channel,
    pressure_drop,
    series_of,
    within,
)
from flowborne.validation.reference import reference
from flowborne.validation.shedding import crest
from flowborne.worlds import advance

DURATION = 8.0
"""s, half a period of the inflow."""

DRAG_AT, LIFT_AT = 3.93625, 5.693125
"""s, when the published drag and lift are largest."""


@dataclass(frozen=True)
class Pulse:
    """Inflow of the channel that starts and ends at rest, as a profile."""

    def __call__(self, x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
        return Parabola(SHEDDING.fastest * np.sin(np.pi * time / DURATION))(x, y, z)


def pulse(cells: int, duration: float = DURATION) -> Array:
    """(n, 4) time in s, drag and lift coefficient, pressure drop in Pa, from a fluid at rest."""
    world = channel(cells, Pulse())
    fluid, _ = world.flow()
    count = int(np.ceil(duration * SHEDDING.fastest / (CFL * fluid.grid.spacing)))
    dt = duration / count
    rows = []
    for _ in range(count):
        drag, lift = SHEDDING.coefficients(advance(world, dt))
        rows.append((world.time, drag, lift, pressure_drop(world)))
    return np.array(rows)


def swelling_inflow(quick: bool) -> list[Finding]:
    """B3: largest drag and lift in the pulse, and the pressure drop at its end."""
    grids = SHEDDING_GRIDS[quick]
    runs = [pulse(n) for n in grids]
    drag, lift, drop = (
        series_of("B3", quantity, grids, values)
        for quantity, values in (
            ("cD max", [crest(run[:, 1])[0] for run in runs]),
            ("cL max", [crest(run[:, 2])[0] for run in runs]),
            ("dp(t=8)", [float(run[-1, 3]) for run in runs]),
        )
    )
    shown = (
        course(runs[-1], 1, "drag coefficient", DRAG_AT, reference("B3", "cD max")),
        course(runs[-1], 2, "lift coefficient", LIFT_AT, reference("B3", "cL max")),
        course(runs[-1], 3, "pressure drop (Pa)", DURATION, reference("B3", "dp(t=8)")),
    )
    return [
        within("B3", "cD max", drag, (2.93, 2.97), plot=shown[0]),
        within("B3", "cL max", lift, (0.47, 0.49), plot=shown[1]),
        within("B3", "dp(t=8)", drop, (-0.115, -0.105), plot=shown[2]),
    ]


def course(run: Array, column: int, name: str, time: float, published: float) -> Plot:
    """A column of a run over time, a few hundred points of it, beside the one published value."""
    thinned = run[:: max(1, len(run) // 400)]
    curves = (
        Curve("published", (time,), (published,), True),
        Curve("flowborne", thinned[:, 0], thinned[:, column]),
    )
    return Plot("t (s)", name, curves)


CASES = (Case("B3", swelling_inflow, Tier.HALF_HOUR, coarse=True),)

"""The flyer of the paper's Figs. 11 and 12: what the twist of its outer wings is worth (K11)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from flowborne.fluid.grid import Array
from flowborne.scenes.load import load_scene
from flowborne.simulation import BlowUpError, Simulation
from flowborne.validation.case import Case, Finding

CYCLES = {True: 1, False: 5}
"""Strokes that are followed, by quick."""

COARSE = {"domain.resolution": "16", "time.frames_per_second": "20"}
"""Settings of the quick runs."""


@dataclass(frozen=True)
class Flight:
    """What the air does to the flyer, a row per frame.

    time    (n,) s
    stroke  (n,) degrees of the inner wings, positive up
    lift    (n,) N, upward force of the air on the whole creature
    period  s of a stroke
    """

    time: Array
    stroke: Array
    lift: Array
    period: float

    def impulses(self) -> Array:
        """(cycles, 2) upward impulse of each downstroke and of each upstroke, N s."""
        dt = float(self.time[1] - self.time[0])
        down = np.gradient(self.stroke) < 0.0
        cycle = ((self.time - 0.5 * dt) / self.period).astype(int)
        return np.array(
            [
                [dt * self.lift[(cycle == n) & half].sum() for half in (down, ~down)]
                for n in range(int(cycle.max()) + 1)
            ]
        )


def fly(scene: str, cycles: float, settings: Mapping[str, str] = MappingProxyType({})) -> Flight:
    """Run a flyer for some strokes.

    settings  in place of the scene's own
    raises    ArithmeticError when the run blows up
    """
    loaded = load_scene(scene, settings)
    period = next(table.period for table in loaded.motion if table.kind == "sinusoid")
    rows = []
    with Simulation(loaded, workers=1) as simulation:
        place = simulation.world.setup.solid.positions_of("left_stroke")[0]
        try:
            for _ in range(round(cycles * period / simulation.frame_time)):
                step = simulation.advance_frame().step
                stroke = np.degrees(simulation.world.solid.q[place])
                force = step.pressure_wrench + step.viscous_wrench
                rows.append((simulation.time, stroke, force[:, 2].sum()))
        except BlowUpError as error:
            raise ArithmeticError(f"{scene}: {error}") from error
    time, stroke, lift = np.array(rows).T
    return Flight(time, stroke, lift, period)


def flights(quick: bool) -> dict[str, Flight]:
    """The flyer without control and with twist, over the strokes of the case."""
    settings = COARSE if quick else {}
    return {name: fly(f"flyer-{name}", CYCLES[quick], settings) for name in ("base", "twist")}


def twist_is_worth_it(quick: bool) -> list[Finding]:
    """K11, the flyer: upward impulse with control over that without, and down- over upstroke."""
    found = flights(quick)
    with_control, without = found["twist"].impulses(), found["base"].impulses()
    gain = float((with_control.sum(axis=1) - without.sum(axis=1)).mean())
    lines = [
        f"cycle {n + 1}: down {c[0]:.1f}, up {c[1]:.1f} with control; "
        f"down {b[0]:.1f}, up {b[1]:.1f} without"
        for n, (c, b) in enumerate(zip(with_control, without, strict=True))
    ]
    down, up = np.abs(with_control).mean(axis=0)
    return [
        Finding(
            "flyer: upward impulse of a stroke with control less that without, N s",
            gain,
            "> 0",
            "sign",
            gain > 0.0,
            lines=tuple(lines),
        ),
        Finding(
            "flyer: drag impulse of the downstroke over that of the upstroke, with control",
            float(down / up),
            "> 1",
            "more",
            bool(down > up),
        ),
    ]


CASES = (Case("K11", twist_is_worth_it),)

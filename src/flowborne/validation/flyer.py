"""The flyers of the paper's Figs. 11 to 13: what control of their outer wings is worth (K11)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from flowborne import Array, BlowUpError, Scene, Simulation, load_scene
from flowborne.validation.case import Finding

CYCLES = {True: 1, False: 5}
"""Strokes that are followed, by quick."""

COARSE = {"domain.resolution": "16", "time.frames_per_second": "20"}
"""Settings of the quick runs."""

COARSE_FLESH = {"domain.resolution": "26", "time.frames_per_second": "20"}
"""As COARSE, but finer: wings of flesh grow on all sides where the grid needs them thicker."""


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


def held(scene: Scene) -> Scene:
    """The scene without control: its controlled joints stay at 0."""
    tables = scene.model_dump(exclude_none=True, exclude={"control", "objectives", "controller"})
    still = [{"kind": "constant", "joint": joint} for joint in scene.controlled_joints()]
    tables["motion"] = [*tables["motion"], *still]
    return Scene.model_validate(tables).in_folder(scene.folder)


def fly(
    scene: str,
    cycles: float,
    settings: Mapping[str, str] = MappingProxyType({}),
    controlled: bool = True,
) -> Flight:
    """Run a flyer for some strokes.

    settings    in place of the scene's own
    controlled  False: as `held`
    raises      ArithmeticError when the run blows up
    """
    loaded = load_scene(scene, settings)
    if not controlled:
        loaded = held(loaded)
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


def worth(name: str, controlled: Flight, without: Flight) -> list[Finding]:
    """Upward impulse of a flyer with control over that without, and down- over upstroke."""
    ours, others = controlled.impulses(), without.impulses()
    gain = float((ours.sum(axis=1) - others.sum(axis=1)).mean())
    lines = [
        f"cycle {n + 1}: down {c[0]:.1f}, up {c[1]:.1f} with control; "
        f"down {b[0]:.1f}, up {b[1]:.1f} without"
        for n, (c, b) in enumerate(zip(ours, others, strict=True))
    ]
    down, up = np.abs(ours).mean(axis=0)
    return [
        Finding(
            f"{name}: upward impulse of a stroke with control less that without, N s",
            gain,
            "> 0",
            "sign",
            gain > 0.0,
            lines=tuple(lines),
        ),
        Finding(
            f"{name}: drag impulse of the downstroke over that of the upstroke, with control",
            float(down / up),
            "> 1",
            "more",
            bool(down > up),
        ),
    ]


def control_is_worth_it(quick: bool) -> list[Finding]:
    """K11, the flyer: wings that twist, then wings of flesh that bend."""
    found = flights(quick)
    settings = COARSE_FLESH if quick else {}
    bend, straight = (
        fly("flyer-flesh", CYCLES[quick], settings, controlled) for controlled in (True, False)
    )
    return [
        *worth("flyer", found["twist"], found["base"]),
        *worth("flyer of flesh", bend, straight),
    ]

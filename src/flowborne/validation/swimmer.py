"""The swimmer of the paper's Fig. 7: what its legs are worth beside its jet (K11)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from flowborne import Array, BlowUpError, Simulation, load_scene
from flowborne.bodies import kinematics
from flowborne.validation.case import Case, Finding, Tier
from flowborne.validation.flyer import control_is_worth_it

CYCLE = 1.75
"""s."""

CYCLES = {True: 1, False: 3}
"""Cycles that are followed, by quick."""

COARSE = {"domain.resolution": "72"}
"""Settings of the quick runs: legs of 1.4 cells."""

STILL = 0.2
"""Degrees by which legs at rest may turn in a frame."""

ENOUGH = 1.2
"""What the paper's swimmer claims to gain by its legs, at least."""

SCENES = ("swimmer", "swimmer-jet-only", "swimmer-no-control")

STROKE = "swimmer-stroke"

PASSIVE = {"control": "[]", "objectives": "[]", "initial.positions": "{}"}
"""Settings of a swimmer with its jet alone."""


@dataclass(frozen=True)
class Swim:
    """How a swimmer got on, a row per frame.

    time    (n,) s
    height  (n,) m that the head has risen
    tilt    (n,) degrees of the head's axis from the vertical
    push    (n,) N, upward force of the water on the whole creature
    work    (n,) J that the drives have done so far
    spread  (n,) degrees, mean angle of the legs
    """

    time: Array
    height: Array
    tilt: Array
    push: Array
    work: Array
    spread: Array

    def risen(self) -> float:
        """m in all."""
        return float(self.height[-1])

    def pushed(self, sign: float) -> float:
        """N, mean upward force while the legs open (sign 1) or close (sign -1)."""
        turning = sign * np.diff(self.spread) > STILL
        return float(self.push[1:][turning].mean())


def swim(scene: str, cycles: float, settings: Mapping[str, str] = MappingProxyType({})) -> Swim:
    """Run a swimmer for some cycles.

    settings  in place of the scene's own
    raises    ArithmeticError when the run blows up
    """
    rows, work = [], 0.0
    with Simulation(load_scene(scene, settings)) as simulation:
        model = simulation.world.setup.solid
        head = model.body("head")
        legs = [model.positions_of(f"leg_{n}")[0] for n in range(1, 6)]
        start = kinematics(model, simulation.world.solid.q).body_position[head, 2]
        try:
            for _ in range(round(cycles * CYCLE / simulation.frame_time)):
                steps = simulation.advance_frame().steps
                pose = kinematics(model, simulation.world.solid.q)
                work += sum(step.work for step in steps)
                tilt = np.degrees(np.arccos(np.clip(pose.body_rotation[head, 2, 2], -1.0, 1.0)))
                push = np.mean([step.pressure_wrench[:, 2].sum() for step in steps])
                rise = pose.body_position[head, 2] - start
                spread = np.degrees(simulation.world.solid.q[legs].mean())
                rows.append((simulation.time, rise, tilt, push, work, spread))
        except BlowUpError as error:
            raise ArithmeticError(f"{scene}: {error}") from error
    return Swim(*np.array(rows).T)


def swims(quick: bool) -> dict[str, Swim]:
    """The swimmer, with its jet alone, and with neither, over the cycles of the case."""
    settings = COARSE if quick else {}
    return {name: swim(name, CYCLES[quick], settings) for name in SCENES}


def course_of(name: str, run: Swim) -> str:
    """What a run came to, in words."""
    return (
        f"{name}: rises {run.risen():.2f} m, tilts by at most {run.tilt.max():.1f} degrees, its "
        f"drives do {1e-3 * run.work[-1]:.0f} kJ"
    )


def legs_gain(scene: str, whole: Swim, jet: Swim, lines: tuple[str, ...]) -> Finding:
    """Way up of a swimmer over that of its jet alone."""
    gain = whole.risen() / jet.risen()
    said = f"{scene}: way up with jet and control over that with the jet alone"
    return Finding(said, gain, f">= {ENOUGH:g}", "more", gain >= ENOUGH, lines=lines)


def legs_are_worth_it(quick: bool) -> list[Finding]:
    """K11, the swimmer: its way over that of the jet alone, and its force in stroke and opening."""
    found = swims(quick)
    whole, jet, neither = (found[name] for name in SCENES)
    stroke, opening = whole.pushed(-1.0), whole.pushed(1.0)
    lines = tuple(course_of(name, run) for name, run in found.items())
    return [
        legs_gain("swimmer", whole, jet, lines),
        Finding(
            "swimmer: way up with jet and control less that with neither, m",
            whole.risen() - neither.risen(),
            "> 0",
            "sign",
            whole.risen() > neither.risen(),
        ),
        Finding(
            "swimmer: upward force of the water as legs close over the downward one as they open",
            stroke / abs(opening),
            "> 1",
            "more",
            stroke > abs(opening),
            lines=(f"closing {1e-3 * stroke:.1f} kN, opening {1e-3 * opening:.1f} kN",),
        ),
    ]


def stroke_is_worth_it(quick: bool) -> list[Finding]:
    """The swimmer with objectives that are not the paper's, by the same measure."""
    settings = COARSE if quick else {}
    whole = swim(STROKE, CYCLES[quick], settings)
    jet = swim(STROKE, CYCLES[quick], {**settings, **PASSIVE})
    lines = (course_of(STROKE, whole), course_of("its jet alone", jet))
    return [legs_gain(STROKE, whole, jet, lines)]


def creatures(quick: bool) -> list[Finding]:
    """K11: the flyers and the swimmers."""
    return control_is_worth_it(quick) + legs_are_worth_it(quick) + stroke_is_worth_it(quick)


CASES = (Case("K11", creatures, Tier.HALF_HOUR),)

"""The paper's flyers (Figs. 11 to 13) and swimmer (Fig. 7): the gain by control of them, K11."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from flowborne import Array, FrameReport, Scene, Simulation, load_scene
from flowborne.bodies import kinematics
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.worlds import frames_of

CYCLE = 1.75
"""s, of the swimmer."""

SWIMMERS, STROKE = ("swimmer", "swimmer-jet-only", "swimmer-no-control"), "swimmer-stroke"


@dataclass(frozen=True)
class Flight:
    """Forces of the air on a flyer, a row per frame.

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
    with Simulation(loaded, workers=1) as simulation:
        joint = simulation.world.setup.solid.positions_of("left_stroke")[0]

        def figures(report: FrameReport) -> tuple[float, float, float]:
            stroke = np.degrees(simulation.world.solid.q[joint])
            force = report.step.pressure_wrench + report.step.viscous_wrench
            return simulation.time, stroke, force[:, 2].sum()

        rows = frames_of(simulation, round(cycles * period / simulation.frame_time), figures)
    time, stroke, lift = rows.T
    return Flight(time, stroke, lift, period)


def flights(strokes: int, settings: Mapping[str, str] = MappingProxyType({})) -> dict[str, Flight]:
    """The flyer without control and with twist, over some strokes."""
    return {name: fly(f"flyer-{name}", strokes, settings) for name in ("base", "twist")}


def flyer_gain(name: str, controlled: Flight, without: Flight) -> Figures:
    """Upward impulse of a flyer with control over that without, and down- over upstroke."""
    ours, others = controlled.impulses(), without.impulses()
    gain = float((ours.sum(axis=1) - others.sum(axis=1)).mean())
    lines = [
        f"cycle {n + 1}: down {c[0]:.1f}, up {c[1]:.1f} with control; "
        f"down {b[0]:.1f}, up {b[1]:.1f} without"
        for n, (c, b) in enumerate(zip(ours, others, strict=True))
    ]
    down, up = np.abs(ours).mean(axis=0)
    title = f"{name}: upward impulse of a stroke with control less that without, N s"
    halves = f"{name}: drag impulse of the downstroke over that of the upstroke, with control"
    return {title: Figure(gain, lines=lines), halves: float(down / up)}


def twist_is_worth_it(strokes: int, settings: Mapping[str, str]) -> Figures:
    """K11: the flyer, whose wings twist."""
    found = flights(strokes, settings)
    return flyer_gain("flyer", found["twist"], found["base"])


def bending_is_worth_it(strokes: int, settings: Mapping[str, str]) -> Figures:
    """K11: the flyer of flesh, whose wings bend. They need a finer grid than others: a coarse one
    makes them thicker."""
    bend, straight = (
        fly("flyer-flesh", strokes, settings, controlled) for controlled in (True, False)
    )
    return flyer_gain("flyer of flesh", bend, straight)


@dataclass(frozen=True)
class Swim:
    """Motion, force and work of a swimmer, a row per frame.

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
        """N, mean upward force while the legs open (sign 1) or close (sign -1), by more than 0.2
        degrees a frame."""
        turning = sign * np.diff(self.spread) > 0.2
        return float(self.push[1:][turning].mean())


def swim(scene: str, cycles: float, settings: Mapping[str, str] = MappingProxyType({})) -> Swim:
    """Run a swimmer for some cycles.

    settings  in place of the scene's own
    raises    ArithmeticError when the run blows up
    """
    with Simulation(load_scene(scene, settings)) as simulation:
        model = simulation.world.setup.solid
        head = model.body("head")
        legs = [model.positions_of(f"leg_{n}")[0] for n in range(1, 6)]
        start = kinematics(model, simulation.world.solid.q).body_position[head, 2]

        def figures(report: FrameReport) -> tuple[float, ...]:
            pose = kinematics(model, simulation.world.solid.q)
            tilt = np.degrees(np.arccos(np.clip(pose.body_rotation[head, 2, 2], -1.0, 1.0)))
            push = np.mean([step.pressure_wrench[:, 2].sum() for step in report.steps])
            work = sum(step.work for step in report.steps)
            spread = np.degrees(simulation.world.solid.q[legs].mean())
            return simulation.time, pose.body_position[head, 2] - start, tilt, push, work, spread

        rows = frames_of(simulation, round(cycles * CYCLE / simulation.frame_time), figures)
    time, height, tilt, push, work, spread = rows.T
    return Swim(time, height, tilt, push, np.cumsum(work), spread)


def swims(cycles: int, settings: Mapping[str, str] = MappingProxyType({})) -> dict[str, Swim]:
    """The swimmer, with its jet alone, and with neither, over some cycles."""
    return {name: swim(name, cycles, settings) for name in SWIMMERS}


def summary(name: str, run: Swim) -> str:
    """Figures of a run in words."""
    return (
        f"{name}: rises {run.risen():.2f} m, tilts by at most {run.tilt.max():.1f} degrees, its "
        f"drives do {1e-3 * run.work[-1]:.0f} kJ"
    )


def legs_gain(scene: str, whole: Swim, jet: Swim, lines: Sequence[str]) -> Figures:
    """Rise of a swimmer over that with its jet alone."""
    title = f"{scene}: way up with jet and control over that with the jet alone"
    return {title: Figure(whole.risen() / jet.risen(), lines=lines)}


def legs_are_worth_it(cycles: int, settings: Mapping[str, str]) -> Figures:
    """K11, the swimmer: rise over that with the jet alone, force as the legs close and open. On the
    coarse grid its legs are 1.4 cells thick."""
    found = swims(cycles, settings)
    whole, jet, neither = (found[name] for name in SWIMMERS)
    stroke, opening = whole.pushed(-1.0), whole.pushed(1.0)
    rise = "swimmer: way up with jet and control less that with neither, m"
    force = "swimmer: upward force of the water as legs close over the downward one as they open"
    forces = f"closing {1e-3 * stroke:.1f} kN, opening {1e-3 * opening:.1f} kN"
    return {
        **legs_gain("swimmer", whole, jet, [summary(name, run) for name, run in found.items()]),
        rise: whole.risen() - neither.risen(),
        force: Figure(stroke / abs(opening), lines=[forces]),
    }


def stroke_is_worth_it(cycles: int, settings: Mapping[str, str]) -> Figures:
    """The swimmer with other objectives than the paper's, by the same measure."""
    whole = swim(STROKE, cycles, settings)
    passive = {"control": "[]", "objectives": "[]", "initial.positions": "{}"}
    jet = swim(STROKE, cycles, {**settings, **passive})
    return legs_gain(STROKE, whole, jet, [summary(STROKE, whole), summary("its jet alone", jet)])

"""The controlled block in a stream (K5), and frames until controllers arrive (K6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from flowborne import Array, Simulation, load_scene
from flowborne.worlds import advance
from flowborne_validation.case import reference
from flowborne_validation.controller import hinge_angles
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.worlds import hold_all

FRAMES_PER_SECOND = 24.0
STRENGTH = 20.0
"""degrees/s, of the block scenes."""


@dataclass(frozen=True)
class AngleHistory:
    """The angle of the block over the frames.

    angles    (frames + 1,) degrees
    step      degrees in a frame that the strength allows
    final     mean of the last tenth, at least ten frames, degrees
    reached   the first frame in which the angle is within a step of the final one
    frames    the first after which the angle stays within a step of the final one; the number of
              frames without such a frame
    chatter   largest departure from the final angle in those last frames, in steps
    """

    angles: Array
    step: float
    final: float
    reached: int
    frames: int
    chatter: float

    @property
    def arrived(self) -> bool:
        """Whether it stays within a step of the final angle to the end."""
        return self.chatter <= 1.0 + 1e-9


def course(
    scene: str,
    frames: int | None = None,
    strength: float = STRENGTH,
    resolution: int | None = None,
    rule: str | None = None,
    start: float | None = None,
) -> AngleHistory:
    """Run a built-in block scene with one worker; what is None is that of the scene.

    strength    degrees/s
    resolution  of the domain
    rule        of the controller
    start       angle in degrees
    raises      ArithmeticError when the run blows up
    """
    settings = {
        "control.0.strength": strength,
        "domain.resolution": resolution,
        "controller.rule.kind": rule,
        "initial.positions.hinge": start,
    }
    given = {key: str(value) for key, value in settings.items() if value is not None}
    with Simulation(load_scene(scene, given), workers=1) as simulation:
        angles = hinge_angles(simulation, simulation.frames if frames is None else frames)
    return judged(angles, strength / FRAMES_PER_SECOND)


def judged(angles: Array, step: float) -> AngleHistory:
    """Final angle and convergence, as in the summary of a run."""
    run = angles[1:]
    last = min(len(run), max(10, round(0.1 * len(run))))
    final = float(run[-last:].mean())
    away = np.abs(run - final)
    outside = np.flatnonzero(away > step * (1.0 + 1e-9))
    frames = int(outside[-1]) + 2 if outside.size else 1
    reached = int(np.argmax(away <= step * (1.0 + 1e-9))) + 1
    chatter = float(away[-last:].max()) / step
    return AngleHistory(angles, step, final, reached, min(frames, len(run)), chatter)


def held_drag(degrees: float, resolution: int, seconds: float) -> float:
    """Mean pressure drag of the block held at an angle, N, over the last half of `seconds`. In a
    step the stream of 1 m/s moves by a quarter of a cell."""
    settings = {"domain.resolution": str(resolution), "initial.positions.hinge": str(degrees)}
    world = Simulation(load_scene("ns-block-drag-max", settings)).world
    command = hold_all(1)
    dt = 0.25 * world.flow()[0].grid.spacing
    count = round(seconds / dt)
    drags = [advance(world, dt, command=command).pressure_wrench[1, 0] for _ in range(count)]
    return float(np.mean(drags[count // 2 :]))


def from_wind(angle: float) -> float:
    """Angle between the block and the stream, 0 to 90 degrees; an angle of 0 hangs across it."""
    return abs((angle % 180.0) - 90.0)


def block_in_stream(grids: Sequence[int], apart: float, resolution: int, seconds: float) -> Figures:
    """K5: final angles by most and least drag, and the drag of blocks held at angles that are some
    degrees apart."""
    finals = {
        scene: [course(scene, resolution=n).final for n in grids]
        for scene in ("ns-block-drag-max", "ns-block-drag-min")
    }
    angles = np.arange(-90.0, 91.0, apart)
    drags = np.array([held_drag(a, resolution, seconds) for a in angles])
    unit = 0.5 * 1000.0  # rho U^2 L / 2 of the NS scenes, N/m
    lines = [f"{a:>6g} degrees: {d / unit:.4g}" for a, d in zip(angles, drags, strict=True)]
    rise = float(drags[len(angles) // 2] - 0.5 * (drags[0] + drags[-1])) / unit
    found = {
        f"{scene}: final angle to the stream, degrees": Figure(
            [from_wind(angle) for angle in final], grids
        )
        for scene, final in finals.items()
    }
    found["drag across the stream less that along it, over rho U^2 L/2"] = Figure(rise, lines=lines)
    best = (angles[drags.argmax()], angles[drags.argmin()])
    for (scene, final), angle in zip(finals.items(), best, strict=True):
        away = abs((final[-1] - angle + 90.0) % 180.0 - 90.0)
        title = f"{scene}: final angle from that of held blocks, degrees"
        found[title] = Figure(away, judged={"absolute": apart})
    return found


SCENES = {
    "NS max drag": "ns-block-drag-max",
    "NS min drag": "ns-block-drag-min",
    "NS min effort": "ns-block-effort",
    "simple max drag": "block-drag-max",
    "simple min drag": "block-drag-min",
    "simple min effort": "block-effort-wind",
}
"""Rows of Fig. 2 and their scenes."""

PROBE = 5.0
"""Displacement of the scenes' central differences, degrees."""


def balanced_corner() -> float:
    """Angle in degrees at which central differences find the least drag of the block: the drag by
    K3's law, w/L = 0.2, is the same a probe to either side. It is 0.9 degrees from the minimum."""

    def drag(degrees: float) -> float:
        phi = np.radians(degrees + 90.0)
        return float(np.abs(np.sin(phi)) ** 3 + 0.2 * np.abs(np.cos(phi)) ** 3)

    return float(brentq(lambda a: drag(a + PROBE) - drag(a - PROBE), 70.0, 85.0))


OPTIMA = {
    "block-drag-max": 0.0,
    "block-drag-min": float(np.degrees(np.arctan(5.0))),
    "block-effort-wind": float(np.degrees(np.arctan(224.0 / (25.0 * 9.81)))),
}
"""Degrees: across the wind; the block's corner into it; along the net force."""


def frames_and_strength(strengths: Sequence[float]) -> Figures:
    """K6: frames in simple winds by the rule `fixed` and by the scenes'."""
    found: dict[str, float | Figure] = {}
    for scene, optimum in OPTIMA.items():
        found.update(own_rule(scene, optimum, strengths))
        best = balanced_corner() if scene == "block-drag-min" else optimum
        found.update(fixed_rule(scene, best, strengths))
    return found


def frames_of_figure_2() -> Figures:
    """K6: frames in the flow against those in simple winds."""
    paper = reference("K6", "paper frames")
    found = {row: course(scene, rule="fixed").reached for row, scene in SCENES.items()}
    lines = [f"{row}: {found[row]} frames, paper {paper[row]}" for row in SCENES]
    flow, simple = (
        found[f"{kind} max drag"] + found[f"{kind} min drag"] for kind in ("NS", "simple")
    )
    title = "frames to reach most and least drag together, NS over simple wind"
    return {title: Figure(flow / simple, lines=lines)}


def fixed_rule(scene: str, best: float, strengths: Sequence[float]) -> Figures:
    """Frames and accuracy with which the rule `fixed` arrives at an optimum (degrees)."""
    away = away_from(scene, best)
    runs = [course(scene, frames_enough(away, s), s, rule="fixed") for s in strengths]
    laws = [int(np.ceil(away / run.step)) for run in runs]
    lines = [
        f"{s:g} degrees/s: {run.frames} frames, law {law}, final {run.final:.3f} degrees, "
        f"chatter {run.chatter:.2f} steps"
        for s, run, law in zip(strengths, runs, laws, strict=True)
    ]
    late = max(abs(run.frames - law) for run, law in zip(runs, laws, strict=True))
    products = [run.frames * s for s, run in zip(strengths, runs, strict=True)]
    uneven = max(
        abs(p - products[0]) / max(s, strengths[0])
        for s, p in zip(strengths, products, strict=True)
    )
    off = max(abs(run.final - best) / run.step for run in runs)
    title = f"{scene}: frames less ceil(|phi0 - phi*| / (strength dt)), largest"
    return {
        title: Figure(late, lines=lines),
        f"{scene}: N x strength, largest difference in frames": uneven,
        f"{scene}: final angle from the optimum, in steps": off,
        f"{scene}: chatter, in steps": max(run.chatter for run in runs),
    }


def away_from(scene: str, angle: float) -> float:
    """Angle between a scene's block at the start and `angle`, degrees."""
    return abs(float(np.degrees(Simulation(scene).world.solid.q[0])) - angle)


def frames_enough(away: float, strength: float) -> int:
    """Frames to turn by some degrees at a strength in degrees/s, and to settle."""
    return round(1.2 * away * FRAMES_PER_SECOND / strength) + 30


def own_rule(scene: str, best: float, strengths: Sequence[float]) -> Figures:
    """Frames and accuracy with which a scene's own rule arrives at its optimum (degrees)."""
    late, off, chatter = 0.0, 0.0, 0.0
    away = away_from(scene, best)
    for strength in strengths:
        run = course(scene, frames_enough(away, strength), strength)
        near_it = int(np.argmax(np.abs(run.angles - best) <= PROBE))
        late = max(late, near_it - float(np.ceil((away - PROBE) / run.step)))
        off = max(off, abs(run.final - best))
        chatter = max(chatter, run.chatter)
    own = f"{scene}, own rule"
    return {
        f"{own}: frames to a probe's width of the optimum, more than the law's": late,
        f"{own}: final angle from the optimum, degrees": off,
        f"{own}: chatter, in steps": chatter,
    }

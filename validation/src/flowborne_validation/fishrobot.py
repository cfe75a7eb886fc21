"""R2: a real robot fish that tendons bend, and the robot of the scene `fish-robot`.

The robot swims at four rates of its motor. Its joints follow the Fourier series that were fitted to
their measured angles, with means of zero; nothing else is taken from the measurements. Times and
beats are those of the video at 60 frames per second.

The measured speed is that along the head, over whole beats. Sway and yaw are amplitudes of the
head's first harmonic, as published.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from flowborne import Array, Simulation, load_scene
from flowborne_validation.case import reference
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.measurements import rows_of
from flowborne_validation.worlds import frames_of

FRAMES, SKIPPED, COUNTED = 40, 6, 3
"""Frames per beat, beats from the start that are left out, and those that are measured after."""

HEAD = -0.006
"""x of the middle of the head's two markers in the frame of the head, m."""

QUANTITIES = ("speed m/s", "head sway mm", "head yaw degrees")
COLUMNS = (("speed", "speed_err"), ("sway_mm", "sway_err_mm"), ("yaw_deg", "yaw_err_deg"))
"""Compared quantities, and the columns of the measurements with their errors."""


def table(name: str) -> list[dict[str, str]]:
    """Rows of a table in the folder fishrobot."""
    header, *rows = rows_of("fishrobot", name)
    return [dict(zip(header, row, strict=True)) for row in rows]


def measured(run: str) -> dict[str, float]:
    """What was measured in a run, by the names of the columns."""
    (row,) = (row for row in table("measured") if row["run_hz"] == run)
    return {name: float(value) for name, value in row.items()}


def gait(run: str, means: bool = False, moved: float = 0.0) -> dict[str, str]:
    """Settings of the scene for the joints of a run.

    means  keep the means of the series
    moved  degrees of the first harmonic that joint 0 takes over from joint 1
    """
    found = {"constants.beat": f"{measured(run)['beat_hz']}"}
    rows = [row for row in table("joint_series") if row["run_hz"] == run]
    for joint, row in enumerate(rows):
        more = np.exp(1j * float(rows[1]["phase1_rad"])) * {0: moved, 1: -moved}.get(joint, 0.0)
        terms = [f"{np.degrees(float(row['mean_rad']))}"] if means else []
        for n in (1, 2, 3):
            size = np.degrees(float(row[f"amplitude{n}_rad"]))
            wave = size * np.exp(1j * float(row[f"phase{n}_rad"])) + more * (n == 1)
            terms.append(f"{abs(wave)}*sin({2 * n}*pi*beat*t + {np.angle(wave)})")
        found[f"motion.{joint}.position"] = f"ramp(beat*t) * ({' + '.join(terms)})"
    return found


@dataclass(frozen=True)
class Swim:
    """A run: the head's position and heading in every frame.

    beat     Hz
    place    (n, 2) the middle of the head's markers, m
    heading  (n,) rad, counter-clockwise from above
    seconds  of wall clock per frame
    """

    beat: float
    place: Array
    heading: Array
    seconds: float

    def figures(self, frames: int = FRAMES) -> Array:
        """(3,) QUANTITIES over the last COUNTED beats, with `frames` in each."""
        last = slice(-COUNTED * frames - 1, None)
        place, heading = self.place[last], self.heading[last]
        time = np.arange(len(place)) / (frames * self.beat)
        speed = np.polyfit(time, swum(place, heading), 1)[0]
        (across, turned), _ = first_harmonics(time, place, heading, self.beat)
        return np.array([speed, 1e3 * across, np.degrees(turned)])

    def by_beat(self, frames: int = FRAMES) -> Array:
        """(beats,) speed along the head in each beat, m/s."""
        return np.diff(swum(self.place, self.heading)[::frames]) * self.beat


def swum(place: Array, heading: Array) -> Array:
    """(n,) m swum along the head, which points to -x where the heading is 0, since the start."""
    step = np.diff(place, axis=0)
    ahead = -step[:, 0] * np.cos(heading[1:]) - step[:, 1] * np.sin(heading[1:])
    return np.concatenate([[0.0], np.cumsum(ahead)])


def first_harmonics(
    time: Array, place: Array, heading: Array, beat: float
) -> tuple[tuple[float, float], Array]:
    """Amplitudes of the beat: of the place across the mean course, m, and of the heading, rad; and
    the course (2,), a unit vector. They are least-squares fits of two harmonics and a cubic trend,
    which turns and drifts."""
    trend = np.polynomial.polynomial.polyvander(2.0 * time / time[-1] - 1.0, 3)
    waves = [f(2.0 * np.pi * n * beat * time) for n in (1, 2) for f in (np.sin, np.cos)]
    columns = np.column_stack([trend, *waves])
    found = np.linalg.lstsq(columns, np.column_stack([place, heading]), rcond=None)[0]
    ends = trend[[0, -1]] @ found[:4, :2]
    course = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    wave = found[4] + 1j * found[5]
    across = wave[1] * course[0] - wave[0] * course[1]
    return (float(abs(across)), float(abs(wave[2]))), course


def swim(
    run: str,
    cells: int,
    frames: int = FRAMES,
    beats: int = SKIPPED + COUNTED,
    settings: Mapping[str, str] | None = None,
) -> Swim:
    """The scene's robot with the joints of a run, started at the measured speed.

    cells     along the window
    frames    per beat
    settings  of the scene, besides these
    raises    ArithmeticError when the run blows up
    """
    real = measured(run)
    changed = {
        **gait(run),
        "time.frames_per_second": f"{frames * real['beat_hz']}",
        "domain.resolution": f"{cells}",
        "initial.velocities.head_x": f"{-real['speed']}",
        **(settings or {}),
    }
    started = perf_counter()
    with Simulation(load_scene("fish-robot", changed)) as simulation:
        first = simulation.world.solid.q[:3].copy()
        later = frames_of(simulation, beats * frames, lambda _: simulation.world.solid.q[:3].copy())
    x, y, heading = np.array([first, *later]).T
    place = np.stack([x + HEAD * np.cos(heading), y + HEAD * np.sin(heading)], axis=1)
    return Swim(real["beat_hz"], place, heading, (perf_counter() - started) / len(later))


VARIANTS: Mapping[str, Mapping[str, str]] = {
    "a window 1.27 times as long, 1.5 times as wide and 1.25 times as deep": {
        "domain.lower": "[-0.34, -0.36, -0.2475]",
        "domain.upper": "[0.80, 0.36, 0.0525]",
        "domain.resolution": "76",
    },
    "started at 1.5 times the measured speed": {"initial.velocities.head_x": "-0.12"},
    "joints with their means": gait("1.00", means=True),
    "4 degrees of joint 1 moved to joint 0": gait("1.00", moved=4.0),
}
"""Changes of the scene at 1 Hz on the coarser grid, whose effects make the error bar."""

IMMERSED: Mapping[str, Mapping[str, str]] = {
    "with the tendons' arms in the water": {
        "solids.displace": '{ classes = ["hull", "drive", "arm"] }'
    },
    "with all of it in the water": {
        "solids.displace": '{ classes = ["hull", "drive", "arm", "top"] }',
        "domain.upper": "[0.68, 0.24, 0.1425]",
    },
}
"""The same on the finer grid, whose cells do not close the gaps between the arms."""


def compared(runs: Sequence[str], grids: Sequence[int], bar: bool = False) -> Figures:
    """R2: QUANTITIES of runs on some grids, of which the last is judged by the measured errors.

    bar  whether to measure the error bar of the speed
    """
    found: dict[str, Figure] = {}
    errors, changes = [], error_bar(grids) if bar else []
    for run in runs:
        real = measured(run)
        swims = [swim(run, n) for n in grids]
        figures = np.array([one.figures() for one in swims])
        lines = [
            f"{n:>6} cells along the window: {one.seconds:.2f} s per frame, in each beat "
            + ", ".join(f"{speed:.4f}" for speed in one.by_beat())
            for n, one in zip(grids, swims, strict=True)
        ]
        # the way does not depend on the time base of the video
        ways = (speed / real["beat_hz"] for speed in (figures[-1, 0], real["speed"]))
        lines += ["way in a beat {:.4f} m, measured {:.4f} m".format(*ways), *changes]
        errors.append(np.abs(figures[:, 0] - real["speed"]))
        for k, (quantity, (value, error)) in enumerate(zip(QUANTITIES, COLUMNS, strict=True)):
            found[f"run {run}, beat {real['beat_hz']:.3f} Hz: {quantity}"] = Figure(
                figures[:, k],
                grids,
                real[value],
                lines=lines if k == 0 else (),
                judged={"absolute": real[error]},
            )
    twin, slender = (reference("R2", name) for name in ("authors' twin", "elongated-body theory"))
    others = f"the authors' fitted twin {twin:g} and elongated-body theory {slender:g}, over 8 runs"
    mean = Figure(np.mean(errors, axis=0), grids, twin, lines=[others])
    return {**found, f"mean error of speed over {len(runs)} runs, m/s": mean}


def error_bar(cells: Sequence[int]) -> list[str]:
    """What changes the speed at 1 Hz by how much, in words."""
    coarse, fine = (swim("1.00", n).figures()[0] for n in cells)
    changes = {
        f"{cells[1]} for {cells[0]} cells": fine - coarse,
        "half the step": swim("1.00", cells[0], frames=2 * FRAMES).figures(2 * FRAMES)[0] - coarse,
    }
    for number, speed, variants in ((cells[0], coarse, VARIANTS), (cells[1], fine, IMMERSED)):
        for name, settings in variants.items():
            changes[name] = swim("1.00", number, settings=settings).figures()[0] - speed
    whole = float(np.linalg.norm(list(changes.values())))
    listed = [f"{name}: {change:+.4f} m/s" for name, change in changes.items()]
    return [*listed, f"error bar at 1 Hz, root of the sum of squares: {whole:.4f} m/s"]

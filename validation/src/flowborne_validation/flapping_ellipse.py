"""An ellipse that hovers by flapping: S3."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Array, World
from flowborne.bodies import TrajectorySinusoid
from flowborne.worlds import advance, make_world
from flowborne_validation.case import reference
from flowborne_validation.findings import Curve, Figure, Figures, Plot
from flowborne_validation.worlds import at_start, force_on, mjcf, square, whole_steps

SWAY, PERIOD, PITCH = 2.8, 4.0, 0.25 * np.pi
"""m from end to end of the motion of the centre, for an ellipse of 1 m; s; rad by which it pitches
from upright to each side."""

FASTEST = np.pi * SWAY / PERIOD
"""m/s, of the centre."""

LIFT, DRAG, MEASURED = "CL(t/T) Eldredge", "CD(t/T) Eldredge", "CL experiment Wang"


def hover(cells: int, side: int) -> World:
    """The ellipse, a tenth as thick as long, upright at one end of its stroke, in still fluid."""
    body = (
        '<body name="wing"><joint name="x" type="slide" axis="1 0 0"/>'
        '<joint name="pitch" axis="0 0 1"/>'
        '<geom type="ellipsoid" size="0.5 0.05 1"/></body>'
    )
    motions = (
        TrajectorySinusoid(np.array([0]), 0.5 * SWAY, PERIOD, 0.0, 0.5 * np.pi),
        TrajectorySinusoid(np.array([1]), PITCH, PERIOD, 0.5 * np.pi),
    )
    grid, viscosity = square(side * cells, side), FASTEST / 75.0
    world = make_world(mjcf(body), grid, viscosity=viscosity, motions=motions, tolerance=1e-7)
    world.solid.q[:], _ = at_start(motions)
    return world


def largest_quasi_steady() -> tuple[float, float]:
    """Scales of the published coefficients: the largest lift and drag in a stroke by 1.2 sin 2a and
    1.4 - cos 2a times rho u^2 c / 2, N/m."""
    angle = np.linspace(0.0, 2.0 * np.pi, 10_001)
    pressure = 0.5 * (FASTEST * np.sin(angle)) ** 2
    pitch = 0.5 * np.pi + PITCH * np.sin(angle)
    lift = pressure * np.abs(1.2 * np.sin(2.0 * pitch))
    drag = pressure * (1.4 - np.cos(2.0 * pitch))
    return float(lift.max()), float(drag.max())


def flap(cells: int, side: int, strokes: float) -> Array:
    """Flap from rest for some periods, in a closed box `side` chords wide.

    returns  (n, 3) t/T in the middle of every step, and lift and drag over the largest quasi-steady
             ones; drag is positive against the motion of the wing
    """
    world = hover(cells, side)
    # in a step the centre crosses at most a cell; the tips are up to 1.4 times as fast
    count, dt = whole_steps(strokes * PERIOD, 1.0 / cells / FASTEST)
    lift, drag = largest_quasi_steady()
    rows = []
    for k in range(count):
        force = force_on(advance(world, dt))
        phase = (k + 0.5) * dt / PERIOD
        onward = -np.sign(np.sin(2.0 * np.pi * phase))
        rows.append((phase, force[1] / lift, -onward * force[0] / drag))
    return np.array(rows)


def apart(times: Array, values: Array, published: Array) -> float:
    """Root of the mean square distance from published points (n, 2)."""
    return float(
        np.sqrt(np.mean((np.interp(published[:, 0], times, values) - published[:, 1]) ** 2))
    )


def hovering(grids: Sequence[int], side: int, strokes: float) -> Figures:
    """S3: lift and drag from rest, against another solver and the experiment. The list has no
    tolerance. The distance of the measured lift from that solver's is the tolerance of ours, and of
    the drag, which was not measured."""
    runs = [flap(n, side, strokes) for n in grids]
    lift, drag, measured = (
        points[points[:, 0] <= strokes]
        for points in (np.array(reference("S3", name)) for name in (LIFT, DRAG, MEASURED))
    )
    bound = apart(measured[:, 0], measured[:, 1], lift)
    # the drag changes its sign at each reversal of the stroke: points there are left out
    drag = drag[np.abs((drag[:, 0] + 0.25) % 0.5 - 0.25) > 0.012]
    thinned = runs[-1][:: max(1, len(runs[-1]) // 500)]
    found = {}
    for name, column, published in (("lift", 1, lift), ("drag", 2, drag)):
        away = [apart(run[:, 0], run[:, column], published) for run in runs]
        curves = [
            Curve("Eldredge", published[:, 0], published[:, 1], True),
            Curve("flowborne", thinned[:, 0], thinned[:, column]),
        ]
        if name == "lift":
            curves.append(Curve("measured by Wang", measured[:, 0], measured[:, 1], True))
        plot = Plot("t/T", f"{name} over the largest quasi-steady one", curves)
        found[f"{name}, mean distance from Eldredge's"] = Figure(away, grids, bound, plot=plot)
    return found

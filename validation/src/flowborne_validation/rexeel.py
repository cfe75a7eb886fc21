"""R1: the real swimming robot RExEel, and the robots of the scenes `eel` and `eel-room`.

All have the same start and gait. `eel` is a slab in two-dimensional flow; `eel-room` has the
robot's height, in a tank four times as deep.

The robot's thickness and its start in the tank are not published: the scene's links are 1.6 cm
thick, and all start in the middle. At 40 degrees the tank is a quarter longer, as the head's front
would end beyond its wall.

The heading's error is mostly a delay, on all grids: 25 to 30 ms at 20 degrees and 60 to 75 ms at
40. 17 ms of it come from the published comparison, which takes the last sample for the last but
one; by the robot's logs the motors lead the gait by 5 to 11 ms. The cause of the rest is not known:
thickness, viscosity and step change it by 10 ms at most.

Lengths are cm and angles degrees, as published. A link's direction points to the tail.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import numpy as np
from scipy.interpolate import CubicSpline

from flowborne import Array, Simulation, load_scene
from flowborne.bodies import kinematics
from flowborne_validation.case import reference
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.measurements import rows_of
from flowborne_validation.worlds import frames_of

LINK_LENGTH = np.array([12.0, 9.8, 9.8, 9.8, 9.8, 9.8])
MASS = np.array([192.0, 140.0, 140.0, 140.0, 140.0, 140.0])
"""cm and g of each link, head first."""

TIMES = np.arange(241) / 60.0
"""s at which trajectories are compared."""

POINTS = ("centre of mass", "head")
QUANTITIES = (*(f"{point} {axis} cm" for point in POINTS for axis in "xy"), "heading degrees")
HEADING = 4
"""Compared quantities, and the number of the heading."""

TANK_LENGTH = {20: 1.0, 40: 1.25}
"""Length of the tank over that of the scene, by amplitude."""


def table(name: str) -> dict[str, Array]:
    """Columns of a table of measurements in the folder rexeel."""
    header, *rows = rows_of("rexeel", name)
    return dict(zip(header, np.array(rows, dtype=np.float64).T, strict=True))


def resampled(values: Array, last: float) -> Array:
    """Samples (n, k) at TIMES, by natural cubic splines with straight ends beyond the last. As in
    the published comparison, samples are taken as evenly spaced over 0 to `last` s."""
    spline = CubicSpline(np.linspace(0.0, last, len(values)), values, bc_type="natural")
    within = np.minimum(TIMES, last)
    return np.asarray(spline(within) + (TIMES - within)[:, None] * spline(within, 1))


def motor_angles(amplitude: int, last: int = -2) -> Array:
    """(241, 5) measured degrees of the joints at TIMES; `last` as in `measured`."""
    log = table(f"motor_angles_{amplitude}deg")
    angles = np.stack([log[f"actual_{n}"] for n in range(1, 6)], axis=1)
    return resampled(angles, log["time_s"][last])


def mass_centre(head: Array, joints: Array) -> Array:
    """(n, 2) cm, of a robot with a head (n, 3) in cm and degrees, and joints (n, 5) in degrees. The
    hinges lie at the links' ends, and the mass of each link in its middle."""
    turned = np.hstack([np.zeros((len(head), 1)), np.cumsum(joints, axis=1)])
    angle = np.radians(head[:, 2:] + turned)
    link = LINK_LENGTH[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    ends = np.cumsum(link, axis=1)
    middles = head[:, None, :2] + ends - 0.5 * link - 0.5 * link[:, :1]
    return np.asarray(np.average(middles, axis=1, weights=MASS))


def measured(amplitude: int, last: int = -2) -> Array:
    """(runs, 241, 5) QUANTITIES less their values at the start, of all runs at an amplitude of the
    gait in degrees, 20 or 40.

    last  number of the sample that gives the time of the last one: the last but one as published,
          -1 by the logs' times, which are later by 17 ms in the mean
    """
    log, joints = table(f"hardware_{amplitude}deg"), motor_angles(amplitude, last)
    runs = []
    for run in np.unique(log["run"]):
        mine = log["run"] == run
        sampled = np.stack([log["x_cm"], log["y_cm"], -log["yaw_deg"]], axis=1)[mine]
        head = resampled(sampled, log["time_s"][mine][last])
        path = np.hstack([mass_centre(head, joints), head])
        runs.append(path - path[0])
    return np.array(runs)


def rmse(changes: Array, runs: Array) -> Array:
    """(5,) root mean square error of changes (241, 5) over all times of all runs."""
    return np.asarray(np.sqrt(np.mean((changes - runs) ** 2, axis=(0, 1))))


def scatter(runs: Array) -> Array:
    """(5,) rmse of the mean of all runs, the least of any trajectory."""
    return rmse(runs.mean(axis=0), runs)


def lag(changes: Array, runs: Array) -> tuple[float, float]:
    """Delay of a trajectory's heading in s, to 5 ms, and its rmse without the delay."""
    heading = CubicSpline(TIMES, changes[:, HEADING])
    lags = 0.005 * np.arange(25)
    errors = []
    for late in lags:
        earlier = changes.copy()
        earlier[:, HEADING] = heading(np.minimum(TIMES + late, TIMES[-1])) - heading(late)
        errors.append(float(rmse(earlier, runs)[HEADING]))
    best = int(np.argmin(errors))
    return float(lags[best]), errors[best]


def swim(amplitude: int, cells: int, scene: str = "eel") -> tuple[Array, float]:
    """(241, 5) QUANTITIES of a scene's robot at TIMES, and the seconds of wall clock of the run.

    cells   across the tank
    raises  ArithmeticError when the run blows up
    """
    domain = load_scene(scene).domain
    assert domain is not None
    upper = (domain.upper[0], domain.upper[1] * TANK_LENGTH[amplitude], *domain.upper[2:])
    settings = {
        "constants.amplitude": f"{amplitude}",
        "domain.upper": f"[{', '.join(f'{c:g}' for c in upper)}]",
        "domain.resolution": f"{round(cells * TANK_LENGTH[amplitude])}",
    }
    started = perf_counter()
    with Simulation(load_scene(scene, settings)) as simulation:
        first = quantities(simulation)
        later = frames_of(simulation, len(TIMES) - 1, lambda _: quantities(simulation))
    return np.array([first, *later]), perf_counter() - started


def quantities(simulation: Simulation) -> Array:
    """(5,) QUANTITIES now."""
    model, q = simulation.world.setup.solid, simulation.world.solid.q
    pose, mass = kinematics(model, q), model.body_mass
    centre = 100.0 * (mass @ pose.mass_centre)[:2] / mass.sum()
    head = 100.0 * pose.body_position[model.body("head"), :2]
    return np.array([*centre, *head, np.degrees(q[model.positions_of("heading")[0]])])


def compared(amplitude: int, grids: Sequence[int], scene: str = "eel") -> Figures:
    """R1: errors of the robot on some grids, of which the last is judged, and of other simulators.
    They should be at most those of the robot's own simulator, Aquarium."""
    runs = measured(amplitude)
    paths, seconds = zip(*(swim(amplitude, n, scene=scene) for n in grids), strict=True)
    errors = np.array([rmse(path - path[0], runs) for path in paths])
    least = scatter(runs)
    times = [
        f"{n:>6} cells across the tank: 4 s in {spent:.0f} s"
        for n, spent in zip(grids, seconds, strict=True)
    ]
    found = {}
    for n, quantity in enumerate(QUANTITIES):
        aquarium, genesis = (
            reference("R1", simulator)[str(amplitude)][quantity]
            for simulator in ("Aquarium", "Genesis")
        )
        delay = delay_lines(paths[-1] - paths[-1][0], amplitude, runs) if n == HEADING else []
        others = f"Aquarium {aquarium:g}, Genesis {genesis:g}"
        scattered = f"mean of the {len(runs)} runs {least[n]:.3f}"
        lines = [*times, *delay, f"{others}, {scattered}"]
        title = f"{scene}, gait of {amplitude} degrees: RMSE of {quantity}"
        found[title] = Figure(errors[:, n], grids, aquarium, lines=lines)
    return found


def delay_lines(changes: Array, amplitude: int, runs: Array) -> list[str]:
    """The delay in a heading's error, in words."""
    late, left = lag(changes, runs)
    own = float(rmse(changes, measured(amplitude, last=-1))[HEADING])
    return [
        f"late by {1e3 * late:.0f} ms: {left:.3f} without that",
        f"by the times in the logs, to which the published comparison does not keep: {own:.3f}",
    ]

"""Measured runs of the swimming robot RExEel, and how far another trajectory is off them.

Lengths are cm and angles degrees, as published. A link's direction leads to the tail.
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
from scipy.interpolate import CubicSpline

from flowborne import Array

LENGTH = np.array([12.0, 9.8, 9.8, 9.8, 9.8, 9.8])
"""cm of each link, head first."""

MASS = np.array([192.0, 140.0, 140.0, 140.0, 140.0, 140.0])
"""g."""

TIMES = np.arange(241) / 60.0
"""s, when trajectories are compared."""

QUANTITIES = (
    "centre of mass x cm",
    "centre of mass y cm",
    "head x cm",
    "head y cm",
    "heading degrees",
)


HEADING = 4
"""Number of the heading among them."""


@dataclass(frozen=True)
class SwimPath:
    """Where the robot is at TIMES.

    mass_centre  (241, 2) cm
    head         (241, 3) middle of the head link in cm, and its angle in degrees
    """

    mass_centre: Array
    head: Array

    def changes(self) -> Array:
        """(241, 5) QUANTITIES less what they are at the start."""
        values = np.hstack([self.mass_centre, self.head])
        return np.asarray(values - values[0])


def table(name: str) -> dict[str, Array]:
    """Columns of one of the packed tables of measurements."""
    packed = files("flowborne.validation").joinpath("rexeel", f"{name}.csv.gz").read_bytes()
    header, *rows = gzip.decompress(packed).decode().split()
    columns = np.array([row.split(",") for row in rows], dtype=np.float64).T
    return dict(zip(header.split(","), columns, strict=True))


def resampled(values: Array, last: float) -> Array:
    """Samples (n, k) at TIMES, by natural cubic splines that go on straight beyond the last.

    The published comparison takes samples as evenly spaced over 0 to `last` s, and so does this.
    """
    spline = CubicSpline(np.linspace(0.0, last, len(values)), values, bc_type="natural")
    within = np.minimum(TIMES, last)
    return np.asarray(spline(within) + (TIMES - within)[:, None] * spline(within, 1))


def motor_angles(amplitude: int, last: int = -2) -> Array:
    """(241, 5) degrees of the joints at TIMES, as the motors turned them; `last` as `measured`."""
    log = table(f"motor_angles_{amplitude}deg")
    angles = np.stack([log[f"actual_{n}"] for n in range(1, 6)], axis=1)
    return resampled(angles, log["time_s"][last])


def mass_centre(head: Array, joints: Array) -> Array:
    """(n, 2) cm, of a robot with a head (n, 3) in cm and degrees, and joints (n, 5) in degrees.

    The hinges lie at the links' ends, and a link's mass in its middle.
    """
    turned = np.hstack([np.zeros((len(head), 1)), np.cumsum(joints, axis=1)])
    angle = np.radians(head[:, 2:] + turned)
    link = LENGTH[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    ends = np.cumsum(link, axis=1)
    middles = head[:, None, :2] + ends - 0.5 * link - 0.5 * link[:, :1]
    return np.asarray(np.average(middles, axis=1, weights=MASS))


def measured(amplitude: int, last: int = -2) -> list[SwimPath]:
    """All runs at an amplitude of the gait in degrees, 20 or 40.

    last  the sample whose time the last one is given: the last but one as published, -1 by the
          logs' own times, which are later by 17 ms in the mean
    """
    log, joints = table(f"hardware_{amplitude}deg"), motor_angles(amplitude, last)
    runs = []
    for run in np.unique(log["run"]):
        mine = log["run"] == run
        sampled = np.stack([log["x_cm"], log["y_cm"], -log["yaw_deg"]], axis=1)[mine]
        head = resampled(sampled, log["time_s"][mine][last])
        runs.append(SwimPath(mass_centre(head, joints), head))
    return runs


def rmse(changes: Array, runs: list[SwimPath]) -> Array:
    """(5,) root mean square over all times of all runs of what changes (241, 5) are off by."""
    off = np.stack([changes - run.changes() for run in runs])
    return np.asarray(np.sqrt(np.mean(off**2, axis=(0, 1))))


def scatter(runs: list[SwimPath]) -> Array:
    """(5,) rmse of the mean of all runs, the least that one trajectory can have."""
    return rmse(np.mean([run.changes() for run in runs], axis=0), runs)


def lag(changes: Array, runs: list[SwimPath]) -> tuple[float, float]:
    """By how much (s, to 5 ms) a trajectory's heading comes late, and its rmse without that."""
    heading = CubicSpline(TIMES, changes[:, HEADING])
    lags = 0.005 * np.arange(25)
    errors = []
    for late in lags:
        earlier = changes.copy()
        earlier[:, HEADING] = heading(np.minimum(TIMES + late, TIMES[-1])) - heading(late)
        errors.append(float(rmse(earlier, runs)[HEADING]))
    best = int(np.argmin(errors))
    return float(lags[best]), errors[best]

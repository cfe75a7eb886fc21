"""Pendulums: A1 and A2."""

from __future__ import annotations

import numpy as np

from flowborne import Array, SolidState, World
from flowborne.bodies import halfway_momentum, kinematics, kinetic_energy, potential_energy
from flowborne.validation.case import Case, reference, table
from flowborne.validation.findings import Finding, Grids, at_most, near
from flowborne.validation.worlds import mjcf, recorded
from flowborne.worlds import advance, make_world, start

G = 9.81
DOWN = (0.0, -G, 0.0)


def bar(length: float, width: float) -> str:
    """A bar that hangs at the middle of its short edge."""
    size = f"{0.5 * width} {0.5 * length} 1"
    return mjcf(
        '<body name="bar"><joint name="pivot" axis="0 0 1"/>'
        f'<geom type="box" size="{size}" pos="0 {-0.5 * length} 0"/></body>'
    )


def small_period(length: float, width: float) -> float:
    """T0 of `bar`, s."""
    return 2.0 * float(np.pi * np.sqrt((length**2 / 3.0 + width**2 / 12.0) / (0.5 * G * length)))


def period(model: str, amplitude: float, dt: float, longest: float) -> float:
    """Period of a pendulum released at `amplitude` rad, from its passages through its lowest point.

    longest  s, at least 5/4 of the period
    """
    world = make_world(model, slab=True, gravity=DOWN)
    world.solid.q[0] = amplitude
    times = passages(first_angle(world, dt, int(longest / dt)), dt)
    return float(times[2] - times[0])


def first_angle(world: World, dt: float, steps: int) -> Array:
    """(steps + 1,) position of the first joint, after the start from rest."""
    start(world, dt)
    first = world.solid.q[0]
    return np.array([first, *recorded(world, dt, steps, lambda _: world.solid.q[0])])


def passages(angles: Array, dt: float) -> Array:
    """Times (s) at which angles sampled every dt pass through 0."""
    k = np.flatnonzero(angles[:-1] * angles[1:] < 0.0)
    return np.asarray(dt * (k + angles[k] / (angles[k] - angles[k + 1])))


def frequency(heights: Array, dt: float) -> float:
    """Mean frequency of a signal sampled every dt (s), from its passages through 0, Hz."""
    return float(1.0 / (2.0 * np.diff(passages(heights, dt)).mean()))


def pendulum_period(quick: bool) -> list[Finding]:
    """A1: a block at ten amplitudes, and T0 of the block and of a thin rod."""
    length, width = 1.2, 0.3
    t0 = small_period(length, width)
    steps = (25, 50, 100) if quick else (100, 200, 400, 800)
    findings = []
    for degrees, ratio in table("A1", "T/T0").items():
        runs = [
            period(bar(length, width), np.radians(degrees), t0 / n, 1.3 * ratio * t0) / t0
            for n in steps
        ]
        title, grids = f"T/T0 let go at {degrees:g} degrees", Grids("steps in T0", steps)
        findings.append(near(title, runs, ratio, grids, relative=1e-3))
    swing = np.radians(5.0)
    factor = table("A1", "T/T0")[5.0]
    for label, wide in (("block 1.2 x 0.3", width), ("thin rod", 1e-4 * length)):
        exact = small_period(length, wide)
        found = period(bar(length, wide), swing, exact / steps[-1], 1.3 * exact) / factor
        findings.append(near(f"T0 of a {label}, s", found, exact, relative=1e-3))
    return findings


DOUBLE = mjcf(
    '<body name="upper"><joint name="shoulder" axis="0 0 1"/>'
    '<geom type="sphere" size=".001" pos="0 -1 0" mass="1"/>'
    '<body name="lower" pos="0 -1 0"><joint name="elbow" axis="0 0 1"/>'
    '<geom type="sphere" size=".001" pos="0 -1 0" mass="1"/></body></body>'
)
"""Two links of 1 m with 1 kg at the end of each."""


def double_pendulum(first: float, second: float) -> World:
    """World of DOUBLE at rest; angles in rad, the second relative to the first."""
    world = make_world(DOUBLE, slab=True, gravity=DOWN)
    world.solid.q[:] = first, second
    return world


def mode(number: int, steps: int) -> float:
    """omega / sqrt(g/L) of a mode released in its own shape, `steps` in its period."""
    sign = 1.0 - 2.0 * number
    expected = float(reference("A2", "modes")[number]) * np.sqrt(G)
    dt = 2.0 * np.pi / (expected * steps)
    world = double_pendulum(0.002, 0.002 * (sign * np.sqrt(2.0) - 1.0))
    times = passages(first_angle(world, dt, int(4.3 * steps)), dt)
    return float(np.pi / np.diff(times).mean() / np.sqrt(G))


def energy(world: World, dt: float) -> float:
    """J above the lowest, in the middle of the coming step."""
    model, state = world.setup.solid, world.solid
    half = SolidState(model.integrate(state.q, state.v, 0.5 * dt), state.v)
    lowest = potential_energy(model, model.rest())
    return kinetic_energy(model, half) + potential_energy(model, half) - lowest


def swings(steps: int, periods: float) -> tuple[float, float]:
    """Drift of the energy and largest error of a joint's position, m, `steps` in a period of 2 s.

    The drift is that of the mean over a tenth of the run, from the first tenth to the last.
    """
    dt = 2.0 / steps
    world = double_pendulum(0.5, 0.4)
    start(world, dt)
    first = energy(world, dt)
    model = world.setup.solid
    energies, apart = [], 0.0
    for _ in range(int(periods * steps)):
        advance(world, dt)
        energies.append(energy(world, dt))
        pose = kinematics(model, world.solid.q)
        for body in (1, 2):
            link = pose.mass_centre[body] - (pose.mass_centre[1] if body == 2 else 0.0)
            apart = max(apart, abs(float(np.linalg.norm(link)) - 1.0))
    tenth = len(energies) // 10
    drift = float(np.mean(energies[-tenth:]) - np.mean(energies[:tenth])) / first
    return drift, apart


def turning(dt: float, seconds: float) -> float:
    """Largest difference of L - L0 and the integral of gravity's torque, over the largest |L|."""
    world = double_pendulum(0.8, 0.4)
    model = world.setup.solid
    start = halfway_momentum(model, world.solid, dt)[1, 2]
    turned, largest, wrong = 0.0, 0.0, 0.0
    for _ in range(int(seconds / dt)):
        advance(world, dt)
        turned += dt * -G * float(kinematics(model, world.solid.q).mass_centre[1:, 0].sum())
        found = halfway_momentum(model, world.solid, dt)[1, 2] - start
        largest = max(largest, abs(found))
        wrong = max(wrong, abs(found - turned))
    return wrong / largest


def double_pendulum_case(quick: bool) -> list[Finding]:
    """A2: modes, energy and joints over 100 periods, angular momentum about the pivot."""
    findings = []
    steps = (25, 50, 100) if quick else (100, 200, 400)
    for number, expected in enumerate(reference("A2", "modes")):
        runs = [mode(number, n) for n in steps]
        title, on = f"omega of mode {number + 1} over sqrt(g/L)", Grids("steps in a period", steps)
        findings.append(near(title, runs, expected, on, relative=1e-3))
    drift, apart = swings(100, 10.0 if quick else 100.0)
    span = f"{10 if quick else 100} periods"
    findings.append(at_most(f"drift of the energy over {span}", drift, 1e-3))
    findings.append(at_most(f"error of the joints' places over L, {span}", apart, 1e-6))
    torque = "L - L0 - gravity's torque added up, over the largest |L|"
    findings.append(at_most(torque, turning(0.005, 1.0 if quick else 10.0), 1e-6))
    return findings


CASES = (Case("A1", pendulum_period), Case("A2", double_pendulum_case))

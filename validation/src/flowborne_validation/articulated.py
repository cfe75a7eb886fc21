"""Bodies with joints: pendulums (A1, A2), chains held against gravity (A3), free chains (A4)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Array, SolidModel, SolidState, World
from flowborne.bodies import (
    TrajectorySinusoid,
    halfway_momentum,
    kinematics,
    kinetic_energy,
    mass_matrix,
    potential_energy,
)
from flowborne.worlds import advance, make_world, start
from flowborne_validation.case import reference, table
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.worlds import PLANAR, at_start, chain, history, hold_all, mjcf, square

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
    return history(world, dt, steps, lambda: world.solid.q[0])


def passages(angles: Array, dt: float) -> Array:
    """Times (s) at which angles sampled every dt pass through 0."""
    k = np.flatnonzero(angles[:-1] * angles[1:] < 0.0)
    return np.asarray(dt * (k + angles[k] / (angles[k] - angles[k + 1])))


def frequency(heights: Array, dt: float) -> float:
    """Mean frequency of a signal sampled every dt (s), from its passages through 0, Hz."""
    return float(1.0 / (2.0 * np.diff(passages(heights, dt)).mean()))


def pendulum_period(steps: Sequence[int]) -> Figures:
    """A1: a block at ten amplitudes, and T0 of the block and of a thin rod."""
    length, width = 1.2, 0.3
    t0, factors = small_period(length, width), table("A1", "T/T0")
    found: dict[str, Figure] = {}
    for degrees, ratio in factors.items():
        runs = [
            period(bar(length, width), np.radians(degrees), t0 / n, 1.3 * ratio * t0) / t0
            for n in steps
        ]
        found[f"T/T0 let go at {degrees:g} degrees"] = Figure(runs, steps, ratio)
    for label, wide in (("block 1.2 x 0.3", width), ("thin rod", 1e-4 * length)):
        exact = small_period(length, wide)
        swing = period(bar(length, wide), np.radians(5.0), exact / steps[-1], 1.3 * exact)
        found[f"T0 of a {label}, s"] = Figure(swing / factors[5.0], reference=exact)
    return found


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
    The drift is that of the mean over a tenth of the run, from the first tenth to the last."""
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


def modes(steps: int) -> Figures:
    """A2: both modes."""
    return {
        f"omega of mode {number + 1} over sqrt(g/L)": Figure(mode(number, steps), reference=exact)
        for number, exact in enumerate(reference("A2", "modes"))
    }


def large_swings(periods: int, seconds: float) -> Figures:
    """A2: energy and joints over some periods, angular momentum about the pivot."""
    drift, apart = swings(100, float(periods))
    return {
        f"drift of the energy over {periods} periods": drift,
        f"error of the joints' places over L, {periods} periods": apart,
        "L - L0 - gravity's torque added up, over the largest |L|": turning(0.005, seconds),
    }


LINKS, LINK = 4, 0.7
ARM_DENSITY = 1000.0


def arm() -> str:
    """A chain of LINKS boxes along x, the root hinged at the origin."""
    return chain(
        [
            f'<joint name="j{k}" axis="0 0 1"/>'
            f'<geom type="box" size="{0.5 * LINK} {0.05 + 0.01 * k} 1" pos="{0.5 * LINK} 0 0" '
            f'density="{ARM_DENSITY}"/>'
            for k in range(LINKS)
        ],
        LINK,
    )


def statics(model: SolidModel, q: Array, weight: Array) -> Array:
    """(LINKS,) torque of the drives: sum over i >= k of (x_i - x_k) times the weight.

    weight  (LINKS,) net force on each link, downward positive, N, at its middle
    """
    pose = kinematics(model, q)
    joint, middle = pose.body_position[1:, 0], pose.geom_position[:, 0]
    return np.array([((middle[k:] - joint[k]) * weight[k:]).sum() for k in range(LINKS)])


def held(world: World, q: Array, dt: float) -> Array:
    """(LINKS,) torques of the drives that hold a pose for a step, N m."""
    world.solid.q[:] = q
    return advance(world, dt, command=hold_all(LINKS)).actuator


def static_chain(poses: int) -> Figures:
    """A3: torque and effort of a held chain, dry and in fluid at rest, and poses without torque."""
    angles = np.random.default_rng(7).uniform(-2.0, 2.0, (poses, LINKS))
    dry = make_world(arm(), slab=True, gravity=DOWN)
    model = dry.setup.solid
    weight = G * model.body_mass[1:]
    scale = float(weight.sum()) * LINK
    wrong, effort = 0.0, 0.0
    for q in angles:
        exact = statics(model, q, weight)
        wrong = max(wrong, float(np.abs(held(dry.copy(), q, 0.01) - exact).max()))
        for dt in (1e-3, 0.05):
            impulse = dt * held(dry.copy(), q, dt)
            effort = max(effort, float(np.abs(impulse - exact * dt).max()) / dt)
    density = 1300.0
    wet = make_world(arm(), square(48, 2.2 * LINKS * LINK), gravity=DOWN, density=density)
    buoyed = G * (ARM_DENSITY - density) * model.volume[1:]
    in_fluid = max(
        float(np.abs(held(wet.copy(), q, 0.01) - statics(model, q, buoyed)).max()) for q in angles
    )
    balanced, leaning = balance(dry, angles)
    return {
        "error of tau_k over m g L": wrong / scale,
        "error of the effort over m g L dt": effort / scale,
        "in fluid at rest, error of tau_k over m g L": in_fluid / scale,
        "tau_k over m g L with the outboard centre of mass below joint k": balanced,
        "least |tau_k| over m g L, 0.01 rad from there": leaning,
    }


def balance(world: World, poses: Array) -> tuple[float, float]:
    """Largest |tau_k| over m g L with the centre of mass of the bodies beyond joint k below it, and
    the least 0.01 rad from there; over all joints and poses."""
    model = world.setup.solid
    mass = model.body_mass[1:]
    most, least = 0.0, np.inf
    for pose in poses:
        for k in range(LINKS):
            q = pose.copy()
            at = kinematics(model, q)
            centre = (mass[k:, None] * at.geom_position[k:]).sum(axis=0) / mass[k:].sum()
            arm_of = centre - at.body_position[1 + k]
            q[k] += -0.5 * np.pi - np.arctan2(arm_of[1], arm_of[0])
            scale = G * float(mass[k:].sum()) * float(np.linalg.norm(arm_of[:2]))
            there = torque_at(world, q, k)
            q[k] += 0.01
            most, least = max(most, there / scale), min(least, torque_at(world, q, k) / scale)
    return most, float(least)


def torque_at(world: World, q: Array, joint: int) -> float:
    """|torque| that holds a joint, N m."""
    return abs(float(held(world.copy(), q, 0.01)[joint]))


def floating(flat: bool) -> str:
    """A free chain of LINKS boxes of different densities; in 3D its joints' axes alternate."""
    links = []
    for k in range(LINKS):
        axis = "0 0 1" if flat or k % 2 else "0 1 0"
        joint = f'<joint name="j{k}" axis="{axis}"/>' if k else '<freejoint name="root"/>'
        links.append(
            f'{joint}<geom type="box" size="{0.5 * LINK} {0.05 + 0.02 * k} .1" '
            f'pos="{0.5 * LINK} 0 0" density="{1000 - 100 * k}"/>'
        )
    return chain(links, LINK)


def kept(flat: bool, dt: float, seconds: float) -> tuple[float, float]:
    """Largest change of linear and of angular momentum over their first values. The chain flies and
    tumbles while its motors swing its joints."""
    motions = tuple(
        TrajectorySinusoid(np.array([6 + k]), 0.6 + 0.1 * k, 1.0 + 0.1 * k, 0.2 * k, 0.4 * k)
        for k in range(LINKS - 1)
    )
    world = make_world(floating(flat), slab=flat, motions=motions)
    state = world.solid
    state.v[:6] = [0.3, -0.2, 0.0, 0.0, 0.0, 0.7] if flat else [0.3, -0.2, 0.1, 0.2, 0.5, 0.7]
    state.q[7:], state.v[6:] = at_start(motions)
    model = world.setup.solid
    first = halfway_momentum(model, state, dt)
    change = np.zeros(2)
    for _ in range(int(seconds / dt)):
        advance(world, dt)
        lost = halfway_momentum(model, world.solid, dt) - first
        change = np.maximum(change, np.linalg.norm(lost, axis=1))
    linear, angular = change / np.linalg.norm(first, axis=1)
    return float(linear), float(angular)


CAT = mjcf(
    f'<body name="middle">{PLANAR}<geom type="box" size=".5 .1 1" density="1"/>'
    '<body name="front" pos=".5 0 0"><joint name="front" axis="0 0 1"/>'
    '<geom type="box" size=".4 .1 1" pos=".4 0 0" density="1"/></body>'
    '<body name="rear" pos="-.5 0 0"><joint name="rear" axis="0 0 1"/>'
    '<geom type="box" size=".4 .1 1" pos="-.4 0 0" density="1"/></body></body>'
)
LOOP = ((0.7, 0.8, 0.0), (-0.7, 0.8, 0.5 * np.pi))
"""Mean (rad), amplitude (rad) and phase of the cat's two joints: a circle of shapes."""


def cat_turn(steps: int, seconds: float) -> float:
    """Rotation of the cat after one loop of its shape without angular momentum, rad."""
    motions = tuple(
        TrajectorySinusoid(np.array([3 + k]), size, seconds, mean, phase)
        for k, (mean, size, phase) in enumerate(LOOP)
    )
    world = make_world(CAT, slab=True, motions=motions)
    state, dt = world.solid, seconds / steps
    state.q[3:], state.v[3:] = at_start(motions)
    state.v[:3] = unmoved(world.setup.solid, state.q[3:] + 0.5 * dt * state.v[3:], state.v[3:])
    advance(world, dt, steps)
    return float(world.solid.q[2])


def unmoved(model: SolidModel, shape: Array, rate: Array) -> Array:
    """(3,) velocity of the cat's root for no momentum while its shape changes at `rate`: the
    mechanical connection."""
    M = mass_matrix(model, np.concatenate([np.zeros(3), shape]))
    return np.asarray(-np.linalg.solve(M[:3, :3], M[:3, 3:] @ rate))


def cat_turn_by_geometry() -> float:
    """The same as an integral over the loop, without time."""
    model = SolidModel.from_string(CAT, slab=True, gravity=(0.0, 0.0, 0.0))
    count = 400
    turned = 0.0
    for n in range(count):
        angle = 2.0 * np.pi * n / count
        shape = np.array([mean + size * np.sin(angle + phase) for mean, size, phase in LOOP])
        rate = np.array([size * np.cos(angle + phase) for _, size, phase in LOOP])
        turned += float(unmoved(model, shape, rate)[2]) * 2.0 * np.pi / count
    return turned


def free_chain(seconds: float, steps: Sequence[int]) -> Figures:
    """A4: momentum of a free chain with motors, and the falling cat."""
    found: dict[str, float | Figure] = {}
    for flat in (True, False):
        title = f"momentum over its first value, chain in {2 if flat else 3}D"
        for kind, change in zip(("linear", "angular"), kept(flat, 0.01, seconds), strict=True):
            found[f"change of {kind} {title}"] = change
    turns = [cat_turn(n, 1.0) for n in steps]
    slower = cat_turn(steps[-1], 10.0) - turns[-1]
    return found | {
        "falling cat's turn in a loop, rad": Figure(turns, steps, cat_turn_by_geometry()),
        "the same ten times slower, difference, rad": slower,
    }

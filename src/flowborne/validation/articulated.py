"""Chains held against gravity (A3), and free chains (A4)."""

from __future__ import annotations

import numpy as np

from flowborne import Array, SolidModel, SolidState, World
from flowborne.bodies import (
    TrajectorySinusoid,
    halfway_momentum,
    holding,
    kinematics,
    mass_matrix,
)
from flowborne.validation.case import Case
from flowborne.validation.findings import Finding, Grids, at_most, near
from flowborne.validation.pendulums import DOWN, G
from flowborne.validation.worlds import PLANAR, at_start, chain, hold_all, mjcf, square
from flowborne.worlds import advance, make_world

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


def static_chain(quick: bool) -> list[Finding]:
    """A3: torque and effort of a held chain, dry and in fluid at rest, and poses without torque."""
    rng = np.random.default_rng(7)
    poses = rng.uniform(-2.0, 2.0, (3 if quick else 20, LINKS))
    dry = make_world(arm(), slab=True, gravity=DOWN)
    model = dry.setup.solid
    weight = G * model.body_mass[1:]
    scale = float(weight.sum()) * LINK
    wrong, effort = 0.0, 0.0
    for q in poses:
        exact = statics(model, q, weight)
        wrong = max(wrong, float(np.abs(held(dry.copy(), q, 0.01) - exact).max()))
        for dt in (1e-3, 0.05):
            state = SolidState(q.copy(), np.zeros(LINKS))
            impulse = dt * holding(model, state, np.zeros(LINKS), dt)
            effort = max(effort, float(np.abs(impulse - exact * dt).max()) / dt)
    findings = [
        at_most("error of tau_k over m g L", wrong / scale, 1e-6),
        at_most("error of the effort over m g L dt", effort / scale, 1e-6),
    ]
    density = 1300.0
    wet = make_world(arm(), square(48, 2.2 * LINKS * LINK), gravity=DOWN, density=density)
    buoyed = G * (ARM_DENSITY - density) * model.volume[1:]
    wrong = max(
        float(np.abs(held(wet.copy(), q, 0.01) - statics(model, q, buoyed)).max()) for q in poses
    )
    findings.append(at_most("in fluid at rest, error of tau_k over m g L", wrong / scale, 1e-6))
    balanced, leaning = balance(model, poses)
    title = "tau_k over m g L with the outboard centre of mass below joint k"
    findings.append(at_most(title, balanced, 1e-6))
    title = "least |tau_k| over m g L, 0.01 rad from there"
    return [*findings, Finding(title, leaning, "> 0", "not zero", leaning > 1e-4)]


def balance(model: SolidModel, poses: Array) -> tuple[float, float]:
    """Largest |tau_k| over m g L with the centre of mass of the bodies beyond joint k below it, and
    the least 0.01 rad from there; over all joints and poses."""
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
            there = torque_at(model, q, k)
            q[k] += 0.01
            most, least = max(most, there / scale), min(least, torque_at(model, q, k) / scale)
    return most, float(least)


def torque_at(model: SolidModel, q: Array, joint: int) -> float:
    """|torque| that holds a joint, N m."""
    state = SolidState(q, np.zeros(LINKS))
    return abs(float(holding(model, state, np.zeros(LINKS), 0.01)[joint]))


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
    """Largest change of linear and of angular momentum over their first values.

    The chain flies and tumbles while its motors swing its joints.
    """
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


def free_chain(quick: bool) -> list[Finding]:
    """A4: momentum of a free chain with motors, and the falling cat."""
    findings = []
    for flat in (True, False):
        linear, angular = kept(flat, 0.01, 0.5 if quick else 5.0)
        title = f"momentum over its first value, chain in {2 if flat else 3}D"
        findings.append(at_most(f"change of linear {title}", linear, 1e-10))
        findings.append(at_most(f"change of angular {title}", angular, 1e-10))
    exact = cat_turn_by_geometry()
    steps = (100, 200, 400) if quick else (200, 400, 800, 1600)
    turns, grids = [cat_turn(n, 1.0) for n in steps], Grids("steps in a loop", steps)
    title = "falling cat's turn in a loop, rad"
    findings.append(near(title, turns, exact, grids, relative=1e-3))
    slow = cat_turn(steps[-1], 10.0)
    findings.append(at_most("the same ten times slower, difference, rad", slow - turns[-1], 1e-10))
    return findings


CASES = (Case("A3", static_chain), Case("A4", free_chain))

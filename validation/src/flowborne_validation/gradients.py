"""Finite differences of the objective, and their cost: K7."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from time import perf_counter, process_time

import numpy as np

from flowborne import Controller, Hypothesis, Measurement, Simulation, World, load_scene, step
from flowborne.bodies import WindFaces, WindForce
from flowborne.machine import Serial, cores, kernel_threads
from flowborne.parts import (
    GradientCentral,
    GradientOneSided,
    ObjectiveCallable,
    ObjectiveSum,
    ObjectiveWindDrag,
)
from flowborne.worlds import make_world
from flowborne_validation.controller import AIR, HINGE, LENGTH, SPEED, WIDTH, block
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.worlds import Vector, mjcf, square

FRAME = 1.0 / 24.0

LEANING = 35.0
"""Angle of the block at which the gradient is measured, degrees; its incidence is 90 more."""


def drag_slope(degrees: float) -> float:
    """dD/dphi of K3's law, N per rad, of the block at an angle."""
    phi = float(np.radians(degrees + 90.0))
    s, c = np.sin(phi), np.cos(phi)
    rise = LENGTH * 3.0 * s * abs(s) * c - WIDTH * 3.0 * c * abs(c) * s
    return float(2.0 * AIR * SPEED**2 * rise)


def slope(
    gradient: type[GradientCentral] | type[GradientOneSided], size: float, degrees: float
) -> float:
    """Estimate with a displacement `size` (degrees), N per rad."""
    controller = Controller(
        HINGE,
        ObjectiveSum.of(ObjectiveWindDrag(np.array([1]), (1.0, 0.0, 0.0))),
        Hypothesis(FRAME),
        1.0,
        gradient(float(np.radians(size))),
        executor=Serial(),
    )
    world = block(degrees, 0.0, WindFaces((SPEED, 0.0, 0.0), AIR, ("block",)))
    return float(controller.gradient.estimate(controller.trials(world, step)).gradient[0])


def difference_error(inverse: float) -> Figures:
    """K7: both differences with a displacement, 1/degrees."""
    exact = drag_slope(LEANING)
    return {
        f"order of {label} differences": Figure(
            slope(kind, 1.0 / inverse, LEANING), reference=exact
        )
        for label, kind in (("central", GradientCentral), ("one-sided", GradientOneSided))
    }


def bias_at_optimum() -> Figures:
    """K7: both differences at an optimum, where the one-sided one is biased."""
    scale = 2.0 * AIR * SPEED**2 * LENGTH
    return {
        "central gradient at the most drag over 2 rho U^2 L": slope(GradientCentral, 5.0, 0.0)
        / scale,
        "one-sided gradient there": slope(GradientOneSided, 5.0, 0.0) / scale,
    }


def pushed_arm(force: Vector) -> World:
    """Two blocks in a fluid under gravity and a force."""
    lower = (
        '<body name="lower" pos="0 -.5 0"><joint name="elbow" axis="0 0 1"/>'
        '<geom type="box" size=".08 .25 1" pos="0 -.25 0"/></body>'
    )
    model = mjcf(
        '<body name="upper"><joint name="shoulder" axis="0 0 1"/>'
        f'<geom type="box" size=".1 .25 1" pos="0 -.25 0"/>{lower}</body>'
    )
    return make_world(
        model,
        square(32, 3.0),
        gravity=(0.0, -9.81, 0.0),
        solid_density=3.0,
        density=1.0,
        winds=(WindForce(force),),
    )


def exact_position(count: int) -> Figures:
    """K7: displacement of the trials less the requested one, and joints less targets after a frame,
    in some states."""
    rng = np.random.default_rng(3)
    wrong, off = 0.0, 0.0
    for _ in range(count):
        fx, fy = rng.uniform(-50.0, 50.0, 2)
        world = pushed_arm((float(fx), float(fy), 0.0))
        world.solid.q[:] = rng.uniform(-1.0, 1.0, 2)
        world.solid.v[:] = rng.uniform(-1.0, 1.0, 2)
        start, asked = world.solid.q.copy(), rng.uniform(-0.3, 0.3, 2)
        for dof in (0, 1):

            def end_position(measurement: Measurement, dof: int = dof) -> float:
                return float(measurement.joint_positions(np.array([dof]))[0])

            controller = Controller(
                np.array([0, 1]),
                ObjectiveSum.of(ObjectiveCallable(end_position)),
                Hypothesis(FRAME, steps=2),
                1.0,
                executor=Serial(),
            )
            reached = controller.trials(world, step).values(asked[None, :])[0]
            wrong = max(wrong, abs(float(reached - start[dof] - asked[dof])))
        controller.decide(world, FRAME, step)
        target = world.memory["target"].copy()
        for _ in range(3):
            command = controller.command(world, FRAME, FRAME / 3.0)
            step(world, FRAME / 3.0, command)
        off = max(off, float(np.abs(world.solid.q - target).max()))
    return {
        "displacement of a trial minus the one asked for, rad": wrong,
        "joints minus their targets at the end of a frame, rad": off,
    }


CHAINS = (1, 2, 3, 4)
"""Joints of the chains of Fig. 10."""


def decision_seconds(
    count: int, resolution: int, workers: int, clock: Callable[[], float]
) -> list[float]:
    """Median time of a decision of each chain over the first `count` frames by `clock`, s. The
    chains take turns, so that other load of the machine affects all of them alike."""
    spent: list[list[float]] = [[] for _ in CHAINS]
    settings = {"domain.resolution": str(resolution)}
    with kernel_threads(1), ExitStack() as stack:
        simulations = [
            stack.enter_context(Simulation(load_scene(f"ns-chain-{n}", settings), workers))
            for n in CHAINS
        ]
        for _ in range(count):
            for times, simulation in zip(spent, simulations, strict=True):
                simulation.advance_frame()
                controller, world = simulation.controller, simulation.world.copy()
                assert controller is not None
                started = clock()
                controller.decide(world, simulation.frame_time, step)
                times.append(clock() - started)
    return [float(np.median(times)) for times in spent]


def chain_cost(count: int, resolution: int) -> Figures:
    """K7: time of a decision against the number of joints. The serial time is CPU time, so that it
    does not depend on other load of the machine."""
    serial = decision_seconds(count, resolution, 1, process_time)
    side = decision_seconds(count, resolution, cores(), perf_counter)
    lines = [
        f"{n} joints: {s:.4g} s serial, {p:.4g} s with {cores()} workers"
        for n, s, p in zip(CHAINS, serial, side, strict=True)
    ]
    return {
        f"serial time of a decision for {n} joints over that for one": Figure(
            seconds / serial[0], (), float(n), lines=lines if n == CHAINS[-1] else ()
        )
        for n, seconds in zip(CHAINS[1:], serial[1:], strict=True)
    }

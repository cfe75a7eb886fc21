"""Warnings about stops of the model that are soft for the motions of a scene, or in their way."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from flowborne.base.phrases import listed, more_too, rounded_down
from flowborne.coupling.world import Setup
from flowborne.motion.tracks import SPEED_SAMPLES
from flowborne.scenes.bodies import driven_dofs, initial_state
from flowborne.scenes.schema import Scene
from flowborne.solids.passed import Passed, passed_stops
from flowborne.solids.scratch import DEFAULT_SOLREF, STOP_STEPS, time_constant
from flowborne.solids.trajectories import Trajectory

SOFT = 0.1
"""Time constant of a stop over the period of a drive. A joint that swings through its range with
that period passes a critically damped stop by pi / e of this share of its range."""


def soft_stops(scene: Scene, setup: Setup) -> Iterator[str]:
    """Stops that give way for more than SOFT of the period of the fastest prescribed motion."""
    model, mj = setup.solid, setup.solid.mj
    driven = driven_dofs(scene, model, setup.motions)
    step = scene.step_time
    times = {
        name: time
        for j, name in enumerate(model.joint_names)
        if mj.jnt_limited[j]
        and not driven[mj.jnt_dofadr[j]]
        and not np.array_equal(mj.jnt_solref[j], DEFAULT_SOLREF)
        and (time := time_constant(mj.jnt_solref[j])) > STOP_STEPS * step
    }
    if not times:
        return
    length = scene.time.frames * scene.frame_time
    periods = [(period_of(motion, length, step), motion) for motion in setup.motions]
    period, fastest = min(periods, key=lambda each: each[0], default=(math.inf, None))
    soft = [name for name, time in times.items() if time > SOFT * period * (1.0 + 1e-9)]
    if fastest is None or not soft:
        return
    worst = max(soft, key=times.__getitem__)
    mover = model.joint_names[mj.dof_jntid[fastest.dofs[0]]]
    stops = "its stop" if len(soft) == 1 else "their stops"
    yield (
        f"[solids]: {listed(soft)} may pass {stops}: that of {worst} has a time constant of "
        f"{1e3 * times[worst]:.3g} ms, and {mover} moves with a period of {1e3 * period:.3g} ms; "
        f'solreflimit = "{rounded_down(SOFT * period)} 1" in the model will do, and without it a '
        "stop is as stiff as the step allows"
    )


def past_stops(scene: Scene, setup: Setup) -> Iterator[str]:
    """Prescribed motions that take their joints beyond their ranges."""
    model, found = setup.solid, dict[str, Passed]()
    if not setup.motions or not model.mj.jnt_limited.any():
        return
    driven, q = driven_dofs(scene, model, setup.motions), initial_state(scene, model).q
    with suppress(ArithmeticError):
        for time in np.linspace(0.0, scene.time.frames * scene.frame_time, SPEED_SAMPLES):
            for motion in setup.motions:
                q[model.indices_of(motion.dofs)] = motion.position(float(time))
            for passed in passed_stops(model, q):
                moved = passed.joint >= 0 and driven[model.mj.jnt_dofadr[passed.joint]]
                known = found.get(passed.name, passed)
                if moved and passed.amount >= max(passed.allowed, known.amount):
                    found[passed.name] = passed
    if found:
        worst = max(found.values(), key=lambda passed: passed.ratio)
        yield (
            f"[solids]: {worst.name} moves to {worst.said(worst.place)}, "
            f"{worst.said(worst.amount)} beyond its range{more_too(found)}, and its stop "
            "pushes against its drive; a wider range in the model will do, or a motion within it"
        )


def period_of(motion: Trajectory, length: float, step: float) -> float:
    """s, 2 pi times the root mean square of a motion's velocity over that of its acceleration;
    infinite for a motion at rest.

    length  of the run, s
    step    over which the velocity is differenced, s
    """
    with suppress(ArithmeticError):  # a formula that has no value there: the run says so
        times = np.linspace(0.0, max(length - step, 0.0), SPEED_SAMPLES)
        before = np.array([motion.velocity(float(time)) for time in times])
        after = np.array([motion.velocity(float(time + step)) for time in times])
        speed, change = float(np.linalg.norm(before)), float(np.linalg.norm(after - before))
        if change > 1e-9 * speed:
            return 2.0 * math.pi * step * speed / change
    return math.inf

"""Warnings about steps in which bodies or the flow cross too many cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np

from flowborne.base.tables import MOST_STEPS
from flowborne.coupling.mouths import Mouth
from flowborne.coupling.thrusters import Thruster
from flowborne.coupling.world import Setup
from flowborne.fluid.sides.far import Strength
from flowborne.fluid.transport import EXTRAPOLATION_COURANT
from flowborne.kernels.arrays import Array
from flowborne.motion.tracks import SPEED_SAMPLES
from flowborne.scenes.bodies import driven_dofs, initial_state
from flowborne.scenes.schema import Scene
from flowborne.solids.model import joint_unit
from flowborne.solids.surfaces import Outline

BODY_CELLS = 1.0
"""Cells that a body may cross in a step. A faster body jumps over cells, and their fluid passes
through it (docs/momentum.md: 9 % of a dye in 100 steps of 2.4 cells)."""

FLOW_CELLS = EXTRAPOLATION_COURANT
"""Cells that the undisturbed flow may cross in a step, summed over the axes. Below it the pressure
and the forces of the last step are extrapolated; transport is done in substeps."""

AFTER_CELLS = 1.0
"""Cells a step with the proposed number of steps: around a body the flow is a few times faster."""

FASTEST_TIMES = 20
"""Number of the SPEED_SAMPLES times at which all bodies are posed; each takes ms with flesh."""


Crossing = tuple[str, float]
"""Name of what crosses cells in a step, and how many at most."""


def fast_bodies(scene: Scene, setup: Setup) -> Iterator[str]:
    """Bodies that cross more than BODY_CELLS in a step."""
    fluid = setup.fluid
    if fluid is None or fluid.one_way or not setup.solid.ngeom:
        return
    yield from _said(scene, lambda dt: _fastest_body(scene, setup, dt), BODY_CELLS)


def steps_for_bodies(scene: Scene, setup: Setup) -> int:
    """Steps a frame, at least the scene's, with which no body crosses more than BODY_CELLS in a
    step; the scene's own if MOST_STEPS are too few."""
    steps, fluid = scene.time.steps_per_frame, setup.fluid
    if fluid is None or fluid.one_way or not setup.solid.ngeom:
        return steps
    count, _ = _enough(scene, lambda dt: _fastest_body(scene, setup, dt), BODY_CELLS)
    return count if count <= MOST_STEPS else steps


def fast_flow(scene: Scene, setup: Setup) -> Iterator[str]:
    """A stream, a source or a jet that crosses more cells in a step than FLOW_CELLS."""
    if setup.fluid is None:
        return
    h = setup.fluid.grid.spacing
    speeds = [*_streams(scene), *((m.name, _jet(m, scene)) for m in setup.mouths)]
    density = setup.fluid.density
    speeds += [
        (f"the jet of thruster '{t.name}'", _slipstream(t, scene, density)) for t in setup.thrusters
    ]
    who, speed = max(speeds, key=lambda each: each[1])
    yield from _said(scene, lambda dt: (who, speed * dt / h), FLOW_CELLS)


def _said(scene: Scene, crossing: Callable[[float], Crossing], most: float) -> Iterator[str]:
    """The warning if more than `most` cells are crossed in a step, with a sufficient number."""
    count, (who, cells) = _enough(scene, crossing, most)
    if count == scene.time.steps_per_frame:
        return
    if count <= MOST_STEPS:
        remedy = f"time.steps_per_frame = {count} makes it one at most"
    else:
        remedy = f"as slow as {1.0 / cells:.2g} of that it crosses one"
    yield f"[time]: {who} crosses up to {cells:.3g} cells in one step; {remedy}"


def _enough(
    scene: Scene, crossing: Callable[[float], Crossing], most: float
) -> tuple[int, Crossing]:
    """Steps a frame with which at most AFTER_CELLS are crossed, and what the scene's steps cross.

    The former are the scene's own if these cross no more than `most`, and above MOST_STEPS if that
    many are too few.
    """
    count = scene.time.steps_per_frame
    found = crossing(scene.step_time)
    left = found[1]
    if not left > most * (1.0 + 1e-9):
        return count, found
    while left > AFTER_CELLS * (1.0 + 1e-9) and count <= MOST_STEPS:
        count = max(count + 1, math.ceil(min(count * left / AFTER_CELLS, MOST_STEPS + 1)))
        left = crossing(scene.frame_time / count)[1]
    return count, found


def _fastest_body(scene: Scene, setup: Setup, dt: float) -> Crossing:
    """The largest displacement of a point of a body in a step of dt s.

    Bodies move with their initial velocities; by one controlled joint at its strength; or by all
    prescribed motions at times of the run. Floating creatures recoil.
    """
    assert setup.fluid is not None
    model, h = setup.solid, setup.fluid.grid.spacing
    outline, axes = Outline(model), list(setup.fluid.grid.axes)
    state, driven = initial_state(scene, model), driven_dofs(scene, model, setup.motions)
    floating = np.unique(model.dof_root[~driven & (model.dof_body == model.dof_root)])

    def moved(start: Array, end: Array, recoils: bool) -> Crossing:
        places = outline.at(start)
        way = outline.at(end) - places
        for root in floating if recoils else ():
            of = model.mj.body_rootid[outline.body] == root
            if of.any():
                way[of] -= rigid_part(places[of], way[of], outline.mass[of])
        cells = np.linalg.norm(way[:, axes], axis=1) / h
        place = int(np.argmax(cells))
        return model.body_names[outline.body[place]], float(cells[place])

    with np.errstate(all="ignore"):
        found = [moved(state.q, model.integrate(state.q, state.v, dt), False)]
        found += [moved(*ends, True) for ends in _driven_moves(scene, setup, state.q, dt)]
    return max(found, key=lambda crossing: crossing[1])


def rigid_part(places: Array, way: Array, mass: Array) -> Array:
    """(n, 3) rigid part of small displacements `way` (n, 3) of points (n, 3) with masses (n,).

    Without it the displacements have neither linear nor angular momentum. 0 where they overflow.
    """
    if not mass.sum() > 0.0:
        return np.zeros_like(way)
    centre, mean = (np.average(values, axis=0, weights=mass) for values in (places, way))
    arm = places - centre
    turned = (mass[:, None] * np.cross(arm, way)).sum(axis=0)
    inertia = (mass * (arm**2).sum(axis=1)).sum() * np.eye(3) - (mass * arm.T) @ arm
    if not (np.isfinite(inertia).all() and np.isfinite(turned).all()):
        return np.zeros_like(way)
    angle = np.linalg.pinv(inertia, rcond=1e-9, hermitian=True) @ turned
    return np.asarray(mean + np.cross(angle, arm))


def _driven_moves(
    scene: Scene, setup: Setup, start: Array, dt: float
) -> Iterator[tuple[Array, Array]]:
    """Positions (nq,) before and after a step, for each controlled joint and for the motions."""
    model = setup.solid
    for table in scene.control:
        strength = max(table.strengths)
        for joint in table.joints:
            for dof in model.dofs_of(joint):
                velocity = np.zeros(model.nv)
                velocity[dof] = strength * joint_unit(model, joint)
                yield start, model.integrate(start, velocity, dt)
    with suppress(ArithmeticError):  # a formula that has no value there: the run says so
        for time in _fastest_times(scene, setup, dt):
            ends = start.copy(), start.copy()
            for motion in setup.motions:
                places = model.indices_of(motion.dofs)
                for q, at in zip(ends, (time, time + dt), strict=True):
                    q[places] = motion.position(at)
            yield ends


def unlike_the_sea(scene: Scene, setup: Setup) -> Iterator[str]:
    """A fluid that starts with another velocity than the sea around it."""
    if scene.fluid is None or setup.fluid is None:
        return
    sea = setup.fluid.boundaries.sea(setup.fluid.grid)
    if sea is None:
        return
    inside, around = list(scene.fluid.velocity), sea.velocity(0.0).tolist()
    if inside != around:
        yield (
            f"[fluid] velocity: the fluid starts with {inside} m/s in a sea of {around} m/s, which "
            f"stops it within a step; give [fluid] velocity = {around}, or far sides its velocity"
        )


def _fastest_times(scene: Scene, setup: Setup, dt: float) -> list[float]:
    """The FASTEST_TIMES steps of the run, s, in whose middle the prescribed motions are fastest."""
    if not setup.motions:
        return []
    times = np.linspace(0.0, scene.time.frames * scene.frame_time - dt, SPEED_SAMPLES)
    rates = [
        np.linalg.norm([np.linalg.norm(m.velocity(float(time) + 0.5 * dt)) for m in setup.motions])
        for time in times
    ]
    return [float(time) for time in times[np.argsort(rates)[-FASTEST_TIMES:]]]


def _streams(scene: Scene) -> Iterator[tuple[str, float]]:
    """Speeds in m/s, the axes added up, of the flow at the start, at the sides and in sources."""
    yield "the initial flow", _added(scene.fluid.velocity if scene.fluid else ())
    for name, side in scene.boundaries or ():
        yield f"the stream at {name}", side.fastest(scene.dimensions)
    for number, source in enumerate(scene.sources, start=1):
        yield f"the flow of [[sources]] {number}", _added(source.velocity or ())


def _added(velocity: tuple[float, ...]) -> float:
    return sum(map(abs, velocity))


def _jet(mouth: Mouth, scene: Scene) -> float:
    """Largest mean speed at a mouth at times of the run, m/s."""
    area = mouth.area(scene.is_slab)
    factor = max(map(abs, _values(mouth.strength, scene)))
    return factor * abs(mouth.volume_rate) / area if area > 0.0 else math.inf


def _slipstream(thruster: Thruster, scene: Scene, density: float) -> float:
    """Largest speed of the jet of a thruster at rest, sqrt(2 T / rho A), m/s: at times of the run,
    or where a policy tells it at the ends of its range."""
    told = scene.policy is not None and thruster.name in scene.policy.thrusters
    settings = thruster.limits if told else _values(thruster.setting, scene)
    slab, radius = scene.is_slab, thruster.radius
    thrusts = [abs(thruster.thrust(s, density, slab)) for s in settings if math.isfinite(s)]
    thrust = max(thrusts, default=0.0)
    return math.sqrt(2.0 * thrust / density / (2.0 * radius if slab else math.pi * radius**2))


def _values(strength: Strength, scene: Scene) -> list[float]:
    """A strength at times of the run; 0 from where it is no number."""
    values = [0.0]
    with suppress(ArithmeticError):
        for time in np.linspace(0.0, scene.time.frames * scene.frame_time, SPEED_SAMPLES):
            values.append(strength.at(float(time)))
    return values

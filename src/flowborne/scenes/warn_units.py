"""Warnings about numbers in another unit, also without a fluid: sizes, densities, angles, steps."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from scipy.linalg import LinAlgError, eigh

from flowborne.base.phrases import and_more, listed
from flowborne.base.tables import MOST_STEPS
from flowborne.coupling.world import Setup
from flowborne.kernels.arrays import Array, Integers
from flowborne.scenes.bodies import CENTIMETRES, gravity_in_centimetres, initial_state
from flowborne.scenes.capture import capture_of
from flowborne.scenes.creature import creature_extent
from flowborne.scenes.schema import Scene
from flowborne.scenes.warn_bodies import DENSEST, mean_densities
from flowborne.solids.model import BALL, HINGE, SolidModel
from flowborne.solids.scratch import scratch

SHORTEST, LONGEST, LONGEST_HULL = 1e-3, 34.0, 460.0
"""m. The longest animal is the blue whale (33 m), the longest hull that of a ship (458 m, Seawise
Giant). Swimmers of less than a millimetre are in a fluid."""

LIGHTEST = 10.0
"""kg/m^3, of the lightest foams of polystyrene. Solids in g/cm^3 have 0.1 to 8."""

SMALLEST_PERSON, HEAVIEST_PERSON = 1.0, 635.0
"""kg, of a child born very early (WHO: below 1 kg) and the heaviest on record (J. B. Minnoch)."""

STRONGEST_GRAVITY = 274.0
"""m/s^2 on the Sun. On the Earth it is 9810 mm/s^2."""

STRONGEST_WIND = 113.0
"""m/s, the strongest gust on record (WMO: Barrow Island, 1996). That is 408 km/h."""

WIDEST = math.sqrt(3.0 / 8.0)
"""Jung's theorem: what is L long lies within a ball of this times L in radius, and no radius of
gyration is longer. With inertia in kg mm^2 it is a thousand times as long."""

MOST_TURNS = 2.0
"""Turns of a joint to one side that a cable through it survives. 13 degrees read as radians are
more."""

FULL_TURN = 2.0 * math.pi
"""A range of all joints that ends within this many degrees is one in radians by its looks."""

STILL = 0.01
"""Degrees, or rad in such a file: smaller turns are rounding, as where only the root travels."""

FEWEST_STEPS = 2.0 * math.pi
"""Steps of a period, omega dt = 1. The scheme (Newmark's average acceleration, docs/method/
bodies.md) has periods that are (omega dt)^2 / 12 too long, here 8 %; gravity makes them as much too
short."""

ENOUGH_STEPS = 20
"""Steps of a period with which that is 0.8 %."""

SLOWEST_CAPTURE, FASTEST_CAPTURE = 5.0, 1000.0
"""Frames per second: sketches of animators, and the fastest cameras of motion capture. A frame time
in ms has less, one in place of its inverse as well."""

NUDGE = 1e-5
"""rad or m by which a joint is moved for the stiffness that it has."""


def sizes(scene: Scene, setup: Setup) -> Iterator[str]:
    """Creatures that are longer than any, or without a fluid shorter; and people of other weights
    than people have."""
    length, dry = float(max(creature_extent(scene, setup), default=0.0)), setup.fluid is None
    short = dry and 0.0 < length < SHORTEST
    if short or length > (LONGEST if dry else LONGEST_HULL):
        meant = [(1e-3, "millimetres"), (1e-2, "centimetres")]
        units = " and ".join(f"{f * length:.3g} m if in {u}" for f, u in meant)
        yield (
            f"[solids]: the bodies measure {length:.3g} m; lengths in a model are metres, and they "
            f"measure {f'{1e3 * length:.3g} m if in kilometres' if short else units}"
        )
    if scene.human is not None and not (SMALLEST_PERSON <= scene.human.mass <= HEAVIEST_PERSON):
        mass = scene.human.mass
        unit, factor = ("g", 1e-3) if mass > HEAVIEST_PERSON else ("t", 1e3)
        yield (
            f"[human] mass: {mass:g} kg, and people have {SMALLEST_PERSON:g} to "
            f"{HEAVIEST_PERSON:g} kg; {mass:g} {unit} are {factor * mass:g} kg"
        )


def densities_alone(scene: Scene, setup: Setup) -> Iterator[str]:
    """Bodies lighter than foam or denser than osmium, where no fluid is to be compared with."""
    if setup.fluid is not None and not setup.fluid.one_way:
        return
    found = [*mean_densities(setup.solid), *((table.name, table.density) for table in scene.flesh)]
    light = sorted((body for body in found if body[1] < LIGHTEST), key=lambda body: body[1])
    heavy = sorted((body for body in found if body[1] > DENSEST), key=lambda body: -body[1])
    for bodies, what, bound in ((light, "foam", LIGHTEST), (heavy, "osmium", DENSEST)):
        if bodies:
            yield (
                f"[solids]: the density of {and_more([name for name, _ in bodies])} is "
                f"{bodies[0][1]:.3g} kg/m^3, and that of {what} is {bound:g}; water has 1000 "
                "kg/m^3, and 1 g/cm^3 is 1000 kg/m^3"
            )


def gravity(scene: Scene, setup: Setup) -> Iterator[str]:
    """Gravity in cm/s^2 or mm/s^2, and gravity that points up."""
    if not scene.has_bodies:
        return
    strength, up = float(np.linalg.norm(scene.gravity)), scene.dimensions - 1
    if strength and scene.gravity[up] == strength:
        yield f"gravity: it points up; -{strength:g} m/s^2 along {'xyz'[up]} points down"
    if strength > STRONGEST_GRAVITY:
        unit, factor = ("mm", 1e-3) if strength > CENTIMETRES[1] else ("cm", 1e-2)
        yield (
            f"gravity: {strength:g} m/s^2, and the Sun has {STRONGEST_GRAVITY:g}; "
            f"{strength:g} {unit}/s^2 are {factor * strength:g} m/s^2"
        )


def model_in_centimetres(scene: Scene, setup: Setup) -> Iterator[str]:
    """A model in cm and g in a scene with another gravity."""
    if (own := gravity_in_centimetres(scene)) and own != float(np.linalg.norm(scene.gravity)):
        assert scene.model_path is not None
        yield (
            f"[solids]: {scene.model_path.name} has a gravity of {own:g}, the Earth's in cm/s^2, "
            "so its sizes are in cm and its masses in g; a scene all in cm, g and s fits it "
            f"(gravity {own:g}, water of 1 g/cm^3 and 0.01 g/(cm s), air of 0.0012 and 0.00018), "
            "and so are its results"
        )


def winds(scene: Scene, setup: Setup) -> Iterator[str]:
    """Winds in km/h or mm/s."""
    for number, wind in enumerate(scene.wind, start=1):
        speed = float(np.linalg.norm(getattr(wind, "velocity", 0.0)))
        if speed > STRONGEST_WIND:
            yield (
                f"[[wind]] {number}: {speed:.4g} m/s, and the strongest gust on record had "
                f"{STRONGEST_WIND:g}; {speed:.4g} km/h are {speed / 3.6:.3g} m/s, and mm/s "
                f"{1e-3 * speed:.3g}"
            )


def inertias(scene: Scene, setup: Setup) -> Iterator[str]:
    """Bodies with a larger inertia than their mass can have within the creature."""
    model, length = setup.solid, float(np.linalg.norm(creature_extent(scene, setup)))
    moving = np.flatnonzero(model.moving & (model.body_mass[: model.nbody] > 0.0))
    largest = model.mj.body_inertia[moving].max(axis=1, initial=0.0)
    radius = np.sqrt(largest / model.body_mass[moving])
    wide = np.flatnonzero((radius > WIDEST * length * (1.0 + 1e-9)) & (length > 0.0))
    if wide.size:
        names = [model.body_names[moving[n]] for n in wide]
        yield (
            f"[solids]: the <inertial> of {and_more(names)} has its mass {radius[wide[0]]:.3g} m "
            f"from its centre, and the bodies measure {length:.3g} m; inertia is in kg m^2, a "
            "millionth of it in kg mm^2"
        )


def ranges(scene: Scene, setup: Setup) -> Iterator[str]:
    """Ranges of joints in degrees that are read as radians, and the other way round."""
    ends = _ends(setup.solid)
    wide = {joint: end for joint, end in ends.items() if end > MOST_TURNS * FULL_TURN}
    if wide:
        joint = max(wide, key=wide.__getitem__)
        yield (
            f"[solids]: the range of {and_more([joint, *(j for j in wide if j != joint)])} ends "
            f"{wide[joint] / FULL_TURN:.3g} turns away; {wide[joint]:.4g} rad are that, and "
            '<compiler angle="degree"/> in the model reads degrees; a joint without a range turns '
            "freely"
        )
    if ends and np.degrees(max(ends.values())) <= FULL_TURN * (1.0 + 1e-9):
        yield (
            f"[solids]: {listed([*ends])} turn{'s' * (len(ends) == 1)} by "
            f"{np.degrees(max(ends.values())):.3g} degrees at most; "
            '<compiler angle="radian"/> in the model reads radians'
        )


def _ends(model: SolidModel) -> dict[str, float]:
    """Joint -> the end of its range that is farther from 0, rad, of hinges and balls with one."""
    mj = model.mj
    turning = np.flatnonzero(np.isin(mj.jnt_type, (HINGE, BALL)) & (mj.jnt_limited != 0))
    return {model.joint_names[j]: float(np.abs(mj.jnt_range[j]).max()) for j in turning}


def clips(scene: Scene, setup: Setup) -> Iterator[str]:
    """A clip whose frame time is not in s, or whose angles are those of a file in radians."""
    capture = capture_of(scene)
    if scene.clip is None or scene.clip.file is None or capture is None:
        return
    file, clip = scene.clip.file, capture.clip
    if not SLOWEST_CAPTURE <= (rate := 1.0 / clip.frame_time) <= FASTEST_CAPTURE:
        yield (
            f"[clip]: {file} has a frame time of {clip.frame_time:.3g} s, {rate:.3g} frames per "
            "second; the unit of frame times is the second, as 0.0333 for 30 frames per second"
        )
    largest = 2.0 * math.acos(min(1.0, float(np.abs(clip.rotations[:, 1:, 0]).min(initial=1.0))))
    still, turned = math.radians(STILL), math.radians(FULL_TURN)
    if file.lower().endswith(".bvh") and still < largest <= turned:
        yield (
            f"[clip]: no joint of {file} turns by more than {math.degrees(largest):.3g}, as in a "
            "file whose angles are in radians; those of BVH files are in degrees"
        )


def slow_steps(scene: Scene, setup: Setup) -> Iterator[str]:
    """Steps in which joints swing or fall too far to be followed, without a fluid.

    Loops and flesh are left out: their fast modes are stiff, and nothing is lost with them.
    """
    model = setup.solid
    if setup.fluid is not None or model.flesh is not None or model.mj.neq:
        return
    free = ~model.locked
    for motion in setup.motions:
        free[motion.dofs] = False
    rate, dof = _fastest(model, initial_state(scene, model).q, np.flatnonzero(free))
    dt = scene.step_time
    if rate * dt <= 1.0 + 1e-9:
        return
    period = 2.0 * math.pi / rate
    enough = math.ceil(ENOUGH_STEPS * scene.frame_time / period)
    key = f"time.steps_per_frame = {enough}"
    if enough > MOST_STEPS:
        rate = ENOUGH_STEPS / period / scene.time.steps_per_frame
        key = f"time.frames_per_second = {rate:.3g} or more"
    name = model.joint_names[model.mj.dof_jntid[dof]]
    yield (
        f"[time]: {name} swings with a period of {period:.3g} s, and a step is {dt:.3g} s, where "
        f"{period / FEWEST_STEPS:.2g} s is the longest that can follow it; {key} will do"
    )


def _fastest(model: SolidModel, q: Array, dofs: Integers) -> tuple[float, int]:
    """Largest frequency or growth rate, rad/s, that gravity and springs give dofs (n,) at q (nq,),
    and the dof that moves most in it; 0 if none moves. Modes that their damping stops are none."""
    if not dofs.size:
        return 0.0, 0
    s, still = scratch(model), np.zeros(model.nv)

    def force(dof: int, way: float) -> Array:
        move = still.copy()
        move[dof] = way
        s.smooth_forces(model.integrate(q, move, 1.0), still, still)
        return s.smooth[dofs].copy()

    stiffness = np.array([(force(d, -NUDGE) - force(d, NUDGE)) / (2.0 * NUDGE) for d in dofs])
    s.smooth_forces(q, still, still)
    mass = s.mass_matrix()[np.ix_(dofs, dofs)]
    try:
        values, modes = eigh(0.5 * (stiffness + stiffness.T), mass)
    except (LinAlgError, ValueError):  # of numbers that overflow, with which a run blows up
        return 0.0, 0
    rates = np.sqrt(np.abs(values))
    damping = (model.mj.dof_damping[dofs, None] * modes**2).sum(axis=0)
    rates[damping >= 2.0 * rates] = 0.0
    mode = int(rates.argmax())
    return float(rates[mode]), int(dofs[np.abs(modes[:, mode] * (mass @ modes[:, mode])).argmax()])

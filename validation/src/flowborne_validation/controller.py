"""A controlled hinged block in simple winds: K1 to K4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from flowborne import Array, Controller, Hypothesis, Simulation, Velocities, World, load_scene, step
from flowborne.bodies import Wind, WindFaces, WindForce, kinematics
from flowborne.machine import Serial
from flowborne.parts import (
    GradientCentral,
    Objective,
    ObjectiveEffort,
    ObjectiveSum,
    ObjectiveWindDrag,
)
from flowborne.worlds import make_world
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.worlds import Vector, frames_of, mjcf

G = 9.81
FRAME = 1.0 / 24.0
LENGTH, WIDTH, DENSITY = 1.0, 0.3, 100.0
WEIGHT = DENSITY * LENGTH * WIDTH * G
"""Weight of the block, N per m."""

PROBE = 1.0
"""Displacement of the central difference, degrees."""

SPEED, AIR = 5.0, 1.2
"""m/s and kg/m^3 of the wind on faces."""

HINGE = np.array([0])

BLOCK = mjcf(
    '<geom name="square" type="box" size=".15 .15 1" pos="0 .15 0"/>'
    '<body name="block"><joint name="hinge" axis="0 0 1"/>'
    f'<geom type="box" size="{0.5 * WIDTH} {0.5 * LENGTH} 1" pos="0 {-0.5 * LENGTH} 0"/></body>'
)
"""Angle 0 hangs straight down, positive ones lean towards +x."""


def block(degrees: float, gravity: float, wind: Wind) -> World:
    """World of the block at rest at an angle."""
    world = make_world(
        BLOCK, slab=True, gravity=(0.0, -gravity, 0.0), solid_density=DENSITY, winds=(wind,)
    )
    world.solid.q[0] = np.radians(degrees)
    return world


def controller_of(
    objective: Objective, weight: float, pace: float, velocities: Velocities
) -> Controller:
    """Controller of the hinge.

    weight  1 minimises, -1 maximises
    pace    degrees in a frame that the strength allows
    """
    return Controller(
        HINGE,
        ObjectiveSum.of(objective, weight),
        Hypothesis(FRAME, velocities=velocities),
        float(np.radians(pace)) / FRAME,
        GradientCentral(float(np.radians(PROBE))),
        executor=Serial(),
    )


def path(world: World, controller: Controller, frames: int) -> Array:
    """(frames + 1,) angles in degrees while the controller runs."""
    angles = [float(world.solid.q[0])]
    for _ in range(frames):
        controller.decide(world, FRAME, step)
        step(world, FRAME, controller.command(world, world.time + FRAME, FRAME))
        angles.append(float(world.solid.q[0]))
    return np.degrees(angles)


def settled(world: World, controller: Controller, frames: int) -> float:
    """Mean of the last ten angles, degrees."""
    return float(path(world, controller, frames)[-10:].mean())


def landscape(world: World, controller: Controller, angles: Array) -> Array:
    """Objective at `angles` (degrees) in the controller's trials."""
    here = float(np.degrees(world.solid.q[0]))
    return controller.trials(world, step).values(np.radians(angles - here)[:, None])


def uniform_wind(shares: Sequence[float], apart: float) -> Figures:
    """K1: least effort under gravity and a uniform force, with the objective's own law, over angles
    that are some degrees apart."""
    pace = 20.0 * FRAME
    effort = controller_of(ObjectiveEffort(HINGE), 1.0, pace, "present")
    found: dict[str, float | Figure] = {}
    for share in shares:
        wind = WindForce((share * WEIGHT, 0.0, 0.0))
        best = float(np.degrees(np.arctan(share)))
        angle = settled(block(0.0, G, wind), effort, round((best + 20.0) / pace) + 20)
        title = f"angle of least effort at F_w = {share:g} m g, degrees"
        found[title] = Figure(angle, reference=best)
    angle = settled(block(best + 180.0 - 60.0, G, wind), effort, round(60.0 / pace) + 20)
    found["the same from near the far root, degrees"] = Figure(angle, reference=best + 180.0)
    size = 0.5 * LENGTH * WEIGHT * FRAME
    world = block(0.0, G, wind)
    least = float(landscape(world, effort, np.array([best]))[0]) / size
    angles = np.arange(-180.0, 180.0, apart)
    law = np.hypot(1.0, share) * np.abs(np.sin(np.radians(angles - best)))
    wrong = float(np.abs(landscape(world, effort, angles) / size - law).max())
    title = "error of |tau| = (L/2) sqrt((m g)^2 + F_w^2) |sin(psi - psi*)| over m g L/2"
    return {**found, "effort at the optimum over m g L/2 dt": least, title: wrong}


def faces_wind(optima: Mapping[str, float]) -> Figures:
    """K2: least effort under gravity and the wind of eq. (2), with windward and leeward faces.

    optima  load Lam of the wind over the weight -> angle, degrees
    """
    effort = controller_of(ObjectiveEffort(HINGE), 1.0, 0.1, "present")
    found: dict[str, float | Figure] = {}
    for load, exact in optima.items():
        speed = float(np.sqrt(float(load) * WEIGHT / (2.0 * AIR * LENGTH)))
        wind = WindFaces((speed, 0.0, 0.0), AIR, ("block",))
        world = block(exact - 5.0, G, wind)
        angle = settled(world, effort, 90)
        model, state = world.setup.solid, world.solid
        pose = kinematics(model, state.q)
        force = wind.wrench(model, pose, np.zeros(model.nv), 0.0)[1, :2] + [0.0, -WEIGHT]
        axis = -pose.body_rotation[1][:2, 1]
        off = np.degrees(np.arctan2(axis[0] * force[1] - axis[1] * force[0], force @ axis))
        title = f"angle of least effort at Lam = {load}, degrees"
        found[title] = Figure(angle, reference=exact)
        found[f"net force off the block's axis at Lam = {load}, degrees"] = float(off)
    return found


def wind_towards(degrees: float) -> tuple[Vector, WindFaces]:
    """Direction of a wind at an angle from +x, and the wind."""
    turn = float(np.radians(degrees))
    along = (float(np.cos(turn)), float(np.sin(turn)), 0.0)
    return along, WindFaces((SPEED * along[0], SPEED * along[1], 0.0), AIR, ("block",))


def drag_law(incidence: Array) -> Array:
    """D(phi) of K3 over 2 rho U^2 L; phi in degrees."""
    turn = np.radians(incidence)
    thin = WIDTH / LENGTH
    return np.abs(np.sin(turn)) ** 3 + thin * np.abs(np.cos(turn)) ** 3


def drag_at_rest(turns: Sequence[float], apart: float) -> Figures:
    """K3: most and least drag without the relative velocity, for winds from several sides. The
    least drag is at tan phi = w/L, where d/dphi (L sin^3 + w cos^3) = 0: a corner of a thick block
    points into the wind. Angles at which the law is compared are some degrees apart."""
    pace = 0.5
    scale = 2.0 * AIR * SPEED**2 * LENGTH
    corner = float(np.degrees(np.arctan(WIDTH / LENGTH)))
    found: dict[str, float | Figure] = {}
    for turn in turns:
        along, wind = wind_towards(turn)
        drag = ObjectiveWindDrag(np.array([1]), along)
        for extreme, weight, incidence in (("most", -1.0, 90.0), ("least", 1.0, corner)):
            # incidence 0 is the block along the wind, hinge windward: at angle turn + 90
            goal = turn + 90.0 - incidence
            controller = controller_of(drag, weight, pace, "removed")
            angle = settled(block(goal + 15.0, 0.0, wind), controller, 50)
            title = f"angle of {extreme} drag, wind turned by {turn:g} degrees, degrees"
            found[title] = Figure(angle, reference=goal)
    along, wind = wind_towards(0.0)
    controller = controller_of(ObjectiveWindDrag(np.array([1]), along), -1.0, pace, "removed")
    world = block(0.0, 0.0, wind)
    most = -float(landscape(world, controller, np.array([0.0]))[0]) / scale
    angles = np.arange(-180.0, 180.0, apart)
    wrong = -landscape(world, controller, angles) / scale - drag_law(angles + 90.0)
    return found | {
        "most drag over 2 rho U^2 L": most,
        "error of D(phi) over 2 rho U^2 L": float(np.abs(wrong).max()),
    }


def drag_of_slender_blocks(aspects: Sequence[float]) -> Figures:
    """K3 for blocks of several shapes, with the settings of the scene of least drag. The least drag
    is at a kink with different slopes on its sides: a probe of constant width would find a minimum
    away from it."""
    model = resources.files("flowborne.scenes.library").joinpath("block.xml").read_text()
    found = {}
    for aspect in aspects:
        best = {"most": 0.0, "least": float(np.degrees(np.arctan(aspect)))}
        with TemporaryDirectory() as folder:
            file = Path(folder) / "block.xml"
            file.write_text(model.replace("0.1 0.5 0.5", f"{0.5 / aspect:g} 0.5 0.5"))
            for goal, angle in best.items():
                settings = {
                    "solids.model": str(file),
                    "objectives.0.goal": goal,
                    "initial.positions.hinge": f"{angle - 34.3:g}",
                }
                with Simulation(load_scene("block-drag-min", settings), workers=1) as simulation:
                    final = float(hinge_angles(simulation, simulation.frames)[-10:].mean())
                title = f"{aspect:g}:1, angle of {goal} drag with the scene's defaults, degrees"
                found[title] = Figure(final, reference=angle)
    return found


def hinge_angles(simulation: Simulation, frames: int) -> Array:
    """(frames + 1,) degrees of a scene's only joint, at the start and after each frame. Raises
    ArithmeticError when the run blows up."""

    def angle(_: object = None) -> float:
        return float(simulation.world.solid.q[0])

    return np.degrees([angle(), *frames_of(simulation, frames, angle)])


def drag_in_motion(frames: int) -> Figures:
    """K4: with velocities kept the block turns against or with the wind at its strength."""
    pace = 20.0 * FRAME
    along, wind = wind_towards(0.0)
    drag = ObjectiveWindDrag(np.array([1]), along)
    found = {}
    for kind, where, sign in (("most", "against", -1.0), ("least", "with", 1.0)):
        controller = controller_of(drag, sign, pace, "probe")
        rates = np.diff(path(block(-sign * 70.0, 0.0, wind), controller, frames)) / pace
        for extreme, rate in (("slowest", rates.min()), ("fastest", rates.max())):
            title = f"{kind} drag: {extreme} rate over strength, + is {where} the wind"
            found[title] = float(rate * sign)
    return found

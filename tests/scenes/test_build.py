"""From tables to a world: units, initial state, what enters, what is wanted."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from flowborne.control.gradients import GradientCentral, GradientOneSided
from flowborne.control.measurement import Measurement
from flowborne.control.objective_kinds import ObjectivePressureDrag
from flowborne.control.objectives import ObjectiveCallable
from flowborne.control.phases import PhaseIntervals, PhaseTrack
from flowborne.control.rules import GoldenSection
from flowborne.coupling.stream import WindStream
from flowborne.fluid.sides.kinds import BoundaryInflow, BoundaryNoSlip
from flowborne.kernels.arrays import Array
from flowborne.motion.inflow import FactorSteady
from flowborne.scenes.build import Built, build
from flowborne.scenes.load import load_scene
from flowborne.scenes.wind import Gusts
from flowborne.sim.simulation import Simulation
from flowborne.solids.trajectories import ServoExact, ServoPD, TrajectoryServo
from flowborne.solids.wind import WindFaces, WindForce

Write = Callable[..., Path]


def cost(measurement: Measurement) -> float:
    """A user's own objective."""
    return 3.0 * measurement.dt


def whirl(x: Array, time: float) -> Array:
    """A user's own wind."""
    return np.stack([-x[:, 1], x[:, 0], 0.0 * x[:, 0]], axis=1)


def built(write: Write, append: str = "", **replaced: str) -> Built:
    return build(load_scene(write(append=append), replaced))


def test_degrees_become_radians_and_metres_stay(write: Write) -> None:
    scene = """
[initial]
positions = { wrist = 90.0, rail = 0.25, drift = [-0.5, 0.4, 0.0, 2.0, 0.0, 0.0, 0.0] }
velocities = { wrist = -180.0, rail = 0.5, drift = [1.0, 2.0, 0.0, 0.0, 0.0, 90.0] }
"""
    made = built(write, scene)
    model, state = made.world.setup.solid, made.world.solid
    q = {joint: state.q[model.positions_of(joint)] for joint in model.joint_names}
    v = {joint: state.v[model.dofs_of(joint)] for joint in model.joint_names}
    assert_allclose(q["wrist"], math.pi / 2)
    assert_allclose(q["rail"], 0.25)
    assert_allclose(q["drift"], [-0.5, 0.4, 0.0, 1.0, 0.0, 0.0, 0.0])
    assert_allclose(v["wrist"], -math.pi)
    assert_allclose(v["rail"], 0.5)
    assert_allclose(v["drift"], [1.0, 2.0, 0.0, 0.0, 0.0, math.pi / 2])


def test_a_joint_with_a_motion_starts_in_it(write: Write) -> None:
    made = build(load_scene(write(), {"motion.0.mean": "10.0", "motion.0.phase": "90.0"}))
    model, state = made.world.setup.solid, made.world.solid
    assert_allclose(state.q[model.positions_of("shoulder")], math.radians(40.0))
    motion = made.world.setup.motions[0]
    assert_allclose(state.v[model.dofs_of("shoulder")], motion.velocity(0.0), atol=1e-15)
    assert_allclose(motion.dofs, model.dofs_of("shoulder"))
    assert_allclose(motion.velocity(0.5), -math.radians(30.0) * math.pi)


def test_a_formula_follows_the_constants_that_are_set(write: Write) -> None:
    formula = """
[[motion]]
kind = "formula"
joint = "wrist"
position = "turn * (1 + ramp(t, 2))"

[[motion]]
kind = "formula"
joint = "rail"
position = "0.01 * turn * cos(pi * t)"

[constants]
turn = 30.0
"""
    settings = {"constants.turn": "40.0", "control": "[]", "objectives": "[]"}
    made = build(load_scene(write(append=formula), settings))
    _, wrist, rail = made.world.setup.motions
    assert_allclose(wrist.position(1.0), math.radians(60.0))
    assert_allclose(wrist.velocity(1.0), math.radians(40.0) * 0.75)
    assert_allclose(rail.position(1.0), -0.4)
    assert_allclose(made.world.solid.q[made.world.setup.solid.positions_of("rail")], 0.4)
    load_scene(write(append=formula), settings).to_toml()


def test_a_motion_has_the_servo_and_the_limit_of_the_scene(write: Write) -> None:
    settings = {"motion.0.servo": '{ kind = "pd", frequency = 2.0 }', "motion.0.torque_limit": "4"}
    (told,) = build(load_scene(write(), settings)).world.setup.motions
    assert isinstance(told, TrajectoryServo)
    assert isinstance(told.servo, ServoPD)
    assert told.servo.frequency == pytest.approx(4.0 * math.pi)
    assert told.servo.torque_limit == 4.0
    assert_allclose(told.velocity(0.0), math.radians(30.0) * math.pi)
    (told,) = build(load_scene(write(), {"motion.0.torque_limit": "4.0"})).world.setup.motions
    assert isinstance(told, TrajectoryServo)
    assert told.servo == ServoExact(4.0)
    (told,) = build(load_scene(write())).world.setup.motions
    assert not isinstance(told, TrajectoryServo)


def test_the_fluid_starts_with_the_scenes_velocity_everywhere(write: Write) -> None:
    made = build(load_scene(write(), {"fluid.velocity": "[1.5, -0.5]"}))
    fluid = made.world.fluid
    assert fluid is not None
    for values, expected in zip(fluid.velocity, (1.5, -0.5, 0.0), strict=True):
        assert_allclose(values, expected)
    for values in (*fluid.velocity_change, *fluid.acceleration):
        assert_allclose(values, 0.0)


def test_the_sides_are_those_of_the_scene(write: Write) -> None:
    made = build(
        load_scene(
            write(append='[[dye]]\nkind = "bands"\nside = "x_min"\ncount = 2\nwidth = 0.5'),
            {
                "boundaries.x_min.ramp": "2.0",
                "boundaries.y_max": '{ kind = "no-slip", velocity = [3.0, 0.0] }',
            },
        )
    )
    fluid = made.world.setup.fluid
    assert fluid is not None
    fluid.boundaries.check(fluid.grid)
    assert fluid.grid.shape == (16, 16, 1)
    assert_allclose(fluid.grid.upper[:2], (1.0, 1.0))
    inflow = fluid.boundaries.x_min
    assert isinstance(inflow, BoundaryInflow)
    y = np.array([-0.9, -0.5, 0.0, 0.5])
    u, _, _ = inflow.profile(np.full(4, -1.0), y, np.zeros(4), 1.0)
    assert_allclose(u, 0.5)
    assert_allclose(inflow.scalars["dye"](np.full(4, -1.0), y, np.zeros(4), 1.0), [0, 1, 0, 1])
    assert fluid.scalars == ("dye",)
    assert fluid.boundaries.y_max == BoundaryNoSlip((3.0, 0.0, 0.0))


def test_a_parabolic_inflow_spans_its_side(write: Write) -> None:
    made = build(load_scene(write(), {"boundaries.x_min.profile": "parabolic"}))
    assert made.world.setup.fluid is not None
    inflow = made.world.setup.fluid.boundaries.x_min
    assert isinstance(inflow, BoundaryInflow)
    u, _, _ = inflow.profile(np.full(3, -1.0), np.array([-1.0, 0.0, 1.0]), np.zeros(3), 0.0)
    assert_allclose(u, [0.0, 1.5, 0.0], atol=1e-15)


def test_sources_and_boxes_of_dye(write: Write) -> None:
    made = built(
        write,
        """
[[sources]]
lower = [0.2, -0.9]
upper = [0.4, -0.8]
volume_rate = 0.1
stop = 2.0
[[dye]]
kind = "box"
name = "smoke"
lower = [0.0, 0.0]
upper = [0.1, 0.1]
value = 0.5
""",
    )
    assert made.world.setup.fluid is not None
    jet, smoke = made.world.setup.fluid.sources
    assert (jet.volume_rate, jet.velocity, jet.times) == (0.1, None, (0.0, 2.0))
    assert (smoke.volume_rate, smoke.scalars) == (None, {"smoke": 0.5})
    assert smoke.active(1e9)


def test_mouths(write: Write) -> None:
    made = built(
        write,
        """
[[mouths]]
body = "hand"
position = [0.0, -0.2]
direction = [0.0, -2.0]
radius = 0.05
volume_rate = 0.3
pulse = { period = 1.75, duration = 1.0, start = 0.25 }
dye = { ink = 0.5 }
[[mouths]]
body = "float"
position = [0.1, 0.0]
direction = [1.0, 0.0]
radius = 0.05
volume_rate = -0.1
times = [0.0, 1.0]
factors = [0.0, 1.0]
[[mouths]]
body = "float"
position = [-0.1, 0.0]
direction = [-1.0, 0.0]
radius = 0.05
volume_rate = 0.2
factor = "-sin(2*pi*min(t % period, 1))"
[constants]
period = 1.75
""",
    )
    pulsed, inhaling, both = made.world.setup.mouths
    model = made.world.setup.solid
    assert model.body_names[pulsed.body] == "hand"
    assert (pulsed.position, pulsed.direction) == ((0.0, -0.2, 0.0), (0.0, -1.0, 0.0))
    assert (pulsed.radius, pulsed.volume_rate, pulsed.scalars) == (0.05, 0.3, {"ink": 0.5})
    times = [0.0, 0.25, 0.5, 0.75, 1.25, 1.5, 2.25, 4.0]
    strength = [pulsed.strength.at(time) for time in times]
    half = math.sqrt(0.5)
    assert_allclose(strength, [0.0, 0.0, half, 1.0, 0.0, 0.0, half, half], atol=1e-12)
    assert [inhaling.strength.at(time) for time in (-1.0, 0.5, 2.0)] == [0.0, 0.5, 1.0]
    assert inhaling.volume_rate == -0.1
    strength = [both.strength.at(time) for time in (0.0, 0.25, 0.75, 1.5, 2.0)]
    assert_allclose(strength, [0.0, -1.0, 1.0, 0.0, -1.0], atol=1e-12)
    assert made.world.setup.fluid is not None
    assert made.world.setup.fluid.scalars == ("ink",)
    pickle.loads(pickle.dumps(made.world.setup.mouths))


def test_a_run_tells_what_its_mouths_expel(write: Write) -> None:
    mouth = """
[[mouths]]
body = "float"
position = [0.1, 0.0]
direction = [1.0, 0.0]
radius = 0.05
volume_rate = 0.3
"""
    alone = {"control": "[]", "objectives": "[]", "time.steps_per_frame": "2"}
    with Simulation(load_scene(write(append=mouth), alone)) as simulation:
        simulation.advance_frame()
        measured = simulation.measure()
    assert_allclose(measured["expelled_m3"], 0.3 / 24.0)
    assert_allclose(measured["momentum_jet_x_Ns"], 1000.0 * 0.3**2 / 0.1 / 24.0, rtol=0.2)
    with Simulation(load_scene(write(), alone)) as simulation:
        assert not {"expelled_m3", "momentum_jet_x_Ns"} & simulation.measure().keys()


def test_winds(write: Write) -> None:
    made = built(
        write,
        """
[[wind]]
kind = "faces"
velocity = [5.0, 0.0]
[[wind]]
kind = "force"
force = [2.0, 0.0]
bodies = ["hand"]
""",
    )
    faces, force = made.world.setup.winds
    assert isinstance(faces, WindFaces)
    assert (faces.velocity, faces.density, faces.bodies) == ((5.0, 0.0, 0.0), 1.2, None)
    assert isinstance(force, WindForce)
    assert (force.force, force.bodies) == ((2.0, 0.0, 0.0), ("hand",))


def test_winds_over_the_ground_and_in_gusts(write: Write) -> None:
    made = built(
        write,
        """
[[wind]]
kind = "faces"
velocity = [8.0, 0.0]
times = [0.0, 2.0]
factors = [0.5, 1.0]
[[wind]]
kind = "python"
function = "WHIRL"
""".replace("WHIRL", f"{__name__}:whirl"),
    )
    gusts, whirl = made.world.setup.winds
    assert isinstance(gusts, WindFaces)
    assert callable(gusts.velocity)
    places = np.array([[0.0, 0.0, 0.0], [3.0, 1.0, 0.0]])
    assert_allclose(gusts.velocity(places, 0.0)[:, 0], 4.0)
    assert_allclose(gusts.velocity(places, 5.0)[:, 0], 8.0)
    assert isinstance(whirl, WindFaces)
    assert callable(whirl.velocity)
    assert_allclose(whirl.velocity(places, 0.0), [[0.0, 0.0, 0.0], [-1.0, 3.0, 0.0]])
    ground = Gusts((8.0, 0.0, 0.0), 0.5, 4.0, FactorSteady())
    heights = np.array([[0.0, 0.0, z] for z in (-1.0, 0.0, 1.0, 4.0)])
    assert_allclose(ground(heights, 1.0)[:, 0], [0.0, 0.0, 4.0, 8.0])


@pytest.mark.parametrize(
    ("coupling", "kind"), [("none", WindFaces), ("one-way", WindStream), ("two-way", None)]
)
def test_a_stream_stands_for_the_fluid_where_that_does_not_push(
    write: Write, coupling: str, kind: type | None
) -> None:
    stream = '[[wind]]\nkind = "stream"\nvelocity = [1.0, 0.0]\n'
    made = build(load_scene(write(append=stream), {"fluid.coupling": coupling}))
    assert (made.world.setup.fluid is None) == (coupling == "none")
    winds = made.world.setup.winds
    assert [type(wind) for wind in winds] == ([] if kind is None else [kind])
    if made.world.setup.fluid is not None:
        assert made.world.setup.fluid.one_way == (coupling == "one-way")


def test_densities_of_the_scene_replace_those_of_the_model(write: Write) -> None:
    area = {"arm": 0.1 * 0.4, "hand": math.pi * 0.01, "float": math.pi * 0.01}
    densities = {
        (): {"arm": 1200.0, "hand": 1200.0, "float": 500.0},
        (("solids.density", "100.0"),): {"arm": 100.0, "hand": 100.0, "float": 100.0},
        (("solids.density", "100.0"), ("solids.densities.hand", "7.0")): {
            "arm": 100.0,
            "hand": 7.0,
            "float": 100.0,
        },
    }
    for overrides, expected in densities.items():
        model = build(load_scene(write(), dict(overrides))).world.setup.solid
        for body, density in expected.items():
            mass = model.body_mass[model.body(body)]
            assert_allclose(mass, density * area[body], rtol=1e-9)


def test_the_controller_is_that_of_the_scene(write: Write) -> None:
    made = build(
        load_scene(
            write(),
            {
                "control.0.joints": '["wrist", "rail"]',
                "control.0.torque_limit": "4.0",
                "control.0.in_phases": "[{ strength = 10.0, phases = { kind = 'motion', "
                "joint = 'shoulder', side = 'above' } }]",
                "controller.gradient": "one-sided",
                "controller.rule": '{ kind = "golden-section", reach = 30.0 }',
                "controller.servo": '{ kind = "pd", frequency = 2.0 }',
                "controller.every": "3",
                "controller.settle_steps": "2",
                "controller.velocities": "present",
            },
        )
    )
    controller, model = made.controller, made.world.setup.solid
    assert controller is not None
    assert_allclose(controller.dofs, [*model.dofs_of("wrist"), *model.dofs_of("rail")])
    assert_allclose(controller.strength, [math.radians(20.0), 20.0])
    (other,) = controller.in_phases
    assert other.indices == (0, 1)
    assert_allclose(other.strength, [math.radians(10.0), 10.0])
    rises = made.world.setup.motions[0].velocity(0.1)[0] >= 0.0
    assert other.phases.active(0.1) == rises
    assert isinstance(controller.gradient, GradientOneSided)
    assert_allclose(controller.gradient.displacement, [math.radians(5.0), 5.0])
    assert isinstance(controller.rule, GoldenSection)
    assert controller.rule.reach == pytest.approx(math.radians(30.0))
    assert isinstance(controller.servo, ServoPD)
    assert controller.servo.frequency == pytest.approx(4.0 * math.pi)
    assert controller.servo.torque_limit == (4.0, 4.0)
    assert (controller.every, controller.hypothesis.settle) == (3, 2)
    assert controller.hypothesis.dt == pytest.approx(1.0 / 24.0)
    assert controller.hypothesis.velocities == "present"
    pickle.loads(pickle.dumps((made.world, controller)))


def test_objectives_have_sign_weight_scope_and_phases(write: Write) -> None:
    made = built(
        write,
        f"""
[[objectives]]
kind = "pressure-lift"
goal = "most"
weight = 2.5
direction = [0.0, 1.0]
bodies = ["hand"]
frame = "arm"
phases = {{ kind = "motion", joint = "shoulder", side = "below", threshold = 10.0 }}

[[objectives]]
kind = "input-motion"
joint = "wrist"
values = [45.0]
phases = {{ kind = "intervals", intervals = [[0.0, 1.0]], period = 2.0 }}

[[objectives]]
kind = "velocity"
body = "arm"
target = [1.0, 0.0]

[[objectives]]
kind = "python"
function = "{__name__}:cost"
""",
    )
    assert made.controller is not None
    assert isinstance(made.controller.gradient, GradientCentral)
    model = made.world.setup.solid
    effort, lift, pose, _, own = made.controller.objective.terms
    assert effort.weight == 1.0
    assert isinstance(lift.objective, ObjectivePressureDrag)
    assert lift.weight == -2.5
    assert lift.objective.name == "pressure-lift"
    assert lift.objective.bodies.tolist() == [model.body("hand")]
    assert lift.objective.frame == model.body("arm")
    assert isinstance(lift.phases, PhaseTrack)
    assert (lift.phases.sign, lift.phases.threshold) == (-1, pytest.approx(math.radians(10.0)))
    assert isinstance(pose.phases, PhaseIntervals)
    assert pose.phases.active(2.5)
    assert not pose.phases.active(1.5)
    assert isinstance(own.objective, ObjectiveCallable)


def test_a_scene_without_bodies(tmp_path: Path) -> None:
    path = tmp_path / "cavity.toml"
    path.write_text(
        "dimensions = 2\n[domain]\nsize = [1.0, 1.0]\nresolution = 8\n[fluid]\nviscosity = 0.01\n"
        '[boundaries]\ny_max = { kind = "no-slip", velocity = [1.0, 0.0] }'
    )
    made = build(load_scene(path))
    assert made.controller is None
    assert made.world.setup.solid.nv == 0
    assert made.world.solid.q.size == 0


def test_a_scene_without_fluid_in_three_dimensions(tmp_path: Path, write: Write) -> None:
    write()
    path = tmp_path / "air.toml"
    path.write_text('gravity = [0.0, 0.0, -9.81]\n[solids]\nmodel = "squid.xml"')
    made = build(load_scene(path))
    assert made.world.fluid is None
    assert not made.world.setup.solid.slab
    assert_allclose(made.world.setup.solid.gravity, [0.0, 0.0, -9.81])

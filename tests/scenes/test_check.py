"""Everything that can be wrong with a scene is said at once, in sentences, with its place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flowborne.base.errors import SceneError
from flowborne.scenes.load import check_scene, load_scene

Write = Callable[..., Path]

TURNING = '{ kind = "far", times = [0.0, 1.0], factors = [1.0, -1.0] }'

ONE_FAULT = {
    "a key that is unknown": (
        {"density = 1000.0": "densty = 1000.0"},
        "scene swim.toml, [fluid]: unknown key 'densty'; did you mean 'density'?",
    ),
    "a table that is unknown": (
        {"[fluid]": "[fluit]"},
        "scene swim.toml: unknown key 'fluit'; did you mean 'fluid'?",
    ),
    "a negative density": (
        {"density = 1000.0": "density = -1.5"},
        "scene swim.toml, [fluid] density: -1.5 is not greater than 0. Give a larger number.",
    ),
    "a joint that is not in the model": (
        {'joints = ["wrist"]': 'joints = ["wirst"]'},
        "scene swim.toml, [[control]] 1: joint 'wirst' is not in model squid.xml; "
        "did you mean 'wrist'?",
    ),
    "a joint that is like no other": (
        {'joints = ["wrist"]': 'joints = ["xyz"]'},
        "scene swim.toml, [[control]] 1: joint 'xyz' is not in model squid.xml. "
        "Its joints are: shoulder, wrist, rail, drift.",
    ),
    "no resolution at all": (
        {"resolution = 16": "resolution = 0"},
        "scene swim.toml, [domain] resolution: 0 is less than 1. Give a larger number.",
    ),
    "a coarse resolution": (
        {"resolution = 16": "resolution = 2"},
        "scene swim.toml, [domain] is too coarse with 2 x 2 cells. "
        "Refine it until every side has at least 4 cells.",
    ),
    "cells that are no cubes": (
        {"resolution = 16": "cells = [16, 8]"},
        "scene swim.toml, [domain] has cells of 0.125 x 0.25 m, but cells are cubes. "
        "Change cells or the corners, or give resolution alone.",
    ),
    "a domain inside out": (
        {"upper = [1.0, 1.0]": "upper = [1.0, -2.0]"},
        "scene swim.toml, [domain] reaches from -1 to -2 m in y. "
        "Make every number of upper larger than that of lower.",
    ),
    "a body outside the domain": (
        {"lower = [-1.0, -1.0]": "lower = [-1.0, -0.5]", "resolution = 16": "cells = [16, 12]"},
        "scene swim.toml, [domain]: body 'hand' reaches from -0.6 to -0.4 m in y at the start, "
        "outside the domain from -0.5 to 1 m. The creature takes -0.6 to 0.6 m in x and -0.6 to "
        "0.6 m in y. Move it or enlarge the domain.",
    ),
    "a creature outside the domain": (
        {"lower = [-1.0, -1.0]": "lower = [1.0, -1.0]", "upper = [1.0, 1.0]": "upper = [3.0, 1.0]"},
        "at the start, outside the domain from 1 to 3 m, and so do 3 more bodies. The creature ",
    ),
    "an infinite velocity": (
        {"velocity = [1.0, 0.0]": "velocity = [inf, 0.0]"},
        "scene swim.toml, [boundaries] x_min.velocity, entry 1: inf is not a finite number. "
        "Give a finite number.",
    ),
    "a number that is text": (
        {"strength = 20.0": 'strength = "20"'},
        "scene swim.toml, [[control]] 1, strength: '20' is not a number. "
        "Give a number, without quotes.",
    ),
    "a boundary that does not exist": (
        {'x_max = "open"': 'x_max = "opn"'},
        "scene swim.toml, [boundaries] x_max: 'opn' is not known; did you mean 'open'?",
    ),
    "an inflow without outlet": (
        {'x_max = "open"': 'x_max = "closed"'},
        "scene swim.toml, [boundaries]: +2 m^2/s enters through inflow sides and sources, and no "
        "side is open for as much to leave. Make a side open.",
    ),
    "one periodic side": (
        {'x_max = "open"': 'x_max = "open"\ny_min = "periodic"'},
        "scene swim.toml, [boundaries]: y_min is periodic and y_max is closed. "
        "Make both of them periodic or neither.",
    ),
    "far sides of a channel": (
        {'x_max = "open"': 'y_min = "far"\ny_max = "far"'},
        "scene swim.toml, [boundaries]: only the sides across one axis are far or open, and an "
        "endless channel of fluid cannot be set in motion. Make a side across another axis far, or "
        "these open.",
    ),
    "far sides in different seas": (
        {'x_max = "open"': 'x_max = { kind = "far", velocity = [1.0, 0.0] }\ny_min = "far"'},
        "scene swim.toml, [boundaries] y_min has another velocity or another change in time than "
        "x_max. Give all of them the same: there is one sea.",
    ),
    "a sea that others take part in": (
        {'x_max = "open"': 'x_max = { kind = "far", velocity = [1.0, 0.0] }\ny_min = "open"'},
        "scene swim.toml, [boundaries]: far sides have a velocity, and other sides take part in "
        "the flow. Make every side far, or closed opposite a far one.",
    ),
    "a sea that turns back": (
        {'x_max = "open"': f"x_max = {TURNING}\ny_min = {TURNING}"},
        "scene swim.toml, [boundaries] x_max: factors [1.0, -1.0] turn the sea's stream around, "
        "and it leaves through one side only. Keep them at 0 or above.",
    ),
    "a side in z of a plane": (
        {'x_max = "open"': 'x_max = "open"\nz_min = "open"'},
        "scene swim.toml, [boundaries] z_min is open, but a scene of 2 dimensions has no sides "
        "in z. Drop it.",
    ),
    "inflow that faces a periodic side": (
        {'x_max = "open"': 'x_max = "periodic"'},
        "scene swim.toml, [boundaries]: x_min is inflow and x_max is periodic. "
        "Make both of them periodic or neither.",
    ),
    "gravity that is not finite": (
        {"gravity = [0.0, -9.81]": "gravity = [inf, -9.81]"},
        "scene swim.toml, gravity, entry 1: inf is not a finite number. Give a finite number.",
    ),
    "gravity out of the plane": (
        {"gravity = [0.0, -9.81]": "gravity = [0.0, 0.0, -9.81]"},
        "scene swim.toml, gravity: [0.0, 0.0, -9.81] leaves the plane of a scene of 2 dimensions. "
        "Make its z component 0.",
    ),
    "a model that is missing": ({"squid.xml": "octopus.xml"}, "octopus.xml. Correct solids.model."),
    "motion and control on one joint": (
        {'joints = ["wrist"]': 'joints = ["wrist", "shoulder"]'},
        "scene swim.toml, [[control]] 1: joint 'shoulder' has a [[motion]] as well. "
        "Take it out of one of the two.",
    ),
    "a joint that is controlled twice": (
        {'joints = ["wrist"]': 'joints = ["wrist", "wrist"]'},
        "scene swim.toml, [[control]] 1: joint 'wrist' is controlled twice. Name it once.",
    ),
    "a free joint that is controlled": (
        {'joints = ["wrist"]': 'joints = ["wrist", "drift"]'},
        "joint 'drift' is a free joint, and only hinges, slides and ball joints have strength.",
    ),
    "a motion of a free joint": (
        {'joint = "shoulder"': 'joint = "drift"'},
        "scene swim.toml, [[motion]] 1: joint 'drift' is a free joint, and only hinges and slides "
        "follow a motion.",
    ),
    "a start beyond the joint's range": (
        {"amplitude = 30.0": "amplitude = 150.0\nphase = 90.0"},
        "scene swim.toml, [initial]: joint 'shoulder' starts at 150 degrees, outside its range "
        "from -120 to 120 degrees. Start it within.",
    ),
    "an objective without its kind": (
        {'kind = "effort"': 'goal = "least"'},
        "scene swim.toml, [[objectives]] 1: key 'kind' is missing. Give one of: effort, wind-drag, "
        "drag, pressure-drag, pressure-lift, input-motion, velocity, speed, distance, python.",
    ),
    "a speed without direction": (
        {'kind = "effort"': 'kind = "speed"\ndirection = [0.0, 0.0]'},
        "scene swim.toml, [[objectives]] 1: direction is 0. "
        "Give a direction such as [1.0, 0.0, 0.0].",
    ),
    "a distance of a body that is not there": (
        {'kind = "effort"': 'kind = "distance"\nbody = "hnad"\npoint = [0.0, 0.0]'},
        "scene swim.toml, [[objectives]] 1: body 'hnad' is not in model squid.xml; "
        "did you mean 'hand'?",
    ),
    "knots and what only trials of poses have": (
        {"[solids]": '[controller]\nknots = 3\nvelocities = "probe"\n\n[solids]'},
        "scene swim.toml, [controller] has knots, and velocities, which is for trials of poses. "
        "Give one of the two.",
    ),
    "steps of a plan that miss its knots": (
        {"[solids]": "[controller]\nknots = 3\nhypothetical_time = 0.03\n\n[solids]"},
        "scene swim.toml, [controller]: hypothetical_time is 0.03 s, and there are 0.04167 s from "
        "decision to decision, which is no whole number of steps. Give 0.04167, or leave it out "
        "to step by frames.",
    ),
    "a wind objective without wind": (
        {'kind = "effort"': 'kind = "wind-drag"\ndirection = [1.0, 0.0]'},
        "scene swim.toml, [[objectives]] 1: there is no wind to drag. "
        "Add a [[wind]], or use 'pressure-drag'.",
    ),
    "a frame that is no body": (
        {'kind = "effort"': 'kind = "pressure-lift"\ndirection = [0.0, 1.0]\nframe = "hnad"'},
        "scene swim.toml, [[objectives]] 1: body 'hnad' is not in model squid.xml; "
        "did you mean 'hand'?",
    ),
    "a phase that ends before it starts": (
        {
            'kind = "effort"': 'kind = "effort"\n'
            'phases = { kind = "intervals", intervals = [[2.0, 1.0]] }'
        },
        "scene swim.toml, [[objectives]] 1, phases has the interval [2, 1] s. "
        "Put the smaller time first.",
    ),
    "a strength in a phase that follows nothing": (
        {
            "strength = 20.0": "strength = 20.0\nin_phases = "
            '[{ strength = 1.0, phases = { kind = "motion", joint = "rail" } }]'
        },
        "scene swim.toml, [[control]] 1, in_phases 1, phases: joint 'rail' has no [[motion]] to "
        "follow.",
    ),
    "a phase that follows nothing": (
        {'kind = "effort"': 'kind = "effort"\nphases = { kind = "motion", joint = "rail" }'},
        "scene swim.toml, [[objectives]] 1, phases: joint 'rail' has no [[motion]] to follow.",
    ),
    "a function that Python does not find": (
        {'kind = "effort"': 'kind = "python"\nfunction = "nowhere_at_all:cost"'},
        "Python does not find module 'nowhere_at_all' of 'nowhere_at_all:cost'.",
    ),
    "a wish of a joint that is not controlled": (
        {'kind = "effort"': 'kind = "effort"\nwanted_by = ["wirst"]'},
        "scene swim.toml, [[objectives]] 1, wanted_by: joint 'wirst' is not controlled; "
        "did you mean 'wrist'?",
    ),
    "one table where several may be": (
        {"[[control]]": "[control]"},
        "scene swim.toml: [control] may be there several times. Write [[control]].",
    ),
}


@pytest.mark.parametrize("fault", ONE_FAULT)
def test_one_fault_gives_one_clear_message(write: Write, fault: str) -> None:
    replaced, message = ONE_FAULT[fault]
    problems = check_scene(write(replaced))
    assert len(problems) == 1
    assert message in problems[0]


PERIODIC_Y = {
    "resolution = 16": "cells = [16, 12]",
    'x_max = "open"': 'x_max = "open"\ny_min = "periodic"\ny_max = "periodic"',
}


def test_a_model_is_no_scene(write: Write) -> None:
    model = write({}).parent / "squid.xml"
    model.write_text("<mujoco/>")
    assert check_scene(model) == [
        f"scene {model} is a model, without a fluid. Write a TOML file beside it, with "
        'model = "squid.xml" under [solids], and give that.'
    ]


def test_a_body_may_start_across_periodic_sides(write: Write) -> None:
    problems = check_scene(write({"lower = [-1.0, -1.0]": "lower = [-1.0, -0.5]"} | PERIODIC_Y))
    assert not problems


def test_a_body_across_periodic_sides_is_shorter_than_the_domain(write: Write) -> None:
    short = {
        "lower = [-1.0, -1.0]": "lower = [-1.0, -0.05]",
        "upper = [1.0, 1.0]": "upper = [1.0, 0.05]",
        "resolution = 16": "cells = [160, 8]",
    }
    problems = check_scene(write(PERIODIC_Y | short))
    assert len(problems) == 1
    assert "m in y at the start, outside the domain from -0.05 to 0.05 m" in problems[0]


MOUTH = """
[[mouths]]
body = "hand"
position = [0.0, -0.2]
direction = [0.0, -1.0]
radius = 0.05
volume_rate = 0.1
"""

FORMULA = """
[[motion]]
kind = "formula"
joint = "rail"
position = "height * t"

[constants]
height = 0.3
"""

APPENDED_FAULT = {
    "keyframes that go back in time": (
        '[[motion]]\nkind = "keyframes"\njoint = "rail"\ntimes = [0, 2, 1]\nvalues = [0, 1, 2]',
        "scene swim.toml, [[motion]] 2 has times that do not increase: entry 3 is 1 s after 2 s. "
        "Put them in order, each once.",
    ),
    "an input motion that goes back in time": (
        '[[objectives]]\nkind = "input-motion"\njoint = "rail"\ntimes = [0, 2, 1]\n'
        "values = [0, 1, 2]",
        "has times that do not increase: entry 3 is 1 s after 2 s. Put them in order, each once.",
    ),
    "NaN in keyframes": (
        '[[motion]]\nkind = "keyframes"\njoint = "rail"\ntimes = [0, 1]\nvalues = [0, nan]',
        "scene swim.toml, [[motion]] 2, values, entry 2: nan is not a finite number. "
        "Give a finite number.",
    ),
    "tables of unequal length": (
        '[[motion]]\nkind = "keyframes"\njoint = "rail"\ntimes = [0, 1, 2]\nvalues = [0, 1]',
        "scene swim.toml, [[motion]] 2 has 3 times and 2 values. Give as many of both.",
    ),
    "two motions of one joint": (
        '[[motion]]\nkind = "constant"\njoint = "shoulder"',
        "scene swim.toml, [[motion]] 2: joint 'shoulder' has another [[motion]] above.",
    ),
    "a name that a formula does not know": (
        FORMULA.replace("height *", "hieght *"),
        "scene swim.toml, [[motion]] 2, position: formula 'hieght * t': "
        "name 'hieght' is not known; "
        "did you mean 'height'?",
    ),
    "a formula that is not finite": (
        FORMULA.replace("height *", "height / (t - 0.125) *").replace(' t"', ' sqrt(t + 1)"'),
        "scene swim.toml, [[motion]] 2, position: formula 'height / (t - 0.125) * sqrt(t + 1)' or "
        "its derivative is not finite at t = 0.125 s. Change it, or end the run before.",
    ),
    "a constant that no formula uses": (
        FORMULA + "hieght = 2.0",
        "scene swim.toml, constants: no formula uses 'hieght'; did you mean 'height'?",
    ),
    "a constant with the name of a function": (
        FORMULA + "ramp = 2.0",
        "scene swim.toml, constants: 'ramp' cannot be a constant's name. Change it.",
    ),
    "a constant that is text": (
        FORMULA.replace("0.3", '"0.3"'),
        "scene swim.toml, constants height: '0.3' is not a number. Give a number, without quotes.",
    ),
    "a drive without force": (
        '[[motion]]\nkind = "constant"\njoint = "rail"\ntorque_limit = 0.0',
        "scene swim.toml, [[motion]] 2, torque_limit: 0.0 is not greater than 0.",
    ),
    "a servo that does not exist": (
        '[[motion]]\nkind = "constant"\njoint = "rail"\nservo = "exct"',
        "scene swim.toml, [[motion]] 2, servo: 'exct' is not known; did you mean 'exact'?",
    ),
    "a start and a motion of one joint": (
        "[initial]\npositions = { shoulder = 3.0 }",
        "scene swim.toml, [initial] positions: joint 'shoulder' has a [[motion]], which says where "
        "it starts. Drop one of them.",
    ),
    "too many numbers for a joint": (
        "[initial]\nvelocities = { rail = [1.0, 2.0] }",
        "scene swim.toml, [initial] velocities: joint 'rail' is a slide and has 2 numbers. Give 1.",
    ),
    "dye at a closed side": (
        '[[dye]]\nkind = "bands"\nside = "y_min"\ncount = 3\nwidth = 0.1',
        "scene swim.toml, [[dye]] 1: side y_min is closed, and dye enters with an inflow. "
        "Choose an inflow side, or use a dye of kind 'box'.",
    ),
    "a source outside the domain": (
        "[[sources]]\nlower = [2.0, 0.0]\nupper = [3.0, 0.1]\nvolume_rate = 1.0",
        "scene swim.toml, [[sources]] 1: the box reaches from 2 to 3 m in x, outside the domain "
        "from -1 to 1 m. Move it.",
    ),
    "a mouth of a body that is not there": (
        MOUTH.replace("hand", "head"),
        "scene swim.toml, [[mouths]] 1: body 'head' is not in model squid.xml; "
        "did you mean 'hand'?",
    ),
    "a mouth of no size": (
        MOUTH.replace("0.05", "0.0"),
        "scene swim.toml, [[mouths]] 1, radius: 0.0 is not greater than 0. Give a larger number.",
    ),
    "a mouth that points nowhere": (
        MOUTH.replace("-1.0]", "0.0]"),
        "scene swim.toml, [[mouths]] 1 has a direction of length 0. Point it out of the body.",
    ),
    "a mouth that points out of the plane": (
        MOUTH.replace("-1.0]", "-1.0, 0.5]"),
        "scene swim.toml, [[mouths]] 1, direction: [0.0, -1.0, 0.5] leaves the plane of a scene of "
        "2 dimensions. Make its z component 0.",
    ),
    "a mouth beside its body": (
        MOUTH.replace("-0.2]", "0.9]"),
        "scene swim.toml, [[mouths]] 1: mouth 1 of body 'hand' covers no cell at [0.0, 0.5, 0.0] "
        "m, 0 s. Put its position on the body's skin, inside the domain, with the direction out of "
        "the body.",
    ),
    "a mouth with a pulse and keyframes": (
        MOUTH + "pulse = { period = 1, duration = 1 }\ntimes = [0.0, 1.0]\nfactors = [0.0, 1.0]",
        "scene swim.toml, [[mouths]] 1 has keyframes and a pulse. Keep one of them.",
    ),
    "a mouth with a pulse and a formula": (
        MOUTH + 'pulse = { period = 1, duration = 1 }\nfactor = "sin(t)"',
        "scene swim.toml, [[mouths]] 1 has a pulse and a formula. Keep one of them.",
    ),
    "a mouth's formula with a name that is not known": (
        MOUTH + 'factor = "sin(t / period)"\n[constants]\nperoid = 1.75',
        "scene swim.toml, [[mouths]] 1, factor: formula 'sin(t / period)': name 'period' is not "
        "known; did you mean 'peroid'?",
    ),
    "a constant that no mouth uses": (
        MOUTH + 'factor = "sin(t / period)"\n[constants]\nperiod = 1.75\nperoid = 1.75',
        "scene swim.toml, constants: no formula uses 'peroid'; did you mean 'period'?",
    ),
    "a pulse longer than its period": (
        MOUTH + "pulse = { period = 1.0, duration = 1.5 }",
        "scene swim.toml, [[mouths]] 1, pulse lasts for 1.5 s of every 1 s. Make the duration no "
        "longer than the period.",
    ),
    "a wind on no body": (
        '[[wind]]\nkind = "force"\nforce = [1.0, 0.0]\nbodies = ["arms"]',
        "scene swim.toml, [[wind]] 1: body 'arms' is not in model squid.xml; did you mean 'arm'?",
    ),
    "a wind that grows with a height that is not there": (
        '[[wind]]\nkind = "faces"\nvelocity = [1.0, 0.0]\nexponent = 0.2',
        "scene swim.toml, [[wind]] 1: an exponent makes the wind grow with z, which a scene of 2 "
        "dimensions does not have. Drop it.",
    ),
    "gusts without their times": (
        '[[wind]]\nkind = "faces"\nvelocity = [1.0, 0.0]\nfactors = [0.0, 1.0]',
        "scene swim.toml, [[wind]] 1 has no times. Give both times and factors.",
    ),
    "a wind that Python does not find": (
        '[[wind]]\nkind = "python"\nfunction = "nowhere_at_all:blow"',
        "scene swim.toml, [[wind]] 1: Python does not find module 'nowhere_at_all' of "
        "'nowhere_at_all:blow'.",
    ),
    "a short vector": (
        '[[wind]]\nkind = "faces"\nvelocity = [1.0]',
        "scene swim.toml, [[wind]] 1, velocity [1.0] is neither (x, y) nor (x, y, z). "
        "Give 2 or 3 numbers.",
    ),
}


@pytest.mark.parametrize("fault", APPENDED_FAULT)
def test_one_more_table_gives_one_clear_message(write: Write, fault: str) -> None:
    text, message = APPENDED_FAULT[fault]
    problems = check_scene(write(append="\n" + text))
    assert len(problems) == 1
    assert message in problems[0]


@pytest.mark.parametrize(
    ("replaced", "message"),
    [
        (
            {'{ kind = "inflow", velocity = [1.0, 0.0] }': '"closed"', '"open"': '"closed"'},
            "scene swim.toml, [boundaries]: what a mouth expels has nowhere to go, as no side is "
            "open. Make a side open.",
        ),
        (
            {"density = 1000.0": 'density = 1000.0\ncoupling = "one-way"'},
            "scene swim.toml, [fluid] coupling: the fluid does not feel bodies with mouths when it "
            "is 'one-way'. Make it 'two-way', or drop [[mouths]].",
        ),
    ],
)
def test_a_mouth_needs_a_fluid_that_feels_it_and_gives_way(
    write: Write, replaced: dict[str, str], message: str
) -> None:
    assert check_scene(write(replaced, MOUTH)) == [message]
    assert check_scene(write(append=MOUTH)) == []


def test_a_sound_scene_has_no_problems(write: Write) -> None:
    assert check_scene(write()) == []


def test_all_problems_come_at_once(write: Write) -> None:
    problems = check_scene(
        write(
            {
                "frames = 3": "frames = 0",
                "density = 1000.0": "density = -1.0\nviscosty = 1.0",
                'x_max = "open"': 'x_max = "open"\ny_min = "periodic"',
                'joint = "shoulder"': 'joint = "sholder"',
                'kind = "effort"': 'kind = "efort"',
            },
            '\n[[objectives]]\nkind = "velocity"\nbody = "palm"\ntarget = [1.0, 0.0]',
        )
    )
    wanted = ["frames", "density", "viscosty", "y_min", "sholder", "efort", "[[objectives]] 2"]
    assert len(problems) == len(wanted)
    for word in wanted:
        assert any(word in problem for problem in problems), word


def test_syntax_is_told_with_its_line(write: Write) -> None:
    problems = check_scene(write({"frames = 3": "frames = = 3"}))
    assert len(problems) == 1
    assert problems[0].startswith("scene swim.toml, line 6, column 10: this is not TOML (")


def test_a_file_that_ends_early_is_told(write: Write) -> None:
    problems = check_scene(write(append="\nfoo = [1, 2"))
    assert problems == [
        "scene swim.toml, at its end: this is not TOML (unclosed array). Correct it there."
    ]


def test_mujoco_refuses_the_model(write: Write) -> None:
    problems = check_scene(write(model="<mujoco><worldbody><body><geom/></body></worldbody>"))
    assert len(problems) == 1
    assert problems[0].startswith("scene swim.toml, [solids]: model ")
    assert "squid.xml cannot be read" in problems[0]


def test_a_hinge_across_the_plane_cannot_be_driven(write: Write) -> None:
    tilted = """
    <mujoco><worldbody><body name="arm">
      <joint name="shoulder" type="hinge" axis="0 0 1"/>
      <geom type="box" size="0.05 0.2 0.5"/>
      <body name="hand" pos="0 -0.4 0">
        <joint name="wrist" type="hinge" axis="1 0 0"/>
        <geom type="box" size="0.05 0.05 0.5"/>
      </body></body></worldbody></mujoco>"""
    problems = check_scene(write(model=tilted))
    assert problems == [
        "scene swim.toml, [[control]] 1: joint 'wrist' moves out of the plane of a scene of 2 "
        "dimensions. Turn its axis, or choose another joint."
    ]


def test_tables_without_their_domain_or_bodies(write: Write, tmp_path: Path) -> None:
    path = tmp_path / "empty.toml"
    path.write_text("dimensions = 2\n[fluid]\ndensity = 1.0\n[[control]]\njoints=['a']\nstrength=1")
    problems = check_scene(path)
    assert problems == [
        "scene empty.toml, [fluid]: there is no [domain] to fill. "
        "Add [domain], or drop this table.",
        "scene empty.toml has neither [domain] nor [solids]: there is nothing to simulate. "
        "Add one of them.",
        "scene empty.toml, [control]: there are no bodies. "
        "Add [solids] with a model, or drop this table.",
    ]


def test_a_scene_that_is_not_there() -> None:
    assert check_scene("ns-blok-drag-max") == [
        "there is no scene 'ns-blok-drag-max'; did you mean 'ns-block-drag-max'?"
    ]
    assert check_scene("nowhere/swim.toml") == [
        "there is no scene file nowhere/swim.toml. Correct the path."
    ]


def test_load_raises_what_check_lists(write: Write) -> None:
    path = write({"density = 1000.0": "density = -1.0", "frames = 3": "frames = -3"})
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    assert caught.value.problems == check_scene(path)
    assert len(caught.value.problems) == 2


@pytest.mark.parametrize(
    "model", [r"C:\Users\me\fish.xml", r"models\fish.xml", r"..\new\tail.xml", r"\ball.xml"]
)
def test_a_windows_path_in_quotes_is_told_to_be_written_with_slashes(
    tmp_path: Path, model: str
) -> None:
    (tmp_path / "swim.toml").write_text(f'[solids]\nmodel = "{model}"\n')
    (problem, *_) = [p for p in check_scene(tmp_path / "swim.toml") if "\\" in p]
    assert problem.endswith(" Write paths with / in place of \\, on Windows as well.")

"""Numbers in another unit, without a fluid: what `check` says, and that its proposals end it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import flowborne as fb
from flowborne.base.errors import SceneError
from flowborne.scenes import warn_units
from flowborne.scenes.build import build
from flowborne.scenes.load import load_scene
from flowborne.scenes.notes import notes_of
from flowborne.scenes.warn import warnings_of

MODEL = """
<mujoco>
  <compiler angle="degree"/>
  <worldbody>
    <body name="arm">
      <joint name="hinge" axis="0 1 0" range="-90 90"/>
      <geom type="box" size="0.05 0.05 0.2" pos="0 0 -0.2"/>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 24.0
frames = 24
[solids]
model = "arm.xml"
density = 500.0
[initial]
positions = { hinge = 40.0 }
"""

PERIOD = 2.0 * np.pi * np.sqrt((0.05**2 + 0.2**2) / 3.0 + 0.2**2) / np.sqrt(9.81 * 0.2)
"""s, of the arm's small swings about straight down."""

Swung = Callable[..., fb.Scene]


@pytest.fixture
def swung(tmp_path: Path) -> Swung:
    """The scene above with other texts in scene or model."""

    def swung(new: dict[str, str] | None = None) -> fb.Scene:
        scene, model = SCENE, MODEL
        for old, text in (new or {}).items():
            assert old in scene + model
            scene, model = scene.replace(old, text), model.replace(old, text)
        (tmp_path / "arm.xml").write_text(model)
        (tmp_path / "arm.toml").write_text(scene)
        return load_scene(tmp_path / "arm.toml")

    return swung


def said(scene: fb.Scene) -> list[str]:
    return warnings_of(scene, build(scene).world.setup)


def test_a_sound_scene_without_a_fluid_has_no_warning(swung: Swung) -> None:
    assert said(swung()) == []


IN_MILLIMETRES = {'size="0.05 0.05 0.2" pos="0 0 -0.2"': 'size="50 50 200" pos="0 0 -200"'}


IN_CENTIMETRES = {"<compiler": '<option gravity="0 0 -981"/><compiler'}


WIND = '[[wind]]\nkind = "faces"\nvelocity = [144.0, 0.0, 0.0]\n'
INERTIAL = '<inertial pos="0 0 0" mass="1" diaginertia="{0} {0} {0}"/>'


@pytest.mark.parametrize(
    ("new", "expected"),
    [
        (IN_MILLIMETRES, "they measure 0.371 m if in millimetres and 3.71 m if in centimetres"),
        ({"density = 500.0": "density = 0.5"}, "that of foam is 10; water has 1000 kg/m^3"),
        ({"density = 500.0": "density = 5e5"}, "that of osmium is 22600; water has 1000 kg/m^3"),
        ({"-9.81": "9.81"}, "gravity: it points up; -9.81 m/s^2 along z points down"),
        ({"-9.81": "-981.0"}, "gravity: 981 m/s^2, and the Sun has 274; 981 cm/s^2 are 9.81 m"),
        ({"-9.81": "-9810.0"}, "gravity: 9810 m/s^2, and the Sun has 274; 9810 mm/s^2 are 9.81 m"),
        (IN_CENTIMETRES, "arm.xml has a gravity of 981, the Earth's in cm/s^2, so its size"),
        ({"[initial]": WIND + "[initial]"}, "[[wind]] 1: 144 m/s, and the strongest gust"),
        ({"<geom": f"{INERTIAL.format(1000)}<geom"}, "the <inertial> of arm has its mass 31.6 m"),
        ({'angle="degree"': 'angle="radian"'}, "the range of hinge ends 14.3 turns away; 90 rad"),
        ({"-90 90": "-1.57 1.57", "= 40.0": "= 0.5"}, "hinge turns by 1.57 degrees at most; "),
    ],
)
def test_numbers_in_another_unit(swung: Swung, new: dict[str, str], expected: str) -> None:
    warnings = [w for w in said(swung(new)) if "[time]" not in w]
    assert len(warnings) == 1
    assert expected in warnings[0]


def test_a_scene_in_the_centimetres_of_its_model_is_not_compared_with_metres(swung: Swung) -> None:
    """Its density of 0.5 g/cm^3 is none of foam, and a note says why."""
    scene = swung(IN_CENTIMETRES | {"0, -9.81]": "0, -981.0]", "density = 500.0": "density = 0.5"})
    setup = build(scene).world.setup
    assert [w for w in warnings_of(scene, setup) if "[time]" not in w] == []
    assert any("the scene is taken to be in cm" in note for note in notes_of(scene, setup.solid))


def test_a_grain_in_kilometres(swung: Swung) -> None:
    new = {'size="0.05 0.05 0.2" pos="0 0 -0.2"': 'size="5e-5 5e-5 2e-4" pos="0 0 -2e-4"'}
    scene = swung(new | {"<compiler ": '<compiler boundmass="1e-6" boundinertia="1" '})
    assert "and they measure 0.371 m if in kilometres" in said(scene)[0]


CLIP = Path(__file__).parent / "clips" / "pybvh-test2.bvh"


def clip_in(folder: Path, turned: float = 1.0, frame_time: str | None = None) -> list[str]:
    """What is said of the clip with angles times `turned` and another frame time."""
    head, motion = CLIP.read_text().split("MOTION")
    lines = motion.strip().splitlines()
    rows = np.array([line.split() for line in lines[2:]], float)
    rows[:, 3:] *= turned  # all joints but the root have angles alone
    time = lines[1] if frame_time is None else f"Frame Time: {frame_time}"
    body = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in rows)
    (folder / "walk.bvh").write_text(f"{head}MOTION\n{lines[0]}\n{time}\n{body}\n")
    scene = 'human = {}\n[time]\nframes = 2\n[clip]\nfile = "walk.bvh"\n'
    (folder / "walk.toml").write_text(scene)
    loaded = load_scene(folder / "walk.toml")
    return list(warn_units.clips(loaded, build(loaded).world.setup))


def test_a_clip_in_other_units_is_told(tmp_path: Path) -> None:
    assert clip_in(tmp_path) == []
    (said,) = clip_in(tmp_path, turned=np.pi / 180.0)
    assert "those of BVH files are in degrees" in said
    assert clip_in(tmp_path, turned=1e-7) == []  # rounding: only the root travels
    (said,) = clip_in(tmp_path, frame_time="33.3")
    assert "33.3 s, 0.03 frames per second; the unit of frame times is the second" in said


def test_people_weigh_what_people_do(swung: Swung) -> None:
    for mass, right in ((70000.0, "70000 g are 70 kg"), (0.07, "0.07 t are 70 kg")):
        scene = load_scene("human-gravity-arms", {"human.mass": str(mass)})
        warnings = [w for w in said(scene) if w.startswith("[human] mass")]
        assert [w.split("; ")[1] for w in warnings] == [right]


def test_steps_too_long_for_a_swing(swung: Swung) -> None:
    """With the proposal the arm ends near where it ends with far shorter steps. At 40 degrees its
    stiffness is that of small swings times the cosine."""
    slow = {"frames_per_second = 24.0": "frames_per_second = 1.0", "frames = 24": "frames = 1"}
    (warning,) = said(swung(slow))
    period = float(re.findall(r"period of ([\d.]+) s", warning)[0])
    assert period == pytest.approx(PERIOD / np.sqrt(np.cos(np.radians(40.0))), rel=1e-2)
    steps = int(re.findall(r"time\.steps_per_frame = (\d+) will do", warning)[0])
    ends = {}
    for count in (1, steps, 100 * steps):
        scene = swung(slow | {"frames = 24": f"frames = 1\nsteps_per_frame = {count}"})
        assert bool(said(scene)) is (count == 1)
        with fb.Simulation(scene) as simulation:
            simulation.advance_frame()
            ends[count] = float(np.degrees(simulation.joint("hinge").position[0]))
    exact = ends[100 * steps]
    assert abs(ends[steps] - exact) < 5.0 < abs(ends[1] - exact)


@pytest.mark.parametrize(
    ("stiffness", "damping", "warns"), [(0.0, 0.0, False), (1e5, 0.0, True), (1e5, 1e3, False)]
)
def test_a_spring_counts_unless_its_damping_stops_it(
    swung: Swung, stiffness: float, damping: float, warns: bool
) -> None:
    joint = f'range="-90 90" stiffness="{stiffness}" damping="{damping}"'
    assert any("swings" in w for w in said(swung({'range="-90 90"': joint}))) is warns


@pytest.mark.parametrize("range_", ["30 30", "40 30"])
def test_ranges_that_limit_nothing_are_refused(swung: Swung, range_: str) -> None:
    """MuJoCo reads them as no limit."""
    for old, new in (
        ('range="-90 90"', f'range="{range_}"'),
        ('range="-90 90"', f'actuatorfrcrange="{range_}"'),
        (
            "</mujoco>",
            f'<actuator><motor name="m" joint="hinge" ctrlrange="{range_}"/></actuator></mujoco>',
        ),
    ):
        with pytest.raises(SceneError, match=f"range from {range_.replace(' ', ' to ')}"):
            swung({old: new})

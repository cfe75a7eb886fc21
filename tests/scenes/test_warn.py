"""What `check` warns of, and that each value it proposes ends the warning."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flowborne.coupling.world import TRIAL_TOLERANCE
from flowborne.scenes import warn, warn_bodies
from flowborne.scenes.build import build
from flowborne.scenes.load import load_scene
from flowborne.scenes.seen import Seen
from flowborne.scenes.warn import warnings_of
from flowborne.scenes.warn_speed import rigid_part

MODEL = """
<mujoco>
  <worldbody>
    <body name="arm" pos="-0.5 0 0">
      <joint name="shoulder" axis="0 0 1"/>
      <geom type="box" size="0.25 0.1 1" pos="0.25 0 0"/>
      <body name="hand" pos="0.5 0 0">
        <joint name="wrist" axis="0 0 1" stiffness="1"/>
        <geom type="box" size="0.25 0.1 1" pos="0.25 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """
dimensions = 2

[time]
frames_per_second = 100.0
frames = 10

[domain]
lower = [-2.0, -2.0]
upper = [2.0, 2.0]
resolution = 80

[fluid]
density = 1000.0

[boundaries]
x_min = { kind = "inflow", velocity = [1.0, 0.0] }
x_max = "open"

[solids]
model = "arm.xml"
density = 1100.0

[[motion]]
kind = "sinusoid"
joint = "shoulder"
amplitude = 20.0
period = 1.0

[[control]]
joints = ["wrist"]
strength = 30.0
probe = 2.0

[[objectives]]
kind = "effort"
"""

Warned = Callable[..., list[str]]


@pytest.fixture
def warned(tmp_path: Path) -> Warned:
    """Warnings about the scene above with other settings and texts, in the scene or the model."""

    def warned(
        settings: dict[str, str] | None = None, new: dict[str, str] | None = None, more: str = ""
    ) -> list[str]:
        scene, model = SCENE + more, MODEL
        for old, text in (new or {}).items():
            assert old in scene + model
            scene, model = scene.replace(old, text), model.replace(old, text)
        (tmp_path / "arm.xml").write_text(model)
        (tmp_path / "arm.toml").write_text(scene)
        loaded = load_scene(tmp_path / "arm.toml", settings or {})
        return warnings_of(loaded, build(loaded).world.setup)

    return warned


def proposed(warning: str) -> dict[str, str]:
    """The settings that a warning proposes."""
    remedy = warning.split("; ")[1]
    return dict(re.findall(r"([a-z]\w*(?:\.\w+)+) = (\[[\d, ]+\]|[\d.]*\d)", remedy))


def test_a_sound_scene_has_no_warning(warned: Warned) -> None:
    assert warned() == []


@pytest.mark.parametrize("new", [{}, {"resolution = 80": "cells = [30, 30]"}])
def test_thin_bodies_and_the_grid_that_gives_two_cells(warned: Warned, new: dict[str, str]) -> None:
    """0.2 m are two cells of 0.1 m, at 40 along 4 m."""
    (warning,) = warned({} if new else {"domain.resolution": "30"}, new)
    assert warning.startswith("[domain]: arm is 0.2 m thick, 1.5 cells, and below 2 cells the flow")
    settings = proposed(warning)
    assert settings == ({"domain.cells": "[40, 40]"} if new else {"domain.resolution": "40"})
    assert warned(settings, new) == []
    if not new:
        assert len(warned({"domain.resolution": "39"})) == 1


def test_bodies_that_are_thickened(warned: Warned) -> None:
    """The fluid meets the arm as thick as the diagonal of a cell, here of 5 m."""
    corners = {"domain.lower": "[-50.0, -50.0]", "domain.upper": "[50.0, 50.0]"}
    thin, *_ = warned(corners | {"domain.resolution": "20"})
    assert "and 7.14 m on the grid, 35.7 times as thick" in thin
    assert proposed(thin) == {"domain.resolution": "1000"}
    assert not any("thick" in warning for warning in warned(corners | proposed(thin)))


def test_a_domain_for_which_there_is_no_memory_is_to_be_smaller_or_the_body_thicker(
    warned: Warned, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(warn_bodies, "fits_memory", lambda counts: max(counts) <= 80)
    wide = {"domain.lower": "[-3.0, -3.0]", "domain.upper": "[3.0, 3.0]"}
    coarse = wide | {"domain.resolution": "50"}
    (warning,) = warned(coarse)
    assert proposed(warning) == {"domain.resolution": "60"}
    monkeypatch.setattr(warn_bodies, "fits_memory", lambda counts: False)
    (warning,) = warned(coarse)
    assert "; in a domain 5 m long as many cells give 2" in warning
    half = {"domain.lower": "[-2.5, -2.5]", "domain.upper": "[2.5, 2.5]"}
    assert warned(coarse | half) == []
    (warning,) = warned({"domain.resolution": "16"})
    assert "; a thickness of 0.5 m gives 2" in warning
    assert warned({"domain.resolution": "16"}, {"0.25 0.1 1": "0.25 0.25 1"}) == []


def test_fluid_that_passes_through_a_body(warned: Warned, monkeypatch: pytest.MonkeyPatch) -> None:
    net = Seen("net", 0.04, 0.04, 0.8, False, 0.0, 0.0)
    monkeypatch.setattr(warn_bodies, "seen_bodies", lambda setup: [net])
    (warning,) = warned()
    assert warning.startswith(
        "[domain]: net is 0.04 m thick, 0.8 cells, and fluid passes through it"
    )
    assert proposed(warning) == {"domain.resolution": "200"}


def test_a_domain_far_larger_than_the_creature_and_the_size_that_will_do(warned: Warned) -> None:
    """At a hundred lengths a wall changes the added mass by 1e-4 of it."""

    def sized(side: float) -> list[str]:
        half = 0.5 * side
        corners = {"domain.lower": f"[{-half}, {-half}]", "domain.upper": f"[{half}, {half}]"}
        return [w for w in warned(corners) if "shortest side" in w]

    (warning,) = sized(150.0)
    side = float(re.findall(r"; ([\d.]+) m or less", warning)[0])
    assert 99.0 < side < 103.0
    assert sized(side) == []
    assert pytest.approx(1e-4) == 1.0 / warn_bodies.LARGEST_DOMAIN**2


@pytest.mark.parametrize(
    ("settings", "said", "value"),
    [
        ({"solids.density": "0.5"}, "0.0005 times the mass", "500"),
        ({"solids.density": "30"}, "0.03 times the mass", "100"),
        ({"solids.density": "1.1e6"}, "1.1e+03 times the mass", "1100"),
        ({"solids.density": "50000"}, "50 times the mass", "10000"),
        ({"fluid.density": "1.2", "solids.density": "1e6"}, "8.33e+05 times", "1000"),
    ],
)
def test_densities_of_another_unit_and_what_will_do(
    warned: Warned, settings: dict[str, str], said: str, value: str
) -> None:
    (warning,) = warned(settings)
    assert said in warning
    assert f"; {value} kg/m^3 will do, and 1 g/cm^3 is 1000 kg/m^3" in warning
    assert warned(settings | {"solids.density": value}) == []


def test_water_as_light_as_air(warned: Warned) -> None:
    """Bodies a thousand times heavier are at home in air, but no gas is as viscous as water."""
    assert warned({"fluid.density": "1.2", "fluid.viscosity": "1.8e-5"}) == []
    typed = {"fluid.density": "1.0", "fluid.viscosity": "1e-3"}
    (warning,) = warned(typed)
    assert proposed(warning) == {"fluid.density": "1000"}
    assert warned(typed | proposed(warning)) == []


@pytest.mark.parametrize(
    ("new", "said"),
    [
        ({"period = 1.0": "period = 0.02"}, "hand crosses up to"),
        ({"strength = 30.0": "strength = 3000.0"}, "hand crosses up to"),
        ({"velocity = [1.0": "velocity = [60.0"}, "the stream at x_min crosses up to 12 cells"),
        (
            {
                "[boundaries]": "[[sources]]\nlower = [1.0, 1.0, 0.0]\nupper = [1.5, 1.5, 0.0]\n"
                "velocity = [0.0, -20.0]\n[boundaries]"
            },
            "the flow of [[sources]] 1 crosses up to 4 cells",
        ),
        ({"[fluid]": "[fluid]\nvelocity = [10.0, 10.0]"}, "the initial flow crosses up to 4 cells"),
    ],
)
def test_too_many_cells_in_a_step_and_the_steps_that_make_it_one(
    warned: Warned, new: dict[str, str], said: str
) -> None:
    (warning,) = warned({}, new)
    assert warning.startswith(f"[time]: {said}")
    settings = proposed(warning)
    assert set(settings) == {"time.steps_per_frame"}
    assert warned(settings, new) == []


def test_a_speed_for_which_there_are_not_steps_enough(warned: Warned) -> None:
    new = {"velocity = [1.0": "velocity = [1e6"}
    (warning,) = warned({}, new)
    assert warning.endswith(
        "crosses up to 2e+05 cells in one step; as slow as 5e-06 of that it crosses one"
    )


@pytest.mark.parametrize(
    ("settings", "value"),
    [
        ({"control.0.strength": "0.5"}, "28.6"),
        ({"control.0.strength": "0.05"}, "6.29"),
        ({"control.0.probe": "0.02"}, "1.15"),
        ({"control.0.probe": "0.001"}, "0.573"),
    ],
)
def test_strength_and_probe_in_radians(
    warned: Warned, settings: dict[str, str], value: str
) -> None:
    (warning,) = warned(settings)
    assert re.search(rf"; .*\b{re.escape(value)} degrees", warning), warning
    assert warned(dict.fromkeys(settings, value)) == []


def test_a_probe_as_small_as_may_be_has_a_gradient_right_to_a_thousandth() -> None:
    assert TRIAL_TOLERANCE / np.radians(warn.LEAST_PROBE) == pytest.approx(1e-3)


@pytest.mark.parametrize("strength", ["120.0", "360.0"])
def test_joints_slower_than_the_clip_that_they_are_to_be_close_to(
    strength: str, swing: str
) -> None:
    """A servo of 4 Hz goes at half of its strength."""

    def slow(strength: str) -> list[str]:
        scene = load_scene(swing, {"control.0.strength": strength})
        return [w for w in warnings_of(scene, build(scene).world.setup) if "close to" in w]

    found = slow(strength)
    assert len(found) == 2 * (strength == "120.0")
    if found:
        assert "[[objectives]] 2: 'left_shoulder' is to be close to a motion of up to" in found[0]
        assert "and goes at 62.8 at most; a strength of" in found[0]
        values = [re.findall(r"a strength of ([\d.]+) in", warning)[0] for warning in found]
        assert slow(max(values, key=float)) == []


LIMP = {' stiffness="1"': "", 'joints = ["wrist"]': 'joints = ["shoulder"]'}
MOVED = SCENE[SCENE.index("[[motion]]") : SCENE.index("[[control]]")]


def test_a_fluid_that_starts_unlike_the_sea_around(warned: Warned) -> None:
    sides = {f"boundaries.{name}_{end}": FLOWING for name in "xy" for end in ("min", "max")}
    (warning,) = warned(sides)
    assert warning.startswith(
        "[fluid] velocity: the fluid starts with [0.0, 0.0, 0.0] m/s in a sea"
    )
    assert warned(sides | {"fluid.velocity": "[1.0, 0.5]"}) == []


FLOWING = '{ kind = "far", velocity = [1.0, 0.5] }'


def test_a_joint_that_hangs_limp_and_what_holds_it(warned: Warned) -> None:
    """The shoulder hangs on the world: a creature may swing there."""
    new = {MOVED: ""} | LIMP
    (warning,) = warned({}, new)
    assert warning.startswith("[solids]: nothing drives wrist, and no stiffness holds it; ")
    assert warned({}, {MOVED: "", **dict([list(LIMP.items())[1]])}) == []
    held = '\n[[motion]]\nkind = "constant"\njoint = "wrist"\n'
    assert warned({}, new, held) == []


@pytest.mark.parametrize(
    "settings",
    [
        {"fluid.density": "1e-100"},
        {"fluid.density": "1e100", "solids.density": "1e-9"},
        {"control.0.strength": "1e-100", "control.0.probe": "1e-100"},
        {"control.0.strength": "1e100"},
        {"time.frames_per_second": "1e-100"},
    ],
)
def test_numbers_at_the_ends_of_the_range_end_in_warnings(
    warned: Warned, settings: dict[str, str]
) -> None:
    assert all(len(warning) < 400 for warning in warned(settings, {MOVED: ""}))


def test_what_floats_recoils() -> None:
    """Two equal masses pushed apart by a joint go half as far each, and a turn as a whole is none.

    What has no mass, or more than numbers hold, stays as it is.
    """
    places = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    mass = np.array([1.0, 2.0, 3.0, 4.0])
    whole = np.array([0.1, 0.2, 0.3]) + np.cross([0.01, 0.02, 0.03], places)
    assert rigid_part(places, whole, mass) == pytest.approx(whole, abs=1e-12)
    assert not rigid_part(places, whole, np.zeros(4)).any()
    with np.errstate(all="ignore"):
        assert not rigid_part(places, 1e200 * whole, 1e200 * mass).any()
    apart = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
    assert apart - rigid_part(places[:2], apart, np.ones(2)) == pytest.approx(
        np.array([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]])
    )

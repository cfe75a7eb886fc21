"""Winds, streams, weights and strengths that change in a run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import flowborne as fb
from flowborne.scenes.changes import ChangeTable, values_at
from flowborne.sim.running import run
from flowborne.sim.simulation import Simulation


def bits(simulation: Simulation) -> dict[str, bytes]:
    return {name: values.tobytes() for name, values in simulation.world.arrays().items()}


def with_changes(scene: Path, text: str) -> Path:
    """A copy of a scene with [[changes]]."""
    path = scene.with_name("changed.toml")
    path.write_text(scene.read_text() + text)
    return path


def test_values_go_evenly_from_those_before() -> None:
    changes = [
        ChangeTable(time=1.0, over=2.0, values={"wind.0.velocity": [4.0, 0.0, 0.0]}),
        ChangeTable(time=2.0, values={"control.0.strength": 9.0}),
    ]
    start = {"wind.0.velocity": [0.0, 0.0, 2.0], "control.0.strength": 5.0}
    assert values_at(changes, start, 0.75, 0.25) == {}
    assert values_at(changes, start, 1.75, 0.25) == {"wind.0.velocity": [2.0, 0.0, 1.0]}
    last = {"wind.0.velocity": [4.0, 0.0, 0.0], "control.0.strength": 9.0}
    assert values_at(changes, start, 2.75, 0.25) == last


def test_a_wind_that_turns_pushes_the_other_way(small_scene: Path) -> None:
    with Simulation(small_scene, workers=1) as simulation:
        before = simulation.advance_frame().drag()[1, 0]
        wind = simulation.scene.wind[0].velocity
        simulation.change({"wind.0.velocity": [-speed for speed in wind]})
        after = simulation.advance_frame().drag()[1, 0]
    assert before > 0.0
    assert after < 0.0


ARRAYS = [np.array, np.float32, tuple, lambda values: [np.float64(value) for value in values]]


@pytest.mark.parametrize("kind", ARRAYS)
def test_arrays_change_a_value_as_lists_do(small_scene: Path, kind: Callable[[Any], Any]) -> None:
    with Simulation(small_scene, workers=1) as plain, Simulation(small_scene, workers=1) as other:
        for wind in ([0.0, 5.0, 0.0], [1.0, -5.0, 0.0], [1.0, -5.0, 0.0]):
            plain.change({"wind.0.velocity": wind, "control.0.strength": 7.5}, over=0.05)
            given = kind(wind), np.float64(7.5)
            other.change({"wind.0.velocity": given[0], "control.0.strength": given[1]}, over=0.05)
            for simulation in (plain, other, plain, other):
                simulation.advance_frame()
        assert bits(plain) == bits(other)
        assert other.changes == plain.changes
        assert tomli_w.dumps({"values": other.changes[0].values})
        with pytest.raises(fb.SceneError, match="velocity"):
            other.change({"wind.0.velocity": kind([0.0, np.nan, 0.0])})
        other.advance_frame()


def test_a_scene_with_the_changes_repeats_the_run(small_scene: Path) -> None:
    """Also one that is stopped and goes on."""
    with Simulation(small_scene, workers=1) as played:
        for _ in range(2):
            played.advance_frame()
        played.change({"wind.0.velocity": [0.0, 7.0, 0.0], "control.0.strength": 20.0}, over=0.1)
        for _ in range(4):
            played.advance_frame()
        (change,) = played.changes
        row = played.measure()
    scene = with_changes(
        small_scene,
        f"""
[[changes]]
time = {change.time!r}
over = 0.1
values = {{ "wind.0.velocity" = [0.0, 7.0, 0.0], "control.0.strength" = 20.0 }}
""",
    )
    with Simulation(scene, workers=1) as repeated:
        for _ in range(6):
            repeated.advance_frame()
        assert bits(repeated) == bits(played)
        np.testing.assert_equal(repeated.measure(), row)
    run(scene, out=scene.parent / "out", frames=3, workers=1, film=False)
    result = run(scene, out=scene.parent / "out", frames=6, workers=1, film=False, resume=True)
    history = fb.open_run(result.folder).history
    assert history["angle_hinge_rad"][-1] == row["angle_hinge_rad"]


def test_from_an_earlier_frame_it_goes_on_with_other_settings(small_scene: Path) -> None:
    with Simulation(small_scene, workers=1) as simulation:
        simulation.advance_frame()
        early = simulation.snapshot()
        simulation.advance_frame()
        unchanged = bits(simulation)
        simulation.restore(early)
        simulation.change({"wind.0.velocity": [0.0, 7.0, 0.0]})
        simulation.advance_frame()
        changed = bits(simulation)
        assert changed != unchanged
        simulation.restore(early)
        simulation.advance_frame()
        assert bits(simulation) == changed


def test_a_stream_changes_in_its_sides() -> None:
    scene = fb.load_scene("ns-block-drag-max", {"domain.resolution": "24"})
    with Simulation(scene, workers=1) as simulation:
        simulation.advance_frame()
        simulation.change({"boundaries.x_min.velocity": [2.0, 0.0, 0.0]})
        simulation.advance_frame()
        _, state = simulation.world.flow()
        np.testing.assert_allclose(state.velocity[0][0, :, 0], 2.0)
        assert simulation.setup.shapes is not None


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"time.frames": 3}, "'time.frames' cannot change in a run. Change one of wind"),
        ({"wind.0.speed": 3}, "speed"),
        ({"wind.4.velocity": [1.0, 0.0, 0.0]}, "'4' is not an entry of wind"),
        ({"control.0.strength": -1.0}, "strength"),
        ({"control.0.joints": ["elbow"]}, "which joints are controlled"),
    ],
)
def test_what_cannot_change_is_refused(
    small_scene: Path, values: dict[str, object], said: str
) -> None:
    with Simulation(small_scene, workers=1) as simulation:
        with pytest.raises(fb.SceneError, match=said):
            simulation.change(values)
        assert simulation.changes == ()
    key, value = next(iter(values.items()))
    text = str(value).replace("'", '"')
    scene = with_changes(
        small_scene, f'\n[[changes]]\ntime = 0.5\nvalues = {{ "{key}" = {text} }}\n'
    )
    with pytest.raises(fb.SceneError, match=said):
        fb.load_scene(scene)

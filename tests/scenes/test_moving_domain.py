"""A domain that follows bodies, in scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flowborne as fb
from flowborne.base.errors import SceneError
from flowborne.scenes.notes import window_notes
from flowborne.scenes.warn_bodies import fixed_outside

from ..made_runs import numbers, run

SEA = dict.fromkeys(("x_min", "x_max", "y_min", "y_max"), "far")
DRIFTER = """<mujoco><worldbody>
<body name="drifter"><joint name="x" type="slide" axis="1 0 0"/>
<geom type="cylinder" size="0.1 1" density="1000"/></body>
<body name="post" pos="0.3 0.3 0"><geom type="cylinder" size="0.05 1"/></body>
</worldbody></mujoco>"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "drifter.xml").write_text(DRIFTER)
    return tmp_path


def toml(value: Any) -> str:
    """A value of a scene file."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(one)}" for key, one in value.items()) + " }"
    return f'"{value}"' if isinstance(value, str) else str(value)


def scene(folder: Path, **domain: Any) -> fb.Scene:
    path = folder / "drift.toml"
    table = {"lower": [-0.4, -0.4], "upper": [0.4, 0.4], "resolution": 32, **domain}
    sides = table.pop("sides", SEA)
    lines = ["dimensions = 2", "[time]", "frames_per_second = 20.0", "frames = 12"]
    lines += ["[solids]", 'model = "drifter.xml"', "[initial]", "velocities = { x = 1.0 }"]
    for name, keys in (("domain", table), ("boundaries", sides)):
        lines += [f"[{name}]"]
        lines += [f"{key} = {toml(value)}" for key, value in keys.items()]
    path.write_text("\n".join([*lines, "[fluid]", ""]))
    return fb.load_scene(path)


def test_a_run_knows_where_its_window_is(folder: Path) -> None:
    fb.run(scene(folder, follow="drifter", along=["x"]), folder / "out", film=False)
    run = fb.open_run(folder / "out")
    corners = [run.grid_at(run.state(n)).origin for n in range(len(run))]
    place = run.every("body_position")[:, run.bodies.index("drifter"), 0]
    moved = np.array([x for x, _, _ in corners]) + 0.4
    assert moved[-1] >= 0.3
    assert np.abs(place - moved).max() < 0.025 + 0.06
    assert np.array_equal(run.history["window_x_m"], [x for x, _, _ in corners[1:]])
    assert {y for _, y, _ in corners} == {-0.4}
    assert run.grid is not None
    assert run.grid.origin[0] == -0.4


def test_a_resumed_run_gives_the_same_bits(folder: Path) -> None:
    drift = scene(folder, follow="bodies")
    run(drift, folder / "whole")
    run(drift, folder / "parts", frames=6)
    run(drift, folder / "parts", frames=12, resume=True)
    assert numbers(folder / "whole") == numbers(folder / "parts")


def notes(drift: fb.Scene) -> list[str]:
    return list(window_notes(drift))


def test_what_a_domain_leaves_behind_is_said(folder: Path) -> None:
    assert not notes(scene(folder))
    assert notes(scene(folder, follow="bodies")) == [
        "[domain]: it follows bodies, and vortices and dye that it leaves behind are lost"
    ]
    drift = scene(folder, follow="drifter", along=["x"])
    assert notes(drift)[0].startswith("[domain]: it follows drifter along x, and")
    (folder / "drift.toml").write_text(
        (folder / "drift.toml").read_text()
        + '[[dye]]\nkind = "box"\nlower = [-0.1, 0.2]\nupper = [0.1, 0.3]\n'
    )
    _, kept = notes(fb.load_scene(folder / "drift.toml"))
    assert kept == "[domain]: [[dye]] 1 stays in place, and acts only while the domain is there"


def test_dye_in_a_stream_goes_along_unless_the_side_moves_across_it(folder: Path) -> None:
    """Bands through x_min have places in y."""
    stream = {**SEA, "x_min": {"kind": "inflow", "velocity": [0.1, 0.0]}}
    bands = '[[dye]]\nkind = "bands"\nside = "x_min"\ncount = 3\nwidth = 0.05\n'
    for along, expected in ((["x"], 1), (["x", "y"], 2)):
        scene(folder, follow="bodies", along=along, sides=stream)
        drift = folder / "drift.toml"
        drift.write_text(drift.read_text() + bands)
        assert len(notes(fb.load_scene(drift))) == expected


def test_a_body_ahead_of_the_domain_is_not_called_lost(folder: Path) -> None:
    (folder / "drifter.xml").write_text(DRIFTER.replace('"0.3 0.3 0"', '"0.8 0.2 0"'))
    for along, lost in ((["x"], False), (["y"], True)):
        drift = scene(folder, follow="drifter", along=along)
        setup = fb.Simulation(drift).world.setup
        assert any(fixed_outside(drift, setup)) == lost


@pytest.mark.usefixtures("shared_processes")
def test_worker_processes_give_the_same_bits_as_the_window_moves() -> None:
    sea = fb.load_scene(
        "eel-sea", {"domain.resolution": "45", "initial.velocities": "{ head_y = 0.5 }"}
    )
    worlds = []
    for executor in ("serial", "processes"):
        with fb.Simulation(sea, workers=2, executor=executor) as simulation:
            for _ in range(12):
                report = simulation.advance_frame()
                assert report.step.momentum_budget_error < 1e-11
            worlds.append(simulation.world)
    first, second = (world.arrays() for world in worlds)
    assert first["grid/origin"][1] > sea.domain.lower[1] + 1e-3
    assert all(np.array_equal(second[name], values) for name, values in first.items())


@pytest.mark.parametrize(
    ("domain", "said"),
    [
        ({"follow": "tail"}, "body 'tail' is not in model"),
        ({"follow": "post"}, "body 'post' does not move"),
        ({"along": ["x"]}, "the domain follows nothing"),
        ({"follow": "bodies", "along": ["z"]}, "has no z"),
        (
            {"follow": "bodies", "sides": {**SEA, "y_min": "closed"}},
            r'y_min: the domain follows bodies along y.*or give \[domain\] along = \["x"\]',
        ),
        (
            {"follow": "bodies", "along": ["y"], "sides": {**SEA, "y_min": "closed"}},
            "Make the side far, open or inflow[.]",
        ),
        (
            {
                "follow": "bodies",
                "sides": {
                    **SEA,
                    "x_min": {"kind": "inflow", "velocity": [1.0, 0.0], "profile": "parabolic"},
                },
            },
            r'x_min: its profile is 0 at the edges of the side, which move along y.*"uniform"',
        ),
    ],
)
def test_what_cannot_be_followed_is_said(folder: Path, domain: Any, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        scene(folder, **domain)

"""A domain that follows bodies, in scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flowborne as fb
from flowborne.errors import SceneError

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


def scene(folder: Path, **domain: Any) -> fb.Scene:
    path = folder / "drift.toml"
    table = {"lower": [-0.4, -0.4], "upper": [0.4, 0.4], "resolution": 32, **domain}
    sides = table.pop("sides", SEA)
    lines = ["dimensions = 2", "[time]", "frames_per_second = 20.0", "frames = 12"]
    lines += ["[solids]", 'model = "drifter.xml"', "[initial]", "velocities = { x = 1.0 }"]
    for name, keys in (("domain", table), ("boundaries", sides)):
        lines += [f"[{name}]"]
        lines += [
            f"{key} = " + (f'"{value}"' if isinstance(value, str) else str(list(value)))
            if not isinstance(value, int)
            else f"{key} = {value}"
            for key, value in keys.items()
        ]
    path.write_text("\n".join([*lines, "[fluid]"]))
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
    ],
)
def test_what_cannot_be_followed_is_said(folder: Path, domain: Any, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        scene(folder, **domain)

"""Runs in three dimensions, made by the engine or by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import flowborne
from flowborne.fluid.grid import Grid
from flowborne.shapes.primitives import shape_of
from flowborne.view.run import Geom, Run
from flowborne.view.shot import Shot

MODEL = """
<mujoco>
  <asset><mesh name="fin" vertex="0 0 0  .5 0 0  0 .3 0  0 0 .4"/></asset>
  <worldbody>
    <geom type="plane" size="5 5 .1"/>
    <geom name="post" type="box" size=".08 .08 .5" pos="-.6 0 .5"/>
    <body name="arm" pos="-.6 0 1.05">
      <joint name="swing" type="hinge" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 .5 0 0" size=".07"/>
      <body name="hand" pos=".5 0 0">
        <joint name="wrist" type="ball"/>
        <geom type="ellipsoid" size=".16 .1 .05" pos=".16 0 0"/>
      </body>
    </body>
    <body name="ball" pos=".3 -.5 .3">
      <freejoint/><geom type="sphere" size=".14" rgba=".2 .6 .9 1"/>
    </body>
    <body name="can" pos=".5 .3 .4" euler="60 0 20">
      <freejoint/><geom type="cylinder" size=".12 .2"/>
    </body>
    <body name="fin" pos=".1 .2 .8"><freejoint/><geom type="mesh" mesh="fin"/></body>
  </worldbody>
</mujoco>
"""

SCENE = """
name = "things"
dimensions = 3
gravity = [0.0, 0.0, -9.81]

[time]
frames_per_second = 24.0
frames = 5
steps_per_frame = 2

[solids]
model = "things.xml"
density = 300.0

[[wind]]
kind = "faces"
velocity = [4.0, 1.0, 0.0]

[[control]]
joints = ["swing"]
strength = 60.0
probe = 5.0

[[objectives]]
kind = "wind-drag"
goal = "least"
direction = [1.0, 0.0, 0.0]
bodies = ["arm"]
"""


@pytest.fixture(scope="session")
def scene_of_things(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scene with a body of every kind, a hinge that is controlled, a ball joint and free bodies."""
    folder = tmp_path_factory.mktemp("scene")
    (folder / "things.xml").write_text(MODEL)
    (folder / "things.toml").write_text(SCENE)
    return folder / "things.toml"


@pytest.fixture(scope="session")
def things(scene_of_things: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run of that scene, without pictures. Not to be written into."""
    folder = tmp_path_factory.mktemp("runs") / "things"
    flowborne.run(scene_of_things, folder, workers=1, film=False)
    return folder


@pytest.fixture
def run_of(tmp_path: Path) -> Callable[..., Run]:
    """Makes a run of spheres and other geometries that move as options."""

    def make(
        geoms: list[tuple[str, tuple[float, float, float]]],
        centres: np.ndarray,
        *,
        accented: tuple[int, ...] = (),
        force: tuple[float, float, float] = (0.0, 0.0, 0.0),
        origins: np.ndarray | None = None,
        **options: object,
    ) -> Run:
        """`centres` (frames, n, 3) of the geometries, each of a body of its own.

        origins  (frames, 3) of a grid that follows them
        """
        frames, count = np.shape(centres)[:2]
        paths = []
        for frame, places in enumerate(np.asarray(centres, np.float32)):
            bodies = np.concatenate([np.zeros((1, 3), np.float32), places])
            forces = np.zeros_like(bodies)
            forces[1:] = force
            path = tmp_path / f"{frame:06d}.npz"
            np.savez(
                path,
                time=np.array(frame / 24.0),
                geom_position=places,
                geom_rotation=np.broadcast_to(np.eye(3, dtype=np.float32), (count, 3, 3)),
                fluid_centre=bodies,
                fluid_force=forces,
                **({} if origins is None else {"grid_origin": origins[frame]}),
            )
            paths.append(path)
        plain = np.array([0.5, 0.5, 0.5, 1.0])
        values: dict[str, object] = {
            "name": "made up",
            "tables": {},
            "bodies": ("world", *(f"body {n}" for n in range(count))),
            "accented": frozenset(accented),
            "controlled": (),
            "grid": None,
            "is_slab": False,
            "density": 0.0,
            "gravity": np.zeros(3),
            "geoms": tuple(
                Geom(shape_of(kind, np.array(size), None), n + 1, plain)
                for n, (kind, size) in enumerate(geoms)
            ),
            "frames_per_second": 24.0,
            "wind": np.zeros((0, 3)),
            "shot": Shot(field="none"),
            "history": {"frame": np.arange(1.0, frames), "time_s": np.arange(1.0, frames) / 24.0},
            "flesh": None,
            "carried": (),
            "sources": np.zeros((0, 2, 3)),
            "_states": tuple(paths),
            "frames": tuple(range(frames)),
        }
        if origins is not None:
            values["tables"] = {"domain": {"follow": "bodies"}}
        run = Run.__new__(Run)
        vars(run).update(values | options)
        return run

    return make


@pytest.fixture
def box_of_fluid() -> Grid:
    """Small grid of a fluid about the origin."""
    return Grid((12, 10, 8), 0.2, (-1.2, -1.0, -0.8))

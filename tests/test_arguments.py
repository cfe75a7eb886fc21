"""Wrong arguments of public functions: one message each, of flowborne's own, and no change."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flowborne as fb
from flowborne.coupling.stream import flow_at
from flowborne.worlds import Boundaries, BoundaryPeriodic, set_velocity
from fuzz_bases import bases

NAN, INF = float("nan"), float("inf")

WRONG: dict[str, Any] = {
    "nothing": None,
    "nan": NAN,
    "infinity": INF,
    "negative": -1,
    "zero": 0,
    "half": 1.5,
    "a huge whole number": 10**30,
    "a huge number": 1e300,
    "text": "x",
    "no text": "",
    "a list": [1],
    "an empty list": [],
    "a dict": {"a": 1},
    "an empty dict": {},
    "an array": np.ones((2, 2)),
    "nans": np.full(3, NAN),
    "objects": np.array([None, 1], dtype=object),
    "an object": object(),
    "true": True,
    "bytes": b"x",
    "complex": 1j,
    "half a letter": "\ud800",
    "no path": "a\0b",
    "a long name": "y" * 5000,
    "a type": int,
}

BODY = '<mujoco><worldbody><body name="b"><freejoint/><geom size=".1"/></body></worldbody></mujoco>'
GRID = fb.Grid.slab(8, 8, 0.125, (-0.5, -0.5))


class Given:
    """A scene without a fluid and one with, at the same moment for every call."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for base in ("pendulum", "slab"):
            (folder / base).mkdir()
            for name, content in bases()[base].items():
                (folder / base / name).write_bytes(content)
        self.scene = folder / "pendulum" / "scene.toml"
        self.dry, self.wet = fb.Simulation(self.scene), fb.Simulation(folder / "slab/scene.toml")
        for simulation in (self.dry, self.wet):
            simulation.advance_frame()
        self.moments = self.dry.snapshot(), self.wet.snapshot()
        fb.run(self.scene, folder / "run", film=False)
        self.run = fb.open_run(folder / "run")

    def go_back(self) -> None:
        self.dry.restore(self.moments[0], [])
        self.wet.restore(self.moments[1], [])


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Given:
    return Given(tmp_path_factory.mktemp("arguments"))


def changed(simulation: fb.Simulation, values: Any, over: Any = 0.0) -> None:
    simulation.change(values, over)
    simulation.advance_frame()


CALLS: dict[str, Callable[[Given, Any], Any]] = {
    "commands": lambda g, v: g.dry.advance_frame(v),
    "command": lambda g, v: g.dry.advance_frame({"hinge": v}),
    "torque": lambda g, v: g.dry.advance_frame({"hinge": fb.Torque(v)}),
    "then": lambda g, v: g.dry.advance_frame({"hinge": fb.Position(0.1, v)}),
    "ball": lambda g, v: g.dry.advance_frame({"wrist": fb.Position(v)}),
    "force": lambda g, v: g.wet.advance_frame({"f": fb.Force("block", v)}),
    "force's body": lambda g, v: g.dry.advance_frame({"f": fb.Force(v, (1.0, 0.0, 0.0))}),
    "force's frame": lambda g, v: g.dry.advance_frame({"f": fb.Force("arm", frame=v)}),
    "changes": lambda g, v: changed(g.dry, v),
    "change": lambda g, v: changed(g.dry, {"wind.0.velocity": v}),
    "changed table": lambda g, v: changed(g.dry, {"wind": v}),
    "over": lambda g, v: changed(g.dry, {"control.0.strength": 20.0}, v),
    "snapshot": lambda g, v: g.dry.restore(v),
    "changes of a snapshot": lambda g, v: g.dry.restore(g.moments[0], v),
    "points": lambda g, v: g.wet.flow_at("block", v),
    "body": lambda g, v: g.dry.body(v),
    "joint": lambda g, v: g.dry.joint(v),
    "actuator": lambda g, v: g.dry.actuator(v),
    "sensor": lambda g, v: g.dry.sensor(v),
    "scene": lambda g, v: fb.Simulation(v),
    "workers": lambda g, v: fb.Simulation(g.scene, workers=v),
    "executor": lambda g, v: fb.Simulation(g.scene, executor=v),
    "name": lambda g, v: fb.load_scene(v),
    "overrides": lambda g, v: fb.load_scene(g.scene, v),
    "override": lambda g, v: fb.load_scene(g.scene, {"time.frames": v}),
    "frames": lambda g, v: fb.run(g.scene, g.folder / "run", frames=v, resume=True, film=False),
    "out": lambda g, v: fb.run(g.scene, v, resume=True, film=False),
    "progress": lambda g, v: fb.run(g.scene, g.folder, progress=v),
    "folder": lambda g, v: fb.open_run(v),
    "state": lambda g, v: g.run.state(v),
    "plot": lambda g, v: g.run.plot(v),
    "film": lambda g, v: g.run.film("x" if v is None else v),
    "view": lambda g, v: fb.view(v),
    "port": lambda g, v: fb.view(g.folder, v),
    "checked": lambda g, v: fb.check(v),
    "every": lambda g, v: g.run.every(v),
    "export's run": lambda g, v: fb.export(v, "a.csv"),
    "export's parameters": lambda g, v: fb.export(g.folder / "run", g.folder / "a.glb", v),
    "file": lambda g, v: fb.import_character(v, g.folder),
    "density of a character": lambda g, v: fb.import_character("a.glb", g.folder, density=v),
    "study": lambda g, v: fb.study(v, g.folder),
    "clips": lambda g, v: fb.run_clips(g.scene, v),
    "steps": lambda g, v: fb.error_bar(g.scene, "time_s", steps=v),
    "measure": lambda g, v: fb.error_bar(g.scene, v, steps=(2, 4), frames=1),
    "model": lambda g, v: fb.make_world(v),
    "grid": lambda g, v: fb.make_world(BODY, v),
    "gravity": lambda g, v: fb.make_world(BODY, gravity=v),
    "solid density": lambda g, v: fb.make_world(BODY, solid_density=v),
    "density": lambda g, v: fb.make_world(BODY, GRID, density=v),
    "viscosity": lambda g, v: fb.make_world(BODY, GRID, viscosity=v),
    "tolerance": lambda g, v: fb.make_world(BODY, GRID, tolerance=v),
    "boundaries": lambda g, v: fb.make_world(BODY, GRID, boundaries=v),
    "sources": lambda g, v: fb.make_world(BODY, GRID, sources=v),
    "mouths": lambda g, v: fb.Setup(g.dry.setup.solid, mouths=v),
    "scalars": lambda g, v: fb.make_world(BODY, GRID, scalars=v),
    "winds": lambda g, v: fb.make_world(BODY, winds=v),
    "shape": lambda g, v: fb.Grid(v, 0.1),
    "spacing": lambda g, v: fb.Grid((8, 8, 1), v),
    "spacing of a slab": lambda g, v: fb.Grid.slab(8, 8, v, (0.0, 0.0)),
    "origin": lambda g, v: fb.Grid.slab(8, 8, 0.1, v),
    "axis": lambda g, v: GRID.moved(v, 1),
    "world": lambda g, v: fb.advance(v, 0.01),
    "dt": lambda g, v: fb.step(fb.make_world(BODY), v),
    "steps of a world": lambda g, v: fb.advance(fb.make_world(BODY), 0.01, v),
    "text": lambda g, v: fb.SolidModel.from_string(v),
    "path": lambda g, v: fb.SolidModel.from_file(v),
    "dofs": lambda g, v: g.dry.setup.solid.dofs_of(v),
    "positions": lambda g, v: g.dry.setup.solid.integrate(v, np.zeros(5), 1.0),
    "setup": lambda g, v: fb.Setup(v),
    "at rest": lambda g, v: fb.World.at_rest(v),
    "young": lambda g, v: fb.Tissue(v, 0.3, 1000.0),
    "poisson": lambda g, v: fb.Tissue(1e4, v, 1000.0),
}

OWN = fb.SceneError, fb.RunFolderError, fb.PartError, fb.BlowUpError
PLAIN = ValueError, OSError, KeyError, ArithmeticError
SOURCE = str(Path(fb.__file__).parent)


def is_said(error: BaseException) -> bool:
    """Whether it is an error of flowborne's, or a plain one that its own line raises."""
    if isinstance(error, OWN):
        return not (isinstance(error, fb.BlowUpError) and error.fault) and " --" not in str(error)
    at = traceback.extract_tb(error.__traceback__)[-1]
    ours = at.filename.startswith(SOURCE) and (at.line or "").startswith("raise")
    return ours and isinstance(error, PLAIN)


@pytest.mark.parametrize("call", CALLS)
def test_wrong_arguments_are_refused_in_a_message_of_flowbornes(given: Given, call: str) -> None:
    refused: dict[str, Exception] = {}
    for kind, value in WRONG.items():
        try:
            CALLS[call](given, value)
        except Exception as error:
            refused[kind] = error
        given.go_back()
    assert [(kind, error) for kind, error in refused.items() if not is_said(error)] == []
    assert len(refused) >= len(WRONG) // 2


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda g: g.dry.advance_frame([1]), r"commands is \[1\]; give a dict"),
        (lambda g: g.dry.change("fluid.density", 3), "values is 'fluid.density'; give a dict"),
        (lambda g: g.dry.change({"wind.0": 1}, over=-1), "over is -1; give a finite number of 0"),
        (lambda g: g.dry.restore(g.moments[1]), "of another scene than scene: its joints are"),
        (lambda g: fb.run(g.scene, "a", frames=NAN), "frames is nan; give a whole number from 1"),
        (lambda g: fb.Simulation(g.scene, workers=1.5), "workers is 1.5; give a whole number"),
        (lambda g: g.wet.flow_at("block", [[0, 0]]), r"points is .*; give \(n, 3\) finite numbers"),
        (lambda g: g.wet.flow_at("block", [99.0, 0, 0]), r"point 1 of 1 is at x = .*, outside"),
        (lambda g: g.run.state(99), r"no state 99; give 0 to 3"),
    ],
)
def test_messages_name_the_argument_and_what_to_give(
    given: Given, call: Callable[[Given], Any], message: str
) -> None:
    with pytest.raises(fb.SceneError, match=message):
        call(given)


def test_arrays_and_numbers_of_numpy_are_as_good_as_lists(given: Given) -> None:
    places = []
    for velocity in ([1.0, 2.0, 3.0], np.array([1.0, 2.0, 3.0])):
        given.dry.change({"wind.0.velocity": velocity}, over=np.float64(0.1))
        given.dry.advance_frame()
        given.dry.advance_frame()
        places.append(given.dry.world.solid.q)
        given.go_back()
    np.testing.assert_array_equal(*places)
    assert not np.array_equal(places[0], given.moments[0].world.solid.q)


def test_a_point_beyond_a_periodic_side_is_where_its_image_is() -> None:
    side = BoundaryPeriodic()
    around = Boundaries(side, side, side, side, side, side)
    world = fb.make_world("<mujoco/>", GRID, boundaries=around)
    set_velocity(world, lambda x, y, z: (np.sin(2 * np.pi * x), 0 * x, 0 * x))
    inside, beyond = (flow_at(world, np.array([[x, 0.1, 0.0]])).velocity for x in (-0.2, 1.8))
    np.testing.assert_allclose(beyond, inside, atol=1e-12)
    assert abs(inside[0, 0]) > 0.5

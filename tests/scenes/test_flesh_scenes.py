"""Flesh of a user's scene: its tables, its messages, and the mesh that its run folder keeps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flowborne.runs.run_folder import RunFolder
from flowborne.scenes import flesh as flesh_room
from flowborne.scenes.build import build
from flowborne.scenes.load import check_scene, load_scene
from flowborne.scenes.save import scene_files, scene_to_resume, write_scene
from flowborne.scenes.warn import stale_meshes
from flowborne.sim.running import run
from flowborne.sim.simulation import BlowUpError, Simulation
from flowborne.solids.flesh import inversion
from flowborne.solids.tissue.mesh import FleshMesh
from flowborne.solids.tissue.mesh_file import mesh_bytes
from flowborne_validation.flesh_bars import bar_mesh, flat_mesh

MODEL = """<mujoco><default><joint damping="3" limited="true" range="-1 1"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".08" contype="0" conaffinity="0"/></default>
<worldbody><body name="upper"><freejoint name="root"/><geom name="upper"/>
<body name="lower" pos=".3 0 0"><joint name="elbow" type="hinge" axis="0 1 0" range="-90 90"/>
<geom name="lower"/></body></body></worldbody></mujoco>"""

SCENE = """
figure = "none"
[time]
frames = 2
[domain]
lower = [-0.6, -0.6, -0.6]
upper = [1.2, 0.6, 0.6]
resolution = 18
[boundaries]
z_max = "open"
[solids]
model = "arm.xml"
[[flesh]]
name = "arm"
bones = ["upper", "lower"]
thickness = 0.08
size = 0.16
young = 1e5
[initial.positions]
elbow = 20.0
[[motion]]
kind = "sinusoid"
joint = "elbow"
amplitude = 20.0
period = 1.0
"""

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """The scene with some of its text replaced."""
    (tmp_path / "arm.xml").write_text(MODEL)

    def written(*changes: tuple[str, str]) -> Path:
        text = SCENE.replace("[initial.positions]\nelbow = 20.0\n", "")
        for before, after in changes:
            assert before in text
            text = text.replace(before, after)
        path = tmp_path / "scene.toml"
        path.write_text(text)
        return path

    return written


@pytest.fixture(autouse=True)
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Bones of what is meshed during a test."""
    made: list[str] = []
    skin = flesh_room.skin_mesh

    def counting(spec, bones, *given):  # type: ignore[no-untyped-def]
        made.append(" ".join(bones))
        return skin(spec, bones, *given)

    monkeypatch.setattr(flesh_room, "skin_mesh", counting)
    return made


def test_flesh_grows_on_the_bones_once_and_starts_where_they_are(
    write: Write, counted: list[str]
) -> None:
    path = write(("period = 1.0", "period = 1.0\nphase = 90.0"))
    world = build(load_scene(path)).world
    model, flesh = world.setup.solid, world.setup.solid.flesh
    assert flesh is not None
    assert len(counted) <= 1
    assert model.body_names == ("world", "upper", "lower")
    assert model.geom_covered.all()
    assert world.solid.q[7] == pytest.approx(np.radians(20.0))
    assert inversion(flesh, world.solid.q) is None
    tip = flesh.rest[:, 0].argmax()
    sunk = flesh.vertices(world.solid.q)[tip] - flesh.rest[tip]
    assert sunk[2] == pytest.approx(
        -(flesh.rest[tip, 0] - 0.3) * np.sin(np.radians(20.0)), abs=0.03
    )


MESSAGES = {
    "no bone": (('bones = ["upper", "lower"]', 'bones = ["upper", "lowe"]'), "'lowe'"),
    "both": (("thickness = 0.08", 'thickness = 0.08\nsurface = "a.stl"'), "both a thickness and"),
    "neither": (("thickness = 0.08\n", ""), "neither a thickness nor a surface"),
    "no size": (("size = 0.16\n", ""), "no size of elements"),
    "no surface": (("thickness = 0.08", 'surface = "none.stl"'), "none.stl"),
    "two dimensions": (('figure = "none"', "dimensions = 2"), "meshed in 3 dimensions alone"),
    "outside": (("upper = [1.2, 0.6, 0.6]", "upper = [0.6, 0.6, 0.6]"), "outside the domain"),
}


@pytest.mark.parametrize("case", MESSAGES)
def test_wrong_flesh_is_told_with_its_place(write: Write, case: str) -> None:
    change, expected = MESSAGES[case]
    problems = check_scene(write(change))
    assert any(expected in problem for problem in problems), problems
    assert all("scene.toml" in problem for problem in problems)


def test_flesh_in_two_dimensions_is_a_mesh_of_triangles(write: Write, tmp_path: Path) -> None:
    points, elements = flat_mesh((8, 2), (0.3, 0.2))
    held = np.abs(points[:, 1]) < 0.05
    mesh = FleshMesh(points, elements, tuple("upper" if h else "" for h in held))
    (tmp_path / "fin.npz").write_bytes(mesh_bytes(mesh, ""))
    path = write(
        ('figure = "none"', "dimensions = 2"),
        ("lower = [-0.6, -0.6, -0.6]", "lower = [-0.6, -0.6]"),
        ("upper = [1.2, 0.6, 0.6]", "upper = [1.2, 0.6]"),
        ('z_max = "open"', 'y_max = "open"'),
        ('bones = ["upper", "lower"]\nthickness = 0.08\nsize = 0.16', FIN),
    )
    (tmp_path / "arm.xml").write_text(MODEL.replace('axis="0 1 0"', 'axis="0 0 1"'))
    world = build(load_scene(path)).world
    flesh = world.setup.solid.flesh
    assert flesh is not None
    assert flesh.elements.shape[1] == 6
    assert Simulation(load_scene(path)).advance_frame()
    tetrahedra = FleshMesh(*bar_mesh((2, 1, 1), (0.3, 0.2, 0.2)), ("upper",) * 12)
    (tmp_path / "fin.npz").write_bytes(mesh_bytes(tetrahedra, ""))
    assert any("triangles at z = 0" in problem for problem in check_scene(path))


FIN = 'bones = ["upper"]\nmesh = "fin.npz"'


def test_two_fleshes_have_names_and_one_damping(write: Write) -> None:
    another = (
        '[[flesh]]\nname = "arm"\nbones = ["upper"]\nthickness = 0.05\nsize = 0.1\nyoung = 1e5\n'
        "damping = 0.5\n[[motion]]"
    )
    problems = check_scene(write(("[[motion]]", another)))
    assert any("another flesh is called 'arm'" in problem for problem in problems)
    assert any("Give all flesh the same" in problem for problem in problems)


def test_a_run_folder_keeps_its_mesh(write: Write, tmp_path: Path, counted: list[str]) -> None:
    scene = load_scene(write())
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    files = scene_files(scene)
    assert set(files) == {"scene.toml", "arm.xml", "flesh-arm.npz"}
    write_scene(folder, files)
    rest = build(scene).world.setup.solid.flesh
    flesh_room._made.clear()
    counted.clear()
    again = load_scene(folder.scene)
    found = build(again).world.setup.solid.flesh
    assert counted == []
    assert rest is not None
    assert found is not None
    np.testing.assert_array_equal(found.rest, rest.rest)
    assert scene_files(again) == files
    # the user's scene, meshed anew, is still the same run
    assert scene_to_resume(folder, scene).flesh[0].mesh == "flesh-arm.npz"
    # and what is asked for otherwise is meshed otherwise
    other = load_scene(folder.scene, {"flesh.0.thickness": "0.09"})
    assert counted == ["upper lower"]
    assert scene_files(other)["flesh-arm.npz"] != files["flesh-arm.npz"]


NAMED = ("size = 0.16", 'size = 0.16\nmesh = "arm.npz"')

STALE = [
    (("size = 0.16", "size = 0.18"), "arm.npz was made with other size,"),
    (('mesh = "arm.npz"', 'mesh = "gone.npz"'), "gone.npz is missing,"),
    (("thickness = 0.08", "thickness = 0.09"), "arm.npz was made with other thickness,"),
]


def test_a_run_with_a_mesh_of_another_recipe_is_resumed_by_its_scene(
    write: Write, tmp_path: Path
) -> None:
    (tmp_path / "arm.npz").write_bytes(scene_files(load_scene(write()))["flesh-arm.npz"])
    fresh = load_scene(write(NAMED))
    setup = build(fresh).world.setup
    assert list(stale_meshes(fresh, setup)) == []
    for change, why in STALE:
        scene = write(NAMED, change)
        stale = load_scene(scene)
        (warning,) = stale_meshes(stale, setup)
        assert warning.startswith(f"[[flesh]] 1: {why} so that each process meshes the flesh anew")
    out = tmp_path / "run"
    run(scene, out, frames=1, film=False)
    kept = stale.flesh[0].kept_as
    mesh = (out / kept).read_bytes()
    flesh_room._made.clear()  # as in another process
    assert run(scene, out, frames=2, film=False, resume=True).frames == 2
    assert (out / kept).read_bytes() == mesh
    # and the remedy works
    (tmp_path / "new.npz").write_bytes(mesh)
    mended = load_scene(scene, {"flesh.0.mesh": "'new.npz'"})
    assert list(stale_meshes(mended, build(mended).world.setup)) == []


def test_torn_flesh_stops_a_run_with_its_place(write: Write) -> None:
    with Simulation(load_scene(write()), workers=1) as simulation:
        simulation.advance_frame()
        solid = simulation.world.solid
        solid.q[8:] += 0.1 * np.random.default_rng(1).standard_normal(solid.q.size - 8)
        with pytest.raises(
            BlowUpError,
            match=r"frame 2, step 1: \d+ of \d+ elements of flesh are inside out.*'arm'",
        ):
            simulation.advance_frame()
        assert simulation.frame == 1

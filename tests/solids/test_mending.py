"""Meshes with holes: small ones are closed, others refused at once or taken as hulls."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from flowborne.shapes.closing import is_closed
from flowborne.solids import mjcf
from flowborne.solids.geoms import mesh_of
from flowborne.solids.mending import joined_pairs, mended_meshes
from flowborne.solids.mjcf import Given, bones_of
from flowborne.solids.model import SolidModel

BALL = trimesh.creation.icosphere(4, 0.1)


def model_of(folder: Path, *meshes: trimesh.Trimesh) -> Path:
    """A model with a body b0, b1, ... for each mesh, of files."""
    assets, bodies = "", ""
    for n, mesh in enumerate(meshes):
        mesh.export(folder / f"m{n}.stl")
        assets += f'<mesh file="m{n}.stl" scale="2 2 2" refpos="0.01 0 0"/>'
        bodies += f'<body name="b{n}" pos="{n} 0 0" euler="10 20 30"><freejoint/>'
        bodies += f'<geom type="mesh" mesh="m{n}" pos="0.1 0.2 0.3" density="500"/></body>'
    path = folder / "model.xml"
    path.write_text(f"<mujoco><asset>{assets}</asset><worldbody>{bodies}</worldbody></mujoco>")
    return path


def without(mesh: trimesh.Trimesh, *faces: int) -> trimesh.Trimesh:
    kept = np.delete(mesh.faces, faces, axis=0)
    return trimesh.Trimesh(mesh.vertices, kept, process=False)


def cup() -> trimesh.Trimesh:
    return without(BALL, *np.flatnonzero(BALL.triangles_center[:, 2] > 0.05))


def test_a_small_hole_is_closed_and_the_body_stays_where_it_is(tmp_path: Path) -> None:
    inverted = trimesh.Trimesh(BALL.vertices, BALL.faces[:, ::-1], process=False)
    turned = BALL.faces.copy()
    turned[:9] = turned[:9, ::-1]
    unlike = trimesh.Trimesh(BALL.vertices, turned, process=False)
    whole = SolidModel.from_file(model_of(tmp_path, *[BALL] * 3))
    model = SolidModel.from_file(model_of(tmp_path, without(BALL, 7), inverted, unlike))
    np.testing.assert_allclose(model.volume, whole.volume, rtol=1e-3)
    np.testing.assert_allclose(model.body_mass, whole.body_mass, rtol=1e-3)
    np.testing.assert_allclose(model.centroid, whole.centroid, atol=1e-4)
    said = mended_meshes(model.mj)
    assert said.startswith("b0 (3 open edges) closed, b1 (inside out) closed, b2 (")
    assert mended_meshes(whole.mj) == ""


def test_wide_holes_are_named_at_once_by_body_and_hulls_taken_on_request(tmp_path: Path) -> None:
    open_one = cup()
    path = model_of(tmp_path, open_one, BALL, open_one)
    with pytest.raises(ValueError, match=r"of b0 \(\d+ open edges\), b2 \(") as raised:
        SolidModel.from_file(path)
    assert 'mend = "hull"' in str(raised.value)
    whole = trimesh.convex.convex_hull(open_one.triangles.reshape(-1, 3))
    model = SolidModel.from_file(path, given=Given(hulls=True))
    assert model.volume[1] == pytest.approx(8.0 * whole.volume, rel=1e-4)
    assert model.body_mass[1] == pytest.approx(500.0 * model.volume[1], rel=1e-4)
    mesh = mesh_of(model.mj, 0)
    assert mesh is not None
    assert is_closed(mesh)
    assert "b0 (" in mended_meshes(model.mj)


def test_a_mesh_that_two_bodies_have_is_mended_once(tmp_path: Path) -> None:
    path = model_of(tmp_path, without(BALL, 7))
    text = path.read_text()
    start, stop = text.index("<body"), text.index("</worldbody>")
    second = text[start:stop].replace('name="b0" pos="0', 'name="b1" pos="1')
    path.write_text(text[:stop] + second + text[stop:])
    mj = mjcf.bones_of(path, False, (0.0, 0.0, 0.0))[1]
    assert mended_meshes(mj) == "b0 (3 open edges) closed"
    assert len(set(mj.geom_dataid)) == 1


MODEL = """<mujoco><worldbody>{floor}
<body name="trunk" pos="0 0 1">{root}<geom type="box" size=".2 .1 .1"/>
 <body name="hip" pos=".2 0 0">{joint}<geom type="box" size=".1 .05 .05"/>
  <body name="shank" pos=".1 0 0"><joint/><geom type="capsule" size=".03 .1"/></body></body></body>
</worldbody></mujoco>"""

HINGE, FREE = '<joint type="hinge" axis="0 1 0"/>', "<freejoint/>"


def model(joint: str = HINGE, root: str = "", floor: str = "") -> mujoco.MjModel:
    return bones_of(MODEL.format(joint=joint, root=root, floor=floor), False, (0.0, 0.0, 0.0))[1]


def test_a_hip_within_its_fixed_trunk_stays_at_rest() -> None:
    mj = model()
    assert joined_pairs(mj) == ["trunk and hip"]
    data = mujoco.MjData(mj)
    mujoco.mj_step(mj, data, 50)
    np.testing.assert_allclose(data.qpos, 0.0, atol=1e-12)


def test_bodies_without_a_name_are_called_by_their_numbers() -> None:
    text = MODEL.replace(' name="trunk"', "").replace(' name="hip"', "")
    mj = bones_of(text.format(joint=HINGE, root="", floor=""), False, (0.0, 0.0, 0.0))[1]
    assert joined_pairs(mj) == ["body1 and body2"]


@pytest.mark.parametrize(
    "given",
    [
        {"root": FREE},  # MuJoCo leaves the pair out itself
        {"joint": '<joint type="slide" axis="0 0 1"/>'},  # what lies on it may slide
        {"joint": HINGE + '<joint type="slide" axis="1 0 0"/>'},
    ],
)
def test_no_other_pair_is_left_out(given: dict[str, str]) -> None:
    assert joined_pairs(model(**given)) == []


def test_a_leg_still_meets_the_floor_of_the_world() -> None:
    """A base whose geoms are the world's own, beside a plane: MuJoCo cannot leave out one alone."""
    text = MODEL.replace('<body name="trunk" pos="0 0 1">{root}', "").replace(
        "</body></body></body>", "</body></body>"
    )
    assert joined_pairs(bones_of(text.format(joint=HINGE, floor=""), False, (0.0,) * 3)[1]) == [
        "world and hip"
    ]
    floor = '<geom type="plane" size="1 1 1" pos="0 0 -1"/>'
    assert joined_pairs(bones_of(text.format(joint=HINGE, floor=floor), False, (0.0,) * 3)[1]) == []

"""Closed pieces of a surface for the joints that become bodies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from flowborne.base.errors import SceneError
from flowborne.characters.division import MIN_VOLUME, WELD_DISTANCE, divided
from flowborne.characters.model import model_files
from flowborne.characters.rig import Rig, Surface
from flowborne.characters.source import read_source
from flowborne.shapes.closing import is_closed
from flowborne.shapes.mesh import ShapeMesh

from . import rigged

GREY = np.full((len(rigged.box()[1]), 3), 0.5)

CREATURES = Path(__file__).parents[3] / "shared" / "creatures"


def rig(parents: tuple[int, ...] = rigged.PARENTS) -> Rig:
    count = len(parents)
    names = tuple(f"joint_{n}" for n in range(count))
    frames = np.tile(np.eye(3), (count, 1, 1))
    return Rig(names, np.array(parents), np.zeros((count, 3)), frames)


def volumes(surface: Surface, skeleton: Rig, fill: bool = False) -> dict[int, float]:
    """Joint that moves -> volume of its piece, which is closed."""
    division = divided(skeleton, surface, "box.glb", fill)
    for piece in (*division.pieces.values(), *division.shapes.values()):
        assert not len(piece[1]) or is_closed(piece)
    return {
        joint: ShapeMesh(*piece).volume if len(piece[1]) else 0.0
        for joint, piece in division.pieces.items()
    }


def test_pieces_end_where_the_weights_are_even() -> None:
    """The handle goes with the trunk and the tip with the tail."""
    vertices, faces, weights = rigged.box()
    division = divided(rig(), Surface(vertices, faces, weights / 0.8, GREY), "box.glb")
    section = rigged.WIDTH * rigged.HEIGHT
    assert division.owners.tolist() == [0, 0, 2, 2]
    assert division.leader == 1
    assert division.volume == pytest.approx(section * rigged.LENGTH, rel=1e-9)
    found = volumes(Surface(vertices, faces, weights / 0.8, GREY), rig())
    assert found[0] == pytest.approx(section * rigged.JOINT, rel=1e-5)
    assert found[2] == pytest.approx(section * (rigged.LENGTH - rigged.JOINT), rel=1e-5)
    low = division.pieces[2][0][:, 2].max()
    assert low == pytest.approx(-rigged.JOINT, abs=1e-5)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_pieces_fill_the_whole_whatever_the_weights(seed: int) -> None:
    """Many joints meet at a point, weights vanish, neighbours in the tree do not touch."""
    random = np.random.default_rng(seed)
    vertices, faces, _ = rigged.box()
    parents = (-1, *(int(random.integers(0, n)) for n in range(1, 6)))
    weights = random.random((len(vertices), 6)) ** 8 * (random.random((len(vertices), 6)) < 0.6)
    weights[:, 0] += 1e-3
    weights /= weights.sum(axis=1, keepdims=True)
    found = volumes(Surface(vertices, faces, weights, GREY), rig(parents))
    whole = rigged.WIDTH * rigged.HEIGHT * rigged.LENGTH
    assert sum(found.values()) == pytest.approx(whole, rel=100 * WELD_DISTANCE)


def test_no_crack_opens_at_a_joint_that_turns() -> None:
    """Places around it stay within one body or the other; masses are those of the plain pieces."""
    vertices, faces, weights = rigged.box()
    skeleton = replace(rig(), position=rigged.PLACES)
    division = divided(skeleton, Surface(vertices, faces, weights / 0.8, GREY), "box.glb")
    trunk, tail = division.shapes[0], division.shapes[2]
    assert is_closed(tail)
    assert trunk[1].shape == division.pieces[0][1].shape
    joint = np.array([0.0, 0.0, -rigged.JOINT])
    corner = 0.5 * np.hypot(rigged.WIDTH, rigged.HEIGHT)
    assert tail[0][:, 2].max() == pytest.approx(-rigged.JOINT + corner, abs=1e-5)
    around = np.random.default_rng(3).uniform(-1.0, 1.0, (500, 3))
    around = joint + 0.9 * 0.5 * rigged.HEIGHT * around / np.linalg.norm(around, axis=1)[:, None]
    for angle in (-30.0, 15.0, 30.0):
        turn = Rotation.from_euler("x", angle, True).as_matrix()
        turned = ShapeMesh(joint + (tail[0] - joint) @ turn.T, tail[1])
        apart = np.minimum(ShapeMesh(*trunk).distance(around), turned.distance(around))
        assert apart.max() < 1e-3


def test_surface_with_a_hole_is_refused() -> None:
    vertices, faces, weights = rigged.box()
    end = Surface(vertices, faces[2:], weights / 0.8, GREY[2:])
    said = r"box\.glb: .* watertight: 4 edges .*: 1, the widest 0\.5 m .* by fill=True, or"
    with pytest.raises(SceneError, match=said):
        divided(rig(), end, "box.glb")
    division = divided(rig(), end, "box.glb", fill=True)
    assert division.filled == (pytest.approx(0.5),)
    whole = rigged.WIDTH * rigged.HEIGHT * rigged.LENGTH
    assert sum(volumes(end, rig(), fill=True).values()) == pytest.approx(whole, rel=1e-9)
    inward = Surface(vertices, end.faces[:, ::-1], weights / 0.8, GREY[2:])
    with pytest.raises(SceneError, match=r"0\.5 m across, at \(.*\) m\. Close them in Blender"):
        divided(rig(), inward, "box.glb")


def test_a_part_that_is_inside_out_is_refused_with_its_place() -> None:
    """A cavity in another part is none, nor is one that is too small for a body."""
    whole = trimesh.creation.box((1.0, 1.0, 1.0))

    def divide(size: float, away: float) -> float:
        other = trimesh.creation.box((size, size, size))
        other.apply_translation((away, 0.0, 0.0))
        faces = np.concatenate([whole.faces, other.faces[:, ::-1] + len(whole.vertices)])
        points = np.concatenate([whole.vertices, other.vertices])
        grey, weights = np.full((len(faces), 3), 0.5), np.ones((len(points), 1))
        return divided(rig((-1,)), Surface(points, faces, weights, grey), "two.glb").volume

    said = r"two\.glb: the mesh around \(2, 0, 0\) m, 0\.6 m long, is inside out\. Orient its faces"
    with pytest.raises(SceneError, match=said):
        divide(0.6, 2.0)
    assert divide(0.6, 0.1) == pytest.approx(1.0 - 0.6**3)
    assert divide(0.1, 2.0) == pytest.approx(1.0 - 0.1**3)


def test_small_holes_are_closed_and_triangles_wound_alike() -> None:
    """A ball with a triangle missing, and a tenth of the others turned over."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    faces = ball.faces[1:].copy()
    faces[::10] = faces[::10, ::-1]
    weights, colours = np.ones((len(ball.vertices), 1)), np.full((len(faces), 3), 0.5)
    division = divided(rig((-1,)), Surface(ball.vertices, faces, weights, colours), "ball.glb")
    (across,) = division.filled
    assert 0.0 < across < 0.1
    assert division.volume == pytest.approx(ball.volume, rel=1e-6)


def test_sheets_that_touch_along_an_edge_have_their_mass() -> None:
    """Two boxes with an edge in common, for which MuJoCo's own integrals refuse the mesh."""
    one, other = (trimesh.creation.box((1.0, 1.0, 1.0)) for _ in range(2))
    other.apply_translation((1.0, 1.0, 0.0))
    both = trimesh.util.concatenate(one, other)
    grey = np.full((len(both.faces), 3), 0.5)
    surface = Surface(both.vertices, both.faces, np.ones((len(both.vertices), 1)), grey)
    skeleton = rig((-1,))
    division = divided(skeleton, surface, "boxes.glb")
    files = model_files("boxes", skeleton, division, surface, 1000.0)
    text = {name: content for name, content in files.items() if not name.endswith("-skin.xml")}
    xml = text.pop("boxes.xml").replace(b'<include file="boxes-skin.xml" />', b"").decode()
    model = mujoco.MjModel.from_xml_string(xml, text)
    assert model.body_mass.sum() == pytest.approx(2000.0)
    assert_allclose(model.body_ipos[1], [0.5, 0.5, 0.0], atol=1e-9)


@pytest.mark.skipif(not CREATURES.is_dir(), reason="the creatures are beside the project")
@pytest.mark.parametrize("name", ["fish-whale.glb", "bird-eagle.glb"])
def test_creatures_are_divided_without_loss(name: str) -> None:
    source = read_source(CREATURES / name)
    assert source.surface is not None
    division = divided(source.rig, source.surface, name)
    parts = np.array([ShapeMesh(*piece).volume for piece in division.pieces.values()])
    assert parts.sum() == pytest.approx(division.volume, rel=1e-6)
    assert parts.min() > MIN_VOLUME * division.volume
    assert all(is_closed(piece) for piece in division.pieces.values())

"""A mesh is seen by the fluid as the primitive that it copies."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from flowborne import Grid, World
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    advance,
    cut_by_bodies,
    make_world,
    set_velocity,
)
from flowborne_validation.worlds import mjcf

from .meshes import mesh_asset

DENSITY = 1.0
BALL, CAPSULE = 4.0 / 3.0 * np.pi, 2.0 * np.pi * 0.25 * 0.7 + 4.0 / 3.0 * np.pi * 0.125


def of_volume(mesh: trimesh.Trimesh, volume: float) -> trimesh.Trimesh:
    """A mesh about the origin, blown up a little: what its sides cut off is made good."""
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh.apply_scale(np.cbrt(volume / mesh.volume))


COPIES = {
    "sphere": ('type="sphere" size="1"', of_volume(trimesh.creation.icosphere(4), BALL)),
    "box": ('type="box" size="0.8 0.5 1"', trimesh.creation.box((1.6, 1.0, 2.0))),
    "capsule": (
        'type="capsule" size="0.5 0.7"',
        of_volume(trimesh.creation.capsule(1.4, 0.5, count=[96, 96]), CAPSULE),
    ),
}
"""A primitive, 2 m long, and the mesh that copies it."""


def pair(name: str, grid: Grid, turn: Rotation, joint: str, **fluid: object) -> tuple[World, World]:
    """A world with the primitive, and one with the mesh."""
    geom, mesh = COPIES[name]
    a, b, c, w = turn.as_quat()
    body = f'<body quat="{w} {a} {b} {c}">{joint}<geom {{}}/></body>'
    asset = f"<asset>{mesh_asset('copy', mesh)}</asset>"
    plain = mjcf(body.format(geom))
    copied = mjcf(body.format('type="mesh" mesh="copy"'), options=asset)
    one, other = (make_world(m, grid, solid_density=0.01, **fluid) for m in (plain, copied))
    return one, other


def room(across: int) -> Grid:
    n, h = across + 14, 2.0 / across
    low = -0.5 * n * h + 0.3 * h
    return Grid((n, n, n), h, (low, low - 0.1 * h, low + 0.2 * h))


TURN = Rotation.from_euler("xyz", [0.3, -0.5, 0.9])


@pytest.mark.parametrize(
    ("name", "across", "apart"),
    [
        ("sphere", 8, 0.01),
        ("sphere", 16, 0.01),
        ("box", 8, 0.002),
        ("box", 16, 0.001),
        ("capsule", 8, 0.01),
        ("capsule", 16, 0.01),
    ],
)
def test_open_parts_of_faces_are_those_of_the_primitive(
    name: str, across: int, apart: float
) -> None:
    """But for what the mesh itself is off: root mean square over the faces that are cut."""
    cuts = [cut_by_bodies(world) for world in pair(name, room(across), TURN, "")]
    own, copied = (np.concatenate([o.ravel() for o in cut.open]) for cut in cuts)
    cut = (own > 0.0) & (own < 1.0)
    off = float(np.sqrt(np.square(copied - own)[cut].mean()))
    assert off < apart
    solid = [float((1.0 - c.volume / room(across).cell_volume).sum()) for c in cuts]
    assert solid[1] == pytest.approx(solid[0], rel=2e-3), off


@pytest.mark.parametrize(("name", "apart"), [("sphere", 2e-3), ("box", 1e-3), ("capsule", 1e-3)])
def test_added_mass_is_that_of_the_primitive(name: str, apart: float) -> None:
    """First acceleration of a body a hundredth as heavy as the fluid, 8 cells across."""
    found = []
    for world in pair(name, room(8), TURN, "<freejoint/>", gravity=(0.0, -1.0, 0.0)):
        advance(world, 1e-3)
        found.append(world.solid.v[1] / 1e-3)
    assert found[1] == pytest.approx(found[0], rel=apart)


def stream(x: np.ndarray, *_: object) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return 1.0 + 0.0 * x, 0.0 * x, 0.0 * x


@pytest.mark.parametrize(("name", "apart"), [("sphere", 1e-3), ("box", 1e-3), ("capsule", 3e-3)])
def test_drag_is_that_of_the_primitive(name: str, apart: float) -> None:
    """Re 40, a while after the start, 8 cells across."""
    sides = Boundaries(x_min=BoundaryInflow(stream), x_max=BoundaryOpen())
    found = []
    for world in pair(name, room(8), TURN, "", boundaries=sides, viscosity=0.05):
        set_velocity(world, stream)
        report = advance(world, 0.1, 8)
        found.append((report.pressure_wrench + report.viscous_wrench)[1, :3])
    assert np.linalg.norm(found[1] - found[0]) < apart * np.linalg.norm(found[0]), found

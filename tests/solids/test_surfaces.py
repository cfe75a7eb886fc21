"""Patches of the bodies' surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.solids.model import SolidModel
from flowborne.solids.surfaces import Patches, geom_boxes, surfaces


def patches(geom: str, slab: bool = False) -> tuple[SolidModel, Patches]:
    model = SolidModel.from_string(
        f"""<mujoco><asset><mesh name="m" vertex="0 0 0  2 0 0  0 2 0  0 0 2"/></asset><worldbody>
        <body><joint axis="0 0 1"/><geom {geom}/></body></worldbody></mujoco>""",
        slab=slab,
    )
    return model, surfaces(model)


@pytest.mark.parametrize(
    ("geom", "area", "accuracy"),
    [
        (
            'type="box" size=".1 .2 .4" pos="1 2 3" euler="10 20 30"',
            8 * (0.02 + 0.08 + 0.04),
            1e-13,
        ),
        ('type="sphere" size=".5"', np.pi, 9e-3),
        ('type="capsule" size=".2 .6"', 4 * np.pi * 0.2 * 0.8, 4e-3),
        ('type="cylinder" size=".2 .6"', 2 * np.pi * 0.04 + 4 * np.pi * 0.12, 3e-3),
        ('type="ellipsoid" size=".3 .3 .3"', 4 * np.pi * 0.09, 9e-3),
        ('type="mesh" mesh="m"', 6 + 2 * np.sqrt(3), 1e-6),
    ],
)
def test_closed_surface(geom: str, area: float, accuracy: float) -> None:
    """Total area; area vectors add to nothing; the divergence theorem gives the volume."""
    model, p = patches(geom)
    vector = p.area[:, None] * p.normal
    assert p.area.sum() == pytest.approx(area, rel=accuracy)
    np.testing.assert_allclose(vector.sum(axis=0), 0.0, atol=1e-12 * area)
    volume = (p.centre * vector).sum() / 3
    assert volume == pytest.approx(model.volume[1], rel=2.5 * accuracy)
    np.testing.assert_allclose(np.linalg.norm(p.normal, axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    ("geom", "length", "accuracy"),
    [
        ('type="box" size=".1 .4 .2" euler="0 0 25"', 2.0, 1e-13),
        ('type="capsule" fromto="0 0 0 .8 0 0" size=".1"', 1.6 + 0.2 * np.pi, 5e-4),
        ('type="cylinder" size=".3 1"', 0.6 * np.pi, 5e-4),
        ('type="sphere" size=".3"', 0.6 * np.pi, 5e-4),
        ('type="mesh" mesh="m" pos="0 0 -.5"', 2 + np.sqrt(2), 1e-5),
    ],
)
def test_closed_outline_in_a_slab(geom: str, length: float, accuracy: float) -> None:
    model, p = patches(geom, slab=True)
    vector = p.area[:, None] * p.normal
    if "mesh" not in geom:
        assert p.area.sum() == pytest.approx(length, rel=accuracy)
    np.testing.assert_allclose(vector.sum(axis=0), 0.0, atol=1e-10)
    assert (p.centre * vector).sum() / 2 == pytest.approx(model.volume[1], rel=3 * accuracy + 1e-3)
    np.testing.assert_allclose(p.normal[:, 2], 0.0, atol=1e-12)


@pytest.mark.parametrize("slab", [False, True])
def test_box_has_patches_no_longer_than_an_eighth(slab: bool) -> None:
    _, p = patches('type="box" size=".05 .4 .1"', slab)
    ends = p.centre[np.abs(p.normal[:, 0]) > 0.5]
    assert np.unique(ends[:, 1].round(9)).size == 8


def test_the_box_of_a_mesh_touches_it_however_it_is_turned() -> None:
    """MuJoCo turns a mesh to its principal axes, so that a box along these would be larger."""
    model, _ = patches('type="mesh" mesh="m"')
    low, high = geom_boxes(model, np.zeros(1))
    np.testing.assert_allclose([low[0], high[0]], [[0.0] * 3, [2.0] * 3], atol=1e-6)
    low, high = geom_boxes(model, np.array([0.5 * np.pi]))
    np.testing.assert_allclose([low[0], high[0]], [[-2.0, 0.0, 0.0], [0.0, 2.0, 2.0]], atol=1e-6)

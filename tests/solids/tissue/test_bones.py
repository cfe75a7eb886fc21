"""Bones as a signed distance, and the surface at some distance from them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from flowborne.shapes.closing import is_closed
from flowborne.solids.tissue.bones import bones_of, contour

MODEL = """<mujoco><asset><mesh name="die" vertex="-.1 -.1 -.1 .1 -.1 -.1 -.1 .1 -.1 .1 .1 -.1
-.1 -.1 .1 .1 -.1 .1 -.1 .1 .1 .1 .1 .1"/></asset><worldbody>
<body name="{name}" pos=".3 -.2 .1" euler="20 -30 40"><geom {geom}/></body>
<body name="air"/></worldbody></mujoco>"""

PLACE, GEOMS = (
    np.array([0.3, -0.2, 0.1]),
    {
        "sphere": 'type="sphere" size=".2"',
        "capsule": 'type="capsule" size=".1 .3"',
        "cylinder": 'type="cylinder" size=".1 .3"',
        "box": 'type="box" size=".1 .2 .3"',
        "ellipsoid": 'type="ellipsoid" size=".05 .2 .4"',
        "mesh": 'type="mesh" mesh="die"',
    },
)


def model(kind: str, name: str = "bone") -> mujoco.MjSpec:
    return mujoco.MjSpec.from_string(MODEL.format(geom=GEOMS[kind], name=name))


@pytest.mark.parametrize("kind", GEOMS)
def test_contour_is_closed_outward_and_at_its_distance(kind: str) -> None:
    bones = bones_of(model(kind), ["bone"])
    points, triangles = contour(bones, 0.06, 0.03)
    assert is_closed((points, triangles))
    assert np.abs(bones.distance(points) - 0.06).max() < 0.002


@pytest.mark.parametrize("kind", GEOMS)
def test_distance_grows_by_the_way_along_its_slope(kind: str) -> None:
    """The slope of a distance has length 1, and one goes down it to the surface."""
    bones = bones_of(model(kind), ["bone"])
    points = PLACE + np.random.default_rng(1).uniform(-0.6, 0.6, (400, 3))
    distance = bones.distance(points)
    points, distance = points[distance > 0.01], distance[distance > 0.01]
    step = 1e-5 * np.eye(3)
    slope = np.stack(
        [(bones.distance(points + s) - bones.distance(points - s)) / 2e-5 for s in step], axis=1
    )
    assert np.linalg.norm(slope, axis=1) == pytest.approx(1.0, abs=1e-6)
    assert bones.distance(points - distance[:, None] * slope) == pytest.approx(0.0, abs=1e-6)


def test_distance_within_an_ellipsoid_is_that_to_the_nearest_surface() -> None:
    bones = bones_of(model("ellipsoid"), ["bone"])
    assert bones.distance(PLACE[None]) == pytest.approx(-0.05, abs=1e-6)


def test_unknown_and_bare_bones_are_refused() -> None:
    with pytest.raises(ValueError, match="there is no body 'bome'; did you mean 'bone'"):
        bones_of(model("box"), ["bome"])
    with pytest.raises(ValueError, match="body 'air' has no geom for flesh to grow on"):
        bones_of(model("box"), ["bone", "air"])

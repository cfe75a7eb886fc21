"""Where bodies overlap, or reach into a side, no cell empties itself through a sliver of a face."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Grid, World
from flowborne.bodies import TrajectorySinusoid, kinematics
from flowborne.coupling.cut import volumes_of
from flowborne.coupling.operators import twists
from flowborne.fluid.projection import accelerated, face_weights
from flowborne.kernels.closed_fractions import CREASE
from flowborne.worlds import advance, cut_by_bodies, make_world
from flowborne_validation.swimmers import BOX, LINK, PERIOD, swimmer
from flowborne_validation.worlds import mjcf


def fastest_end(world: World) -> float:
    """Largest speed of an end of a link, m/s."""
    pose = kinematics(world.setup.solid, world.solid.q)
    twist = twists(pose, world.solid.v)[1:]
    ends = pose.body_position[1:], pose.body_position[1:] + LINK * pose.body_rotation[1:, :, 0]
    velocity = [twist[:, :3] + np.cross(twist[:, 3:], end) for end in ends]
    return float(np.linalg.norm(velocity, axis=-1).max())


@pytest.mark.parametrize(
    ("links", "cells", "offset"),
    [
        (2, 80, (0.040, 0.529)),
        (6, 80, (0.459, 0.062)),
        (6, 64, (0.260, 0.840)),
        (6, 64, (0.148, 0.820)),
    ],
)
def test_fluid_at_the_joints_of_a_swimmer_is_about_as_fast_as_its_links(
    links: int, cells: int, offset: tuple[float, float]
) -> None:
    """A period of a swimmer whose links overlap at their hinges; offset in cells."""
    gait = tuple(
        TrajectorySinusoid(np.array([6 + k]), 0.8, PERIOD, 0.0, 1.6 * k) for k in range(links - 1)
    )
    world = swimmer(cells, gait, None)
    world.solid.q[:2] += np.multiply(offset, BOX / cells)
    fluid, links_ends = [], []
    for _ in range(100):
        fluid.append(advance(world, PERIOD / 100).fastest)
        links_ends.append(fastest_end(world))
    assert max(fluid) < 2.5 * max(links_ends), f"in step {np.argmax(fluid)}"


CLOSING = {
    "disc": ('type="sphere" size="0.2"', 0.2),
    "rod": ('type="capsule" size="0.08 0.2" zaxis="1 0.15 0"', 0.08 + 0.2 * 0.1483405),
    "box": ('type="box" size="0.2 0.1 1" euler="0 0 0.2"', 0.1 * np.cos(0.2) + 0.2 * np.sin(0.2)),
}
"""Geometry in MJCF, and how far it reaches down, m."""


@pytest.mark.parametrize("cells", [32, 40])
@pytest.mark.parametrize("shape", CLOSING)
def test_fluid_between_a_body_and_a_side_is_squeezed_out_and_not_shot(
    shape: str, cells: int
) -> None:
    """A body that slides along a side, and reaches 0.3 cells into it at its lowest: what leaves the
    narrowing gap fast is less than half of what the body displaces, and no sliver lets it out.
    """
    geom, reach = CLOSING[shape]
    h = 1.0 / cells
    motions = (
        TrajectorySinusoid(np.array([0]), 0.1, 0.7),
        TrajectorySinusoid(np.array([1]), 0.15, 1.0, mean=-0.5 + reach - 0.3 * h + 0.15),
    )
    body = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    model = mjcf(f"<body>{body}<geom {geom}/></body>")
    world = make_world(model, Grid.slab(cells, cells, h, (-0.5, -0.5)), motions=motions)
    world.solid.q[:] = [float(motion.position(0.0)[0]) for motion in motions]
    speeds, gaps, body_speed = [], [], 0.0
    for _ in range(200):
        advance(world, 0.01)
        body_speed = max(body_speed, float(np.linalg.norm(world.solid.v)))
        opened, velocity = cut_by_bodies(world).open, world.flow()[1].velocity
        for u, a in zip(velocity[:2], opened[:2], strict=True):
            speeds.append(np.abs(u[a > 0.0]))
            gaps.append(a[a > 0.0])
    speed, gap = np.concatenate(speeds), np.concatenate(gaps)
    fast = speed > 9.0 * body_speed
    assert (gap[fast] >= CREASE).all()
    assert (speed * gap * h)[fast].max(initial=0.0) < 0.5 * body_speed * reach


def test_cells_that_a_body_and_a_side_seal_have_no_row() -> None:
    """What the side leaves open of such a cell leads nowhere, and the solve leaves it out."""
    grid = Grid.slab(16, 16, 1.0, (0.0, 0.0))
    sealed = 0
    for depth in np.linspace(-0.9, 0.1, 101):
        disc = f'<body pos="8.3 {3.0 + depth} 0"><freejoint/><geom type="sphere" size="3"/></body>'
        world = make_world(mjcf(disc), grid)
        cut, sides = cut_by_bodies(world), world.flow()[0].boundaries
        moving = volumes_of(world, cut).moving
        x, y, _ = face_weights(cut.open, accelerated(cut.open, moving, 1.0, grid, sides), grid)
        total = x[1:] + x[:-1] + y[:, 1:] + y[:, :-1]
        assert total.ravel()[cut.rows[0]].min() > 0.0, f"depth {depth}"
        sealed += int(((total[:, 0] == 0.0) & (cut.open[1][:, 0] > 0.0)).sum())
    assert sealed > 0


def test_a_crease_keeps_momentum() -> None:
    """Two free overlapping capsules that shear each other: the exchange stays exact."""
    capsule = '<geom type="capsule" size="0.08 0.2" zaxis="1 0.3 0"/>'
    first = f'<body pos="-0.1 0.01 0"><freejoint/>{capsule}</body>'
    second = f'<body pos="0.12 0.05 0" euler="0 0 0.9"><freejoint/>{capsule}</body>'
    grid = Grid.slab(40, 40, 1.0 / 40, (-0.5, -0.5))
    world = make_world(mjcf(first, second), grid, solid_density=2.0, tolerance=1e-11)
    world.solid.v[:] = [0.5, 0.2, 0.0, 0.0, 0.0, 2.0, -0.4, 0.1, 0.0, 0.0, 0.0, -3.0]
    for _ in range(30):
        report = advance(world, 0.005)
        assert report.momentum_exchange_error < 1e-13

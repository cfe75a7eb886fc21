"""Creatures that swim in still ideal fluid: S5."""

from __future__ import annotations

import numpy as np

from flowborne import Array, Grid, World
from flowborne.bodies import halfway_momentum, kinematics
from flowborne.boundaries import Boundaries
from flowborne.motions import TrajectorySinusoid
from flowborne.validation.case import Case, Finding, GridSeries, Tier, at_most
from flowborne.validation.worlds import RING, mjcf
from flowborne.worlds import advance, make_world

BOX = 3.0
LINK, WIDTH = 0.4, 0.1
"""Length and width of a link, m."""

PERIOD = 1.0
"""s, of the gaits."""


def chain(links: int) -> str:
    """A free chain of capsules along x about the origin."""
    body = ""
    for k in reversed(range(links)):
        joint = f'<joint name="j{k}" axis="0 0 1"/>' if k else '<freejoint name="root"/>'
        size = f"{0.5 * WIDTH} {0.5 * LINK - 0.02}"
        body = (
            f'<body name="link{k}" pos="{LINK if k else -0.5 * links * LINK} 0 0">{joint}'
            f'<geom type="capsule" size="{size}" pos="{0.5 * LINK} 0 0" zaxis="1 0 0"/>'
            f"{body}</body>"
        )
    return mjcf(body)


def swimmer(cells: int, gait: tuple[TrajectorySinusoid, ...], sides: Boundaries | None) -> World:
    """A neutrally buoyant chain at rest in still fluid without gravity, in its gait's first pose.

    cells  across the box
    gait   motion of each joint
    """
    grid = Grid.slab(cells, cells, BOX / cells, (-0.5 * BOX, -0.5 * BOX))
    world = make_world(
        chain(len(gait) + 1),
        grid,
        boundaries=sides or Boundaries(),
        solid_density=1.0,
        motions=gait,
        tolerance=1e-11,
    )
    for k, motion in enumerate(gait):
        world.solid.q[7 + k] = motion.position(0.0)[0]
    return world


def mass_centre(world: World) -> Array:
    """(2,) m."""
    model = world.setup.solid
    centres = kinematics(model, world.solid.q).mass_centre
    return np.asarray((model.body_mass @ centres)[:2] / model.body_mass.sum())


def momentum_kept(cells: int, steps: int) -> tuple[float, float]:
    """A cycle of a three-link stroke in a periodic box.

    returns  largest change of the total momentum over the creature's largest; largest relative
             error of the coupled solve's exchange
    """
    gait = tuple(
        TrajectorySinusoid(np.array([6 + k]), 0.8, PERIOD, 0.0, 0.5 * np.pi * k) for k in range(2)
    )
    world = swimmer(cells, gait, RING)
    model, dt = world.setup.solid, PERIOD / steps
    change = largest = exchange = 0.0
    for _ in range(steps):
        balance = advance(world, dt).momentum
        creature = halfway_momentum(model, world.solid, dt)[0]
        total = creature + balance.fluid
        change = max(change, float(np.abs(total).max()))
        largest = max(largest, float(np.abs(creature).max()))
        exchange = max(exchange, balance.exchange_error)
    return change / largest, exchange


def scallop(cells: int, steps: int, cycles: int) -> float:
    """Largest drift of the mass centre in a cycle of one hinge that opens and closes, over L."""
    hinge = TrajectorySinusoid(np.array([6]), 0.5, PERIOD, 0.7, -0.5 * np.pi)
    world = swimmer(cells, (hinge,), None)
    places = [mass_centre(world)]
    for _ in range(cycles):
        advance(world, PERIOD / steps, steps)
        places.append(mass_centre(world))
    drifts = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return float(drifts.max()) / (2.0 * LINK)


def invariants(quick: bool) -> list[Finding]:
    """S5: momentum in a periodic box, and the scallop that gets nowhere."""
    grids = (48,) if quick else (48, 96, 192)
    runs = [momentum_kept(n, 2 * n) for n in grids]
    label = "cells a side"
    changes, exchanges = (list(values) for values in zip(*runs, strict=True))
    findings = [
        at_most(
            "change of the total momentum in a cycle, over the creature's",
            changes[-1],
            1e-8,
            series=GridSeries(label, grids, changes, changes),
        ),
        at_most(
            "momentum that a coupled solve makes or loses, relative",
            exchanges[-1],
            1e-10,
            series=GridSeries(label, grids, exchanges, exchanges),
        ),
    ]
    drifts = [scallop(n, n, 1 if quick else 2) for n in grids]
    series = GridSeries(label, grids, drifts, drifts)
    said = "drift of a one-hinge swimmer in a cycle over its length"
    return [*findings, at_most(said, drifts[-1], 1e-3, series=series)]


CASES = (Case("S5", invariants, full=Tier.HALF_HOUR),)

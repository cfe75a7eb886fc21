"""Small boxes in an endless sea: B8, a cylinder that sheds vortices in a stream; I11, bodies that
swim and are towed through still water in a window that follows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flowborne import Grid, Simulation, World, load_scene, step
from flowborne.bodies import JointCommand
from flowborne.validation.case import Case, Tier, reference
from flowborne.validation.findings import Finding, Grids, falling, near
from flowborne.validation.shedding import (
    AFTER,
    BEFORE,
    CFL,
    PERIODS,
    STREAM,
    UNBOUNDED,
    Kicked,
    amplitude,
    cylinder,
    watch,
)
from flowborne.validation.worlds import force_on, mjcf, refined
from flowborne.worlds import (
    Boundaries,
    BoundaryFar,
    follow_bodies,
    make_world,
    set_going,
    set_velocity,
)

GRIDS = {True: (8,), False: (8, 16, 32)}
"""Cells across D, by quick."""

BOXES = {(12, 8): 1.0, (8, 6): 2.0}
"""Lengths and widths of the boxes in D, and how much wider than in the first what is required is.
A third of the length lies ahead of the cylinder, three diameters in the shorter one."""

REQUIRED = {"Cd mean": 0.02, "Cl amplitude": 0.05, "St": 0.02}
"""Relative, in the first box."""

TOWED = mjcf(
    '<body name="cylinder"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    '<geom type="cylinder" size="0.5 1"/></body>'
)
UPSTREAM = -1.0, 0.0
"""m/s, at which the cylinder is towed."""


def box(cells: int, length: int, width: int) -> Grid:
    """The cylinder is at the origin."""
    ahead = min(4, 3 + (length > 8))
    return Grid.slab(length * cells, width * cells, 1.0 / cells, (-float(ahead), -0.5 * width))


def in_stream(cells: int, length: int, width: int) -> World:
    """The held cylinder at Re 100 in a box in a sea that flows."""
    sides = Boundaries(*(BoundaryFar(velocity=(1.0, 0.0, 0.0)),) * 4)
    return make_world(
        cylinder(1.0, 0.0, 0.0),
        box(cells, length, width),
        viscosity=0.01,
        boundaries=sides,
        tolerance=1e-7,
    )


def shed(length: int, width: int, quick: bool) -> tuple[list[tuple[float, ...]], list[str]]:
    """Mean drag, amplitude of the lift and frequency from grid to grid, and lines for people."""
    rows, lines = [], []
    field, periods = Kicked(STREAM, UNBOUNDED, 0.0, 0.0), PERIODS[quick]
    for n, world, first in refined(GRIDS[quick], lambda n: in_stream(n, length, width), field):
        before = 2.0 * BEFORE[quick] if first else AFTER
        seen, drags, _ = watch(world, UNBOUNDED, before, 0.165, periods)
        steps, period = seen.last(periods)
        mean = float(drags[steps].mean())
        rows.append((mean, amplitude(seen.signal[steps]), UNBOUNDED.time / period))
        lines.append(f"{n:>6g} cells across D: {seen.unsteadiness(periods)}")
    return list(zip(*rows, strict=True)), lines


def cylinder_in_sea(quick: bool) -> list[Finding]:
    """B8: B5's figures in small boxes; unless quick in the smaller one too."""
    findings: list[Finding] = []
    for (length, width), wider in list(BOXES.items())[: 1 if quick else None]:
        figures, lines = shed(length, width, quick)
        for (name, relative), values in zip(REQUIRED.items(), figures, strict=True):
            found = near(
                f"{name} in {length} x {width} D",
                values,
                float(reference("B5", name)),
                Grids("cells across D", GRIDS[quick]),
                relative=wider * relative,
            )
            findings.append(falling(replace(found, lines=lines)))
            lines = []
    return findings


def towed(cells: int) -> World:
    """The cylinder that is towed through still water in a window that follows it."""
    sea, grid = Boundaries(*(BoundaryFar(),) * 4), box(cells, 12, 8)
    world = make_world(TOWED, grid, viscosity=0.01, boundaries=sea, tolerance=1e-7)
    follow_bodies(world, [1], [0, 1])
    return world


def drag(world: World, velocity: Sequence[float], duration: float) -> float:
    """Drag coefficient in the mean over the last D/U of some, on a body that keeps a velocity."""
    command, dt = JointCommand.none(world.solid.v.size), 0.5 * CFL * world.flow()[0].grid.spacing
    dofs = np.arange(world.solid.v.size)
    command.set(dofs, np.asarray(velocity)[dofs], np.asarray(velocity)[dofs])
    world.solid.v[:] = np.asarray(velocity)[dofs]
    set_going(world)
    count, last = round(duration / dt), round(1.0 / dt)
    forces = [force_on(step(world, dt, command))[0] for _ in range(count)]
    return float(2.0 * np.mean(forces[-last:]))


def towed_over_held(quick: bool) -> Finding:
    """The same flow seen from the water and from the cylinder."""
    ratios = []
    for cells in GRIDS[quick]:
        held = in_stream(cells, 12, 8)
        set_velocity(held, STREAM)
        at_rest = drag(held, (0.0, 0.0), 5.0)
        ratios.append(drag(towed(cells), UPSTREAM, 5.0) / at_rest)
    title = "drag of a towed cylinder in a window over that of a held one in a stream, at 5 D/U"
    on = Grids("cells across D", GRIDS[quick])
    return falling(near(title, ratios, 1.0, on, relative=0.02))


def eel_way(lower: tuple[float, float], upper: tuple[float, float], follow: str) -> float:
    """How far the head of the robot eel swims along y in 4 s, m."""
    cells = round(100 * (upper[1] - lower[1]))
    changes = {f"boundaries.{name}": "far" for name in ("x_min", "x_max", "y_min", "y_max")}
    domain = {"lower": list(lower), "upper": list(upper), "resolution": cells, "follow": follow}
    changes |= {f"domain.{key}": str(value) for key, value in domain.items()}
    with Simulation(load_scene("eel", changes), workers=1) as simulation:
        head = simulation.world.solid.q[1]
        for _ in range(240):
            simulation.advance_frame()
        return float(simulation.world.solid.q[1] - head)


def eel() -> list[Finding]:
    """The eel of 0.55 m in windows that follow it, against a domain that holds its whole way."""
    large = eel_way((-1.22, -1.42), (2.44, 2.24), "nothing")
    boxes = ((0.36, -0.09), (0.86, 0.81)), ((0.2, -0.25), (1.02, 0.95))
    return [
        near(
            f"way of the eel in a window of {high[0] - low[0]:.2g} x {high[1] - low[1]:.2g} m, "
            "over that in 3.66 x 3.66 m",
            eel_way(low, high, "bodies") / large,
            1.0,
            relative=0.005,
        )
        for low, high in boxes
    ]


def in_windows(quick: bool) -> list[Finding]:
    """I11: a towed cylinder, and unless quick the way of the eel."""
    return [towed_over_held(quick), *([] if quick else eel())]


CASES = (
    Case("B8", cylinder_in_sea, Tier.HALF_HOUR, coarse=True),
    Case("I11", in_windows, full=Tier.HALF_HOUR, coarse=True),
)

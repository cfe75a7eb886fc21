"""Lid-driven cavity: F2."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from flowborne import Array, Grid, World
from flowborne.worlds import Boundaries, BoundaryNoSlip, advance, make_world
from flowborne_validation.case import reference
from flowborne_validation.findings import Curve, Figure, Figures, Plot
from flowborne_validation.worlds import NOWHERE, Uniform, refined

LONGEST, MISPRINT = 400.0, (400, 0.9063)
"""s within which a flow has to become steady; Reynolds number and x of a value misprinted in the
table."""


def cavity(cells: int, reynolds: int) -> World:
    """The unit square at rest under a lid of 1 m/s."""
    wall, lid = BoundaryNoSlip(), BoundaryNoSlip((1.0, 0.0, 0.0))
    return make_world(
        grid=Grid.slab(cells, cells, 1.0 / cells, (0.0, 0.0)),
        viscosity=1.0 / reynolds,
        boundaries=Boundaries(wall, wall, wall, lid),
        tolerance=1e-9,
    )


def settle(world: World, rate: float) -> float:
    """Time in s at which max|du/dt| falls below `rate` (m/s^2). Raises ArithmeticError when the
    flow does not become steady."""
    fluid, state = world.flow()
    dt = fluid.grid.spacing  # the lid crosses a cell in a step
    while world.time < LONGEST:
        before = [state.velocity[axis].copy() for axis in fluid.grid.axes]
        advance(world, dt)
        change = max(float(np.abs(state.velocity[a] - before[a]).max()) for a in fluid.grid.axes)
        if change < rate * dt:
            return world.time
    raise ArithmeticError(f"the cavity is not steady after {LONGEST:g} s")


def profiles(world: World) -> tuple[CubicSpline, CubicSpline]:
    """u over y on the line x = 0.5, and v over x on the line y = 0.5, walls included."""
    fluid, state = world.flow()
    n = fluid.grid.shape[0]
    line = np.concatenate([[0.0], fluid.grid.cell_coordinates()[0], [1.0]])
    u = np.concatenate([[0.0], state.velocity[0][n // 2, :, 0], [1.0]])
    v = np.concatenate([[0.0], state.velocity[1][:, n // 2, 0], [0.0]])
    return CubicSpline(line, u), CubicSpline(line, v)


def against_tables(world: World, reynolds: int) -> tuple[list[float], list[Plot]]:
    """Largest |u - table| and |v - table|, m/s, and both profiles with the table."""
    line, wrong, plots = np.linspace(0.0, 1.0, 101), [], []
    rows = ("u(x=0.5,y) table", "y", "x", "u"), ("v(x,y=0.5) table", "x", "y", "v")
    for profile, (name, along, fixed, component) in zip(profiles(world), rows, strict=True):
        known = reference("F2", name)
        at, values = np.array(known[along]), np.array(known[str(reynolds)])
        right = (at != MISPRINT[1]) | (reynolds != MISPRINT[0])
        wrong.append(float(np.abs(profile(at) - values)[right].max()))
        curves = (Curve("Ghia et al.", at, values, True), Curve("flowborne", line, profile(line)))
        plots.append(Plot(f"{along} on the line {fixed} = 0.5 m", f"{component} (m/s)", curves))
    return wrong, plots


def stream_function(world: World) -> Array:
    """(n+1, n+1) psi at the nodes, m^2/s: 0 on the walls."""
    fluid, state = world.flow()
    below = np.cumsum(state.velocity[0][:, :, 0], axis=1) * fluid.grid.spacing
    return np.concatenate([np.zeros((len(below), 1)), below], axis=1)


def primary_vortex(world: World) -> tuple[float, float, float]:
    """x, y (m) and psi (m^2/s) at the minimum of psi: vertex of a parabola along each axis."""
    fluid, _ = world.flow()
    psi = stream_function(world)
    i, j = np.unravel_index(int(np.argmin(psi)), psi.shape)
    centre, least = [], float(psi[i, j])
    for at, line in ((i, psi[:, j]), (j, psi[i, :])):
        before, here, after = line[at - 1 : at + 2]
        shift = 0.5 * (before - after) / (before - 2.0 * here + after)
        centre.append(fluid.grid.spacing * (at + shift))
        least -= 0.25 * (before - after) * shift
    return float(centre[0]), float(centre[1]), least


def lid_driven(grids: Sequence[int], reynolds: Sequence[int], rate: float) -> Figures:
    """F2: velocity profiles, and position and strength of the primary vortex. The tables are
    accurate to some thousandths, so that the deviation from them levels off. The flow is steady
    when it changes by less than `rate` (m/s^2)."""
    found: dict[str, Figure] = {}
    for re in reynolds:
        rows, lines = [], []
        for n, world, _ in refined(grids, partial(cavity, reynolds=re), Uniform(NOWHERE)):
            lines.append(f"{n:>6g} cells a side: steady after {settle(world, rate):.1f} s")
            wrong, plots = against_tables(world, re)
            rows.append((*wrong, *primary_vortex(world)))
        u, v, *vortex = zip(*rows, strict=True)
        found[f"max|u - table|, Re {re}"] = Figure(u, grids, plot=plots[0])
        found[f"max|v - table|, Re {re}"] = Figure(v, grids, plot=plots[1])
        exact = reference("F2", "primary vortex (x,y,psi)")[str(re)]
        for name, values, known in zip(("x", "y", "psi"), vortex, exact, strict=True):
            shown = lines if name == "psi" else ()
            found[f"{name} of the vortex, Re {re}"] = Figure(values, grids, known, lines=shown)
    return found

"""Flesh without a fluid: D1, D4 and D5."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, eigsh

from flowborne import Array, SolidState
from flowborne.bodies import (
    FleshTable,
    assemble_flesh,
    prescribe_flesh,
    static_forces,
    symmetric_factor,
)
from flowborne_validation.articulated import frequency
from flowborne_validation.case import Case, reference, table
from flowborne_validation.findings import Finding, Grids, GridSeries, at_most, near, order_of
from flowborne_validation.flesh_bars import Bar, bar_of, equilibrium, tissue_table
from flowborne_validation.worlds import Vector

Cells = tuple[int, ...]

FLAG = (0.35, 0.02)
"""Length and thickness of Turek and Hron's bar, m."""

FLAG_CELLS: tuple[Cells, ...] = ((9, 1), (18, 1), (35, 2), (70, 4))
FLAG_DOWN: Vector = (0.0, -2.0, 0.0)


def flag_tissue(young: float) -> FleshTable:
    """Turek and Hron's material."""
    return tissue_table(young, 0.4, 1000.0)


def round_root(y: Array) -> Array:
    """Start of the bar on the cylinder of radius 0.05 m at heights y, from that of its axis, m."""
    return np.asarray(np.sqrt(0.05**2 - y**2) - 0.05)


def sunk(build: Callable[[Cells], Bar], cells: Sequence[Cells]) -> Array:
    """(grids, 2) displacements (mm) of the ends of bars under their weight."""
    found = []
    for grid in cells:
        bar = build(grid)
        q = equilibrium(bar, np.zeros(bar.model.nv))
        found.append(1e3 * bar.end(q)[:2])
    return np.array(found)


def flags(quick: bool) -> list[Finding]:
    """D1: CSM1 and CSM2 in a slab, and CSM1 in a room, one cell deep."""
    findings = []
    deep = tuple((*cells, 1) for cells in FLAG_CELLS[:3])
    for name, label, young, cells in (
        ("CSM1", "triangles", 1.4e6, FLAG_CELLS[: 3 if quick else None]),
        ("CSM2", "triangles", 5.6e6, FLAG_CELLS[: 3 if quick else None]),
        ("CSM1", "tetrahedra", 1.4e6, deep),
    ):
        build = partial(
            bar_of, size=FLAG, tissue=flag_tissue(young), gravity=FLAG_DOWN, root=round_root
        )
        found = sunk(build, cells).T
        exact = reference("D1", f"{name} A [1e-3]")
        for (quantity, value), values in zip(exact.items(), found, strict=True):
            title = f"{name} A, {label}, {quantity} in mm"
            findings.append(near(title, values, value, along(cells), relative=0.02))
    return findings


def along(cells: Sequence[Cells]) -> Grids:
    """Grids by their cells along the bar."""
    return Grids("cells along the bar", [grid[0] for grid in cells])


SLENDER = (1.0, 1.0 / 40.0)
"""Length and thickness of the beams of D4 and D5, m."""


def beam(cells: Cells, stiffness: float, weight: float) -> Bar:
    """A beam without Poisson's ratio, of bending stiffness EI (N m^2) and weight (N/m)."""
    tissue = tissue_table(12.0 * stiffness / SLENDER[1] ** 3, 0.0, 1.0 / SLENDER[1])
    return bar_of(cells, SLENDER, tissue, (0.0, -weight, 0.0))


def elastica(quick: bool) -> list[Finding]:
    """D4: end of a slender beam of EI = 1 and L = 1 under a load at its tip, or a uniform load."""
    grids: tuple[Cells, ...] = ((10, 1), (20, 1)) if quick else ((10, 1), (20, 1), (40, 1))
    loads = {
        "tip load alpha": table("D4", "tip load: [w/L,u/L,tip deg]"),
        "uniform load beta": table("D4", "uniform load"),
    }
    findings = []
    for label, exact in loads.items():
        chosen = [k for k in exact if not quick or k in (1.0, 10.0)]
        found = np.array([_bent(grid, label.startswith("tip"), chosen) for grid in grids])
        for i, load in enumerate(chosen):
            for j, quantity in enumerate(("w/L", "u/L", "angle of the tip in degrees")):
                title, values = f"{label} = {load:g}, {quantity}", found[:, i, j]
                findings.append(near(title, values, exact[load][j], along(grids), relative=0.01))
    return findings


def _bent(cells: Cells, at_tip: bool, loads: Sequence[float]) -> Array:
    """(loads, 3) downward and backward displacement of the end, m, and its angle, degrees."""
    found, q = [], None
    for load in loads:
        bar = beam(cells, 1.0, 0.0 if at_tip else load)
        push = bar.load((0.0, -load, 0.0)) if at_tip else np.zeros(bar.model.nv)
        q = equilibrium(bar, push, q)
        x, y, _ = bar.end(q)
        found.append((-y, -x, -np.degrees(bar.turned(q))))
    return np.array(found)


def modes(bar: Bar, count: int) -> tuple[Array, Array]:
    """Lowest frequencies about rest, (count,) Hz, and their shapes (nv, count)."""
    model, free = bar.model, np.flatnonzero(~bar.fixed)
    K, _ = static_forces(model, model.mj.qpos0, np.zeros(model.nv))
    K = csc_array(K[free][:, free])
    M = csc_array(assemble_flesh(model, model.rest(), np.zeros(model.nv), 1e-9).A[free][:, free])
    inverse = LinearOperator(K.shape, matvec=symmetric_factor(K).solve, dtype=np.float64)
    squares, found = eigsh(K, count, M, sigma=0.0, OPinv=inverse, v0=np.ones(len(free)))
    shapes = np.zeros((model.nv, count))
    shapes[free] = found
    return np.sqrt(squares) / (2.0 * np.pi), shapes


def swing(bar: Bar, q: Array, dt: float, steps: int) -> Array:
    """(steps + 1,) height of the end above rest, m, after the bar is released at q (nq,)."""
    model, zero = bar.model, np.zeros(bar.model.nv)
    ahead = assemble_flesh(model, SolidState(q, zero), zero, dt)
    first = prescribe_flesh(ahead, bar.fixed, zero).velocity
    state = SolidState(q.copy(), 0.5 * first)  # the velocity in the middle of the next step
    heights = [bar.end(q)[1]]
    for _ in range(steps):
        q = model.integrate(state.q, state.v, dt)
        system = assemble_flesh(model, SolidState(q, state.v), zero, dt)
        state = SolidState(q, prescribe_flesh(system, bar.fixed, zero).velocity)
        heights.append(bar.end(q)[1])
    return np.array(heights)


def vibration(quick: bool) -> list[Finding]:
    """D5: three modes of a beam, its first mode in time, and CSM3."""
    findings = []
    exact = np.array(reference("D5", "beta L")) ** 2 / (2.0 * np.pi)
    grids: tuple[Cells, ...] = ((5, 1), (10, 1), (20, 1)) if quick else ((10, 1), (20, 1), (40, 1))
    found = np.array([modes(beam(grid, 1.0, 0.0), 3)[0] for grid in grids])
    for mode in range(3):
        title, values = f"f{mode + 1} of a beam, Hz", found[:, mode]
        findings.append(near(title, values, exact[mode], along(grids), relative=0.02))
    findings += in_time((20, 40) if quick else (25, 50, 100), 3 if quick else 10)
    return findings + flag_in_time(quick)


def in_time(steps: Sequence[int], periods: int) -> list[Finding]:
    """Frequency and amplitude of a beam released in its first mode at 1 mm, `steps` in a period."""
    bar = beam((10, 1), 1.0, 0.0)
    (f1,), shape = modes(bar, 1)
    rest = bar.model.mj.qpos0
    reach = abs(bar.end(bar.model.integrate(rest, shape[:, 0], 1.0))[1])
    q = bar.model.integrate(rest, shape[:, 0], 1e-3 / reach)
    runs, lost = [], []
    for n in steps:
        dt = 1.0 / (f1 * n)
        heights = swing(bar, q, dt, int((periods + 0.5) * n))
        runs.append(frequency(heights, dt))
        lost.append(1.0 - float(np.abs(heights[-n:]).max() / np.abs(heights[0])))
    series = GridSeries.toward(Grids("steps in a period", steps), runs, f1)
    return [
        order_of("order in time of f1", series, expected=2.0),
        near("f1 in time over that of the mode", runs[-1] / f1, 1.0, relative=0.02),
        at_most(f"amplitude that is lost in {periods} periods", lost[-1], 0.01),
    ]


def flag_in_time(quick: bool) -> list[Finding]:
    """CSM3: the bar of CSM1 released at rest, by its small vibrations and by its large ones. It is
    not damped. At 50 steps a second its fast modes grow in the large swings and dominate after some
    seconds; at 100 they do not in 10 s."""
    known = reference("D5", "CSM3 cross-check, Hz")
    small, large = known["f1 of Euler-Bernoulli with E/(1-nu^2)"], known["large amplitude"]
    grids = FLAG_CELLS[:2] if quick else FLAG_CELLS[:3]
    bars = [bar_of(g, FLAG, flag_tissue(1.4e6), FLAG_DOWN, round_root) for g in grids]
    values = [float(modes(bar, 1)[0][0]) for bar in bars]
    slow = near("f1 of CSM3's bar, Hz", values, small, along(grids), relative=0.02)
    steps, seconds = ((50, 100), 3.0) if quick else ((100, 200), 10.0)
    runs = []
    for n in steps:
        heights = swing(bars[1], bars[1].model.rest().q, 1.0 / n, int(seconds * n))
        runs.append(frequency(heights - heights.mean(), 1.0 / n))
    lines = [f"the end swings between {1e3 * heights.min():.1f} and {1e3 * heights.max():.1f} mm"]
    on, title = Grids("steps a second", steps), "CSM3 at large amplitude, Hz"
    return [slow, near(title, runs, large, on, relative=0.02, lines=lines)]


CASES = (Case("D1", flags), Case("D4", elastica), Case("D5", vibration))

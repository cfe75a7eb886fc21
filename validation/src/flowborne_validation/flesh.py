"""Flesh without a fluid: D1, D4 and D5."""

from __future__ import annotations

from collections.abc import Sequence

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
from flowborne_validation.case import reference, table
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.flesh_bars import Bar, bar_of, equilibrium, tissue_table
from flowborne_validation.worlds import Vector

FLAG = (0.35, 0.02)
"""Length and thickness of Turek and Hron's bar, m."""

FLAG_DOWN: Vector = (0.0, -2.0, 0.0)


def flag_tissue(young: float) -> FleshTable:
    """Turek and Hron's material."""
    return tissue_table(young, 0.4, 1000.0)


def round_root(y: Array) -> Array:
    """Start of the bar on the cylinder of radius 0.05 m at heights y, from that of its axis, m."""
    return np.asarray(np.sqrt(0.05**2 - y**2) - 0.05)


def flag(cells: Sequence[int], name: str, young: float) -> Figures:
    """D1: displacement of a flag's end under its weight, in a slab or in a room, one cell deep."""
    bar = bar_of(cells, FLAG, flag_tissue(young), FLAG_DOWN, round_root)
    end = 1e3 * bar.end(equilibrium(bar, np.zeros(bar.model.nv)))
    label = "triangles" if len(cells) == 2 else "tetrahedra"
    exact = reference("D1", f"{name} A [1e-3]").items()
    return {
        f"{name} A, {label}, {quantity} in mm": Figure(value, reference=known)
        for (quantity, known), value in zip(exact, end[:2], strict=True)
    }


SLENDER = (1.0, 1.0 / 40.0)
"""Length and thickness of the beams of D4 and D5, m."""


def beam(cells: Sequence[int], stiffness: float, weight: float) -> Bar:
    """A beam without Poisson's ratio, of bending stiffness EI (N m^2) and weight (N/m)."""
    tissue = tissue_table(12.0 * stiffness / SLENDER[1] ** 3, 0.0, 1.0 / SLENDER[1])
    return bar_of(cells, SLENDER, tissue, (0.0, -weight, 0.0))


def elastica(cells: Sequence[int], kind: str, loads: Sequence[float] = ()) -> Figures:
    """D4: displacement down and back of the end of a slender beam of EI = 1 and L = 1, and its
    angle, under a load at its tip or a uniform load; all loads of the list by default."""
    at_tip = kind == "tip load alpha"
    exact = table("D4", "tip load: [w/L,u/L,tip deg]" if at_tip else "uniform load")
    found, q = {}, None
    for load in loads or exact:
        bar = beam(cells, 1.0, 0.0 if at_tip else load)
        push = bar.load((0.0, -load, 0.0)) if at_tip else np.zeros(bar.model.nv)
        q = equilibrium(bar, push, q)
        x, y, _ = bar.end(q)
        figures = -y, -x, -np.degrees(bar.turned(q))
        names = ("w/L", "u/L", "angle of the tip in degrees")
        for name, figure, known in zip(names, figures, exact[load], strict=True):
            found[f"{kind} = {load:g}, {name}"] = Figure(figure, reference=known)
    return found


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


def beam_modes(cells: Sequence[int]) -> Figures:
    """D5: three modes of a beam."""
    exact = np.array(reference("D5", "beta L")) ** 2 / (2.0 * np.pi)
    found, _ = modes(beam(cells, 1.0, 0.0), 3)
    return {
        f"f{n} of a beam, Hz": Figure(value, reference=known)
        for n, (value, known) in enumerate(zip(found, exact, strict=True), 1)
    }


def in_time(steps: Sequence[int], periods: int) -> Figures:
    """D5: frequency and amplitude of a beam released in its first mode at 1 mm, `steps` in a
    period."""
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
    return {
        "order in time of f1": Figure(runs, steps, f1),
        "f1 in time over that of the mode": runs[-1] / f1,
        f"amplitude that is lost in {periods} periods": lost[-1],
    }


def flag_mode(cells: Sequence[int]) -> Figures:
    """D5: the bar of CSM1 by its small vibrations, for CSM3."""
    bar = bar_of(cells, FLAG, flag_tissue(1.4e6), FLAG_DOWN, round_root)
    exact = reference("D5", "CSM3 cross-check, Hz")["f1 of Euler-Bernoulli with E/(1-nu^2)"]
    return {"f1 of CSM3's bar, Hz": Figure(float(modes(bar, 1)[0][0]), reference=exact)}


def flag_in_time(steps: int, seconds: float) -> Figures:
    """D5, CSM3: the bar of CSM1 released at rest, by its large vibrations. It is not damped. At 50
    steps a second its fast modes grow in the large swings and dominate after some seconds; at 100
    they do not in 10 s."""
    bar = bar_of((18, 1), FLAG, flag_tissue(1.4e6), FLAG_DOWN, round_root)
    heights = swing(bar, bar.model.rest().q, 1.0 / steps, int(seconds * steps))
    found = frequency(heights - heights.mean(), 1.0 / steps)
    line = f"the end swings between {1e3 * heights.min():.1f} and {1e3 * heights.max():.1f} mm"
    exact = reference("D5", "CSM3 cross-check, Hz")["large amplitude"]
    return {"CSM3 at large amplitude, Hz": Figure(found, reference=exact, lines=[line])}

"""Flow past a fixed cylinder in open water, beside B5: B4, B6, and V9's while it is held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flowborne import World
from flowborne.validation.case import Case, Curve, Finding, Plot, Tier, near
from flowborne.validation.fixed_bodies import (
    CFL,
    OPEN_GRIDS,
    STREAM,
    UNBOUNDED,
    begin,
    open_water,
    series_of,
    shed_in_the_open,
    within,
)
from flowborne.validation.fixed_sphere import separation
from flowborne.validation.fixed_sphere import series_of as toward
from flowborne.validation.reference import confirmed, reference, table
from flowborne.worlds import advance, velocity_at

STEADY_GRIDS = {True: (4, 8), False: (8, 16, 24, 32)}
"""Cells across D of B4, by quick."""

FIRST, NEXT = {True: 30.0, False: 60.0}, 15.0
"""Times D/U that B4 is given to become steady: on the first grid, by quick, from the undisturbed
flow, and on the others from that of the coarser grid."""

FURTHEST = 6.0
"""Diameters behind the centre within which the backflow ends."""

GERRIS_GRIDS = (8, 16)
"""Cells across D of the frequencies over the Reynolds number."""


def bubble(world: World) -> float:
    """Length of the backflow behind the cylinder along its axis, in D; 0 where there is none."""
    h = world.flow()[0].grid.spacing
    x = np.arange(0.5 + h, FURTHEST, 0.05 * h)
    u = velocity_at(world, x[:, None] * np.array(STREAM.velocity))[:, 0]
    if u[0] > 0.0:
        return 0.0
    return float(x[int(np.argmax(u > 0.0))] - 0.5)


def steady_cylinder(quick: bool) -> list[Finding]:
    """B4: drag, length of the backflow and the angle at which the flow leaves the cylinder."""
    grids = STEADY_GRIDS[quick]
    rows, lines = [], []
    coarser = None
    for n in grids:
        world = open_water(n, 1.0 / 40.0)
        begin(world, coarser, STREAM)
        dt = CFL / n
        steps = round((NEXT if coarser else FIRST[quick]) / dt)
        before, _ = UNBOUNDED.coefficients(advance(world, dt, steps - n))
        drag, _ = UNBOUNDED.coefficients(advance(world, dt, n))
        rows.append((drag, bubble(world), 180.0 - separation(world, (0.0, 1.0, 0.0))))
        lines.append(f"{n:>6g} cells across D: Cd changes by {drag - before:.2g} in the last D/U")
        coarser = world
    names = ("Cd", "bubble length L/D", "separation angle deg")
    drags, lengths, angles = (
        series_of("B4", quantity, grids, values)
        for quantity, values in zip(names, zip(*rows, strict=True), strict=True)
    )
    return [
        within("B4", "Cd", drags, (1.48, 1.62), lines),
        within("B4", "bubble length L/D", lengths, (2.13, 2.35)),
        within("B4", "separation angle deg", angles, (52.7, 54.2)),
    ]


def shedding_at_200(quick: bool) -> list[Finding]:
    """B6: mean drag, amplitude of the lift and frequency at Re 200, and unless quick the frequency
    at Re 250 to 500."""
    grids = OPEN_GRIDS[quick]
    columns, lines = shed_in_the_open(200.0, 0.197, grids, quick)
    drag, lift, strouhal = (
        series_of("B6", quantity, grids, values)
        for quantity, values in zip(("Cd mean", "Cl amplitude", "St"), columns, strict=True)
    )
    findings = [
        within("B6", "Cd mean", drag, (1.17, 1.41), lines),
        within("B6", "Cl amplitude", lift, (0.50, 0.70)),
        within("B6", "St", strouhal, (0.190, 0.203)),
    ]
    return findings if quick else findings + frequencies()


def frequencies() -> list[Finding]:
    """Frequency over the Reynolds number, beside Gerris's."""
    known = table("B6", "St(Re) Gerris 250..500")
    found = {re: shed_in_the_open(re, st, GERRIS_GRIDS, False)[0][2] for re, st in known.items()}
    curves = (
        Curve("Gerris", list(known), list(known.values()), True),
        Curve("flowborne", list(known), [values[-1] for values in found.values()]),
    )
    plot = Plot("Reynolds number", "Strouhal number", curves)
    findings = []
    for reynolds, exact in known.items():
        series = toward(GERRIS_GRIDS, found[reynolds], exact)
        said = f"St at Re {reynolds:g}"
        findings.append(near(said, series.values[-1], exact, relative=0.03, series=series))
    return [replace(findings[0], plot=plot), *findings[1:]]


def held_at_185(quick: bool) -> list[Finding]:
    """V9: the cylinder before it is moved. Of the moved one the list names curves and has none."""
    known = numbers_of(reference("V9", "fixed cylinder Re=185"))
    grids = OPEN_GRIDS[quick]
    (drag, lift, strouhal), lines = shed_in_the_open(185.0, 0.195, grids, quick)
    measured = (drag, [value * np.sqrt(0.5) for value in lift], strouhal)
    findings = []
    for (name, exact), values in zip(known.items(), measured, strict=True):
        series = toward(grids, values, exact)
        findings.append(near(f"{name}, held", values[-1], exact, relative=0.05, series=series))
    sure = confirmed("V9", "fixed cylinder Re=185")
    findings[0] = replace(findings[0], lines=tuple(lines))
    return [replace(finding, confirmed=sure) for finding in findings]


def numbers_of(text: str) -> dict[str, float]:
    """Names and numbers of "Cd 1.287, Cl_rms 0.443"."""
    pairs: Sequence[Sequence[str]] = [part.split() for part in text.split(",")]
    return {name: float(number) for name, number in pairs}


CASES = (
    Case("B4", steady_cylinder, Tier.HALF_HOUR, coarse=True),
    Case("B6", shedding_at_200, Tier.HALF_HOUR, coarse=True),
    Case("V9", held_at_185, Tier.HALF_HOUR, coarse=True),
)

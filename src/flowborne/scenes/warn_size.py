"""Warnings about bodies and cells of sizes that do not match."""

from __future__ import annotations

import math
from collections.abc import Iterator

from flowborne.coupling.seen import Seen, seen_bodies
from flowborne.coupling.world import Setup
from flowborne.phrases import rounded_down, rounded_up
from flowborne.scenes.creature import creature_extent
from flowborne.scenes.domain import Domain, fits_memory
from flowborne.scenes.schema import Scene

LEAST_CELLS = 2.0
"""Cells across the thinnest part of a body. A sheet of two cells holds a whole cell wherever it
lies on the grid; and it is thicker than the diagonal of a cell, 1.43 in slabs and 1.75 in rooms,
so that the fluid meets the body as thick as it is."""

LARGEST_DOMAIN = 100.0
"""Shortest side of a domain, in lengths of the creature. Sides that are L away change the added
mass of a body of the size D by (D/L)^2 of it (validation I2): 1e-4 at 100, less than any case is
accurate to. More than that is a slip of units."""

MOST_CELLS_ALONG = 10**6
"""Cells along a side that no machine holds, whatever the others are."""


def thin_bodies(scene: Scene, setup: Setup) -> Iterator[str]:
    """Bodies that fluid passes through, and those of fewer cells than LEAST_CELLS."""
    if setup.fluid is None or scene.domain is None:
        return
    h = setup.fluid.grid.spacing
    seen = seen_bodies(setup)
    leaking = [body for body in seen if not body.tight]
    least = LEAST_CELLS * h * (1.0 - 1e-9)
    thin = [body for body in seen if body.tight and body.thickness < least]
    for bodies, harm in (
        (leaking, "fluid passes through it"),
        (thin, f"below {LEAST_CELLS:g} cells the flow is not reliable"),
    ):
        if bodies:
            worst = min(bodies, key=lambda body: body.thickness)
            more = f" ({len(bodies) - 1} more too)" if len(bodies) > 1 else ""
            remedy = _remedy(scene, setup, worst.thickness)
            yield f"[domain]: {_size(worst, h)}, and {harm}{more}; {remedy}"


def _size(body: Seen, h: float) -> str:
    """How thick a body is, in cells of h m, and its thickness on the grid."""
    cells = f"{body.thickness / h:.2g}"
    said = f"{body.name} is {body.thickness:.3g} m thick, {cells} cell{'s' * (cells != '1')}"
    if not body.tight or not 0.0 < body.thickness < body.seen * (1.0 - 1e-9):
        return said
    times = body.seen / body.thickness
    return f"{said}, and {body.seen:.3g} m on the grid, {times:.3g} times as thick"


def _remedy(scene: Scene, setup: Setup, thickness: float) -> str:
    """What gives LEAST_CELLS across `thickness` m: a grid that this machine holds, a smaller domain
    that the creature fits into, or a thicker body."""
    assert scene.domain is not None
    assert setup.fluid is not None
    domain, spacing = scene.domain, thickness / LEAST_CELLS
    if spacing > 0.0 and max(domain.extent()) / spacing < MOST_CELLS_ALONG:
        finer, said = _refined(domain, spacing)
        if fits_memory(finer.counts()):
            return f"{said} gives {LEAST_CELLS:g}"
        smaller = spacing / domain.spacing()
        if min(domain.extent()) * smaller > 2.0 * max(creature_extent(scene, setup)):
            longest = rounded_down(max(domain.extent()) * smaller)
            return f"in a domain {longest} m long as many cells give {LEAST_CELLS:g}"
    return f"a thickness of {rounded_up(LEAST_CELLS * domain.spacing())} m gives {LEAST_CELLS:g}"


def _refined(domain: Domain, spacing: float) -> tuple[Domain, str]:
    """The domain with cells no larger than `spacing` m, and the key that makes it so."""
    if domain.cells is not None:
        common = math.gcd(*domain.cells)
        times = math.ceil(domain.spacing() * common / spacing * (1.0 - 1e-9))
        cells = tuple(count // common * times for count in domain.cells)
        return domain.model_copy(update={"cells": cells}), f"domain.cells = {list(cells)}"
    resolution = math.ceil(max(domain.extent()) / spacing * (1.0 - 1e-9))
    finer = domain.model_copy(update={"resolution": resolution})
    return finer, f"domain.resolution = {resolution}"


def lost_in_domain(scene: Scene, setup: Setup) -> Iterator[str]:
    """Creatures that are tiny in their domain."""
    if setup.fluid is None or setup.fluid.one_way or scene.domain is None:
        return
    length, shortest = max(creature_extent(scene, setup)), min(scene.domain.extent())
    if 0.0 < length < shortest / LARGEST_DOMAIN * (1.0 - 1e-9):
        yield (
            f"[domain]: its shortest side is {shortest:.3g} m, {shortest / length:.3g} times the "
            f"{length:.3g} m that the bodies measure, and sides so far away change nothing; "
            f"{rounded_down(LARGEST_DOMAIN * length)} m or less will do, and lengths are metres"
        )

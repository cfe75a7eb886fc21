"""The force on a body is what a box of fluid around it tells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flowborne.coupling import flow
from flowborne.coupling.cut import cut_by_bodies, volumes_of
from flowborne.coupling.step import step
from flowborne.coupling.world import World
from flowborne.fluid import transport
from flowborne.fluid.control_volumes import face_masses
from flowborne.fluid.grid import Grid
from flowborne.fluid.transport import damp_eddies
from flowborne.kernels import carry as kernels
from flowborne.kernels.arrays import Array, Faces
from flowborne.kernels.flux import GHOSTS, Fluxes, Padded, Stage

from ..kernels.references.flux import line_flux_reference, side_fluxes_reference
from .test_flux_form import CUBE, SQUARE, channel, free

DT = 1.0 / 256
"""s, so that the flow crosses less than a cell in a step."""

Box = tuple[slice, slice, slice]


def box_in(grid: Grid) -> Box:
    """The control volumes of a component that lie well around the body, and what even out with it:
    no transfers cross its sides."""
    first = grid.shape[0] // 8 - 1
    around = slice(first, grid.shape[0] - first)
    return around, around, slice(None) if grid.is_slab else around


def momentum_in(world: World, box: Box) -> Array:
    """(3,) N s."""
    fluid, state = world.flow()
    mass = face_masses(volumes_of(world, cut_by_bodies(world)), fluid.density)
    pairs = zip(mass, state.velocity, strict=True)
    return np.array([float((m[box] * u[box]).sum()) for m, u in pairs])


def out_of_box(padded: Padded, flux: Fluxes, box: Box) -> float:
    """What leaves a box of control volumes per time in one stage, m^4/s, by NumPy."""
    (field, marks), through = padded, side_fluxes_reference(flux)
    flat = field.shape[0] == 1
    inside = (slice(None), *box[:2]) if flat else box
    total = 0.0
    for axis in range(int(flat), 3):
        sides = [slice(s.start, s.stop) if s.start is not None else s for s in inside]
        first, last = inside[axis].start, inside[axis].stop
        for at, sign in ((first, -1.0), (last, 1.0)):
            layer, near = list(sides), list(sides)
            layer[axis] = slice(at, at + 1)
            for a in range(int(flat), 3):
                near[a] = slice(sides[a].start + GHOSTS, sides[a].stop + GHOSTS)
            line, mark = [], []
            for shift in range(-2, 2):
                near[axis] = slice(at + shift + GHOSTS, at + shift + GHOSTS + 1)
                line.append(field[tuple(near)])
                mark.append(marks[tuple(near)])
            found = line_flux_reference(through[axis][tuple(layer)], *line, mark[1], mark[2])
            total += sign * float(found.sum())
    return total


@pytest.mark.parametrize("grid", [SQUARE, CUBE], ids=["slab", "room"])
@pytest.mark.parametrize("held", [True, False], ids=["held in a stream", "free in a swirl"])
def test_the_force_is_that_of_a_control_volume(
    monkeypatch: pytest.MonkeyPatch, grid: Grid, held: bool
) -> None:
    world = channel(grid) if held else free(grid)
    stages: list[tuple[Padded, Fluxes]] = []
    carried = kernels.stage

    def recorded(now: Stage, start: Array, before: Array, padded: Padded, flux: Fluxes) -> None:
        stages.append((Padded(*(values.copy() for values in padded)), flux))
        carried(now, start, before, padded, flux)

    crossed = np.zeros(3)

    def evened(velocity: Faces, carrying: transport.Transport, *where: Any) -> None:
        pairs = list(zip(carrying.after.moving, velocity, strict=True))
        was = [float((m[box] * u[box]).sum()) for m, u in pairs]
        damp_eddies(velocity, carrying, *where)
        crossed[:] = [
            float((m[box] * u[box]).sum()) - w for (m, u), w in zip(pairs, was, strict=True)
        ]

    monkeypatch.setattr(kernels, "stage", recorded)
    monkeypatch.setattr(flow, "damp_eddies", evened)
    monkeypatch.setattr(transport, "carry", kernels.carry.__wrapped__)
    box, area = box_in(grid), grid.face_area
    fluid, state = world.flow()
    for _ in range(6):
        stages.clear()
        before = momentum_in(world, box)
        report = step(world, DT)
        assert len(stages) == 2 * len(grid.axes), "one part of the step"
        change = momentum_in(world, box) - before
        for axis in grid.axes:
            pair = stages[2 * grid.axes.index(axis) : 2 * grid.axes.index(axis) + 2]
            left = DT * fluid.density * np.mean([out_of_box(*stage, box) for stage in pair])
            left -= fluid.density * crossed[axis]  # eddies on the sides of the box
            below, above = list(box), list(box)
            below[axis] = slice(box[axis].start - 1, box[axis].start)
            above[axis] = slice(box[axis].stop - 1, box[axis].stop)
            sides = state.pressure[tuple(below)].sum() - state.pressure[tuple(above)].sum()
            force = (DT * area * float(sides) - left - change[axis]) / DT
            exchanged = report.momentum_exchanged[axis] / DT
            assert force == pytest.approx(exchanged, rel=1e-10, abs=1e-10)
    assert np.abs(report.momentum_exchanged).max() / DT > 1e-4

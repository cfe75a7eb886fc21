"""Cases D1, D4 and D5, short, and bars that would lock."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array

from flowborne.solids.flesh_dynamics import static_forces
from flowborne.solvers.cholesky import symmetric_factor
from flowborne_validation import cases
from flowborne_validation import flesh as case
from flowborne_validation.findings import figure_of
from flowborne_validation.flesh_bars import bar_of, tissue_table
from flowborne_validation.worlds import NOWHERE


def test_D1_comes_near_and_nearer() -> None:
    """CSM1 and CSM2, in a slab and in a room: within 2 % of cells that are as long as wide."""
    for result in cases.case("D1").run(quick=True):
        assert result.series is not None
        assert result.series.falls
        assert result.verdict == "pass", f"{result.quantity}: {result.value}"


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4, 0.45, 0.49])
@pytest.mark.parametrize("cells", [(16, 1), (16, 1, 1)])
def test_a_skin_one_element_thick_bends_as_a_plate(cells: tuple[int, ...], poisson: float) -> None:
    """Its end sinks by 4 F L^3 (1 - nu^2) / (E t^3) under a load F along it, to 5 %."""
    length, thickness, young = 1.0, 0.05, 1e6
    tissue = tissue_table(young, poisson, 1000.0)
    bar = bar_of(cells, (length, thickness), tissue, NOWHERE)
    depth = 1.0 if len(cells) == 2 else length / cells[0]
    free = np.flatnonzero(~bar.fixed)
    K, _ = static_forces(bar.model, bar.model.mj.qpos0, np.zeros(bar.model.nv))
    sinking = np.zeros(bar.model.nv)
    load = bar.load((0.0, -depth, 0.0))
    sinking[free] = symmetric_factor(csc_array(K[free][:, free])).solve(load[free])
    q = bar.model.integrate(bar.model.mj.qpos0, sinking, 1e-6)
    expected = 4.0 * (1.0 - poisson**2) * (length / thickness) ** 3 / young
    assert -1e6 * bar.end(q)[1] == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("name", ["D4", "D5"])
def test_large_deflections_and_vibrations(name: str) -> None:
    for result in cases.case(name).run(quick=True):
        assert result.verdict == "pass", f"{result.quantity}: {result.value}"


def test_D5_frequency_in_time_is_that_of_its_step() -> None:
    """sin(omega' dt / 2) = omega dt / 2 / sqrt(1 + beta (omega dt)^2), Newmark's beta = 1/2."""
    runs, ratio, _ = map(figure_of, case.in_time((30, 60), 2).values())
    exact = runs.values[-1] / ratio.values
    for steps, found in zip((30, 60), runs.values, strict=True):
        turn = 2.0 * np.pi / steps
        expected = exact * 2.0 * np.arcsin(0.5 * turn / np.sqrt(1.0 + 0.5 * turn**2)) / turn
        assert found == pytest.approx(expected, rel=3e-4)


def test_D5_triangles_and_tetrahedra_agree() -> None:
    """A short, thick bar in plane strain."""
    found = []
    for cells in ((8, 4), (8, 4, 1)):
        bar = bar_of(cells, (1.0, 0.5), tissue_table(1e5, 0.4, 1000.0), NOWHERE)
        found.append(float(case.modes(bar, 1)[0][0]))
    assert found[1] == pytest.approx(found[0], rel=0.005)

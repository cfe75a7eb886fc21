"""D2 and D3 on a coarse grid, and a stiff flag of flesh against a rigid one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_array

from flowborne.solids.flesh_dynamics import static_forces
from flowborne.solids.flesh_solve import symmetric_factor
from flowborne.validation import case
from flowborne.validation import flag_in_channel as flags
from flowborne.validation.flesh_bars import bar_in_slab


def test_D2_CFD1_on_44_cells() -> None:
    """A flag of two cells: its drag, to the 2 % that the reference asks for.

    The lift, which follows the place of the flag's sides in their cells, is in the report alone.
    """
    values, _ = flags.steady(flags.CFD[0], (44,), quick=True)
    assert flags.judged(flags.CFD[0], "drag", (44,), values[0, :1], 0.02).passed


def test_D3_FSI1_on_44_cells() -> None:
    ux, uy, drag, lift = case("D3").run(quick=True)
    assert ux.value == pytest.approx(ux.reference, rel=0.2)
    assert uy.value == pytest.approx(uy.reference, rel=0.2)
    assert drag.value == pytest.approx(drag.reference, rel=0.025)
    assert lift.value == pytest.approx(lift.reference, rel=0.1)


def test_D3_stiff_flesh_feels_what_a_rigid_flag_does() -> None:
    """Nor does it matter that its forces come by way of its vertices."""
    rigid = flags.CFD[0]
    stiff = replace(rigid, tissue=flags.flag_tissue(0.5e9, 1e3))
    found = []
    for flow in (rigid, stiff):
        world = flags.channel(44, flow)
        flags.start(world, flow, None)
        found.append(flags.march(world, flow, 2.0)[-1, :2])
    np.testing.assert_allclose(found[1], found[0], rtol=2e-3)


def test_D3_slice_is_as_stiff_and_heavy_as_a_metre() -> None:
    """Pulled and bent at its end, as a beam in plane strain; the held face has no mass."""
    tissue = flags.flag_tissue(0.5e6, 1e3)
    model = bar_in_slab((18, 1), flags.SIZE, flags.END, tissue, flags.CYLINDER)
    free = model.mj.body_mass[model.nbody :].sum()
    assert free == pytest.approx(1e3 * 0.35 * 0.02 * (1.0 - 1.0 / 108.0), rel=1e-12)
    flesh, unlocked = model.flesh, np.flatnonzero(~model.locked)
    assert flesh is not None
    at_rest = model.rest().q
    end = np.isclose(flesh.rest[:, 0], flags.END[0])
    K, _ = static_forces(model, at_rest, np.zeros(model.nv))
    factor = symmetric_factor(csc_array(K[unlocked][:, unlocked]))
    J = flesh.jacobian(at_rest)
    young = tissue.young / (1.0 - tissue.poisson**2)
    length, thickness = flags.SIZE
    gives = length / (young * thickness), 4.0 * (length / thickness) ** 3 / young
    simpson = np.array([1.0, 4.0, 1.0]) / 6.0
    order = np.lexsort((flesh.rest[end, 2].round(9), flesh.rest[end, 1].round(9)))
    for axis, expected in enumerate(gives):
        load = np.zeros(flesh.rest.shape)
        load[np.flatnonzero(end)[order], axis] = np.outer(simpson, simpson).ravel()
        found = np.zeros(model.nv)
        found[unlocked] = factor.solve((J.T @ load.ravel())[unlocked])
        assert (J @ found).reshape(-1, 3)[end, axis].mean() == pytest.approx(expected, rel=0.015)


def test_D3_figures_of_a_known_flutter() -> None:
    dt, t = 0.01, 0.01 * np.arange(1000)
    swing = np.sin(2.0 * np.pi * 2.0 * t)
    rows = np.stack([200.0 + 70.0 * swing**2, 5.0 + 230.0 * swing, 0.0 * t, 0.08 * swing], axis=1)
    seen = flags.flutter(rows, dt)
    assert seen.frequency == pytest.approx(2.0, rel=1e-3)
    np.testing.assert_allclose(seen.means, [235.0, 5.0, 0.0, 0.0], rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(seen.amplitudes, [35.0, 230.0, 0.0, 0.08], rtol=2e-3)

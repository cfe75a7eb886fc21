"""D2 and D3 on a coarse grid, and a stiff flag of flesh against a rigid one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flowborne.worlds import set_velocity
from flowborne_validation import flag_in_channel as flags
from flowborne_validation.case import reference
from flowborne_validation.cases import case
from flowborne_validation.findings import Figure
from flowborne_validation.worlds import Parabola


def test_D2_CFD1_on_44_cells() -> None:
    """A flag of two cells: its drag, to the 2 % that the reference asks for.

    The lift, which follows the place of the flag's sides in their cells, is in the report alone.
    """
    (drag, *_), _ = flags.steady(flags.CFD[0], (44,), quick=True)
    figure = Figure(drag, (44,), reference("D2", "CFD1")["drag"])
    (result,) = case("D2").judge({"CFD1, drag": figure})
    assert (result.tolerance, result.verdict) == ("2 %", "pass")


def test_D3_FSI1_repeats_its_own_figures_on_44_cells_after_4_s() -> None:
    """Too few for the published ranges: the flag sinks by 8 % too little."""
    found = case("D3").run(quick=True)
    own = 2.63075e-5, 7.57216e-4, 14.2331, 0.761915
    assert [result.value for result in found] == pytest.approx(own, rel=2e-3)
    assert [result.verdict for result in found] == ["coarse", "coarse", "pass", "pass"]


def test_D3_stiff_flesh_feels_what_a_rigid_flag_does() -> None:
    """Nor does it matter that its forces come by way of its vertices."""
    rigid = flags.CFD[0]
    stiff = replace(rigid, tissue=flags.flag_tissue(0.5e9, 1e3, flags.SETTLING))
    found = []
    for flow in (rigid, stiff):
        world = flags.channel(44, flow)
        set_velocity(world, Parabola(flow.peak))
        found.append(flags.march(world, flow, 1.0)[-1, :2])
    np.testing.assert_allclose(found[1], found[0], rtol=2e-3)


def test_D3_flag_is_held_by_the_cylinder_and_ends_in_A() -> None:
    model = flags.flag_of(flags.flag_tissue(0.5e6, 1e3))
    flesh = model.flesh
    assert flesh is not None
    nodes = flesh.elasticity.rest
    free = np.isin(np.arange(len(nodes)), flesh.moved[0])
    beside = np.hypot(*(nodes[:, :2] - (0.2, 0.2)).T)
    assert beside[~free].max() == pytest.approx(0.05, rel=1e-3)
    assert beside[free].min() > 0.05
    assert nodes[:, 0].max() == pytest.approx(flags.END[0])
    assert np.ptp(nodes[:, 1]) == pytest.approx(flags.SIZE[1])
    assert flesh.volumes.sum() == pytest.approx(0.36 * 0.02, rel=2e-3)


def test_D3_figures_of_a_known_flutter() -> None:
    dt, t = 0.01, 0.01 * np.arange(1000)
    swing = np.sin(2.0 * np.pi * 2.0 * t)
    rows = np.stack([200.0 + 70.0 * swing**2, 5.0 + 230.0 * swing, 0.0 * t, 0.08 * swing], axis=1)
    seen = flags.flutter(rows, dt)
    assert seen.frequency == pytest.approx(2.0, rel=1e-3)
    np.testing.assert_allclose(seen.means, [235.0, 5.0, 0.0, 0.0], rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(seen.amplitudes, [35.0, 230.0, 0.0, 0.08], rtol=2e-3)


def test_a_flow_that_does_not_swing_is_told_as_at_rest() -> None:
    """And is no lost run: on coarse grids vortices may not be shed."""
    time = 0.01 * np.arange(400)
    rows = np.stack([5.0 + np.exp(-time), 2.0 - np.exp(-time), 0.0 * time, 0.0 * time], axis=1)
    seen = flags.flutter(rows, 0.01)
    assert seen.frequency == 0.0
    assert seen.means[:2] == pytest.approx([5.0, 2.0], abs=0.03)
    assert seen.amplitudes[:2] == pytest.approx(0.0, abs=0.01)
    assert "at rest" in seen.line

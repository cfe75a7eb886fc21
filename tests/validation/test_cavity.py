"""F2: the lid-driven cavity at Re 100, on coarse grids."""

import numpy as np
import pytest

import flowborne_validation.cavity
from flowborne.worlds import advance, set_velocity
from flowborne_validation.cases import case
from flowborne_validation.cavity import cavity, primary_vortex, profiles, stream_function


@pytest.fixture(scope="module")
def ran():
    """The case's results by quantity, and its worlds by cells a side, in their steady flow."""
    worlds = {}

    def kept(cells, reynolds):
        worlds[cells] = cavity(cells, reynolds)
        return worlds[cells]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flowborne_validation.cavity, "cavity", kept)
        found = {result.quantity: result for result in case("F2").run(quick=True)}
    return found, worlds


@pytest.fixture
def found(ran):
    return ran[0]


def test_F2_profiles_are_those_of_the_tables(found):
    for name in ("u", "v"):
        result = found[f"max|{name} - table|, Re 100"]
        assert result.verdict == "pass", result.lines


def test_F2_extremes_are_those_of_a_finer_table_than_the_case_has(ran):
    """Marchi, Suero and Araki (2009), who are good to six digits where the printed tables of the
    case are good to some thousandths: v is -0.2538 at least, and not -0.2453."""
    errors = []
    for n in (16, 32):
        u, v = profiles(ran[1][n])
        line = np.linspace(0.0, 1.0, 2001)
        found = u(line).min(), v(line).min(), v(line).max()
        errors.append(np.abs(np.array(found) - (-0.21404, -0.25380, 0.17957)).max())
    assert errors[1] < 0.004, errors
    assert np.log2(errors[0] / errors[1]) > 1.7, errors


def test_F2_vortex(found):
    assert found["x of the vortex, Re 100"].verdict == "pass"
    assert found["y of the vortex, Re 100"].verdict == "pass"
    psi = found["psi of the vortex, Re 100"]
    assert psi.series.order > 1.8, psi.lines
    assert psi.verdict == "pass", psi.lines


def turning(x, y, z):
    """Velocity of psi = -sin^2(pi x) sin^2(pi y), whose vortex is in the middle."""
    u = -(np.sin(np.pi * x) ** 2) * np.pi * np.sin(2.0 * np.pi * y)
    v = np.sin(np.pi * y) ** 2 * np.pi * np.sin(2.0 * np.pi * x)
    return u + 0.0 * z, v + 0.0 * z, 0.0 * (x + y + z)


def test_F2_figures_of_a_known_flow():
    world = cavity(32, 100)
    set_velocity(world, turning)
    x, y, psi = primary_vortex(world)
    np.testing.assert_allclose((x, y, psi), (0.5, 0.5, -1.0), atol=5e-3)
    assert np.abs(stream_function(world)[:, -1]).max() < 1e-12
    u, v = profiles(world)
    assert float(u(0.25)) == pytest.approx(-np.pi, rel=1e-3)
    assert float(v(0.25)) == pytest.approx(np.pi, rel=1e-3)
    advance(world, 0.01)

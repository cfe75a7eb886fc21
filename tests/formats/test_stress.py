"""Stresses of flesh: of turns, of small strains, and as the derivative of the energy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from flowborne.formats.vtkhdf import cauchy_stress, deformation_gradients, von_mises
from flowborne.solids.elasticity import Elasticity
from flowborne.solids.elements import measures, with_middles

MU, LAME = 3e4, 5e4

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0.2, 1, 0], [0.1, 0.3, 1], [1, 1, 1]])


def body(law: int) -> Elasticity:
    """Two quadratic tetrahedra."""
    tetrahedra = np.array([[0, 1, 2, 3], [1, 4, 2, 3]])
    edges, elements = with_middles(len(CORNERS), tetrahedra)
    nodes = np.concatenate([CORNERS, CORNERS[edges].mean(axis=1)])
    assert (measures(nodes, tetrahedra) > 0.0).all()
    return Elasticity(nodes, elements, np.tile([MU, LAME], (2, 1)), np.full(2, law))


@pytest.mark.parametrize("law", [0, 1])
def test_a_turn_makes_no_stress(law: int) -> None:
    elasticity = body(law)
    places = elasticity.rest @ Rotation.from_euler("xyz", [1.0, -0.7, 2.0]).as_matrix().T + 3.0
    stress = cauchy_stress(elasticity, deformation_gradients(elasticity, places))
    assert np.abs(stress).max() < 1e-9 * MU


@pytest.mark.parametrize("law", [0, 1])
def test_small_strains_obey_hooke(law: int) -> None:
    """Both laws are Hooke's in the limit, with their own Lame constants."""
    elasticity, small = body(law), 1e-6
    strain = small * np.array([[0.7, 0.2, -0.1], [0.2, -0.4, 0.3], [-0.1, 0.3, 0.5]])
    F = deformation_gradients(elasticity, elasticity.rest @ (np.eye(3) + strain).T)
    hooke = LAME * np.trace(strain) * np.eye(3) + 2.0 * MU * strain
    assert_allclose(cauchy_stress(elasticity, F), [hooke, hooke], atol=1e-5 * small * MU)


@pytest.mark.parametrize("law", [0, 1])
def test_power_of_the_stress_is_the_change_of_energy(law: int) -> None:
    """dW = V J sigma : dF F^-1 for a uniform F, the energy that of the solver."""
    elasticity, step = body(law), 1e-6
    random = np.random.default_rng(3)
    F = np.eye(3) + 0.2 * random.normal(size=(3, 3))
    change = random.normal(size=(3, 3))
    energy = [elasticity.energy(elasticity.rest @ (F + s * change).T) for s in (step, -step)]
    (sigma, _) = cauchy_stress(elasticity, deformation_gradients(elasticity, elasticity.rest @ F.T))
    volume = np.linalg.det(F) * measures(elasticity.rest, elasticity.elements[:, :4]).sum()
    power = volume * np.sum(sigma * (change @ np.linalg.inv(F)))
    assert (energy[0] - energy[1]) / (2.0 * step) == pytest.approx(power, rel=1e-6)


def test_von_mises_of_pull_and_pressure() -> None:
    stress = np.array([np.diag([5.0, 0.0, 0.0]), -7.0 * np.eye(3)])
    assert_allclose(von_mises(stress), [5.0, 0.0], atol=1e-12)

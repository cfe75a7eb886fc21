"""Elastic elements: forces and stiffness against the energy, and their NumPy reference."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, random_array
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array
from flowborne.kernels.elastic import (
    SAINT_VENANT_KIRCHHOFF,
    STABLE_NEO_HOOKEAN,
    Elements,
    add_stiffness,
    congruent,
    elastic_energy,
    elastic_forces,
    singular_values,
    volume_ratios,
)
from flowborne.solids.elements import shape_gradients, with_middles

from .references.elastic import stiffness_reference, stress_reference

LAWS = (SAINT_VENANT_KIRCHHOFF, STABLE_NEO_HOOKEAN)
MODULI = (2.0, 3.0)


def element(law: int, corners: int) -> tuple[Array, Elements]:
    """Nodes (k, 3) of one oblique element, and the element."""
    points = np.eye(4, 3, -1)[:corners]
    points[:, : corners - 1] += 0.1 * np.random.default_rng(0).standard_normal(
        (corners, corners - 1)
    )
    edges, nodes = with_middles(corners, np.arange(corners)[None])
    every = np.concatenate([points, points[edges].mean(axis=1)])
    gradients, volume = shape_gradients(every, nodes)
    volumes = np.full((1, corners), volume[0] / corners)
    moduli = np.tile(MODULI, (1, corners, 1))
    return every, (nodes, gradients[:, :corners].copy(), volumes, moduli, np.array([law]))


def stiffness_of(u: Array, elements: Elements) -> Array:
    k = len(u)
    slot = (9 * k * np.arange(k)[:, None] + 3 * np.arange(k))[None]
    values = np.zeros(9 * k * k)
    add_stiffness(u, elements, slot, np.full(k, 3 * k), values)
    return values.reshape(3 * k, 3 * k)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("corners", [3, 4])
@pytest.mark.parametrize("amplitude", [0.0, 0.05, 0.4])
def test_forces_are_those_of_the_energy(law: int, corners: int, amplitude: float) -> None:
    nodes, elements = element(law, corners)
    u = amplitude * np.random.default_rng(1).standard_normal(nodes.shape)
    found, expected, eps = elastic_forces(u, elements), np.empty(u.shape), 1e-6
    for at in np.ndindex(u.shape):
        aside = np.zeros(u.shape)
        aside[at] = eps
        rise = elastic_energy(u + aside, elements) - elastic_energy(u - aside, elements)
        expected[at] = -rise / (2.0 * eps)
    if corners == 3:
        expected[:, 2] = found[:, 2] = 0.0
    np.testing.assert_allclose(found, expected, atol=1e-8 * (1.0 + np.abs(found).max()))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("amplitude", [0.0, 0.05, 0.4])
def test_stress_and_stiffness_are_those_of_numpy(law: int, amplitude: float) -> None:
    """At 0.4 of its size the element is inside out in places."""
    nodes, elements = element(law, 4)
    u = amplitude * np.random.default_rng(2).standard_normal(nodes.shape)
    gradients, volumes = elements[1][0], elements[2][0]
    stiffness = stiffness_reference(u, gradients, volumes, np.tile(MODULI, (len(volumes), 1)), law)
    found = stiffness_of(u, elements)
    np.testing.assert_allclose(found, stiffness, atol=1e-8 * np.abs(stiffness).max())
    assert np.linalg.eigvalsh(found)[0] > -1e-12 * np.abs(found).max()
    force, ratios = np.zeros(u.shape), []
    for g, volume in zip(gradients, volumes, strict=True):
        F = np.eye(3) + u.T @ g
        force -= volume * g @ stress_reference(F, *MODULI, law).T
        ratios.append(np.linalg.det(F))
    np.testing.assert_allclose(elastic_forces(u, elements), force, atol=1e-12)
    assert volume_ratios(u, elements)[0] == pytest.approx(min(ratios), abs=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_at_rest_the_stiffness_is_that_of_hooke_and_turns_with_the_element(law: int) -> None:
    nodes, elements = element(law, 4)
    K = stiffness_of(np.zeros(nodes.shape), elements)
    share = np.linalg.eigvalsh(K)
    assert (np.abs(share) < 1e-10).sum() == 6
    assert share[6] > 1e-3
    strain = np.array([[0.3, 0.1, -0.2], [0.1, -0.4, 0.5], [-0.2, 0.5, 0.2]])
    moved = (nodes @ strain).ravel()
    mu, lame = MODULI
    density = mu * (strain**2).sum() + 0.5 * lame * np.trace(strain) ** 2
    assert 0.5 * moved @ K @ moved == pytest.approx(density * elements[2].sum(), rel=1e-12)
    turn = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
    turned = stiffness_of(nodes @ turn.T - nodes, elements)
    whole = np.kron(np.eye(len(nodes)), turn)
    np.testing.assert_allclose(turned, whole @ K @ whole.T, atol=1e-12 * np.abs(K).max())
    assert np.abs(elastic_forces(nodes @ turn.T - nodes, elements)).max() < 1e-13


def test_singular_values_of_any_matrix() -> None:
    rng, U, V, sigma = np.random.default_rng(3), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    flat = np.outer([1.0, 2.0, 0.5], [0.3, 0.0, 1.0])
    for F in (*rng.standard_normal((20, 3, 3)), np.eye(3), np.zeros((3, 3)), flat):
        singular_values(np.ascontiguousarray(F), U, V, sigma)
        np.testing.assert_allclose(U * sigma @ V.T, F, atol=1e-12)
        for turn in (U, V):
            np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
            assert np.linalg.det(turn) == pytest.approx(1.0)
        expected = np.linalg.svd(F, compute_uv=False)
        np.testing.assert_allclose(np.abs(sigma), expected, atol=1e-7)
        assert sigma[0] >= sigma[1] >= abs(sigma[2]) - 1e-7


def test_a_stiffness_between_nodes_becomes_one_between_dofs() -> None:
    """Rows 0 to 8 move with dofs of their own, in turned axes; others with bones or not at all."""
    rng = np.random.default_rng(4)
    half = random_array((15, 15), density=0.2, rng=rng)
    K, J = csr_array(half + half.T), np.zeros((15, 11))
    for n in range(0, 9, 3):
        J[n : n + 3, n : n + 3] = Rotation.random(rng=rng).as_matrix()
    J[9:13, 9:] = rng.standard_normal((4, 2))
    moving = csr_array(J)
    pattern = csr_array(np.ones((11, 11)))
    values = np.zeros(pattern.nnz)
    parts = [(m.indptr, m.indices, m.data) for m in (K, moving)]
    congruent(values, pattern.indptr, pattern.indices, *parts, np.array([9, 10]))
    np.testing.assert_allclose(values.reshape(11, 11), J.T @ K.toarray() @ J, atol=1e-14)

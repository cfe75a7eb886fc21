"""The built-in fish of flesh: its files, its symmetry, and its first strokes."""

from __future__ import annotations

import numpy as np
import pytest

import fish
from flowborne.scenes.build import build
from flowborne.scenes.load import load_scene
from flowborne.sim.simulation import Simulation
from flowborne.solids.elements import measures
from flowborne.solids.tissue.mesh_file import read_mesh

COARSE = {"domain.resolution": "36"}
"""Four cells across its body."""


def test_its_files_are_those_of_the_tool() -> None:
    flesh, hulls = fish.mesh()
    kept = read_mesh(fish.LIBRARY / "fish.npz")
    assert kept.holders == flesh.holders
    np.testing.assert_array_equal(kept.elements, flesh.elements)
    np.testing.assert_allclose(kept.points, flesh.points, atol=1e-12)
    assert (fish.LIBRARY / "fish.xml").read_text() == fish.model(hulls)


@pytest.mark.parametrize("axis", [1, 2])
def test_its_flesh_is_its_own_mirror_image(axis: int) -> None:
    flesh, _ = fish.mesh()
    places = {tuple(point): number for number, point in enumerate(flesh.points.round(9) + 0.0)}
    mirrored = flesh.points.round(9)
    mirrored[:, axis] *= -1.0
    image = np.array([places[tuple(point)] for point in mirrored + 0.0])
    assert [flesh.holders[number] for number in image] == list(flesh.holders)
    elements = {frozenset(element) for element in flesh.elements.tolist()}
    assert {frozenset(element) for element in image[flesh.elements].tolist()} == elements


def test_flesh_and_bones_fill_the_fish_and_weigh_what_it_displaces() -> None:
    flesh, _ = fish.mesh()
    assert measures(flesh.points, flesh.elements).min() > 0.0
    model = build(load_scene("fish", COARSE)).world.setup.solid
    corners = np.sin(2.0 * np.pi / fish.AROUND) * fish.AROUND / 2.0  # an octagon in an ellipse
    at, _ = fish.stations()
    areas = [corners * fish.half_width(s) * fish.half_height(s) for s in at]
    between = zip(areas, areas[1:], np.diff(at) * fish.LENGTH, strict=False)
    volume = sum((a + b + np.sqrt(a * b)) / 3.0 * length for a, b, length in between)
    assert model.body_mass.sum() == pytest.approx(1000.0 * volume, rel=0.02)


def first_gradient(positions: str) -> np.ndarray:
    """(10,) of the first decision from a pose, in m/s per rad."""
    settings = {"controller.gradient": "central", "initial.positions": positions}
    with Simulation(load_scene("fish", COARSE | settings), workers=1) as simulation:
        simulation.advance_frame()
        return np.asarray(simulation.world.memory["gradient"])


def test_bent_the_other_way_it_decides_the_mirror_image() -> None:
    """The grid is its own mirror image, too."""
    left = first_gradient("{ joint_1 = 1.0, joint_10 = -2.0 }")
    right = first_gradient("{ joint_1 = -1.0, joint_10 = 2.0 }")
    assert np.abs(left).max() > 1e-4
    np.testing.assert_allclose(right, -left, rtol=0.0, atol=0.02 * np.abs(left).max())

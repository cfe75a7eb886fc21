"""Inertia of the human's bodies, such that de Leva's segments come out exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.motion.human.segments import Sex, ends_of, measures_of, segments, shares_of
from flowborne.motion.human.skeleton import Array, Skeleton

APART = 0.95
"""Most that the distances between a segment's bodies may make of its inertia in any direction."""


@dataclass(frozen=True, eq=False)
class Inertia:
    """Inertia of a body at rest.

    mass    kg
    centre  (3,) m, centre of mass
    tensor  (3, 3) kg m^2, about the centre along the world's axes
    """

    mass: float
    centre: Array
    tensor: Array

    def part(self, share: float) -> Inertia:
        """A share of the mass, spread as the whole."""
        return Inertia(share * self.mass, self.centre, share * self.tensor)


def axes_of(start: Array, end: Array, ahead: Array | None = None) -> Array:
    """(3, 3) columns: sagittal, transverse and longitudinal axis of a segment, right-handed.

    The longitudinal axis points from end to start. The sagittal one is as near to `ahead` as can
    be: x when not given, or z when the segment itself points along x, as a foot does.
    """
    longitudinal = (start - end) / np.linalg.norm(start - end)
    if ahead is None:
        ahead = np.eye(3)[2 if abs(longitudinal[0]) > np.sqrt(0.5) else 0]
    sagittal = ahead - (ahead @ longitudinal) * longitudinal
    sagittal /= np.linalg.norm(sagittal)
    return np.column_stack([sagittal, np.cross(longitudinal, sagittal), longitudinal])


def inertias(skeleton: Skeleton, mass: float, sex: Sex) -> dict[str, Inertia]:
    """Inertia of each body of a human of `mass` kg.

    A segment that is one body has de Leva's figures. One of several bodies, at rest, has them as
    a whole: the bodies' centres of mass are the middles of their bones, moved together so that the
    segment's is in its place; where they are too far apart for the segment's radii of gyration
    they are drawn in towards it. What inertia then remains the bodies share by their mass.
    """
    found: dict[str, Inertia] = {}
    for segment in segments():
        found |= _of_segment(segment, skeleton, mass, sex)
    return found


def _of_segment(segment: str, skeleton: Skeleton, mass: float, sex: Sex) -> dict[str, Inertia]:
    figures, shares = measures_of(segment, sex), shares_of(segment, sex)
    start, end = ends_of(segment, skeleton)
    centre = start + figures.centre * (end - start)
    whole = _second_moment(segment, skeleton, sex)
    weight = np.array(list(shares.values()))
    middle = np.array([np.mean(skeleton.bone(body), axis=0) for body in shares])
    away = middle - weight @ middle
    inward = np.linalg.inv(np.linalg.cholesky(whole))
    spread = float(np.linalg.eigvalsh(inward @ (away.T * weight) @ away @ inward.T)[-1])
    away *= min(1.0, np.sqrt(APART / max(spread, APART)))
    rest = whole - (away.T * weight) @ away
    tensor = np.trace(rest) * np.eye(3) - rest
    kilograms = figures.mass * mass
    return {
        body: Inertia(share * kilograms, centre + offset, share * kilograms * tensor)
        for (body, share), offset in zip(shares.items(), away, strict=True)
    }


def _second_moment(segment: str, skeleton: Skeleton, sex: Sex) -> Array:
    """(3, 3) m^2: a segment's mean of x x^T about its centre of mass, along the world's axes."""
    figures = measures_of(segment, sex)
    start, end = ends_of(segment, skeleton)
    radii = np.array([figures.sagittal, figures.transverse, figures.longitudinal])
    squares = (float(np.linalg.norm(end - start)) * radii) ** 2
    axes = axes_of(start, end)
    return np.asarray(axes @ np.diag(0.5 * squares.sum() - squares) @ axes.T)

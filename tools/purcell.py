"""Displacement per cycle of Purcell's three-link swimmer in Stokes flow: the reference of case C5.

`python tools/purcell.py` prints the figures of references.json. The swimmer's surface carries
regularised Stokeslets (Cortez, Fauci and Medovikov 2005); neither force nor torque acts on it. Slip
walls act by their images, a lattice of swimmers, summed as by Hasimoto (1959) and by Lindbo and
Tornberg (2010). The flow is symmetric about z = 0, so only points with z > 0 are unknowns.

A link has the length 1 between its hinges, and the fluid the viscosity 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve
from scipy.special import erfc

from flowborne_validation.creeping import AHEAD, BASIN, CYCLE

Array = NDArray[np.float64]
Radial = Callable[[Array], tuple[Array, Array]]
Velocity = Callable[[Array, Array, Array], Array]
"""Rates of the pose from the pose, the angles of the hinges and their rates."""

REGULARISATION = 0.37
"""Of the Stokeslets, in distances of points: the drag of a sphere is right within 0.2 % from 84
points on."""

RUNS = [(4, 8, 16, BASIN), (4, 12, 24, None), (8, 8, 16, None), (16, 6, 12, None), (32, 4, 8, None)]
"""Slenderness, two numbers of points around a link, and box."""

SPLIT = 3.0
"""Of the lattice sum: terms below exp(-SPLIT^2) are left out."""


def interaction(x: Array, y: Array, factors: Sequence[float] | Array, radial: Radial) -> Array:
    """(3, n, 3, m): velocity of x, (n, 3), by forces on y, (m, 3), whose components have factors;
    it is a(r^2) r r + b(r^2) for the radial functions a and b, over 8 pi."""
    d = (x[:, None] - y[None]).transpose(2, 0, 1)
    a, b = radial((d**2).sum(axis=0))
    found = np.empty((3, len(x), 3, len(y)))
    for i, j in product(range(3), repeat=2):
        found[i, :, j] = factors[j] * (a * d[i] * d[j] + (b if i == j else 0.0))
    return found / (8.0 * np.pi)


def stokeslets(x: Array, spacing: float) -> Array:
    """(3, n, 3, n): velocity by forces on the points and on their mirror images in z = 0."""
    epsilon = REGULARISATION * spacing

    def radial(r2: Array) -> tuple[Array, Array]:
        near = r2 + epsilon**2
        return near**-1.5, (near + epsilon**2) * near**-1.5

    mirrored = interaction(x, x * (1.0, 1.0, -1.0), (1.0, 1.0, -1.0), radial)
    return interaction(x, x, (1.0, 1.0, 1.0), radial) + mirrored


def images(x: Array, box: Sequence[float]) -> Array:
    """(3, n, 3, n): what slip walls add to `stokeslets`; the box has its middle in the origin."""
    size, mirrored = np.asarray(box), x * (1.0, 1.0, -1.0)
    xi = 2.5 / size.min()
    reach, highest = SPLIT / xi, 2.0 * xi * SPLIT

    def near(r2: Array) -> tuple[Array, Array]:
        r, g = np.sqrt(r2), 2.0 * xi / np.sqrt(np.pi) * np.exp(-(xi**2) * r2)
        a = (g + erfc(xi * r) / r) / r2
        return a, a * r2 - 2.0 * g

    def own(r2: Array) -> tuple[Array, Array]:  # less a free Stokeslet, with its limit at r = 0
        a, b = near(np.maximum(r2, 1e-8))
        r = np.sqrt(np.maximum(r2, 1e-8))
        return a - r**-3, np.where(r2 < 1e-8, -4.0 * xi / np.sqrt(np.pi), b - 1.0 / r)

    found = interaction(x, x, (1.0, 1.0, 1.0), own)
    for *walls, plane in product((-1, 0, 1), (-1, 0, 1), (-1, 0, 1), (1.0, -1.0)):
        signs = np.where(np.array(walls) % 2, -1.0, 1.0)
        y = signs * (x if plane > 0.0 else mirrored) + np.array(walls) * size
        close = (np.abs(y) < np.abs(x).max(axis=0) + reach).all(axis=1)
        factors = signs * (1.0, 1.0, plane)
        if plane < 0.0 and not any(walls):
            found += interaction(x, y, factors, own)
        elif any(walls) and close.any():
            found[..., close] += interaction(x, y[close], factors, near)

    counts = [np.arange(int(highest * side / np.pi) + 1) for side in box]
    k = np.stack(np.meshgrid(*counts, indexing="ij"), axis=-1).reshape(-1, 3) * np.pi / size
    k2 = (k**2).sum(axis=1)
    k, k2 = k[(k2 > 0.0) & (k2 < highest**2)], k2[(k2 > 0.0) & (k2 < highest**2)]
    weight = (1.0 + k2 / (4.0 * xi**2)) / k2**2 * np.exp(-k2 / (4.0 * xi**2))
    weight *= 2.0 ** np.count_nonzero(k, axis=1) / size.prod()

    def waves(y: Array) -> Array:
        phase = (y + 0.5 * size).T[:, :, None] * k.T[:, None]
        c, s = np.cos(phase), np.sin(phase)
        return np.array([s[0] * c[1] * c[2], c[0] * s[1] * c[2], c[0] * c[1] * s[2]])

    here, there = waves(x), waves(mirrored) * np.array([1.0, 1.0, -1.0])[:, None, None]
    there += here
    for i, j in product(range(3), repeat=2):
        part = weight * ((k2 if i == j else 0.0) - k[:, i] * k[:, j])
        found[i, :, j] += (here[i] * part) @ there[j].T
    return found


def ring(x: float, radius: float, spacing: float) -> Array:
    """Points with z > 0 of a circle around the x axis."""
    count = max(2, round(np.pi * radius / spacing))
    angle = (np.arange(count) + 0.5) * np.pi / count
    return np.stack([np.full(count, x), radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def spheroid(half: float, radius: float, spacing: float) -> Array:
    """Points of a spheroid around the x axis, of half the length `half`."""
    t = np.linspace(0.0, np.pi, 4001)
    steps = np.hypot(np.diff(half * np.cos(t)), np.diff(radius * np.sin(t)))
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    count = round(arc[-1] / spacing)
    at = np.interp((np.arange(count) + 0.5) / count * arc[-1], arc, t)
    return np.concatenate([ring(half * np.cos(s), radius * np.sin(s), spacing) for s in at])


def capsule(radius: float, spacing: float) -> Array:
    """Points of a capsule whose axis is from 0 to 1 on the x axis."""
    count, caps = round(1.0 / spacing), max(2, round(0.5 * np.pi * radius / spacing))
    rings = [ring((k + 0.5) / count, radius, spacing) for k in range(count)]
    for angle in (np.arange(caps) + 0.5) * 0.5 * np.pi / caps:
        out, around = radius * np.sin(angle), radius * np.cos(angle)
        rings += [ring(1.0 + out, around, spacing), ring(-out, around, spacing)]
    return np.concatenate(rings)


def turned(x: Array, angle: float) -> Array:
    """Points turned about the z axis."""
    c, s = np.cos(angle), np.sin(angle)
    return x @ np.array([(c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)])


def frames(pose: Array, angles: Array) -> tuple[Array, Array]:
    """Starts (3, 3) and angles (3,) of the links' axes: the left, the middle and the right one.

    pose    x, y and angle of the middle link
    angles  of the left and the right hinge
    """
    place = np.array([pose[0], pose[1], 0.0])
    half = turned(np.array([[0.5, 0.0, 0.0]]), pose[2])[0]
    turns = pose[2] + np.array([np.pi + angles[0], 0.0, angles[1]])
    return np.array([place - half, place - half, place + half]), turns


def surface(starts: Array, turns: Array, radius: float, spacing: float) -> tuple[Array, Array]:
    """Points (n, 3) of the links' common surface, and the link of each."""
    rod, points, links = capsule(radius, spacing), [], []
    for link, (start, turn) in enumerate(zip(starts, turns, strict=True)):
        x, margin = turned(rod, turn) + start, 0.0 if link == 1 else 0.25 * spacing
        outside = np.ones(len(x), bool)
        for other in {0, 1, 2} - {link}:
            local = turned(x - starts[other], -turns[other])
            local[:, 0] -= np.clip(local[:, 0], 0.0, 1.0)
            outside &= np.linalg.norm(local, axis=1) > radius * (1.0 + 1e-6) + margin
        points.append(x[outside])
        links.append(np.full(int(outside.sum()), link))
    return np.concatenate(points), np.concatenate(links)


def rigid(x: Array, about: Array) -> Array:
    """(3, 3, n): velocities of points at unit velocity along x and y and unit rate about z."""
    zero, one = np.zeros(len(x)), np.ones(len(x))
    turning = (about[1] - x[:, 1], x[:, 0] - about[0], zero)
    return np.array([(one, zero, zero), (zero, one, zero), turning])


def motions(x: Array, links: Array, starts: Array, pose: Array, rates: Array) -> Array:
    """(4, 3, n): velocities of points in the swimmer's three rigid motions, and by its hinges."""
    left, right = (
        rate * rigid(x, starts[link])[2] * (links == link)
        for link, rate in zip((0, 2), rates, strict=True)
    )
    return np.concatenate([rigid(x, pose), [left + right]])


def free(moves: Array, forces: Array) -> Array:
    """Rates of the three rigid motions at which neither force nor torque acts on the swimmer.

    forces  (4, 3, n), that its points exert in each of its motions
    """
    resistance = np.einsum("ain,bin->ab", moves[:3], forces)
    return -np.linalg.solve(resistance[:, :3], resistance[:, 3])


def drag(x: Array, spacing: float) -> Array:
    """Drag at unit velocity along x and y of the body with these points."""
    moves = rigid(x, np.zeros(3))[:2]
    return 2.0 * np.einsum("ain,ain->a", moves, exerted(stokeslets(x, spacing), moves))


def exerted(matrix: Array, moves: Array) -> Array:
    """Forces on points, (k, 3, n), that move them like this."""
    n = moves[0].size
    forces = solve(matrix.reshape(n, n), moves.reshape(-1, n).T, assume_a="pos")
    return forces.T.reshape(moves.shape)


def by_stokeslets(radius: float, spacing: float, box: Sequence[float] | None) -> Velocity:
    """Velocity of the swimmer in Stokes flow, in a box with slip walls or in endless fluid."""

    def velocity(pose: Array, angles: Array, rates: Array) -> Array:
        starts, turns = frames(pose, angles)
        x, links = surface(starts, turns, radius, spacing)
        moves = motions(x, links, starts, pose, rates)
        matrix = stokeslets(x, spacing) + (0.0 if box is None else images(x, box))
        return free(moves, exerted(matrix, moves))

    return velocity


def by_resistive_forces(ratio: float) -> Velocity:
    """The same by resistive-force theory, with the ratio of drags across and along a link."""
    along, weights = np.polynomial.legendre.leggauss(2)

    def velocity(pose: Array, angles: Array, rates: Array) -> Array:
        starts, turns = frames(pose, angles)
        links = np.repeat([0, 1, 2], len(along))
        tangents = np.array([np.cos(turns), np.sin(turns), np.zeros(3)])[:, links]
        x = starts[links] + np.tile(0.5 + 0.5 * along, 3)[:, None] * tangents.T
        moves = motions(x, links, starts, pose, rates)
        lengthwise = np.einsum("ain,in->an", moves, tangents)[:, None] * tangents
        return free(moves, np.tile(weights, 3) * (ratio * moves + (1.0 - ratio) * lengthwise))

    return velocity


def cycle(velocity: Velocity, steps: int = 2) -> float:
    """Displacement in a cycle: twice that of half a cycle along the axis in which the other half is
    its mirror image.

    steps  of Runge and Kutta's fourth order in a quarter of a cycle; with 2 right within 0.1 %
    """
    pose, dt = np.array([0.0, 0.0, AHEAD]), 1.0 / steps
    for first, last in pairwise(CYCLE.T[:3]):
        for t in np.arange(steps) * dt:
            rates = last - first
            one = velocity(pose, first + t * rates, rates)
            middle = first + (t + 0.5 * dt) * rates
            two = velocity(pose + 0.5 * dt * one, middle, rates)
            three = velocity(pose + 0.5 * dt * two, middle, rates)
            four = velocity(pose + dt * three, first + (t + dt) * rates, rates)
            pose = pose + dt / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    axis = 0.5 * (AHEAD + pose[2])
    return float(2.0 * (pose[0] * np.cos(axis) + pose[1] * np.sin(axis)))


def displacement(
    slenderness: float, around: int, box: Sequence[float] | None = None
) -> tuple[int, float]:
    """Number of points, and displacement in a cycle by regularised Stokeslets.

    slenderness  length of a link between its hinges over its diameter
    around       points around a link
    """
    radius = 0.5 / slenderness
    spacing = 2.0 * np.pi * radius / around
    points = len(surface(*frames(np.zeros(3), CYCLE[:, 0]), radius, spacing)[0])
    return 2 * points, cycle(by_stokeslets(radius, spacing, box))


def spheroid_drag(ratio: float) -> Array:
    """Drag of a spheroid of half the length 1 along and across it (Chwang and Wu 1975)."""
    e = np.sqrt(1.0 - ratio**-2)
    log = np.log((1.0 + e) / (1.0 - e))
    along, across = (1.0 + e**2) * log - 2.0 * e, (3.0 * e**2 - 1.0) * log + 2.0 * e
    return 16.0 * np.pi * e**3 / np.array([along, 0.5 * across])


def main() -> None:
    """Print the drag of known bodies, and the swimmer's displacement."""
    for around in (12, 24, 36):
        spacing = 2.0 * np.pi / around
        ball = drag(spheroid(1.0, 1.0, spacing), spacing) / (6.0 * np.pi)
        long = drag(spheroid(8.0, 1.0, spacing), spacing) / (8.0 * spheroid_drag(8.0))
        print(f"{around} points around: drag of a sphere {ball}, of a spheroid of 8:1 {long}")
    limits = {}
    for slenderness, coarse, fine, box in RUNS:
        (few, one), (many, two) = (displacement(slenderness, n, box) for n in (coarse, fine))
        limit = two + (two - one) * coarse / (fine - coarse)  # errors of first order
        where = f"{slenderness}:1 in {box or 'endless fluid'}"
        print(f"{where}, {few} points {one:.4f}, {many} {two:.4f}: {limit:.4f}", flush=True)
        if box is None:
            limits[1.0 / np.log(2.0 * slenderness)] = limit
    fit = np.polynomial.Polynomial.fit(list(limits), list(limits.values()), 2)
    theory = cycle(by_resistive_forces(2.0))
    print(f"limit of slender links {fit(0.0):.4f}; by resistive-force theory {theory:.4f}")


if __name__ == "__main__":
    main()

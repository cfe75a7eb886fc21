"""The kernels of `flux` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Faces, Marks
from flowborne.kernels.flux import CLEAR, GHOSTS, ROOM, UPSTREAM, Fluxes, Padded, Stage


def line_flux_reference(
    flux: Array, a: Array, b: Array, c: Array, d: Array, one: Marks, other: Marks
) -> Array:
    """`line_flux` in NumPy, of the fluxes g through the sides between b and c of a, b, c, d."""
    forward = flux > 0.0
    behind, upstream, downstream, ahead = np.where(forward, (a, b, c, d), (d, c, b, a))
    bends = np.stack([behind - 2.0 * upstream + downstream, upstream - 2.0 * downstream + ahead])
    room = np.where(bends.prod(axis=0) > 0.0, ROOM * np.abs(bends).min(axis=0), 0.0)
    low, high = np.minimum(upstream, downstream) - room, np.maximum(upstream, downstream) + room
    smooth = np.clip((5.0 * upstream + 2.0 * downstream - behind) / 6.0, low, high)
    either = np.where(np.maximum(one, other) == UPSTREAM, upstream, 0.5 * (b + c))
    return np.asarray(flux * np.where((one == CLEAR) & (other == CLEAR), smooth, either))


def side_fluxes_reference(flux: Fluxes) -> Faces:
    """Volume per time through all sides of the control volumes across each axis."""
    through, component = [], flux.component
    for axis, q in enumerate(flux.through):
        own = int(axis == component)
        count = q.shape[component] + 1
        at, part = flux.place[own, :count], flux.share[own, :count]
        q = np.moveaxis(q, component, -1)
        mean = part[:, 0] * q[..., at[:, 0]] + part[:, 1] * q[..., at[:, 1]]
        through.append(np.ascontiguousarray(np.moveaxis(mean, -1, component)))
    return through[0], through[1], through[2]


def net_flux_reference(field: Array, marks: Marks, gx: Array, gy: Array, gz: Array) -> Array:
    """`net_flux` in NumPy, of the fluxes through the sides of the control volumes."""
    shape = gz.shape[0], gz.shape[1], gz.shape[2] - 1
    inner = [
        slice(GHOSTS, -GHOSTS) if n < m else slice(None)
        for n, m in zip(shape, field.shape, strict=True)
    ]
    net = np.zeros(shape)
    for axis, flux in enumerate((gx, gy, gz)):
        if field.shape[axis] == shape[axis]:
            continue
        along = list(inner)
        along[axis] = slice(None)
        f = np.moveaxis(field[tuple(along)], axis, 0)
        m = np.moveaxis(marks[tuple(along)], axis, 0)
        through = line_flux_reference(
            np.moveaxis(flux, axis, 0), f[:-3], f[1:-2], f[2:-1], f[3:], m[1:-2], m[2:-1]
        )
        net += np.diff(np.moveaxis(through, 0, axis), axis=axis)
    return net


def stage_reference(
    now: Stage, start: Array, before: Array, padded: Padded, flux: Fluxes
) -> tuple[Array, Array]:
    """`stage` in NumPy: the component after it, and what was kept for the next one."""
    half = 0.5 * now.dt * net_flux_reference(*padded, *side_fluxes_reference(flux))
    kept = before * start - half if now.weight == 1.0 else now.kept
    return (kept - half) / np.where(now.volume > now.nothing, now.volume, 1.0), kept


def largest_crossing_reference(q: Faces) -> float:
    """`largest_crossing` in NumPy."""
    rates = []
    for axis, flux in enumerate(q):
        size = np.moveaxis(np.abs(flux), axis, 0)
        rates.append(np.moveaxis(np.maximum(size[:-1], size[1:]), 0, axis))
    return float(sum(rates).max())

"""The kernels of `fleeting` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers


def what_leaves_reference(
    field: Array,
    later: Array,
    volumes: Array,
    listed: Integers,
    beside: Integers,
    row: Integers,
    out: Array,
    nothing: float,
) -> Array:
    """`what_leaves` in NumPy, as one system of equations."""
    values, volume, n = field.ravel(), volumes.ravel()[listed], np.arange(listed.size)
    inner, among = beside >= 0, (beside >= 0) & (row >= 0)
    passed, came = np.where(inner, out, 0.0), np.where(inner, np.maximum(-out, 0.0), 0.0)
    amount = later.ravel()[listed] * np.where(volume > nothing, volume, 1.0)
    amount += (passed * 0.5 * (values[listed][:, None] + values[beside])).sum(axis=1)
    amount += (came * values[beside] * ~among).sum(axis=1)
    system = np.diag(volume + np.maximum(passed, 0.0).sum(axis=1))
    np.subtract.at(system, (np.repeat(n, 6)[among.ravel()], row[among]), came[among])
    return np.asarray(np.linalg.solve(system, amount))


def let_through_reference(
    later: Array,
    net: Array,
    field: Array,
    volumes: Array,
    listed: Integers,
    beside: Integers,
    row: Integers,
    rate: Array,
    arriving: Array,
    leaving: Array,
    dt: float,
    nothing: float,
) -> tuple[Array, Array]:
    """`let_through` in NumPy: `later` and `net` after it."""
    values, change = field.ravel(), np.zeros_like(field)
    entering = np.where(row >= 0, leaving[row], arriving)
    passed = np.where(rate > 0.0, leaving[:, None], entering)
    more = rate * (passed - 0.5 * (values[listed][:, None] + values[beside])) * (beside >= 0)
    np.add.at(change.reshape(-1), listed, more.sum(axis=1))
    apart = (beside >= 0) & (row < 0)
    np.subtract.at(change.reshape(-1), beside[apart], more[apart])
    return later - dt * change / np.where(volumes > nothing, volumes, 1.0), net + change

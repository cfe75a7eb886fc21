"""The kernels for dye in cut cells in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.dye import CUT, EMPTY, WHOLE, Marks

from .control_volumes import neighbours_reference


def beside_reference(
    listed: Integers, shape: Integers, wraps: Integers
) -> tuple[Integers, Integers]:
    """(n, 6) each: the cells beside, and their places in the list, or -1."""
    beside = neighbours_reference(shape, wraps)[:, listed].T
    at = np.minimum(np.searchsorted(listed, beside), listed.size - 1)
    return beside, np.where((beside >= 0) & (listed[at] == beside), at, -1)


def pass_on_reference(
    field: Array,
    volume: Array,
    listed: Integers,
    beside: Integers,
    row: Integers,
    out: Array,
    entering: Array,
    gain: Array,
    brought: Array,
    local: Array,
) -> tuple[Array, Array, float]:
    """`pass_on` in NumPy, as one system of equations: field and volumes after it, what came in."""
    c, v, n = field.ravel(), volume.ravel(), np.arange(listed.size)
    came, gone = np.maximum(-out, 0.0), np.maximum(out, 0.0)
    taken, given = np.maximum(-local, 0.0), np.maximum(local, 0.0)
    arrived, left = gain + came.sum(axis=1), gone.sum(axis=1) + taken
    among, beyond = row >= 0, beside < 0
    known = brought + (came * np.where(beyond, entering, c[beside]) * ~among).sum(axis=1)
    share = np.ones(n.size)
    swift = (left > v[listed] + given) & (arrived > 0.0)
    share[swift] = (v[listed] + given)[swift] / left[swift]
    # leaving = share c + (1 - share) (known + what others pass on) / arrived
    passed = (1.0 - share) / np.where(arrived > 0.0, arrived, 1.0)
    system = np.eye(n.size)
    np.subtract.at(
        system, (np.repeat(n, 6)[among.ravel()], row[among]), (passed[:, None] * came)[among]
    )
    leaving = np.linalg.solve(system, share * c[listed] + passed * known)
    later, through = v.copy(), gone * leaving[:, None]
    later[listed] += gain + local - out.sum(axis=1)
    arriving = known + (came * leaving[row] * among).sum(axis=1)
    amount = v * c
    amount[listed] += arriving + given * c[listed] - taken * leaving - through.sum(axis=1)
    apart = ~among & ~beyond
    np.add.at(later, beside[apart], out[apart])
    np.add.at(amount, beside[apart], (through - came * c[beside])[apart])
    gained = (came * entering - through)[beyond].sum() + brought.sum()
    gained += given @ c[listed] - taken @ leaving
    values = amount / np.where(later > 0.0, later, 1.0)
    return values.reshape(field.shape), later.reshape(field.shape), float(gained)


def sort_cells_reference(
    before: Array, after: Array, rate: Array, x: Array, y: Array, z: Array, whole: float
) -> tuple[Marks, Array]:
    """`sort_cells` in NumPy."""
    net, gross = np.zeros(before.shape), np.zeros(before.shape)
    for axis, flux in enumerate((x, y, z)):
        net += np.diff(flux, axis=axis)
        size = np.abs(flux)
        gross += np.delete(size, 0, axis) + np.delete(size, -1, axis)
    clear = (np.minimum(before, after) >= whole) & (rate == 0.0)
    nothing = (before == 0.0) & (after == 0.0) & (rate == 0.0) & (gross == 0.0)
    kind = np.where(clear, WHOLE, np.where(nothing, EMPTY, CUT)).astype(np.uint8)
    least = np.maximum(np.minimum(before, after), whole)
    return kind, np.where(clear, 0.5 * (gross + net) / least, 0.0).max(axis=(1, 2))

"""The kernels of `control_volumes` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Marks, Mask


def neighbours_reference(shape: Integers, wraps: Integers) -> Integers:
    """(6, n) `neighbour` of all control volumes: lower and upper one along each axis in turn."""
    at, found = np.indices(tuple(shape)), []
    for axis in range(3):
        for side in (-1, 1):
            to = at.copy()
            to[axis] += side
            if wraps[axis] > 0:
                to[axis] %= wraps[axis]
            inside = (to[axis] >= 0) & (to[axis] < shape[axis]) & (shape[axis] > 1)
            flat = np.ravel_multi_index(tuple(to), tuple(shape), mode="clip")
            found.append(np.where(inside, flat, -1).ravel())
    return np.stack(found)


def largest_reference(candidates: Integers, worth: Array, least: float) -> tuple[Integers, Mask]:
    """Of candidates (k, n) the first of largest worth (k, n), and whether that exceeds `least`."""
    best = worth.argmax(axis=0)[None]
    return np.take_along_axis(candidates, best, 0)[0], worth.max(axis=0) > least


def find_targets_reference(
    small: Integers,
    pushed: Marks,
    opened: Array,
    volumes: Array,
    cells: Array,
    component: int,
    wraps: Integers,
    nothing: float,
) -> Array:
    """`find_targets` in NumPy: the share of each control volume (n, all) in each closed one."""
    beside = neighbours_reference(np.array(opened.shape), wraps)[:, small]
    driven = (beside >= 0) & (pushed.ravel()[beside] > 0)
    ends = [(int(axis == component),) * 2 for axis in range(3)]
    wide = np.pad(cells, ends, mode="wrap" if wraps[component] > 0 else "constant")
    own = np.unravel_index(small, opened.shape)
    ahead, shut = np.zeros(beside.shape), np.zeros(small.size)
    for side in (0, 1):
        way = 2 * component + side
        cell = wide[tuple(at + side * (axis == component) for axis, at in enumerate(own))]
        cell = np.where(cell > nothing, cell, 0.0)
        ahead[way] = np.where(driven[way], cell * opened.ravel()[beside[way]], 0.0)
        shut += np.where(driven[way], 0.0, cell)
    across = driven & (np.arange(6) // 2 != component)[:, None]
    around = np.where(across, volumes.ravel()[beside], 0.0)
    beside_it = around.sum(axis=0)
    parts = ahead + around / np.where(beside_it > 0.0, beside_it, 1.0) * np.where(
        ahead.any(axis=0), shut, 1.0
    )
    while True:
        led = (beside >= 0) & np.isin(beside, small[parts.any(axis=0)])
        joined = np.where(led, np.maximum(volumes.ravel()[beside], nothing), 0.0)
        new = joined.any(axis=0) & ~parts.any(axis=0)
        if not new.any():
            break
        parts[:, new] = joined[:, new]
    shares = np.zeros((small.size, opened.size))
    total = parts.sum(axis=0)
    np.add.at(shares, (np.arange(small.size), beside), parts / np.where(total > 0.0, total, 1.0))
    return shares


def merge_small_reference(
    amount: Array, small: Integers, targets: Integers, shares: Array
) -> Array:
    """`merge_small` in NumPy: the amounts after it."""
    merged = amount.ravel().copy()
    for f, to, share in zip(small, targets, shares, strict=True):
        given = share * merged[f]
        np.add.at(merged, to, given)
        merged[f] -= given.sum()
    return merged.reshape(amount.shape)


def join_small_reference(
    field: Array, volumes: Array, small: Integers, targets: Integers, shares: Array, nothing: float
) -> tuple[Array, Array]:
    """`join_small` in NumPy: field, but for that of whole small ones, and volumes after it."""
    amount = field * np.where(volumes > nothing, volumes, 1.0)
    amount = merge_small_reference(amount, small, targets, shares)
    merged = merge_small_reference(volumes, small, targets, shares)
    return amount / np.where(merged > nothing, merged, 1.0), merged


def fill_empty_reference(
    field: Array, volumes: Array, listed: Integers, nothing: float, wraps: Integers
) -> Array:
    """`fill_empty` in NumPy: the field after it."""
    beside = neighbours_reference(np.array(field.shape), wraps)[:, listed]
    volume = volumes.ravel()[beside]
    weight = np.where((beside >= 0) & (volume > nothing), volume, 0.0)
    total = weight.sum(axis=0)
    mean = (weight * field.ravel()[beside]).sum(axis=0) / np.where(total > 0.0, total, 1.0)
    filled, empty = field.ravel().copy(), (volumes.ravel()[listed] <= nothing) & (total > 0.0)
    filled[listed[empty]] = mean[empty]
    return filled.reshape(field.shape)


def level_reference(
    field: Array, volumes: Array, listed: Integers, leaving: Array, nothing: float, wraps: Integers
) -> Array:
    """`level` in NumPy: the field after it."""
    levelled, volume = field.ravel().copy(), volumes.ravel()
    beside = neighbours_reference(np.array(field.shape), wraps)[:, listed]
    to, _ = largest_reference(beside, np.where(beside >= 0, volume[beside], -1.0), 0.0)
    part = leaving / np.where(volume[listed] > nothing, volume[listed], 1.0)
    mixed = (volume[listed] > nothing) & (part > 2.0) & (volume[to] > volume[listed])
    f, to = listed[mixed], to[mixed]
    growth = 1.0 - part[mixed] + 0.5 * part[mixed] ** 2
    mixing = (1.0 - 1.0 / growth) * volume[f]
    whole = volume + np.bincount(to, mixing, volume.size)
    apart = levelled[f] - levelled[to]
    mean = np.bincount(to, mixing * apart, volume.size)[to] / whole[to]
    exchange = mixing * (mean - apart)
    np.add.at(levelled, f, exchange / volume[f])
    np.subtract.at(levelled, to, exchange / volume[to])
    return levelled.reshape(field.shape)


def share_velocity_reference(
    field: Array, small: Integers, targets: Integers, shares: Array
) -> Array:
    """`share_velocity` in NumPy: the field after it."""
    shared = field.ravel().copy()
    for f, to, share in zip(small[::-1], targets[::-1], shares[::-1], strict=True):
        shared[f] = (1.0 - share.sum()) * shared[f] + share @ shared[to]
    return shared.reshape(field.shape)


def mark_cut_reference(marks: Marks, listed: Integers, shape: Integers, wraps: Integers) -> Marks:
    """`mark_cut` in NumPy: the marks after it."""
    cut, out = np.zeros(shape, bool), marks.copy()
    cut.reshape(-1)[listed] = True
    depth = (np.array(marks.shape) - shape) // 2
    inner = out[tuple(slice(d, d + n) for d, n in zip(depth, shape, strict=True))]
    for axis, d in enumerate(depth):
        n, line = shape[axis], np.moveaxis(inner, axis, 0)
        distinct = np.moveaxis(cut, axis, 0)[: wraps[axis] if wraps[axis] else n]
        for at, here in enumerate(distinct):
            for shift in range(-d, d + 1):
                places = {at + shift + image * wraps[axis] for image in (-1, 0, 1)}
                for place in places & set(range(n)):
                    line[place][here] = 0
    return out


def find_parts_reference(volume: Array, whole: float, component: int, wraps: Integers) -> Integers:
    """`find_parts` in NumPy."""
    least = np.full(volume.shape, whole)
    ends = np.moveaxis(least, component, 0)
    if wraps[component] > 0:
        ends[-1] = 0.0
    else:
        ends[0], ends[-1] = 0.5 * whole, 0.5 * whole
    return np.flatnonzero(volume < least)


def find_closed_reference(
    opened: Array, volume: Array, component: int, prescribed: Marks, periodic: bool, nothing: float
) -> tuple[Integers, Array]:
    """`find_closed` in NumPy: closed faces, and on which ones pressure acts."""
    driven = (volume > nothing) & (opened > 0.0)
    counted = (volume != 0.0) & ~driven
    for end, told in zip((0, -1), prescribed, strict=True):
        for marks in (driven, counted):
            np.moveaxis(marks, component, 0)[end] &= not told and not (periodic and end)
    return np.flatnonzero(counted), driven

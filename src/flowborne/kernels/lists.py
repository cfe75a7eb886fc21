"""Lists of whole numbers in ascending order."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Integers
from flowborne.kernels.jit import kernel

AHEAD = 16
"""Places that a list is gone through before it is searched."""


@kernel
def place_of(listed: Integers, f: int, near: int) -> int:
    """Place of the first of a list in ascending order that is not below f; quick where that is a
    little after the place `near`."""
    low, high = 0, listed.size
    if near == 0 or listed[near - 1] < f:
        low, stop = near, min(near + AHEAD, high)
        while low < stop and listed[low] < f:
            low += 1
        if low < stop or low == high:
            return low
    while low < high:
        middle = (low + high) // 2
        if listed[middle] < f:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def merged(one: Integers, other: Integers) -> tuple[Integers, Integers, Integers]:
    """What is in one of two lists in ascending order or in both, in one such list; and where in it
    the elements of each are."""
    found, a, b, count = np.empty(one.size + other.size, np.int64), 0, 0, 0
    first, second = np.empty(one.size, np.int64), np.empty(other.size, np.int64)
    while a < one.size or b < other.size:
        beyond = b == other.size or (a < one.size and one[a] < other[b])
        both = not beyond and a < one.size and one[a] == other[b]
        found[count] = one[a] if beyond else other[b]
        if beyond or both:
            first[a] = count
            a += 1
        if not beyond:
            second[b] = count
            b += 1
        count += 1
    return found[:count].copy(), first, second

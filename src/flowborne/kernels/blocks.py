"""Blocks of planes that several operations go through together while they are in cache."""

from __future__ import annotations

from flowborne.kernels.jit import inlined

BLOCK = 16
"""Fewest planes of a block: more than an operation leaves to when all blocks are done."""


@inlined
def reach(block: int, blocks: int, planes: int, behind: int) -> tuple[int, int]:
    """First plane, and that after the last, of a block that an operation may go through which takes
    both neighbours of a plane from the one before it, and so on `behind` times; the planes between
    two blocks are left to when all blocks are done."""
    start, end = planes * block // blocks, planes * (block + 1) // blocks
    first = start if block == 0 else start + behind
    return first, end if block == blocks - 1 else end - behind

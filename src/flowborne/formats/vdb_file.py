"""OpenVDB files of dense fields, by the format alone.

A grid is a tree: a root of nodes of 32^3 children, of 16^3 children, and leaves of 8^3 voxels. The
shape of the whole tree comes first, then the numbers of its leaves. Little-endian; version 224.

No library is used: the wheels of OpenVDB are for its own Python, and tinyvdb writes no grid but in
place of another of the same name.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO
from typing import TypeVar
from uuid import NAMESPACE_URL, uuid5

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", np.bool_, np.float32)
Single = NDArray[np.float32]
Marks = NDArray[np.bool_]

MAGIC, VERSION, LIBRARY = 0x56444220, 224, (10, 0)
"""Of the file: its mark, the version of the format, and of the library that it is written like."""

ZIPPED, ACTIVE_ONLY = 0x1, 0x2
"""Flags of a grid: numbers are compressed by zlib; only those of active voxels are there."""

INACTIVE_IS_BACKGROUND = 0
"""What stands before the numbers of a node: the others are the background's."""

LEAF, LOWER, UPPER = 8, 16, 32
"""Children of a node along an axis: voxels of a leaf, leaves, nodes of leaves."""


@dataclass(frozen=True)
class VdbGrid:
    """A field in cubic voxels.

    name     of the grid
    kind     "fog volume" or "unknown"
    values   (nx, ny, nz) or (nx, ny, nz, 3), of the voxels from index (0, 0, 0) on
    active   (nx, ny, nz) voxels that are kept; the others are 0
    spacing  m
    first    (3,) middle of voxel (0, 0, 0), m
    """

    name: str
    kind: str
    values: Single
    active: Marks
    spacing: float
    first: tuple[float, float, float]


def vdb_bytes(grids: Iterable[VdbGrid]) -> bytes:
    """The content of a file with these grids, the same for the same grids."""
    every = tuple(grids)
    out = BytesIO()
    out.write(struct.pack("<qIIIB", MAGIC, VERSION, *LIBRARY, 1))
    out.write(str(uuid5(NAMESPACE_URL, " ".join(grid.name for grid in every))).encode())
    out.write(struct.pack("<II", 0, len(every)))  # no metadata of the file
    for grid in every:
        _write_grid(out, grid)
    return out.getvalue()


def _write_grid(out: BytesIO, grid: VdbGrid) -> None:
    """Descriptor, metadata, transform, shape of the tree, numbers."""
    vector = grid.values.ndim == 4
    out.write(_text(grid.name) + _text(f"Tree_{'vec3s' if vector else 'float'}_5_4_3") + _text(""))
    offsets = out.tell()
    out.write(bytes(24))
    start = out.tell()
    out.write(struct.pack("<I", ZIPPED | ACTIVE_ONLY))
    metadata = [
        _text("class") + _value("string", grid.kind.encode()),
        _text("name") + _value("string", grid.name.encode()),
        _text("is_saved_as_half_float") + _value("bool", b"\0"),
        _text("file_voxel_count") + _value("int64", struct.pack("<q", int(grid.active.sum()))),
    ]
    out.write(struct.pack("<I", len(metadata)) + b"".join(metadata))
    h = grid.spacing
    out.write(_text("UniformScaleTranslateMap"))
    for numbers in (grid.first, *((x,) * 3 for x in (h, h, 1.0 / h, 1.0 / h**2, 0.5 / h))):
        out.write(struct.pack("<3d", *numbers))
    leaves = _write_tree(out, grid.active, 3 if vector else 1)
    blocks = out.tell()
    for corner in leaves:
        box = tuple(slice(c, c + LEAF) for c in corner)
        marks = _padded(grid.active[box])
        out.write(_mask(marks) + _numbers(_padded(grid.values[box])[marks]))
    end = out.tell()
    out.seek(offsets)
    out.write(struct.pack("<3q", start, blocks, end))
    out.seek(end)


def _write_tree(out: BytesIO, active: Marks, components: int) -> list[tuple[int, int, int]]:
    """Write the shape of the tree; lower corners of its leaves, in the file's order."""
    zero = struct.pack(f"<{components}f", *[0.0] * components)
    out.write(struct.pack("<I", 1) + zero)
    used = _blocks(active, LEAF)
    lower = _blocks(used, LOWER)
    upper = _blocks(lower, UPPER)
    out.write(struct.pack("<II", 0, int(upper.sum())))
    corners = []
    for u in np.argwhere(upper):
        out.write(struct.pack("<3i", *(u * UPPER * LOWER * LEAF)))
        children = _node(out, lower, u * UPPER, UPPER)
        for n in children:
            for leaf in _node(out, used, n * LOWER, LOWER):
                corner = leaf * LEAF
                marks = active[tuple(slice(c, c + LEAF) for c in corner)]
                out.write(_mask(_padded(marks)))
                corners.append((int(corner[0]), int(corner[1]), int(corner[2])))
    return corners


def _node(out: BytesIO, used: Marks, first: NDArray[np.int64], side: int) -> NDArray[np.int64]:
    """Write a node that has children where `used` is true in its box of `side`^3; their numbers."""
    box = np.zeros((side,) * 3, bool)
    part = used[tuple(slice(f, f + side) for f in first)]
    box[tuple(slice(0, n) for n in part.shape)] = part
    out.write(_mask(box) + _mask(np.zeros_like(box)) + _numbers(np.zeros(0, np.float32)))
    return np.asarray(np.argwhere(box) + first)


def _blocks(marks: Marks, side: int) -> Marks:
    """Which blocks of `side`^3 hold a mark."""
    counts = [-(-n // side) for n in marks.shape]
    whole = np.zeros([side * n for n in counts], bool)
    whole[tuple(slice(0, n) for n in marks.shape)] = marks
    split = whole.reshape(counts[0], side, counts[1], side, counts[2], side)
    return np.asarray(split.any(axis=(1, 3, 5)))


def _padded(part: NDArray[Number]) -> NDArray[Number]:
    """A leaf's part of a field, beyond whose end it is 0."""
    full = np.zeros((LEAF,) * 3 + part.shape[3:], part.dtype)
    full[tuple(slice(0, n) for n in part.shape[:3])] = part
    return full


def _mask(marks: Marks) -> bytes:
    """A bit for each child, the last axis fastest."""
    return np.packbits(marks.ravel(), bitorder="little").tobytes()


def _numbers(values: Single) -> bytes:
    """The numbers of a node after what they are: compressed, or as they are where that is less."""
    raw = np.ascontiguousarray(values, "<f4").tobytes()
    packed = zlib.compress(raw)
    known = struct.pack("<b", INACTIVE_IS_BACKGROUND)
    if len(packed) < len(raw):
        return known + struct.pack("<q", len(packed)) + packed
    return known + struct.pack("<q", -len(raw)) + raw


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text.encode())) + text.encode()


def _value(kind: str, value: bytes) -> bytes:
    return _text(kind) + struct.pack("<I", len(value)) + value

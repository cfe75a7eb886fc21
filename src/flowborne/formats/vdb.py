"""Dye and velocity of a run as OpenVDB volumes, a file per frame.

The files are written without a library: the wheels of OpenVDB are for its own Python, and tinyvdb
can only replace grids of an existing file. A grid is a tree: a root of nodes of 32^3 children, of
16^3 children, and leaves of 8^3 voxels. The topology of the whole tree comes first, then the values
of its leaves. Little-endian; version 224.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TypeVar
from uuid import NAMESPACE_URL, uuid5

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import write_atomically
from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Integers, Mask, Single
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import StoredRun
from flowborne.runs.states import cell_velocity

Number = TypeVar("Number", np.bool_, np.float32)

MAGIC, VERSION, LIBRARY = 0x56444220, 224, (10, 0)
"""Magic number of the file, version of the format, and version of the library that is imitated."""

ZIPPED, ACTIVE_ONLY = 0x1, 0x2
"""Flags of a grid: values are compressed by zlib; only those of active voxels are stored."""

INACTIVE_IS_BACKGROUND = 0
"""Code before the values of a node: inactive voxels have the background value."""

LEAF, LOWER, UPPER = 8, 16, 32
"""Children of a node along an axis: voxels of a leaf, leaves, nodes of leaves."""


@provided(".vdb")
@dataclass(frozen=True)
class ExporterVdb:
    """smoke.vdb stands for smoke_0000.vdb, smoke_0001.vdb and so on, a file for each state.

    A grid for each dye, by its name, and "velocity", m/s, the mean of the two faces of a cell.
    Index (0, 0, 0) is the first cell; coordinates are in m, z up, of where the domain is in the
    state.
    """

    def write(self, run: StoredRun, path: Path) -> Written:
        if run.grid is None:
            raise SceneError(f"{run.folder} has no flow: {_without_flow(run)}.")
        return Written(write_states(run, path, velocity=True))


def write_states(run: StoredRun, path: Path, *, velocity: bool) -> tuple[Path, ...]:
    """Write a file for each state, named like `path`, with the dyes, and the velocity if asked for;
    returns the files."""
    files = tuple(path.with_name(f"{path.stem}_{n:04d}{path.suffix}") for n in run.frames)
    for number, file in enumerate(files):
        state = run.state(number)
        grid = run.grid_at(state)
        x, y, z = (float(along[0]) for along in grid.cell_coordinates())
        grids = []
        for dye in run.dyes:
            values = state[f"scalar_{dye}"]
            grids.append(VdbGrid(dye, "fog volume", values, values != 0.0, grid.spacing, (x, y, z)))
        if velocity:
            field, active = cell_velocity(grid, state), np.ones(grid.shape, bool)
            grids.append(VdbGrid("velocity", "unknown", field, active, grid.spacing, (x, y, z)))
        _write_file(file, grids)
    return files


def _without_flow(run: StoredRun) -> str:
    """Why a run has no grid, and how to get one."""
    if "fluid" in run.tables and "domain" in run.tables:
        return (
            "its scene leaves the fluid out by fluid.coupling = 'none'. Run it with 'one-way' or "
            "'two-way'"
        )
    return "its scene has no fluid. Add [domain] and [fluid]"


@dataclass(frozen=True)
class VdbGrid:
    """A field in cubic voxels.

    name     of the grid
    kind     "fog volume" or "unknown"
    values   (nx, ny, nz) or (nx, ny, nz, 3), from voxel (0, 0, 0)
    active   (nx, ny, nz) voxels that are stored; the others are 0
    spacing  m
    first    (3,) centre of voxel (0, 0, 0), m
    """

    name: str
    kind: str
    values: Single
    active: Mask
    spacing: float
    first: tuple[float, float, float]


def _write_file(path: Path, grids: Iterable[VdbGrid]) -> None:
    write_atomically(path, lambda file: file.write(vdb_bytes(grids)), durable=False)


def vdb_bytes(grids: Iterable[VdbGrid]) -> bytes:
    """Content of a file with these grids; equal grids give equal bytes."""
    every = tuple(grids)
    out = BytesIO()
    out.write(struct.pack("<qIIIB", MAGIC, VERSION, *LIBRARY, 1))
    out.write(str(uuid5(NAMESPACE_URL, " ".join(grid.name for grid in every))).encode())
    out.write(struct.pack("<II", 0, len(every)))  # the file has no metadata
    for grid in every:
        _write_grid(out, grid)
    return out.getvalue()


def _write_grid(out: BytesIO, grid: VdbGrid) -> None:
    """Write descriptor, metadata, transform, topology and values."""
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
        mask = _padded(grid.active[box])
        out.write(_mask_bytes(mask) + _value_bytes(_padded(grid.values[box])[mask]))
    end = out.tell()
    out.seek(offsets)
    out.write(struct.pack("<3q", start, blocks, end))
    out.seek(end)


def _write_tree(out: BytesIO, active: Mask, components: int) -> list[tuple[int, int, int]]:
    """Write the topology of the tree; returns the lower corners of its leaves, in file order."""
    zero = struct.pack(f"<{components}f", *[0.0] * components)
    out.write(struct.pack("<I", 1) + zero)
    used = _blocks(active, LEAF)
    lower = _blocks(used, LOWER)
    upper = _blocks(lower, UPPER)
    out.write(struct.pack("<II", 0, int(upper.sum())))
    corners = []
    for u in np.argwhere(upper):
        out.write(struct.pack("<3i", *(u * UPPER * LOWER * LEAF)))
        children = _write_node(out, lower, u * UPPER, UPPER)
        for n in children:
            for leaf in _write_node(out, used, n * LOWER, LOWER):
                corner = leaf * LEAF
                mask = active[tuple(slice(c, c + LEAF) for c in corner)]
                out.write(_mask_bytes(_padded(mask)))
                corners.append((int(corner[0]), int(corner[1]), int(corner[2])))
    return corners


def _write_node(out: BytesIO, used: Mask, first: Integers, side: int) -> Integers:
    """Write a node of `side`^3 possible children; returns the indices (n, 3) of those in `used`."""
    box = np.zeros((side,) * 3, bool)
    part = used[tuple(slice(f, f + side) for f in first)]
    box[tuple(slice(0, n) for n in part.shape)] = part
    empty = np.zeros(0, np.float32)
    out.write(_mask_bytes(box) + _mask_bytes(np.zeros_like(box)) + _value_bytes(empty))
    return np.asarray(np.argwhere(box) + first)


def _blocks(mask: Mask, side: int) -> Mask:
    """Which blocks of `side`^3 contain a true value."""
    padded = np.pad(mask, [(0, -n % side) for n in mask.shape])
    nx, ny, nz = (n // side for n in padded.shape)
    split = padded.reshape(nx, side, ny, side, nz, side)
    return np.asarray(split.any(axis=(1, 3, 5)))


def _padded(part: NDArray[Number]) -> NDArray[Number]:
    """A leaf's part of a field, padded with 0 to the full leaf."""
    full = np.zeros((LEAF,) * 3 + part.shape[3:], part.dtype)
    full[tuple(slice(0, n) for n in part.shape[:3])] = part
    return full


def _mask_bytes(mask: Mask) -> bytes:
    """One bit per child, the last axis fastest."""
    return np.packbits(mask.ravel(), bitorder="little").tobytes()


def _value_bytes(values: Single) -> bytes:
    """The values of a node after their code: compressed, or raw if that is shorter."""
    raw = np.ascontiguousarray(values, "<f4").tobytes()
    packed = zlib.compress(raw)
    code = struct.pack("<b", INACTIVE_IS_BACKGROUND)
    if len(packed) < len(raw):
        return code + struct.pack("<q", len(packed)) + packed
    return code + struct.pack("<q", -len(raw)) + raw


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text.encode())) + text.encode()


def _value(kind: str, value: bytes) -> bytes:
    return _text(kind) + struct.pack("<I", len(value)) + value

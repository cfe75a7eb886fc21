"""A run as one VTKHDF file for ParaView, by h5py.

Lengths are in m, times in s. The blocks are, each only if the run has it:

    fluid   cells: velocity (m/s, mean of the faces), vorticity (1/s), pressure (Pa), open (open
            fraction of the cell), and the dyes by name. VTKHDF has one place of an image for all
            times: of a domain that follows bodies the cells are all that it ever has, nan and
            hidden (vtkGhostType) where it is not at a time
    bodies  triangles of all geometries; cells: body and geometry by number
    forces  a point for each body, at its centroid: force (N) of fluid and winds, body by number
    flesh   quadratic elements; cells: stress (Pa, elastic Cauchy stress), von_mises (Pa),
            volume_ratio (smallest det F), flesh by number

Source: VTK's file formats, VTKHDF 2.3. A block is temporal by its group Steps; constant arrays are
stored once, and all steps refer to them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import replaced_whole
from flowborne.base.extras import optional
from flowborne.formats.creature import Creature, has_bodies
from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.elastic import STABLE_NEO_HOOKEAN
from flowborne.runs.exporters import provided
from flowborne.runs.open_run import StoredRun
from flowborne.runs.states import cell_velocity, cell_vorticity
from flowborne.solids.elasticity import Elasticity
from flowborne.solids.elements import shape_gradients
from flowborne.solids.flesh import Flesh
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import scratch

if TYPE_CHECKING:
    import h5py

VERSION = (2, 3)

GHOSTS, HIDDEN = "vtkGhostType", 32
"""Array by which VTK hides cells, and its number for a hidden one (vtkDataSetAttributes)."""

QUADRATIC = {6: (22, (0, 1, 2, 3, 5, 4)), 10: (24, (0, 1, 2, 3, 4, 7, 5, 6, 8, 9))}
"""Nodes of an element -> VTK's number of its cell type, and our nodes in VTK's order."""


@provided(".vtkhdf")
@dataclass(frozen=True)
class ExporterVtkHdf:
    """Blocks fluid, bodies, forces and flesh, each if the run has it."""

    def write(self, run: StoredRun, path: Path) -> None:
        h5py = optional("h5py", "h5py", "vtk", f"'{path.suffix}' files")
        with replaced_whole(path) as new, h5py.File(new, "w") as file:
            _write_blocks(run, file)


def _write_blocks(run: StoredRun, file: h5py.File) -> None:
    """Write the run into an open file. Raises SceneError if it has neither fluid nor bodies."""
    import h5py

    root = file.create_group("VTKHDF", track_order=True)
    _set_type(root, "MultiBlockDataSet")
    _steps(root, run)
    names = []
    if run.grid is not None:
        _fluid(root.create_group("fluid"), run)
        names.append("fluid")
    if has_bodies(run) or run.grid is None:
        creature = Creature(run)
        _bodies(root.create_group("bodies"), creature)
        _forces(root.create_group("forces"), run)
        names += ["bodies", "forces"]
        if creature.model.flesh is not None:
            _flesh(root.create_group("flesh"), run, creature.model, creature.model.flesh)
            names.append("flesh")
    tree = root.create_group("Assembly", track_order=True)
    for number, name in enumerate(names):
        root[name].attrs["Index"] = number
        tree[name] = h5py.SoftLink(f"/VTKHDF/{name}")


def _fluid(group: h5py.Group, run: StoredRun) -> None:
    """Write the fields of the cells; a step is a slice of each array."""
    _set_type(group, "ImageData")
    start, origins = run.grid_at({}), run.origins()
    h, origin = start.spacing, origins.min(axis=0)
    first = np.rint((origins - origin) / h).astype(np.int64)
    whole = tuple((first.max(axis=0) + start.shape).tolist())
    group.attrs["WholeExtent"] = np.stack([np.zeros(3, int), whole], axis=1).ravel()
    group.attrs["Origin"], group.attrs["Spacing"] = origin, (h,) * 3
    group.attrs["Direction"] = np.eye(3).ravel()
    steps = _steps(group, run)
    fields = group.create_group("CellData")
    offsets = steps.create_group("CellDataOffsets")
    for number in range(len(run)):
        state = run.state(number)
        grid = run.grid_at(state)
        values: dict[str, NDArray[Any]] = {
            "velocity": cell_velocity(grid, state),
            "vorticity": cell_vorticity(grid, state),
            "pressure": state["pressure"],
            "open": state["open"],
            **{dye: state[f"scalar_{dye}"] for dye in run.dyes},
        }
        if whole != grid.shape:
            place = tuple(slice(a, a + n) for a, n in zip(first[number], grid.shape, strict=True))
            values = {name: _within(whole, place, v, np.nan) for name, v in values.items()}
            shown = np.zeros(grid.shape, np.uint8)
            values[GHOSTS] = _within(whole, place, shown, HIDDEN)
        for name, field in values.items():
            ordered = np.moveaxis(field, (0, 2), (2, 0))  # z slowest
            if number == 0:
                shape, chunk = (len(run), *ordered.shape), (1, *ordered.shape)
                kind = np.uint8 if name == GHOSTS else np.float32
                fields.create_dataset(name, shape, kind, chunks=chunk, compression="gzip")
                offsets[name] = np.arange(len(run))
            fields[name][number] = ordered


def _within(
    whole: tuple[int, ...], place: tuple[slice, ...], values: NDArray[Any], outside: float
) -> NDArray[Any]:
    """Values (nx, ny, nz, ...) of a domain at a place in a whole (3,) of cells."""
    found = np.full((*whole, *values.shape[3:]), outside, values.dtype)
    found[place] = values
    return found


def _bodies(group: h5py.Group, creature: Creature) -> None:
    """Write the triangles of the geometries, which move with their bones."""
    surfaces, run = creature.surfaces, creature.run
    starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    faces = [s.faces + start for s, start in zip(surfaces, starts[:-1], strict=True)]
    counts = [len(surface.faces) for surface in surfaces]
    triangles = np.concatenate([*faces, np.zeros((0, 3), np.int64)])
    steps = _poly(group, run, int(starts[-1]), {"Polygons": triangles})
    _set_constant(group, steps, "body", np.repeat(creature.model.geom_body, counts))
    _set_constant(group, steps, "geometry", np.repeat(np.arange(len(surfaces)), counts))
    rotation, translation = creature.skeleton.carried
    for number in range(len(run)):
        for surface, start, end in zip(surfaces, starts[:-1], starts[1:], strict=True):
            vertices, bone = surface.vertices, surface.bone
            if bone >= 0:
                vertices = vertices @ rotation[number, bone].T + translation[number, bone]
            first = number * starts[-1]
            group["Points"][first + start : first + end] = vertices


def _forces(group: h5py.Group, run: StoredRun) -> None:
    """Write a vertex for each body with the force on it."""
    count = len(run.bodies) - 1
    steps = _poly(group, run, count, {"Vertices": np.arange(count)[:, None]})
    _set_constant(group, steps, "body", np.arange(1, count + 1))
    group["Points"][:] = run.every("fluid_centre")[:, 1:].reshape(-1, 3)
    force = run.every("fluid_force")[:, 1:].reshape(-1, 3)
    group.create_group("PointData")["force"] = force.astype(np.float32)
    steps.create_group("PointDataOffsets")["force"] = count * np.arange(len(run))


def _flesh(group: h5py.Group, run: StoredRun, model: SolidModel, flesh: Flesh) -> None:
    """Write the elements of flesh with their stresses."""
    _set_type(group, "UnstructuredGrid")
    kind, order = QUADRATIC[flesh.elements.shape[1]]
    cells, nodes = len(flesh.elements), len(flesh.elasticity.rest)
    steps = _points(group, run, nodes)
    states = len(run)
    group["NumberOfCells"] = np.full(states, cells)
    group["NumberOfConnectivityIds"] = np.full(states, flesh.elements.size)
    group["Types"] = np.full(cells, kind, np.uint8)
    group["Offsets"] = np.arange(cells + 1) * flesh.elements.shape[1]
    group["Connectivity"] = flesh.elements[:, list(order)].ravel()
    steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = np.zeros(states, np.int64)
    _set_constant(group, steps, "flesh", flesh.of_element)
    widths = {"stress": (9,), "von_mises": (), "volume_ratio": ()}
    for name, width in widths.items():
        group["CellData"].create_dataset(name, (states * cells, *width), np.float32)
        steps["CellDataOffsets"][name] = cells * np.arange(states)
    s, q = scratch(model), run.arrays["q"]
    for number in range(states):
        s.place(q[number].astype(np.float64))
        positions = flesh.nodes(s)
        stress = cauchy_stress(flesh.elasticity, deformation_gradients(flesh.elasticity, positions))
        group["Points"][number * nodes : (number + 1) * nodes] = positions
        values = {
            "stress": stress.reshape(-1, 9),
            "von_mises": von_mises(stress),
            "volume_ratio": flesh.elasticity.volume_ratios(positions),
        }
        for name, field in values.items():
            group["CellData"][name][number * cells : (number + 1) * cells] = field


def _set_type(group: h5py.Group, name: str) -> None:
    """Set the version of the format and the type of a group."""
    group.attrs["Version"] = VERSION
    group.attrs["Type"] = np.bytes_(name)


def _steps(group: h5py.Group, run: StoredRun) -> h5py.Group:
    """A new group of time steps."""
    steps = group.create_group("Steps")
    steps.attrs["NSteps"] = len(run)
    steps["Values"] = run.times
    return steps


def _points(group: h5py.Group, run: StoredRun, count: int) -> h5py.Group:
    """Allocate `count` points per step; returns the group of steps, which refers to them."""
    states = len(run)
    steps = _steps(group, run)
    group["NumberOfPoints"] = np.full(states, count)
    group.create_dataset("Points", (states * count, 3), np.float32)
    group.create_group("CellData")
    steps.create_group("CellDataOffsets")
    steps["PartOffsets"] = np.zeros(states, np.int64)
    steps["NumberOfParts"] = np.ones(states, np.int64)
    steps["PointOffsets"] = count * np.arange(states)
    return steps


def _poly(
    group: h5py.Group, run: StoredRun, count: int, cells: Mapping[str, Integers]
) -> h5py.Group:
    """Allocate a surface of `count` points with `cells`: kind -> points (m, k) of each cell."""
    _set_type(group, "PolyData")
    steps = _points(group, run, count)
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        points = cells.get(kind, np.zeros((0, 1), np.int64))
        part = group.create_group(kind)
        part["NumberOfCells"] = np.array([len(points)])
        part["NumberOfConnectivityIds"] = np.array([points.size])
        part["Offsets"] = np.arange(len(points) + 1) * points.shape[1]
        part["Connectivity"] = points.ravel()
    steps["CellOffsets"] = np.zeros((len(run), 4), np.int64)
    steps["ConnectivityIdOffsets"] = np.zeros((len(run), 4), np.int64)
    return steps


def _set_constant(group: h5py.Group, steps: h5py.Group, name: str, values: Integers) -> None:
    """Store cell values that are the same in all steps."""
    group["CellData"][name] = values.astype(np.int32)
    steps["CellDataOffsets"][name] = np.zeros(steps.attrs["NSteps"], np.int64)


def deformation_gradients(elasticity: Elasticity, positions: Array) -> Array:
    """(m, 3, 3) F at the centroid of every element with nodes at `positions` (n, 3), m.

    Flesh of slabs is in plane strain.
    """
    gradients = shape_gradients(elasticity.rest, elasticity.elements)[0][:, -1]
    displacement = (positions - elasticity.rest)[elasticity.elements]
    return np.asarray(np.eye(3) + np.einsum("mai,maj->mij", displacement, gradients))


def cauchy_stress(elasticity: Elasticity, F: Array) -> Array:
    """(m, 3, 3) Cauchy stress P F^T / det F of every element at F (m, 3, 3), Pa.

    P is the derivative of the energy in `kernels.elastic`, without viscous stress. The stress of a
    flat element is nan.
    """
    mu, lame = (modulus[:, None, None] for modulus in elasticity.moduli.T)
    J = np.linalg.det(F)[:, None, None]
    C = np.swapaxes(F, 1, 2) @ F
    # derivative of det F
    cofactor = np.stack([np.cross(F[:, (i + 1) % 3], F[:, (i + 2) % 3]) for i in range(3)], axis=1)
    soft = mu * F + ((lame + mu) * (J - 1.0) - mu) * cofactor
    strain = 0.5 * (C - np.eye(3))
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
    linear = F @ (lame * trace * np.eye(3) + 2.0 * mu * strain)
    is_soft = (np.asarray(elasticity.laws) == STABLE_NEO_HOOKEAN)[:, None, None]
    P = np.where(is_soft, soft, linear)
    return np.asarray(P @ np.swapaxes(F, 1, 2) / np.where(J == 0.0, np.nan, J))


def von_mises(stress: Array) -> Array:
    """(m,) von Mises equivalent of stresses (m, 3, 3), Pa."""
    mean = np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3.0
    deviator = stress - mean * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.sum(deviator**2, axis=(1, 2))))

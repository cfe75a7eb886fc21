"""The blocks of a VTKHDF file, and the run's numbers in them; lengths in m, time in s.

    fluid   cells: velocity (m/s, mean of the faces), vorticity (1/s), pressure (Pa), open (part of
            the cell that no body takes up), and the dyes by name
    bodies  triangles of all geometries; cells: body and geometry by number
    forces  a point for each body, at its centroid: force (N) of fluid and winds, body by number
    flesh   quadratic elements; cells: stress (Pa, Cauchy's, elastic), von_mises (Pa),
            volume_ratio (least det F), flesh by number

Source: VTK's file formats, VTKHDF 2.3. A block is temporal by its group Steps; what does not change
is there once, and all steps point to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Grid
from flowborne.formats.creature import Creature, has_bodies
from flowborne.formats.stress import cauchy_stress, deformation_gradients, von_mises
from flowborne.runs.open_run import OpenRun
from flowborne.runs.states import cell_velocity, vorticity
from flowborne.solids.flesh import Flesh
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import scratch

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

VERSION = (2, 3)

QUADRATIC = {6: (22, (0, 1, 2, 3, 5, 4)), 10: (24, (0, 1, 2, 3, 4, 7, 5, 6, 8, 9))}
"""Nodes of an element -> VTK's number of its kind, and our nodes in VTK's order."""


def write_vtkhdf(run: OpenRun, path: Path) -> None:
    """Write the run to `path`. Raises SceneError when it has neither fluid nor bodies."""
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF", track_order=True)
        _kind(root, "MultiBlockDataSet")
        _steps(root, run)
        names = []
        if run.grid is not None:
            _fluid(root.create_group("fluid"), run, run.grid)
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


def _fluid(group: h5py.Group, run: OpenRun, grid: Grid) -> None:
    """The fields of the cells, a slice of each array a step."""
    _kind(group, "ImageData")
    nx, ny, nz = grid.shape
    group.attrs["WholeExtent"] = (0, nx, 0, ny, 0, nz)
    group.attrs["Origin"], group.attrs["Spacing"] = grid.origin, (grid.spacing,) * 3
    group.attrs["Direction"] = np.eye(3).ravel()
    steps = _steps(group, run)
    fields = group.create_group("CellData")
    offsets = steps.create_group("CellDataOffsets")
    for number in range(len(run)):
        state = run.state(number)
        velocity = cell_velocity(grid, state)
        values: dict[str, NDArray[Any]] = {"velocity": velocity}
        values["vorticity"] = vorticity(grid, state)
        values |= {name: state[name] for name in ("pressure", "open")}
        values |= {dye: state[f"scalar_{dye}"] for dye in run.dyes}
        for name, field in values.items():
            turned = np.moveaxis(field, (0, 2), (2, 0))  # z slowest
            if number == 0:
                fields.create_dataset(
                    name,
                    (len(run), *turned.shape),
                    np.float32,
                    chunks=(1, *turned.shape),
                    compression="gzip",
                )
                offsets[name] = np.arange(len(run))
            fields[name][number] = turned


def _bodies(group: h5py.Group, creature: Creature) -> None:
    """The triangles of the geometries, which move with their bones."""
    surfaces, run = creature.surfaces, creature.run
    starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    faces = [s.faces + start for s, start in zip(surfaces, starts[:-1], strict=True)]
    counts = [len(surface.faces) for surface in surfaces]
    triangles = np.concatenate([*faces, np.zeros((0, 3), np.int64)])
    steps = _poly(group, run, int(starts[-1]), {"Polygons": triangles})
    _still(group, steps, "body", np.repeat(creature.model.geom_body, counts))
    _still(group, steps, "geometry", np.repeat(np.arange(len(surfaces)), counts))
    turn, shift = creature.skeleton.carried
    for number in range(len(run)):
        for surface, start, end in zip(surfaces, starts[:-1], starts[1:], strict=True):
            places, bone = surface.vertices, surface.bone
            if bone >= 0:
                places = places @ turn[number, bone].T + shift[number, bone]
            first = number * starts[-1]
            group["Points"][first + start : first + end] = places


def _forces(group: h5py.Group, run: OpenRun) -> None:
    """A vertex for each body with the force on it."""
    count = len(run.bodies) - 1
    steps = _poly(group, run, count, {"Vertices": np.arange(count)[:, None]})
    _still(group, steps, "body", np.arange(1, count + 1))
    group["Points"][:] = run.every("fluid_centre")[:, 1:].reshape(-1, 3)
    force = run.every("fluid_force")[:, 1:].reshape(-1, 3)
    group.create_group("PointData")["force"] = force.astype(np.float32)
    steps.create_group("PointDataOffsets")["force"] = count * np.arange(len(run))


def _flesh(group: h5py.Group, run: OpenRun, model: SolidModel, flesh: Flesh) -> None:
    """The elements of flesh with their stresses."""
    _kind(group, "UnstructuredGrid")
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
    _still(group, steps, "flesh", flesh.of_element)
    widths = {"stress": (9,), "von_mises": (), "volume_ratio": ()}
    for name, width in widths.items():
        group["CellData"].create_dataset(name, (states * cells, *width), np.float32)
        steps["CellDataOffsets"][name] = cells * np.arange(states)
    s, q = scratch(model), run.arrays["q"]
    for number in range(states):
        s.place(q[number].astype(np.float64))
        places = flesh.nodes(s)
        stress = cauchy_stress(flesh.elasticity, deformation_gradients(flesh.elasticity, places))
        group["Points"][number * nodes : (number + 1) * nodes] = places
        values = {
            "stress": stress.reshape(-1, 9),
            "von_mises": von_mises(stress),
            "volume_ratio": flesh.elasticity.volume_ratios(places),
        }
        for name, found in values.items():
            group["CellData"][name][number * cells : (number + 1) * cells] = found


def _kind(group: h5py.Group, kind: str) -> None:
    """The version of the format, and what a group is."""
    group.attrs["Version"] = VERSION
    group.attrs.create("Type", np.bytes_(kind), dtype=h5py.string_dtype("ascii", len(kind)))


def _steps(group: h5py.Group, run: OpenRun) -> h5py.Group:
    """The group of the steps in time."""
    steps = group.create_group("Steps")
    steps.attrs["NSteps"] = len(run)
    steps["Values"] = run.times
    return steps


def _points(group: h5py.Group, run: OpenRun, count: int) -> h5py.Group:
    """Room for `count` points a step, and the steps that lead to them."""
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


def _poly(group: h5py.Group, run: OpenRun, count: int, cells: Mapping[str, Integers]) -> h5py.Group:
    """A surface of `count` points; `cells` has points (m, k) of each kind of cell that it has."""
    _kind(group, "PolyData")
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


def _still(group: h5py.Group, steps: h5py.Group, name: str, values: Integers) -> None:
    """Numbers of the cells that are the same in all steps."""
    group["CellData"][name] = values.astype(np.int32)
    steps["CellDataOffsets"][name] = np.zeros(steps.attrs["NSteps"], np.int64)

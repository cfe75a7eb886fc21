"""A run opened for drawing: the shapes and skins of its bodies in addition to its results."""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flowborne.kernels.arrays import Array, Integers
from flowborne.runs.history import HistoryColumns, history_columns, read_history
from flowborne.runs.open_run import StoredRun
from flowborne.runs.run_folder import RunFolder, RunFolderError, reading
from flowborne.shapes.primitives import shape_of
from flowborne.shapes.shape import Shape
from flowborne.solids.skins import skinned
from flowborne.view import style
from flowborne.view.shot import Shot

State = dict[str, NDArray[Any]]
"""Arrays of one file of states/, by name."""

PLOTTED = ("objective", "measured_", "angle_", "position_")
"""Prefixes of the columns of the history that are read in addition to frame and time."""


@dataclass(frozen=True)
class Geom:
    """One drawn geometry of a body.

    shape    in its own frame
    body     number of the body
    rgba     colour in the model
    covered  whether flesh surrounds it, or a skin replaces it
    """

    shape: Shape
    body: int
    rgba: Array
    covered: bool = False


@dataclass(frozen=True)
class Flesh:
    """The skin of all flesh; its vertices are the `flesh_vertices` (k, 3) of a state.

    triangles  (m, 3) vertices of each, outward
    bodies     numbers of the bodies that carry flesh
    """

    triangles: Integers
    bodies: tuple[int, ...]

    rgb = style.rgb(style.FLESH)

    def vertices(self, state: State) -> Array:
        """(k, 3) m, in a state."""
        return state["flesh_vertices"].astype(float)


class CarriedSkin:
    """A skin of the model, bound to bodies.

    rest       (k, 3) vertices in the model's rest pose, m
    triangles  (m, 3) vertices of each, outward
    bodies     (n,) numbers of the bodies that carry it
    weights    (k, n) weight of each body for each vertex; rows sum to 1
    position   (n, 3) m, of the bodies in the rest pose
    rotation   (n, 3, 3) of the bodies in the rest pose
    rgb        (3,) colour
    """

    def __init__(self, entry: dict[str, Any]) -> None:
        """`entry`: of the skin in model.json. Raises ValueError if it lacks a vertex."""
        _check_numbers(entry["triangles"], entry["vertices"], "vertex")
        self.rest = np.asarray(entry["vertices"], float)
        self.triangles = np.asarray(entry["triangles"], np.int64)
        self.bodies = np.asarray(entry["bodies"], np.int64)
        self.weights = np.asarray(entry["weights"], float)
        self.position = np.asarray(entry["body_position"], float)
        self.rotation = np.asarray(entry["body_rotation"], float)
        self.rgb = np.asarray(entry["rgba"][:3], float)

    def vertices(self, state: State) -> Array:
        """(k, 3) m, in a state."""
        R = state["body_rotation"][self.bodies].astype(float) @ self.rotation.swapaxes(1, 2)
        position = state["body_position"][self.bodies].astype(float)
        t = position - np.einsum("nij,nj->ni", R, self.position)
        return skinned(self.rest, self.weights, R, t)


Skin = Flesh | CarriedSkin
"""A surface that deforms from frame to frame."""


class Run(StoredRun):
    """A run opened for drawing; `history` has only the columns that are plotted.

    raises  RunFolderError when it is not a run, has no state yet, or a file is missing or damaged

    accented    numbers of the bodies that controlled joints move
    controlled  names of the controlled joints
    gravity     (3,) m/s^2
    density     of the fluid, kg/m^3; 0 without fluid
    objective_unit  unit of the objective; "" if it is not known
    wind        (n, 3) m/s, winds that are drawn if there is no fluid
    geoms       drawn geometries, in the order of geom_position
    flesh       skin of the flesh; None without flesh
    carried     skins of the model, in 3D
    sources     (n, 2, 3) m, lower and upper corners of sources of dye
    shot        of the scene
    """

    def __init__(self, folder: str | Path) -> None:
        super().__init__(folder)
        files = RunFolder(self.folder)
        with reading(self.folder):
            scene, model = self.tables, self._model
            body_of = dict(zip(self.joints, model.get("joint_bodies", []), strict=False))
            self.controlled: tuple[str, ...] = tuple(model["controlled"])
            self.accented = frozenset(body_of[j] for j in self.controlled if j in body_of)
            self.gravity = np.asarray(scene.get("gravity", (0.0, 0.0, 0.0)), float)
            self.density = float(scene.get("fluid", {}).get("density", 0.0))
            self.objective_unit = str(files.read_summary().get("objective_unit", ""))
            self.wind = np.asarray(model["wind"], float).reshape(-1, 3)
            self.geoms = tuple(_geom(entry) for entry in model["geoms"])
            self.flesh = None
            if self.skin is not None:
                self.flesh = Flesh(self.skin, tuple(model["flesh"]["bodies"]))
            self.carried = tuple(CarriedSkin(entry) for entry in model.get("skins", ()))
            self.sources = _sources(scene)
            self.shot = Shot.model_validate(scene.get("film", {}))
            self.history = _plotted(files.history)
            numbers = [*body_of.values(), *(geom.body for geom in self.geoms)]
            numbers += [body for skin in self.carried for body in skin.bodies]
            numbers += self.flesh.bodies if self.flesh else ()
            _check_numbers(numbers, self.bodies, "body")

    @property
    def skins(self) -> tuple[Skin, ...]:
        """All deforming surfaces."""
        return self.carried if self.flesh is None else (self.flesh, *self.carried)

    def state(self, number: int) -> State:
        arrays = super().state(number)
        self._check_geoms(arrays["geom_position"])
        return arrays

    def every(self, name: str) -> Array:
        values = super().every(name)
        if name in ("geom_position", "geom_rotation"):
            self._check_geoms(values[0])
        return values

    def sampled(self, most: int) -> list[State]:
        """At most `most` states at even intervals, including the last one."""
        picks = np.unique(np.linspace(len(self) - 1, 0, min(most, len(self))).round().astype(int))
        return [self.state(int(pick)) for pick in picks]

    def row(self, number: int) -> int | None:
        """Row of the history of the `number`-th state; None for the initial one."""
        rows = np.flatnonzero(self.history["frame"] == self.frames[number])
        return int(rows[0]) if rows.size else None

    def _check_geoms(self, positions: Array) -> None:
        if len(positions) != len(self.geoms):
            raise RunFolderError(
                f"model.json of the run has {len(self.geoms)} geometries and its states "
                f"{len(positions)}; start the run again with replace=True"
            )


def _check_numbers(numbers: ArrayLike, of: Sized, what: str) -> None:
    """Raise ValueError unless all numbers are valid indices of `of`."""
    found = np.asarray(numbers, np.int64).ravel()
    wrong = found[(found < 0) | (found >= len(of))]
    if wrong.size:
        raise ValueError(f"model.json has {what} {wrong[0]}, and {len(of)} in all")


def _geom(entry: dict[str, Any]) -> Geom:
    mesh = None
    if entry["type"] == "mesh":
        mesh = (np.asarray(entry["vertices"], float), np.asarray(entry["faces"], np.int64))
        _check_numbers(mesh[1], mesh[0], "vertex")
    size, rgba = np.asarray(entry["size"], float), np.asarray(entry["rgba"], float)
    covered = bool(entry.get("covered", False))
    shape = shape_of(entry["type"], size, mesh)
    return Geom(shape, int(entry["body"]), rgba, covered)


def _sources(scene: dict[str, Any]) -> Array:
    """(n, 2, 3) m, lower and upper corners of the sources of dye in a 3D scene."""
    boxes = [(t["lower"], t["upper"]) for t in scene.get("sources", ()) if t.get("dye")]
    return np.array([box for box in boxes if len(box[0]) == 3], float).reshape(-1, 2, 3)


def _plotted(path: Path) -> HistoryColumns:
    """The plotted columns that the run has.

    raises  ValueError for a history without frames or times
    """
    required = "frame", "time_s"
    columns = [n for n in history_columns(path) if n in required or n.startswith(PLOTTED)]
    for name in required:
        if name not in columns:
            raise ValueError(f"{path.name} has no column '{name}'")
    return read_history(path, columns)

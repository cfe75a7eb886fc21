"""A run folder, read for drawing."""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flowborne.files.given import read_json
from flowborne.fluid.grid import Grid
from flowborne.runs.history import history_columns, history_rows
from flowborne.runs.run_folder import STATE_NAME, RunFolder, RunFolderError, reading
from flowborne.runs.states import read_state
from flowborne.shapes.primitives import shape_of
from flowborne.shapes.shape import Shape
from flowborne.solids.skins import skinned
from flowborne.view import style
from flowborne.view.shot import Shot

Array = NDArray[np.float64]
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


class Skin(Protocol):
    """A surface that deforms from frame to frame.

    triangles  (m, 3) vertices of each, outward
    rgb        (3,) colour
    """

    @property
    def triangles(self) -> NDArray[np.int64]: ...

    @property
    def rgb(self) -> Array: ...

    def vertices(self, state: State) -> Array:
        """(k, 3) m, in a state."""
        ...


@dataclass(frozen=True)
class Flesh:
    """The skin of all flesh; its vertices are the `flesh_vertices` (k, 3) of a state.

    triangles  (m, 3) vertices of each, outward
    bodies     numbers of the bodies that carry flesh
    """

    triangles: NDArray[np.int64]
    bodies: tuple[int, ...]

    @property
    def rgb(self) -> Array:
        return style.rgb(style.FLESH)

    def vertices(self, state: State) -> Array:
        """(k, 3) m, in a state."""
        return state["flesh_vertices"].astype(float)


@dataclass(frozen=True)
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

    rest: Array
    triangles: NDArray[np.int64]
    bodies: NDArray[np.int64]
    weights: Array
    position: Array
    rotation: Array
    rgb: Array

    def vertices(self, state: State) -> Array:
        """(k, 3) m, in a state."""
        R = state["body_rotation"][self.bodies].astype(float) @ self.rotation.swapaxes(1, 2)
        position = state["body_position"][self.bodies].astype(float)
        t = position - np.einsum("nij,nj->ni", R, self.position)
        return skinned(self.rest, self.weights, R, t)


@dataclass(frozen=True)
class Run:
    """The data of a run folder that are the same for all frames; `state` reads one frame.

    name               of the scene
    bodies             names, the world first
    accented           numbers of the bodies that controlled joints move
    controlled         names of the controlled joints
    grid               of the fluid; None without fluid
    slab               whether the run is two-dimensional
    gravity            (3,) m/s^2
    geoms              drawn geometries, in the order of geom_position
    frames_per_second  of the film
    wind               (n, 3) m/s, winds that are drawn if there is no fluid
    shot               of the scene
    history            column -> values, a number per frame from frame 1
    states             files of states/, in order
    flesh              skin of the flesh; None without flesh
    carried            skins of the model, in 3D
    sources            (n, 2, 3) m, lower and upper corners of sources of dye
    """

    name: str
    bodies: tuple[str, ...]
    accented: frozenset[int]
    controlled: tuple[str, ...]
    grid: Grid | None
    slab: bool
    gravity: Array
    geoms: tuple[Geom, ...]
    frames_per_second: float
    wind: Array
    shot: Shot
    history: dict[str, Array]
    states: tuple[Path, ...]
    flesh: Flesh | None = None
    carried: tuple[CarriedSkin, ...] = ()
    sources: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))

    @classmethod
    def read(cls, path: Path) -> Self:
        """The run in folder `path`.

        raises  ValueError if it has no frame; RunFolderError if a file is missing or damaged
        """
        folder = RunFolder(path)
        states = state_files(folder)
        if not states:
            raise ValueError(f"{path} has no frame to draw; let the run go on with --resume")
        with reading(path):
            return cls._read(folder, states)

    @classmethod
    def _read(cls, folder: RunFolder, states: tuple[Path, ...]) -> Self:
        path = folder.path
        scene = folder.read_scene()
        model = read_json(folder.model)
        body_of = dict(zip(model["joints"], model.get("joint_bodies", []), strict=False))
        geoms = tuple(_geom(entry) for entry in model["geoms"])
        flesh = _flesh(model.get("flesh"))
        carried = tuple(_carried(entry) for entry in model.get("skins", ()))
        bodies = [*body_of.values(), *(geom.body for geom in geoms)]
        bodies += [body for skin in carried for body in skin.bodies]
        _check_numbers([*bodies, *(flesh.bodies if flesh else ())], model["bodies"], "body")
        return cls(
            name=scene.get("name", path.name),
            bodies=tuple(model["bodies"]),
            accented=frozenset(body_of[j] for j in model["controlled"] if j in body_of),
            controlled=tuple(model["controlled"]),
            grid=_grid(model["grid"]),
            slab=bool(model["slab"]),
            gravity=np.asarray(scene.get("gravity", (0.0, 0.0, 0.0)), float),
            geoms=geoms,
            frames_per_second=float(model["frames_per_second"]),
            wind=np.asarray(model["wind"], float).reshape(-1, 3),
            shot=Shot.of(scene.get("film", {})),
            history=_history(folder.history),
            states=states,
            flesh=flesh,
            carried=carried,
            sources=_sources(scene),
        )

    @property
    def skins(self) -> tuple[Skin, ...]:
        """All deforming surfaces."""
        return self.carried if self.flesh is None else (self.flesh, *self.carried)

    def __len__(self) -> int:
        """Number of frames that can be drawn, including the initial state."""
        return len(self.states)

    def state(self, number: int) -> State:
        """Arrays of the `number`-th state; negative numbers count from the end."""
        arrays = read_state(self.states[number])
        self._check_geoms(arrays["geom_position"])
        return arrays

    def _check_geoms(self, positions: Array) -> None:
        """Raise RunFolderError unless there is a position of each geometry."""
        if len(positions) != len(self.geoms):
            raise RunFolderError(
                f"model.json of the run has {len(self.geoms)} geometries and its states "
                f"{len(positions)}; start the run again with --replace"
            )

    def sampled(self, most: int) -> list[State]:
        """At most `most` states at even intervals, including the last one."""
        picks = np.unique(np.linspace(len(self) - 1, 0, min(most, len(self))).round().astype(int))
        return [self.state(int(pick)) for pick in picks]

    def every(self, name: str) -> Array:
        """(n, ...) values of a small array in all states, such as "fluid_force"."""
        values = np.asarray([read_state(path, (name,))[name] for path in self.states], float)
        if name in ("geom_position", "geom_rotation"):
            self._check_geoms(values[0])
        return values

    @property
    def times(self) -> Array:
        """(n,) times of all states, s."""
        return self.every("time")

    def row(self, number: int) -> int | None:
        """Row of the history of the `number`-th state; None for the initial one."""
        frame = int(self.states[number].stem)
        rows = np.flatnonzero(self.history["frame"] == frame)
        return int(rows[0]) if rows.size else None


def state_files(folder: RunFolder) -> tuple[Path, ...]:
    """Files of the states of a run, in order."""
    if not folder.states.is_dir():
        return ()
    return tuple(sorted(p for p in folder.states.iterdir() if STATE_NAME.fullmatch(p.name)))


def _grid(entry: dict[str, Any] | None) -> Grid | None:
    if entry is None:
        return None
    nx, ny, nz = entry["shape"]
    x, y, z = entry["origin"]
    return Grid((nx, ny, nz), float(entry["spacing"]), (x, y, z))


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


def _flesh(entry: dict[str, Any] | None) -> Flesh | None:
    if entry is None:
        return None
    return Flesh(np.asarray(entry["triangles"], np.int64), tuple(entry["bodies"]))


def _carried(entry: dict[str, Any]) -> CarriedSkin:
    _check_numbers(entry["triangles"], entry["vertices"], "vertex")
    return CarriedSkin(
        np.asarray(entry["vertices"], float),
        np.asarray(entry["triangles"], np.int64),
        np.asarray(entry["bodies"], np.int64),
        np.asarray(entry["weights"], float),
        np.asarray(entry["body_position"], float),
        np.asarray(entry["body_rotation"], float),
        np.asarray(entry["rgba"][:3], float),
    )


def _sources(scene: dict[str, Any]) -> Array:
    """(n, 2, 3) m, lower and upper corners of the sources of dye in a 3D scene."""
    boxes = [(t["lower"], t["upper"]) for t in scene.get("sources", ()) if t.get("dye")]
    return np.array([box for box in boxes if len(box[0]) == 3], float).reshape(-1, 2, 3)


def _history(path: Path) -> dict[str, Array]:
    """The plotted columns that the run has.

    raises  ValueError for a history without frames or times
    """
    required = "frame", "time_s"
    columns = [n for n in history_columns(path) if n in required or n.startswith(PLOTTED)]
    for name in required:
        if name not in columns:
            raise ValueError(f"{path.name} has no column '{name}'")
    rows = np.array(list(history_rows(path, columns)), float).reshape(-1, len(columns))
    return dict(zip(columns, rows.T, strict=True))

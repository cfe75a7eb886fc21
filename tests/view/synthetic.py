"""Run folders made by hand: a block that turns in a stream that nobody has solved for."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

SPACING = 4.0 / 96
FRAMES_PER_SECOND = 24.0
ORIGIN = np.array([-1.5, -2.0, -0.5 * SPACING])
CENTRE = np.array([0.4, 0.3])
"""Of the block, off the middle in x and y, so that a picture upside down is noticed."""


def angle_at(frame: int) -> float:
    return np.radians(-50.0 + 40.0 * np.sin(0.05 * frame))


def write_run(
    folder: Path,
    *,
    frames: int = 6,
    fluid: bool = True,
    field: str = "dye",
    dyes: tuple[str, ...] = ("dye",),
    objective: bool = True,
    force: tuple[float, float] = (30.0, 12.0),
    wind: tuple[float, float] | None = None,
    window: tuple[float, float] | None = None,
) -> Path:
    """Run folder with the start and `frames` frames; a block, and a fixed square on its left.

    window  cells per frame by which the domain moves, in whole cells, over water that stands still
    """
    (folder / "states").mkdir(parents=True)
    (folder / "summary.json").write_text(json.dumps({"flowborne": "0", "outcome": "done"}))
    scene = f'name = "made-up-block"\ndimensions = 2\n[film]\nfield = "{field}"\n'
    scene += "[fluid]\ndensity = 1000.0\n" if fluid else ""
    scene += '[domain]\nfollow = "bodies"\n' if window else ""
    (folder / "scene.toml").write_text(scene)
    (folder / "model.json").write_text(json.dumps(_model(fluid, wind)))
    columns = ["frame", "time_s", "angle_hinge_rad", "target_hinge_rad"]
    columns += ["objective"] if objective else []
    rows = [",".join(columns)]
    for frame in range(frames + 1):
        time = frame / FRAMES_PER_SECOND
        cells = np.trunc(frame * np.array(window or (0.0, 0.0)))
        arrays = _state(frame, fluid, dyes, np.array([*force, 0.0]), cells, still=bool(window))
        exact = {"time": np.float64(time)}
        if window:
            exact["grid_origin"] = ORIGIN + SPACING * np.append(cells, 0.0)
        np.savez(folder / "states" / f"{frame:06d}.npz", **exact, **arrays)
        if frame:
            angle = angle_at(frame)
            values = [frame, time, angle, angle, -np.exp(-time) * (1.0 + 0.2 * np.cos(9 * time))]
            rows.append(",".join(repr(float(x)) for x in values[: len(columns)]))
    (folder / "history.csv").write_text("\n".join(rows) + "\n")
    return folder


def _model(fluid: bool, wind: tuple[float, float] | None) -> dict[str, Any]:
    return {
        "slab": True,
        "bodies": ["world", "block"],
        "joints": ["hinge"],
        "joint_bodies": [1],
        "controlled": ["hinge"],
        "grid": {"shape": [96, 96, 1], "spacing": SPACING, "origin": ORIGIN.tolist()}
        if fluid
        else None,
        "geoms": [
            {"type": "box", "size": [0.12, 0.12, 0.5], "body": 0, "rgba": [0.5, 0.5, 0.5, 1.0]},
            {"type": "box", "size": [0.5, 0.09, 0.5], "body": 1, "rgba": [0.5, 0.5, 0.5, 1.0]},
        ],
        "frames_per_second": FRAMES_PER_SECOND,
        "wind": [] if wind is None else [[*wind, 0.0]],
    }


def _state(
    frame: int, fluid: bool, dyes: tuple[str, ...], force: Any, cells: Any, *, still: bool
) -> dict[str, Any]:
    angle = angle_at(0 if still else frame)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )
    root = CENTRE - turn[:2, 0] * 0.5
    arrays = {
        "q": np.array([angle]),
        "v": np.zeros(1),
        "geom_position": np.array([[*root, 0.0], [*CENTRE, 0.0]]),
        "geom_rotation": np.stack([np.eye(3), turn]),
        "body_position": np.array([[0.0, 0.0, 0.0], [*root, 0.0]]),
        "fluid_force": np.array([np.zeros(3), 0.0 * force if frame == 0 else force]),
        "fluid_centre": np.array([[0.0, 0.0, 0.0], [*CENTRE, 0.0]]),
    }
    if fluid:
        arrays |= _fluid(0 if still else frame, turn, dyes, ORIGIN[:2] + SPACING * cells)
    return {name: values.astype(np.float32) for name, values in arrays.items()}


def _fluid(frame: int, turn: Any, dyes: tuple[str, ...], corner: Any) -> dict[str, Any]:
    """A row of vortices that drifts to the right, and bands of dye that they roll up."""
    nodes_x, nodes_y = (x + SPACING * np.arange(97) for x in corner)
    x, y = np.meshgrid(nodes_x, nodes_y, indexing="ij")
    stream = y.copy()
    for n in range(6):
        side = 1.0 if n % 2 else -1.0
        centre = 0.5 + (n * 0.55 + 0.03 * frame) % 2.4
        distance = (x - centre) ** 2 + (y - CENTRE[1] - 0.3 * side) ** 2
        stream += 0.25 * side * np.exp(-distance / 0.06)
    cells = stream[1:, 1:] + stream[1:, :-1] + stream[:-1, 1:] + stream[:-1, :-1]
    local = np.stack([x[1:, 1:] - CENTRE[0], y[1:, 1:] - CENTRE[1]], axis=-1) @ turn[:2, :2]
    distance = np.maximum(np.abs(local[..., 0]) - 0.5, np.abs(local[..., 1]) - 0.09)
    arrays = {
        "velocity_x": np.diff(stream, axis=1)[:, :, None] / SPACING,
        "velocity_y": -np.diff(stream, axis=0)[:, :, None] / SPACING,
        "pressure": np.zeros((96, 96, 1)),
        "open": np.clip(0.5 + distance / SPACING, 0.0, 1.0)[:, :, None],
    }
    for n, dye in enumerate(dyes):
        bands = np.clip(0.5 + 3.0 * np.cos(9.0 * cells / 4.0 + 2.1 * n), 0.0, 1.0)
        arrays[f"scalar_{dye}"] = bands[:, :, None]
    return arrays

"""Writes the tables of docs/exporters.md: runs of five scenes, exported and read back by the
libraries of other programs: `make exporters`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import flowborne as fb
from flowborne.formats.creature import Creature
from flowborne.runs.states import cell_velocity, cell_vorticity
from marked import with_part
from read_back import Alembic, Bvh, Gltf, Stage, VtkHdf, cells_of, grids_of, meshes_of, points_of

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "exporters.md"

FISH = ROOT / "tests" / "formats" / "fish.toml"
SCENES = ("swimmer", "flyer-flesh", "human-wind-back", "eel", FISH)
FRAMES = 24

ENDINGS = (".usdc", ".glb", ".abc", ".bvh", ".vdb", ".vtkhdf", ".csv", ".parquet")

Array = NDArray[Any]


@dataclass(frozen=True)
class Away:
    """How far what was read is from the run.

    vertices  largest distance of a vertex over the size of the creature, of all frames
    degrees   largest angle between a joint and its own
    wrong     numbers of fields or tables that are not the run's
    late      largest difference of a frame's time, in frames
    """

    vertices: float | None = None
    degrees: float | None = None
    wrong: int | None = None
    late: float = 0.0

    def __str__(self) -> str:
        said = [] if self.vertices is None else [f"{self.vertices:.0e}"]
        said += [] if self.degrees is None else [f"{self.degrees:.0e} deg"]
        said += [] if self.wrong is None else ["exact" if self.wrong == 0 else f"{self.wrong}!"]
        said += [f"{self.late:.2g} frames late!"] if self.late > 1e-3 else []
        return ", ".join(said)


def lateness(times: Array, creature: Creature) -> float:
    """How far the times of a file are from those of the run's frames, in frames.

    raises  ValueError where it has not as many
    """
    if len(times) != len(creature.run):
        raise ValueError(f"{len(times)} frames for {len(creature.run)}")
    return float(np.abs(times * creature.run.frames_per_second - np.arange(len(times))).max())


def apart(found: dict[str, Array], wanted: dict[str, Array]) -> float:
    """Largest distance between meshes, m; raises ValueError where they have other names."""
    if set(found) != set(wanted):
        raise ValueError(f"{sorted(found)} for {sorted(wanted)}")
    return max(np.linalg.norm(found[name] - wanted[name], axis=1).max() for name in wanted)


def astray(joints: dict[str, Array], creature: Creature, frame: int) -> float:
    """Largest angle between joints and the run's bones, degrees."""
    found = np.array([joints[name] for name in creature.skeleton.names])
    return turned(found[:, :3, :3], creature.skeleton.rotation[frame])


def turned(first: Array, second: Array) -> float:
    """Largest angle between rotations (n, 3, 3), degrees."""
    away = Rotation.from_matrix(np.einsum("nji,njk->nik", first, second))
    return float(np.degrees(away.magnitude()).max())


def of_motion(open_file: Callable[[Path], Any], path: Path, creature: Creature) -> Away:
    """Of a file with meshes, and with joints perhaps."""
    reader = open_file(path)
    frames = range(len(creature.run))
    vertices = max(apart(reader.meshes(f), meshes_of(creature, f)) for f in frames)
    degrees = None
    if hasattr(reader, "joints"):
        degrees = max(astray(reader.joints(f), creature, f) for f in frames)
    return Away(vertices / creature.size, degrees, late=lateness(reader.times, creature))


def of_bvh(path: Path, creature: Creature) -> Away:
    """Angles count from the model's own pose; where the run follows a clip, whose skeleton is the
    file's, from the first frame, of the joints that are called as bodies."""
    reader, skeleton = Bvh(path), creature.skeleton
    turn, degrees = skeleton.carried[0], 0.0
    names = ["_".join(name.split()) for name in skeleton.names]
    bones, first = list(range(len(names))), np.eye(3)
    if "clip" in creature.run.tables:
        start = reader.joints(0)
        bones = [n for n in bones if names[n] in start]
        first = np.array([start[names[n]][:3, :3].T for n in bones])
        turn = np.einsum("fnij,nkj->fnik", turn, turn[0])
    for frame in range(len(creature.run)):
        joints = reader.joints(frame)
        found = np.array([joints[names[n]][:3, :3] for n in bones]) @ first
        degrees = max(degrees, turned(found, turn[frame, bones]))
    return Away(degrees=degrees, late=lateness(reader.times, creature))


def of_vdb(path: Path, creature: Creature) -> Away:
    run, wrong = creature.run, 0
    assert run.grid is not None
    everywhere = np.ones(run.grid.shape, bool)
    for frame in range(len(run)):
        state = run.state(frame)
        wanted = {dye: state[f"scalar_{dye}"] for dye in run.dyes}
        active = {dye: field != 0.0 for dye, field in wanted.items()} | {"velocity": everywhere}
        wanted["velocity"] = cell_velocity(run.grid, state)
        found = grids_of(path.with_name(f"{path.stem}_{frame:04d}{path.suffix}"), active)
        wrong += sum(int((found[n] != field.squeeze()).sum()) for n, field in wanted.items())
    return Away(wrong=wrong)


def of_vtkhdf(path: Path, creature: Creature) -> Away:
    run, reader, vertices, wrong = creature.run, VtkHdf(path), 0.0, 0
    bodies, flesh = creature.model.geom_names, creature.model.flesh
    for frame in range(len(run)):
        state, blocks, meshes = run.state(frame), reader.blocks(frame), meshes_of(creature, frame)
        wanted = np.concatenate([meshes[name] for name in bodies])
        vertices = max(vertices, np.abs(points_of(blocks["bodies"]) - wanted).max())
        if flesh is not None:
            skin = points_of(blocks["flesh"])[np.unique(flesh.surface)]
            vertices = max(vertices, np.abs(skin - state["flesh_vertices"]).max())
        if run.grid is None:
            continue
        fields = {"velocity": cell_velocity(run.grid, state)}
        fields |= {"vorticity": cell_vorticity(run.grid, state).astype(np.float32)}
        fields |= {name: state[name] for name in ("pressure", "open")}
        fields |= {dye: state[f"scalar_{dye}"] for dye in run.dyes}
        for name, field in fields.items():
            parts = field.reshape(*run.grid.shape, -1).transpose(2, 1, 0, 3)
            found = cells_of(blocks["fluid"], name).reshape(parts.shape)
            wrong += int((found != parts).sum())
    late = lateness(reader.times, creature)
    return Away(vertices / creature.size, wrong=None if run.grid is None else wrong, late=late)


def of_table(path: Path, creature: Creature) -> Away:
    table = pandas.read_csv(path) if path.suffix == ".csv" else pandas.read_parquet(path)
    history = creature.run.history
    if tuple(table.columns) != tuple(history):
        raise ValueError("other columns")
    same = {n: np.isclose(table[n], v, 0.0, 0.0, equal_nan=True) for n, v in history.items()}
    return Away(wrong=sum(int((~equal).sum()) for equal in same.values()))


READ: dict[str, Callable[[Path, Creature], Away]] = {
    ".usdc": partial(of_motion, Stage),
    ".glb": partial(of_motion, Gltf),
    ".abc": partial(of_motion, Alembic),
    ".bvh": of_bvh,
    ".vdb": of_vdb,
    ".vtkhdf": of_vtkhdf,
    ".csv": of_table,
    ".parquet": of_table,
}


def tried(ending: str, run: Path, folder: Path) -> tuple[str, str]:
    """What is said of an ending for a run: size and seconds, and how far what is read is away."""
    path = folder / f"{run.name}{ending}"
    begun = time.perf_counter()
    try:
        fb.export(run, path)
    except fb.SceneError as refused:
        return "", str(refused).split(". ")[0].split(" has ")[-1]
    seconds = time.perf_counter() - begun
    size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    away = READ[ending](path, Creature(fb.open_run(run)))
    return f"{short(size / 1e6)} MB, {short(seconds)} s", str(away)


def short(value: float) -> str:
    """Two digits of a number."""
    return f"{float(f'{value:.2g}'):g}"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]
    return "\n".join(lines) + "\n"


def tables(work: Path) -> str:
    """Both tables, by runs that are made in the folder `work`."""
    runs = []
    for scene in SCENES:
        loaded = fb.load_scene(scene)
        runs.append(work / loaded.name)
        fb.run(loaded, runs[-1], frames=FRAMES, film=False)
    made, found = [], []
    for ending in ENDINGS:
        said = []
        for run in runs:
            with TemporaryDirectory(dir=work) as folder:
                said.append(tried(ending, run, Path(folder)))
        made.append([f"`{ending}`", *(size for size, _ in said)])
        found.append([f"`{ending}`", *(away for _, away in said)])
    head = ["", *(f"`{run.name}`" for run in runs)]
    return table(head, found) + "\n" + table(head, made)


if __name__ == "__main__":
    with TemporaryDirectory() as work:
        made = tables(Path(work))
    PAGE.write_text(
        with_part(PAGE.read_text(encoding="utf-8"), "exporters", made), encoding="utf-8"
    )

"""The paper's Figs. 2, 7, 9 b, 10 and 11 by flowborne: tables, a picture and plots."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from flowborne import Array, Simulation, SolidModel, load_scene, run
from flowborne.bodies import SIDES, kinematics
from flowborne.machine import cores
from flowborne.parts import write_atomically
from flowborne.pictures import ChainCost, plot_chain_cost, plot_courses, plot_forces
from flowborne_validation.bench.timing import frame_times
from flowborne_validation.case import reference
from flowborne_validation.controller_in_flow import SCENES, course
from flowborne_validation.creatures import flights, swims

PAPER_SERIAL = {1: 14.0, 2: 29.0, 3: 43.0, 4: 58.0}
"""s per frame in Fig. 10 on the authors' machines; in parallel it is 14 to 15."""

ARMS_SCENE = "human-gravity-arms"
ARM = ("upper_arm", "forearm", "hand")
SETTLED = 0.25
"""Part of the frames of Fig. 9 b that is left out at the start."""

ARMS_COLUMNS = (
    "walk",
    "left arm ahead mm",
    "right arm ahead mm",
    "torso ahead mm",
    "torso to the left mm",
    "twist to the left degrees",
    "frames with contact",
)


def figure_names() -> tuple[str, ...]:
    """Every figure, in the paper's order."""
    return tuple(FIGURES)


def make_figures(
    out: Path, names: Sequence[str] | None = None, console: Console | None = None
) -> None:
    """Run the scenes of the paper's figures, print their tables and write files.

    out      folder, created if missing. A figure writes figure-<name>.csv, and most a .png
    names    of the figures; all when None
    console  for the tables
    raises   ArithmeticError or BlowUpError when a run blows up, OSError when a file cannot be
             written, ValueError when this machine cannot draw in three dimensions
    """
    shown = console or Console()
    out.mkdir(parents=True, exist_ok=True)
    for name in figure_names() if names is None else names:
        FIGURES[name](out, shown)


def convergence_figure(out: Path, console: Console) -> None:
    """Fig. 2: the frame in which the block arrives, for each wind and objective."""
    paper = reference("K6", "paper frames")
    columns = ["run", "scene", "reached in frame", "stays from frame", "frames in the paper"]
    columns += ["final angle", "chatter in steps"]
    rows = []
    for row, scene in SCENES.items():
        found = course(scene)
        stays = str(found.frames) if found.arrived else "never"
        final, chatter = f"{found.final:.1f}", f"{found.chatter:.2f}"
        rows.append((row, scene, found.reached, stays, paper[row], final, chatter))
    title = "Fig. 2: frames until the block is within a step of its final angle"
    finish(title, columns, rows, out / "figure-2.csv", console)


def swimmer_figure(out: Path, console: Console) -> None:
    """Fig. 7: rise, tilt and work of the swimmer, with its jet alone, and with neither."""
    found = swims(3)
    columns = ("run", "rises m", "largest tilt degrees", "work of the drives kJ")
    rows = [
        (name, f"{run.risen():.2f}", f"{run.tilt.max():.1f}", f"{1e-3 * run.work[-1]:.1f}")
        for name, run in found.items()
    ]
    finish("Fig. 7: three cycles of the swimmer", columns, rows, out / "figure-7.csv", console)
    runs = found.items()
    strips = {
        "height of the head (m)": {name: (run.time, run.height) for name, run in runs},
        "tilt (degrees)": {name: (run.time, run.tilt) for name, run in runs},
        "work of the drives (kJ)": {name: (run.time, 1e-3 * run.work) for name, run in runs},
    }
    plot_courses(strips, out / "figure-7.png")


def arms_figure(out: Path, console: Console) -> None:
    """Fig. 9 b: the leg blocks the arm, which stays ahead, and the torso balances it."""
    rows, frame = blocked_rows()
    finish("Fig. 9 b: arms in the way", ARMS_COLUMNS, rows, out / "figure-9b.csv", console)
    draw_frame(frame, out / "figure-9b.png")


def chain_figure(out: Path, console: Console) -> None:
    """Fig. 10: seconds per frame of chains with 1 to 4 joints."""
    costs = [ChainCost(n, frame_seconds(n, 1), frame_seconds(n, cores())) for n in PAPER_SERIAL]
    columns = ["joints", "serial s", "parallel s", "workers"]
    columns += ["serial s in the paper", "parallel s in the paper"]
    rows = [
        (
            c.joints,
            f"{c.serial:.4f}",
            f"{c.parallel:.4f}",
            cores(),
            PAPER_SERIAL[c.joints],
            "14 to 15",
        )
        for c in costs
    ]
    finish("Fig. 10: seconds per frame", columns, rows, out / "figure-10.csv", console)
    plot_chain_cost(costs, out / "figure-10.png")


def flyer_figure(out: Path, console: Console) -> None:
    """Figs. 11 and 12: upward force on a flyer with and without twisting wings."""
    found = flights(5)
    strokes = np.hstack([found["twist"].impulses(), found["base"].impulses()])
    rows = [(n, *(f"{value:.1f}" for value in row)) for n, row in enumerate(strokes, 1)]
    columns = ("stroke", "down N s", "up N s", "down without N s", "up without N s")
    finish("Fig. 11: upward impulse with twist", columns, rows, out / "figure-11.csv", console)
    curves = {
        name: (flight.time, flight.lift)
        for name, flight in zip(("no control", "twist"), found.values(), strict=True)
    }
    plot_forces("upward force of the air (N)", curves, out / "figure-11.png")


def blocked_rows(frames: int | None = None) -> tuple[list[Sequence[object]], int]:
    """Rows of `ARMS_COLUMNS` with and without collisions, and the frame with the largest difference
    between the arms.

    frames  number of frames; that of the scene when None
    """
    walks = {"arms collide": walk(True, frames), "arms pass through": walk(False, frames)}
    blocked = walks["arms collide"]
    late = round(SETTLED * len(blocked))
    rows: list[Sequence[object]] = []
    for name, found in walks.items():
        *lengths, twist = found[late:, :5].mean(axis=0)
        numbers = [f"{1e3 * length:.1f}" for length in lengths]
        rows.append((name, *numbers, f"{twist:.1f}", f"{100.0 * found[:, 5].mean():.0f} %"))
    apart = np.abs(blocked[late:, 0] - blocked[late:, 1])
    return rows, int(apart.argmax()) + late + 1


def walk(collisions: bool, frames: int | None = None) -> Array:
    """Run the scene with or without collisions of the arms.

    returns  (frames, 6) the two arms ahead, the torso ahead and to the left, m, and the twist in
             degrees as in `posture`; whether an arm touched the body
    """
    rows = []
    with Simulation(load_scene(ARMS_SCENE), workers=1) as simulation:
        model = simulation.world.setup.solid
        if not collisions:
            model.mj.geom_contype[:] = 0
        for _ in range(simulation.frames if frames is None else frames):
            report = simulation.advance_frame()
            ahead, torso, twist = posture(model, simulation.world.solid.q)
            rows.append((*ahead, *torso, twist, any(step.contacts > 0 for step in report.steps)))
    return np.array(rows, float)


def posture(model: SolidModel, q: Array) -> tuple[Array, Array, float]:
    """Positions of arms and torso in a pose.

    returns  (2,) m, centre of mass of the left and of the right arm ahead of its shoulder; (2,) m,
             that of the bodies above the back's joint without the arms, ahead and to the left of
             the joint; degrees of the thorax about the vertical, to the left
    """
    pose = kinematics(model, q)

    def centre(bodies: Sequence[int]) -> Array:
        mass = model.body_mass[bodies]
        return np.asarray(mass @ pose.mass_centre[bodies] / mass.sum())

    arms = {side: [model.body(f"{side}_{part}") for part in ARM] for side in SIDES}
    ahead = [centre(bodies)[0] - pose.body_position[bodies[0], 0] for bodies in arms.values()]
    above = np.flatnonzero(model.moves[:, model.dofs_of("lower_back")[0]])
    rest = np.setdiff1d(above, [body for bodies in arms.values() for body in bodies])
    torso = centre(rest.tolist()) - pose.body_position[model.body("lower_back")]
    turn = pose.body_rotation[model.body("thorax")]
    return np.array(ahead), torso[:2], float(np.degrees(np.arctan2(turn[1, 0], turn[0, 0])))


def draw_frame(frame: int, path: Path) -> None:
    """Picture of the scene after `frame` frames. Raises ValueError when this machine cannot draw in
    three dimensions."""
    import imageio.v3 as imageio

    from flowborne.pictures import Picture, Run

    with TemporaryDirectory() as folder:
        run(load_scene(ARMS_SCENE), Path(folder) / "run", frames=frame, film=False)
        picture = Picture(Run(Path(folder) / "run"), scale=1.5)
        pixels = picture.draw(frame)[:, :, :3].copy()
        picture.close()
    write_atomically(path, lambda file: imageio.imwrite(file, pixels, extension=".png"))


def frame_seconds(joints: int, workers: int, frames: int = 20) -> float:
    """Median time of a frame of ns-chain-`joints`, s; several workers are processes."""
    executor = "serial" if workers == 1 else "processes"
    with Simulation(load_scene(f"ns-chain-{joints}"), workers, executor) as simulation:
        return float(np.median(frame_times([simulation], frames)))


def finish(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[object]],
    path: Path,
    console: Console,
) -> None:
    """Print a table and write it as CSV."""
    table = Table(*columns, title=title)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        table.add_row(*(str(value) for value in row))
        writer.writerow(row)
    write_atomically(path, lambda file: file.write(text.getvalue().encode("utf-8")))
    console.print(table)


FIGURES: dict[str, Callable[[Path, Console], None]] = {
    "2": convergence_figure,
    "7": swimmer_figure,
    "9b": arms_figure,
    "10": chain_figure,
    "11": flyer_figure,
}
"""Name of a figure -> function that makes it."""

"""Puts the committed baselines into docs/learning.md, and draws their curves and the learned gait.

`make baselines` runs it after the measurements.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from baselines import DOCS, GAIT, TASKS, Data, Outcome, read, scene_of
from flowborne.play.gym import SceneEnv
from markdown_text import table
from marked import with_part

PAGE = DOCS / "learning.md"
CURVES, FILM = DOCS / "learning-curves.webp", DOCS / "learned-eel.webp"
GRADIENT = "gradient controller"

PLAYED = 4
"""Frames of the run for one of the film."""
SIZE = (360, 360)
"""Width and height of the film, pixels."""


def section() -> str:
    """A table for each environment that was measured, and the numbers of the eel's gaits."""
    data = read()
    parts = [f"### {name}\n\n{outcomes(name, data[name])}" for name in TASKS if name in data]
    return "\n".join([*parts, "### The eel's gaits\n", gaits(data["eel"])])


def outcomes(name: str, data: Data) -> str:
    """Every motion on every grid."""
    task = TASKS[name]
    power = "power, W/m" if scene_of(name, next(iter(task.grids))).is_slab else "power, W"
    head = ("grid", "motion", f"reward: {task.reward}", task.measured, power)
    rows = []
    for grid in task.grids:
        for kind, found in data.items():
            if grid in found["on"]:
                outcome = Outcome(**found["on"][grid])
                values = outcome.reward, outcome.measure, outcome.power
                cost = evaluations(found, outcome), training(found), f"{outcome.seconds:.2g}"
                rows.append([grid, title(name, kind), *(f"{v:.4g}" for v in values), *cost])
    return table((*head, "evaluations", "training, s", "episode, s"), rows)


def title(name: str, kind: str) -> str:
    """What a kind of motion is called in the table."""
    named = {"start": TASKS[name].start, "clip": "the clip, no control", "gradient": GRADIENT}
    return named.get(kind, f"learned, {kind}")


def evaluations(found: Data, outcome: Outcome) -> str:
    """Episodes of training, or trials of the controller in this episode."""
    if "best" in found:
        return f"{len(found['best']) * found['episodes']} episodes"
    return f"{outcome.trials} trials" if outcome.trials else "none"


def training(found: Data) -> str:
    return f"{found['seconds']:.0f}" if "seconds" in found else "none"


def learned(data: Data) -> Iterator[tuple[str, Data]]:
    """The seeds of an environment."""
    return ((kind, found) for kind, found in data.items() if "best" in found)


def gaits(data: Data) -> str:
    """The five numbers of every gait."""
    rows = [["scene `eel`", *(f"{value:g}" for value in GAIT.start)]]
    rows += [
        [kind, *(f"{value:.3g}" for value in found["numbers"])] for kind, found in learned(data)
    ]
    return table(("gait", *GAIT.names), rows)


def with_section(text: str) -> str:
    """The page with the tables of the committed results."""
    return with_part(text, "baselines", section())


def draw_curves(path: Path) -> None:
    """Best reward so far and mean of each generation, over episodes."""
    data = read()
    names = [name for name in TASKS if name in data]
    figure, grid = plt.subplots(
        (len(names) + 1) // 2, 2, figsize=(8.0, 2.9 * ((len(names) + 1) // 2)), layout="constrained"
    )
    for axes in list(grid.flat)[len(names) :]:
        axes.set_visible(False)
    for name, axes in zip(names, grid.flat, strict=False):
        trained = next(iter(TASKS[name].grids))
        for n, (kind, found) in enumerate(learned(data[name])):
            episodes = found["episodes"] * np.arange(1, len(found["best"]) + 1)
            axes.plot(episodes, found["best"], color=f"C{n}", label=kind)
            axes.plot(episodes, found["mean"], color=f"C{n}", linewidth=0.6, alpha=0.6)
        for kind, style in (("gradient", "-"), ("start", "--"), ("clip", ":")):
            if kind in data[name]:
                reward = data[name][kind]["on"][trained]["reward"]
                axes.axhline(reward, color="black", linestyle=style, linewidth=1.0, label=kind)
        axes.set(title=f"{name}, {trained}", xlabel="episodes", ylabel="reward")
        axes.legend(fontsize=7)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_eel(path: Path) -> None:
    """Film of the gait with the highest reward on its grid, on the finer one."""
    task, data = TASKS["eel"], read()["eel"]
    _, best = max(learned(data), key=lambda found: found[1]["best"][-1])
    env = SceneEnv(scene_of("eel", list(task.grids)[-1]), every=PLAYED, render_mode="rgb_array")
    observation, _ = env.reset()
    act, pictures, ended = task.policy(best["numbers"], env), [], False
    while not ended:
        pictures.append(Image.fromarray(env.render()).resize(SIZE, Image.Resampling.LANCZOS))
        action = np.clip(act(env.simulation.time, observation.astype(float)), -1.0, 1.0)
        observation, _, terminated, truncated, _ = env.step(action)
        ended = terminated or truncated
    first, *others = pictures
    duration = round(1000.0 / float(env.metadata["render_fps"]))
    first.save(path, save_all=True, append_images=others, duration=duration, loop=0, quality=60)


if __name__ == "__main__":
    PAGE.write_text(with_section(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    draw_curves(CURVES)
    draw_eel(FILM)

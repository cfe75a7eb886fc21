"""Baselines of the environments of flowborne.play.gym, in docs/learning.md: `make baselines`.

In each environment stand side by side: the motion that training starts from, the scene's gradient
controller, and policies of a few numbers, each trained with a seed of its own on the first grid by
CMA-ES (Hansen 2016, arXiv 1604.00772; library `cmaes`). All are then measured on every grid.

`make baselines` measures what docs/learning.json lacks, then `learning_page` writes tables and
curves; `make baselines NAMES="eel block"` measures these environments again. After a kill,
`make baselines` continues; a seed that was not finished starts again.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray

from flowborne import FrameReport, Measurement, Scene, Simulation, load_scene
from flowborne.control.controller import Controller
from flowborne.control.executors import Serial
from flowborne.play.gym import ENVIRONMENTS, SceneEnv

Array = NDArray[np.float64]
Data = dict[str, Any]
Policy = Callable[[float, Array], Array]
"""(time in s, observation) -> action."""

DOCS = Path(__file__).parents[1] / "docs"
RESULTS = DOCS / "learning.json"

WORKERS = 2
SIGMA = 0.3
"""First standard deviation of each number, as part of half its range."""


@dataclass(frozen=True)
class Numbers:
    """The numbers of a policy: their names, those that training starts from, and their range."""

    names: tuple[str, ...]
    start: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]

    def scaled(self, x: Array) -> Array:
        """The numbers of which -1 and 1 are the ends of the range."""
        low, high = np.array(self.low), np.array(self.high)
        return low + 0.5 * (x + 1.0) * (high - low)

    def unscaled(self, numbers: Sequence[float]) -> Array:
        """Inverse of `scaled`."""
        low, high = np.array(self.low), np.array(self.high)
        return 2.0 * (np.array(numbers) - low) / (high - low) - 1.0


def within_one(names: Sequence[str]) -> Numbers:
    """Numbers from -1 to 1 that start at 0."""
    count = len(names)
    return Numbers(tuple(names), (0.0,) * count, (-1.0,) * count, (1.0,) * count)


GAIT = Numbers(
    ("amplitude, degrees", "frequency, Hz", "lag, waves", "growth to the tail", "bias, degrees"),
    (20.0, 0.5, 0.14, 0.0, 0.0),
    (2.0, 0.2, -0.3, -1.0, -10.0),
    (30.0, 2.0, 0.4, 1.0, 10.0),
)
"""It starts from that of the scene `eel`."""


def gait(numbers: Sequence[float], env: SceneEnv) -> Policy:
    """A wave along the body, which joints follow as fast as their strength allows."""
    amplitude, frequency, lag, growth, bias = numbers
    place = [n for n, name in enumerate(env.observed) if name.startswith("position_")]
    count = np.arange(1, len(place) + 1)
    amplitudes = np.radians(amplitude) * (1.0 + growth * np.linspace(-1.0, 1.0, count.size))
    duration = 1.0 / float(env.metadata["render_fps"])
    fastest = controller_of(env).greatest_strength() * duration

    def act(time: float, observation: Array) -> Array:
        end = time + duration
        s = min(end, 1.0)
        wave = np.sin(2.0 * np.pi * (frequency * end - lag * count))
        wanted = s * s * (3.0 - 2.0 * s) * (amplitudes * wave + np.radians(bias))
        return np.asarray((wanted - observation[place]) / fastest)

    return act


BLOCK = within_one(("constant", "of the angle", "of its velocity", "of the drive"))
BLOCK_SCALES = np.array([1.0, 1.0, 10.0])
"""rad, rad/s, N: of the observations of the block's hinge."""


def linear(numbers: Sequence[float], env: SceneEnv) -> Policy:
    """An action that is linear in angle, velocity and drive force of the one joint."""
    constant, *slopes = 4.0 * np.array(numbers)

    def act(time: float, observation: Array) -> Array:
        return np.array([constant + slopes @ (observation[:3] / BLOCK_SCALES)])

    return act


STRIDE = 1.06
"""s, of the walker's clip."""
STARTING = 0.3
"""s, in which the walker's arms leave their first pose."""

WALKER = within_one(
    [
        f"{joint} {axis}: {part}"
        for joint in ("lower_back", "left_shoulder", "right_shoulder")
        for axis in "xyz"
        for part in ("start", "cos", "sin")
    ]
)


def strides(numbers: Sequence[float], env: SceneEnv) -> Policy:
    """Velocities with the rhythm of the walk, after a first move."""
    parts = np.reshape(numbers, (-1, 3))

    def act(time: float, observation: Array) -> Array:
        phase = 2.0 * np.pi * time / STRIDE
        return parts @ np.array([np.exp(-time / STARTING), np.cos(phase), np.sin(phase)])

    return act


STROKE = 1.75
"""s, period of the swimmer's mouth."""

SWIMMER = within_one(("cos", "sin", "cos 2", "sin 2"))


def strokes(numbers: Sequence[float], env: SceneEnv) -> Policy:
    """One velocity for all legs, with the rhythm of the mouth."""
    (legs,) = env.action_space.shape

    def act(time: float, observation: Array) -> Array:
        phase = 2.0 * np.pi * time / STROKE
        waves = np.cos(phase), np.sin(phase), np.cos(2.0 * phase), np.sin(2.0 * phase)
        return np.full(legs, np.dot(numbers, waves))

    return act


@dataclass(frozen=True)
class Task:
    """An environment, and how its policy is trained.

    grids        name -> changes of the scene; training runs on the first
    every        frames for which an action holds
    numbers      of the policy
    policy       of numbers and the environment
    start        what the policy does with the numbers that training starts from
    generations  of training
    measure      of a frame, and its name; the mean over the frames, or the last one
    mean         which of these
    reward       what the reward is, and its unit
    clip         whether the scene without control is measured, too
    seeds        of training
    """

    grids: Mapping[str, Mapping[str, str]]
    every: int
    numbers: Numbers
    policy: Callable[[Sequence[float], SceneEnv], Policy]
    start: str
    generations: int
    measure: Callable[[Simulation, FrameReport], float]
    measured: str
    reward: str
    mean: bool = False
    clip: bool = False
    seeds: tuple[int, ...] = (1, 2, 3)


def distance(simulation: Simulation, report: FrameReport) -> float:
    """m, of the eel's head from its start in the middle of its tank."""
    return float(simulation.body("head").position[1]) - 0.61


def angle(simulation: Simulation, report: FrameReport) -> float:
    """Degrees; at 0 the block is across the stream."""
    return float(np.degrees(simulation.joint("hinge").position[0]))


def arm_drag(simulation: Simulation, report: FrameReport) -> float:
    """N, of the wind on both arms."""
    names = simulation.setup.solid.body_names
    arms = [n for n, name in enumerate(names) if name.endswith(("_arm", "_forearm", "_hand"))]
    return -float(report.drag()[arms, 0].sum())


def rise(simulation: Simulation, report: FrameReport) -> float:
    """m, of the swimmer's head from its start."""
    return float(simulation.body("head").position[2])


TASKS = {
    "eel": Task(
        {"48 cells": {"domain.resolution": "48"}, "122 cells": {}},
        4,
        GAIT,
        gait,
        "the gait of the scene `eel`",
        20,
        distance,
        "distance, m",
        "speed, m/s",
    ),
    "walker": Task(
        {"wind of 8 m/s": {}, "wind of 12 m/s": {"wind.0.velocity": "[-12.0, 0.0, 0.0]"}},
        1,
        WALKER,
        strides,
        "arms held where they start",
        40,
        arm_drag,
        "drag of the arms, N",
        "minus drag, effort and distance from the clip",
        mean=True,
        clip=True,
    ),
    "block": Task(
        {"48 cells": {"domain.resolution": "48"}, "128 cells": {}},
        1,
        BLOCK,
        linear,
        "held where it starts",
        15,
        angle,
        "last angle, degrees",
        "pressure drag, N/m",
    ),
    "swimmer": Task(
        {
            f"{cells} cells": {"domain.resolution": f"{cells}", "time.frames": "54"}
            for cells in (48, 72)
        },
        3,
        SWIMMER,
        strokes,
        "legs held where they start",
        6,
        rise,
        "rise, m",
        "pressure drag, least then most, N",
        seeds=(1,),
    ),
}


def scene_of(name: str, grid: str) -> Scene:
    return load_scene(ENVIRONMENTS[name], TASKS[name].grids[grid])


def controller_of(env: SceneEnv) -> Controller:
    controller = env.simulation.controller
    assert controller is not None
    return controller


@dataclass(frozen=True)
class Outcome:
    """An episode.

    reward   mean over the frames of the scene; those after a breakdown count as the worst one
    measure  of the task
    power    W (W per m in a slab) of the controlled joints' drives, mean over the frames
    frames   done
    trials   of the gradient controller
    seconds  of computing, on all cores together
    """

    reward: float
    measure: float
    power: float
    frames: int
    trials: int
    seconds: float


class Meter:
    """Adds up an episode frame by frame; as a function, the reward of a frame."""

    def __init__(self, task: Task, controller: Controller, frames: int) -> None:
        self._task, self._controller, self._frames = task, controller, frames
        self.restart()

    def restart(self) -> None:
        self._rewards, self._powers, self._measures = list[float](), list[float](), list[float]()
        self._started = process_time()

    def __call__(self, simulation: Simulation, report: FrameReport) -> float:
        measurement = Measurement(simulation.world, report.step)
        self._rewards.append(-self._controller.objective.value(measurement))
        self._powers.append(float(report.power()[self._controller.dofs].sum()))
        self._measures.append(self._task.measure(simulation, report))
        return self._rewards[-1]

    def outcome(self, trials: int = 0) -> Outcome:
        seconds = process_time() - self._started
        measure = float(np.mean(self._measures)) if self._task.mean else self._measures[-1]
        done, power = len(self._rewards), float(np.mean(self._powers))
        lost = (self._frames - done) * min(self._rewards)
        reward = (sum(self._rewards) + lost) / self._frames
        return Outcome(reward, measure, power, done, trials, seconds)


@cache
def environment(name: str, grid: str) -> tuple[SceneEnv, Meter]:
    """Kept for all episodes of a process. The frame before them loads what is compiled."""
    scene, task = scene_of(name, grid), TASKS[name]
    meters: list[Meter] = []
    env = SceneEnv(scene, every=task.every, reward=lambda *frame: meters[0](*frame))
    meters.append(Meter(task, controller_of(env), scene.time.frames))
    env.reset()
    env.step(np.zeros(env.action_space.shape))
    return env, meters[0]


def episode(name: str, grid: str, numbers: Sequence[float]) -> Outcome:
    """An episode with the policy of these numbers."""
    env, meter = environment(name, grid)
    act = TASKS[name].policy(numbers, env)
    observation, _ = env.reset()
    meter.restart()
    ended = False
    while not ended:
        action = act(env.simulation.time, observation.astype(np.float64))
        observation, _, terminated, truncated, _ = env.step(np.clip(action, -1.0, 1.0))
        ended = terminated or truncated
    return meter.outcome()


class Counted(Serial):
    """Counts the trials of a controller."""

    def __init__(self) -> None:
        self.trials = 0

    def map(self, function: Any, tasks: Sequence[Any]) -> list[Any]:
        self.trials += len(tasks)
        return super().map(function, tasks)


def scene_itself(name: str, grid: str, control: bool) -> Outcome:
    """The scene with its gradient controller, or with its motions alone."""
    env, _ = environment(name, grid)
    scene, counted = scene_of(name, grid), Counted()
    if not control:
        alone = scene.model_copy(update={"control": (), "objectives": ()})
        scene = alone.in_folder(scene.folder)
    with Simulation(scene, workers=1, executor=counted) as simulation:
        meter = Meter(TASKS[name], controller_of(env), scene.time.frames)
        for _ in range(scene.time.frames):
            meter(simulation, simulation.advance_frame())
    return meter.outcome(counted.trials)


def train(name: str, seed: int, workers: int = WORKERS) -> Data:
    """Train the policy on the first grid.

    returns  numbers: the best ones found; best, mean: reward of the best episode so far, and the
             mean one of each generation; episodes: in a generation; seconds: of all episodes
    """
    task = TASKS[name]
    grid, numbers = next(iter(task.grids)), task.numbers
    start = numbers.unscaled(numbers.start)
    optimiser = CMA(start, SIGMA, bounds=np.array([[-1.0, 1.0]] * start.size), seed=seed)
    found: Data = {"numbers": [], "best": [], "mean": [], "episodes": optimiser.population_size}
    best, seconds = -np.inf, 0.0
    pool = ProcessPoolExecutor(workers, get_context("spawn")) if workers > 1 else None
    with_all = map if pool is None else pool.map
    for generation in range(task.generations):
        asked = [optimiser.ask() for _ in range(optimiser.population_size)]
        tried = [numbers.scaled(x).tolist() for x in asked]
        count = len(tried)
        outcomes = list(with_all(episode, [name] * count, [grid] * count, tried))
        rewards = [outcome.reward for outcome in outcomes]
        optimiser.tell([(x, -reward) for x, reward in zip(asked, rewards, strict=True)])
        if max(rewards) > best:
            best = max(rewards)
            found["numbers"] = tried[int(np.argmax(rewards))]
        found["best"].append(best)
        found["mean"].append(float(np.mean(rewards)))
        seconds += sum(outcome.seconds for outcome in outcomes)
        print(f"{name}, seed {seed}, generation {generation + 1}: {best:.5g}", flush=True)
    if pool is not None:
        pool.shutdown()
    return found | {"seconds": seconds}


def fill(name: str, results: Data, save: Callable[[], None]) -> None:
    """Measure what the results of an environment lack."""
    task = TASKS[name]
    seeds = {f"seed {seed}": seed for seed in task.seeds}
    kinds = ["start", *(["clip"] if task.clip else []), "gradient", *seeds]
    for kind in kinds:
        results.setdefault(kind, {"on": {}})
    for kind, seed in seeds.items():
        if "numbers" not in results[kind]:
            results[kind] |= train(name, seed)
            save()
    for grid, kind in product(task.grids, kinds):
        on = results[kind]["on"]
        if grid in on:
            continue
        if kind in ("clip", "gradient"):
            outcome = scene_itself(name, grid, control=kind == "gradient")
        else:
            outcome = episode(name, grid, results[kind].get("numbers", task.numbers.start))
        on[grid] = asdict(outcome)
        print(f"{name}, {grid}, {kind}: {outcome}", flush=True)
        save()


def read() -> Data:
    """The committed results: environment -> kind -> training, and outcome on each grid."""
    data: Data = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    return data


def rounded(value: Any) -> Any:
    """Numbers with 6 digits, at any depth."""
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [rounded(part) for part in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def main(names: Sequence[str]) -> None:
    data = read()

    def save() -> None:
        RESULTS.write_text(json.dumps(rounded(data), indent=1) + "\n", encoding="utf-8")

    for name in names:
        data.pop(name, None)
    for name in names or TASKS:
        fill(name, data.setdefault(name, {}), save)


if __name__ == "__main__":
    main(sys.argv[1:])

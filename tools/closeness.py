"""The walker's closeness to its clip against its effort: a picture and a table of the docs.

Every weight of an input-motion in `human-wind-all` is multiplied by a factor, from 0.03 to 100.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from flowborne import Measurement, Scene, Simulation, load_scene
from flowborne.control.objective_kinds import ObjectiveInputMotionTable
from flowborne.scenes.build import surroundings_of

SCENE = "human-wind-all"
FACTORS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
FIRST, FRAMES = 24, 120
PICTURE = Path(__file__).parents[1] / "docs" / "closeness.webp"


def weighted(scene: Scene, factor: float) -> Scene:
    """The scene with all closeness worth so many times as much."""
    objectives = tuple(
        table.model_copy(update={"weight": factor * table.weight})
        if isinstance(table, ObjectiveInputMotionTable)
        else table
        for table in scene.objectives
    )
    return scene.model_copy(update={"objectives": objectives}).in_folder(scene.folder)


def walked(scene: Scene) -> tuple[float, float]:
    """Root mean square of a joint's angle from the clip, degrees, and the median over frames of the
    torques of all joints together, N m."""
    angles, torques = [], []
    with Simulation(scene, workers=1) as simulation:
        around = surroundings_of(scene, simulation.setup.solid)
        tables = [t for t in scene.objectives if isinstance(t, ObjectiveInputMotionTable)]
        wanted = [table.reference(around) for table in tables]
        for frame in range(FRAMES):
            step = simulation.advance_frame().step
            if frame < FIRST:
                continue
            measured = Measurement(simulation.world, step)
            away = [measured.joints_away(m.dofs, m.position(measured.time)) for m in wanted]
            angles.append([np.linalg.norm(angle) for angle in away])
            torques.append([np.linalg.norm(step.actuator[motion.dofs]) for motion in wanted])
    rms = np.sqrt(np.mean(np.square(angles)))
    return float(np.degrees(rms)), float(np.median(np.sum(torques, axis=1)))


def main() -> None:
    scene = load_scene(SCENE)
    found = [walked(weighted(scene, factor)) for factor in FACTORS]
    for factor, (angle, torque) in zip(FACTORS, found, strict=True):
        print(f"| {factor:g} | {angle:.1f} | {torque:.0f} |")
    figure, axes = plt.subplots(figsize=(5.0, 3.4), layout="constrained")
    angles, torques = zip(*found, strict=True)
    axes.plot(angles, torques, "o-", color="#d08a00")
    for factor, angle, torque in zip(FACTORS, angles, torques, strict=True):
        axes.annotate(
            f"{factor:g}", (angle, torque), (5, 4), textcoords="offset points", fontsize=8
        )
    axes.set(
        xlabel="angle of a joint from the clip, rms, degrees",
        ylabel="torques above the hips, N m",
        ylim=(0.0, None),
        xlim=(0.0, None),
    )
    figure.savefig(PICTURE, dpi=120)


if __name__ == "__main__":
    main()

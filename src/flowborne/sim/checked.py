"""What `check` finds in a scene that can be run."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from math import prod
from pathlib import Path

import numpy as np

from flowborne.coupling.world import Setup
from flowborne.scenes.creature import Creature, creature_extent, creature_of
from flowborne.scenes.listing import has_gas
from flowborne.scenes.notes import notes_of
from flowborne.scenes.schema import Scene
from flowborne.scenes.seen import Seen, seen_bodies
from flowborne.scenes.warn import accepted_of, headline, warnings_of
from flowborne.sim.simulation import Simulation

MOST_STARTED = 4_000_000
"""Cells of the largest grid that `check` cuts and on which it starts bodies and fluid: that takes
some seconds and 2 GB."""


@dataclass(frozen=True, repr=False)
class Checked:
    """A scene that can be run, and what there is to say of it; `str` gives all of it for people.

    name      of the scene
    creature  its mass and size, None without bodies
    fluid     density, viscosity and Reynolds number, in a sentence
    warnings  sentences on what is implausible; none of them stops a run
    notes     sentences on what is good to know, among them warnings that the scene accepts
    bodies    how thick the fluid sees each body
    started   whether bodies and fluid were started, as on grids of up to MOST_STARTED cells
    """

    name: str
    creature: Creature | None
    fluid: str
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    bodies: tuple[Seen, ...]
    started: bool

    def __str__(self) -> str:
        later = (
            f"  not started, as the grid has more than {MOST_STARTED:,} cells; a run starts bodies "
            "and fluid first"
        )
        return "\n".join(
            [
                *([] if self.creature is None else self.creature.lines()),
                self.fluid,
                headline(self.warnings, self.notes),
                *([] if self.started else [later]),
                *(f"  warning: {warning}" for warning in self.warnings),
                *(f"  note: {note}" for note in self.notes),
                *(f"  {seen.sentence()}" for seen in self.bodies),
            ]
        )

    def __repr__(self) -> str:
        return f"Checked '{self.name}': {headline(self.warnings, self.notes)}"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def check(scene: Scene | str | Path) -> Checked:
    """Describe the creature and the fluid of a scene, and list what is implausible.

    Bodies and fluid are started as in a run, on grids of up to MOST_STARTED cells.

    scene   a Scene, or the name of a built-in one, or the path of a scene file
    raises  SceneError with every problem if the scene is wrong
    """
    with Simulation(scene, workers=1) as simulation:
        wanted, setup = simulation.scene, simulation.setup
        started = setup.fluid is None or prod(setup.fluid.grid.shape) <= MOST_STARTED
        if started:
            simulation.snapshot()
    return Checked(
        wanted.name,
        creature_of(wanted, setup, on_grid=started),
        fluid_line(wanted, setup),
        tuple(warnings_of(wanted, setup)),
        (*notes_of(wanted, setup.solid), *accepted_of(wanted, setup)),
        tuple(seen_bodies(setup)),
        started,
    )


def fluid_line(scene: Scene, setup: Setup) -> str:
    """Density and viscosity, and the Reynolds number where fluid streams past bodies: with the
    largest speed of a stream, and the largest extent of all that moves."""
    fluid = setup.fluid
    if fluid is None:
        return "fluid: none"
    said = f"fluid: {fluid.density:.4g} kg/m^3, viscosity "
    if fluid.viscosity == 0.0:
        known = "air has 1.8e-5 Pa s" if has_gas(scene) else "water has 1e-3 Pa s"
        return f"{said}none: no friction, walls slip; {known}"
    said += f"{fluid.viscosity:.3g} Pa s"
    streams = [side.stream() for _, side in scene.boundaries or ()]
    streams += [] if scene.fluid is None else [scene.fluid.velocity]
    speed = max((float(np.linalg.norm(v)) for v in streams if v is not None), default=0.0)
    length = float(max(creature_extent(scene, setup), default=0.0)) if scene.has_bodies else 0.0
    if speed == 0.0 or length == 0.0:
        return said
    number = fluid.density * speed * length / fluid.viscosity
    return f"{said}, Re {number:.3g} ({speed:.3g} m/s past {length:.3g} m)"

"""What a creature is to the fluid: its mass and size, and which of its geoms the fluid meets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.world import Setup
from flowborne.scenes.bodies import displace_of, initial_state
from flowborne.scenes.schema import Scene
from flowborne.scenes.wording import listed
from flowborne.solids.displacing import solid_geoms
from flowborne.solids.outline import Outline


@dataclass(frozen=True)
class Creature:
    """All that moves at the start of a run; all bodies where nothing does.

    mass              kg; kg/m in a slab
    displaced         m^3; m^2 in a slab, each body and flesh by itself
    displaced_mass    kg of fluid in its place; None without a fluid
    size              (3,) extent along x, y and z, m; (2,) in a slab
    geoms             that have a volume, of the whole model
    displacing_geoms  of them those that the fluid meets
    rule              by which these are chosen
    unmet             moving bodies that have none of them
    """

    mass: float
    displaced: float
    displaced_mass: float | None
    size: tuple[float, ...]
    geoms: int
    displacing_geoms: int
    rule: str
    unmet: tuple[str, ...]

    def lines(self) -> list[str]:
        """Three for people."""
        unit = "kg/m" if len(self.size) == 2 else "kg"
        size = " x ".join(f"{length:.3g}" for length in self.size)
        fluid = (
            ""
            if self.displaced_mass is None
            else f", in place of {self.displaced_mass:.3g} {unit} of fluid"
        )
        without = listed(self.unmet) if self.unmet else "none"
        chosen = f"{self.displacing_geoms} of {self.geoms}, {self.rule}"
        if self.displacing_geoms == self.geoms:
            chosen = f"all {self.geoms}"
        return [
            f"creature: {self.mass:.3g} {unit}{fluid}, {size} m",
            f"geoms that displace fluid: {chosen}",
            f"moving bodies without one: {without}",
        ]


def creature_of(scene: Scene, setup: Setup) -> Creature | None:
    """The creature of a scene, None without bodies."""
    model = setup.solid
    if not scene.has_bodies:
        return None
    moving, fluid = model.moves.any(axis=1), setup.fluid
    counted = moving if moving.any() else np.ones(model.nbody, bool)
    mass, displaced = model.body_mass[: model.nbody][counted].sum(), model.volume[counted].sum()
    if model.flesh is not None:
        mass += model.body_mass[model.nbody :].sum()
        displaced += model.flesh.volumes.sum()
    met = np.isin(np.arange(model.nbody), model.geom_body)
    return Creature(
        float(mass),
        float(displaced),
        None if fluid is None else float(fluid.density * displaced),
        tuple(creature_extent(scene, setup).tolist()),
        len(solid_geoms(model.mj)),
        model.ngeom,
        _rule(scene),
        tuple(model.body_names[body] for body in np.flatnonzero(moving & ~met)),
    )


def creature_extent(scene: Scene, setup: Setup) -> NDArray[np.float64]:
    """(dimensions,) extent at the start of all that moves, m; of all bodies where none does."""
    model, axes = setup.solid, scene.dimensions
    outline, state = Outline(model), initial_state(scene, model)
    places = outline.at(state.q)
    moving = model.moves[outline.body].any(axis=1)
    places = places[moving] if moving.any() else places
    if model.flesh is not None:
        places = np.concatenate([places, model.flesh.rest])
    return np.ptp(places[:, :axes], axis=0) if len(places) else np.zeros(axes)


def _rule(scene: Scene) -> str:
    if scene.solids is not None and not displace_of(scene.solids).by_rule:
        return "those of [solids] displace"
    return "of each body those that draw it, or those that collide where these are open or small"

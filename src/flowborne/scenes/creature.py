"""The creature of a scene: its mass and size, and the geoms that displace fluid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.base.phrases import listed
from flowborne.coupling.cut import cut_at
from flowborne.coupling.world import Setup
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.scenes.bodies import initial_state
from flowborne.scenes.schema import Scene
from flowborne.shapes.mesh import ShapeMesh
from flowborne.solids.dynamics import kinematics
from flowborne.solids.geoms import solid_geoms
from flowborne.solids.model import SolidModel
from flowborne.solids.surfaces import Outline

GRID_ERROR = 0.02
"""Part of the displaced mass by which the grid may be off before the lines say so."""


@dataclass(frozen=True)
class Creature:
    """All that moves at the start of a run; all bodies where nothing does.

    mass              kg; kg/m in a slab
    displaced_mass    kg of fluid in its place, by which buoyancy acts: exact, whatever the grid is;
                      None without two-way coupling, or if it is of the world itself
    displaced_on_grid
                      kg of fluid that the cells lack, by which the flow goes; None if not asked for
    size              (3,) extent along x, y and z, m; (2,) in a slab
    geoms             number of geoms with a volume
    displacing_geoms  number of them that displace fluid
    rule              by which these are chosen
    unmet             moving bodies without one
    """

    mass: float
    displaced_mass: float | None
    displaced_on_grid: float | None
    size: tuple[float, ...]
    geoms: int
    displacing_geoms: int
    rule: str
    unmet: tuple[str, ...]

    def lines(self) -> list[str]:
        """Three for people."""
        unit = "kg/m" if len(self.size) == 2 else "kg"
        size = " x ".join(f"{length:.3g}" for length in self.size)
        fluid = ""
        exact, cells = self.displaced_mass, self.displaced_on_grid
        if exact is not None:
            fluid = f", displaces {exact:.3g} {unit} of fluid"
            if cells is not None and abs(cells - exact) > GRID_ERROR * exact:
                fluid += f" ({cells:.3g} {unit} on the grid)"
        without = listed(self.unmet) if self.unmet else "none"
        chosen = f"{self.displacing_geoms} of {self.geoms}, {self.rule}"
        if self.displacing_geoms == self.geoms:
            chosen = f"all {self.geoms}"
        return [
            f"creature: {self.mass:.3g} {unit}{fluid}, {size} m",
            f"geoms that displace fluid: {chosen}",
            f"moving bodies without one: {without}",
        ]


def creature_of(scene: Scene, setup: Setup, *, on_grid: bool = True) -> Creature | None:
    """The creature of a scene, None without bodies.

    on_grid  whether to cut the grid for `displaced_on_grid`
    """
    model = setup.solid
    if not scene.has_bodies:
        return None
    counted, start = counted_bodies(model), initial_state(scene, model).q
    rule = "of each body the visual ones, or the collision ones where those are open or small"
    if scene.solids is not None and not scene.solids.displace.build().by_rule:
        rule = "those of [solids] displace"
    return Creature(
        float(model.body_mass[counted].sum()),
        displaced_mass(setup, counted),
        _displaced_on_grid(setup, start, counted) if on_grid else None,
        tuple(creature_extent(scene, setup).tolist()),
        len(solid_geoms(model.mj)),
        model.ngeom,
        rule,
        tuple(model.body_names[body] for body in unmet_bodies(model)),
    )


def counted_bodies(model: SolidModel) -> Mask:
    """(nbody + nodes,) bodies that move, all of them where none does, and nodes of flesh."""
    counted = model.moving if model.moving.any() else np.ones(model.nbody, bool)
    return np.append(counted, np.ones(len(model.body_mass) - model.nbody, bool))


def unmet_bodies(model: SolidModel) -> Integers:
    """(k,) numbers of moving bodies that the fluid does not meet."""
    return np.flatnonzero(model.moving & ~model.met)


def displaced_mass(setup: Setup, counted: Mask) -> float | None:
    """kg of fluid in place of the counted bodies and of flesh, as in `buoyancy_wrench` and
    `hydrostatic_push`; None without two-way coupling, and where geoms of the world are among them,
    on which no buoyancy is computed."""
    model, fluid = setup.solid, setup.fluid
    if fluid is None or fluid.one_way or (counted[0] and model.met[0]):
        return None
    volume = float(model.volume[counted[: model.nbody]].sum())
    if model.flesh is not None:
        volume += ShapeMesh(model.flesh.rest, model.flesh.surface).volume
    return fluid.density * volume


def _displaced_on_grid(setup: Setup, start: Array, counted: Mask) -> float | None:
    """The same in the cells nearest to these bodies."""
    fluid = setup.fluid
    if fluid is None or fluid.one_way:
        return None
    cut = cut_at(setup, kinematics(setup.solid, start))
    closed = fluid.grid.cell_volume - cut.volume
    return float(fluid.density * closed[counted[cut.nearest[:-1, :-1, :-1]]].sum())


def creature_extent(scene: Scene, setup: Setup) -> Array:
    """(dimensions,) extent at the start of all that moves, m; of all bodies where none does."""
    model, axes = setup.solid, scene.dimensions
    outline, state = Outline(model), initial_state(scene, model)
    places = outline.at(state.q)
    moving = model.moving[outline.body]
    places = places[moving] if moving.any() else places
    if model.flesh is not None:
        places = np.concatenate([places, model.flesh.rest])
    return np.ptp(places[:, :axes], axis=0) if len(places) else np.zeros(axes)

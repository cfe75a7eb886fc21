"""Warnings about bodies: sizes, densities, masses, geoms that displace no fluid, and floors."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from flowborne.base.phrases import and_more, listed, more_too, rounded_down, rounded_up
from flowborne.coupling.world import Fluid, Setup
from flowborne.runs.summary import LEAST_WATER
from flowborne.scenes.bodies import initial_state
from flowborne.scenes.creature import counted_bodies, creature_extent, displaced_mass, unmet_bodies
from flowborne.scenes.domain import Domain, fits_memory
from flowborne.scenes.schema import Scene
from flowborne.scenes.seen import Seen, seen_bodies
from flowborne.scenes.thrusters import parts_of_water
from flowborne.solids.enclosed import enclosing_geoms
from flowborne.solids.geoms import floors, geom_name, kind_of, rest_poses
from flowborne.solids.model import SolidModel
from flowborne.solids.model_checks import links_to_see
from flowborne.solids.model_files import parsed, text_of
from flowborne.solids.surfaces import geom_boxes

LEAST_CELLS = 2.0
"""Cells across the thinnest part of a body. A sheet of two cells holds a whole cell wherever it
lies on the grid; and it is thicker than the diagonal of a cell, 1.43 in slabs and 1.75 in rooms,
so that the fluid meets the body as thick as it is."""

LARGEST_DOMAIN = 100.0
"""Shortest side of a domain, in lengths of the creature. Sides that are L away change the added
mass of a body of the size D by (D/L)^2 of it (validation I2): 1e-4 at 100, less than any case is
accurate to. More than that is a slip of units."""

MOST_CELLS_ALONG = 10**6
"""Cells along a side that no machine holds, whatever the others are."""


def leaking_bodies(scene: Scene, setup: Setup) -> Iterator[str]:
    """Bodies that fluid passes through."""
    bodies = [body for body in seen_bodies(setup) if not body.tight]
    yield from _too_thin(scene, setup, bodies, "fluid passes through it")


def thin_bodies(scene: Scene, setup: Setup) -> Iterator[str]:
    """Bodies of fewer cells than LEAST_CELLS that fluid does not pass through."""
    h = 0.0 if setup.fluid is None else setup.fluid.grid.spacing
    least = LEAST_CELLS * h * (1.0 - 1e-9)
    bodies = [body for body in seen_bodies(setup) if body.tight and body.thickness < least]
    yield from _too_thin(
        scene, setup, bodies, f"below {LEAST_CELLS:g} cells the flow is not reliable"
    )


def _too_thin(scene: Scene, setup: Setup, bodies: list[Seen], harm: str) -> Iterator[str]:
    """What to do about bodies, if any: the thinnest of them."""
    if not bodies or setup.fluid is None or scene.domain is None:
        return
    worst = min(bodies, key=lambda body: body.thickness)
    remedy = _remedy(scene, setup, worst.thickness)
    harm += more_too(bodies)
    yield f"[domain]: {_size(worst, setup.fluid.grid.spacing)}, and {harm}; {remedy}"


def _size(body: Seen, h: float) -> str:
    """How thick a body is, in cells of h m, and its thickness on the grid."""
    cells = f"{body.thickness / h:.2g}"
    said = f"{body.name} is {body.thickness:.3g} m thick, {cells} cell{'s' * (cells != '1')}"
    if not body.tight or not 0.0 < body.thickness < body.seen * (1.0 - 1e-9):
        return said
    times = body.seen / body.thickness
    return f"{said}, and {body.seen:.3g} m on the grid, {times:.3g} times as thick"


def _remedy(scene: Scene, setup: Setup, thickness: float) -> str:
    """What gives LEAST_CELLS across `thickness` m: a grid that this machine holds, a smaller domain
    that the creature fits into, or a thicker body."""
    assert scene.domain is not None
    assert setup.fluid is not None
    domain, spacing = scene.domain, thickness / LEAST_CELLS
    if spacing > 0.0 and max(domain.extent()) / spacing < MOST_CELLS_ALONG:
        finer, said = _refined(domain, spacing)
        if fits_memory(finer.counts()):
            return f"{said} gives {LEAST_CELLS:g}"
        smaller = spacing / domain.spacing()
        if min(domain.extent()) * smaller > 2.0 * max(creature_extent(scene, setup)):
            longest = rounded_down(max(domain.extent()) * smaller)
            return f"in a domain {longest} m long as many cells give {LEAST_CELLS:g}"
    return f"a thickness of {rounded_up(LEAST_CELLS * domain.spacing())} m gives {LEAST_CELLS:g}"


def _refined(domain: Domain, spacing: float) -> tuple[Domain, str]:
    """The domain with cells no larger than `spacing` m, and the key that makes it so."""
    if domain.cells is not None:
        common = math.gcd(*domain.cells)
        times = math.ceil(domain.spacing() * common / spacing * (1.0 - 1e-9))
        cells = tuple(count // common * times for count in domain.cells)
        return domain.model_copy(update={"cells": cells}), f"domain.cells = {list(cells)}"
    resolution = math.ceil(max(domain.extent()) / spacing * (1.0 - 1e-9))
    finer = domain.model_copy(update={"resolution": resolution})
    return finer, f"domain.resolution = {resolution}"


def lost_in_domain(scene: Scene, setup: Setup) -> Iterator[str]:
    """Creatures that are tiny in their domain."""
    if setup.fluid is None or setup.fluid.one_way or scene.domain is None:
        return
    length, shortest = max(creature_extent(scene, setup)), min(scene.domain.extent())
    if 0.0 < length < shortest / LARGEST_DOMAIN * (1.0 - 1e-9):
        yield (
            f"[domain]: its shortest side is {shortest:.3g} m, {shortest / length:.3g} times the "
            f"{length:.3g} m that the bodies measure, and sides so far away change nothing; "
            f"{rounded_down(LARGEST_DOMAIN * length)} m or less will do, and lengths are metres"
        )


LIGHT, HEAVY = 0.1, 10.0
"""Mass of a body over that of the liquid in its place. In water balsa has 0.14 and steel 7.8; what
is typed in g/cm^3 beside a fluid in kg/m^3 has a thousandth, and the other way round a thousand
times as much."""

GAS_DENSITY, GAS_VISCOSITY = 20.0, 1e-4
"""kg/m^3 and Pa s above which a fluid is no gas: the heaviest, tungsten hexafluoride, has 12.4, and
the most viscous ones some 1e-4; ordinary liquids have 600 and 2e-4 or more."""

DENSEST = 22_600.0
"""kg/m^3 of osmium: in a gas bodies may be thousands of times heavier than what they displace, and
none is denser than this."""

GRAM_PER_CM3 = 1000.0
"""kg/m^3."""


def is_gas(fluid: Fluid) -> bool:
    return fluid.density <= GAS_DENSITY and fluid.viscosity <= GAS_VISCOSITY


def implausible_density(scene: Scene, setup: Setup) -> Iterator[str]:
    """Bodies far lighter or far heavier than the fluid in their place.

    Those that flesh covers have the flesh's density. There are no warnings with a
    one-way fluid, on which bodies have no effect.
    """
    if setup.fluid is None or setup.fluid.one_way:
        return
    rho = setup.fluid.density
    gas = is_gas(setup.fluid)
    most = DENSEST if gas else HEAVY * rho
    found = [*mean_densities(setup.solid), *((table.name, table.density) for table in scene.flesh)]
    light = sorted((body for body in found if body[1] < LIGHT * rho), key=lambda body: body[1])
    heavy = sorted((body for body in found if body[1] > most), key=lambda body: -body[1])
    for bodies, factor, bound in (
        (light, GRAM_PER_CM3, rounded_up(LIGHT * rho)),
        (heavy, 1.0 / GRAM_PER_CM3, rounded_down(most)),
    ):
        if not bodies:
            continue
        density = bodies[0][1]
        meant = factor * density
        likely = LIGHT * rho <= meant <= most
        value = f"{meant:.6g} kg/m^3 will do" if likely else f"{bound} kg/m^3 will do"
        if bodies is heavy and not gas and rho <= GAS_DENSITY:
            value = f"fluid.density = {GRAM_PER_CM3 * rho:.6g} will do"
        has, place = ("has", "its") if len(bodies) == 1 else ("have", "their")
        yield (
            f"[fluid]: {and_more([name for name, _ in bodies])} of {density:.3g} kg/m^3 {has} "
            f"{density / rho:.3g} times the mass of the fluid of {rho:.4g} kg/m^3 in {place} "
            f"place; {value}, and 1 g/cm^3 is 1000 kg/m^3"
        )


def mass_apart(scene: Scene, setup: Setup) -> Iterator[str]:
    """Creatures whose mass and size in the fluid do not fit, though each body's do: much of their
    mass is in bodies that displace nothing."""
    model, fluid = setup.solid, setup.fluid
    if fluid is None or fluid.one_way or is_gas(fluid) or any(implausible_density(scene, setup)):
        return
    counted = counted_bodies(model)
    mass, displaced = model.body_mass[counted].sum(), displaced_mass(setup, counted)
    if not (displaced and model.moving.any()):
        return
    times = float(mass / displaced)
    if LIGHT <= times <= HEAVY:
        return
    yield (
        f"[solids]: the creature of {mass:.3g} kg has {times:.3g} times the mass of the fluid in "
        "its place; [solids] displace names geoms that the fluid meets, and densities set the mass"
    )


def mean_densities(model: SolidModel) -> Iterator[tuple[str, float]]:
    """Name and mean density, kg/m^3, of every body that moves and that no flesh covers in part."""
    covered = np.zeros(model.nbody, bool)
    covered[model.geom_body[model.geom_covered]] = True
    for body in np.flatnonzero(model.moving & ~covered & (model.volume > 0.0)):
        yield model.body_names[body], float(model.body_mass[body] / model.volume[body])


LEAST_MASS = 0.01
"""Part of the creature's mass. Bodies without any geom that have less together are frames; 1 % of
the mass is less than a force of the fluid is right to on the grids that films have."""


def only_to_see(scene: Scene, setup: Setup) -> Iterator[str]:
    """Links of a URDF that only have visual shapes, and so displace nothing."""
    links = _only_to_see(scene, setup)
    if links:
        have = "has" if len(links) == 1 else "have"
        yield (
            f"[solids]: {listed(links)} {have} visual shapes alone, which MuJoCo leaves out of a "
            "URDF, so that no fluid meets them; "
            '<mujoco><compiler discardvisual="false"/></mujoco> within its <robot> keeps them'
        )


def _only_to_see(scene: Scene, setup: Setup) -> list[str]:
    """Links that `only_to_see` names: those that move, and all where nothing displaces fluid."""
    if setup.fluid is None or scene.model_path is None:
        return []
    model = setup.solid
    unmet = {model.body_names[body] for body in unmet_bodies(model)}
    links = links_to_see(parsed(text_of(scene.model_path)))
    return [link for link in links if link in unmet or not model.ngeom]


def bodies_not_met(scene: Scene, setup: Setup) -> Iterator[str]:
    """Moving bodies that displace no fluid, though they have geoms that could, or mass.

    Ballast inside a hull is none of them.
    """
    if setup.fluid is None:
        return
    model, unmet = setup.solid, unmet_bodies(setup.solid)
    outside = model.mj.geom_bodyid[enclosing_geoms(model) < 0]
    unmet = unmet[(model.mj.body_geomnum[unmet] == 0) | np.isin(unmet, outside)]
    seen = _only_to_see(scene, setup)
    unmet = unmet[[model.body_names[body] not in seen for body in unmet]]
    bare = model.mj.body_geomnum[unmet] == 0
    whole = model.body_mass[counted_bodies(model)].sum()
    named = unmet
    if model.body_mass[unmet[bare]].sum() <= LEAST_MASS * whole:
        named = unmet[~bare]
    if named.size:
        them = "it" if named.size == 1 else "them"
        yield (
            f"[solids]: no geom of {listed([model.body_names[b] for b in named])} displaces "
            f"fluid, which flows through {them}; [solids] displace names geoms that do, and a body "
            "without any needs one in the model"
        )


def fixed_outside(scene: Scene, setup: Setup) -> Iterator[str]:
    """Geoms of bodies that do not move, wholly outside the domain and where it may come to."""
    if setup.fluid is None or scene.domain is None:
        return
    model, domain = setup.solid, scene.domain
    low, high = geom_boxes(model, initial_state(scene, model).q)
    axes = slice(0, scene.dimensions)
    gone = (high[:, axes] <= domain.lower) | (low[:, axes] >= domain.upper)
    gone &= ~np.array(setup.fluid.boundaries.periodic())[axes]
    if setup.fluid.window is not None:
        gone[:, list(setup.fluid.window.axes)] = False
    fixed = ~model.moving[model.geom_body]
    names = [model.geom_names[g] for g in np.flatnonzero(gone.any(axis=1) & fixed)]
    if names:
        yield (
            f"[domain]: {listed(names)} lie{'s' * (len(names) == 1)} outside the domain, and no "
            "fluid meets it; a larger domain does, and [solids] displace.without leaves geoms out"
        )


def floors_in_fluid(scene: Scene, setup: Setup) -> Iterator[str]:
    """Planes and height fields inside the domain: bodies rest on them, and the fluid does not."""
    if setup.fluid is None or scene.domain is None:
        return
    mj, grid = setup.solid.mj, setup.fluid.grid
    low, high = np.array(grid.origin), np.array(grid.origin) + grid.spacing * np.array(grid.shape)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    _, _, position, rotation = rest_poses(mj)
    for geom in floors(mj):
        kind = kind_of(mj, geom)
        height = (corners - position[geom]) @ rotation[geom][:, 2]
        top = mj.hfield_size[mj.geom_dataid[geom], 2] if kind == "hfield" else 0.0
        if height.min() < -grid.spacing and height.max() > top + grid.spacing:
            yield (
                f"[domain]: the {kind} '{geom_name(mj, geom)}' lies inside the fluid, which flows "
                "through it; a domain that ends there has a solid side, and a box in the model is "
                "met"
            )


def discs_not_met(scene: Scene, setup: Setup) -> Iterator[str]:
    """Thrusters with a disc that the grid does not resolve, or that is mostly no water."""
    if setup.fluid is None or not setup.thrusters:
        return
    coarse = [t for t in setup.thrusters if t.radius < setup.fluid.grid.spacing]
    if coarse:
        least = min(thruster.radius for thruster in coarse)
        names = listed([thruster.name for thruster in coarse])
        yield (
            f"[[thruster]]: the disc of {names} is less than two cells across, so that its jet is "
            f"wider and slower than it should be; cells of {least:.3g} m resolve it"
        )
    start = initial_state(scene, setup.solid)
    parts = parts_of_water(setup.thrusters, setup, start)
    for thruster, part in zip(setup.thrusters, parts, strict=True):
        if isinstance(part, float) and part < LEAST_WATER:
            yield (
                f"[[thruster]]: {100.0 * part:.0f} % of the disc of '{thruster.name}' are water, "
                "which has the whole thrust, as the rest is in a body or outside the domain; a "
                "place farther out makes it a whole disc"
            )

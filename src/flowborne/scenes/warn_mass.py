"""Warnings about densities that no body or fluid has."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.coupling.world import Fluid, Setup
from flowborne.phrases import and_more, rounded_down, rounded_up
from flowborne.scenes.schema import Scene
from flowborne.solids.model import SolidModel

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
    found = [*_bones(setup.solid), *((table.name, table.density) for table in scene.flesh)]
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
    moving = model.moving
    mass, displaced = model.body_mass[: model.nbody][moving].sum(), model.volume[moving].sum()
    if model.flesh is not None:
        mass += model.body_mass[model.nbody :].sum()
        displaced += model.flesh.volumes.sum()
    if not displaced:
        return
    times = float(mass / (fluid.density * displaced))
    if LIGHT <= times <= HEAVY:
        return
    yield (
        f"[solids]: the creature of {mass:.3g} kg has {times:.3g} times the mass of the fluid in "
        "its place; [solids] displace names geoms that the fluid meets, and densities set the mass"
    )


def _bones(model: SolidModel) -> Iterator[tuple[str, float]]:
    """Name and mean density, kg/m^3, of every body that moves and that no flesh covers in part."""
    covered = np.zeros(model.nbody, bool)
    covered[model.geom_body[model.geom_covered]] = True
    for body in np.flatnonzero(model.moving & ~covered & (model.volume > 0.0)):
        yield model.body_names[body], float(model.body_mass[body] / model.volume[body])

"""Options of a model file: those that have no effect here, and those that switch parts off."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from flowborne.base.phrases import listed

REPLACED = {"integrator": mujoco.mjtIntegrator, "solver": mujoco.mjtSolver, "cone": mujoco.mjtCone}
"""Options that the coupled solve has its own of, and MuJoCo's names for their values."""

MEDIUM = ("density", "viscosity", "wind")
"""Options of MuJoCo's own medium, which the fluid replaces."""

SWITCHES = ("constraint", "contact", "damper", "equality", "frictionloss", "limit", "spring")
"""MuJoCo's flags that switch parts of a model off, here as well."""


def replaced_options(
    spec: mujoco.MjSpec, gravity: tuple[float, ...], step: float, on_floors: bool
) -> Iterator[str]:
    """Options of a model file that differ from MuJoCo's defaults and have no effect.

    gravity    m/s^2 of the scene
    step       s, of the scene
    on_floors  whether the model has a floor, on which the default gravity counts as given
    """
    option, default = spec.option, mujoco.MjSpec().option
    given = not np.array_equal(option.gravity, default.gravity) or on_floors
    if given and not np.array_equal(option.gravity, gravity):
        x, y, z = option.gravity
        own = ", ".join(f"{g:g}" for g in gravity)
        yield f"its gravity of ({x:g}, {y:g}, {z:g}) m/s^2, where the scene has ({own})"
    if option.timestep != default.timestep:
        yield f"its timestep of {1e3 * option.timestep:g} ms, where a step is {1e3 * step:.3g} ms"
    changed = [
        f"{key} {kinds(getattr(option, key)).name.rpartition('_')[2].lower()}"
        for key, kinds in REPLACED.items()
        if getattr(option, key) != getattr(default, key)
    ]
    changed += [key for key in MEDIUM if np.any(getattr(option, key) != getattr(default, key))]
    if option.noslip_iterations:
        changed.append("noslip_iterations")
    if option.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        changed.append("gravity disabled")
    if changed:
        yield f"options {listed(changed)}"


def disabled_parts(spec: mujoco.MjSpec) -> list[str]:
    """Those of SWITCHES that a model file switches off."""
    flags, bits = spec.option.disableflags, mujoco.mjtDisableBit
    return [name for name in SWITCHES if flags & getattr(bits, f"mjDSBL_{name.upper()}")]


def bodies_with_own_inertia(spec: mujoco.MjSpec) -> list[str]:
    """Names of the bodies whose mass is that of their <inertial>, and not of their geoms."""
    if spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return []
    return [body.name for body in spec.bodies if body.explicitinertial]

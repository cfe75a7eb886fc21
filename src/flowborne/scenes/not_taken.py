"""What of a model file a run does not take, said once, and what the file itself switches off."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from flowborne.phrases import listed
from flowborne.scenes.bodies import spec_of
from flowborne.scenes.schema import Scene
from flowborne.solids.geoms import floors
from flowborne.solids.model import SolidModel

REPLACED = {
    "integrator": mujoco.mjtIntegrator,
    "solver": mujoco.mjtSolver,
    "cone": mujoco.mjtCone,
}
"""Options that the coupled solve has its own of, and MuJoCo's names for their values."""

MEDIUM = ("density", "viscosity", "wind")
"""Options of MuJoCo's own medium, in whose place the fluid is."""


def not_taken(scene: Scene, model: SolidModel) -> str | None:
    """One sentence on what of the model file has no effect, None where all of it has."""
    if scene.model_path is None or scene.solids is None:
        return None
    spec, on_floors = spec_of(scene), bool(floors(model.mj))
    said = [*_options(scene, spec, on_floors), *_elements(scene, spec), *_densities(scene, spec)]
    if not said:
        return None
    return f"[solids]: of {scene.model_path.name} these have no effect: {'; '.join(said)}"


COUNTING = ("constraint", "contact", "damper", "equality", "frictionloss", "limit", "spring")
"""MuJoCo's flags that switch parts of a model off, and do so here."""


def switched_off(scene: Scene) -> str | None:
    """One sentence on what the model file itself switches off, None where it leaves all on."""
    if scene.model_path is None:
        return None
    flags = spec_of(scene).option.disableflags
    off = [
        name for name in COUNTING if flags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}")
    ]
    if not off:
        return None
    return f"[solids]: {scene.model_path.name} itself switches off its {listed(off)} by <flag>"


def _options(scene: Scene, spec: mujoco.MjSpec, on_floors: bool) -> Iterator[str]:
    option, default = spec.option, mujoco.MjSpec().option
    given = not np.array_equal(option.gravity, default.gravity) or on_floors
    if given and not np.array_equal(option.gravity, scene.gravity):
        x, y, z = option.gravity
        own = ", ".join(f"{g:g}" for g in scene.gravity)
        yield f"its gravity of ({x:g}, {y:g}, {z:g}) m/s^2, where the scene has ({own})"
    step = scene.frame_time / scene.time.steps_per_frame
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


def _elements(scene: Scene, spec: mujoco.MjSpec) -> Iterator[str]:
    keys = [key.name or f"keyframe {n}" for n, key in enumerate(spec.keys)]
    if keys and scene.initial.keyframe is None:
        yield f"keyframes {listed(keys)}, of which [initial] keyframe takes one"
    assert scene.solids is not None
    hold = bool(scene.solids.hold)
    servos = sum(bool(actuator.biasprm[1] < 0.0) for actuator in spec.actuators)
    others = len(spec.actuators) - servos * hold
    if others:
        yield f"{others} actuator{'s' * (others > 1)}" + (
            f", of which [solids] hold = true takes {servos}" if servos and not hold else ""
        )
    if spec.sensors:
        yield f"{len(spec.sensors)} sensor{'s' * (len(spec.sensors) > 1)}"


def _densities(scene: Scene, spec: mujoco.MjSpec) -> Iterator[str]:
    """Bodies whose own inertia counts, and not the densities of the scene."""
    assert scene.solids is not None
    given = scene.solids
    always = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    own = [
        body.name
        for body in spec.bodies
        if body.explicitinertial and given.densities.get(body.name, given.density) is not None
    ]
    if own and not always:
        yield (
            f"[solids] density for {listed(own)}, whose <inertial> in the file says what they weigh"
        )

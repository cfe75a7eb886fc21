"""Reading an MJCF model and compiling it for the coupled solve, also as a slab."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
from mujoco import MjModel, MjSpec

from flowborne.kernels.arrays import Array
from flowborne.shapes.own import PlacedShape
from flowborne.shapes.section import Section
from flowborne.solids.displacing import BY_RULE, Displace, chosen_geoms, write_groups
from flowborne.solids.geoms import (
    CONTACT_ONLY,
    HIDDEN_GROUP,
    add_shapes,
    displacing_geoms,
    element_name,
    geom_name,
    geom_shape,
    kind_of,
    own_by_mesh,
    rest_poses,
)
from flowborne.solids.mending import exclude_joined, mend_meshes
from flowborne.solids.model_checks import too_large, wrong_model_values, wrong_spec_values
from flowborne.solids.model_files import ModelFiles, gathered, parsed

ARENA = 1 << 26
"""Bytes of MuJoCo's working memory without the pairs of bodies; by default it grows with the square
of the number of dofs."""


STDERR = 2
"""File descriptor that Qhull writes to, past Python's `sys.stderr`."""

NEGLIGIBLE = 1e-6
"""kg and kg m^2 that a body without mass may be given: negligible for any real body."""

REMEDIES = (
    {"balanceinertia": True},
    {"boundmass": NEGLIGIBLE, "boundinertia": NEGLIGIBLE},
    {"balanceinertia": True, "boundmass": NEGLIGIBLE, "boundinertia": NEGLIGIBLE},
)
"""Attributes of the compiler element that correct inertias, in the order of trial."""


@dataclass(frozen=True)
class Given:
    """Settings of a model in addition to its file.

    density    kg/m^3, replaces the density of every geom that displaces fluid; a mass that the file
               gives a geom wins over every density, as in MuJoCo
    densities  body -> kg/m^3 of its geoms, replaces `density`
    shapes     the user's geometries, added to those of the file
    floating   bodies on the world without a joint; they get a free joint of the same name
    displace   geoms that displace fluid
    packages   folders that may contain ROS packages, in addition to those above the model
    hulls      whether meshes with large holes are replaced by their convex hulls
    """

    density: float | None = None
    densities: Mapping[str, float] = field(default_factory=dict)
    shapes: Sequence[PlacedShape] = ()
    floating: Sequence[str] = ()
    displace: Displace = BY_RULE
    packages: Sequence[Path] = ()
    hulls: bool = False

    def density_of(self, body: str) -> float | None:
        """kg/m^3 of the geoms of a body; None for the values of the model."""
        return self.densities.get(body, self.density)


NOTHING = Given()


def bones_of(
    source: str | Path, slab: bool, gravity: tuple[float, float, float], given: Given = NOTHING
) -> tuple[MjSpec, MjModel]:
    """The spec and MuJoCo's model of an MJCF file (a Path) or text (a str), without flesh.

    MuJoCo's own medium, sleeping and noslip pass are switched off, which the fluid replaces, and so
    are actuators and sensors, which `motors` and `sensors` switch on where they are computed.
    raises  ValueError for a bad model
    """
    where = _named(source)
    spec = read_spec(source, given.packages)
    wrong = next(wrong_spec_values(spec), None)
    if wrong is not None:
        raise ValueError(f"{where}: {wrong}")
    _set_options(spec, gravity)
    add_shapes(spec, given.shapes)
    for name in given.floating:
        _set_floating(spec, name, where)
    for geom in _weighed_by_scene(spec, given):
        geom.density = given.density_of(geom.parent.name)
    mj = _compiled(spec, where)
    with _errors_at(where):
        chosen = chosen_geoms(spec, mj, given.displace)
    weightless = _weightless(spec, chosen, given)
    for geom in weightless:
        geom.mass = 0.0
    if write_groups(spec, chosen) or weightless:
        mj = _compiled(spec, where)
    _refuse_unsupported(mj, where)
    with _errors_at(where):
        mended = mend_meshes(spec, mj, displacing_geoms(mj), given.hulls)
    if exclude_joined(spec, mj) or mended:
        mj = _compiled(spec, where)
    if slab:
        _set_slab_inertias(spec, mj)
        try:
            mj = compiled_quietly(spec)
        except ValueError as error:
            raise ValueError(f"{where} cannot be made a slab: {error}.") from error
    return spec, mj


@contextmanager
def _errors_at(where: str) -> Iterator[None]:
    """Context in which the messages of ValueErrors get the name of the model."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error


def compiled_quietly(spec: MjSpec) -> MjModel:
    """The model of a spec, with colours clipped to 0 to 1 and without Qhull's messages.

    raises  ValueError for a bad model
    """
    with _silent_stderr():
        mj = spec.compile()
    for colours in (mj.geom_rgba, mj.mat_rgba, mj.skin_rgba):
        np.clip(np.nan_to_num(colours), 0.0, 1.0, out=colours)
    return mj


@contextmanager
def _silent_stderr() -> Iterator[None]:
    kept, nothing = os.dup(STDERR), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, STDERR)
        yield
    finally:
        os.dup2(kept, STDERR)
        os.close(kept)
        os.close(nothing)


def _unreadable(where: str, error: Exception) -> ValueError:
    """The error for a model that its reader refuses."""
    return ValueError(f"{where} cannot be read: {error}. Mend the MJCF there.")


def _refusal(spec: MjSpec, where: str, error: ValueError) -> ValueError:
    """The error for a model that does not compile, with a remedy that has been tried.

    spec   of the model, not changed
    where  name of the model
    """
    muscle = re.search(r"(.*lengthrange.*) in actuator (\d+)", str(error), re.IGNORECASE)
    if muscle is not None:
        why = muscle[1].removeprefix("Error: ")
        return ValueError(f"{where}: {_without_range(spec.actuators[int(muscle[2])], why)}")
    found = re.search(r"Error: (.*inertia.*?)\s*Element name '([^']*)'", str(error), re.DOTALL)
    if found is None:
        return _unreadable(where, error)
    why = re.sub(r"; use .*|error '|' in fullinertia", "", found[1].strip())
    return ValueError(
        f"{where}: MuJoCo refuses the inertia of body '{found[2]}' ({why}). {_remedy(spec)}"
    )


def _without_range(muscle: mujoco.MjsActuator, why: str) -> str:
    """Sentences about a muscle whose length has no ends, or that does not come to rest there."""
    return (
        f"'{muscle.name}' is a muscle, whose force goes by its length between the shortest and the "
        f"longest. MuJoCo looks for these by pulling '{muscle.target}' both ways until it stops, "
        f"and it did not ({why}). Give the joints or the tendon that it pulls a range, or the "
        'muscle its own lengthrange="shortest longest", as where a tendon slips off a geom.'
    )


def _remedy(spec: MjSpec) -> str:
    """A sentence: how to correct inertias that MuJoCo refuses."""
    for keys in REMEDIES:
        corrected = spec.copy()
        for key, value in keys.items():
            setattr(corrected.compiler, key, value)
        try:
            compiled_quietly(corrected)
        except ValueError:
            continue
        written = " ".join(f'{key}="{str(value).lower()}"' for key, value in keys.items())
        return (
            f"Correct its <inertial> or the mass of its geoms, or add <compiler {written}/>, in a "
            "URDF within <mujoco> in <robot>."
        )
    return "Correct its <inertial> or the mass of its geoms."


def _compiled(spec: MjSpec, where: str) -> MjModel:
    try:
        return compiled_quietly(spec)
    except ValueError as error:
        raise _refusal(spec, where, error) from error


def _weighed_by_scene(spec: MjSpec, given: Given) -> list[mujoco.MjsGeom]:
    """Geoms with a density from the scene: they have no mass in the file, and are no shape of the
    scene with a density of its own."""
    own = zip(own_by_mesh(given.shapes), given.shapes, strict=True)
    dense = {mesh for mesh, shape in own if shape.density is not None}
    return [
        geom
        for geom in spec.geoms
        if given.density_of(geom.parent.name) is not None
        and np.isnan(geom.mass)
        and geom.meshname not in dense
    ]


def _weightless(spec: MjSpec, chosen: set[int], given: Given) -> list[mujoco.MjsGeom]:
    """Geoms without mass: the density from the scene is that of other geoms of the body."""
    weighed = _weighed_by_scene(spec, given)
    displacing = {geom.parent.id for geom in weighed if geom.id in chosen}
    return [g for g in weighed if g.id not in chosen and g.parent.id in displacing]


def _set_floating(spec: MjSpec, name: str, where: str) -> None:
    held = {body.name: body for body in spec.worldbody.bodies if not body.joints}
    if name not in held:
        listed = ", ".join(held) or "none"
        raise ValueError(
            f"{where} has no body '{name}' that hangs on the world without a joint. Such bodies, "
            f"which can be floating, are: {listed}."
        )
    held[name].add_freejoint(name=name)


def read_spec(source: str | Path, packages: Sequence[Path] = ()) -> MjSpec:
    """The spec of a model file (a Path) or text.

    The text is checked first: MuJoCo ignores text after the end of a model, and allocates any size
    that a model requests. MuJoCo gets the same files as a run folder.
    packages  folders that may contain ROS packages
    raises    ValueError for a bad model
    """
    where = _named(source)
    try:
        if isinstance(source, Path):
            files = gathered(source, packages)
        else:
            files = ModelFiles("", {"": source.encode()})
        for text in files.texts.values():
            for wrong in too_large(parsed(text)):
                raise ValueError(wrong)
    except ElementTree.ParseError as error:
        raise _unreadable(where, error) from error
    except OSError as error:
        which = where if Path(error.filename) == source else f"{where}: {error.filename}"
        raise ValueError(f"{which} cannot be read: {error.strerror}. Mend that.") from error
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error
    try:
        if isinstance(source, str):
            return MjSpec.from_string(source)
        memory = mujoco.MjVfs()
        for name, content in (files.texts | files.assets).items():
            memory[name] = content
        spec = MjSpec.from_file(files.name, vfs=memory)
    except ValueError as error:
        raise _unreadable(where, error) from error
    spec.assets = files.assets
    return spec


def _named(source: str | Path) -> str:
    return f"model {source}" if isinstance(source, Path) else "model text"


def compiled_with_flesh(spec: MjSpec, gravity: tuple[float, float, float]) -> MjModel:
    """MuJoCo's model of bones and flesh, with the options of `bones_of`.

    raises  ValueError for a bad model, and for one with a flex
    """
    spec = spec.copy()
    _set_options(spec, gravity)
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE  # dense allocates (nv, nv) arrays
    spec.memory = ARENA + 2 * len(spec.bodies) ** 2  # 4 bytes for each pair that may collide
    try:
        mj = compiled_quietly(spec)
    except ValueError as error:
        raise ValueError(f"the model with flesh cannot be read: {error}. Mend it there.") from error
    _refuse_unsupported(mj, "the model with flesh")
    return mj


def _set_options(spec: MjSpec, gravity: tuple[float, float, float]) -> None:
    option = spec.option
    option.gravity = gravity
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.iterations = 500
    option.tolerance = 1e-14
    option.noslip_iterations = 0
    option.density = option.viscosity = 0.0
    option.wind = (0.0, 0.0, 0.0)
    disable, enable = mujoco.mjtDisableBit, mujoco.mjtEnableBit
    option.disableflags |= disable.mjDSBL_ACTUATION | disable.mjDSBL_WARMSTART
    option.disableflags |= disable.mjDSBL_SENSOR | disable.mjDSBL_ISLAND
    option.disableflags &= ~int(disable.mjDSBL_GRAVITY)
    option.enableflags &= ~int(enable.mjENBL_SLEEP)


def _refuse_unsupported(mj: MjModel, where: str) -> None:
    wrong = next(wrong_model_values(mj), None)
    if wrong is not None:
        raise ValueError(f"{where}: {wrong}")
    if mj.nflex:
        raise ValueError(
            f"{where}: flex '{element_name(mj, mujoco.mjtObj.mjOBJ_FLEX, 0)}' is not simulated, as "
            "MuJoCo's flexes lock in bending and the fluid does not act on them. Remove it from "
            "the model, and describe the flesh by a [[flesh]] table of the scene."
        )
    for geom in displacing_geoms(mj):
        if kind_of(mj, geom) == "sdf":
            raise ValueError(
                f"{where}: geom '{geom_name(mj, geom)}' is a signed distance plugin. "
                f"Use a mesh, or put it into group {HIDDEN_GROUP} or above."
            )


def slab_section(mj: MjModel, geom: int, position: Array, rotation: Array) -> Section:
    """Cross-section of a geometry at its rest pose.

    raises  ValueError with the name of a geometry that has none
    """
    shape = geom_shape(mj, geom)
    try:
        return shape.section(rotation, float(position[2]))
    except ValueError as error:
        raise ValueError(
            f"geom '{geom_name(mj, geom)}' ({shape.kind}) {error}. In a slab every geom crosses "
            "z = 0 with a local axis along z: turn or move it."
        ) from error


def _set_slab_inertias(spec: MjSpec, mj: MjModel) -> None:
    """Give each body of `spec` the mass, centre and inertia per unit depth of its sections.

    An explicit <inertial> is kept and is per unit depth. A height that all bodies have in common is
    subtracted.
    """
    body_position, body_rotation, geom_position, geom_rotation = rest_poses(mj)
    heights = np.unique(body_position[1:, 2].round(9))
    if heights.size == 1:
        height, world = float(body_position[1, 2]), spec.worldbody
        for part in (*world.bodies, *world.geoms, *world.sites):
            part.pos[2] -= height
        body_position[1:, 2] -= height
        geom_position[:, 2] -= height
    off = np.flatnonzero(np.abs(body_position[:, 2]) > 1e-9)
    if off.size:
        name = element_name(mj, mujoco.mjtObj.mjOBJ_BODY, off[0])
        raise ValueError(
            f"body '{name}' is at z = {body_position[off[0], 2]:g} m in a slab. "
            "Put every body at z = 0."
        )
    always = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    for body in spec.bodies:
        if body.id == 0 or (body.explicitinertial and not always):
            continue
        mass, moment, parts = 0.0, np.zeros(3), []
        for geom in spec.geoms:
            g = geom.id
            weightless = geom.mass == 0.0 or (np.isnan(geom.mass) and geom.density == 0.0)
            if geom.parent.id != body.id or weightless or kind_of(mj, g) in CONTACT_ONLY:
                continue
            cut = slab_section(mj, g, geom_position[g], geom_rotation[g])
            m = geom.density * cut.area if np.isnan(geom.mass) else geom.mass
            world = geom_position[g] + geom_rotation[g] @ cut.centroid
            centre = body_rotation[body.id].T @ (world - body_position[body.id])
            parts.append((m, centre, m * cut.polar_moment / cut.area))
            mass += m
            moment = moment + m * centre
        if mass > 0.0:
            centre = moment / mass
            about_z = sum(i + m * float((c - centre) @ (c - centre)) for m, c, i in parts)
            body.explicitinertial = True
            body.mass, body.ipos, body.iquat = mass, centre, (1.0, 0.0, 0.0, 0.0)
            body.inertia = (about_z, about_z, about_z)
            body.fullinertia = (np.nan, 0.0, 0.0, 0.0, 0.0, 0.0)
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO

"""A run as one USD scene, by usd-core: time codes are frames, lengths are in m, z is up.

/Run                    the model; its custom data contain the scene's name
  Creature              UsdSkel root: Skeleton, its Animation, and the geometries of the bodies,
                        each bound to the bone of its body
    Bound               flesh in the rest pose, bound to bones by its weights, as a guide
  Flesh                 the skin as recorded in the run, a time sample per frame
  World                 fixed geometries
  Forces                an arrow per body, for the force of fluid and winds on it
  Paths                 trajectory of each bone
  Camera                shows all moving bodies
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import replaced_whole
from flowborne.base.colours import to_linear
from flowborne.base.extras import optional
from flowborne.base.version import __version__
from flowborne.formats.creature import Creature, ModelSkin, Skeleton, Surface, quaternions
from flowborne.formats.morphs import strongest
from flowborne.formats.vdb import write_states
from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.quaternions import continuous
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import StoredRun

with suppress(ImportError):  # the list of exporters imports this module without the library too
    from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom, UsdShade, UsdSkel, UsdVol, Vt

ROOT = "/Run"

INFLUENCES = 8
"""Maximum number of bones per vertex of the guide of flesh."""

LARGEST_ARROW = 0.5
"""Length of the arrow of the largest force, in sizes of the creature."""

CURVE_WIDTH = 0.005
"""Width of a curve, in sizes of the creature."""

ROUGHNESS = 0.8
"""Roughness of every surface, from 0 to 1."""

FOCAL_LENGTH, FILM_WIDTH, ASPECT = 50.0, 36.0, 16.0 / 9.0
"""Focal length and width of the film, both in mm, and its width over its height."""

MM = 0.01
"""A millimetre in USD's unit of focal lengths and apertures, a tenth of the stage's unit (m)."""

VIEW_DIRECTION = np.array([-0.45, 0.85, -0.3])
"""Direction in which the camera looks in 3D."""


@provided(".usd")
@provided(".usda")
@provided(".usdc")
@dataclass(frozen=True)
class ExporterUsd:
    """Skeleton, surfaces, flesh, forces, paths, camera and dye.

    Dye is in separate files: swim.usd refers to swim_dye/swim_0000.vdb and so on.
    """

    def write(self, run: StoredRun, path: Path) -> Written:
        optional("pxr.Usd", "usd-core", "usd", f"'{path.suffix}' files")
        creature, volumes = Creature(run), tuple[Path, ...]()
        if run.dyes:
            folder = path.with_name(f"{path.stem}_dye")
            folder.mkdir(exist_ok=True)
            volumes = write_states(run, folder / f"{path.stem}.vdb", velocity=False)
        with replaced_whole(path) as new:
            write_stage(creature, new, [f"./{v.parent.name}/{v.name}" for v in volumes])
        return Written((path, *volumes))


def write_stage(creature: Creature, path: Path, volumes: Sequence[str]) -> None:
    """Write the run of a creature to `path`.

    volumes  paths of the files with the dyes of each state, relative to the stage; may be empty
    """
    run = creature.run
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(run.frames_per_second)
    stage.SetFramesPerSecond(run.frames_per_second)
    stage.SetStartTimeCode(run.frames[0])
    stage.SetEndTimeCode(run.frames[-1])
    root = UsdGeom.Xform.Define(stage, ROOT).GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    root.SetDisplayName(run.name)
    root.SetCustomData({"scene": run.name, "flowborne": __version__, "slab": run.is_slab})
    _creature(stage, creature)
    _flesh(stage, creature)
    _forces(stage, creature)
    _paths(stage, creature)
    _dye(stage, run, volumes)
    _camera(stage, creature)
    stage.Save()


def _creature(stage: Usd.Stage, creature: Creature) -> None:
    """Write the skeleton with its motion, the meshes bound to it, and the fixed geometries."""
    skeleton, frames = creature.skeleton, creature.run.frames
    parent = Sdf.Path(f"{ROOT}/Creature")
    root = UsdSkel.Root.Define(stage, parent)
    skel = UsdSkel.Skeleton.Define(stage, parent.AppendChild("Skeleton"))
    joints = joint_paths(skeleton)
    skel.CreateJointsAttr(joints)
    skel.CreateJointNamesAttr(list(skeleton.names))
    skel.CreateBindTransformsAttr(_matrices(*skeleton.rest))
    skel.CreateRestTransformsAttr(_matrices(*skeleton.rest_local()))
    animation = UsdSkel.Animation.Define(stage, skel.GetPath().AppendChild("Animation"))
    animation.CreateJointsAttr(joints)
    position, rotation = skeleton.local()
    turns = continuous(quaternions(rotation))
    animation.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1.0)] * len(joints)))
    translations, rotations = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    for frame, x, q in zip(frames, position, turns, strict=True):
        translations.Set(_vectors(x), frame)
        rotations.Set(Vt.QuatfArray.FromNumpy(q.astype(np.float32)), frame)
    binding = UsdSkel.BindingAPI.Apply(skel.GetPrim())
    binding.CreateAnimationSourceRel().AddTarget(animation.GetPath())
    UsdSkel.BindingAPI.Apply(root.GetPrim()).CreateSkeletonRel().AddTarget(skel.GetPath())
    low, high = creature.bounds
    root.CreateExtentAttr(_vectors(np.stack([low, high])))
    names = Names()
    for surface in creature.seen:
        if surface.bone >= 0:
            path = parent.AppendChild(names.of(surface.name))
            _bound(stage, path, surface, np.array([[surface.bone]]), np.ones((1, 1)), rigid=True)
    for bound in creature.bound:
        path = parent.AppendChild(names.of(bound.name))
        _bound(stage, path, bound, *strongest(bound.weights, INFLUENCES))
    for skin in creature.skins:
        guides = UsdGeom.Scope.Define(stage, parent.AppendChild("Bound")).GetPath()
        path = guides.AppendChild(names.of(skin.name))
        _bound(stage, path, skin, *strongest(skin.weights, INFLUENCES), guide=True)
    names = Names()
    for surface in creature.surfaces:
        if surface.bone < 0:
            path = _scope(stage, "World").AppendChild(names.of(surface.name))
            _set_points(_mesh(stage, path, surface), surface.vertices)


def _flesh(stage: Usd.Stage, creature: Creature) -> None:
    """Write the skin of each flesh as recorded in the run."""
    if not creature.skins:
        return
    scope, names = _scope(stage, "Flesh"), Names()
    meshes = [_mesh(stage, scope.AppendChild(names.of(s.name)), s) for s in creature.skins]
    for number, frame in enumerate(creature.run.frames):
        vertices = creature.run.arrays["flesh_vertices"][number]
        for skin, mesh in zip(creature.skins, meshes, strict=True):
            _set_points(mesh, vertices[skin.chosen], frame)


def _forces(stage: Usd.Stage, creature: Creature) -> None:
    """Write arrows from the centroid of each body, all to one scale, and the forces in N."""
    run = creature.run
    force = run.every("fluid_force")[:, 1:]
    largest = float(np.linalg.norm(force, axis=2).max(initial=0.0))
    if largest == 0.0:
        return
    scale = LARGEST_ARROW * creature.size / largest
    start = run.every("fluid_centre")[:, 1:]
    ends = np.stack([start, start + scale * force], axis=2)
    curves = _curves(stage, Sdf.Path(f"{ROOT}/Forces"), creature, [2] * force.shape[1])
    curves.GetPrim().SetCustomData({"metresPerNewton": scale, "bodies": list(run.bodies[1:])})
    vectors = UsdGeom.PrimvarsAPI(curves).CreatePrimvar(
        "force", Sdf.ValueTypeNames.Vector3fArray, UsdGeom.Tokens.uniform
    )
    for frame, points, forces in zip(run.frames, ends, force, strict=True):
        _set_points(curves, points.reshape(-1, 3), frame)
        vectors.Set(_vectors(forces), frame)


def _paths(stage: Usd.Stage, creature: Creature) -> None:
    """Write the trajectory of each bone as a curve."""
    positions = np.swapaxes(creature.skeleton.position, 0, 1)
    if positions.shape[1] > 1:
        counts = [positions.shape[1]] * positions.shape[0]
        curves = _curves(stage, Sdf.Path(f"{ROOT}/Paths"), creature, counts)
        curves.GetPrim().SetCustomData({"bones": list(creature.skeleton.names)})
        _set_points(curves, positions.reshape(-1, 3))


def _dye(stage: Usd.Stage, run: StoredRun, volumes: Sequence[str]) -> None:
    """Write a volume for each dye, which refers to a file per frame."""
    if run.grid is None or not volumes:
        return
    scope, names = _scope(stage, "Dye"), Names()
    size = np.array(run.grid.upper) - run.grid.origin
    for dye in run.dyes:
        volume = UsdVol.Volume.Define(stage, scope.AppendChild(names.of(dye)))
        volume.GetPrim().SetDisplayName(dye)
        extent = volume.CreateExtentAttr(_vectors(np.array([run.grid.origin, run.grid.upper])))
        if run.window_axes:
            for frame, low in zip(run.frames, run.origins(), strict=True):
                extent.Set(_vectors(np.array([low, low + size])), frame)
        field = UsdVol.OpenVDBAsset.Define(stage, volume.GetPath().AppendChild("field"))
        field.CreateFieldNameAttr(dye)
        field.CreateFieldDataTypeAttr("float")
        file = field.CreateFilePathAttr()
        for frame, name in zip(run.frames, volumes, strict=True):
            file.Set(name, frame)
        volume.CreateFieldRelationship("density", field.GetPath())


def _camera(stage: Usd.Stage, creature: Creature) -> None:
    """Write a camera above a slab, else at the side and a little above the bodies."""
    low, high = creature.bounds
    middle, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    camera = UsdGeom.Camera.Define(stage, Sdf.Path(f"{ROOT}/Camera"))
    height = 2.2 * radius
    forward, up = VIEW_DIRECTION / np.linalg.norm(VIEW_DIRECTION), np.array([0.0, 0.0, 1.0])
    distance = 1.1 * radius / np.sin(np.arctan(0.5 * FILM_WIDTH / ASPECT / FOCAL_LENGTH))
    if creature.run.is_slab:
        forward, up = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
        camera.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
        camera.CreateHorizontalApertureAttr(10.0 * ASPECT * height)
        camera.CreateVerticalApertureAttr(10.0 * height)
    else:
        camera.CreateHorizontalApertureAttr(FILM_WIDTH * MM)
        camera.CreateVerticalApertureAttr(FILM_WIDTH / ASPECT * MM)
    camera.CreateFocalLengthAttr(FOCAL_LENGTH * MM)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.01 * distance, 100.0 * distance))
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    axes = np.stack([right, np.cross(right, forward), -forward], axis=1)
    matrix = _matrices((middle - distance * forward)[None], axes[None])[0]
    camera.MakeMatrixXform().Set(matrix)


class Names:
    """Unique names of siblings, valid in USD."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def of(self, name: str) -> str:
        """The name, or a valid and unused one like it."""
        valid = Tf.MakeValidIdentifier(name)
        number, found = 1, valid
        while found in self._taken:
            number, found = number + 1, f"{valid}_{number + 1}"
        self._taken.add(found)
        return found


def joint_paths(skeleton: Skeleton) -> list[str]:
    """USD's names of the bones: their paths from the root."""
    names, paths = Names(), list[str]()
    for name, parent in zip(skeleton.names, skeleton.parents, strict=True):
        own = names.of(name)
        paths.append(own if parent < 0 else f"{paths[parent]}/{own}")
    return paths


def _scope(stage: Usd.Stage, name: str) -> Sdf.Path:
    path = Sdf.Path(f"{ROOT}/{name}")
    UsdGeom.Scope.Define(stage, path)
    return path


def _mesh(stage: Usd.Stage, path: Sdf.Path, shown: Surface | ModelSkin) -> UsdGeom.Mesh:
    """A mesh of triangles without points yet."""
    faces, rgba = shown.faces, shown.rgba
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.GetPrim().SetDisplayName(shown.name)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(faces)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.astype(np.int32).ravel()))
    mesh.CreateDisplayColorAttr(_vectors(to_linear(rgba[None, :3])))
    mesh.CreateDisplayOpacityAttr([float(rgba[3])])
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(_material(stage, rgba))
    return mesh


def _material(stage: Usd.Stage, rgba: Array) -> UsdShade.Material:
    """The material of a colour, created on first use."""
    red, green, blue = to_linear(rgba[:3]).tolist()
    name = "colour_" + "".join(f"{round(255.0 * float(part)):02x}" for part in rgba)
    path = _scope(stage, "Materials").AppendChild(name)
    if stage.GetPrimAtPath(path):
        return UsdShade.Material.Get(stage, path)
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, path.AppendChild("surface"))
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(red, green, blue))
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(float(rgba[3]))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGHNESS)
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface)
    return material


def _curves(
    stage: Usd.Stage, path: Sdf.Path, creature: Creature, counts: Iterable[int]
) -> UsdGeom.BasisCurves:
    """Polylines with `counts` vertices each, without points yet."""
    curves = UsdGeom.BasisCurves.Define(stage, path)
    curves.CreateTypeAttr(UsdGeom.Tokens.linear)
    curves.CreateCurveVertexCountsAttr(Vt.IntArray(list(counts)))
    curves.CreateWidthsAttr([CURVE_WIDTH * creature.size])
    curves.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    return curves


def _set_points(prim: UsdGeom.PointBased, points: NDArray[Any], frame: int | None = None) -> None:
    """Set points and their extent, of a frame or of all time."""
    time = Usd.TimeCode.Default() if frame is None else Usd.TimeCode(frame)
    prim.CreatePointsAttr().Set(_vectors(points), time)
    extent = UsdGeom.Boundable.ComputeExtentFromPlugins(prim, time)
    prim.CreateExtentAttr().Set(extent, time)


def _bound(
    stage: Usd.Stage,
    path: Sdf.Path,
    shown: Surface | ModelSkin,
    bones: Integers,
    weights: Array,
    *,
    rigid: bool = False,
    guide: bool = False,
) -> None:
    """A mesh in the rest pose, bound to bones (k, m) with weights (k, m)."""
    mesh = _mesh(stage, path, shown)
    if guide:
        mesh.CreatePurposeAttr(UsdGeom.Tokens.guide)
    _set_points(mesh, shown.vertices)
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    numbers = Vt.IntArray.FromNumpy(bones.astype(np.int32).ravel())
    binding.CreateJointIndicesPrimvar(rigid, bones.shape[1]).Set(numbers)
    shares = Vt.FloatArray.FromNumpy(weights.astype(np.float32).ravel())
    binding.CreateJointWeightsPrimvar(rigid, bones.shape[1]).Set(shares)


def _vectors(values: NDArray[Any]) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32))


def _matrices(position: Array, rotation: Array) -> Vt.Matrix4dArray:
    """Transforms of positions (n, 3) and rotations (n, 3, 3); USD's multiply row vectors."""
    matrices = np.zeros((len(position), 4, 4))
    matrices[:, :3, :3] = np.swapaxes(rotation, 1, 2)
    matrices[:, 3, :3], matrices[:, 3, 3] = position, 1.0
    return Vt.Matrix4dArray.FromNumpy(matrices)

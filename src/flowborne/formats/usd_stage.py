"""The stage of a run: frames are time codes, lengths metres, z is up.

/Run                    the model; its custom data name the scene
  Creature              UsdSkel root: Skeleton, its Animation, and the bodies' geometries,
                        each bound to the bone of its body
    Bound               flesh in the model's own pose, bound to bones by its weights, as a guide
  Flesh                 the skin as the run has it, a time sample per frame
  World                 geometries that stay
  Forces                an arrow per body, for the force that fluid and winds exert on it
  Paths                 where each bone has been
  Camera                looks at all that moves
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom, UsdShade, UsdSkel, UsdVol, Vt
from scipy.spatial.transform import Rotation

from flowborne.colours import to_linear
from flowborne.formats.creature import SKIN_COLOUR, Creature, Skeleton, Surface
from flowborne.formats.morphs import strongest
from flowborne.quaternions import continuous
from flowborne.runs.open_run import OpenRun
from flowborne.version import __version__

Array = NDArray[np.float64]

ROOT = Sdf.Path("/Run")

INFLUENCES = 8
"""Largest number of bones that a vertex of the guide of flesh is bound to."""

LONGEST = 0.5
"""Length of the greatest force's arrow, in sizes of the creature."""

THIN = 0.005
"""Width of a curve, in sizes of the creature."""

ROUGH = 0.8
"""Roughness of every surface, from 0 to 1."""

LENS, FILM, ASPECT = 50.0, 36.0, 16.0 / 9.0
"""Focal length and width of the picture, both in mm, and its width over its height."""

MM = 0.01
"""What USD has lenses and films in where lengths are metres: tenths of the unit."""

TOWARD = np.array([-0.45, 0.85, -0.3])
"""Direction in which the camera looks in a room."""


def write_stage(creature: Creature, path: Path, volumes: Sequence[str]) -> None:
    """Write the run of a creature to `path`.

    volumes  names of the files with the dyes of each state, from the stage's folder; empty without
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
    """The skeleton with its motion, and all that is bound to it."""
    skeleton, frames = creature.skeleton, creature.run.frames
    above = ROOT.AppendChild("Creature")
    root = UsdSkel.Root.Define(stage, above)
    skel = UsdSkel.Skeleton.Define(stage, above.AppendChild("Skeleton"))
    joints = joint_paths(skeleton)
    skel.CreateJointsAttr(joints)
    skel.CreateJointNamesAttr(list(skeleton.names))
    skel.CreateBindTransformsAttr(_matrices(*skeleton.rest))
    skel.CreateRestTransformsAttr(_matrices(*skeleton.rest_local()))
    animation = UsdSkel.Animation.Define(stage, skel.GetPath().AppendChild("Animation"))
    animation.CreateJointsAttr(joints)
    place, turn = skeleton.local()
    quaternions = continuous(
        Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat().reshape(*turn.shape[:2], 4)
    )
    animation.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1.0)] * len(joints)))
    moved, turned = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    for frame, translation, rotation in zip(frames, place, quaternions, strict=True):
        moved.Set(_vectors(translation), frame)
        turned.Set(Vt.QuatfArray.FromNumpy(rotation.astype(np.float32)), frame)
    binding = UsdSkel.BindingAPI.Apply(skel.GetPrim())
    binding.CreateAnimationSourceRel().AddTarget(animation.GetPath())
    UsdSkel.BindingAPI.Apply(root.GetPrim()).CreateSkeletonRel().AddTarget(skel.GetPath())
    low, high = creature.bounds
    root.CreateExtentAttr(_vectors(np.stack([low, high])))
    names = Names()
    for surface in creature.seen:
        if surface.bone >= 0:
            mesh = _surface(stage, above.AppendChild(names.of(surface.name)), surface)
            _bind(mesh, np.array([[surface.bone]]), np.ones((1, 1)), rigid=True)
    for bound in creature.bound:
        path = above.AppendChild(names.of(bound.name))
        mesh = _mesh(stage, path, bound.name, bound.faces, bound.rgba)
        _set_points(mesh, bound.vertices)
        _bind(mesh, *strongest(bound, INFLUENCES), rigid=False)
    for skin in creature.skins:
        UsdGeom.Scope.Define(stage, above.AppendChild("Bound"))
        path = above.AppendChild("Bound").AppendChild(names.of(skin.name))
        mesh = _mesh(stage, path, skin.name, skin.faces, SKIN_COLOUR)
        mesh.CreatePurposeAttr(UsdGeom.Tokens.guide)
        _set_points(mesh, skin.rest)
        _bind(mesh, *strongest(skin, INFLUENCES), rigid=False)
    names = Names()
    for surface in creature.surfaces:
        if surface.bone < 0:
            _surface(stage, _scope(stage, "World").AppendChild(names.of(surface.name)), surface)


def _flesh(stage: Usd.Stage, creature: Creature) -> None:
    """The skin of each flesh as the run has it."""
    if not creature.skins:
        return
    above, names = _scope(stage, "Flesh"), Names()
    vertices = creature.run.arrays["flesh_vertices"]
    meshes = [
        _mesh(stage, above.AppendChild(names.of(skin.name)), skin.name, skin.faces, SKIN_COLOUR)
        for skin in creature.skins
    ]
    for number, frame in enumerate(creature.run.frames):
        places = vertices[number]
        for skin, mesh in zip(creature.skins, meshes, strict=True):
            _set_points(mesh, places[skin.chosen], frame)


def _forces(stage: Usd.Stage, creature: Creature) -> None:
    """Arrows from the centroid of each body, all to one scale, and the forces in numbers."""
    run = creature.run
    force = run.every("fluid_force")[:, 1:]
    greatest = float(np.linalg.norm(force, axis=2).max(initial=0.0))
    if greatest == 0.0:
        return
    scale = LONGEST * creature.size / greatest
    start = run.every("fluid_centre")[:, 1:]
    ends = np.stack([start, start + scale * force], axis=2)
    curves = _curves(stage, ROOT.AppendChild("Forces"), creature, [2] * force.shape[1])
    curves.GetPrim().SetCustomData({"metresPerNewton": scale, "bodies": list(run.bodies[1:])})
    vectors = UsdGeom.PrimvarsAPI(curves).CreatePrimvar(
        "force", Sdf.ValueTypeNames.Vector3fArray, UsdGeom.Tokens.uniform
    )
    for frame, points, exerted in zip(run.frames, ends, force, strict=True):
        _set_points(curves, points.reshape(-1, 3), frame)
        vectors.Set(_vectors(exerted), frame)


def _paths(stage: Usd.Stage, creature: Creature) -> None:
    """A curve through the places of each bone in the whole run."""
    places = np.swapaxes(creature.skeleton.position, 0, 1)
    if places.shape[1] > 1:
        counts = [places.shape[1]] * places.shape[0]
        curves = _curves(stage, ROOT.AppendChild("Paths"), creature, counts)
        curves.GetPrim().SetCustomData({"bones": list(creature.skeleton.names)})
        _set_points(curves, places.reshape(-1, 3))


def _dye(stage: Usd.Stage, run: OpenRun, volumes: Sequence[str]) -> None:
    """A volume for each dye, whose field is in the file of the frame."""
    if run.grid is None or not volumes:
        return
    above, names = _scope(stage, "Dye"), Names()
    for dye in run.dyes:
        volume = UsdVol.Volume.Define(stage, above.AppendChild(names.of(dye)))
        volume.GetPrim().SetDisplayName(dye)
        volume.CreateExtentAttr(_vectors(np.array([run.grid.origin, run.grid.upper])))
        field = UsdVol.OpenVDBAsset.Define(stage, volume.GetPath().AppendChild("field"))
        field.CreateFieldNameAttr(dye)
        field.CreateFieldDataTypeAttr("float")
        file = field.CreateFilePathAttr()
        for frame, name in zip(run.frames, volumes, strict=True):
            file.Set(name, frame)
        volume.CreateFieldRelationship("density", field.GetPath())


def _camera(stage: Usd.Stage, creature: Creature) -> None:
    """From above on a slab, else from the side and a little above."""
    low, high = creature.bounds
    middle, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    camera = UsdGeom.Camera.Define(stage, ROOT.AppendChild("Camera"))
    height = 2.2 * radius
    toward, up = TOWARD / np.linalg.norm(TOWARD), np.array([0.0, 0.0, 1.0])
    distance = 1.1 * radius / np.sin(np.arctan(0.5 * FILM / ASPECT / LENS))
    if creature.run.is_slab:
        toward, up = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
        camera.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
        camera.CreateHorizontalApertureAttr(10.0 * ASPECT * height)
        camera.CreateVerticalApertureAttr(10.0 * height)
    else:
        camera.CreateHorizontalApertureAttr(FILM * MM)
        camera.CreateVerticalApertureAttr(FILM / ASPECT * MM)
    camera.CreateFocalLengthAttr(LENS * MM)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.01 * distance, 100.0 * distance))
    right = np.cross(toward, up) / np.linalg.norm(np.cross(toward, up))
    axes = np.stack([right, np.cross(right, toward), -toward], axis=1)
    place = _matrices((middle - distance * toward)[None], axes[None])[0]
    camera.MakeMatrixXform().Set(place)


class Names:
    """Names of siblings, valid in USD and each of them once."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def of(self, name: str) -> str:
        """The name, or one like it."""
        valid = Tf.MakeValidIdentifier(name)
        number, found = 1, valid
        while found in self._taken:
            number, found = number + 1, f"{valid}_{number + 1}"
        self._taken.add(found)
        return found


def joint_paths(skeleton: Skeleton) -> list[str]:
    """The bones as USD names joints: by the way from the root."""
    names, paths = Names(), list[str]()
    for name, parent in zip(skeleton.names, skeleton.parents, strict=True):
        own = names.of(name)
        paths.append(own if parent < 0 else f"{paths[parent]}/{own}")
    return paths


def _scope(stage: Usd.Stage, name: str) -> Sdf.Path:
    path = ROOT.AppendChild(name)
    UsdGeom.Scope.Define(stage, path)
    return path


def _surface(stage: Usd.Stage, path: Sdf.Path, surface: Surface) -> UsdGeom.Mesh:
    mesh = _mesh(stage, path, surface.name, surface.faces, surface.rgba)
    _set_points(mesh, surface.vertices)
    return mesh


def _mesh(
    stage: Usd.Stage, path: Sdf.Path, name: str, faces: NDArray[np.int64], rgba: Array
) -> UsdGeom.Mesh:
    """A mesh of triangles that lacks its points."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.GetPrim().SetDisplayName(name)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(faces)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.astype(np.int32).ravel()))
    mesh.CreateDisplayColorAttr(_vectors(to_linear(rgba[None, :3])))
    mesh.CreateDisplayOpacityAttr([float(rgba[3])])
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(_material(stage, rgba))
    return mesh


def _material(stage: Usd.Stage, rgba: Array) -> UsdShade.Material:
    """The plain surface of a colour, made when it is first asked for."""
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
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGH)
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface)
    return material


def _curves(
    stage: Usd.Stage, path: Sdf.Path, creature: Creature, counts: Iterable[int]
) -> UsdGeom.BasisCurves:
    """Straight pieces, as many vertices a curve as `counts` says, that lack their points."""
    curves = UsdGeom.BasisCurves.Define(stage, path)
    curves.CreateTypeAttr(UsdGeom.Tokens.linear)
    curves.CreateCurveVertexCountsAttr(Vt.IntArray(list(counts)))
    curves.CreateWidthsAttr([THIN * creature.size])
    curves.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    return curves


def _set_points(prim: UsdGeom.PointBased, points: NDArray[Any], frame: int | None = None) -> None:
    """Points and their extent, of a frame or for good."""
    time = Usd.TimeCode.Default() if frame is None else Usd.TimeCode(frame)
    prim.CreatePointsAttr().Set(_vectors(points), time)
    extent = UsdGeom.Boundable.ComputeExtentFromPlugins(prim, time)
    prim.CreateExtentAttr().Set(extent, time)


def _bind(mesh: UsdGeom.Mesh, bones: NDArray[np.int64], weights: Array, *, rigid: bool) -> None:
    """Bind a mesh in the model's own pose to bones (k, m) with weights (k, m)."""
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    count = bones.shape[1]
    numbers = Vt.IntArray.FromNumpy(bones.astype(np.int32).ravel())
    binding.CreateJointIndicesPrimvar(rigid, count).Set(numbers)
    shares = Vt.FloatArray.FromNumpy(weights.astype(np.float32).ravel())
    binding.CreateJointWeightsPrimvar(rigid, count).Set(shares)


def _vectors(values: NDArray[Any]) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32))


def _matrices(place: Array, turn: Array) -> Vt.Matrix4dArray:
    """USD's transforms, which multiply rows, of places (n, 3) and rotations (n, 3, 3)."""
    matrices = np.zeros((len(place), 4, 4))
    matrices[:, :3, :3] = np.swapaxes(turn, 1, 2)
    matrices[:, 3, :3], matrices[:, 3, 3] = place, 1.0
    return Vt.Matrix4dArray.FromNumpy(matrices)

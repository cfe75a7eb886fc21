"""Skins, weights and animations of UsdSkel, by usd-core, checked as they are read.

As a program, it is the process in which `usd_gate.probe` reads a file first, because reading
may crash, or fill the memory.

source  OpenUSD: UsdGeomMesh; UsdSkel schemas, binding API and SkelAnimation
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, wraps
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pxr import Usd, UsdGeom, UsdShade, UsdSkel

from flowborne.base.colours import to_srgb
from flowborne.base.errors import SceneError
from flowborne.characters.apart import limit_memory
from flowborne.characters.limits import MAX_POSES, check_size, wrong
from flowborne.characters.rig import (
    PLAIN,
    Z_UP,
    Action,
    Rig,
    Surface,
    frame_times,
    joined,
    normalised,
    own_names,
    placed,
    sampled_action,
    unique_names,
)
from flowborne.characters.usd_gate import EVERYTHING, open_stage, reading_usd
from flowborne.kernels.arrays import Array, Integers

Result = TypeVar("Result")


def _reading(method: Callable[..., Result]) -> Callable[..., Result]:
    """A method of UsdSource that runs within `reading_usd`."""

    @wraps(method)
    def within(self: UsdSource, *args: Any) -> Result:
        with reading_usd(self._name):
            return method(self, *args)

    return within


class UsdSource:
    """A stage's skeleton, the surface bound to it, and its animations.

    raises  SceneError when it cannot be read, or has no skeleton
    """

    def __init__(self, path: Path, *, probed: bool = False) -> None:
        """probed  whether to open the file without a trial in another process"""
        self._name = path.name
        self._open(path, probed)

    @_reading
    def _open(self, path: Path, probed: bool) -> None:
        stage = open_stage(path, probed=probed)
        self._stage, self._cache, self._bound = stage, UsdSkel.Cache(), []
        prims = list(Usd.PrimRange.Stage(stage, EVERYTHING))
        for root in (prim for prim in prims if prim.IsA(UsdSkel.Root)):
            self._cache.Populate(UsdSkel.Root(root), EVERYTHING)
            self._bound += self._cache.ComputeSkelBindings(UsdSkel.Root(root), EVERYTHING)
        skeletons = [binding.GetSkeleton() for binding in self._bound]
        skeletons += [UsdSkel.Skeleton(prim) for prim in prims if prim.IsA(UsdSkel.Skeleton)]
        if not skeletons:
            raise SceneError(f"{path.name} has no skeleton. Export the armature as UsdSkel.")
        self._skeleton = skeletons[0]
        self._query = self._cache.GetSkelQuery(self._skeleton)
        if not self._query:
            raise wrong(f"{path.name}: its skeleton is damaged")
        check_size(len(self._query.GetJointOrder()), 0, path.name)
        self._check_topology()
        self._animations = [UsdSkel.Animation(p) for p in prims if p.IsA(UsdSkel.Animation)]
        self._world = UsdGeom.XformCache(Usd.TimeCode.Default())
        turn = np.eye(3) if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else Z_UP
        self._turned = np.eye(4)
        unit = UsdGeom.GetStageMetersPerUnit(stage)
        if not 1e-9 <= unit <= 1e9:
            raise SceneError(f"{path.name}: metersPerUnit is {unit:.3g}. Set it to 1 or 0.01.")
        self._turned[:3, :3] = unit * turn

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of the SkelAnimations, each once."""
        return unique_names([animation.GetPrim().GetName() for animation in self._animations])

    @cached_property
    @_reading
    def rig(self) -> Rig:
        """The joints in the pose of their skin's binding."""
        topology = self._query.GetTopology()
        paths = [str(joint) for joint in self._query.GetJointOrder()]
        bind = self._to_world(self._skeleton.GetPrim()) @ _matrices(
            self._query.GetJointWorldBindTransforms()
        )
        parents = [topology.GetParent(joint) for joint in range(len(paths))]
        names = own_names([path.rpartition("/")[2] for path in paths])
        return Rig(names, np.array(parents), *placed(bind, f"{self._name}, joints at rest"))

    @property
    @_reading
    def surface(self) -> Surface | None:
        """All meshes bound to the skeleton as one; None when there is none."""
        found, count = [], 0
        into = self._to_world(self._skeleton.GetPrim())
        for binding in self._bound:
            if binding.GetSkeleton().GetPrim() != self._skeleton.GetPrim():
                continue
            for target in binding.GetSkinningTargets():
                mesh = UsdGeom.Mesh(target.GetPrim())
                if not mesh or not target.HasJointInfluences():
                    continue
                where = f"{self._name}, {mesh.GetPath()}"
                points = _points(mesh, where)
                count += len(points)
                check_size(len(self._query.GetJointOrder()), count, self._name)
                own = into @ _matrices([target.GetGeomBindTransform()])[0]
                vertices = points @ own[:3, :3].T + own[:3, 3]
                turned = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
                mirrored = (np.linalg.det(own[:3, :3]) < 0.0) != turned
                faces = _triangles(mesh, len(points), mirrored, where)
                weights = self._weights(target, len(points))
                colours = np.tile(_colour(mesh), (len(faces), 1))
                found.append(Surface(vertices, faces, weights, colours))
        return joined(found, self._name)

    @property
    @_reading
    def left_out(self) -> tuple[str, ...]:
        """Names of the meshes that are not bound to the skeleton."""
        carried = {
            target.GetPrim()
            for binding in self._bound
            if binding.GetSkeleton().GetPrim() == self._skeleton.GetPrim()
            for target in binding.GetSkinningTargets()
            if target.HasJointInfluences()
        }
        prims = Usd.PrimRange.Stage(self._stage, EVERYTHING)
        meshes = [prim for prim in prims if prim.IsA(UsdGeom.Mesh)]
        return tuple(prim.GetName() for prim in meshes if prim not in carried)

    @_reading
    def action(self, clip: int) -> Action:
        """The `clip`-th animation, sampled at its own rate.

        raises  SceneError when it moves no joint
        """
        query = self._cache.GetAnimQuery(self._animations[clip])
        codes = np.array(query.GetJointTransformTimeSamples())
        joints = list(query.GetJointOrder())
        order = list(self._query.GetJointOrder())
        known = [order.index(joint) for joint in joints if joint in order]
        if not codes.size or not known:
            raise SceneError(f"{self._name}: clip '{self.clips[clip]}' moves no joint.")
        where = f"{self._name}, clip '{self.clips[clip]}'"
        rate = self._stage.GetTimeCodesPerSecond()
        if not 1e-6 <= rate <= 1e6:
            raise SceneError(f"{self._name}: timeCodesPerSecond is {rate:.3g}. Set it to 24.")
        if len(codes) * len(order) > MAX_POSES:
            raise SceneError(
                f"{where} needs {len(codes):,} samples of {len(order)} joints; the maximum is "
                f"{MAX_POSES:,} poses. Export a shorter clip."
            )
        times = frame_times(codes / rate, codes / rate, len(order), where)
        rest = _matrices(self._query.ComputeJointLocalTransforms(Usd.TimeCode.Default(), True))
        local = np.tile(rest, (len(times), 1, 1, 1))
        own = [n for n, joint in enumerate(joints) if joint in order]
        for frame, time in enumerate(times):
            poses = query.ComputeJointLocalTransforms(time * rate)
            if len(poses or ()) != len(joints):
                raise wrong(f"{where} has not a pose for each of its {len(joints)} joints")
            local[frame, known] = _matrices(poses)[own]
        world, into = local.copy(), self._to_world(self._skeleton.GetPrim())
        for joint in range(len(order)):
            parent = self._query.GetTopology().GetParent(joint)
            above = into if parent < 0 else world[:, parent]
            world[:, joint] = above @ local[:, joint]
        return sampled_action(times, world, where)

    def _check_topology(self) -> None:
        """Raise SceneError unless the joints are a tree with a pose for each of them."""
        query, name = self._query, self._name
        joints = len(query.GetJointOrder())
        valid, reason = query.GetTopology().Validate() if joints else (False, "it has none")
        if not valid:
            raise wrong(f"{name}: the skeleton's joints are not a tree ({reason})")
        for what, poses in (
            ("bindTransforms", query.GetJointWorldBindTransforms()),
            ("restTransforms", query.ComputeJointLocalTransforms(Usd.TimeCode.Default(), True)),
        ):
            if (count := len(poses or ())) != joints:
                raise wrong(f"{name}: the skeleton has {count} {what} for {joints} joints")

    def _to_world(self, prim: Usd.Prim) -> Array:
        """(4, 4) a prim's frame to the world's, m, z up."""
        matrix = _matrices([self._world.GetLocalToWorldTransform(prim)])[0]
        return np.asarray(self._turned @ matrix)

    def _weights(self, target: UsdSkel.SkinningQuery, count: int) -> Array:
        """(count, n) weights of the joints."""
        where = f"{self._name}, {target.GetPrim().GetPath()}"
        width = target.GetNumInfluencesPerComponent()
        found_for = target.ComputeVaryingJointInfluences(count) or ((), ())
        indices, shares = np.array(found_for[0], np.int64), np.array(found_for[1], float)
        order = [str(joint) for joint in self._query.GetJointOrder()]
        own = target.GetJointOrder()
        if lost := [str(joint) for joint in own or () if str(joint) not in order]:
            raise wrong(f"{where} names joint '{lost[0]}', which is not in the skeleton")
        number = np.array([order.index(str(joint)) for joint in own] if own else range(len(order)))
        if len(indices) != count * width or len(shares) != count * width:
            raise wrong(
                f"{where} has {len(indices)} jointIndices and {len(shares)} jointWeights, not "
                f"{count * width}"
            )
        if len(indices) and (indices.min() < 0 or indices.max() >= len(number)):
            raise wrong(
                f"{where}.jointIndices are {indices.min()} to {indices.max()}, but there are "
                f"{len(number)} joints"
            )
        if not np.isfinite(shares).all() or (shares < 0.0).any():
            raise wrong(f"{where}.jointWeights are not all finite and at least 0")
        found = np.zeros((count, len(order)))
        rows = np.arange(count)[:, None]
        joints = number[indices.reshape(count, width)]
        np.add.at(found, (rows, joints), shares.reshape(count, width))
        return normalised(found, 0)


def _matrices(transforms: Any) -> Array:
    """(n, 4, 4) transposes of USD's transforms, which multiply rows."""
    return np.array([np.array(transform) for transform in transforms]).swapaxes(1, 2)


def _colour(mesh: UsdGeom.Mesh) -> Array:
    """(3,) sRGB colour of a mesh: the plain colour of its material, or else the mean of its
    displayColor."""
    material, _ = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial()
    shader = material.ComputeSurfaceSource()[0] if material else None
    plain = shader.GetInput("diffuseColor") if shader else None
    if plain and not plain.HasConnectedSource() and plain.Get() is not None:
        return to_srgb(plain.Get())
    shown = mesh.GetDisplayColorAttr().Get()
    if not shown:
        return np.full(3, PLAIN)
    return to_srgb(np.array(shown, float).mean(axis=0))


def _points(mesh: UsdGeom.Mesh, where: str) -> Array:
    """(k, 3) the points of a mesh, by default or at its first time."""
    for time in (Usd.TimeCode.Default(), Usd.TimeCode.EarliestTime()):
        points = mesh.GetPointsAttr().Get(time)
        if points:
            return np.array(points, float)
    raise wrong(f"{where}: it has no points")


def _triangles(mesh: UsdGeom.Mesh, points: int, mirrored: bool, where: str) -> Integers:
    """(m, 3) the faces of a mesh as fans, outward."""
    earliest = Usd.TimeCode.EarliestTime()
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(earliest) or (), np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get(earliest) or (), np.int64)
    if not len(counts) or counts.min() < 3:
        raise wrong(f"{where}.faceVertexCounts: a face needs 3 corners or more")
    if counts.sum() != len(corners):
        raise wrong(
            f"{where}.faceVertexCounts add up to {counts.sum()}, but there are {len(corners)} "
            "faceVertexIndices"
        )
    if corners.min() < 0 or corners.max() >= points:
        raise wrong(
            f"{where}.faceVertexIndices are {corners.min()} to {corners.max()}, but the mesh has "
            f"{points} points"
        )
    starts = np.cumsum(counts) - counts
    fans = [
        corners[[start, start + n, start + n + 1]]
        for start, size in zip(starts, counts, strict=True)
        for n in range(1, size - 1)
    ]
    triangles = np.array(fans, np.int64).reshape(-1, 3)
    return triangles[:, ::-1] if mirrored else triangles


def read_all(path: Path) -> None:
    """Read all that an import reads. The calling process reports errors."""
    limit_memory()
    with suppress(SceneError):
        source = UsdSource(path, probed=True)
        _ = source.rig, source.surface
        for clip in range(len(source.clips)):
            with suppress(SceneError):
                source.action(clip)


if __name__ == "__main__":
    read_all(Path(sys.argv[1]))

"""Checks of a USD file, before an import uses it.

A damaged binary file can crash the process that reads it, and no check in that process prevents it.
Another process reads it first.

source  OpenUSD: UsdGeomMesh, UsdSkelBindingAPI; SdfLayer.GetCompositionAssetDependencies
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdSkel

from flowborne.base.errors import SceneError
from flowborne.characters.limits import MAX_FILE_BYTES, MAX_POSES
from flowborne.characters.rig import Array, Integers

EVERYTHING = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)

MAX_LAYERS = 1000
MAX_PRIMS = 100_000

PROBE_SECONDS = 300.0
"""Time limit of the other process, s."""


def open_stage(path: Path, *, probed: bool = False) -> Usd.Stage:
    """The stage of a file that is composed only of files in its folder.

    probed  whether to open binary files directly; otherwise another process reads them first
    raises  SceneError when it cannot be read, is too large, or names a file elsewhere
    """
    folder, pending, known = path.parent.resolve(), [str(path)], {str(path)}
    while pending:
        own = pending.pop()
        where = path.name if own == str(path) else f"{path.name}, layer {Path(own).name}"
        if not (probed or _is_text(own)):
            probe(path)
            probed = True
        layer = _layer(own, where)
        for reference in _named_files(layer):
            below = layer.ComputeAbsolutePath(reference)
            file = Path(Ar.SplitPackageRelativePathOuter(below)[0])
            if not (file.resolve().is_relative_to(folder) and file.is_file()):
                raise SceneError(
                    f"{where} names {reference[:100]!r}, which is not a file in the folder of "
                    f"{path.name}. Put it there, or export the character as one file."
                )
            if below not in known:
                known.add(below)
                pending.append(below)
        if len(known) > MAX_LAYERS:
            raise SceneError(
                f"{path.name} is composed of more than {MAX_LAYERS} files. Flatten it into one "
                "(usdcat --flatten)."
            )
    stage = Usd.Stage.Open(str(path))
    for number, _ in enumerate(Usd.PrimRange.Stage(stage, EVERYTHING)):
        if number >= MAX_PRIMS:
            raise SceneError(
                f"{path.name} has more than {MAX_PRIMS:,} prims. Export the character alone."
            )
    return stage


def probe(path: Path) -> None:
    """Raise SceneError unless another process can read a file."""
    command = [sys.executable, "-P", "-m", "flowborne.characters.usd", str(path)]
    nowhere = subprocess.DEVNULL
    try:
        done = subprocess.run(
            command,
            stdin=nowhere,
            stdout=nowhere,
            stderr=nowhere,
            timeout=PROBE_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise SceneError(
            f"{path.name} cannot be read as USD within {PROBE_SECONDS:g} s. Export a smaller "
            "character."
        ) from None
    if done.returncode:
        raise SceneError(
            f"{path.name} cannot be read as USD: reading it crashes the process. Export it again."
        )


@contextmanager
def reading_usd(name: str) -> Iterator[None]:
    """Context for calls of usd-core: its warnings do not reach the terminal, and its exceptions
    become SceneError."""
    with (
        open(os.devnull, "w", encoding="utf-8") as nowhere,
        redirect_stderr(nowhere),  # its output through Python
        np.errstate(all="ignore"),
    ):
        kept = os.dup(2)
        os.dup2(nowhere.fileno(), 2)
        try:
            yield
        except (Tf.ErrorException, TypeError, RuntimeError, ValueError, MemoryError) as error:
            raise _unreadable(name) from error
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def check_topology(query: UsdSkel.SkeletonQuery, name: str) -> None:
    """Raise SceneError unless a skeleton's joints are a tree with a pose for each of them."""
    joints = len(query.GetJointOrder())
    valid, reason = query.GetTopology().Validate() if joints else (False, "it has none")
    if not valid:
        raise _wrong(f"{name}: the skeleton's joints are not a tree ({reason})")
    for what, poses in (
        ("bindTransforms", query.GetJointWorldBindTransforms()),
        ("restTransforms", query.ComputeJointLocalTransforms(Usd.TimeCode.Default(), True)),
    ):
        if len(poses or ()) != joints:
            raise _wrong(f"{name}: the skeleton has {len(poses or ())} {what} for {joints} joints")


def points_of(mesh: UsdGeom.Mesh, where: str) -> Array:
    """(k, 3) the points of a mesh, by default or at its first time."""
    for time in (Usd.TimeCode.Default(), Usd.TimeCode.EarliestTime()):
        points = mesh.GetPointsAttr().Get(time)
        if points:
            return np.array(points, float)
    raise _wrong(f"{where}: it has no points")


def check_faces(counts: Integers, corners: Integers, points: int, where: str) -> None:
    """Raise SceneError unless the sizes and corners of a mesh's faces fit its points."""
    if not len(counts) or counts.min() < 3:
        raise _wrong(f"{where}.faceVertexCounts: a face needs 3 corners or more")
    if counts.sum() != len(corners):
        raise _wrong(
            f"{where}.faceVertexCounts add up to {counts.sum()}, but there are {len(corners)} "
            "faceVertexIndices"
        )
    if corners.min() < 0 or corners.max() >= points:
        raise _wrong(
            f"{where}.faceVertexIndices are {corners.min()} to {corners.max()}, but the mesh has "
            f"{points} points"
        )


def check_influences(indices: Integers, weights: Array, size: int, joints: int, where: str) -> None:
    """Raise SceneError unless there are `size` influences of a mesh by existing joints."""
    if len(indices) != size or len(weights) != size:
        raise _wrong(
            f"{where} has {len(indices)} jointIndices and {len(weights)} jointWeights, not {size}"
        )
    if size and (indices.min() < 0 or indices.max() >= joints):
        raise _wrong(
            f"{where}.jointIndices are {indices.min()} to {indices.max()}, but there are {joints} "
            "joints"
        )
    if not np.isfinite(weights).all() or (weights < 0.0).any():
        raise _wrong(f"{where}.jointWeights are not all finite and at least 0")


def check_samples(samples: int, joints: int, where: str) -> None:
    """Raise SceneError where a clip has too many samples for its joints."""
    if samples * joints > MAX_POSES:
        raise SceneError(
            f"{where} needs {samples:,} samples of {joints} joints; the maximum is {MAX_POSES:,} "
            "poses. Export a shorter clip."
        )


def _is_text(name: str) -> bool:
    """Whether a layer is a text file, which usd-core parses instead of mapping it into memory."""
    file = Path(name)
    if not file.is_file():  # it is within a package
        return False
    with open(file, "rb") as opened:
        return opened.read(5) == b"#usda"


def _layer(name: str, where: str) -> Sdf.Layer:
    """The layer of a file, or of a file within a package."""
    file = Path(Ar.SplitPackageRelativePathOuter(name)[0])
    if (size := file.stat().st_size) > MAX_FILE_BYTES:
        raise SceneError(
            f"{where} has {size / 2**30:.3g} GB; the maximum is {MAX_FILE_BYTES / 2**30:g} GB. "
            "Export fewer meshes and clips."
        )
    layer = Sdf.Layer.FindOrOpen(name)
    if layer is None:
        raise _unreadable(where)
    return layer


def _named_files(layer: Sdf.Layer) -> list[str]:
    """Other files of which a layer is composed, value clips included."""
    named = {str(name) for name in layer.GetCompositionAssetDependencies()}

    def add(value: Any) -> None:
        if isinstance(value, Sdf.AssetPath):
            named.add(value.path)
        elif isinstance(value, dict):
            for inner in value.values():
                add(inner)
        elif isinstance(value, list | tuple | Sdf.AssetPathArray):
            for inner in value:
                add(inner)

    def visit(at: Sdf.Path) -> None:
        spec = layer.GetObjectAtPath(at)
        if isinstance(spec, Sdf.PrimSpec):
            add(spec.GetInfo("clips"))

    layer.Traverse(layer.pseudoRoot.path, visit)
    return sorted(name for name in named if name)


def _unreadable(where: str) -> SceneError:
    return SceneError(f"{where} cannot be read as USD. Export it again.")


def _wrong(said: str) -> SceneError:
    return SceneError(f"{said}. Export it again.")

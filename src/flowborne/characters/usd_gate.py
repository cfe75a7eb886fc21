"""Opening of a USD file, checked before an import uses it.

Another process reads it first.

source  OpenUSD: SdfLayer.GetCompositionAssetDependencies
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf, Tf, Usd

from flowborne.base.errors import SceneError
from flowborne.characters.apart import check_bytes, run_apart
from flowborne.characters.limits import wrong

EVERYTHING = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)

MAX_LAYERS = 1000
MAX_PRIMS = 100_000


def open_stage(path: Path, *, probed: bool = False) -> Usd.Stage:
    """The stage of a file that is composed only of files in its folder.

    probed  whether to open it directly; otherwise another process reads it first
    raises  SceneError when it cannot be read, is too large, or names a file elsewhere
    """
    folder, pending, known = path.parent.resolve(), [str(path)], {str(path)}
    if not probed:
        probe(path)
    while pending:
        own = pending.pop()
        where = path.name if own == str(path) else f"{path.name}, layer {Path(own).name}"
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
    if run_apart("flowborne.characters.usd", "USD", path)[0]:
        raise wrong(f"{path.name} cannot be read as USD: reading it crashes the process")


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
            raise wrong(f"{name} cannot be read as USD") from error
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def _layer(name: str, where: str) -> Sdf.Layer:
    """The layer of a file, or of a file within a package."""
    file = Path(Ar.SplitPackageRelativePathOuter(name)[0])
    check_bytes(file.stat().st_size, where)
    layer = Sdf.Layer.FindOrOpen(name)
    if layer is None:
        raise wrong(f"{where} cannot be read as USD")
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

"""Bodies of primitives as bodies of meshes."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import product

import numpy as np
import trimesh

from flowborne_validation.worlds import mjcf

Model = Callable[..., str]
"""MJCF elements -> a model of them."""

BOX = re.compile(r'type="box"([^/]*?)size="(\S+) (\S+) (\S+)"')


def mesh_asset(name: str, mesh: trimesh.Trimesh) -> str:
    """The mesh as MJCF has it."""
    vertices = " ".join(f"{x:.9g}" for x in np.ravel(mesh.vertices))
    faces = " ".join(str(n) for n in np.ravel(mesh.faces))
    return f'<mesh name="{name}" vertex="{vertices}" face="{faces}" inertia="exact"/>'


def meshed(model: str) -> str:
    """An MJCF model with a mesh in place of every box."""
    assets = []

    def mesh(found: re.Match[str]) -> str:
        between, *sizes = found.groups()
        corners = [
            x * float(size)
            for way in product((-1, 1), repeat=3)
            for x, size in zip(way, sizes, strict=True)
        ]
        assets.append(f'<mesh name="box{len(assets)}" vertex="{" ".join(map(str, corners))}"/>')
        return f'type="mesh"{between}mesh="box{len(assets) - 1}"'

    model = BOX.sub(mesh, model)
    return model.replace("<worldbody>", f"<asset>{''.join(assets)}</asset><worldbody>")


def meshed_mjcf(*elements: str) -> str:
    """`mjcf` with a mesh in place of every box."""
    return meshed(mjcf(*elements))

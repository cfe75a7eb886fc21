"""Meshes that come, change and go in the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from flowborne.view.browser.prism import Mesh

if TYPE_CHECKING:
    from viser import SceneApi


def show_mesh(scene: SceneApi, name: str, mesh: Mesh, **drawn: Any) -> None:
    """Show a mesh under a name, in place of what was there; nothing when it has no triangles.

    drawn  how, as viser's add_mesh_simple has it
    """
    vertices, faces = mesh
    if len(faces):
        scene.add_mesh_simple(name, vertices.astype(np.float32), faces.astype(np.uint32), **drawn)
    else:
        scene.remove_by_name(name)

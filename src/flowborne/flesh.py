"""Flesh by its table: what [[flesh]] of a scene grows on a model, without the scene."""

from __future__ import annotations

from flowborne.scenes.flesh.grow import grow
from flowborne.scenes.flesh.mesh import FleshMesh
from flowborne.scenes.flesh.mesh_file import mesh_bytes, read_mesh
from flowborne.scenes.schema_flesh import FleshTable

__all__ = ["FleshMesh", "FleshTable", "grow", "mesh_bytes", "read_mesh"]

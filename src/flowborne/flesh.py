"""Flesh by its table: what [[flesh]] of a scene grows on a model, without the scene."""

from __future__ import annotations

from flowborne.scenes.flesh import FleshTable, grow
from flowborne.solids.tissue.mesh import FleshMesh
from flowborne.solids.tissue.mesh_file import mesh_bytes, read_mesh

__all__ = ["FleshMesh", "FleshTable", "grow", "mesh_bytes", "read_mesh"]

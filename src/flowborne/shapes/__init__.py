"""Geometries: one contract, `shape.Shape`, and its kinds.

A shape has a volume, a distance, a cross-section, crossings with lines, a surface and a thickness,
all in its own frame; no other room depends on its kind. The distance at the nodes of the grid is a
kernel, `kernels.distance`, which distinguishes kinds by `Shape.code`.
"""

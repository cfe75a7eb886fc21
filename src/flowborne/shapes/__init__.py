"""Geometries: one contract, `shape.Shape`, and its kinds.

A shape knows its volume, its distance, what a slab or a line cuts out of it, its surface and how
thick it is, all in its own frame; no other room asks what kind it is. The distance at the nodes of
the grid is a kernel, `kernels.distance`, which tells the kinds apart by `Shape.code`.
"""

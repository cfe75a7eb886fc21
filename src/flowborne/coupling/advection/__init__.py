"""Schemes that advect the fluid's velocity: one class and one file each.

`scheme` has their contract. The step calls `carry` and never tests which scheme it has.
"""

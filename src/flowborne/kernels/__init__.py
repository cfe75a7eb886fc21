"""Compiled loops, one file an operator: plain arrays in, plain arrays out, no Python objects.

The one room that imports Numba, and the one that decides on threads (`jit`). Imports nothing of
the other rooms. Each operator in NumPy stands with the tests, in `tests/kernels/references`.
"""

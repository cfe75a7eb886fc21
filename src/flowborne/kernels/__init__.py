"""Compiled loops, one file an operator: plain arrays in, plain arrays out, no Python objects.

The one room that imports Numba, and the one that decides on threads (`jit`). Imports nothing of
the other rooms. Beside an operator stands what it is in NumPy, `<name>_reference`, which a test
compares it with.
"""

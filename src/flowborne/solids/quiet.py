"""MuJoCo's compiler without what Qhull writes past Python to the terminal."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

STDERR = 2


def compiled_quietly(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The model of a spec, its colours between 0 and 1. Raises ValueError for a bad one; what Qhull
    says of it is left out."""
    with _nothing_on_stderr():
        mj = spec.compile()
    for colours in (mj.geom_rgba, mj.mat_rgba, mj.skin_rgba):
        np.clip(np.nan_to_num(colours), 0.0, 1.0, out=colours)
    return mj


@contextmanager
def _nothing_on_stderr() -> Iterator[None]:
    kept, nothing = os.dup(STDERR), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, STDERR)
        yield
    finally:
        os.dup2(kept, STDERR)
        os.close(kept)
        os.close(nothing)

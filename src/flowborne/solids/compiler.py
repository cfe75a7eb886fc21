"""Compiling a model with MuJoCo without its output to the terminal; remedies for its errors."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from mujoco import MjModel, MjSpec

STDERR = 2
"""File descriptor that Qhull writes to, past Python's `sys.stderr`."""

NEGLIGIBLE = 1e-6
"""kg and kg m^2 that a body without mass may be given: negligible for any real body."""

REMEDIES = (
    {"balanceinertia": True},
    {"boundmass": NEGLIGIBLE, "boundinertia": NEGLIGIBLE},
    {"balanceinertia": True, "boundmass": NEGLIGIBLE, "boundinertia": NEGLIGIBLE},
)
"""Attributes of the compiler element that correct inertias, in the order of trial."""


def compiled_quietly(spec: MjSpec) -> MjModel:
    """The model of a spec, with colours clipped to 0 to 1 and without Qhull's messages.

    raises  ValueError for a bad model
    """
    with _silent_stderr():
        mj = spec.compile()
    for colours in (mj.geom_rgba, mj.mat_rgba, mj.skin_rgba):
        np.clip(np.nan_to_num(colours), 0.0, 1.0, out=colours)
    return mj


@contextmanager
def _silent_stderr() -> Iterator[None]:
    kept, nothing = os.dup(STDERR), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, STDERR)
        yield
    finally:
        os.dup2(kept, STDERR)
        os.close(kept)
        os.close(nothing)


def unreadable(where: str, error: Exception) -> ValueError:
    """The error for a model that its reader refuses."""
    return ValueError(f"{where} cannot be read: {error}. Mend the MJCF there.")


def refusal(spec: MjSpec, where: str, error: ValueError) -> ValueError:
    """The error for a model that does not compile, with a remedy that has been tried.

    spec   of the model, not changed
    where  name of the model
    """
    found = re.search(r"Error: (.*inertia.*?)\s*Element name '([^']*)'", str(error), re.DOTALL)
    if found is None:
        return unreadable(where, error)
    why = re.sub(r"; use .*|error '|' in fullinertia", "", found[1].strip())
    return ValueError(
        f"{where}: MuJoCo refuses the inertia of body '{found[2]}' ({why}). {_remedy(spec)}"
    )


def _remedy(spec: MjSpec) -> str:
    """A sentence: how to correct inertias that MuJoCo refuses."""
    for keys in REMEDIES:
        corrected = spec.copy()
        for key, value in keys.items():
            setattr(corrected.compiler, key, value)
        try:
            compiled_quietly(corrected)
        except ValueError:
            continue
        written = " ".join(f'{key}="{str(value).lower()}"' for key, value in keys.items())
        return (
            f"Correct its <inertial>, or add <compiler {written}/>, in a URDF within <mujoco> in "
            "<robot>."
        )
    return "Correct its <inertial>."

"""What to do about a model that MuJoCo does not compile."""

from __future__ import annotations

import re

import mujoco

from flowborne.solids.quiet import compiled_quietly

LEAST = 1e-6
"""kg and kg m^2 that a body without mass may be given: nothing beside the bodies that have some."""

REMEDIES = (
    {"balanceinertia": True},
    {"boundmass": LEAST, "boundinertia": LEAST},
    {"balanceinertia": True, "boundmass": LEAST, "boundinertia": LEAST},
)
"""Attributes of the compiler element that mend inertias, in the order in which they are tried."""


def unreadable(where: str, error: Exception) -> ValueError:
    """A model that is wrong where its reader says."""
    return ValueError(f"{where} cannot be read: {error}. Mend the MJCF there.")


def refusal(spec: mujoco.MjSpec, where: str, error: ValueError) -> ValueError:
    """What is wrong with a model that does not compile, with a remedy that makes it do so.

    spec   of the model; it stays as it is
    where  names it
    """
    found = re.search(r"Error: (.*inertia.*?)\s*Element name '([^']*)'", str(error), re.DOTALL)
    if found is None:
        return unreadable(where, error)
    why = re.sub(r"; use .*|error '|' in fullinertia", "", found[1].strip())
    return ValueError(
        f"{where}: MuJoCo refuses the inertia of body '{found[2]}' ({why}). {_remedy(spec)}"
    )


def _remedy(spec: mujoco.MjSpec) -> str:
    """A sentence: what makes a model compile whose inertias are refused."""
    for keys in REMEDIES:
        mended = spec.copy()
        for key, value in keys.items():
            setattr(mended.compiler, key, value)
        try:
            compiled_quietly(mended)
        except ValueError:
            continue
        written = " ".join(f'{key}="{str(value).lower()}"' for key, value in keys.items())
        return (
            f"Correct its <inertial>, or add <compiler {written}/>, in a URDF within <mujoco> in "
            "<robot>."
        )
    return "Correct its <inertial>."

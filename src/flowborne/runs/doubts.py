"""What the history of a run says against its own numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flowborne.coupling.world import Fluid
from flowborne.runs.history import history_columns, history_rows

BUDGET_OPEN = 1e-6
"""`momentum_budget_error` above which momentum is lost or made; a sound run has some 1e-13."""


def doubts_of(history: Path, bodies: Sequence[str], fluid: Fluid | None) -> list[str]:
    """A sentence, without its full stop, for each reason not to trust the run; none in a sound one.

    bodies  names of those that move and that the fluid meets; a scene starts with them inside
    fluid   of the run
    """
    if fluid is None:
        return []
    found = departure(history, bodies, fluid), open_budget(history)
    return [doubt for doubt in found if doubt]


def departure(history: Path, bodies: Sequence[str], fluid: Fluid) -> str | None:
    """The first body that leaves the fluid's domain, more than a cell beyond a side; None when all
    stay there. Through periodic sides none leaves."""
    grid, periodic = fluid.grid, fluid.boundaries.periodic()
    axes = [axis for axis in grid.axes if not periodic[axis]]
    columns = [f"{body}_{'xyz'[axis]}_m" for body in bodies for axis in axes]
    if not columns:
        return None
    low = np.array([grid.origin[axis] - grid.spacing for axis in axes])
    high = np.array([grid.origin[axis] + (grid.shape[axis] + 1) * grid.spacing for axis in axes])
    for frame, *places in history_rows(history, ["frame", *columns]):
        at = np.reshape(places, (len(bodies), len(axes)))
        left = np.any((at < low) | (at > high), axis=1)
        if left.any():
            return (
                f"body '{bodies[int(left.argmax())]}' left the fluid's domain in frame "
                f"{frame:.0f}; enlarge [domain], or ask for fewer than {frame:.0f} frames"
            )
    return None


def open_budget(history: Path) -> str | None:
    """The frame in which the momentum budget is open most, if it is in any."""
    column = "momentum_budget_error"
    if column not in history_columns(history):
        return None
    rows = history_rows(history, ["frame", column])
    frame, error = max(rows, key=lambda row: row[1], default=(0.0, 0.0))
    if error <= BUDGET_OPEN:
        return None
    return (
        f"momentum was lost or made: {column} is {error:.2g} in frame {frame:.0f}, and some 1e-13 "
        "in a sound run; take more steps per frame, or enlarge [domain] if a body reaches "
        "through a side of it then"
    )

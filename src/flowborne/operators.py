"""The operators of a step on plain arrays, for research on the numerics themselves.

What a step is made of, one by one. They change with the numerics; scenes and worlds need none.
"""

from __future__ import annotations

from flowborne.coupling.step import cut_by_bodies
from flowborne.fluid.advection import CENTRE, carry, cells_per_step
from flowborne.fluid.control_volumes import control_volumes
from flowborne.fluid.dye import Passage, nothing_brought
from flowborne.fluid.ghosts import pad_cells
from flowborne.fluid.grid import faces_of
from flowborne.fluid.transport import Transport
from flowborne.solvers.pressure import PressureSolution, PressureSystem

__all__ = [
    "CENTRE",
    "Passage",
    "PressureSolution",
    "PressureSystem",
    "Transport",
    "carry",
    "cells_per_step",
    "control_volumes",
    "cut_by_bodies",
    "faces_of",
    "nothing_brought",
    "pad_cells",
]

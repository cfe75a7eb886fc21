"""The cases of the reference list, by id."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from flowborne_validation.case import Case, entries

MODULES = {
    "added_mass": ("I1", "I2"),
    "articulated": ("A1", "A2", "A3", "A4"),
    "cavity": ("F2",),
    "channel_cylinder": ("B1", "B2", "B3"),
    "controller": ("K1", "K2", "K3", "K4"),
    "controller_in_flow": ("K5", "K6"),
    "creatures": ("K11",),
    "fishrobot": ("R2",),
    "flag_in_channel": ("D2", "D3"),
    "flag_lift": ("D6",),
    "flapping_ellipse": ("S3",),
    "flesh": ("D1", "D4", "D5"),
    "far_sides": ("I10",),
    "fluid_cases": ("F1", "F3", "F6", "F7"),
    "gradients": ("K7",),
    "human": ("K8", "K9", "K10"),
    "hydrostatics": ("F5",),
    "inviscid": ("I4", "I6", "I7", "I8", "I9"),
    "moving_cylinder": ("V3", "V5", "V8"),
    "open_water": ("B4", "B5", "B6", "B7", "V9"),
    "rexeel": ("R1",),
    "scalar_cases": ("F4",),
    "scatter": ("K12", "K13"),
    "sea": ("B8", "I11"),
    "settling": ("V1", "V2"),
    "small_domains": ("I12",),
    "swimmers": ("S1", "S5"),
}
"""Module -> its cases; a module is imported when one of them is run."""


def case_ids() -> Sequence[str]:
    """Every case, in the order of the reference list."""
    return tuple(entries())


def case(name: str) -> Case:
    """The case with this id. Raises KeyError when there is none."""
    of = {name: module for module, names in MODULES.items() for name in names}
    module = import_module(f"flowborne_validation.{of[name]}")
    found: dict[str, Case] = {c.id: c for c in module.CASES}
    return found[name]

"""Comparison with analytic and published cases: the reference list, run on this machine."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from flowborne.validation.case import Case, Result, Tier
from flowborne.validation.findings import GridSeries

__all__ = ["Case", "GridSeries", "Result", "Tier", "case", "case_ids"]

MODULES = {
    "F1": "fluid_cases",
    "F2": "cavity",
    "F3": "fluid_cases",
    "F4": "scalar_cases",
    "F5": "hydrostatics",
    "F6": "fluid_cases",
    "F7": "fluid_cases",
    "B1": "channel_cylinder",
    "B2": "channel_cylinder",
    "B3": "channel_cylinder",
    "B4": "open_water",
    "B5": "open_water",
    "B6": "open_water",
    "B7": "open_water",
    "I1": "added_mass",
    "I2": "added_mass",
    "I4": "inviscid",
    "I6": "inviscid",
    "I7": "inviscid",
    "I8": "inviscid",
    "I9": "inviscid",
    "V1": "settling",
    "V2": "settling",
    "V3": "oscillating_cylinder",
    "V5": "oscillating_cylinder",
    "V8": "viscous",
    "V9": "open_water",
    "D1": "flesh",
    "D2": "flag_in_channel",
    "D3": "flag_in_channel",
    "D4": "flesh",
    "D5": "flesh",
    "A1": "pendulums",
    "A2": "pendulums",
    "A3": "articulated",
    "A4": "articulated",
    "K1": "controller",
    "K2": "controller",
    "K3": "controller",
    "K4": "controller",
    "K5": "controller_in_flow",
    "K6": "controller_in_flow",
    "K7": "gradients",
    "K8": "human",
    "K9": "human",
    "K10": "human",
    "K11": "creatures",
    "S1": "swimmers",
    "S3": "flapping_ellipse",
    "S5": "swimmers",
    "R1": "rexeel",
}
"""Case -> its module, in the order of the list; a module is imported when its case is run."""


def case_ids() -> Sequence[str]:
    """Every case, in the order of the list."""
    return tuple(MODULES)


def case(name: str) -> Case:
    """The case with this id. Raises KeyError when there is none."""
    module = import_module(f"flowborne.validation.{MODULES[name]}")
    found: dict[str, Case] = {c.id: c for c in module.CASES}
    return found[name]

"""Articulated bodies and flesh by themselves: models, poses, momentum, energy."""

from __future__ import annotations

from flowborne.motion.human.body import human_mjcf
from flowborne.motion.human.skeleton import SIDES, standard_skeleton
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.flesh import Flesh
from flowborne.solids.flesh_dynamics import assemble_flesh, static_forces
from flowborne.solids.flesh_solve import prescribe_flesh
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import (
    halfway_momentum,
    kinetic_energy,
    mass_matrix,
    momentum,
    potential_energy,
)
from flowborne.solids.prescribed import holding
from flowborne.solids.state import SolidState
from flowborne.solids.tissue.growth import Tissue, add_flesh
from flowborne.solvers.cholesky import symmetric_factor

__all__ = [
    "SIDES",
    "Flesh",
    "Kinematics",
    "SolidModel",
    "SolidState",
    "Tissue",
    "add_flesh",
    "assemble_flesh",
    "halfway_momentum",
    "holding",
    "human_mjcf",
    "kinematics",
    "kinetic_energy",
    "mass_matrix",
    "momentum",
    "potential_energy",
    "prescribe_flesh",
    "standard_skeleton",
    "static_forces",
    "symmetric_factor",
]

"""Bodies: models, poses, momentum and energy, flesh, prescribed motions and simple winds."""

from __future__ import annotations

from flowborne.motion.human.body import human_mjcf
from flowborne.motion.human.skeleton import SIDES, standard_skeleton
from flowborne.motion.tracks import (
    Curve,
    TrajectoryConstant,
    TrajectoryFormula,
    TrajectoryKeyframes,
    TrajectorySinusoid,
)
from flowborne.scenes.flesh import FleshTable, grow
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.flesh import Flesh
from flowborne.solids.flesh_dynamics import assemble_flesh, static_forces
from flowborne.solids.flesh_solve import prescribe_flesh
from flowborne.solids.mjcf import read_spec
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.momentum import (
    halfway_momentum,
    kinetic_energy,
    mass_matrix,
    momentum,
    potential_energy,
)
from flowborne.solids.tissue.growth import Tissue, add_flesh
from flowborne.solids.tissue.mesh import FleshMesh
from flowborne.solids.tissue.mesh_file import mesh_bytes, read_mesh
from flowborne.solids.trajectories import (
    JointCommand,
    Servo,
    ServoExact,
    ServoPD,
    Trajectory,
    TrajectoryServo,
)
from flowborne.solids.wind import Wind, WindFaces, WindField, WindForce
from flowborne.solvers.cholesky import symmetric_factor

__all__ = [
    "SIDES",
    "Curve",
    "Flesh",
    "FleshMesh",
    "FleshTable",
    "JointCommand",
    "Kinematics",
    "Servo",
    "ServoExact",
    "ServoPD",
    "SolidModel",
    "SolidState",
    "Tissue",
    "Trajectory",
    "TrajectoryConstant",
    "TrajectoryFormula",
    "TrajectoryKeyframes",
    "TrajectoryServo",
    "TrajectorySinusoid",
    "Wind",
    "WindFaces",
    "WindField",
    "WindForce",
    "add_flesh",
    "assemble_flesh",
    "grow",
    "halfway_momentum",
    "human_mjcf",
    "kinematics",
    "kinetic_energy",
    "mass_matrix",
    "mesh_bytes",
    "momentum",
    "potential_energy",
    "prescribe_flesh",
    "read_mesh",
    "read_spec",
    "standard_skeleton",
    "static_forces",
    "symmetric_factor",
]

__dir__ = __all__.copy

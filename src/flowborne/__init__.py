"""flowborne: creatures that react to the fluid around them.

The public names are here and in these modules:

    bodies     models, poses, momentum and energy, flesh, prescribed motions, simple winds
    play.gym   Gymnasium environments of scenes
    machine    threads, memory, seconds by part, executors
    parts      objectives, rules, gradients, shapes and exporters, and how to add your own
    pictures   pictures and plots
    worlds     worlds made and stepped in code, boundaries, operators of a step

All other modules are internal and may change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flowborne.base.version import __version__

if TYPE_CHECKING:
    from flowborne.base.errors import PartError, SceneError
    from flowborne.characters.folder import Imported, import_character
    from flowborne.control.commands import Control, Position, Torque, Velocity
    from flowborne.control.controller import Controller, Decision, StrengthInPhase
    from flowborne.control.measurement import Measurement
    from flowborne.control.trial import Hypothesis, Velocities
    from flowborne.coupling.report import Outcome, StepReport
    from flowborne.coupling.step import step
    from flowborne.coupling.stream import FlowState
    from flowborne.coupling.world import Fluid, Setup, World
    from flowborne.fluid.grid import Grid
    from flowborne.fluid.state import FluidState
    from flowborne.formats.exporting import export
    from flowborne.kernels.arrays import Array, Faces
    from flowborne.runs.run_folder import RunFolderError
    from flowborne.scenes.listing import scenes
    from flowborne.scenes.load import load_scene
    from flowborne.scenes.schema import Scene
    from flowborne.sim.checked import Checked, check
    from flowborne.sim.endings import RunInterrupted, RunResult
    from flowborne.sim.frame import FrameReport, Snapshot
    from flowborne.sim.running import run
    from flowborne.sim.simulation import BlowUpError, Simulation
    from flowborne.solids.force import Force
    from flowborne.solids.model import SolidModel, SolidState
    from flowborne.solids.sensed import ActuatorState, BodyState, JointState
    from flowborne.solids.tissue.growth import Tissue
    from flowborne.studies.batch_page import Batch, ClipRun
    from flowborne.studies.batches import run_clips
    from flowborne.studies.error_bars import ErrorBar, Refinement, error_bar
    from flowborne.studies.result import StudyResult
    from flowborne.studies.running import study
    from flowborne.view.browser.open_page import view
    from flowborne.view.open_run import OpenRun, open_run
    from flowborne.worlds import advance, make_world

__all__ = [
    "ActuatorState",
    "Array",
    "Batch",
    "BlowUpError",
    "BodyState",
    "Checked",
    "ClipRun",
    "Control",
    "Controller",
    "Decision",
    "ErrorBar",
    "Faces",
    "FlowState",
    "Fluid",
    "FluidState",
    "Force",
    "FrameReport",
    "Grid",
    "Hypothesis",
    "Imported",
    "JointState",
    "Measurement",
    "OpenRun",
    "Outcome",
    "PartError",
    "Position",
    "Refinement",
    "RunFolderError",
    "RunInterrupted",
    "RunResult",
    "Scene",
    "SceneError",
    "Setup",
    "Simulation",
    "Snapshot",
    "SolidModel",
    "SolidState",
    "StepReport",
    "StrengthInPhase",
    "StudyResult",
    "Tissue",
    "Torque",
    "Velocities",
    "Velocity",
    "World",
    "__version__",
    "advance",
    "bodies",
    "check",
    "error_bar",
    "export",
    "import_character",
    "load_scene",
    "machine",
    "make_world",
    "open_run",
    "parts",
    "pictures",
    "run",
    "run_clips",
    "scenes",
    "step",
    "study",
    "view",
    "worlds",
]

__dir__ = __all__.copy

PAGES = ("parts", "bodies", "play.gym", "machine", "pictures", "worlds")
"""Public modules of the package, besides itself."""

CALLED = ("scenes", "view")
"""Packages that are called as functions."""

_PLACES = {
    "ActuatorState": "flowborne.solids.sensed",
    "Array": "flowborne.kernels.arrays",
    "Batch": "flowborne.studies.batch_page",
    "BlowUpError": "flowborne.sim.simulation",
    "BodyState": "flowborne.solids.sensed",
    "Checked": "flowborne.sim.checked",
    "Control": "flowborne.control.commands",
    "ClipRun": "flowborne.studies.batch_page",
    "Controller": "flowborne.control.controller",
    "Decision": "flowborne.control.controller",
    "ErrorBar": "flowborne.studies.error_bars",
    "Faces": "flowborne.kernels.arrays",
    "FlowState": "flowborne.coupling.stream",
    "Fluid": "flowborne.coupling.world",
    "FluidState": "flowborne.fluid.state",
    "Force": "flowborne.solids.force",
    "FrameReport": "flowborne.sim.frame",
    "Grid": "flowborne.fluid.grid",
    "Hypothesis": "flowborne.control.trial",
    "Imported": "flowborne.characters.folder",
    "JointState": "flowborne.solids.sensed",
    "Measurement": "flowborne.control.measurement",
    "OpenRun": "flowborne.view.open_run",
    "Outcome": "flowborne.coupling.report",
    "PartError": "flowborne.base.errors",
    "Position": "flowborne.control.commands",
    "Refinement": "flowborne.studies.error_bars",
    "RunFolderError": "flowborne.runs.run_folder",
    "RunInterrupted": "flowborne.sim.endings",
    "RunResult": "flowborne.sim.endings",
    "Scene": "flowborne.scenes.schema",
    "SceneError": "flowborne.base.errors",
    "Setup": "flowborne.coupling.world",
    "Simulation": "flowborne.sim.simulation",
    "Snapshot": "flowborne.sim.frame",
    "SolidModel": "flowborne.solids.model",
    "SolidState": "flowborne.solids.model",
    "StepReport": "flowborne.coupling.report",
    "StrengthInPhase": "flowborne.control.controller",
    "StudyResult": "flowborne.studies.result",
    "Tissue": "flowborne.solids.tissue.growth",
    "Torque": "flowborne.control.commands",
    "Velocities": "flowborne.control.trial",
    "Velocity": "flowborne.control.commands",
    "World": "flowborne.coupling.world",
    "advance": "flowborne.worlds",
    "check": "flowborne.sim.checked",
    "error_bar": "flowborne.studies.error_bars",
    "export": "flowborne.formats.exporting",
    "import_character": "flowborne.characters.folder",
    "load_scene": "flowborne.scenes.load",
    "make_world": "flowborne.worlds",
    "open_run": "flowborne.view.open_run",
    "run": "flowborne.sim.running",
    "run_clips": "flowborne.studies.batches",
    "step": "flowborne.coupling.step",
    "study": "flowborne.studies.running",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is asked for, so that `import flowborne` is light."""
    from importlib import import_module

    if name in PAGES or name in CALLED:
        return import_module(f"flowborne.{name}")
    if name not in _PLACES:
        raise AttributeError(f"module 'flowborne' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)

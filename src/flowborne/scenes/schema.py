"""A scene: all input of a run, as in its TOML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import tomli_w
from pydantic import BeforeValidator, ConfigDict, Field, PrivateAttr, model_validator

from flowborne.base.tables import (
    Count,
    FileName,
    Number,
    PlainName,
    Positive,
    Steps,
    SwitchOrNames,
    Table,
    Text,
    Vector,
)
from flowborne.control.objective_kinds import AnyObjective
from flowborne.kernels.arrays import Array
from flowborne.runs.exporters import EXPORTERS, can_write, endings
from flowborne.runs.run_folder import FIXED_NAMES
from flowborne.scenes.actuators import ActuatorTable
from flowborne.scenes.changes import ChangeTable
from flowborne.scenes.control import ControllerTable, ControlTable
from flowborne.scenes.domain import Domain, FluidTable
from flowborne.scenes.dye import DyeTable, SourceTable
from flowborne.scenes.flesh import FleshTable
from flowborne.scenes.force import ForceTable
from flowborne.scenes.motions import EarlierTable, MotionTable
from flowborne.scenes.mouths import MouthTable
from flowborne.scenes.policy import PolicyTable
from flowborne.scenes.schema_bodies import (
    ClipTable,
    HumanTable,
    InitialTable,
    ShapeTable,
    SolidsTable,
)
from flowborne.scenes.schema_film import FilmTable
from flowborne.scenes.sides import BoundariesTable
from flowborne.scenes.thrusters import ThrusterTable
from flowborne.scenes.wind import WindTable


class TimeTable(Table):
    """[time]: frames, and physics steps within each.

    frames_per_second  states, and pictures of the film, in a second of the run
    frames             how many the run has
    steps_per_frame    steps of equal length in a frame; where bodies can touch a floor of the model
                       and it is not given, as many as keep that contact stiff
    """

    frames_per_second: Positive = 24.0
    frames: Count = 120
    steps_per_frame: Steps = 1


def _named_file(value: Any) -> Any:
    return {"file": value} if isinstance(value, str) else value


class ExportTable(Table):
    """A file for another program; further keys are parameters of its exporter.

    file  name in the run folder; the ending chooses the exporter
    """

    model_config = ConfigDict(extra="allow")

    file: PlainName

    @property
    def parameters(self) -> dict[str, Any]:
        """The further keys."""
        return dict(self.model_extra or {})

    @model_validator(mode="after")
    def _check(self) -> Self:
        ending = Path(self.file).suffix
        if self.file in FIXED_NAMES:
            raise ValueError(f"is {self.file}, a file of the run itself. Take another name")
        if not can_write(ending):
            raise ValueError(
                f"is {self.file}, and nothing writes '{ending}' files. End it with one of "
                f"{', '.join(endings())}"
            )
        EXPORTERS.check(ending, self.parameters)
        return self


class OutputTable(Table):
    """[output]: files that a run writes.

    checkpoint_every  frames between checkpoints
    bodies            bodies in the history: centre of mass, velocity, force and torque of the fluid
    joints            joints in the history: torque or force, power and target of their drives;
                      true for all driven joints, false for none, or names
    ellipsoid_model   whether the history has the drag and the power that MuJoCo's ellipsoid fluid
                      model would give for the same motion, with the stream at the start; of rigid
                      bodies in three dimensions
    exports           files for other programs, written at the end: names, or tables with `file`
    """

    checkpoint_every: Count = 24
    bodies: tuple[Text, ...] = ()
    joints: SwitchOrNames = True
    ellipsoid_model: bool = False
    exports: tuple[
        Annotated[
            ExportTable, BeforeValidator(_named_file, json_schema_input_type=str | ExportTable)
        ],
        ...,
    ] = ()


class Kept(dict[str, Any]):
    """Cache of what is made of a scene. It does not take part in comparisons, and copies by pickle
    are empty."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Kept)

    def __reduce__(self) -> tuple[type[Kept], tuple[()]]:
        return Kept, ()


class Scene(Table):
    """A scene, checked and with every default filled in.

    name         that of the file unless given; runs are kept in runs/name
    description  what the film shows, in one line
    figure       figure or section of the paper, or the case
    dimensions   2: a slab one cell thick, everything per unit depth; 3
    gravity      m/s^2
    constants    name -> number, for the formulas of [[motion]], [[actuator]], [[mouths]], [[force]]
                 and [[thruster]]
    plugins      Python files in the scene's folder that register parts of the user
    accepted_warnings  kind of a warning -> why the scene is as it is; `check` gives the warning as
                 a note, with this reason
    """

    name: PlainName
    description: str = ""
    figure: str = ""
    dimensions: Literal[2, 3] = 3
    gravity: Vector = (0.0, 0.0, 0.0)
    constants: dict[str, Number] = Field(default_factory=dict)
    plugins: tuple[FileName, ...] = ()
    accepted_warnings: dict[str, Text] = Field(default_factory=dict)
    time: TimeTable = TimeTable()
    domain: Domain | None = None
    fluid: FluidTable | None = None
    boundaries: BoundariesTable | None = None
    sources: tuple[SourceTable, ...] = ()
    dye: tuple[DyeTable, ...] = ()
    solids: SolidsTable | None = None
    shapes: tuple[ShapeTable, ...] = ()
    flesh: tuple[FleshTable, ...] = ()
    human: HumanTable | None = None
    clip: ClipTable | None = None
    earlier: EarlierTable | None = None
    initial: InitialTable = InitialTable()
    motion: tuple[MotionTable, ...] = ()
    actuator: tuple[ActuatorTable, ...] = ()
    wind: tuple[WindTable, ...] = ()
    force: tuple[ForceTable, ...] = ()
    mouths: tuple[MouthTable, ...] = ()
    thruster: tuple[ThrusterTable, ...] = ()
    control: tuple[ControlTable, ...] = ()
    objectives: tuple[AnyObjective, ...] = ()
    controller: ControllerTable = ControllerTable()
    policy: PolicyTable | None = None
    changes: tuple[ChangeTable, ...] = ()
    output: OutputTable = OutputTable()
    film: FilmTable = FilmTable()

    _folder: Path = PrivateAttr(default=Path())
    _kept: Kept = PrivateAttr(default_factory=Kept)

    @model_validator(mode="before")
    @classmethod
    def _fill_what_depends(cls, data: Any) -> Any:
        """A domain brings a fluid and boundaries with it."""
        if isinstance(data, dict) and "domain" in data:
            return {"fluid": {}, "boundaries": {}, **data}
        return data

    def __repr__(self) -> str:
        grid = self.domain.grid() if self.domain is not None and self.has_fluid else "no fluid"
        return (
            f"Scene '{self.name}': {self.dimensions}D, {grid}, {self.time.frames} frames of "
            f"{self.frame_time:.4g} s"
        )

    __str__ = __repr__

    @property
    def has_bodies(self) -> bool:
        """Whether there is anything to move."""
        return self.solids is not None or self.human is not None

    @property
    def has_fluid(self) -> bool:
        """Whether a fluid is simulated."""
        return self.fluid is not None and self.fluid.coupling != "none"

    @property
    def is_two_way(self) -> bool:
        """Whether fluid and bodies move each other."""
        return self.fluid is not None and self.fluid.coupling == "two-way"

    @property
    def is_slab(self) -> bool:
        return self.dimensions == 2

    @property
    def kept(self) -> Kept:
        return self._kept

    @property
    def folder(self) -> Path:
        """The folder from which the scene's files are found."""
        return self._folder

    @property
    def model_path(self) -> Path | None:
        """The MJCF file, or None in a scene without one."""
        return None if self.solids is None else self._folder / self.solids.model

    @property
    def model_source(self) -> str:
        """Where the model is from, for messages."""
        path = self.model_path
        return "the human" if path is None else f"model {path.name}"

    @property
    def frame_time(self) -> float:
        """s between frames."""
        return 1.0 / self.time.frames_per_second

    @property
    def step_time(self) -> float:
        """s between steps."""
        return self.frame_time / self.time.steps_per_frame

    def frame_times(self) -> Array:
        """(frames + 1,) times of all frames and of the start, s."""
        return self.frame_time * np.arange(self.time.frames + 1, dtype=np.float64)

    def in_folder(self, folder: Path) -> Scene:
        """The same scene with its files found from `folder`."""
        scene = self.model_copy()
        scene._folder = Path(folder)
        return scene

    def controlled_joints(self) -> tuple[str, ...]:
        """Names of the controlled joints in the order of the controller."""
        return tuple(joint for table in self.control for joint in table.joints)

    @property
    def can_settle(self) -> bool:
        """Whether the optimum of the objectives does not depend on time.

        It does with a clip, an earlier run, a moving joint, a mouth, an actuator, a thruster, a
        force that changes, a plan of several knots, phases, changes, a policy, or an objective with
        a reference motion.
        """
        moved = self.clip is not None or self.earlier is not None or bool(self.mouths)
        moved |= not all(table.rests for table in self.motion)
        moved |= bool(self.actuator) or bool(self.changes) or self.policy is not None
        moved |= bool(self.thruster) or not all(table.rests for table in self.force)
        planned = self.controller.knots is not None
        phased = any(table.in_phases for table in self.control)
        return not (moved or planned or phased) and all(
            table.rests and table.phases is None for table in self.objectives
        )

    def moved_joints(self) -> dict[str, str]:
        """Joints that [[control]] and [[motion]] move -> which of them does, in words."""
        moved = dict.fromkeys(self.controlled_joints(), "controlled")
        return moved | {table.joint: "moved by a [[motion]]" for table in self.motion}

    def told_actuators(self) -> tuple[str, ...]:
        """Names of the actuators that [[actuator]] or [policy] tells."""
        told = () if self.policy is None else self.policy.actuators
        return tuple(dict.fromkeys([*(table.name for table in self.actuator), *told]))

    def scalars(self) -> tuple[str, ...]:
        """Names of the dyes, each once, in the order of the file."""
        names = [table.name for table in self.dye]
        names += [name for source in self.sources for name in source.dye]
        names += [name for mouth in self.mouths for name in mouth.dye]
        return tuple(dict.fromkeys(names))

    def stream(self) -> tuple[float, ...] | None:
        """Velocity of the stream far from the bodies in m/s, or a uniform wind force in N.

        That of the first inflow side, else of the first wind, else the fluid's initial velocity;
        None when all of it is at rest.
        """
        winds = [
            getattr(wind, key)
            for key in ("velocity", "force")
            for wind in self.wind
            if hasattr(wind, key)
        ]
        return next(filter(any, [*self._inflows(), *winds, self.fluid_velocity()]), None)

    def fluid_velocity(self) -> tuple[float, ...]:
        """Velocity of the undisturbed fluid, m/s: of the first inflow side, else at the start."""
        found = [*self._inflows(), *([] if self.fluid is None else [self.fluid.velocity])]
        return next(filter(any, found), (0.0, 0.0, 0.0))

    def _inflows(self) -> list[tuple[float, ...]]:
        sides = [] if self.boundaries is None else [side for _, side in self.boundaries]
        return [stream for side in sides if (stream := side.stream()) is not None]

    def to_toml(self) -> str:
        """The scene as a file, every default written out; what is absent has no value at all."""
        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))

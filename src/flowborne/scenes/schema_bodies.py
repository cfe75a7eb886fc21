"""Tables of a scene that describe the bodies: model, human, clip, initial state.

Angles are degrees and angular velocities degrees per second, as in MJCF; lengths are metres. What
a number means for a joint follows from the joint: degrees for a hinge, metres for a slide.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, field_validator, model_validator
from scipy.spatial.transform import Rotation

from flowborne.base.tables import (
    FileName,
    JointValues,
    NotNegative,
    Number,
    OwnTable,
    Positive,
    SwitchOrNames,
    Table,
    Text,
    Vector,
    WholeNumber,
    check_interval,
)
from flowborne.kernels.arrays import Array
from flowborne.shapes.own import SHAPES, PlacedShape
from flowborne.solids.displacing import Displace
from flowborne.solids.model import FREE, SolidModel, joint_kind


class DisplaceTable(Table):
    """[solids.displace]: the geoms that displace fluid, those of all keys together. Unless given,
    of each body those that are drawn (groups 0 to 2), or those that collide in their place where
    these are not closed surfaces or have less than half of the others' volume.

    groups   of MuJoCo, 0 to 5
    classes  of defaults in the model
    names    of geoms, or patterns such as "hull_*"
    without  names or patterns of geoms that displace nothing; alone they are taken off those that
             displace by rule
    """

    groups: tuple[Annotated[int, Field(ge=0, le=5)], ...] = ()
    classes: tuple[Text, ...] = ()
    names: tuple[Text, ...] = ()
    without: tuple[Text, ...] = ()

    def build(self) -> Displace:
        """The rule."""
        return Displace(self.groups, self.classes, self.names, self.without)


class SolidsTable(Table):
    """[solids]: the bodies.

    model      MJCF or URDF file, found from the folder of the scene file
    density    kg/m^3 of every body; replaces the model's densities, and not the mass of a geom or
               body that has one in the model
    densities  body -> kg/m^3 of that body; replaces the model's density and `density`
    floating   bodies that hang on the world without a joint, such as the root of a URDF: each gets
               a free joint of its own name
    displace   which geoms the fluid meets
    hold       joints that stay as they start: true for all between bodies that nothing else drives
               and no spring holds, or names; "root" is the free joint by which a body floats. A
               joint in a loop that an equality closes cannot be held. A position actuator of the
               model on a held joint becomes its "pd" servo, with the actuator's stiffness and
               largest force
    packages   folders in which `package://name/...` of a URDF is looked for, besides those above
               it: each holds the package's folder, or is it
    mend       "hull": open meshes are replaced by their convex hulls. Holes up to a twentieth of
               the mesh are closed without it
    """

    model: FileName
    density: Positive | None = None
    densities: dict[str, Positive] = Field(default_factory=dict)
    floating: tuple[Text, ...] = ()
    displace: DisplaceTable = DisplaceTable()
    hold: SwitchOrNames = False
    packages: tuple[FileName, ...] = ()
    mend: Literal["hull"] | None = None


ROOT = "root"
"""Name in [solids] hold of the free joints by which bodies float, where no joint has it."""


def named_holds(solids: SolidsTable | None, model: SolidModel) -> tuple[str, ...]:
    """Joints that [solids] hold names; "root" is every free joint of a model without that joint."""
    hold = () if solids is None or isinstance(solids.hold, bool) else solids.hold
    free = [joint for joint in model.joint_names if joint_kind(model, joint) == FREE]
    if ROOT in hold and ROOT not in model.joint_names and free:
        hold = (*(joint for joint in hold if joint != ROOT), *free)
    return tuple(dict.fromkeys(hold))


class ShapeTable(Table, OwnTable):
    """[[shapes]]: a geometry that the user defines, on a body; further keys are its parameters.

    kind      as it is registered, in a file that `plugins` names
    body      of the model
    position  of its origin in the body's frame, m
    euler     turns about its own x, y and z one after the other, degrees
    axis      direction of its z in the body's frame; replaces euler
    density   kg/m^3; that of the model's geoms unless given
    """

    model_config = ConfigDict(extra="allow")

    registry = SHAPES

    body: Text
    position: Vector = (0.0, 0.0, 0.0)
    euler: Vector | None = None
    axis: Vector | None = None
    density: Positive | None = None

    @field_validator("kind")
    @classmethod
    def _registered(cls, kind: str) -> str:
        if kind not in SHAPES:
            listed = ", ".join(SHAPES.kinds) or "none"
            raise ValueError(f"'{kind}' is not known. Plugins have registered: {listed}")
        return kind

    @model_validator(mode="after")
    def _check_turn(self) -> Self:
        if self.euler is not None and self.axis is not None:
            raise ValueError("has both euler and axis. Keep one of them")
        if self.axis is not None and not any(self.axis):
            raise ValueError("has an axis of no length. Give its direction")
        return self

    def build(self) -> PlacedShape:
        """The geometry on its body."""
        geometry = SHAPES.make(self.kind, self.parameters)
        return PlacedShape(
            geometry, self.body, np.array(self.position), self._rotation(), self.density
        )

    def _rotation(self) -> Array:
        """(3, 3) the shape's frame to the body's; along an axis the least turn of its z."""
        if self.axis is None:
            turn = Rotation.from_euler("XYZ", self.euler or (0.0, 0.0, 0.0), degrees=True)
            return np.asarray(turn.as_matrix())
        z = np.array(self.axis) / np.linalg.norm(self.axis)
        across = np.cross([0.0, 0.0, 1.0], z)
        sine = float(np.linalg.norm(across))
        normal = across / sine if sine > 0.0 else np.array([1.0, 0.0, 0.0])
        return np.asarray(Rotation.from_rotvec(np.arctan2(sine, z[2]) * normal).as_matrix())


class InitialTable(Table):
    """[initial]: where the joints start. By default they start as in the model, at rest; a hinge or
    slide that the model has outside its range starts at the nearest end.

    keyframe    keyframe of the model with the initial positions and velocities
    positions   joint -> degrees (hinge) or m (slide); a ball joint takes a quaternion (w, x, y, z),
                a free joint (x, y, z) in m and a quaternion
    velocities  joint -> degrees/s or m/s; a ball joint takes (x, y, z) in degrees/s, a free joint
                (x, y, z) in m/s and (x, y, z) in degrees/s, as MuJoCo's qvel does
    impulse     "given": all velocities are as they stand, and the fluid flows around the moving
                bodies; "none": free joints start with the velocity at which the creature and the
                fluid together have no impulse, as after moving its joints from rest
    """

    keyframe: Text | None = None
    positions: dict[str, JointValues] = Field(default_factory=dict)
    velocities: dict[str, JointValues] = Field(default_factory=dict)
    impulse: Literal["given", "none"] = "given"


class HumanTable(Table):
    """[human]: a body of 23 rigid parts; replaces [solids].

    mass    kg
    sex     selects the proportions of mass
    height  m, of the standard skeleton; where a clip's file gives the bones it is not used
    elbows  whether elbows are hinges, each of which goes with its shoulder wherever the scene names
            that: with its strength and its objectives
    """

    mass: Positive = 73.0
    sex: Literal["male", "female"] = "male"
    height: Positive = 1.741
    elbows: bool = False


class ClipTable(Table):
    """[clip]: captured motion that joints follow.

    file         BVH file, found from the folder of the scene file; without it, a walk by published
                 curves of a gait (for [human])
    unit         m per unit of length of the file; "auto" is what makes a human's legs 0.65 to
                 1.1 m long, and 1 for other creatures
    up           axis of the file that points up; "auto" is the one along which a human stands, and
                 y for other creatures
    skip         frames dropped at the start, which often hold a T-pose
    start, stop  s, the part that is used, counted after the skipped frames
    loop         whether it starts again when it ends, from where it has come to; unless given the
                 generated walk does and a file does not
    blend        s over which it sets out from rest, comes to rest at the end, or passes from one
                 round of a loop to the next. What [initial] poses sets out from there, all else
                 from the clip's first pose
    smooth       Hz below which motion is kept; all of it unless given
    floor        "soles" puts those that stand on z = 0, where floors of captures are neither at 0
                 nor even, or "file": heights are the file's own (both for [human])
    heading      degrees; turns the clip to the left about its start
    offset       m; moves the clip after that
    mapping      joint of the model -> joint of the clip, where their names do not tell
    joints       joints of the model that follow; unless given all that the clip has and that are
                 not controlled, moved by a [[motion]], held by name or free
    free         joints that the clip has and that start as it does, but then go where forces take
                 them: a root that is free floats
    """

    file: FileName | None = None
    unit: Positive | Literal["auto"] = "auto"
    up: Literal["auto", "y", "z", "-y", "-z"] = "auto"
    skip: WholeNumber = 0
    start: NotNegative = 0.0
    stop: Positive | None = None
    loop: bool | None = None
    blend: NotNegative = 0.0
    smooth: Positive | None = None
    floor: Literal["soles", "file"] = "soles"
    heading: Number = 0.0
    offset: Vector = (0.0, 0.0, 0.0)
    mapping: dict[str, Text] = Field(default_factory=dict)
    joints: Annotated[tuple[Text, ...], Field(min_length=1)] | None = None
    free: tuple[Text, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> Self:
        check_interval(self.start, self.stop)
        return self

"""Tables of a scene that describe a walking human: the body, and the clip that it follows."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flowborne.tables import (
    FileName,
    NotNegative,
    Number,
    Positive,
    Table,
    Text,
    Vector,
    WholeNumber,
    check_interval,
)


class HumanTable(Table):
    """[human]: a body of 23 rigid parts; replaces [solids].

    mass    kg
    sex     selects the proportions of mass
    height  m, of the standard skeleton; where a clip's file gives the bones it is not used
    elbows  whether each elbow goes with its shoulder wherever the scene names that: controlled as a
            hinge, wanting what the shoulder wants
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
                 not controlled, moved by a [[motion]] or free
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

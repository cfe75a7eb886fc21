"""What is asked of the viewer."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What is shown of a state.

    field     "dye", "vorticity" or "none"; of a slab also "speed" and "pressure"
    slice     "speed", "pressure" or "none", in space
    axis      number of the axis across which the slice is
    place     m, where on it
    velocity  whether the velocity in the slice is shown, in a slab that of all
    bones     whether flesh is seen through, to the bones in it
    forces    whether the forces on the bodies are shown
    follow    whether the view goes along with the bodies
    """

    field: str = "none"
    slice: str = "none"
    axis: int = 1
    place: float = 0.0
    velocity: bool = False
    bones: bool = False
    forces: bool = True
    follow: bool = True

"""Nodes of materials and worlds by short calls, with noises that make a film a loop."""

from __future__ import annotations

from math import pi
from typing import Any

import bpy
from mathutils import Vector

Point = tuple[float, float, float]
Colour = tuple[float, float, float]


class Nodes:
    """Nodes of a material or a world; inputs are numbers, or outputs of other nodes."""

    def __init__(self, owner: Any, frames: int) -> None:
        owner.use_nodes = True
        self.tree, self.frames = owner.node_tree, frames
        self.tree.nodes.clear()

    def add(self, kind: str, inputs: dict[Any, Any] | None = None, **settings: Any) -> Any:
        """The outputs of a new node."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        for key, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        return node.outputs

    def math(self, operation: str, *values: Any) -> Any:
        """A number of numbers."""
        return self.add("Math", dict(enumerate(values)), operation=operation)[0]

    def vector(self, operation: str, *values: Any) -> Any:
        """A vector of vectors; a number for DOT_PRODUCT."""
        found = self.add("VectorMath", dict(enumerate(values)), operation=operation)
        return found["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def smooth(self, value: Any, low: float, high: float) -> Any:
        """0 below `low`, 1 above `high`, smooth in between."""
        limits = {0: value, 1: low, 2: high}
        return self.add("MapRange", limits, interpolation_type="SMOOTHSTEP")[0]

    def mix(self, share: Any, first: Any, second: Any) -> Any:
        """A colour between two."""
        first, second = (
            (*each, 1.0) if isinstance(each, tuple) else each for each in (first, second)
        )
        return self.add("Mix", {0: share, 6: first, 7: second}, data_type="RGBA")[2]

    def noise(self, place: Any, scale: float, pace: float, detail: float = 0.0) -> Any:
        """Noise from 0 to 1 of x and y of a place that moves and is a loop.

        It goes around a circle in two more dimensions.

        scale   1/m
        pace    radius of the circle, in lengths of the noise
        detail  octaves of finer noise
        """
        place = self.vector("MULTIPLY_ADD", place, (scale, scale, 0.0), (0.0, 0.0, 0.0))
        inputs = {"Vector": place, "Scale": 1.0, "Detail": detail}
        noise = self.add("TexNoise", inputs, noise_dimensions="4D")[0]
        self.turn(place.node.inputs[2], 2, pace, "cos")
        self.turn(noise.node.inputs["W"], -1, pace, "sin")
        return noise

    def turn(self, socket: Any, index: int, pace: float, function: str) -> None:
        """Let a value (number `index` of a vector, or -1) go around once in a film."""
        curve = socket.driver_add("default_value", index)
        curve.driver.expression = f"{pace}*{function}({2.0 * pi / self.frames}*frame)"

    def direction(self) -> Any:
        """Direction of the ray."""
        toward = self.add("NewGeometry")["Incoming"]
        return self.vector("MULTIPLY", toward, (-1.0, -1.0, -1.0))

    def out(self, shader: Any, socket: str = "Surface", kind: str = "Material") -> None:
        """Make a shader the surface or the volume of the material or world."""
        self.add(f"Output{kind}", {socket: shader})


def add_object(name: str, data: Any) -> Any:
    """A new object in the scene."""
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def turned_to(direction: Any, axis: str) -> Any:
    """Euler angles that turn an axis of an object to a direction, and y up."""
    return Vector(direction).to_track_quat(axis, "Y").to_euler()


def meet_only(thing: Any, *rays: str) -> None:
    """Let only these kinds of rays meet an object."""
    for kind in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(thing, f"visible_{kind}", kind in rays)

"""Water for Cycles: its colour in depth, light that waves focus, rays, sand, ink, and the surface.

All of it but ink is surfaces and closed formulas, since a volume that scatters takes minutes a
frame on processors. Light from a point fades with its distance, and the water in between adds its
own colour. Patterns are noises that make a film a loop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import bpy
from mathutils import Matrix, Vector

from hero_nodes import Colour, Nodes, Point, add_object, meet_only, turned_to

DEEP, LEVEL, BRIGHT = (0.0, 0.012, 0.04), (0.003, 0.09, 0.17), (0.08, 0.44, 0.52)
"""Colour of the water that is seen downward, level and upward."""

HAZE = (0.55, 0.85, 0.8)
"""Colour of water toward the sun, and of rays."""

SKY, GLARE, SUNLIGHT = (0.75, 0.9, 1.0), (6.0, 5.6, 5.0), (1.0, 0.95, 0.82)
"""Colour of the sky, of the sky around the sun, and of the light."""

WAVES = ((0.22, 0.7, 1.6), (0.6, 1.2, 0.75), (1.7, 2.0, 0.22))
"""Scale (1/m), pace and height (m) of the waves that are seen."""

WEBS = ((0.55, 1.0), (0.83, 1.3))
"""Scale (1/m) and pace of the bright lines into which waves focus light."""

FOCUS = 4.5, 0.2
"""Light in a bright line, beyond that elsewhere."""

INK = 0.12, 0.08, 0.16
"""Colour of light that ink scatters."""


class Water:
    """Water below a surface, with the sun above it.

    frames   of the loop
    sun      toward it; of any length
    surface  height, m
    clear    red, green and blue light that is left after a metre
    """

    def __init__(self, frames: int, sun: Point, surface: float, clear: Colour) -> None:
        self.frames, self.surface, self.clear = frames, surface, clear
        self.sun = Vector(sun).normalized()

    def add(self) -> None:
        """Add the water and the light in it to the scene."""
        self._add_world()
        self._add_surface()
        self._add_sun()

    def colour(self, nodes: Nodes, direction: Any) -> Any:
        """Colour of endless water in a direction; it is brighter toward the sun."""
        up = nodes.add("SeparateXYZ", {0: direction})[2]
        below = nodes.mix(nodes.smooth(up, -0.7, 0.12), DEEP, LEVEL)
        colour = nodes.mix(nodes.smooth(up, -0.1, 0.85), below, BRIGHT)
        share = nodes.math("MULTIPLY", self._toward(nodes, direction, 9.0), 0.7)
        return nodes.mix(share, colour, HAZE)

    def _toward(self, nodes: Nodes, direction: Any, sharpness: float) -> Any:
        """1 toward the sun, less beside it."""
        cosine = nodes.vector("DOT_PRODUCT", direction, tuple(self.sun))
        return nodes.math("POWER", nodes.math("MAXIMUM", cosine, 0.0), sharpness)

    def through(self, nodes: Nodes) -> tuple[Any, Any]:
        """What is left of the light from a point, by colours, and what the water adds to it."""
        length = nodes.add("LightPath")["Ray Length"]
        powers = [nodes.math("POWER", each, length) for each in self.clear]
        left = nodes.add("CombineXYZ", dict(enumerate(powers)))[0]
        lost = nodes.vector("SUBTRACT", (1.0, 1.0, 1.0), left)
        return left, nodes.vector("MULTIPLY", self.colour(nodes, nodes.direction()), lost)

    def material(self, name: str, base: Callable[[Nodes], Any], roughness: float = 0.45) -> Any:
        """A material in the water; `base` gives its colour."""
        material = bpy.data.materials.new(name)
        nodes = Nodes(material, self.frames)
        left, added = self.through(nodes)
        gloss = nodes.math("MULTIPLY", nodes.add("SeparateXYZ", {0: left})[2], 0.25)
        inputs = {
            "Base Color": nodes.vector("MULTIPLY", base(nodes), left),
            "Roughness": roughness,
            "Specular IOR Level": gloss,
            "Emission Color": added,
            "Emission Strength": 1.0,
        }
        nodes.out(nodes.add("BsdfPrincipled", inputs)[0])
        material.cycles.emission_sampling = "NONE"
        return material

    def _add_world(self) -> None:
        """Water all around; rays that leave through the surface meet the sky."""
        world = bpy.data.worlds.new("water")
        bpy.context.scene.world = world
        nodes = Nodes(world, self.frames)
        direction = nodes.direction()
        sky = nodes.mix(self._toward(nodes, direction, 60.0), SKY, GLARE)
        ray = nodes.add("LightPath")
        colour = nodes.mix(ray["Is Transmission Ray"], self.colour(nodes, direction), sky)
        power = nodes.math("ADD", ray["Is Diffuse Ray"], 1.0)
        nodes.out(nodes.add("Background", {0: colour, 1: power})[0], kind="World")

    def _add_surface(self) -> None:
        """Waves by a bump, from below: a mirror of the deep, and a window around the zenith."""
        material = bpy.data.materials.new("surface")
        nodes = Nodes(material, self.frames)
        place = nodes.add("NewGeometry")["Position"]
        height = 0.0
        for scale, pace, size in WAVES:
            height = nodes.math("MULTIPLY_ADD", nodes.noise(place, scale, pace, 2.0), size, height)
        bump = nodes.add("Bump", {"Height": height, "Distance": 1.0})[0]
        left, added = self.through(nodes)
        inputs = {"Color": left, "Roughness": 0.0, "IOR": 1.333, "Normal": bump}
        glass, light = nodes.add("BsdfGlass", inputs)[0], nodes.add("Emission", {0: added})[0]
        nodes.out(nodes.add("AddShader", {0: glass, 1: light})[0])
        material.cycles.emission_sampling = "NONE"
        meet_only(add_plane(material, 600.0, self.surface), "camera", "glossy")

    def _add_sun(self) -> None:
        """The sun, and a plane that lets more of it through where waves focus it."""
        material = bpy.data.materials.new("caustics")
        nodes = Nodes(material, self.frames)
        place = nodes.add("NewGeometry")["Position"]
        bend = nodes.math("MULTIPLY", nodes.noise(place, 0.5, 0.8), 1.6)
        place = nodes.vector("ADD", place, nodes.add("CombineXYZ", {0: bend, 1: bend})[0])
        webs = []
        for scale, pace in WEBS:
            off = nodes.math("SUBTRACT", nodes.noise(place, scale, pace), 0.5)
            near = nodes.math("MULTIPLY_ADD", nodes.math("ABSOLUTE", off), -3.0, 1.0)
            webs.append(nodes.math("POWER", nodes.math("MAXIMUM", near, 0.0), 6.0))
        bright = nodes.math("MULTIPLY_ADD", nodes.math("MAXIMUM", *webs), *FOCUS)
        grey = nodes.add("CombineXYZ", dict.fromkeys(range(3), bright))[0]
        nodes.out(nodes.add("BsdfTransparent", {0: grey})[0])
        meet_only(add_plane(material, 90.0, self.surface + 0.2), "shadow")
        lamp = bpy.data.lights.new("sun", "SUN")
        lamp.energy, lamp.angle, lamp.color = 4.0, 0.01, SUNLIGHT
        add_object("sun", lamp).rotation_euler = turned_to(self.sun, "Z")

    def add_sand(self, height: float) -> None:
        """A bottom of rippled sand."""
        add_plane(self.material("sand", sand, 0.9), 120.0, height)

    def ink(self, grid: str, density: float) -> Any:
        """A volume that takes light away where there is ink; `density` in 1/m for a grid of 1."""
        material = bpy.data.materials.new("ink")
        nodes = Nodes(material, self.frames)
        amount = nodes.math("MULTIPLY", nodes.add("Attribute", attribute_name=grid)["Fac"], density)
        inputs = {"Color": (*INK, 1.0), "Density": amount, "Density Attribute": ""}
        nodes.out(nodes.add("VolumePrincipled", inputs)[0], "Volume")
        return material

    def add_rays(
        self, camera: tuple[Point, Point], distances: Sequence[float], power: float
    ) -> None:
        """Sheets across the view, along the light, that glow in beams; distances in m."""
        view = Vector(camera[1]) - Vector(camera[0])
        view.z = 0.0
        view.normalize()
        across, down = view.cross((0.0, 0.0, 1.0)), -self.sun
        turned = Matrix((across, down, across.cross(down))).transposed().to_4x4()
        for number, distance in enumerate(distances):
            start = Vector(camera[0]) + view * distance
            start.z = self.surface
            corners = [(x, y, 0.0) for x, y in ((-40, 0), (40, 0), (40, 20), (-40, 20))]
            mesh = bpy.data.meshes.new("rays")
            mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
            mesh.materials.append(self._beams(number, power))
            thing = add_object("rays", mesh)
            thing.matrix_world = Matrix.Translation(start) @ turned
            meet_only(thing, "camera")

    def _beams(self, number: int, power: float) -> Any:
        """A clear material with beams along y, which fade with y."""
        material = bpy.data.materials.new("rays")
        nodes = Nodes(material, self.frames)
        own = nodes.add("TexCoord")["Object"]
        line = nodes.vector("MULTIPLY_ADD", own, (1.0, 0.0, 0.0), (0.0, 7.3 * number, 0.0))
        wide = nodes.smooth(nodes.noise(line, 0.35, 0.7), 0.42, 0.75)
        fine = nodes.smooth(nodes.noise(line, 1.3, 1.2), 0.3, 0.8)
        depth = nodes.add("SeparateXYZ", {0: own})[1]
        glow = nodes.math("MULTIPLY", nodes.math("POWER", 0.84, depth), power)
        for part in (nodes.smooth(depth, 0.0, 1.5), fine, wide):
            glow = nodes.math("MULTIPLY", glow, part)
        colour = nodes.vector("MULTIPLY", self.through(nodes)[0], HAZE)
        beams = nodes.add("Emission", {0: colour, 1: glow})[0]
        clear = nodes.add("BsdfTransparent", {0: (1.0, 1.0, 1.0, 1.0)})[0]
        nodes.out(nodes.add("AddShader", {0: beams, 1: clear})[0])
        material.cycles.emission_sampling = "NONE"
        return material


def add_plane(material: Any, size: float, height: float) -> Any:
    """A level square."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0.0, 0.0, height))
    bpy.context.object.data.materials.append(material)
    return bpy.context.object


def sand(nodes: Nodes) -> Any:
    """Colour of sand in ripples."""
    place = nodes.add("NewGeometry")["Position"]
    bands = {"Vector": place, "Scale": 1.3, "Distortion": 4.0, "Detail": 3.0}
    ripples = nodes.add("TexWave", bands)[1]
    grain = nodes.add("TexNoise", {"Vector": place, "Scale": 2.0, "Detail": 6.0})[0]
    light = nodes.math("MULTIPLY_ADD", grain, 0.6, nodes.math("MULTIPLY", ripples, 0.25))
    return nodes.mix(light, (0.10, 0.09, 0.07), (0.36, 0.31, 0.23))

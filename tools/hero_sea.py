"""A sea in wind for Cycles, seen by a camera that flies over it, and the sky above it.

The surface is a sum of waves, which move as those of deep water do, on a grid that is fine near the
camera. Their frequencies, as the camera meets them, are rounded so that a film is a loop.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi, radians
from typing import Any

import bpy
import numpy as np

from hero_nodes import Nodes, Point, add_object, turned_to

GRAVITY = 9.81

WAVES, LONGEST, SHORTEST = 200, 11.0, 0.08
"""Number of waves, and the range of their lengths, m."""

SLOPE = 0.034
"""Steepest slope of a wave."""

SPREAD = 0.7
"""Standard deviation of the waves' directions, rad."""

ROWS, COLUMNS, NEAR, FAR, WIDTH = 900, 400, 1.0, 3000.0, 0.65
"""Of the grid: vertices away from the camera and across, distances in m, half its angle in rad."""

WATER = (0.002, 0.03, 0.045)
"""Colour of light that comes back from below the surface."""

SUN_ELEVATION, SUN_ROTATION = radians(15.0), radians(328.0)


class Sea:
    """The sea below a camera.

    frames  of the loop
    rate    frames per second
    speed   (2,) m/s of the camera
    waves   direction in which most of the waves go, rad
    camera  its place and the point at which it looks, m
    """

    def __init__(
        self,
        frames: int,
        rate: float,
        speed: tuple[float, float],
        waves: float,
        camera: tuple[Point, Point],
    ) -> None:
        random = np.random.default_rng(67)
        self.frames, self.number = frames, 2.0 * pi / np.geomspace(LONGEST, SHORTEST, WAVES)
        angle = waves + SPREAD * random.standard_normal(WAVES)
        self.vector = self.number[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        frequency = self.vector @ np.array(speed) - np.sqrt(GRAVITY * self.number)
        self.turn = 2.0 * pi * np.round(frequency * frames / rate / (2.0 * pi)) / frames
        self.start = random.uniform(0.0, 2.0 * pi, WAVES)
        view = np.subtract(camera[1], camera[0])
        away = np.geomspace(NEAR, FAR, ROWS)[:, None]
        angles = np.arctan2(view[1], view[0]) + np.linspace(-WIDTH, WIDTH, COLUMNS)
        x, y = camera[0][0] + away * np.cos(angles), camera[0][1] + away * np.sin(angles)
        self.flat = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
        self.spacing = np.repeat(away[:, 0] * np.log(FAR / NEAR) / ROWS, COLUMNS)

    def faces(self) -> list[tuple[int, ...]]:
        """Corners of the squares of the grid."""
        corner = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
        around = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
        return [tuple(each) for each in np.stack(around, axis=-1).reshape(-1, 4).tolist()]

    def points(self, frame: int) -> np.ndarray:
        """(n, 3) m, the surface; waves fade out where the grid is too coarse for them."""
        points = self.flat.copy()
        for number, vector, turn, start in zip(
            self.number, self.vector, self.turn, self.start, strict=True
        ):
            shown = np.clip(2.0 - self.spacing * number, 0.0, 1.0)
            seen = shown > 0.0
            phase = points[seen, :2] @ vector + turn * frame + start
            points[seen, 2] += SLOPE / number * shown[seen] * np.sin(phase)
        return points

    def add_light(self, fill: Point) -> None:
        """Add a low sun in a sky, and weak light from a direction, which water does not mirror."""
        world = bpy.data.worlds.new("sky")
        bpy.context.scene.world = world
        nodes = Nodes(world, self.frames)
        sky = nodes.add("TexSky")[0]
        sky.node.sun_elevation, sky.node.sun_rotation = SUN_ELEVATION, SUN_ROTATION
        sky.node.sun_intensity = 0.5
        nodes.out(nodes.add("Background", {0: sky, 1: 0.08})[0], kind="World")
        lamp = bpy.data.lights.new("fill", "SUN")
        lamp.energy, lamp.angle = 2.0, 0.5
        thing = add_object("fill", lamp)
        thing.rotation_euler, thing.visible_glossy = turned_to(fill, "Z"), False

    def water(self) -> Any:
        """The material of the surface."""
        return self.material("sea", lambda nodes: (*WATER, 1.0), 0.06)

    def material(self, name: str, base: Callable[[Nodes], Any], roughness: float = 0.6) -> Any:
        """A material in air; `base` gives its colour."""
        material = bpy.data.materials.new(name)
        nodes = Nodes(material, self.frames)
        inputs = {"Base Color": base(nodes), "Roughness": roughness, "IOR": 1.333}
        nodes.out(nodes.add("BsdfPrincipled", inputs)[0])
        return material

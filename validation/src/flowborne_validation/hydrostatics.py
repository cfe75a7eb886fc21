"""Fluid at rest around cut cells: F5."""

from __future__ import annotations

import numpy as np

from flowborne import Array, Grid, World
from flowborne.worlds import advance, cut_by_bodies, make_world
from flowborne_validation.findings import Figures
from flowborne_validation.worlds import Vector, mjcf, square

GRAVITY: Vector = (751.0, 83.6, 0.0)
TILTED: Vector = (751.0, 83.6, -212.0)
"""m/s^2, at a generic angle to a slab and to a three-dimensional grid."""

DENSITY, DT, SOLVE = 1.3, 1e-3, 1e-13
"""kg/m^3 of fluid and neutral bodies; s; relative residual of the pressure solve, below the
tolerance of the velocity."""

SLAB = square(48)
BOX = Grid((20, 20, 20), 1.0 / 20.0, (-0.5, -0.5, -0.5))

SHAPES = (
    ("ball", (-0.27, -0.262, 0.013), '<geom type="sphere" size="0.123"/>'),
    ("brick", (0.251, -0.23, -0.02), '<geom type="box" size="0.131 0.083 0.11" euler="0 0 0.4"/>'),
    ("egg", (0.24, 0.29, 0.01), '<geom type="ellipsoid" size="0.151 0.092 0.11" euler="0 0 1.1"/>'),
)
"""Name, position and geometry of bodies; the grids cut them all."""


def hollow(depth: float, *ends: float) -> str:
    """Geoms of walls around a pore: four of a half depth, and `ends` across z at these heights."""
    walls = [
        (f"{a} {b} {depth}", f"{x} {y} 0")
        for a, b, x, y in (
            (0.161, 0.041, 0, 0.12),
            (0.161, 0.041, 0, -0.12),
            (0.041, 0.161, 0.12, 0),
            (0.041, 0.161, -0.12, 0),
        )
    ]
    walls += [("0.161 0.161 0.041", f"0 0 {z}") for z in ends]
    return "".join(f'<geom type="box" size="{size}" pos="{at}"/>' for size, at in walls)


def placed(name: str, centre: Vector, content: str, grid: Grid, turned: str = "") -> str:
    """MJCF of a body; in a slab at z = 0."""
    z = 0.0 if grid.is_slab else centre[2]
    return f'<body name="{name}" pos="{centre[0]} {centre[1]} {z}" {turned}>{content}</body>'


def fixed_bodies(grid: Grid) -> str:
    """MJCF of bodies without joints, one of them hollow."""
    bodies = [placed(name, centre, geom, grid) for name, centre, geom in SHAPES]
    pore = hollow(1) if grid.is_slab else hollow(0.161, 0.12, -0.12)
    bodies.append(placed("hollow", (-0.243, 0.228, 0.01), pore, grid, 'euler="0 0 0.3"'))
    return mjcf(*bodies)


def displaced(world: World) -> tuple[Array, Array]:
    """Discrete volume of each body for a pressure gradient along each axis, and its centroid.

    A gradient along an axis acts on the closed parts of the faces across it, each of which
    represents a volume of closed area times h.

    returns  (nbody, 3) m^3; (nbody, 3, 3) centroid of that volume for each axis, m
    """
    fluid, _ = world.flow()
    grid, closed = fluid.grid, cut_by_bodies(world).closed
    count = len(world.setup.solid.body_names)
    volume, moment = np.zeros((count, 3)), np.zeros((count, 3, 3))
    for axis in grid.axes:
        across = closed.axis == axis
        part = grid.cell_volume * closed.part[across]
        np.add.at(volume[:, axis], closed.body[across], part)
        np.add.at(moment[:, axis], closed.body[across], part[:, None] * closed.place[across])
    return volume, moment / np.where(volume > 0.0, volume, 1.0)[:, :, None]


def still_around_fixed(grid: Grid, gravity: Vector, steps: int) -> tuple[float, float, float]:
    """Fluid at rest under its own weight around fixed bodies.

    returns  max|u| / (g dt); largest error of a body's force over that force; largest torque
             about its displaced centroid over force times the cube root of its volume
    """
    world = make_world(
        fixed_bodies(grid), grid, density=DENSITY, body_force=gravity, tolerance=SOLVE
    )
    report = advance(world, DT, steps)
    volume, centroid = displaced(world)
    weight = DENSITY * volume * np.array(gravity)
    force, torque = report.pressure_wrench[:, :3], report.pressure_wrench[:, 3:]
    about = np.zeros_like(torque)
    for axis in grid.axes:
        push = np.zeros_like(force)
        push[:, axis] = -weight[:, axis]
        about += np.cross(centroid[:, axis], push)
    bodies = volume.max(axis=1) > 0.0
    size = np.linalg.norm(weight, axis=1)[bodies]
    length = volume.max(axis=1)[bodies] ** (1.0 / len(grid.axes))
    wrong = np.linalg.norm(force + weight, axis=1)[bodies] / size
    turned = np.linalg.norm(torque - about, axis=1)[bodies] / (size * length)
    return fastest(world) / speed(gravity), float(wrong.max()), float(turned.max())


def still_around_free(grid: Grid, gravity: Vector, steps: int) -> tuple[float, float]:
    """Neutral free bodies in fluid at rest: max|u| and largest velocity of a body over g dt."""
    world = make_world(
        mjcf(*(placed(name, centre, "<freejoint/>" + geom, grid) for name, centre, geom in SHAPES)),
        grid,
        gravity=gravity,
        solid_density=DENSITY,
        density=DENSITY,
        tolerance=SOLVE,
    )
    advance(world, DT, steps)
    return fastest(world) / speed(gravity), float(np.abs(world.solid.v).max()) / speed(gravity)


def speed(gravity: Vector) -> float:
    """g dt, m/s."""
    return float(np.linalg.norm(gravity)) * DT


def fastest(world: World) -> float:
    """Largest velocity of the fluid, m/s."""
    fluid, state = world.flow()
    return max(float(np.abs(state.velocity[axis]).max()) for axis in fluid.grid.axes)


def hydrostatic_balance(name: str, steps: int) -> Figures:
    """F5: fluid at rest under its own weight around fixed bodies, and around neutral free ones, in
    a slab or in 3D. The solver omits the hydrostatic pressure and applies Archimedes' force to
    bodies in closed form. To test the pressure of the cut cells, gravity is a force on the fluid
    around the fixed bodies; the free bodies have the solver's own gravity."""
    grid, gravity = (SLAB, GRAVITY) if name == "slab" else (BOX, TILTED)
    still, force, torque = still_around_fixed(grid, gravity, steps)
    floating, drift = still_around_free(grid, gravity, steps)
    return {
        f"max|u| / (g dt), fixed bodies, {name}": still,
        f"force on a body / Archimedes' - 1, {name}": force,
        f"torque about the centroid / (force size), {name}": torque,
        f"max|u| / (g dt), neutral free bodies, {name}": floating,
        f"velocity of a free body / (g dt), {name}": drift,
    }

"""Implicit viscosity: analytic flows, and what fluid and bodies give each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from flowborne import Array, Faces, Grid
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.viscous_solve import TOLERANCE, ViscousSystem, walls_of
from flowborne.fluid.ghosts import edge
from flowborne.fluid.viscosity import OpenParts, assemble_viscosity
from flowborne.kernels.viscosity import UNKNOWN
from flowborne.solvers.conjugate_gradients import spread
from flowborne.solvers.mobility import DenseAnswer
from flowborne.worlds import Boundaries, BoundaryNoSlip, cut_by_bodies, faces_of, make_world
from flowborne_validation.worlds import PERIODIC, RING, mjcf

DENSITY, VISCOSITY = 1.3, 0.7
"""kg/m^3 and Pa s."""

BOX = Boundaries(PERIODIC, PERIODIC, PERIODIC, PERIODIC, PERIODIC, PERIODIC)
SQUARE = Grid.slab(32, 32, 1.0 / 32, (0.0, 0.0))
CUBE = Grid((16, 16, 16), 1.0 / 16, (0.0, 0.0, 0.0))

DISC = (
    '<body name="{name}" pos="{x} {y} {z}"><freejoint/><geom type="sphere" size="{size}"/></body>'
)
BOX_TURNED = (
    '<body name="{name}" pos="{x} {y} {z}" euler="0 0 {turn}"><freejoint/>'
    '<geom type="box" size="{size} {half} {size}"/></body>'
)
CENTRES = np.array([[0.37, 0.41, 0.44], [0.71, 0.68, 0.58]])
RADII = np.array([0.17, 0.11])
"""m, of two discs or balls."""


@dataclass
class Case:
    """A viscous system and what it was made of; body 0 is the world."""

    grid: Grid
    cut: Geometry
    system: ViscousSystem

    def mass(self) -> Faces:
        """Mass of the unknown faces, kg."""
        masses = self.grid.zeros_faces()
        for axis, part in zip(self.grid.axes, self.system.systems, strict=True):
            masses[axis][:] = np.where(part.kind == UNKNOWN, part.mass * self.system.dt, 0.0)
        return masses

    def places(self, axis: int) -> Array:
        """(3, ...) where the velocity of each face across `axis` is: the centre of its open part,
        m."""
        places = np.array(np.meshgrid(*self.grid.face_coordinates(axis), indexing="ij"))
        places[[d for d in range(3) if d != axis]] += self.system.systems[axis].centre
        return places

    def of(self, field: object) -> Faces:
        """A velocity field (x, y, z) -> (u, v, w) on the faces."""
        velocity = self.grid.zeros_faces()
        for axis in self.grid.axes:
            velocity[axis][:] = field(*self.places(axis))[axis]  # type: ignore[operator]
        return velocity

    def momentum(self, velocity: Faces) -> Array:
        """(3,) N s."""
        return np.array([float((m * u).sum()) for m, u in zip(self.mass(), velocity, strict=True)])


def masses_of(opened: Faces, grid: Grid, sides: Boundaries) -> Faces:
    """Density a V of every face, half of it on the sides of the domain."""
    masses = faces_of([DENSITY * grid.cell_volume * o for o in opened])
    for axis, mass in enumerate(masses):
        for end in () if sides.periodic()[axis] else (0, -1):
            mass[edge(axis, end)] *= 0.5
    return masses


def case_of(
    grid: Grid,
    *bodies: str,
    boundaries: Boundaries,
    dt: float,
    mobility: Array | None = None,
    viscosity: float = VISCOSITY,
) -> Case:
    """Bodies (MJCF elements) that answer with `mobility`; by default they do not yield."""
    world = make_world(mjcf(*bodies), grid, boundaries=boundaries)
    cut = cut_by_bodies(world)
    still = grid.zeros_faces()
    masses = masses_of(cut.open, grid, boundaries)
    parts = assemble_viscosity(
        OpenParts(cut.distance, cut.crossings, cut.open, cut.volume),
        still,
        masses,
        grid,
        boundaries,
        viscosity,
        dt,
        0.0,
    )
    size = 6 * world.setup.solid.nbody
    mobility = np.zeros((size, size)) if mobility is None else mobility
    system = ViscousSystem(
        parts,
        walls_of(parts, cut, grid),
        size,
        size // 6,
        lambda drag: DenseAnswer(mobility, np.asarray(drag)),
        grid,
        boundaries,
        dt,
    )
    return Case(grid, cut, system)


def round_bodies(grid: Grid, shape: str = DISC) -> list[str]:
    """MJCF of the two discs or balls, or of boxes there that are turned by 0.2 and 0."""
    places = CENTRES * [1.0, 1.0, 0.0 if grid.is_slab else 1.0]
    return [
        shape.format(name=f"disc{n}", x=x, y=y, z=z, size=r, half=0.6 * r, turn=0.2 * (1 - n))
        for n, ((x, y, z), r) in enumerate(zip(places, RADII, strict=True))
    ]


def free(grid: Grid, density: float) -> Array:
    """M of the two discs or balls of this density when they are free, twists about the origin."""
    mobility = np.zeros((18, 18))
    for n, (centre, radius) in enumerate(zip(CENTRES, RADII, strict=True)):
        if grid.is_slab:
            mass = density * np.pi * radius**2
            parts = np.array([mass, mass, np.inf, np.inf, np.inf, 0.5 * mass * radius**2])
            centre = centre * [1.0, 1.0, 0.0]
        else:
            mass = density * 4.0 / 3.0 * np.pi * radius**3
            parts = np.repeat([mass, 0.4 * mass * radius**2], 3)
        motion = np.eye(6)
        motion[:3, 3:] = np.cross(centre, np.eye(3)).T
        part = slice(6 * n + 6, 6 * n + 12)
        mobility[part, part] = motion @ np.diag(1.0 / parts) @ motion.T
    return mobility


def noise(grid: Grid, seed: int = 0) -> Faces:
    """Random velocity; periodic ends agree."""
    random = np.random.default_rng(seed)
    velocity = grid.zeros_faces()
    for axis in grid.axes:
        values = random.standard_normal(velocity[axis].shape)
        ends = np.moveaxis(values, axis, 0)
        ends[-1] = ends[0]
        velocity[axis][:] = values
    return velocity


@pytest.mark.parametrize("along", [0, 1, 2])
def test_shear_wave_decays_at_second_order_to_the_analytic_rate(along: int) -> None:
    """The factor by which a wave of one component decays in a time, with dt as h^2."""
    across = (along + 1) % 3
    cells, errors = (8, 16, 32), []
    nu, duration = VISCOSITY / DENSITY, 0.02
    for n in cells:
        shape = [2, 2, 2]
        shape[across] = n
        grid = Grid((shape[0], shape[1], shape[2]), 1.0 / n)
        steps = n * n // 16
        case = case_of(grid, boundaries=BOX, dt=duration / steps)
        velocity = grid.zeros_faces()
        wave = np.sin(2.0 * np.pi * grid.face_coordinates(along)[across])
        velocity[along][:] = np.expand_dims(wave, tuple({0, 1, 2} - {across}))
        first = velocity[along].copy()
        for _ in range(steps):
            velocity, _, converged = case.system.solve(velocity, np.zeros(6), 1e-12)
            assert converged
        factor = float((velocity[along] * first).sum() / (first**2).sum())
        np.testing.assert_allclose(velocity[along], factor * first, atol=1e-9)
        errors.append(abs(factor - np.exp(-nu * (2.0 * np.pi) ** 2 * duration)))
    slope = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert abs(slope - 2.0) < 0.1, f"measured order {slope:.3f}"
    assert errors[-1] < 2e-3


PLATES = [
    '<body pos="0.5 {low} 0"><geom type="box" size="2 0.2 1"/></body>'.replace("{low}", "-0.039"),
    '<body pos="0.5 {high} 0"><geom type="box" size="2 0.2 1"/></body>'.replace("{high}", "1.063"),
]
BOTTOM, TOP = 0.161, 0.863
"""m: where two plates that reach across a periodic box face each other."""


def test_couette_flow_between_plates_and_its_wall_force_are_exact() -> None:
    sides = Boundaries(PERIODIC, PERIODIC)
    case = case_of(SQUARE, *PLATES, boundaries=sides, dt=1e7)
    twist = np.zeros(18)
    twist[12] = 2.0
    velocity, impulse, converged = case.system.solve(SQUARE.zeros_faces(), twist, 1e-13)
    assert converged
    stress = VISCOSITY * 2.0 / (TOP - BOTTOM)
    force = impulse.reshape(3, 6)[:, 0] / 1e7
    np.testing.assert_allclose(force, [0.0, stress, -stress], atol=1e-8)
    torque = impulse.reshape(3, 6)[:, 5] / 1e7
    np.testing.assert_allclose(torque, [0.0, -BOTTOM * stress, TOP * stress], atol=1e-8)
    y = case.places(0)[1, 5, :, 0]
    between = case.cut.open[0][5, :, 0] > 0.0
    exact = 2.0 * (y[between] - BOTTOM) / (TOP - BOTTOM)
    np.testing.assert_allclose(velocity[0][5, between, 0], exact, atol=1e-7)


def test_skin_that_slips_over_its_body_drags_as_a_body_that_moves() -> None:
    """The same flow and the same forces, whether the upper plate moves or its skin alone does; with
    plates that yield, or not."""
    sides = Boundaries(PERIODIC, PERIODIC)
    for yielding in (0.0, 0.5):
        mobility = yielding * np.diag(np.tile([1.0, 1.0, 0.0, 0.0, 0.0, 0.0], 3))
        case = case_of(SQUARE, *PLATES, boundaries=sides, dt=0.3, mobility=mobility)
        twist, speed = np.zeros(18), np.array([2.0, -0.3, 0.0])
        twist[12:15] = speed
        walls = case.system.walls
        slip = (walls.body == 2) * (walls.across @ speed)
        start = noise(SQUARE)
        moved, pushed, _ = case.system.solve(start, twist, 1e-13)
        blown, dragged, converged = case.system.solve(start, np.zeros(18), 1e-13, slip)
        assert converged
        for one, other in zip(moved, blown, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11)
        np.testing.assert_allclose(pushed, dragged, atol=1e-11)


def driven(case: Case, drive: float, bodies: int) -> tuple[Faces, Array]:
    """Velocity and impulse of the last step of a flow along x that `drive` (Pa/m) makes steady."""
    velocity = case.grid.zeros_faces()
    for _ in range(12):
        velocity[0][:] += case.system.dt * drive / DENSITY
        velocity, impulse, converged = case.system.solve(velocity, np.zeros(6 * bodies), 1e-13)
        assert converged
    return velocity, impulse


def test_poiseuille_flow_between_plates_pushes_them_with_all_that_drives_it() -> None:
    """The profile is second order; the force of the walls is what drives the flow, exactly."""
    drive, dt = 3.0, 10.0
    errors = []
    for n in (32, 64):
        grid = Grid.slab(n, n, 1.0 / n, (0.0, 0.0))
        case = case_of(grid, *PLATES, boundaries=Boundaries(PERIODIC, PERIODIC), dt=dt)
        velocity, impulse = driven(case, drive, 3)
        force = impulse.reshape(3, 6)[1:, 0].sum() / dt
        assert force == pytest.approx(drive * (TOP - BOTTOM), rel=1e-9)
        y = case.places(0)[1, 5, :, 0]
        inside = case.cut.open[0][5, :, 0] > 0.0
        exact = 0.5 * drive / VISCOSITY * (y - BOTTOM) * (TOP - y)
        errors.append(np.abs(velocity[0][5, :, 0] - exact)[inside].max())
    assert errors[0] < 0.003 * 0.125 * drive / VISCOSITY * (TOP - BOTTOM) ** 2
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1), errors


def test_poiseuille_flow_between_no_slip_sides_is_exact() -> None:
    sides = Boundaries(PERIODIC, PERIODIC, BoundaryNoSlip(), BoundaryNoSlip())
    velocity, _ = driven(case_of(SQUARE, boundaries=sides, dt=10.0), 3.0, 1)
    y = SQUARE.face_coordinates(0)[1]
    np.testing.assert_allclose(velocity[0][5, :, 0], 1.5 / VISCOSITY * y * (1.0 - y), rtol=1e-8)


def test_poiseuille_flow_between_oblique_plates_is_of_second_order() -> None:
    """Plates with a slope of 1/2, which go on in the next box half as high; flow and flux."""
    angle, thick, drive = np.arctan(0.5), 0.06, 3.0
    t, n = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    pitch, first = 0.5 * np.cos(angle), -0.487
    width = pitch - 2.0 * thick
    plates = [
        f'<body pos="0 {first + 0.5 * m} 0" euler="0 0 {angle}">'
        f'<geom type="box" size="4 {thick} 1"/></body>'
        for m in range(4)
    ]
    sides = Boundaries(PERIODIC, PERIODIC, PERIODIC, PERIODIC)
    peak, carried = drive / VISCOSITY * width**2 / 8.0, drive / VISCOSITY * width**3 / 6.0
    errors, fluxes = [], []
    for cells in (16, 32, 64):
        grid = Grid.slab(cells, cells, 1.0 / cells, (0.0, 0.0))
        case = case_of(grid, *plates, boundaries=sides, dt=10.0)
        velocity = grid.zeros_faces()
        for _ in range(6):
            for axis in grid.axes:
                velocity[axis][:] += case.system.dt * drive * t[axis] / DENSITY
            velocity, _, converged = case.system.solve(velocity, np.zeros(30), 1e-12)
            assert converged
        squares = weights = 0.0
        for axis in grid.axes:
            x, y, _ = case.places(axis)
            away = (x * n[0] + (y - first) * n[1]) % pitch - thick
            exact = 0.5 * drive / VISCOSITY * away * (width - away) * t[axis]
            opened = case.cut.open[axis] * (case.system.systems[axis].kind == UNKNOWN)
            squares += float((opened * (velocity[axis] - exact) ** 2).sum())
            weights += float(opened.sum())
        errors.append(np.sqrt(squares / weights) / peak)
        through = grid.spacing * (case.cut.open[0] * velocity[0])[cells // 2].sum()
        fluxes.append(abs(through / carried - 1.0))
    assert errors[0] < 0.03
    assert fluxes[0] < 0.06
    for values in (errors, fluxes):
        slope = -np.polyfit(np.log([16, 32, 64]), np.log(values), 1)[0]
        assert slope > 1.8, f"measured order {slope:.3f}"


@pytest.mark.parametrize("angle", [0.0, 0.2, 0.5, 0.78, 1.3])
def test_linear_shear_along_an_oblique_wall_stays(angle: float) -> None:
    """A wall through the middle of the box, the flow along it proportional to the distance."""
    t, n = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    wall = np.array([0.5, 0.5]) + 0.011 * n
    low = wall - 0.3 * n
    plate = (
        f'<body pos="{low[0]} {low[1]} 0" euler="0 0 {angle}">'
        '<geom type="box" size="2 0.3 1"/></body>'
    )
    h = SQUARE.spacing
    case = case_of(SQUARE, plate, boundaries=Boundaries(), dt=1e-3 * DENSITY * h**2 / VISCOSITY)

    def shear(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        away = np.maximum((x - wall[0]) * n[0] + (y - wall[1]) * n[1], 0.0)
        return away * t[0], away * t[1], 0.0 * z

    start = case.of(shear)
    after, _, converged = case.system.solve(start, np.zeros(12), 1e-13)
    assert converged
    assert max(part.wall.size for part in case.system.systems) > 20
    for axis, part in zip(SQUARE.axes, case.system.systems, strict=True):
        x, y, _ = case.places(axis)
        inner = (np.abs(x - 0.5) < 0.3) & (np.abs(y - 0.5) < 0.3) & (part.kind == UNKNOWN)
        np.testing.assert_allclose(after[axis][inner], start[axis][inner], atol=1e-10)


@pytest.mark.parametrize("shape", [DISC, BOX_TURNED], ids=["round", "square"])
def test_rigid_rotation_of_fluid_and_body_stays(shape: str) -> None:
    """The wall's friction at its points and the couple of the body's own rotation even out."""
    x0, y0 = CENTRES[0, :2]
    h = SQUARE.spacing
    dt = 1e-3 * DENSITY * h**2 / VISCOSITY
    body = round_bodies(SQUARE, shape)[0]
    case = case_of(SQUARE, body, boundaries=Boundaries(), dt=dt)
    twist = np.zeros(12)
    twist[6:] = [y0, -x0, 0.0, 0.0, 0.0, 1.0]
    start = case.of(lambda x, y, z: (y0 - y, x - x0, 0.0 * z))
    after, impulse, converged = case.system.solve(start, twist, 1e-13)
    assert converged
    for axis, part in zip(SQUARE.axes, case.system.systems, strict=True):
        x, y, _ = case.places(axis)
        inner = (np.hypot(x - x0, y - y0) < 0.3) & (part.kind == UNKNOWN)
        np.testing.assert_allclose(after[axis][inner], start[axis][inner], atol=1e-10)
    force = impulse[6:8] / dt
    torque = impulse[11] / dt - x0 * force[1] + y0 * force[0]
    assert np.abs(force).max() < 1e-9
    assert abs(torque) < 1e-9
    couple = case.system.couples[1, 2, 2]
    area = np.pi * 0.17**2 if shape == DISC else 4.0 * 0.6 * 0.17**2
    assert couple == pytest.approx(2.0 * VISCOSITY * area, rel=0.1)


@pytest.mark.parametrize("grid", [SQUARE, CUBE], ids=["slab", "box"])
@pytest.mark.parametrize("density", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("stiff", [0.1, 1e3])
@pytest.mark.parametrize("shape", [DISC, BOX_TURNED], ids=["round", "square"])
def test_bodies_get_what_the_fluid_loses(
    grid: Grid, density: float, stiff: float, shape: str
) -> None:
    """Linear momentum in a periodic box; stiff is mu dt / (rho h^2)."""
    dt = stiff * DENSITY * grid.spacing**2 / VISCOSITY
    sides = RING if grid.is_slab else BOX
    mobility = free(grid, density)
    case = case_of(grid, *round_bodies(grid, shape), boundaries=sides, dt=dt, mobility=mobility)
    assert (case.system.corner_faces.size > 0) == (shape == BOX_TURNED)
    start, twist = noise(grid), np.zeros(18)
    twist[6:] = free(grid, 1.0)[6:, 6:] @ np.full(12, 1e-3)
    after, impulse, converged = case.system.solve(start, twist, TOLERANCE)
    assert converged
    gained = impulse.reshape(3, 6)[:, :3].sum(axis=0)
    lost = case.momentum(start) - case.momentum(after)
    walls = case.system.walls
    moved = twist + mobility @ impulse
    ends = np.concatenate([after[axis].ravel() for axis in grid.axes])[walls.index]
    rigid = case.system.at_walls(moved)
    exchanged = dt * float(np.abs(walls.weight @ (ends - rigid)).sum())
    bound = exchanged * (1e-10 if shape == DISC else 1e-9)  # rounding of the start, 1e3 times that
    np.testing.assert_allclose(gained, lost, rtol=0.0, atol=bound)


@pytest.mark.parametrize("grid", [SQUARE, CUBE], ids=["slab", "box"])
@pytest.mark.parametrize("density", [1e-3, 1e3])
@pytest.mark.parametrize("shape", [DISC, BOX_TURNED], ids=["round", "square"])
def test_matrix_is_symmetric_and_positive_definite(grid: Grid, density: float, shape: str) -> None:
    sides = RING if grid.is_slab else BOX
    mobility = free(grid, density)
    case = case_of(grid, *round_bodies(grid, shape), boundaries=sides, dt=10.0, mobility=mobility)
    known = case.system.scale == 0.0
    random = np.random.default_rng(2)
    for _ in range(4):
        x, y = spread(known.size), spread(known.size)
        for rows in (x, y):
            rows.ravel()[: known.size] = np.where(known, 0.0, random.standard_normal(known.size))
        ax, ay = (case.system.apply(rows).copy() for rows in (x, y))
        xy, yx = float((y * ax).sum()), float((x * ay).sum())
        assert xy == pytest.approx(yx, abs=1e-12 * np.linalg.norm(x) * np.linalg.norm(y))
        assert float((x * ax).sum()) > 0.0


@pytest.mark.parametrize("density", [1e-3, 1.0, 10.0])
def test_light_free_bodies_and_fluid_go_together_however_long_the_step(density: float) -> None:
    """After a step without end all moves with the mean velocity."""
    dt = 1e5
    mobility = free(SQUARE, density)
    case = case_of(SQUARE, *round_bodies(SQUARE), boundaries=RING, dt=dt, mobility=mobility)
    start, twist = noise(SQUARE), np.zeros(18)
    start[0][:] += 1.0
    twist[6:] = [3.0, -2.0, 0, 0, 0, 0, -1.0, 1.0, 0, 0, 0, 0]
    after, impulse, converged = case.system.solve(start, twist, TOLERANCE)
    assert converged
    masses = density * np.pi * RADII**2
    carried = masses @ twist.reshape(3, 6)[1:, :2]
    fluid = np.array([m.sum() for m in case.mass()])[:2]
    mean = (case.momentum(start)[:2] + carried) / (fluid + masses.sum())
    for axis, part in zip(SQUARE.axes, case.system.systems, strict=True):
        np.testing.assert_allclose(after[axis][part.kind == UNKNOWN], mean[axis], atol=1e-4)
    moved = (twist + mobility @ impulse).reshape(3, 6)[1:]
    np.testing.assert_allclose(moved[:, 5], 0.0, atol=1e-4)
    np.testing.assert_allclose(moved[:, :2], np.tile(mean, (2, 1)), atol=1e-4)


def test_bodies_answer_friction_as_their_equation_of_motion_says() -> None:
    """J = J0 - D (M J) for bodies of which some motions are held."""
    random = np.random.default_rng(3)
    root, pull = random.standard_normal((2, 6, 6))
    root[:, 4:] = 0.0
    mobility, drag, push = root @ root.T, pull @ pull.T, random.standard_normal(6)
    answer = DenseAnswer(mobility, drag)
    change, impulse = answer.to(push)
    np.testing.assert_allclose(impulse, push - drag @ change, atol=1e-12)
    np.testing.assert_allclose(change, mobility @ impulse, atol=1e-12)
    np.testing.assert_allclose(answer.change(push), change, atol=1e-12)
    assert not DenseAnswer(np.zeros((6, 6)), drag).yields

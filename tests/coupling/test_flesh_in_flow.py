"""Flesh and fluid in one solve, against rigid bodies of the same shape and against conservation."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flowborne.coupling.cut import cut_by_bodies
from flowborne.coupling.operators import add_flux, boundary_velocity, leak_proof, pressure_push
from flowborne.coupling.report import Outcome
from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.kinds import BoundaryOpen, BoundaryPeriodic
from flowborne.kernels.arrays import Array
from flowborne.solids.dynamics import kinematics
from flowborne.solids.flesh import inversion
from flowborne.solids.model import SolidModel
from flowborne.solids.tissue.growth import Law, Tissue, add_flesh
from flowborne.solids.trajectories import JointCommand
from flowborne_validation.flesh_bars import bar_mesh

SIDE = 0.42
GRAVITY = (0.0, 0.0, -9.81)
ROOM = Grid((16, 16, 16), 1.0 / 16.0, (-0.5, -0.5, -0.5))
DT = 0.01


def cube(young: float, density: float, gravity: tuple[float, float, float] = GRAVITY) -> SolidModel:
    """A cube of flesh that nothing holds."""
    points, elements = bar_mesh((5, 5, 5), (SIDE, SIDE, SIDE))
    points[:, 0] -= 0.5 * SIDE
    spec = mujoco.MjSpec()
    tissue = Tissue(young, 0.3, density, damping=0.02, law=Law.STABLE_NEO_HOOKEAN)
    grown = add_flesh(spec, "cube", points, elements, tissue, [""] * len(points))
    return SolidModel.with_flesh(spec, [grown], gravity=gravity)


def rigid_cube(density: float) -> SolidModel:
    half = 0.5 * SIDE
    return SolidModel.from_string(
        f'<mujoco><worldbody><body><freejoint/><geom type="box" size="{half} {half} {half}" '
        f'density="{density}"/></body></worldbody></mujoco>',
        gravity=GRAVITY,
    )


LEG = """<mujoco><default><geom contype="0" conaffinity="0"/></default><worldbody>
<body name="upper"><freejoint/><geom type="capsule" fromto="-.14 0 0 -.02 0 0" size=".03"/>
<body name="lower" pos="0 0 0"><joint name="knee" axis="0 1 0"/>
<geom type="capsule" fromto=".02 0 0 .14 0 0" size=".03"/></body></body></worldbody></mujoco>"""


def leg(
    young: float = 2e4, gravity: tuple[float, float, float] = (0.0, 0.0, 0.0), length: float = 0.48
) -> SolidModel:
    """Two bones with a joint, inside one bar of flesh; or partly, where that is shorter (m)."""
    points, elements = bar_mesh((8, 3, 3), (length, 0.18, 0.18))
    points[:, 0] -= 0.24
    inner = (np.abs(points[:, 1]) < 0.05) & (np.abs(points[:, 2]) < 0.05)
    holders = [
        ("lower" if x > 0.0 else "upper") if h and 0.03 < abs(x) < 0.16 else ""
        for x, h in zip(points[:, 0], inner, strict=True)
    ]
    spec = mujoco.MjSpec.from_string(LEG)
    tissue = Tissue(young, 0.3, 1000.0, damping=0.01, law=Law.STABLE_NEO_HOOKEAN)
    grown = add_flesh(spec, "leg", points, elements, tissue, holders)
    return SolidModel.with_flesh(spec, [grown], gravity=gravity)


def mean_velocity(world: World) -> Array:
    """(3,) velocity of the centre of mass, m/s."""
    masses = world.setup.solid.body_mass[1:]
    return np.asarray(masses @ world.solid.v.reshape(-1, 3) / masses.sum())


@pytest.mark.parametrize("viscosity", [0.0, 5.0])
def test_stiff_flesh_falls_as_a_rigid_body_does(viscosity: float) -> None:
    fluid = Fluid(ROOM, 1000.0, viscosity)
    stiff = World.at_rest(Setup(cube(1e7, 1200.0), fluid))
    rigid = World.at_rest(Setup(rigid_cube(1200.0), fluid))
    for _ in range(12):
        for world in (stiff, rigid):
            report = step(world, DT)
            assert report.outcome is Outcome.DONE
            assert report.momentum_exchange_error < 1e-14
            assert report.momentum_budget_error < 1e-13
    assert mean_velocity(stiff)[2] == pytest.approx(rigid.solid.v[2], rel=2e-3)
    assert stiff.solid.v[2] < -0.05


def test_flesh_as_heavy_as_water_hangs_in_it() -> None:
    """Archimedes: its own weight of water bears it, and it is not pressed out of shape."""
    world = World.at_rest(Setup(cube(1e5, 1000.0), Fluid(ROOM, 1000.0)))
    start = world.solid.q.copy()
    for _ in range(20):
        report = step(world, DT)
    assert report.buoyancy_wrench[0, 2] == pytest.approx(1000.0 * 9.81 * SIDE**3, rel=1e-3)
    assert abs(mean_velocity(world)[2]) < 1e-2 * 9.81 * 20 * DT
    assert np.abs(world.solid.q - start).max() < 0.02 * SIDE


def test_soft_flesh_of_a_hundredth_of_the_density_rises_and_stays_whole() -> None:
    world = World.at_rest(
        Setup(cube(2e4, 10.0), Fluid(ROOM, 1000.0, boundaries=Boundaries(z_max=BoundaryOpen())))
    )
    for _ in range(40):
        report = step(world, 0.2 * DT)
        assert report.outcome is Outcome.DONE
        assert report.solver_iterations < 200
    flesh = world.setup.solid.flesh
    assert flesh is not None
    assert inversion(flesh, world.solid.q) is None
    assert mean_velocity(world)[2] > 0.1


def test_flux_and_push_are_transposes_and_uniform_pressure_does_nothing() -> None:
    world = World.at_rest(Setup(leg(), Fluid(ROOM, 1000.0)))
    world.solid.q[:3] += 0.013
    cut, rng = cut_by_bodies(world), np.random.default_rng(1)
    size = 6 * 3 + cut.skins.vertices.size
    pressure, moving = rng.normal(size=ROOM.shape), rng.normal(size=size)
    flux = np.zeros(ROOM.shape)
    add_flux(flux, cut, moving)
    push = pressure_push(cut, pressure, size)
    assert push @ moving == pytest.approx(float((pressure * flux).sum()), rel=1e-12)
    assert not push[:18].any()  # the bones are covered
    even = pressure_push(cut, np.ones(ROOM.shape), size)[18:].reshape(-1, 3)
    assert np.abs(even.sum(axis=0)).max() < 1e-12 * np.abs(even).sum()


def test_fluid_that_moves_with_flesh_is_not_disturbed() -> None:
    model = leg()
    world = World.at_rest(Setup(model, Fluid(ROOM, 1000.0)))
    world.solid.v[:3] = velocity = np.array([0.3, -0.7, 0.4])
    world.solid.v[7:] = np.tile(velocity, (model.nv - 7) // 3)
    cut = cut_by_bodies(world)
    moving = boundary_velocity(kinematics(model, world.solid.q), world.solid.v)
    field = [np.full(ROOM.face_shape(axis), velocity[axis]) for axis in range(3)]
    carried = leak_proof((field[0], field[1], field[2]), cut, moving, ROOM)
    for axis in ROOM.axes:
        deep = np.zeros(ROOM.face_shape(axis), bool)  # farther inside than the skin is known
        entries = cut.closed.axis[-len(cut.closed.corner) :] == axis
        deep.reshape(-1)[cut.closed.face[-len(cut.closed.corner) :][entries]] = (
            cut.closed.weight[entries].sum(axis=1) == 0.0
        )
        np.testing.assert_allclose(carried[axis][~deep], velocity[axis], rtol=1e-12)


def test_a_driven_joint_keeps_its_promise_and_all_momentum_stays() -> None:
    """A kicking leg in a periodic box: creature and fluid together keep what they had."""
    sides = Boundaries(*(BoundaryPeriodic() for _ in range(6)))
    world = World.at_rest(Setup(leg(), Fluid(ROOM, 1000.0, boundaries=sides)))
    knee = world.setup.solid.dofs_of("knee")
    angle = 0.0
    for n in range(15):
        command = JointCommand.none(world.setup.solid.nv)
        pace = 2.0 * np.cos(20.0 * n * DT)
        command.set(knee, pace, pace)
        report = step(world, DT, command)
        angle += DT * pace
        assert report.outcome is Outcome.DONE
        assert world.solid.q[7] == pytest.approx(angle, abs=1e-12)
        assert world.solid.v[knee[0]] == pytest.approx(pace, abs=1e-12)
        assert report.actuator[knee[0]] != 0.0
        together = report.momentum_solid + report.momentum_fluid
        assert np.abs(together).max() < 1e-9 * np.abs(report.pressure_wrench[:, :3]).sum() * DT


def test_flesh_goes_along_when_a_bone_jumps() -> None:
    """A bone that is told to move by more than its flesh is thick takes the flesh with it."""
    world = World.at_rest(Setup(leg(), Fluid(ROOM, 1000.0)))
    command = JointCommand.none(world.setup.solid.nv)
    command.set(np.arange(6), 0.0, 0.0)
    command.set(world.setup.solid.dofs_of("knee"), 0.9 / DT, 0.0)
    step(world, DT, command)
    flesh = world.setup.solid.flesh
    assert flesh is not None
    assert inversion(flesh, world.solid.q) is None
    assert flesh.volume_ratios(world.solid.q).min() > 0.2


def test_flesh_in_a_fluid_that_does_not_feel_it_is_left_alone_by_it() -> None:
    world = World.at_rest(Setup(leg(), Fluid(ROOM, 1000.0, one_way=True)))
    world.solid.v[world.setup.solid.dofs_of("knee")] = 1.0
    report = step(world, DT)
    assert report.outcome is Outcome.DONE
    assert not report.pressure_wrench.any()
    assert world.fluid is not None
    assert not any(u.any() for u in world.fluid.velocity)


@pytest.mark.parametrize("thickness", [0.2, 1.0])
def test_a_thin_plate_of_flesh_lets_nothing_through_at_any_angle(thickness: float) -> None:
    """Every face between cells on two sides of the plate's mid-plane is closed."""
    h = ROOM.spacing
    points, elements = bar_mesh((8, 8, 1), (0.6, 0.6, thickness * h))
    points[:, 0] -= 0.3
    x = np.stack(np.meshgrid(*ROOM.cell_coordinates(), indexing="ij"), axis=-1)
    for angles in np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, (12, 3)):
        turn = Rotation.from_euler("xyz", angles).as_matrix()
        spec = mujoco.MjSpec()
        grown = add_flesh(
            spec, "plate", points @ turn.T, elements, Tissue(1e5, 0.3, 1000.0), [""] * 162
        )
        plate = World.at_rest(Setup(SolidModel.with_flesh(spec, [grown]), Fluid(ROOM, 1000.0)))
        opened = cut_by_bodies(plate).open
        place = x @ turn
        for axis in range(3):
            low, high = np.delete(place, -1, axis), np.delete(place, 0, axis)
            between = low[..., 2] * high[..., 2] < 0.0
            between &= (np.abs(0.5 * (low + high)[..., :2]) < 0.3 - 0.75 * h).all(axis=-1)
            inner = np.delete(np.delete(opened[axis], -1, axis), 0, axis)
            assert not inner[between].any(), f"turned by {np.degrees(angles).round()}"

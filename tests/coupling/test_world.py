"""A world is all the state there is: copies, saved states and trials agree bit for bit."""

from __future__ import annotations

import io
import pickle

import numpy as np
import pytest

import flowborne
from flowborne.coupling import cut
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.step import step
from flowborne.coupling.world import Setup, World
from flowborne.sim.frame import Snapshot
from flowborne.sim.simulation import Simulation
from flowborne.solids.dynamics import Kinematics
from flowborne_validation.worlds import hold_all

SMALL = {"domain.resolution": "32", "time.frames": "4"}


def bits(world: World) -> dict[str, bytes]:
    return {name: values.tobytes() for name, values in world.arrays().items()}


def swimming(scene: str = "ns-chain-2", **options: object) -> Simulation:
    return Simulation(flowborne.load_scene(scene, SMALL), **options)


@pytest.fixture
def simulation() -> Simulation:
    """Two frames into a chain of two controlled joints in a flow."""
    simulation = swimming(workers=1)
    for _ in range(2):
        simulation.advance_frame()
    return simulation


def test_a_trial_leaves_the_world_untouched(simulation: Simulation) -> None:
    world, controller = simulation.world, simulation.controller
    assert controller is not None
    before = bits(world)
    trials = controller.trials(world, simulation._step)
    values = trials.values(np.array([[0.1, 0.0], [0.0, -0.2], [0.3, 0.3]]))
    assert np.unique(values).size == 3
    assert bits(world) == before


def test_what_is_kept_while_bodies_stand_changes_nothing(simulation: Simulation) -> None:
    """A copy keeps none of it, and shares none of it."""
    command, world = hold_all(simulation.world.setup.solid.nv), simulation.world.copy()
    matrices = []
    for _ in range(3):
        other = world.copy()
        for each in (world, other):
            step(each, 0.02, command)
        assert bits(other) == bits(world)
        assert world.still is not None
        assert other.still is not None
        assert other.still[2] is not world.still[2]
        matrices.append(world.still[2])
    assert matrices[0] is matrices[1] is matrices[2]
    assert pickle.loads(pickle.dumps(world)).still is None


def test_a_decision_changes_nothing_but_the_controllers_memory(simulation: Simulation) -> None:
    world, controller = simulation.world, simulation.controller
    assert controller is not None
    before = bits(world)
    decision = controller.decide(world, simulation.frame_time, simulation._step)
    assert decision.evaluations == 4
    after = bits(world)
    changed = {name for name in after if after[name] != before[name]}
    assert changed
    assert all(name.startswith("memory/") for name in changed)


def test_a_copy_shares_no_memory_and_steps_alone(simulation: Simulation) -> None:
    world = simulation.world
    twin, before = world.copy(), bits(world)
    for name, values in twin.arrays().items():
        assert not np.shares_memory(values, world.arrays()[name]), name
    step(twin, 0.01)
    assert bits(world) == before
    assert twin.steps == world.steps + 1


SEVERAL = ["ns-chain-2", "flyer-base", "eel-free", "eel-sea", "flyer-flesh"]


@pytest.mark.parametrize("scene", SEVERAL)
def test_a_frame_leaves_the_world_before_it(scene: str) -> None:
    """Steps share with it what they replace: it is what is left when the frame fails. From the
    third frame on half of the last pressure acts."""
    with swimming(scene, workers=1) as simulation:
        for _ in range(4):
            world, before = simulation.world, bits(simulation.world)
            simulation.advance_frame()
            assert bits(world) == before
            assert bits(simulation.world) != before


@pytest.mark.parametrize("scene", ["ns-chain-2", "ns-block-effort"])
def test_two_runs_are_the_same_bit_for_bit_with_any_number_of_workers(scene: str) -> None:
    found = []
    for workers in (1, 1, 2, 3):
        with swimming(scene, workers=workers) as simulation:
            for _ in range(3):
                simulation.advance_frame()
            measured = simulation.measure()
            found.append((bits(simulation.world), np.array(list(measured.values())).tobytes()))
    assert all(other == found[0] for other in found[1:])


def test_a_saved_state_goes_on_bit_for_bit(simulation: Simulation) -> None:
    """Through a file, in the middle of a run, with the dye and the controller's memory."""
    file = io.BytesIO()
    np.savez(file, **simulation.world.arrays())
    file.seek(0)
    with np.load(file) as loaded:
        arrays = {name: loaded[name] for name in loaded.files}
    with swimming(workers=1) as later:
        restored = World.from_arrays(later.world.setup, arrays)
        assert bits(restored) == bits(simulation.world)
        later.restore(Snapshot(restored, simulation.frame, None))
        for _ in range(2):
            later.advance_frame()
            simulation.advance_frame()
        assert bits(later.world) == bits(simulation.world)


def test_a_state_that_lacks_a_part_is_refused(simulation: Simulation) -> None:
    arrays = simulation.world.arrays()
    for name in ("clock", "solid/v", "fluid/pressure", "fluid/velocity_change_y"):
        rest = {other: values for other, values in arrays.items() if other != name}
        with pytest.raises(KeyError):
            World.from_arrays(simulation.world.setup, rest)


def test_the_grid_is_cut_once_for_each_pose(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a step, by the next one, and by what looks at the state between them."""
    poses = []
    cut_at = cut.cut_at

    def counted(setup: Setup, pose: Kinematics) -> Geometry:
        poses.append(pose)
        return cut_at(setup, pose)

    monkeypatch.setattr(cut, "cut_at", counted)
    with swimming(workers=1) as simulation:
        world = simulation.world.copy()
    world.solid.v[:] = 0.1
    for _ in range(3):
        step(world, 0.01)
        cut.cut_by_bodies(world)
        cut.cut_by_bodies(world.copy())
    assert len(poses) == 4
    world.solid.q[0] += 0.1
    cut.cut_by_bodies(world)
    assert len(poses) == 5

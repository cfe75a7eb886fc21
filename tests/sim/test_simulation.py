from dataclasses import replace

import numpy as np
import pytest

import flowborne
from flowborne.base.errors import SceneError
from flowborne.coupling.report import Outcome
from flowborne.sim import simulation as module
from flowborne.sim.simulation import BlowUpError, Simulation, default_workers


def state_of(world):
    return {name: values.tobytes() for name, values in world.arrays().items()}


def run_frames(scene, frames, **options):
    with Simulation(scene, **options) as simulation:
        for _ in range(frames):
            simulation.advance_frame()
        return state_of(simulation.world), simulation.measure()


@pytest.mark.usefixtures("shared_processes")
def test_numbers_are_the_same_twice_and_with_any_workers_and_executor(small_scene):
    reference, measured = run_frames(small_scene, 6, workers=1)
    for options in ({"workers": 1}, {"workers": 2}, {"executor": "processes", "workers": 2}):
        state, again = run_frames(small_scene, 6, **options)
        assert state == reference, options
        np.testing.assert_equal(again, measured)


def test_a_frame_advances_the_clock_and_turns_towards_least_drag(small_scene):
    with flowborne.Simulation(small_scene) as simulation:
        before = simulation.measure()
        for frame in range(1, 4):
            report = simulation.advance_frame()
            assert (report.frame, simulation.frame) == (frame, frame)
            assert report.time == simulation.time == pytest.approx(frame / 24)
            assert len(report.steps) == 2
        after = simulation.measure()
    step = np.radians(60.0) / 24
    assert after["angle_hinge_rad"] == pytest.approx(before["angle_hinge_rad"] - 3 * step, abs=1e-9)
    assert after["target_hinge_rad"] == pytest.approx(after["angle_hinge_rad"], abs=1e-8)
    assert report.steps[-1].fluid_wrench()[1, 0] == pytest.approx(
        after["measured_wind-drag"], rel=1e-9
    )
    assert after["drag_N"] == pytest.approx(
        np.mean([one.fluid_wrench()[1, 0] for one in report.steps]), rel=1e-9
    )
    assert set(before) == set(after)
    assert np.isnan(before["objective"])


def test_seconds_by_part_do_not_exceed_the_total(small_scene):
    with Simulation(small_scene) as simulation:
        seconds = dict(simulation.advance_frame().seconds)
    total = seconds.pop("total")
    assert 0.0 < seconds["control"] < total
    assert sum(seconds.values()) <= total


def test_going_on_from_a_copy_of_the_state_gives_the_same_numbers(small_scene):
    with Simulation(small_scene) as whole, Simulation(small_scene) as later:
        for _ in range(3):
            whole.advance_frame()
        later.restore(whole.snapshot())
        for _ in range(3):
            whole.advance_frame()
            later.advance_frame()
        assert state_of(later.world) == state_of(whole.world)
        assert later.measure() == whole.measure()


class Failing:
    """The physics step, but for one: it then does `fail`."""

    def __init__(self, step, at, fail):
        self.step, self.at, self.fail = step, at, fail

    def __call__(self, world, dt, command):
        report = self.step(world, dt, command)
        if world.steps == self.at:
            return self.fail(world, report)
        return report


def lose_a_number(world, report):
    world.solid.v[0] = np.nan
    return report


def spin(world, report):
    world.solid.v[0] = 4.0 / report.dt
    return report


def diverge(world, report):
    outcome = Outcome.PRESSURE_NOT_CONVERGED
    return replace(report, outcome=outcome, residual=0.5, solver_iterations=200)


def stay_viscous(world, report):
    outcome = Outcome.VISCOSITY_NOT_CONVERGED
    return replace(report, outcome=outcome, residual=0.5, solver_iterations=200)


def rattle(world, report):
    return replace(report, outcome=Outcome.NOT_SETTLED, unsettled=np.array([0]))


def creep(world, report):
    return replace(report, outcome=Outcome.NOT_SETTLED)


def lose_an_inverse(world, report):
    raise np.linalg.LinAlgError("3-th leading minor not positive definite")


def stumble(world, report):
    int("no number")


@pytest.mark.parametrize(
    ("fail", "cause"),
    [
        (lose_a_number, "a joint's position or velocity is not a finite number"),
        (spin, r"hinge turns by 4 rad in one step, more than half a turn"),
        (
            diverge,
            r"the pressure solve did not reach its tolerance "
            r"\(relative residual 0.5 after 200 iterations\)$",
        ),
        (stay_viscous, r"the viscous solve did not reach its tolerance$"),
        (rattle, r"contacts, torque limits or Coriolis forces did not settle \(at hinge\)$"),
        (creep, r"contacts, torque limits or Coriolis forces did not settle$"),
        (lose_an_inverse, "3-th leading minor not positive definite"),
        (stumble, r"ValueError: invalid literal .*, in test_simulation.py, line \d+$"),
    ],
)
def test_a_blow_up_names_frame_and_cause_and_leaves_the_last_good_frame(small_scene, fail, cause):
    with Simulation(small_scene, workers=1) as simulation:
        for _ in range(2):
            simulation.advance_frame()
        good = state_of(simulation.world)
        simulation._step = Failing(simulation._step, at=6, fail=fail)
        with pytest.raises(BlowUpError, match=f"frame 3, step 2: .*{cause}") as raised:
            simulation.advance_frame()
        assert raised.value.fault is (fail is stumble)
        assert state_of(simulation.world) == good
        assert simulation.frame == 2


def test_workers_are_as_many_as_trials_but_no_more_than_processors(monkeypatch):
    monkeypatch.setattr("flowborne.sim.simulation.cores", lambda: 4)
    assert [default_workers(joints, True) for joints in (0, 1, 2, 3)] == [1, 2, 4, 4]
    assert default_workers(3, False) == 1


def test_kernels_of_small_grids_run_on_one_thread(small_scene, monkeypatch):
    """They would not share out anything: so nothing is searched for."""
    given = []
    limited = module.kernel_threads
    monkeypatch.setattr(
        module, "kernel_threads", lambda most=None: given.append(most) or limited(most)
    )
    with Simulation(small_scene, workers=1) as sim:
        sim.advance_frame()
        assert given[-1] == 1
        monkeypatch.setattr(module, "LARGE", 0)
        sim.advance_frame()
        assert given[-1] is None


def test_no_worker_is_refused(small_scene):
    with pytest.raises(SceneError, match="workers is 0; give a whole number from 1"):
        Simulation(small_scene, workers=0)


def test_rotations_are_told_from_translations():
    from flowborne.solids.model import SolidModel, turning_dofs

    model = SolidModel.from_string(
        """<mujoco><worldbody>
             <body name="a"><freejoint name="root"/><geom name="a" size="0.1"/>
               <body name="b"><joint name="slide" type="slide"/><geom name="b" size="0.1"/>
                 <body name="c"><joint name="hinge"/><geom name="c" size="0.1"/></body>
               </body>
             </body></worldbody></mujoco>"""
    )
    assert turning_dofs(model).tolist() == [False] * 3 + [True] * 3 + [False, True]

"""Objectives read the report and the state; sums weigh them and switch them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flowborne.control.measurement import Measurement
from flowborne.control.objective_kinds import (
    ObjectiveDistance,
    ObjectiveDrag,
    ObjectiveEffort,
    ObjectiveInputMotion,
    ObjectivePressureDrag,
    ObjectiveSpeed,
    ObjectiveVelocity,
    ObjectiveWindDrag,
)
from flowborne.control.objectives import ObjectiveCallable, ObjectiveSum, WeightedObjective
from flowborne.control.phases import PhaseIntervals
from flowborne.coupling.report import Asked, Outcome, StepReport
from flowborne.coupling.world import World

MakeWorld = Callable[..., World]


@pytest.fixture
def measured(make_world: MakeWorld) -> Measurement:
    """Arm with shoulder at 90 degrees after a step with known forces."""
    world = make_world()
    world.solid.q[:] = [np.pi / 2, 0.1, -0.2]
    world.solid.v[:] = [2.0, 0.0, 0.0]
    world.time = 3.0
    rng = np.random.default_rng(1)
    wrench = rng.normal(size=(6, 4, 6))
    told = np.zeros(3), np.zeros(3), np.array([3.0, -4.0, 12.0]), *wrench
    none = Asked(lambda: np.zeros((4, 6)))
    report = StepReport(0.05, Outcome.DONE, *told, none, np.zeros((4, 3)))
    return Measurement(world, report)


def test_effort_is_the_impulse_of_its_scope(measured: Measurement) -> None:
    assert ObjectiveEffort(np.array([0, 1])).value(measured) == pytest.approx(5.0 * 0.05)
    assert ObjectiveEffort(np.array([0, 1, 2])).value(measured) == pytest.approx(13.0 * 0.05)
    assert ObjectiveEffort(np.array([2])).value(measured) == pytest.approx(12.0 * 0.05)


def test_speed_is_along_a_unit_vector_and_distance_from_a_point(measured: Measurement) -> None:
    """The upper arm, of 1 m, stands along y and turns by 2 rad/s: its end goes along -x."""
    lower = measured.world.setup.solid.body("lower")
    assert ObjectiveSpeed(lower, (-3.0, 4.0, 0.0)).value(measured) == pytest.approx(2.0 * 0.6)
    whole = ObjectiveSpeed(None, (1.0, 0.0, 0.0)).value(measured)
    assert whole == pytest.approx(measured.whole_velocity()[0])
    assert ObjectiveDistance(lower, (3.0, 5.0, 0.0)).value(measured) == pytest.approx(5.0)
    with pytest.raises(ValueError, match="direction"):
        ObjectiveSpeed(None, (0.0, 0.0, 0.0))


def test_drags_are_forces_of_their_scope_along_a_unit_vector(measured: Measurement) -> None:
    bodies = np.array([1, 3])
    wind, pressure = measured.report.wind_wrench, measured.report.pressure_wrench
    drag = ObjectiveWindDrag(bodies, (0.0, -2.0, 0.0)).value(measured)
    assert drag == pytest.approx(-(wind[1, 1] + wind[3, 1]))
    lift = ObjectivePressureDrag(bodies, (3.0, 4.0, 0.0)).value(measured)
    assert lift == pytest.approx((pressure[[1, 3], :2] @ [0.6, 0.8]).sum())


def test_drag_is_what_winds_and_moving_fluid_do(measured: Measurement) -> None:
    report = measured.report
    wrench = report.wind_wrench + report.pressure_wrench + report.viscous_wrench
    drag = ObjectiveDrag(np.array([1, 2]), (2.0, 0.0, 0.0)).value(measured)
    assert drag == pytest.approx(wrench[1, 0] + wrench[2, 0])


def test_direction_rides_on_a_body(measured: Measurement) -> None:
    bodies, force = np.array([2]), measured.report.pressure_wrench[2]
    riding = ObjectivePressureDrag(bodies, (1.0, 0.0, 0.0), frame=1)  # body x points along y
    assert riding.value(measured) == pytest.approx(force[1])


def test_motion_and_velocity_are_squared_distances(measured: Measurement) -> None:
    class Reference:
        dofs = np.array([0, 2])

        def position(self, time: float) -> np.ndarray:
            return np.array([np.pi / 2 - 0.5, time - 3.0])

        def velocity(self, time: float) -> np.ndarray:
            return np.zeros(2)

    close = ObjectiveInputMotion(np.array([0, 2]), Reference())
    assert close.value(measured) == pytest.approx(0.5**2 + 0.2**2)
    # the elbow is 1 m up from the shoulder, which turns at 2 rad/s
    velocity = ObjectiveVelocity(2, (-2.0, 0.5, 0.0))
    assert velocity.value(measured) == pytest.approx(0.25)


def test_sum_weighs_and_switches_its_terms(measured: Measurement) -> None:
    two, five = ObjectiveCallable(lambda m: 2.0, "a"), ObjectiveCallable(lambda m: 5.0, "a")
    late = PhaseIntervals(((3.0, 4.0),))
    total = ObjectiveSum((WeightedObjective(two), WeightedObjective(five, -3.0, late)))
    assert total.value(measured) == 2.0 - 15.0
    assert total.value(Measurement(measured.world, measured.report, now=2.9)) == 2.0
    assert total.values(measured) == {"a": 2.0, "a-2": 5.0}
    assert total.active(0.0)
    only_late = ObjectiveSum((WeightedObjective(five, 1.0, late),))
    assert [only_late.active(t) for t in (2.9, 3.0, 4.0)] == [False, True, False]


def test_bad_objectives_are_refused() -> None:
    with pytest.raises(ValueError, match="direction is"):
        ObjectiveWindDrag(np.array([1]), (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="no term"):
        ObjectiveSum(())
    with pytest.raises(ValueError, match="weight of objective 'effort' is nan"):
        ObjectiveSum.of(ObjectiveEffort(np.array([0])), np.nan)

"""The controller's central difference, against one that Richardson's extrapolation makes exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne import Array, Controller, Hypothesis, Measurement, World, step
from flowborne.bodies import WindForce
from flowborne.machine import Serial
from flowborne.parts import GradientCentral, ObjectiveCallable, ObjectiveSum
from flowborne.worlds import make_world
from flowborne_validation.worlds import mjcf

from .worlds import UNSHRUNK

PROBE = 0.1
"""rad, the widest difference."""


@dataclass(frozen=True)
class Work:
    """Square of the drives' torques, and of how far the last body is from a place: smooth."""

    place: tuple[float, float]

    def __call__(self, measured: Measurement) -> float:
        torques = measured.report.actuator
        away = measured.world.setup.solid.nbody - 1
        reach = measured.body(f"link{away}").centre[:2] - self.place
        return float(torques @ torques + reach @ reach)


@st.composite
def arms(draw: st.DrawFn) -> tuple[World, Controller]:
    """One to three links in a wind and under gravity, and what moves their joints."""
    number = st.floats(-1.0, 1.0)
    inner = ""
    count = draw(st.integers(1, 3))
    lengths = [draw(st.floats(0.2, 0.5)) for _ in range(count)]
    for n in range(count, 0, -1):
        root = 2.0 * lengths[n - 2] if n > 1 else 0.0
        inner = (
            f'<body name="link{n}" pos="{root} 0 0"><joint type="hinge" axis="0 0 1"/>'
            f'<geom type="box" size="{lengths[n - 1]} 0.05 0.1" pos="{lengths[n - 1]} 0 0"/>'
            f"{inner}</body>"
        )
    gravity, force = ((draw(number), draw(number), 0.0) for _ in range(2))
    model = mjcf(inner)
    winds = (WindForce(force),)
    world = make_world(model, slab=True, solid_density=3.0, gravity=gravity, winds=winds)
    world.solid.q[:] = [draw(st.floats(-3.0, 3.0)) for _ in range(count)]
    world.solid.v[:] = [draw(number) for _ in range(count)]
    aim = ObjectiveSum.of(ObjectiveCallable(Work((draw(number), draw(number)))))
    tried = Hypothesis(1.0 / 24.0, velocities=draw(st.sampled_from(["removed", "present"])))
    return world, Controller(np.arange(count), aim, tried, 1.0, executor=Serial())


def slopes(world: World, controller: Controller, probe: float) -> Array:
    """(n,) gradient with differences of `probe`, rad."""
    trials = controller.trials(world, step)
    return GradientCentral(probe, resolution=0.0).estimate(trials).gradient


@settings(max_examples=40, phases=UNSHRUNK)
@given(arms())
def test_a_central_difference_is_off_by_the_square_of_its_width(
    arm: tuple[World, Controller],
) -> None:
    """Each extrapolation takes the next even power of the width out of the differences."""
    widths = PROBE * 0.5 ** np.arange(4)
    found = [np.array([slopes(*arm, width) for width in widths])]
    for power in (2, 4, 6):
        rough, fine = found[-1][:-1], found[-1][1:]
        found.append(fine + (fine - rough) / (2.0**power - 1.0))
    exact = found[-1][0]
    size = 1.0 + np.abs(exact).max()
    errors = np.abs(found[0] - exact)
    assert (errors[0] <= PROBE**2 * 10.0 * size).all()
    resolved = errors[0] > 1e-5 * size
    ratios = errors[:-1, resolved] / errors[1:, resolved]
    assert np.allclose(ratios[-1], 4.0, atol=0.1), ratios

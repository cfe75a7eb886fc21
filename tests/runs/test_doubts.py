"""A run that left its domain or lost momentum does not end as if nothing had happened."""

import pytest

from flowborne import BlowUpError, Grid, Simulation
from flowborne.cli.main import BLAS_THREADS, main
from flowborne.coupling.world import Fluid
from flowborne.runs.history import History
from flowborne.runs.summary import doubts_of
from flowborne.sim.endings import RunOutcome
from flowborne.worlds import Boundaries, BoundaryPeriodic

from ..made_runs import run, summary_of

FLUID = Fluid(Grid.slab(10, 10, 0.1, (0.0, 0.0)), 1.0)

SCENE = """
name = "leaving"
dimensions = 2

[time]
frames_per_second = 10.0
frames = 2

[domain]
size = [1.0, 1.0]
resolution = 12

[fluid]
density = 1.0

[boundaries]
x_min = "open"
x_max = "open"

[solids]
model = "ball.xml"
density = 1.0

[[motion]]
kind = "formula"
joint = "along"
position = "0.7 * t"
"""

MODEL = """
<mujoco>
  <worldbody>
    <body name="ball" pos="0.7 0.5 0">
      <joint name="along" type="slide" axis="1 0 0"/>
      <geom type="sphere" size="0.15"/>
    </body>
  </worldbody>
</mujoco>
"""


def history(path, places, errors=None, column="momentum_budget_error"):
    """One body along x, and an error in each frame, by default the budget's."""
    columns = ("frame", "ball_x_m", "ball_y_m", column)
    rows = History.create(path, columns)
    for frame, x in enumerate(places, 1):
        error = errors[frame - 1] if errors else 1e-13
        rows.append(dict(zip(columns, (frame, x, 0.5, error), strict=True)))
    rows.close()
    return path


@pytest.mark.parametrize(
    ("places", "said"),
    [
        ((0.5, 0.9, 1.05), []),  # on its way out, still less than a cell beyond the side
        ((1.5, 1.6, 1.7), ["body 'ball' left the fluid's domain in frame 1"]),
        ((0.5, 0.9, 1.15, 0.5), ["body 'ball' left the fluid's domain in frame 3"]),
        ((0.5, -0.15), ["body 'ball' left the fluid's domain in frame 2"]),
    ],
)
def test_a_body_that_leaves_the_domain_is_named_with_the_frame(tmp_path, places, said):
    found = doubts_of(history(tmp_path / "history.csv", places), ["ball"], FLUID)
    assert [doubt.split(";")[0] for doubt in found] == said


def test_no_body_leaves_through_periodic_sides(tmp_path):
    sides = Boundaries(x_min=BoundaryPeriodic(), x_max=BoundaryPeriodic())
    fluid = Fluid(FLUID.grid, 1.0, boundaries=sides)
    assert not doubts_of(history(tmp_path / "history.csv", (0.5, 1.5)), ["ball"], fluid)


def test_an_open_momentum_budget_is_told_with_its_worst_frame(tmp_path):
    path = history(tmp_path / "history.csv", (0.5, 0.5, 0.5), (1e-13, 3e-4, 2e-5))
    (said,) = doubts_of(path, ["ball"], FLUID)
    assert "momentum_budget_error is 0.0003 in frame 2" in said


def test_viscosity_and_pressure_apart_are_told(tmp_path):
    for errors, told in ((9e-5, 5e-5), 0), ((5e-5, 2e-2), 1):
        path = history(tmp_path / f"{told}.csv", (0.5, 0.5), errors, "sweep_error")
        assert len(doubts_of(path, ["ball"], FLUID)) == told
    assert "sweep_error is 0.02 in frame 2" in doubts_of(path, ["ball"], FLUID)[0]


def test_a_run_that_leaves_its_domain_is_not_done_when_resumed_either(
    tmp_path, capsys, monkeypatch
):
    (tmp_path / "ball.xml").write_text(MODEL)
    scene, out = tmp_path / "leaving.toml", tmp_path / "run"
    scene.write_text(SCENE)
    assert run(scene, out).outcome is RunOutcome.DONE
    result = run(scene, out, resume=True, frames=8)
    assert result.outcome is RunOutcome.DOUBTFUL
    assert "body 'ball' left the fluid's domain in frame 6" in result.message
    summary = summary_of(out)
    assert (summary["outcome"], len(summary["doubts"])) == ("doubtful", 1)
    for name in BLAS_THREADS:
        monkeypatch.setenv(name, "1")
    with pytest.raises(SystemExit) as left:
        main(["run", str(scene), "--out", str(out), "--resume", "--frames", "9", "--no-film"])
    assert left.value.code == 3
    assert "left the fluid's domain in frame 6" in capsys.readouterr().err


def advance_frames(scene, count):
    with Simulation(scene, workers=1) as simulation:
        for _ in range(count):
            simulation.advance_frame()


@pytest.mark.parametrize("kind", ["closed", "no-slip"])
def test_a_run_stops_when_a_body_leaves_through_a_side_that_lets_nothing_through(tmp_path, kind):
    (tmp_path / "ball.xml").write_text(MODEL)
    scene = tmp_path / "leaving.toml"
    scene.write_text(SCENE.replace('x_max = "open"', f'x_max = "{kind}"'))
    with pytest.raises(BlowUpError) as left:
        advance_frames(scene, 8)
    assert 3 <= left.value.frame <= 5  # from 0.2 s on it reaches there, its middle after 0.43 s
    assert left.value.cause == (
        f"body 'ball' has left the domain through its {kind} side x_max; enlarge [domain], or put "
        "a plane with contact into the model where the side is"
    )


def test_a_disc_that_loses_its_water_is_a_doubt(tmp_path):
    path = tmp_path / "history.csv"
    columns = ["frame", "disc_water_aft", "disc_water_bow"]
    path.write_text(",".join(columns) + "\n1,1.0,0.99\n2,0.4,0.98\n3,0.9,0.98\n")
    (said,) = doubts_of(path, [], FLUID)
    assert said.startswith("40 % of the disc of thruster 'aft' were water in frame 2, which had")

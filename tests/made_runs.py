"""Runs of scenes for tests, and what has to be the same in two of them."""

import csv
import json
import subprocess
import sys
import time

import flowborne

DRIFTER = """<mujoco><worldbody><body name="drifter"><freejoint name="root"/>
<geom type="sphere" size="0.1" density="1000"/></body></worldbody></mujoco>"""

DRIFT = """
name = "drift"
[time]
frames_per_second = 20.0
frames = 6
[domain]
lower = [-0.4, -0.3, -0.3]
upper = [0.4, 0.3, 0.3]
resolution = 16
follow = "drifter"
along = ["x", "z"]
[fluid]
[boundaries]
x_min = "far"
x_max = "far"
z_min = "far"
z_max = "far"
[solids]
model = "drifter.xml"
[initial]
velocities = { root = [1.0, 0.0, -0.4, 0.0, 0.0, 0.0] }
[[dye]]
kind = "box"
lower = [-0.2, -0.2, -0.2]
upper = [0.2, 0.2, 0.2]
"""

MASS = (
    '<mujoco><worldbody><body name="mass"><joint name="along" type="slide" axis="1 0 0" '
    'stiffness="4"/><geom type="sphere" size="0.1" mass="1"/></body></worldbody></mujoco>'
)

SPRING = """
[time]
frames_per_second = 10.0
frames = 5
[solids]
model = "spring.xml"
[initial]
positions = { along = 1.0 }
"""


def run(scene, out, **options):
    return flowborne.run(scene, out, **{"film": False, "workers": 1} | options)


def numbers(folder):
    """Everything of a run that has to be the same again, whatever happened on the way."""
    with open(folder / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    history = [{k: v for k, v in row.items() if not k.startswith("seconds_")} for row in rows]
    states = {path.name: path.read_bytes() for path in (folder / "states").iterdir()}
    files = {name: (folder / name).read_bytes() for name in ("checkpoint.npz", "scene.toml")}
    return history, states, files


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def start(arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "flowborne", "run", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_rows(process, path, rows):
    while not path.exists() or path.read_text().count("\n") <= rows:
        assert process.poll() is None, f"the run ended before {path} had {rows} rows"
        time.sleep(0.005)


def drift_scene(folder):
    """File of a scene of a sphere with dye around it, whose far-sided domain follows it."""
    (folder / "drifter.xml").write_text(DRIFTER)
    (folder / "drift.toml").write_text(DRIFT)
    return folder / "drift.toml"


def spring_scene(folder):
    """File of a scene of a mass on a spring, whose runs take milliseconds and need few kernels."""
    (folder / "spring.xml").write_text(MASS)
    (folder / "spring.toml").write_text(SPRING)
    return folder / "spring.toml"

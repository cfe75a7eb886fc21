"""Thrusters of a vehicle in water: actuators on sites push bodies that the fluid resists."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flowborne.sim.simulation import Simulation

VEHICLE = """<mujoco model="vehicle"><worldbody>
  <body name="hull" pos="0.4 0.4 0.4"><freejoint name="free"/>
    <geom name="hull" type="sphere" size="0.1" mass="4.18879"/>
    <site name="middle"/><site name="port" pos="0 0.05 0" euler="0 0 20"/></body>
</worldbody><actuator>
  <motor name="ahead" site="middle" gear="1 0 0 0 0 0" ctrlrange="-50 60"/>
  <motor name="port" site="port" gear="1 0 0 0 0 0" ctrlrange="-50 60"/>
</actuator><sensor><accelerometer name="felt" site="middle"/></sensor></mujoco>"""
SCENE = """
[time]
frames_per_second = 100.0
frames = 4
[domain]
size = [0.8, 0.8, 0.8]
resolution = 24
[fluid]
density = 1000.0
[boundaries]
x_min = "far"
x_max = "far"
y_min = "far"
y_max = "far"
z_min = "far"
z_max = "far"
[solids]
model = "vehicle.xml"
[[actuator]]
name = "{name}"
value = 10.0
"""


@pytest.mark.parametrize("name", ["ahead", "port"])
def test_a_thruster_accelerates_the_vehicle_and_its_added_mass(tmp_path: Path, name: str) -> None:
    """10 N on 4.19 kg and half of 4.19 kg of water along the site's x, and r x F about the centre,
    on which an inviscid fluid has no hold."""
    (tmp_path / "vehicle.xml").write_text(VEHICLE)
    (tmp_path / "vehicle.toml").write_text(SCENE.format(name=name))
    mass, radius = 4.18879, 0.1
    turn = np.radians(20.0) if name == "port" else 0.0
    along = np.array([np.cos(turn), np.sin(turn), 0.0])
    torque = np.cross([0.0, 0.05, 0.0], 10.0 * along) if name == "port" else np.zeros(3)
    with Simulation(tmp_path / "vehicle.toml", workers=1) as simulation:
        report = simulation.advance_frame()
        hull, row = simulation.body("hull"), simulation.measure()
        drive = simulation.joint("free").drive
        felt = simulation.sensor("felt")
    assert drive == pytest.approx([*(10.0 * along), *torque], abs=2e-2)
    assert row[f"actuator_{name}_force"] == row[f"actuator_{name}_control"] == 10.0
    power = 10.0 * report.step.velocity[:3] @ along
    if name == "ahead":
        assert row["actuator_ahead_power_W"] == pytest.approx(power, rel=1e-9)
    assert hull.acceleration @ along == pytest.approx(10.0 / (1.5 * mass), rel=0.03)
    spin = torque / (0.4 * mass * radius**2)
    assert hull.angular_acceleration == pytest.approx(spin, abs=0.01 * (1.0 + abs(spin).max()))
    assert felt == pytest.approx(hull.acceleration, abs=1e-2)  # no gravity in this scene
    assert report.step.momentum_budget_error < 1e-10

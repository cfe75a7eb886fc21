"""What the columns of a history are."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_array_equal

from flowborne.runs.history import history_arrays, unit_of

BODIES = ("world", "head", "head_fin")
JOINTS = ("root", "neck", "slide_x", "fin")
COLUMNS = {
    "frame": 1.0,
    "time_s": 0.1,
    "angle_fin_rad": 2.0,
    "position_slide_x_m": 3.0,
    "target_fin_rad": 4.0,
    "target_slide_x_m": 5.0,
    "torque_fin_Nm": 6.0,
    "torque_neck_y_Nm": 7.0,
    "force_slide_x_N": 8.0,
    "force_root_z_N": 9.0,
    "power_neck_W": 10.0,
    "head_x_m": 11.0,
    "head_fin_qw": 12.0,
    "head_fin_force_x_N": 13.0,
    "head_rotation_z_rad/s": 14.0,
    "momentum_solid_y_Ns": 15.0,
    "divergence_1/s": 16.0,
    "measured_drag": 17.0,
}


def test_columns_go_to_their_joint_body_and_axis() -> None:
    history = {column: np.array([value]) for column, value in COLUMNS.items()}
    found = history_arrays(history, BODIES, JOINTS)
    places = {
        name: (quantity.dimensions, quantity.unit, *np.argwhere(np.isfinite(values[0])).tolist())
        for name, (quantity, values) in found.items()
    }
    assert places == {
        "angle": (("joint",), "rad", [3]),
        "position": (("joint",), "m", [2]),
        "target_angle": (("joint",), "rad", [3]),
        "target_position": (("joint",), "m", [2]),
        "torque": (("joint",), "N m", [3]),
        "torque_xyz": (("joint", "axis"), "N m", [1, 1]),
        "force": (("joint",), "N", [2]),
        "force_xyz": (("joint", "axis"), "N", [0, 2]),
        "power": (("joint",), "W", [1]),
        "body_force": (("body", "axis"), "N", [2, 0]),
        "body_angular_velocity": (("body", "axis"), "rad/s", [1, 2]),
        "momentum_solid": (("axis",), "N s", [1]),
        "divergence": ((), "1/s", []),
        "measured_drag": ((), "", []),
    }
    finite = [float(np.nansum(values)) for _, values in found.values()]
    assert_array_equal(finite, [2, 3, 4, 5, 6, 7, 8, 9, 10, 13, 14, 15, 16, 17])
    assert unit_of("power_neck_W") == "W"

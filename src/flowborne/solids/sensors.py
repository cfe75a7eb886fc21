"""Readings of a model's sensors, computed by MuJoCo from the coupled solution.

Positions, velocities and accelerations are those of bodies and fluid together, so that an
accelerometer measures what the fluid does to the body; contact forces follow from the acceleration,
and the fluid's force on each body is an external one.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import Scratch, scratch
from flowborne.solids.sensed import Sensed

Kind = mujoco.mjtSensor

UNITS = {
    "m/s2": (Kind.mjSENS_ACCELEROMETER, Kind.mjSENS_FRAMELINACC),
    "rad/s2": (Kind.mjSENS_FRAMEANGACC,),
    "m/s": (Kind.mjSENS_VELOCIMETER, Kind.mjSENS_FRAMELINVEL, Kind.mjSENS_SUBTREELINVEL),
    "rad/s": (Kind.mjSENS_GYRO, Kind.mjSENS_BALLANGVEL, Kind.mjSENS_FRAMEANGVEL),
    "m": (
        Kind.mjSENS_RANGEFINDER,
        Kind.mjSENS_FRAMEPOS,
        Kind.mjSENS_SUBTREECOM,
        Kind.mjSENS_GEOMDIST,
        Kind.mjSENS_GEOMFROMTO,
    ),
    "N": (Kind.mjSENS_TOUCH, Kind.mjSENS_FORCE),
    "Nm": (Kind.mjSENS_TORQUE,),
    "J": (Kind.mjSENS_E_POTENTIAL, Kind.mjSENS_E_KINETIC),
    "s": (Kind.mjSENS_CLOCK,),
}
"""Suffix of columns -> kinds of sensors; others have the unit of a joint, tendon or actuator."""

AXES = {1: ("",), 3: ("_x", "_y", "_z"), 4: ("_w", "_x", "_y", "_z")}
"""Number of a sensor's values -> what its columns have after its name."""

OFF = {Kind.mjSENS_PLUGIN, Kind.mjSENS_USER}
"""Kinds that are computed by code outside of MuJoCo."""


def known_sensors(model: SolidModel) -> list[int]:
    """Sensors that have a reading."""
    mj = model.mj
    return [n for n in range(mj.nsensor) if Kind(int(mj.sensor_type[n])) not in OFF]


def unread_sensors(model: SolidModel) -> list[str]:
    """Names of the sensors without a reading."""
    known = known_sensors(model)
    return [name for n, name in enumerate(model.sensor_names) if n not in known]


def late_sensors(model: SolidModel) -> list[str]:
    """Names of the sensors that the model reads late or seldom."""
    late = (model.mj.sensor_delay > 0.0) | (model.mj.sensor_interval[:, 0] > 0.0)
    return [name for name, is_late in zip(model.sensor_names, late, strict=True) if is_late]


def sensor_columns(model: SolidModel) -> list[str]:
    """Names of the columns of all sensors, in the order of `readings`."""
    units = {kind: f"_{unit}" for unit, kinds in UNITS.items() for kind in kinds}
    columns = []
    for n in known_sensors(model):
        size, kind = int(model.mj.sensor_dim[n]), Kind(int(model.mj.sensor_type[n]))
        axes = AXES.get(size) or tuple(f"_{place}" for place in range(size))
        columns += [f"sensor_{model.sensor_names[n]}{a}{units.get(kind, '')}" for a in axes]
    return columns


def readings(sensed: Sensed, time: float) -> dict[str, Array]:
    """Sensor -> (k,) its reading at the end of a step, at `time` (s); nan for what only a step
    gives, before the first."""
    model = sensed.model
    if not model.mj.nsensor:
        return {}
    moves = not np.isnan(sensed.dt)
    with _measuring(model) as s:
        data, mj = s.data, s.mj
        data.time, s.q[:] = time, sensed.q
        s.v[:] = sensed.velocity if moves else 0.0
        mujoco.mj_fwdPosition(mj, data)
        mujoco.mj_fwdVelocity(mj, data)
        data.qacc[:] = sensed.acceleration if moves else 0.0
        data.qfrc_actuator[:] = sensed.actuator if moves else 0.0
        data.actuator_force[:] = sensed.output if moves else 0.0
        data.xfrc_applied[: model.nbody] = sensed.wrench if moves else 0.0
        if data.nefc:
            row = np.zeros(data.nefc)
            mujoco.mj_mulJacVec(mj, data, row, data.qacc)
            mujoco.mj_constraintUpdate(mj, data, row - data.efc_aref, None, 0)
        mujoco.mj_sensorPos(mj, data)
        mujoco.mj_sensorVel(mj, data)
        mujoco.mj_sensorAcc(mj, data)
        values = data.sensordata.copy()
    found = {}
    for n in known_sensors(model):
        first, size = int(mj.sensor_adr[n]), int(mj.sensor_dim[n])
        placed = mj.sensor_needstage[n] == mujoco.mjtStage.mjSTAGE_POS
        reading = values[first : first + size]
        found[model.sensor_names[n]] = reading if moves or placed else np.full(size, np.nan)
    return found


@contextmanager
def _measuring(model: SolidModel) -> Iterator[Scratch]:
    """Working memory in which sensors are on, and off after that."""
    s = scratch(model)
    flags = int(s.mj.opt.disableflags)
    s.mj.opt.disableflags = flags & ~int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    try:
        yield s
    finally:
        s.mj.opt.disableflags = flags
        s.data.time, s.data.xfrc_applied[:] = 0.0, 0.0

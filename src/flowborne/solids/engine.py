"""MuJoCo's equations of a step, and the test of them with a version that is not known.

With `integrator="discrete"`, h the time step and t the row of a tendon's Jacobian, MuJoCo solves

    A a = qfrc_smooth + efm_c + Ja^T Da aref
    A = M + diag(efm_diag) + t^T efm_ts t + Ja^T Da Ja
    v+ = v + h a

where Ja, Da and aref are its active constraint rows. `solids.dynamics` assembles its own A from the
same arrays.
"""

from __future__ import annotations

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.extras import REINSTALL_MUJOCO
from flowborne.kernels.arrays import Array

try:
    import mujoco
except ImportError as error:
    reason = " ".join(str(error).split())
    raise SceneError(
        f"MuJoCo cannot be imported ({reason}). Install it again: {REINSTALL_MUJOCO}."
    ) from error

KNOWN = ("4.0.1",)
"""Versions with which all tests have passed."""

TOLERANCE = 1e-9
"""Largest error of the identities, relative to the largest force and velocity."""

MODEL = """<mujoco><option integrator="discrete" solver="Newton" cone="pyramidal" iterations="500"
tolerance="1e-14" timestep=".01"><flag warmstart="disable" island="disable"/></option>
<worldbody><geom type="plane" size="5 5 .1" pos="0 0 -.6"/>
<body pos="0 0 .1"><freejoint/><geom type="capsule" size=".1 .3" mass="3"/>
<body pos="0 0 .4"><joint type="ball" damping=".3" stiffness="2"/>
<geom type="box" size=".1 .2 .3" mass="2"/>
<body pos=".5 0 0"><joint name="a" axis="0 1 0" damping=".2" stiffness="5" springref="10"
armature=".1" range="-3 3"/><geom type="sphere" size=".2" mass="1"/>
<body pos=".2 0 0"><joint name="b" axis="0 0 1"/><geom type="box" size=".3 .1 .1" pos=".3 0 0"/>
</body></body></body></body></worldbody><tendon><fixed stiffness="30" damping="2">
<joint joint="a" coef="1"/><joint joint="b" coef="-.5"/></fixed></tendon></mujoco>"""
"""Springs, dampers, a stop, a tendon and a floor."""

STATES = 16
"""Random states in which they are tested."""


def check_engine() -> None:
    """Test the identities with a version of MuJoCo that is not in KNOWN.

    raises  SceneError if one does not hold
    """
    version = mujoco.__version__
    if version in KNOWN:
        return
    try:
        error = identity_error()
        found = "" if error <= TOLERANCE else f"its step is off by {error:.2g} of the forces"
    except (AttributeError, TypeError, ValueError) as missing:
        found = " ".join(str(missing).split())
    if found:
        raise SceneError(
            f"MuJoCo {version} solves other equations of a step than flowborne ({found}). "
            f"Install a version that is known: pip install 'mujoco-core=={KNOWN[-1]}'."
        )


def identity_error() -> float:
    """Largest error of both identities in random states, dense and sparse, relative to the largest
    force and velocity."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    h, worst = model.opt.timestep, 0.0
    for seed in range(STATES):
        random = np.random.default_rng(seed)
        model.opt.jacobian = seed % 2  # mjtJacobian: dense, sparse
        data = mujoco.MjData(model)
        mujoco.mj_integratePos(model, data.qpos, random.normal(size=model.nv), 0.2)
        data.qvel[:] = random.normal(size=model.nv)
        mujoco.mj_forward(model, data)
        A = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, A)
        add_springs(A, model, data, data.efm_diag, data.efm_ts)
        on = data.efc_state == mujoco.mjtConstraintState.mjCNSTRSTATE_QUADRATIC
        J, D = row_jacobian(model, data)[on], data.efc_D[on]
        force = data.qfrc_smooth + data.efm_c + J.T @ (D * data.efc_aref[on])
        a, v = data.qacc.copy(), data.qvel.copy()
        missing = np.abs((A + J.T @ (D[:, None] * J)) @ a - force).max() / np.abs(force).max()
        mujoco.mj_step(model, data)
        slip = np.abs(data.qvel - v - h * a).max() / np.abs(data.qvel).max()
        worst = max(worst, float(missing), float(slip))
    return worst


def add_springs(
    A: Array, mj: mujoco.MjModel, data: mujoco.MjData, diagonal: Array, tendons: Array
) -> None:
    """Add to A (nv, nv) the implicit springs and dampers of joints and of active tendons.

    diagonal  (nv,) of joints, such as efm_diag
    tendons   (n,) of the active tendons, such as efm_ts
    """
    A.flat[:: mj.nv + 1] += diagonal
    for n, t in enumerate(data.efm_tid[: data.nefmT]):
        first, count = mj.ten_J_rowadr[t], mj.ten_J_rownnz[t]
        row = np.zeros(mj.nv)
        row[mj.ten_J_colind[first : first + count]] = data.ten_J[first : first + count]
        A += tendons[n] * np.outer(row, row)


def row_jacobian(mj: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """(k, nv) Jacobian of MuJoCo's constraint rows."""
    if not mujoco.mj_isSparse(mj):
        return np.array(data.efc_J).reshape(data.nefc, mj.nv)
    J = np.zeros((data.nefc, mj.nv))
    row = np.repeat(np.arange(data.nefc), data.efc_J_rownnz)
    J[row, data.efc_J_colind[: len(row)]] = data.efc_J[: len(row)]
    return J

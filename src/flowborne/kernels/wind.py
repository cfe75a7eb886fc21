"""The simple wind on flat patches of bodies, eq. (2) of the paper."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.jit import kernel


@kernel
def places(body: Integers, centre: Array, position: Array, rotation: Array) -> Array:
    """(n, 3) patches' centres in the world: position + rotation centre."""
    x = np.empty_like(centre)
    for n in range(len(body)):
        for i in range(3):
            x[n, i] = position[body[n], i]
            for j in range(3):
                x[n, i] += rotation[body[n], i, j] * centre[n, j]
    return x


@kernel
def pushed(
    body: Integers,
    screw: Array,
    area: Array,
    position: Array,
    rotation: Array,
    twist: Array,
    wind: Array,
) -> Array:
    """(nbody, 6) eq. (2) for unit density: force and torque about the world origin on each body.

    In a body's frame the wind meets a patch with G.(u, -omega), u being its velocity relative to
    the frame's origin and G = (n, c x n); the patch passes on A |G.(u, -omega)| G.(u, -omega) G.

    body, screw, area          of the patches (`Patches`)
    position, rotation, twist  (nbody, 3), (nbody, 3, 3), (nbody, 6) of the bodies
    wind                       (n, 3) m/s at each patch, or (1, 3) for all
    """
    wrench, force, torque = np.zeros((len(position), 6)), np.empty(3), np.empty(3)
    first = 0
    while first < len(body):
        b, R, x = body[first], rotation[body[first]], position[body[first]]
        v = twist[b, :3] + np.cross(twist[b, 3:], x)
        spin = -R.T @ twist[b, 3:]
        p, q, r = spin[0], spin[1], spin[2]
        X = Y = Z = K = M = N = 0.0  # in registers, where a small array would not be
        n = first
        while n < len(body) and body[n] == b:
            if n == first or len(wind) > 1:
                flow = R.T @ (wind[n if len(wind) > 1 else 0] - v)
                u, s, w = flow[0], flow[1], flow[2]
            G = screw[n]
            inflow = G[0] * u + G[1] * s + G[2] * w + G[3] * p + G[4] * q + G[5] * r
            passed = area[n] * abs(inflow) * inflow
            X, Y, Z = X + passed * G[0], Y + passed * G[1], Z + passed * G[2]
            K, M, N = K + passed * G[3], M + passed * G[4], N + passed * G[5]
            n += 1
        force[0], force[1], force[2] = X, Y, Z
        torque[0], torque[1], torque[2] = K, M, N
        wrench[b, :3] = R @ force
        wrench[b, 3:] = R @ torque + np.cross(x, wrench[b, :3])
        first = n
    return wrench

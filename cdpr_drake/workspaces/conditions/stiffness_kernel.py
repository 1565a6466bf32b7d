"""Stiffness of a platform at many poses, as a numba kernel.

Source: Gazebo thesis (2.25) to (2.28).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry import (
    add_platform_turning,
    pulley_jacobian,
    pulley_line,
    unit_vector_derivative,
)

ELASTICITY = 6
"""Column of `CableSet.packed()` with the axial stiffness [N]."""


@njit(cache=True, nogil=True, error_model="numpy")
def many_stiffnesses(
    first: int, past: int, positions: Array, rotations: Array, cables: Array, tensions: Array,
    load: Array, out: Array,
) -> None:  # fmt: skip
    """Writes the stiffness about Po in W, (turn, translation), for `numerics.over_rows`.

    Args:
        first: First pose.
        past: One past the last.
        positions: p_WP, shape (k, 3) [m].
        rotations: R_WP, shape (k, 3, 3).
        cables: `CableSet.packed()`, shape (m, 17).
        tensions: Shape (k, m) [N]; a cable without tension does not stretch.
        load: Centre of mass in P (3) [m], weight in W (3) [N].
        out: Shape (k, 6, 6).
    """
    m = cables.shape[0]
    J, lengths, D, SD = np.empty((m, 6)), np.empty(m), np.empty((3, 3)), np.empty((3, 3))
    S, U, c = np.zeros((3, 3)), np.zeros((3, 3)), np.empty(3)
    for pose in range(first, past):
        R, p, K = rotations[pose], positions[pose], out[pose]
        X = (
            R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2], R[2, 0], R[2, 1], R[2, 2],
            p[0], p[1], p[2],
        )  # fmt: skip
        pulley_jacobian(X, cables, lengths, J)
        for a in range(6):
            for b in range(6):
                K[a, b] = 0.0
        for i in range(m):
            t = tensions[pose, i]
            if t == 0.0:
                continue
            # E S / l0 with the unstrained length l0 = l / (1 + t / E S)
            pull = (cables[i, ELASTICITY] + t) / lengths[i]
            for a in range(6):
                for b in range(6):
                    K[a, b] += pull * J[i, a] * J[i, b]
            _, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
            unit_vector_derivative(X, cables[i], D)
            _cross_matrix(rx, ry, rz, S)
            _cross_matrix(ux, uy, uz, U)
            for a in range(3):
                for b in range(3):
                    SD[a, b] = S[a, 0] * D[0, b] + S[a, 1] * D[1, b] + S[a, 2] * D[2, b]
            for a in range(3):
                for b in range(3):
                    turn = 0.0
                    for k in range(3):
                        # S' D S + U S = -S D S + U S
                        turn += (U[a, k] - SD[a, k]) * S[k, b]
                    K[a, b] += t * turn
                    K[a, 3 + b] += t * SD[a, b]
                    K[3 + b, a] += t * SD[a, b]
                    K[3 + a, 3 + b] += t * D[a, b]
            add_platform_turning(X, cables[i], t, K)
        for a in range(3):
            c[a] = R[a, 0] * load[0] + R[a, 1] * load[1] + R[a, 2] * load[2]
        # -[f]x [c]x = (f'c) 1 - c f' with the weight f
        work = load[3] * c[0] + load[4] * c[1] + load[5] * c[2]
        for a in range(3):
            for b in range(3):
                K[a, b] -= c[a] * load[3 + b] - (work if a == b else 0.0)


@njit(cache=True, error_model="numpy")
def _cross_matrix(x: float, y: float, z: float, out: Array) -> None:
    out[0, 1], out[0, 2], out[1, 2] = -z, y, -x
    out[1, 0], out[2, 0], out[2, 1] = z, -y, x

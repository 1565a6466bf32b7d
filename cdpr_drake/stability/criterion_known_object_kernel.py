"""The criterion for a perturbed estimate and a known object, fast: what most questions need.

The same numbers as `criterion_at_pose_kernel.evaluate` up to rounding, from one flat array
with constant indices: a call with many arrays would count references to them longer than it
computes. Products are folded into S = ((L J^+) J_hat L^+ + its transpose) / 2, and nothing is
allocated.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.stability.criterion_at_pose_kernel import (
    CaseArrays,
    PoseRows,
    Work,
    evaluate,
    moves_object,
)
from cdpr_drake.stability.criterion_kernel import OUTSIDE
from cdpr_drake.stability.stability_case import IBVS

WIDTH = 16
"""Cables at most."""

LANES = 8
"""Cables are taken in multiples of this, as many as a processor may take at a time."""

# Where things stand in the flat array: 18 rows of WIDTH for the cables, then these.
TURN = 18 * WIDTH
PLACE = TURN + 9
CAMERA = PLACE + 3
MOUNT = CAMERA + 9
LEFT = MOUNT + 3
RIGHT = LEFT + 6 * WIDTH
PRODUCT = RIGHT + 36
FINAL = PRODUCT + 36

FREEDOM = {"contract", "nsz", "arcp", "reassoc"}
"""What the compiler may do with sums and quotients; infinities and NaN keep their meaning."""


@njit(cache=True, error_model="numpy", inline="always")
def is_quick(case: CaseArrays) -> bool:
    """Whether `evaluate_quick` applies."""
    return not case.truth and not moves_object(case) and case.A.shape[0] <= WIDTH


@njit(cache=True, error_model="numpy", inline="always")
def quick_size() -> int:
    """Numbers in the flat array of `pack_quick`."""
    return FINAL


@njit(cache=True, error_model="numpy")
def pack_quick(
    A: Array, B: Array, C: Array, t: Array, R: Array, p: Array, LM: Array, Li: Array, local: bool,
    q: Array,
) -> None:  # fmt: skip
    """q <- all that `evaluate_quick` needs of the pose that `prepare` has seen.

    Arguments as `CaseArrays` and `Work` have them: tuples of so many arrays cost more to compile.
    """
    m = A.shape[0]
    for i in range(WIDTH):  # columns without a cable repeat the first, with a weight of 0
        cable = i if i < m else 0
        for k in range(3):
            q[WIDTH * k + i] = A[cable, k]
            q[WIDTH * (3 + k) + i] = B[cable, k]
            q[WIDTH * (6 + k) + i] = A[cable, k]
            q[WIDTH * (9 + k) + i] = B[cable, k]
        for k in range(6):
            q[LEFT + WIDTH * k + i] = LM[k, i] if i < m else 0.0
    for i in range(3):
        for k in range(3):
            q[TURN + 3 * i + k] = R[i, k]
            q[CAMERA + 3 * i + k] = C[i, k]
        q[PLACE + i] = p[i]
        q[MOUNT + i] = t[i]
    if not local:
        for i in range(6):
            for k in range(6):
                q[RIGHT + 6 * i + k] = Li[i, k]


@njit(cache=True, error_model="numpy", fastmath=FREEDOM)
def _turn(d: Array, at: int, q: Array, base: int, out: int) -> None:
    """q[out :] <- R exp(d[at : at + 3]) for R at q[base :], both by rows.

    Not `rotation_kernel.rotation_into`: one sine instead of two in what most of the time goes into.
    """
    x, y, z = d[at], d[at + 1], d[at + 2]
    square = x * x + y * y + z * z
    if square > 1e-16:
        theta = np.sqrt(square)
        half = np.sin(0.5 * theta)
        a = 2.0 * half * np.sqrt(1.0 - half * half) / theta  # sin theta / theta, theta <= pi
        b = 2.0 * half * half / square
    else:
        a, b = 1.0, 0.5
    e00, e11, e22 = 1.0 - b * (y * y + z * z), 1.0 - b * (x * x + z * z), 1.0 - b * (x * x + y * y)
    e01, e10 = b * x * y - a * z, b * x * y + a * z
    e02, e20 = b * x * z + a * y, b * x * z - a * y
    e12, e21 = b * y * z - a * x, b * y * z + a * x
    for i in range(3):
        r, s, t = q[base + 3 * i], q[base + 3 * i + 1], q[base + 3 * i + 2]
        q[out + 3 * i] = r * e00 + s * e10 + t * e20
        q[out + 3 * i + 1] = r * e01 + s * e11 + t * e21
        q[out + 3 * i + 2] = r * e02 + s * e12 + t * e22


@shared(types.void(VECTOR, types.int64, types.boolean, types.boolean, VECTOR, MATRIX))
@njit(cache=True, error_model="numpy", fastmath=FREEDOM)
def evaluate_quick(q: Array, m: int, local: bool, planar: bool, d: Array, S: Array) -> None:
    """S <- (Pi + Pi') / 2 for the perturbation d, where `is_quick`.

    Args:
        q: Of `pack_quick`; its tail is work space.
        m: Number of cables.
        local: Whether the scheme is IBVS.
        planar: Whether the robot is planar.
        d: Perturbation, shape (18 + 6 m,).
        S: Output, shape (6, 6).
    """
    lanes = LANES * ((m + LANES - 1) // LANES)
    _turn(d, as_number(0), q, as_number(TURN), PRODUCT)
    r00, r01, r02 = q[PRODUCT], q[PRODUCT + 1], q[PRODUCT + 2]
    r10, r11, r12 = q[PRODUCT + 3], q[PRODUCT + 4], q[PRODUCT + 5]
    r20, r21, r22 = q[PRODUCT + 6], q[PRODUCT + 7], q[PRODUCT + 8]
    _turn(d, as_number(6), q, as_number(CAMERA), PRODUCT)
    c00, c01, c02 = q[PRODUCT], q[PRODUCT + 1], q[PRODUCT + 2]
    c10, c11, c12 = q[PRODUCT + 3], q[PRODUCT + 4], q[PRODUCT + 5]
    c20, c21, c22 = q[PRODUCT + 6], q[PRODUCT + 7], q[PRODUCT + 8]
    px, py, pz = q[PLACE] + d[3], q[PLACE + 1] + d[4], q[PLACE + 2] + d[5]
    tx, ty, tz = q[MOUNT] + d[9], q[MOUNT + 1] + d[10], q[MOUNT + 2] + d[11]
    for i in range(m):
        for k in range(3):
            q[WIDTH * (6 + k) + i] = q[WIDTH * k + i] + d[18 + 3 * i + k]
            q[WIDTH * (9 + k) + i] = q[WIDTH * (3 + k) + i] + d[18 + 3 * (m + i) + k]
    # All in P first: s = b + R' (p - a), then u and the arm from the camera, then both in C.
    for i in range(lanes):
        ax, ay, az = px - q[6 * WIDTH + i], py - q[7 * WIDTH + i], pz - q[8 * WIDTH + i]
        bx, by, bz = q[9 * WIDTH + i], q[10 * WIDTH + i], q[11 * WIDTH + i]
        sx = bx + r00 * ax + r10 * ay + r20 * az
        sy = by + r01 * ax + r11 * ay + r21 * az
        sz = bz + r02 * ax + r12 * ay + r22 * az
        f = 1.0 / np.sqrt(sx * sx + sy * sy + sz * sz)
        ux, uy, uz = f * sx, f * sy, f * sz
        bx, by, bz = bx - tx, by - ty, bz - tz
        vx, vy, vz = by * uz - bz * uy, bz * ux - bx * uz, bx * uy - by * ux
        q[12 * WIDTH + i] = c00 * vx + c10 * vy + c20 * vz
        q[13 * WIDTH + i] = c01 * vx + c11 * vy + c21 * vz
        q[14 * WIDTH + i] = c02 * vx + c12 * vy + c22 * vz
        q[15 * WIDTH + i] = c00 * ux + c10 * uy + c20 * uz
        q[16 * WIDTH + i] = c01 * ux + c11 * uy + c21 * uz
        q[17 * WIDTH + i] = c02 * ux + c12 * uy + c22 * uz
    for i in range(6):
        x0, x1, x2, x3, x4, x5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(lanes):
            f = q[LEFT + WIDTH * i + k]
            x0 += f * q[12 * WIDTH + k]
            x1 += f * q[13 * WIDTH + k]
            x2 += f * q[14 * WIDTH + k]
            x3 += f * q[15 * WIDTH + k]
            x4 += f * q[16 * WIDTH + k]
            x5 += f * q[17 * WIDTH + k]
        at = PRODUCT + 6 * i
        if local:
            q[at], q[at + 1], q[at + 2], q[at + 3], q[at + 4], q[at + 5] = x0, x1, x2, x3, x4, x5
        else:
            for j in range(6):
                q[at + j] = (
                    x0 * q[RIGHT + j]
                    + x1 * q[RIGHT + 6 + j]
                    + x2 * q[RIGHT + 12 + j]
                    + x3 * q[RIGHT + 18 + j]
                    + x4 * q[RIGHT + 24 + j]
                    + x5 * q[RIGHT + 30 + j]
                )
    for i in range(6):
        for j in range(i + 1):
            x = 0.5 * (q[PRODUCT + 6 * i + j] + q[PRODUCT + 6 * j + i])
            S[i, j] = x
            S[j, i] = x
        if planar:
            S[i, i] += OUTSIDE[i]


@njit(cache=True, error_model="numpy", inline="always")
def evaluate_any(
    case: CaseArrays, rows: PoseRows, n: int, w: Work, q: Array, quick: bool, d: Array
) -> bool:
    """w.S <- (Pi + Pi') / 2 by `evaluate_quick` if `quick`, else `evaluate`; False as there."""
    if quick:
        evaluate_quick(q, case.A.shape[0], case.scheme == IBVS, case.planar, d, w.S)
        return True
    return evaluate(case, rows, n, w, d)

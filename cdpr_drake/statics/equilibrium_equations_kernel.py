"""The equations of rest on taut cables as polynomials, with their derivatives, in complex numbers.

Unknown are the position p of Po, a quaternion q of any complex scale and, one a cable, its tension
per length and weight, lambda. With D = q.q, M(q) = D R(q), d_i = p - a_i, B_i = M b_i the equations
are, cable by cable and then for the platform,

    D (d_i.d_i + b_i.b_i - L_i) + 2 d_i.B_i = 0         its length squared is L_i
    sum lambda_i (D d_i + B_i) - D w = 0                forces
    sum lambda_i B_i x d_i - M c x w = 0                moments about Po
    alpha.q - 1 = 0                                     the scale of q

where c is the centre of mass and w the direction of the weight. All are homogeneous in q, so that
q may be scaled at any time and q and -q are one solution.
"""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array

UNKNOWNS_OF_POSE = 7
"""Position and quaternion; the unknowns of the cables come behind."""

CONSTANTS = 7
"""Numbers of a cable: a (3), b (3), L. The row behind the cables has c (3), w (3), 0."""


@njit(cache=True, error_model="numpy", inline="always")
def _cross(a: Array, b: Array, r: int) -> complex:
    s, t = (r + 1) % 3, (r + 2) % 3
    return a[s] * b[t] - a[t] * b[s]


@njit(cache=True, error_model="numpy")
def turned(q: Array, b: Array, B: Array, dB: Array) -> None:
    """Writes M(q) b into B, shape (3,), and its derivatives by q into dB, shape (4, 3)."""
    s, v = q[0], q[1:4]
    along = v[0] * b[0] + v[1] * b[1] + v[2] * b[2]
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    for r in range(3):
        side = _cross(v, b, r)
        B[r] = (s * s - square) * b[r] + 2.0 * v[r] * along + 2.0 * s * side
        dB[0, r] = 2.0 * s * b[r] + 2.0 * side
        for j in range(3):
            dB[1 + j, r] = -2.0 * v[j] * b[r] + 2.0 * v[r] * b[j]
        dB[1 + r, r] += 2.0 * along
    for j in range(3):
        k, m = (j + 1) % 3, (j + 2) % 3
        dB[1 + j, k] -= 2.0 * s * b[m]  # e_j x b
        dB[1 + j, m] += 2.0 * s * b[k]


@njit(cache=True, error_model="numpy")
def rest_equations(
    P: Array, dP: Array, x: Array, F: Array, J: Array, Fs: Array, work: Array
) -> None:
    """Left sides of the equations without the last, their derivatives by x and along dP.

    Args:
        P: Constants, shape (k + 1, 7), complex.
        dP: Direction in which constants change, same shape.
        x: p (3), q (4), lambda (k), complex.
        F: Left sides, written here, shape (k + 7,); the last is left alone.
        J: By x, written here, shape (k + 7, k + 7); the last row is left alone.
        Fs: Along dP, written here, shape (k + 7,).
        work: Shape (12, 3), complex.
    """
    k = P.shape[0] - 1
    q = x[3:7]
    D = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    B, dB, d, moved, unused = work[0], work[1:5], work[5], work[6], work[7:11]
    w = P[k, 3:6]
    F[: k + 6] = 0.0
    Fs[: k + 6] = 0.0
    J[: k + 6] = 0.0
    for i in range(k):
        a, b, da, db, tight = P[i, 0:3], P[i, 3:6], dP[i, 0:3], dP[i, 3:6], x[7 + i]
        turned(q, db, moved, unused)
        turned(q, b, B, dB)
        square, slope = -P[i, 6], -dP[i, 6]
        for r in range(3):
            d[r] = x[r] - a[r]
            square += d[r] * d[r] + b[r] * b[r]
            slope += 2.0 * (b[r] * db[r] - d[r] * da[r])
        F[i], Fs[i] = D * square, D * slope
        for r in range(3):
            F[i] += 2.0 * d[r] * B[r]
            Fs[i] += 2.0 * (d[r] * moved[r] - da[r] * B[r])
            J[i, r] = 2.0 * (D * d[r] + B[r])
        for j in range(4):
            J[i, 3 + j] = 2.0 * q[j] * square
            for r in range(3):
                J[i, 3 + j] += 2.0 * d[r] * dB[j, r]
        for r in range(3):
            f, g = k + r, k + 3 + r
            s, t = (r + 1) % 3, (r + 2) % 3
            pull, moment = D * d[r] + B[r], _cross(B, d, r)
            F[f] += tight * pull
            Fs[f] += tight * (moved[r] - D * da[r])
            J[f, r] += tight * D
            J[f, 7 + i] = pull
            F[g] += tight * moment
            Fs[g] += tight * (_cross(moved, d, r) - _cross(B, da, r))
            J[g, t] += tight * B[s]
            J[g, s] -= tight * B[t]
            J[g, 7 + i] = moment
            for j in range(4):
                J[f, 3 + j] += tight * (2.0 * q[j] * d[r] + dB[j, r])
                J[g, 3 + j] += tight * _cross(dB[j], d, r)
    turned(q, dP[k, 0:3], moved, unused)
    turned(q, P[k, 0:3], B, dB)
    for r in range(3):
        F[k + r] -= D * w[r]
        F[k + 3 + r] -= _cross(B, w, r)
        Fs[k + 3 + r] -= _cross(moved, w, r)
        for j in range(4):
            J[k + r, 3 + j] -= 2.0 * q[j] * w[r]
            J[k + 3 + r, 3 + j] -= _cross(dB[j], w, r)

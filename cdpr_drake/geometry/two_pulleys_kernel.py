"""Numba kernels for a cable with a swivelling pulley at the platform, or at both of its ends.

The pulley at the platform is that of `pulley_kernel` turned round: the cable is fixed inside the
platform, arrives at B along the swivel axis n_B, follows the groove of radius s and leaves it at
the tangent point B'. It turns with the platform, so n_B is a direction in P. The free part is a
line from A' to B'; the length from A to B counts both grooves, and

    length rate = u' v,   v the velocity of B' as a point of the platform,

since both pulleys swivel and turn freely: no torque about either swivel axis, none about either
wheel. So the cable pulls along the free line, and the arm of its moment is p_PB'_W.

With one pulley the line is in closed form, seen from that pulley's side. With two, each lies in the
plane that its swivel axis spans with the other's tangent point. Given the swivel angles, both
tangent points are in closed form; how far each is outside the other's plane, F = (y_A (B' - A),
y_B (A' - B)), is brought to zero by Newton's method on the two angles,

    dF = [[-rho_A, c o_B], [c o_A, -rho_B]] (dphi_A, dphi_B),   c = y_A y_B,

with rho the distance of a tangent point from the other's axis, o that from its own axis, y the
planes' normals. Where the cable leaves both pulleys away from their axes rho > o, and the matrix is
regular; two rounds of seeing each pulley from the other's tangent point, which near the solution
come closer by c^2 o_A o_B / (rho_A rho_B) each, are where it starts. Tangent points move along the
line as the angles change, which is why they may be those of the step before.

Source: servoing thesis 1.3.1 for one pulley; Pott, Cable-Driven Parallel Robots, 2018, 3.2; the two
together are derived here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared

ANCHOR_RADIUS, ANCHOR_AXIS = 13, 14
"""Columns of `CableSet.packed()`: radius s of the groove at the platform [m], its axis in P (3)."""

ROUNDS = 2
"""Rounds of seeing each pulley from the other's tangent point before Newton's method."""

STEPS = 40
"""Newton steps after which a cable is given up; four are usual."""

SETTLED = 1e-7
"""A step of the angles [rad], and of the tangent points relative to their distance, after which one
more is exact: it would be the square of this."""

_LARGEST_TURN = 0.5

_POSE = types.UniTuple(types.float64, 12)


@njit(cache=True, error_model="numpy")
def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy")
def _cross(a: Any, b: Any) -> Any:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True, error_model="numpy")
def _minus(a: Any, b: Any) -> Any:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@njit(cache=True, error_model="numpy")
def _toward(n: Any, d: Any) -> Any:
    """Unit vector from the axis along n to a point at d from its foot."""
    h = _dot(d, n)
    x, y, z = d[0] - h * n[0], d[1] - h * n[1], d[2] - h * n[2]
    per = 1.0 / np.sqrt(x * x + y * y + z * z)
    return (x * per, y * per, z * per)


@njit(cache=True, error_model="numpy")
def _leaves(foot: Any, n: Any, e: Any, r: Any, to: Any) -> Any:
    """Where a cable leaves a groove in the plane (e, n) for a point `to`.

    Returns:
        (point, sine, cosine, o, rho): tangent point, alpha of `pulley_kernel`, distance of that
        point from the axis, and of `to`; NaN where no cable runs.
    """
    d = _minus(to, foot)
    rho, h = _dot(d, e), _dot(d, n)
    if r == 0.0:
        return foot, 0.0 * r, 0.0 * r, 0.0 * r, rho
    square = rho * rho + h * h - 2.0 * r * rho
    if not (square > 0.0 and rho > 0.0):
        nothing = np.nan * r
        return foot, nothing, nothing, nothing, nothing
    L, mx = np.sqrt(square), rho - r
    per_square = 1.0 / (mx * mx + h * h)
    sine = (L * mx + r * h) * per_square
    if h >= 0.0 and sine < 0.0:
        sine = 0.0 * sine
    cosine = (r * mx - L * h) * per_square
    o, up = r * (1.0 + cosine), r * sine
    point = (
        foot[0] + o * e[0] + up * n[0], foot[1] + o * e[1] + up * n[1],
        foot[2] + o * e[2] + up * n[2],
    )  # fmt: skip
    return point, sine, cosine, o, rho


@njit(cache=True, error_model="numpy")
def _swivelled(e: Any, y: Any, angle: Any) -> Any:
    c, s = np.cos(angle), np.sin(angle)
    return (c * e[0] + s * y[0], c * e[1] + s * y[1], c * e[2] + s * y[2])


@njit(cache=True, error_model="numpy")
def _newton(A: Any, nA: Any, r: Any, B: Any, nB: Any, s: Any, eA: Any, eB: Any, TB: Any) -> Any:
    """One step on the two swivel angles: directions, tangent points and the angles' changes."""
    TA, _, _, oA, rhoA = _leaves(A, nA, eA, r, TB)
    TB, _, _, oB, rhoB = _leaves(B, nB, eB, s, TA)
    yA, yB = _cross(nA, eA), _cross(nB, eB)
    FA, FB = _dot(yA, _minus(TB, A)), _dot(yB, _minus(TA, B))
    c = _dot(yA, yB)
    per = 1.0 / (rhoA * rhoB - c * c * oA * oB)
    dA = (rhoB * FA + c * oB * FB) * per
    dB = (c * oA * FA + rhoA * FB) * per
    return _swivelled(eA, yA, dA), _swivelled(eB, yB, dB), TA, TB, dA, dB


@njit(cache=True, error_model="numpy")
def _solved(A: Any, nA: Any, r: float, B: Any, nB: Any, s: float) -> Any:
    """Directions of both swivels, a tangent point, and whether they are found."""
    TA, TB = A, B
    eA, eB = _toward(nA, _minus(TB, A)), _toward(nB, _minus(TA, B))
    for _ in range(ROUNDS):
        eA = _toward(nA, _minus(TB, A))
        TA = _leaves(A, nA, eA, r, TB)[0]
        eB = _toward(nB, _minus(TA, B))
        TB = _leaves(B, nB, eB, s, TA)[0]
    before = TA
    for _ in range(STEPS):
        eA, eB, TA, TB, dA, dB = _newton(A, nA, r, B, nB, s, eA, eB, TB)
        turn = max(abs(dA), abs(dB))
        if not turn <= _LARGEST_TURN:
            return eA, eB, TB, False
        move, apart = _minus(TA, before), _minus(TB, TA)
        before = TA
        if turn <= SETTLED and _dot(move, move) <= SETTLED * SETTLED * _dot(apart, apart):
            return eA, eB, TB, True
    return eA, eB, TB, False


@njit(cache=True, error_model="numpy")
def _alternated(A: Any, nA: Any, r: float, B: Any, nB: Any, s: float) -> Any:
    """The same by rounds alone, where Newton's method went astray: slower, but it never jumps."""
    TA, TB = A, B
    eA, eB = _toward(nA, _minus(TB, A)), _toward(nB, _minus(TA, B))
    for _ in range(50 * STEPS):
        last = TA
        eA = _toward(nA, _minus(TB, A))
        TA = _leaves(A, nA, eA, r, TB)[0]
        eB = _toward(nB, _minus(TA, B))
        TB = _leaves(B, nB, eB, s, TA)[0]
        move, apart = _minus(TA, last), _minus(TB, TA)
        if _dot(move, move) <= 1e-20 * _dot(apart, apart):
            return eA, eB, TB, True
    return eA, eB, TB, False


@njit(cache=True, error_model="numpy")
def begin_swivels(A: Any, nA: Any, r: float, B: Any, nB: Any, s: float) -> Any:
    """Directions of both swivels and the tangent point at the platform, by iterations; NaN: none.

    Args:
        A: Where the cable enters the groove at the frame [m].
        nA: Swivel axis there.
        r: Radius there [m].
        B: Where it enters the groove at the platform [m].
        nB: Swivel axis there, in W.
        s: Radius there [m].
    """
    eA, eB, TB, good = _solved(A, nA, r, B, nB, s)
    if not good:
        eA, eB, TB, good = _alternated(A, nA, r, B, nB, s)
    if not good:
        eA = (np.nan, np.nan, np.nan)
    return eA, eB, TB


@njit(cache=True, error_model="numpy")
def swivels(A: Any, nA: Any, r: Any, B: Any, nB: Any, s: Any) -> Any:
    """Directions of both swivels and the tangent point at the platform; NaN: none.

    On scalars with derivatives `begin_swivels` finds them as numbers: the steps behind it change
    nothing but give them the derivatives of the implicit function.
    """
    eA, eB, TB = begin_swivels(A, nA, r, B, nB, s)
    eA, eB = _toward(nA, eA), _toward(nB, eB)  # axes may have derivatives, to which e is normal
    for _ in range(3):
        eA, eB, _, TB, _, _ = _newton(A, nA, r, B, nB, s, eA, eB, TB)
    return eA, eB, TB


@njit(cache=True, error_model="numpy")
def platform_pulley(X: Motion, cable: Array) -> Any:
    """Entry point B and swivel axis of the pulley at the platform, in W."""
    b = (cable[3], cable[4], cable[5])
    n = (cable[14], cable[15], cable[16])
    B = (
        X[9] + X[0] * b[0] + X[1] * b[1] + X[2] * b[2],
        X[10] + X[3] * b[0] + X[4] * b[1] + X[5] * b[2],
        X[11] + X[6] * b[0] + X[7] * b[1] + X[8] * b[2],
    )
    axis = (
        X[0] * n[0] + X[1] * n[1] + X[2] * n[2],
        X[3] * n[0] + X[4] * n[1] + X[5] * n[2],
        X[6] * n[0] + X[7] * n[1] + X[8] * n[2],
    )
    return B, axis


@njit(cache=True, error_model="numpy")
def free_line(X: Motion, cable: Array) -> Any:
    """The free part of a cable with a pulley at the platform, and what lies in the grooves.

    Args:
        X: Pose of the platform, see `pulley_kernel.pulley_plane`.
        cable: One row of `CableSet.packed()`, shape (17,), its radius at the platform above 0.

    Returns:
        (free, arc_A, arc_B, TA, TB, eA, eB, sineA, cosineA, sineB, cosineB, rhoA, rhoB): length of
        the free part and in the grooves [m], tangent points in W [m], directions of the swivels,
        angles alpha of both, distance of each tangent point from the other's axis [m]. NaN where no
        cable runs.
    """
    A, nA, r, s = (
        (cable[0], cable[1], cable[2]),
        (cable[10], cable[11], cable[12]),
        cable[8],
        cable[13],
    )
    B, nB = platform_pulley(X, cable)
    if r == 0.0:
        eB = _toward(nB, _minus(A, B))
        eA, TB = eB, _leaves(B, nB, eB, s, A)[0]
    else:
        eA, eB, TB = swivels(A, nA, r, B, nB, s)
    TA, sineA, cosineA, _, rhoA = _leaves(A, nA, eA, r, TB)
    TB, sineB, cosineB, _, rhoB = _leaves(B, nB, eB, s, TA)
    d = _minus(TB, TA)
    arcA = r * (np.pi - np.arctan2(sineA, cosineA))
    arcB = s * (np.pi - np.arctan2(sineB, cosineB))
    return (
        np.sqrt(_dot(d, d)), arcA, arcB, TA, TB, eA, eB, sineA, cosineA, sineB, cosineB, rhoA, rhoB
    )  # fmt: skip


@shared(types.UniTuple(types.float64, 7)(_POSE, VECTOR))
@njit(cache=True, error_model="numpy")
def two_pulleys_line(X: Motion, cable: Array) -> Any:
    """As `pulley_kernel.pulley_line`, with the arm of B', where the free line ends."""
    free, arcA, arcB, TA, TB, _, _, _, _, _, _, _, _ = free_line(X, cable)
    per = 1.0 / free
    return (
        free + arcA + arcB,
        (TB[0] - TA[0]) * per, (TB[1] - TA[1]) * per, (TB[2] - TA[2]) * per,
        TB[0] - X[9], TB[1] - X[10], TB[2] - X[11],
    )  # fmt: skip


@shared(types.UniTuple(types.float64, 11)(_POSE, VECTOR))
@njit(cache=True, error_model="numpy")
def two_pulleys_geometry(X: Motion, cable: Array) -> Any:
    """As `pulley_kernel.pulley_geometry`: arcs of both grooves together, and the arm of B'."""
    free, arcA, arcB, TA, TB, _, _, _, _, _, _, _, _ = free_line(X, cable)
    per = 1.0 / free
    return (
        free, arcA + arcB, TA[0], TA[1], TA[2],
        (TB[0] - TA[0]) * per, (TB[1] - TA[1]) * per, (TB[2] - TA[2]) * per,
        TB[0] - X[9], TB[1] - X[10], TB[2] - X[11],
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _turning_of_line(
    r: Any, n: Any, e: Any, sine: Any, cosine: Any, rho: Any, u: Any, L: Any, out: Array
) -> None:
    """How a line that keeps touching a pulley turns with one of its points, at L from it."""
    y = _cross(n, e)
    for i in range(3):
        for j in range(3):
            if r == 0.0:
                out[i, j] = ((1.0 if i == j else 0.0) - u[i] * u[j]) / L
            else:
                c_i, c_j = cosine * e[i] + sine * n[i], cosine * e[j] + sine * n[j]
                out[i, j] = c_i * c_j / L + sine / rho * y[i] * y[j]


@shared(types.void(_POSE, VECTOR, MATRIX))
@njit(cache=True, error_model="numpy")
def line_by_pose(X: Motion, cable: Array, out: Array) -> None:
    """Writes how the free line changes with the pose (turn, translation) in W, shape (6, 6).

    Rows: moment of the line about the moved Po, r x u [m/rad, -], and u [1/rad, 1/m]; with a
    tension they are the stiffness that it gives. Not symmetric in the turns, see
    `statics.stiffness`.

    Seen from A the line turns by D_A x where its point at B' moves by x; seen from the platform by
    -D_B (y - what the platform moves at A'), y = x - L D_A x being how its point at A' moves.

    Args:
        X: Pose of the platform.
        cable: One row of `CableSet.packed()`, shape (17,), its radius at the platform above 0.
        out: Where it is written.
    """
    L, _, _, TA, TB, eA, eB, sineA, cosineA, sineB, cosineB, rhoA, rhoB = free_line(X, cable)
    u = ((TB[0] - TA[0]) / L, (TB[1] - TA[1]) / L, (TB[2] - TA[2]) / L)
    back = (-u[0], -u[1], -u[2])
    nA, (_, nB) = (cable[10], cable[11], cable[12]), platform_pulley(X, cable)
    DA, DB, M, right = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 6))
    _turning_of_line(cable[8], nA, eA, sineA, cosineA, rhoA, u, L, DA)
    _turning_of_line(cable[13], nB, eB, sineB, cosineB, rhoB, back, L, DB)
    far = (TA[0] - X[9], TA[1] - X[10], TA[2] - X[11])
    near = (TB[0] - X[9], TB[1] - X[10], TB[2] - X[11])
    for i in range(3):
        for j in range(3):
            M[i, j] = DA[i, j] + DB[i, j] + u[i] * u[j] / L
            for k in range(3):
                M[i, j] -= L * DB[i, k] * DA[k, j]
            right[i, 3 + j] = DB[i, j]
        # The platform's turn: minus [u]x, and D_B times minus [far]x.
        a, b = (i + 1) % 3, (i + 2) % 3
        right[i, a] += u[b]
        right[i, b] -= u[a]
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            right[i, j] += DB[i, d] * far[c] - DB[i, c] * far[d]
    moved = np.linalg.solve(M, right)
    for j in range(6):
        x = (moved[0, j], moved[1, j], moved[2, j])
        du = (
            DA[0, 0] * x[0] + DA[0, 1] * x[1] + DA[0, 2] * x[2],
            DA[1, 0] * x[0] + DA[1, 1] * x[1] + DA[1, 2] * x[2],
            DA[2, 0] * x[0] + DA[2, 1] * x[1] + DA[2, 2] * x[2],
        )
        beside = (
            x[0] - (1.0 if j == 3 else 0.0), x[1] - (1.0 if j == 4 else 0.0),
            x[2] - (1.0 if j == 5 else 0.0),
        )  # fmt: skip
        first, second = _cross(beside, u), _cross(near, du)
        for i in range(3):
            out[i, j] = first[i] + second[i]
            out[3 + i, j] = du[i]


@njit(cache=True, error_model="numpy")
def add_platform_turning(X: Motion, cable: Array, tension: float, K: Array) -> None:
    """Adds what a pulley at the platform adds to the stiffness by a tension; nothing without one.

    Whoever adds up stiffness takes the anchor point as fixed to the platform, at the arm of
    `pulley_line`, with the derivative of u by p_WB, `unit_vector_derivative`. With a pulley at the
    platform the line also moves in the platform; this is the difference.

    Args:
        X: Pose of the platform, see `pulley_kernel.pulley_plane`.
        cable: One row of `CableSet.packed()`, shape (17,).
        tension: Tension [N].
        K: Stiffness by (turn, translation) in W about Po, shape (6, 6), changed.
    """
    if cable[13] > 0.0:
        _add_turning(X[:12], cable, tension, K)


@shared(types.void(_POSE, VECTOR, types.float64, MATRIX))
@njit(cache=True, error_model="numpy")
def _add_turning(X: Motion, cable: Array, tension: float, K: Array) -> None:
    """As `add_platform_turning`, with a pulley at the platform."""
    T = np.empty((6, 6))
    line_by_pose(X, cable, T)
    _, ux, uy, uz, rx, ry, rz = two_pulleys_line(X, cable)
    r, u = (rx, ry, rz), (ux, uy, uz)
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            # As of an anchor point at r that is fixed: [[(U - S D) S, S D], [-D S, D]].
            turn = r[i] * u[j] - r[a] * (T[3 + b, 3 + c] * r[d] - T[3 + b, 3 + d] * r[c])
            turn += r[b] * (T[3 + a, 3 + c] * r[d] - T[3 + a, 3 + d] * r[c])
            if i == j:
                turn -= r[0] * u[0] + r[1] * u[1] + r[2] * u[2]
            K[i, j] += tension * (T[i, j] - turn)
            fixed = r[a] * T[3 + b, 3 + j] - r[b] * T[3 + a, 3 + j]
            K[i, 3 + j] += tension * (T[i, 3 + j] - fixed)
            fixed = -(T[3 + i, 3 + c] * r[d] - T[3 + i, 3 + d] * r[c])
            K[3 + i, j] += tension * (T[3 + i, j] - fixed)

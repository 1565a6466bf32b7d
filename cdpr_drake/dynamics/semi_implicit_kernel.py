"""Numba kernels for one semi-implicit step: stable with stiff cables whatever its length.

It is the two-stage Rosenbrock method ROS2 with gamma = 1 + 1 / sqrt(2),

    (1 - gamma h A) k_1 = f(y),   (1 - gamma h A) k_2 = f(y + h k_1) - 2 k_1,
    y <- y + h (3 k_1 + k_2) / 2,

of second order for any matrix A and damping infinitely fast motions at once where A is their
Jacobian. The other root, 1 - 1 / sqrt(2), has the smaller error, but y + h k_1 then overshoots what
is infinitely stiff by 2.4 times, and cables that only pull answer to that with blows: a platform on
cables of 350 kN bounced and was lost with steps of 5 and 10 ms.

A holds what is stiff: how the pull of each cable changes with the pose, with its unstrained length
and with their rates, how motors answer to tension and speed, and the spring of contacts that rub. A
cable that would become stiffer within the step counts as stiff already, or its catching would be
met by the second stage alone, as a blow that puts energy in. Weight and gyroscopic moments are left
to f. Vibrations faster than the step are damped away; what is slower is followed. Poses are stepped
by rotation vectors in W.

Source: Verwer, Spee, Blom and Hundsdorfer, SIAM J. Sci. Comput. 20, 1999, ROS2; Iserles et al.,
Acta Numerica 9, 2000, for steps on rotations.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.behaving_kernel import CREEP
from cdpr_drake.cables.dispatch_kernel import cable_response
from cdpr_drake.dynamics.contact_kernel import (
    CONTACTS,
    bend_by_stage,
    push_by_contacts,
    stiffen_by_contacts,
)
from cdpr_drake.dynamics.explicit_kernel import command_at
from cdpr_drake.dynamics.platform_kernel import mass_in_world
from cdpr_drake.dynamics.robot_arrays import (
    CREEPING,
    DAMPING,
    DRIVE,
    IDEAL,
    LAW,
    MODE,
    MOTORS,
    PLATFORM,
    RUB,
    RUBBING,
    SPEEDS,
    TENSIONS,
    RobotArrays,
)
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK, robot_rates
from cdpr_drake.geometry.motion_kernel import Motion, joint_motion
from cdpr_drake.geometry.rotation_kernel import turn_pose
from cdpr_drake.numerics.linear_algebra_kernel import eliminate, substitute
from cdpr_drake.winches.motor_kernel import winch_rates

GAMMA = 1.0 + np.sqrt(0.5)

TENSION_CHANGE, RATE_CHANGE = 1e-3, 1e-6
"""Differences by which motors are differentiated [N, m/s]: far above rounding, far below where
limits and friction bend the law."""

_RETARDATION, _HEIGHT = 7, 1


@njit(cache=True)
def _cross(a: Array, b: Array, out: Array) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _anchor_columns(rx: float, ry: float, rz: float, nv: int, g: Array) -> None:
    """How the anchor point moves with each velocity of the platform, rows of g, shape (nv, 3)."""
    g[:nv] = 0.0
    if nv == 1:
        g[0, 0] = 1.0
        return
    if nv == 3:
        g[0, 0] = 1.0
        g[1, 1] = 1.0
        g[2, 0], g[2, 1] = -ry, rx
        return
    g[0, 1], g[0, 2] = -rz, ry
    g[1, 0], g[1, 2] = rz, -rx
    g[2, 0], g[2, 1] = -ry, rx
    g[3, 0], g[4, 1], g[5, 2] = 1.0, 1.0, 1.0


@njit(cache=True)
def _motor_slopes(robot: RobotArrays, rates: Array, command: Array, brakes: Array) -> None:
    """How length accelerations change with tension and rate: `robot.vectors[0]`, `[1]`."""
    n, nv, mode = robot.kinds[PLATFORM], robot.kinds[SPEEDS], robot.kinds[MODE]
    m = robot.cables.shape[0]
    y, moved, out = robot.work[0], robot.work[6], robot.work[7]
    drums, more = robot.force[nv:], robot.vectors[2][:m]
    for i in range(m):
        more[i] = drums[i] + TENSION_CHANGE
    winch_rates(y[n:], more, command, brakes, robot.home, mode, robot.winch, out[n:])
    for i in range(m):
        robot.vectors[0, i] = (out[n + m + i] - rates[n + m + i]) / TENSION_CHANGE
    moved[:] = y
    for i in range(m):
        moved[n + m + i] += RATE_CHANGE
    winch_rates(moved[n:], drums, command, brakes, robot.home, mode, robot.winch, out[n:])
    for i in range(m):
        robot.vectors[1, i] = (out[n + m + i] - rates[n + m + i]) / RATE_CHANGE


@njit(cache=True)
def _moved(robot: RobotArrays, k: Array, h: float, out: Array) -> None:
    """Writes `robot.work[0]` moved by h times displacements, velocities and winches of k."""
    n, nv, y = robot.kinds[PLATFORM], robot.kinds[SPEEDS], robot.work[0]
    if nv < 6:
        for i in range(nv):
            out[i] = y[i] + h * k[i]
    else:
        out[:4] = y[:4]
        turn_pose(out, h * k[0], h * k[1], h * k[2])
        for i in range(3):
            out[4 + i] = y[4 + i] + h * k[3 + i]
    for i in range(nv):
        out[n - nv + i] = y[n - nv + i] + h * k[nv + i]
    for i in range(n, y.shape[0]):
        out[i] = y[i] + h * k[2 * nv + i - n]


@njit(cache=True)
def _response(robot: RobotArrays, X: Motion, i: int, l0: float) -> tuple[float, ...]:
    """Stiffness of a cable along its pull [N/m], 0 where slack, the pull's direction, and its arm.

    Its derivatives are left in `robot.D`.
    """
    px, py, pz, t, _, _, _, _, rx, ry, rz, good = cable_response(
        robot.kinds[LAW], X, robot.cables[i], l0, robot.guesses[i], robot.inner, robot.D
    )
    if not good or not t > 0.0:
        return 0.0, 0.0, 0.0, 0.0, rx, ry, rz
    if robot.kinds[CREEPING] > 0:  # what creeps away in the end is stiff within a step
        for r in range(robot.D.shape[0]):
            for c in range(4):
                robot.D[r, c] *= 1.0 + robot.cables[i, CREEP]
    ux, uy, uz, D = px / t, py / t, pz / t, robot.D
    along = (
        ux * (D[0, 0] * ux + D[0, 1] * uy + D[0, 2] * uz)
        + uy * (D[1, 0] * ux + D[1, 1] * uy + D[1, 2] * uz)
        + uz * (D[2, 0] * ux + D[2, 1] * uy + D[2, 2] * uz)
    )
    return along, ux, uy, uz, rx, ry, rz


@njit(cache=True)
def _stiffer_response(
    robot: RobotArrays, X: Motion, ahead: Motion, i: int, l0: float, l0_ahead: float
) -> tuple[float, ...]:
    """`_response` here or ahead, where the cable is stiffer."""
    later = _response(robot, ahead, i, l0_ahead)
    now = _response(robot, X, i, l0)
    if later[0] > now[0]:
        return _response(robot, ahead, i, l0_ahead)
    return now


@njit(cache=True)
def linearise(robot: RobotArrays, rates: Array, command: Array, brakes: Array, h: float) -> None:
    """Writes mass, stiffness and damping about `robot.work[0]` to `robot.matrices`.

    Velocities are those of the platform and, with motors, length rates. The force on the platform
    and the accelerations of lengths fall by K times a displacement, D times a velocity. What ideal
    winches add to the force by paying out is in `robot.vectors[3]`.

    Args:
        robot: The robot.
        rates: Derivative of its state, shape (n,).
        command: The command, shape (m,).
        brakes: See `robot_rates`.
        h: How far to look ahead for cables that become stiffer [s].
    """
    n, nv, drive = robot.kinds[PLATFORM], robot.kinds[SPEEDS], robot.kinds[DRIVE]
    m, y = robot.cables.shape[0], robot.work[0]
    M, K, D = robot.matrices[0], robot.matrices[1], robot.matrices[2]
    M[:], K[:], D[:] = 0.0, 0.0, 0.0
    mass_in_world(y[:n], robot.body, M)
    for i in range(nv):
        turns = i == 2 if nv == 3 else nv == 6 and i < 3
        D[i, i] = robot.body[DAMPING + 1] if turns else robot.body[DAMPING]
    paid = robot.vectors[3]
    paid[:] = 0.0
    if drive == TENSIONS:
        return
    if drive == MOTORS:
        _motor_slopes(robot, rates, command, brakes)
    X = joint_motion(y[:n], robot.room[_HEIGHT])
    kept, g, slope = robot.work[6], robot.inner, robot.D
    for i in range(nv):
        kept[i], kept[nv + i] = y[n - nv + i], 0.0
    for i in range(n, y.shape[0]):
        kept[2 * nv + i - n] = rates[i]
    _moved(robot, kept, h, robot.work[7])
    ahead = joint_motion(robot.work[7][:n], robot.room[_HEIGHT])
    j, kg = robot.vectors[4], robot.vectors[5]
    for i in range(m):
        along, ux, uy, uz, rx, ry, rz = _stiffer_response(
            robot, X, ahead, i, y[n + i], robot.work[7][n + i]
        )
        if along == 0.0:
            if drive == MOTORS:
                M[nv + i, nv + i] = 1.0
                D[nv + i, nv + i] = -robot.vectors[1, i]
            continue
        T = robot.cables[i, _RETARDATION]
        _anchor_columns(rx, ry, rz, nv, g)
        for c in range(nv):
            j[c] = g[c, 0] * ux + g[c, 1] * uy + g[c, 2] * uz
        for c in range(nv):
            for a in range(3):
                kg[a] = slope[a, 0] * g[c, 0] + slope[a, 1] * g[c, 1] + slope[a, 2] * g[c, 2]
            for r in range(nv):
                K[r, c] += g[r, 0] * kg[0] + g[r, 1] * kg[1] + g[r, 2] * kg[2]
                D[r, c] += T * along * j[r] * j[c]
        for r in range(nv):
            by_length = g[r, 0] * slope[0, 3] + g[r, 1] * slope[1, 3] + g[r, 2] * slope[2, 3]
            if drive == IDEAL:
                paid[r] += by_length * rates[n + i]
            else:
                K[r, nv + i] = by_length
                D[r, nv + i] = T * slope[3, 3] * j[r]
        if drive == MOTORS:
            pull, own = robot.vectors[0, i], robot.vectors[1, i]
            M[nv + i, nv + i] = 1.0
            for c in range(nv):
                by_pose = g[c, 0] * slope[4, 0] + g[c, 1] * slope[4, 1] + g[c, 2] * slope[4, 2]
                K[nv + i, c] = -pull * by_pose
                D[nv + i, c] = -pull * T * by_pose
            K[nv + i, nv + i] = -pull * slope[4, 3]
            D[nv + i, nv + i] = -own - pull * T * slope[4, 3]


@njit(cache=True)
def _stage(robot: RobotArrays, right: Array, share: float, paying: float, k: Array) -> None:
    """Solves for a stage: right hand side and k hold displacements, velocities, winches."""
    nv, drive = robot.kinds[SPEEDS], robot.kinds[DRIVE]
    m, nw = robot.cables.shape[0], right.shape[0]
    M, K, S = robot.matrices[0], robot.matrices[1], robot.matrices[3]
    x, paid = robot.vectors[6], robot.vectors[3]
    size = nv + m if drive == MOTORS else nv
    first = 2 * nv
    for r in range(nv):
        total = -share * paying * paid[r]
        for c in range(nv):
            total += M[r, c] * right[nv + c] - share * K[r, c] * right[c]
        for c in range(nv, size):
            total -= share * K[r, c] * right[first + c - nv]
        x[r] = total
    for r in range(nv, size):
        i = r - nv
        total = right[first + m + i] - share * K[r, r] * right[first + i]
        for c in range(nv):
            total -= share * K[r, c] * right[c]
        x[r] = total
    turns, y, law = robot.kinds[RUBBING], robot.work[0], robot.body[RUB : RUB + CONTACTS]
    at = nw - robot.kinds[CREEPING] - turns
    if turns > 0:
        push_by_contacts(y, turns, law, share, right[at : at + turns], x)
    substitute(S, size, robot.vectors[7], x)
    for c in range(nv):
        k[nv + c] = x[c]
        k[c] = right[c] + share * x[c]
    for i in range(first, nw):
        k[i] = right[i]
    if drive == MOTORS:
        for i in range(m):
            k[first + m + i] = x[nv + i]
            k[first + i] = right[first + i] + share * x[nv + i]
    if turns > 0:
        bend_by_stage(y, turns, share, x, k[at : at + turns])


@njit(cache=True, inline="always")
def semi_implicit_step(
    robot: RobotArrays, h: float, command: Array, rate: Array, brakes: Array, time: float,
    plain: bool,
) -> int:  # fmt: skip
    """One step as `explicit_step` takes it; what stands in `robot.work[2]` is of first order."""
    n, nv = robot.kinds[PLATFORM], robot.kinds[SPEEDS]
    y, new, low, f, k1, k2 = (
        robot.work[0], robot.work[1], robot.work[2], robot.work[3], robot.work[4], robot.work[5]
    )  # fmt: skip
    size = 2 * nv + y.shape[0] - n
    right, now = robot.work[7], robot.command
    command_at(command, rate, time, now)
    bad = robot_rates(robot, y, now, brakes, plain, f)
    if bad != INTEGRATION_OK:
        return bad
    linearise(robot, f, now, brakes, h)
    M, K, D, S = robot.matrices[0], robot.matrices[1], robot.matrices[2], robot.matrices[3]
    share = GAMMA * h
    for r in range(S.shape[0]):
        for c in range(S.shape[0]):
            S[r, c] = M[r, c] + share * (D[r, c] + share * K[r, c])
    if robot.kinds[RUBBING] > 0:
        law = robot.body[RUB : RUB + CONTACTS]
        stiffen_by_contacts(y, robot.kinds[RUBBING], law, share, S)
    eliminate(S, S.shape[0], robot.vectors[7])
    for i in range(nv):
        right[i], right[nv + i] = y[n - nv + i], f[n - nv + i]
    for i in range(n, y.shape[0]):
        right[2 * nv + i - n] = f[i]
    _stage(robot, right[:size], share, 1.0, k1)
    _moved(robot, k1, h, low)
    command_at(command, rate, time + h, now)
    bad = robot_rates(robot, low, now, brakes, plain, f)
    if bad != INTEGRATION_OK:
        return bad
    for i in range(nv):
        right[i], right[nv + i] = low[n - nv + i], f[n - nv + i] - 2.0 * k1[nv + i]
    if nv == 6:  # rotation vectors from the start of the step turn a little differently than w
        bend = robot.vectors[4]
        _cross(k1, right, bend)
        for i in range(3):
            right[i] -= 0.5 * h * bend[i]
    for i in range(nv):
        right[i] -= 2.0 * k1[i]
    for i in range(n, y.shape[0]):
        right[2 * nv + i - n] = f[i] - 2.0 * k1[2 * nv + i - n]
    _stage(robot, right[:size], share, -1.0, k2)
    for i in range(size):
        k2[i] = 1.5 * k1[i] + 0.5 * k2[i]
    _moved(robot, k2, h, new)
    return bad

"""One step of the law of visual servoing as a numba kernel, for blocks and for compiled loops.

From features s, their interaction matrix L and what they should be, to cable velocities:

    U = L^+ (-lambda e + ds*/dt - b) + (1 - L^+ L) V_2,
    V_C = U + (V_0 - lambda U_0 / lambda_0) exp(-sigma t),

or U by the partition of `partitioned_law_kernel`, or of the features that `switching_law_kernel`
chooses; then the platform's twist, cable velocities by the believed robot's Jacobian, and one share
for all where a cable would be too fast. All numbers come and go in arrays, so that a loop that is
compiled as a whole can call it for every step: `ServoController` says what goes into them, and is
what calls it in a diagram.

Source: servoing thesis (1.31), (1.35), (1.39), (4.2).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_rates import (
    base_adjoint,
    cable_rates_from_base_twist,
    cable_rates_from_platform_twist,
)
from cdpr_drake.geometry.poses import adjoint_of_arrays
from cdpr_drake.numerics.kernel_calls import array_addresses, integers_at, matrix_at, vector_at
from cdpr_drake.numerics.linear_algebra_kernel import least_squares
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.servoing.packed_features_kernel import call_features, pose_parts
from cdpr_drake.servoing.partitioned_law_kernel import partitioned_twist
from cdpr_drake.servoing.servo_law import (
    BEFORE,
    BEGUN,
    CABLE_SPEED,
    FEATURES,
    GAIN_AT_INFINITY,
    GAIN_AT_ZERO,
    GAIN_SLOPE,
    IMAGE_MODE,
    IN_BASE_FRAME,
    KIND,
    MODE,
    PARTITIONED,
    POSE_ROWS,
    SIGMA,
    SIGN,
    SWITCHING,
    TASK,
    TOWARD,
    TWIST,
    YAW_ANGLE,
    YAW_GAIN,
    adaptive_gain,
    saturation_share,
)
from cdpr_drake.servoing.switching_law_kernel import has_to_switch, switch_mode, take_bounds

CURRENT, DESIRED, MEAN = range(3)
"""Interaction matrices, in the order of `servo_task.INTERACTIONS`."""

FADED = 1e-12
"""What is left of a start below this share is nothing."""


@njit(cache=True)
def task_at(begins: Array, memory: Array, time: float) -> int:
    """Number of the task of now; one that takes over begins anew, from the twist of the last.

    Args:
        begins: Times at which tasks take over, shape (n,) [s].
        memory: As in `servo_step`; changed.
        time: Time [s].
    """
    number = int(memory[TASK])
    while number + 1 < begins.shape[0] and time >= begins[number + 1]:
        number += 1
        memory[BEGUN] = -1.0
        for i in range(6):
            memory[BEFORE + i] = memory[TWIST + i]
    memory[TASK] = number
    return number


@shared(VECTOR(VECTOR, MATRIX, VECTOR, VECTOR, types.int64[::1]))
@njit(cache=True)
def _planar_twist(law: Array, L: Array, rate: Array, X_PC: Array, motions: np.ndarray) -> Array:
    """U of a planar robot, shape (6,), with motions that it has alone."""
    R_PC, p_PC = pose_parts(X_PC)
    n = motions.shape[0]
    R_CP = np.ascontiguousarray(R_PC.T)
    Ad = adjoint_of_arrays(R_CP, -R_CP @ p_PC)
    basis = np.empty((6, n))
    for j in range(n):
        for i in range(6):
            basis[i, j] = law[SIGN] * Ad[i, motions[j]]
    return basis @ least_squares(L @ basis, rate, L.shape[1])[0]


@njit(cache=True, inline="always")
def _wanted_twist(
    law: Array, rank: int, L: Array, rate: Array, X_PC: Array, R_WP: Array, motions: np.ndarray
) -> Array:
    """U, shape (6,); see the module. Of a planar robot, only with motions that it has."""
    if motions.shape[0] < 6:
        return _planar_twist(law, L, rate, X_PC, motions)
    R_PC, _ = pose_parts(X_PC)
    wanted, free = least_squares(L, rate, rank)
    if not math.isnan(law[YAW_GAIN]):
        # V_2 turns the platform about the vertical towards the wanted yaw.
        angle = law[YAW_ANGLE] - math.atan2(R_WP[1, 0], R_WP[0, 0])
        turn = law[SIGN] * law[YAW_GAIN] * math.atan2(math.sin(angle), math.cos(angle))
        for j in range(3):
            up = 0.0
            for k in range(3):
                up += R_WP[2, k] * R_PC[k, j]
            for i in range(6):
                wanted[i] += free[i, j] * turn * up
    return wanted


@shared(
    types.Tuple((VECTOR, types.float64))(
        VECTOR, types.int64, VECTOR, VECTOR, MATRIX, MATRIX, VECTOR, MATRIX, types.int64[::1],
        VECTOR,
    )
)  # fmt: skip
@njit(cache=True)
def _asked_twist(
    law: Array, rank: int, s: Array, e: Array, L: Array, reference: Array, X_PC: Array,
    R_WP: Array, motions: np.ndarray, memory: Array,
) -> tuple[Array, float]:  # fmt: skip
    """U of the features that count now, shape (6,), and lambda [1/s]."""
    first, end = 0, e.shape[0]
    if law[KIND] == SWITCHING:
        if memory[MODE] == IMAGE_MODE:
            first = POSE_ROWS
        else:
            end = POSE_ROWS
    square = 0.0
    for i in range(first, end):
        square += e[i] * e[i]
    gain = adaptive_gain(
        law[GAIN_AT_ZERO], law[GAIN_AT_INFINITY], law[GAIN_SLOPE], math.sqrt(square)
    )
    rate = np.empty(end - first)
    for i in range(first, end):
        rate[i - first] = -gain * e[i] + reference[1, i] - reference[2, i]
    if law[KIND] == PARTITIONED:
        return partitioned_twist(law, s, e, L, rate, gain), gain
    return _wanted_twist(law, rank, L[first:end], rate, X_PC, R_WP, motions), gain


@shared(VECTOR(VECTOR, VECTOR, VECTOR, MATRIX, VECTOR, MATRIX, VECTOR))
@njit(cache=True)
def _base_cable_rates(
    law: Array, V_C: Array, X_PC: Array, R_WP: Array, p_WP: Array, cables: Array, V_P: Array
) -> Array:
    """`_cable_rates` by way of the base frame W."""
    R_PC, p_PC = pose_parts(X_PC)
    V_WP = law[SIGN] * (base_adjoint(R_WP, R_PC, p_PC) @ V_C)
    for i in range(6):
        V_P[i] = 0.0
        for k in range(3):
            V_P[i] += R_WP[k, i % 3] * V_WP[k + 3 * (i // 3)]
    return cable_rates_from_base_twist(R_WP, p_WP, cables, V_WP)


@njit(cache=True, inline="always")
def _cable_rates(
    law: Array, V_C: Array, X_PC: Array, R_WP: Array, p_WP: Array, cables: Array,
    motions: np.ndarray, V_P: Array,
) -> Array:  # fmt: skip
    """Cable velocities [m/s] for the camera's twist in C; writes the platform's twist in P."""
    if law[IN_BASE_FRAME] != 0.0:
        return _base_cable_rates(law, V_C, X_PC, R_WP, p_WP, cables, V_P)
    R_PC, p_PC = pose_parts(X_PC)
    moved = law[SIGN] * (adjoint_of_arrays(R_PC, p_PC) @ V_C)
    V_P[:] = 0.0
    for i in motions:
        V_P[i] = moved[i]
    return cable_rates_from_platform_twist(R_WP, p_WP, cables, V_P)


@njit(cache=True, inline="always")
def servo_step(
    law: Array, rank: int, s: Array, L_now: Array, L: Array, reference: Array, X_PC: Array,
    X_WP: Array, cables: Array, motions: np.ndarray, time: float, memory: Array, out: Array,
) -> None:  # fmt: skip
    """One step of the law.

    Args:
        law: Numbers of the law, shape (`LAW_SIZE`,).
        rank: Motions of the camera that the features control, 6 or 5.
        s: Features that are seen, shape (k,).
        L_now: Their interaction matrix, shape (k, 6).
        L: The interaction matrix that the law uses, shape (k, 6).
        reference: s*(t), ds*/dt and the drift b by the object's motion, shape (3, k).
        X_PC: Pose of the camera on the platform now, see `servoing.columns`, shape (12,).
        X_WP: Estimated pose of the platform, the same.
        cables: `CableSet.packed()` of the believed robot, shape (m, 17).
        motions: Components of the platform's twist in P that the robot can move: 0 to 5, or 2 to 4.
        time: Time [s].
        memory: As `ServoController.fresh_memory`, of the task of now; changed. Plan and filter in
            it stay as they are.
        out: Gets cable velocities (m) [m/s], the platform's twist in P (6), e (k), lambda [1/s].
    """
    k, m = s.shape[0], cables.shape[0]
    R_WP, p_WP = pose_parts(X_WP)
    V_P, e = out[m : m + 6], out[m + 6 : m + 6 + k]
    for i in range(k):
        e[i] = s[i] - reference[0, i]
    if law[KIND] == SWITCHING:
        take_bounds(law, e, time, memory)
    V_C, gain = _asked_twist(law, rank, s, e, L, reference, X_PC, R_WP, motions, memory)
    if law[KIND] == SWITCHING and has_to_switch(law, e, L_now, V_C, time, memory):
        switch_mode(time, memory)
        for i in range(6):
            # What is left of the start was for the other one, and the twist of before is what has
            # to end: faded, it would go on towards the bound.
            memory[BEFORE + i], memory[TOWARD + i] = 0.0, 0.0
        V_C, gain = _asked_twist(law, rank, s, e, L, reference, X_PC, R_WP, motions, memory)
    if memory[BEGUN] < 0.0:
        memory[BEGUN] = time
        for i in range(6):
            memory[TOWARD + i] = -V_C[i] / gain
    if not math.isnan(law[SIGMA]):
        fading = math.exp(-law[SIGMA] * (time - memory[BEGUN]))
        if fading >= FADED:
            for i in range(6):
                V_C[i] += (memory[BEFORE + i] + gain * memory[TOWARD + i]) * fading
    rates = _cable_rates(law, V_C, X_PC, R_WP, p_WP, cables, motions, V_P)
    share = saturation_share(rates, law[CABLE_SPEED])
    for i in range(m):
        out[i] = share * rates[i]
    for i in range(6):
        V_P[i] *= share
        memory[TWIST + i] = share * V_C[i]
    for i in range(k):
        memory[FEATURES + i] = s[i]
        own = 0.0
        for j in range(6):
            own += L_now[i, j] * memory[TWIST + j]
        memory[FEATURES + k + i] = own
    out[m + 6 + k] = gain


@njit(cache=True, inline="always")
def look_and_step(
    features: tuple[int, int, int, int], numbers: Array, seen: Array, law: Array,
    L_desired: Array, interaction: int, reference: Array, X_mount: Array, X_WP: Array,
    cables: Array, motions: np.ndarray, time: float, memory: Array, out: Array,
) -> None:  # fmt: skip
    """One step from what is seen: features by their kernel, then `servo_step`.

    Args:
        features: Address of the kernel, features that it writes, row of them to leave out or -1,
            and how many motions they control; see `servoing.packed_features_kernel`.
        numbers: Its first argument.
        seen: What is seen, as `servoing.packed_features_kernel` says.
        law: As `servo_step`, and so are all that follow but L_desired, interaction and X_mount.
        L_desired: Interaction matrix at the goal, shape (k, 6).
        interaction: `CURRENT`, `DESIRED` or `MEAN`: which one the law uses.
        reference: See law.
        X_mount: X_PC or, where law[SIGN] is negative, X_PO of an object that moves with the
            platform before a camera in the world; as columns, shape (12,).
        X_WP: See law.
        cables: See law.
        motions: See law.
        time: See law.
        memory: See law.
        out: See law.
    """
    kernel, size, dropped, rank = features
    s, L_now = np.empty(size), np.empty((size, 6))
    call_features(kernel, numbers, seen, s, L_now)
    if dropped >= 0:
        for i in range(dropped, size - 1):
            s[i] = s[i + 1]
            for j in range(6):
                L_now[i, j] = L_now[i + 1, j]
        s, L_now = s[: size - 1], L_now[: size - 1]
    L = L_now
    if interaction == DESIRED:
        L = L_desired
    elif interaction == MEAN:
        L = 0.5 * (L_now + L_desired)
    X_PC = X_mount
    if law[SIGN] < 0.0:
        X_PC = np.empty(12)
        for i in range(3):
            X_PC[9 + i] = X_mount[9 + i]
            for j in range(3):  # R_PC = R_PO R_CO', p_PC = p_PO - R_PC p_CO
                X_PC[3 * j + i] = 0.0
                for k in range(3):
                    X_PC[3 * j + i] += X_mount[3 * k + i] * seen[3 * k + j]
                X_PC[9 + i] -= X_PC[3 * j + i] * seen[9 + j]
    servo_step(
        law, rank, s, L_now, L, reference, X_PC, X_WP, cables, motions, time, memory, out
    )  # fmt: skip


def step_addresses(
    features: tuple[int, int, int, int],
    numbers: Array,
    law: Array,
    L_desired: Array,
    interaction: int,
    reference: Array,
    *,
    X_mount: Array,
    cables: Array,
    motions: np.ndarray,
) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """The constants of `look_and_step` at one address, for `look_and_step_at`.

    Returns:
        Their table, and the arrays that must be kept as long as it.
    """
    arrays = (
        np.array([*features, interaction], dtype=np.int64),
        *(np.ascontiguousarray(one, dtype=float) for one in (
            numbers, law, L_desired, reference, X_mount, cables
        )),
        np.ascontiguousarray(motions, dtype=np.int64),
    )  # fmt: skip
    return array_addresses(arrays), arrays


@njit(cache=True)
def look_and_step_at(
    table: np.ndarray, seen: Array, X_WP: Array, time: float, memory: Array, out: Array
) -> None:
    """`look_and_step` with what `step_addresses` gave; few arguments cost little from Python."""
    whole = integers_at(table, 0)
    look_and_step(
        (whole[0], whole[1], whole[2], whole[3]), vector_at(table, 1), seen, vector_at(table, 2),
        matrix_at(table, 3), whole[4], matrix_at(table, 4), vector_at(table, 5), X_WP,
        matrix_at(table, 6), integers_at(table, 7), time, memory, out,
    )  # fmt: skip

"""Numba kernel for one explicit step of the ordinary robot: a floating platform, ideal winches,
straight cables from fixed exit points.

It is `explicit_kernel.explicit_step` to the last bit, by the same laws. The platform's numbers stay
in registers, cables go eight at once, and nothing is written between stages but lengths.
"""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.straight_lanes_kernel import lanes_force
from cdpr_drake.dynamics.platform_kernel import floating_derivative, put_state
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.numerics.lanes import COUNT, lane_of, load_lanes, store_lanes, within

State = tuple[float, ...]


@njit(cache=True, error_model="numpy", forceinline=True)
def _state_of(y: Array) -> State:
    return (
        y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], y[8], y[9], y[10], y[11], y[12],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _along(y: State, h: float, k: State) -> State:
    """y + h k."""
    return (
        y[0] + h * k[0], y[1] + h * k[1], y[2] + h * k[2], y[3] + h * k[3], y[4] + h * k[4],
        y[5] + h * k[5], y[6] + h * k[6], y[7] + h * k[7], y[8] + h * k[8], y[9] + h * k[9],
        y[10] + h * k[10], y[11] + h * k[11], y[12] + h * k[12],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _weighted(a: float, j: State, b: float, k: State) -> State:
    """a j + b k."""
    return (
        a * j[0] + b * k[0], a * j[1] + b * k[1], a * j[2] + b * k[2], a * j[3] + b * k[3],
        a * j[4] + b * k[4], a * j[5] + b * k[5], a * j[6] + b * k[6], a * j[7] + b * k[7],
        a * j[8] + b * k[8], a * j[9] + b * k[9], a * j[10] + b * k[10], a * j[11] + b * k[11],
        a * j[12] + b * k[12],
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def plain_step(
    work: Array, body: Array, columns: Array, limit: float, third: bool, h: float, command: Array,
    rate: Array, time: float,
) -> None:  # fmt: skip
    """One step from `work[0]` to `work[1]`, and of the platform by the lower order to `work[2]`.

    Args:
        work: `RobotArrays.work`; rows 3 to 6 are work space.
        body: `RobotArrays.body`.
        columns: Cables as `put_columns` wrote them.
        limit: Rated speed of the winches [m/s].
        third: Whether by the method of third order; else by that of second.
        h: Step [s].
        command: The command where its time is zero, shape (m,) [m/s].
        rate: Its rate, shape (m,) [m/s^2].
        time: Time of the command at the beginning of the step [s].
    """
    m = command.shape[0]
    begun, lengths = work[0][13:], work[6][13:]
    v1, v2, v3 = work[3][13:], work[4][13:], work[5][13:]
    for i in range(0, m, COUNT):
        asked, more = load_lanes(command, i), load_lanes(rate, i)
        store_lanes(v1, i, within(asked + more * time, limit))
        if third:
            store_lanes(v2, i, within(asked + more * (time + 0.5 * h), limit))
        store_lanes(v3, i, within(asked + more * (time + h), limit))
        store_lanes(lengths, i, load_lanes(begun, i))
    y = _state_of(work[0])
    state, k1, k2, speeds = y, y, y, v1
    for stage in range(3 if third else 2):
        X = floating_motion(state)
        sums = lanes_force(X, lengths, speeds, columns)
        force = (
            lane_of(sums, 0), lane_of(sums, 1), lane_of(sums, 2),
            lane_of(sums, 3), lane_of(sums, 4), lane_of(sums, 5),
        )  # fmt: skip
        q = state[0], state[1], state[2], state[3]
        k = floating_derivative(q, X, force, body)
        if stage == 0:
            k1, ahead = k, 0.5 * h if third else h
            state = _along(y, ahead, k)
            if not third:
                put_state(state, work[2])
            speeds = v2 if third else v3
            for i in range(0, m, COUNT):
                store_lanes(lengths, i, load_lanes(begun, i) + ahead * load_lanes(v1, i))
        elif third and stage == 1:
            k2 = k
            put_state(_along(y, h, k), work[2])
            state = _along(y, h, _weighted(2.0, k, -1.0, k1))
            speeds = v3
            for i in range(0, m, COUNT):
                change = 2.0 * load_lanes(v2, i) - load_lanes(v1, i)
                store_lanes(lengths, i, load_lanes(begun, i) + h * change)
        elif third:
            mean = _weighted(1.0, _weighted(1.0, k1, 4.0, k2), 1.0, k)
            put_state(_along(y, h / 6.0, mean), work[1])
        else:
            put_state(_along(y, 0.5 * h, _weighted(1.0, k1, 1.0, k)), work[1])
    new = work[1][13:]
    for i in range(0, m, COUNT):
        if third:
            mean = load_lanes(v1, i) + 4.0 * load_lanes(v2, i) + load_lanes(v3, i)
            store_lanes(new, i, load_lanes(begun, i) + h / 6.0 * mean)
        else:
            mean = load_lanes(v1, i) + load_lanes(v3, i)
            store_lanes(new, i, load_lanes(begun, i) + 0.5 * h * mean)

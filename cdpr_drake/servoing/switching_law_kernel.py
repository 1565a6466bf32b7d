"""Which controller of a switching servo acts: pose or image.

Each makes a function of its error fall, L_P = |e_P|^2 / 2 and L_I = |e_I|^2 / 2. The one that acts
may make the other's grow: where that is going to reach its bound, the other takes over. What is
going to be is foreseen to first order, by the rate of the other's function under the twist that the
acting one wants, one step ahead. The new controller acts at once, without a continuous start: the
old twist would go on towards the bound. A switch is refused until a least time after the last one
is over, so that the two cannot chatter where both bounds are near; till then a bound may be left.
Where both functions are going to leave their bounds, the one that is further gone is served.

Source: Gans and Hutchinson, Stable visual servoing through hybrid switched-system control, 2007:
two controllers, switched by bounds of their Lyapunov functions. Foresight, least time and bounds as
multiples of the start are chosen here.
"""

from __future__ import annotations

import math

from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.servoing.servo_law import (
    AHEAD,
    BEGUN,
    BOUND_OF_IMAGE,
    BOUND_OF_POSE,
    BOUND_RATIO,
    DWELL,
    FIRST_MODE,
    IMAGE_BOUND,
    IMAGE_MODE,
    MODE,
    OF_IMAGE,
    OF_POSE,
    POSE_BOUND,
    POSE_MODE,
    POSE_ROWS,
    SWITCHED_AT,
    SWITCHES,
)


@njit(cache=True)
def half_square(e: Array, first: int, end: int) -> float:
    """Half the square of the 2-norm of e[first:end]."""
    total = 0.0
    for i in range(first, end):
        total += 0.5 * e[i] * e[i]
    return total


@shared(types.void(VECTOR, VECTOR, types.float64, VECTOR))
@njit(cache=True)
def take_bounds(law: Array, e: Array, time: float, memory: Array) -> None:
    """Functions of now, and at the start of a task its bounds and mode; changes the memory."""
    memory[OF_POSE] = half_square(e, as_number(0), as_number(POSE_ROWS))
    memory[OF_IMAGE] = half_square(e, as_number(POSE_ROWS), e.shape[0])
    if memory[BEGUN] >= 0.0:
        return
    memory[MODE], memory[SWITCHED_AT] = law[FIRST_MODE], time - 2.0 * law[DWELL]  # may switch now
    memory[BOUND_OF_POSE] = law[POSE_BOUND]
    if math.isnan(law[POSE_BOUND]):
        memory[BOUND_OF_POSE] = law[BOUND_RATIO] * memory[OF_POSE]
    memory[BOUND_OF_IMAGE] = law[IMAGE_BOUND]
    if math.isnan(law[IMAGE_BOUND]):
        memory[BOUND_OF_IMAGE] = law[BOUND_RATIO] * memory[OF_IMAGE]


@njit(cache=True)
def growth(e: Array, L: Array, V_C: Array, first: int, end: int) -> float:
    """Rate of half the square of e[first:end] under a twist, of features at rest [1/s]."""
    total = 0.0
    for i in range(first, end):
        rate = 0.0
        for j in range(6):
            rate += L[i, j] * V_C[j]
        total += e[i] * rate
    return total


@shared(types.boolean(VECTOR, VECTOR, MATRIX, VECTOR, types.float64, VECTOR))
@njit(cache=True)
def has_to_switch(law: Array, e: Array, L: Array, V_C: Array, time: float, memory: Array) -> bool:
    """Whether the other controller takes over now; see the module.

    Args:
        law: Numbers of the law, shape (`LAW_SIZE`,).
        e: Errors of pose and image, shape (6 + 2 n,).
        L: Interaction matrix of now, shape (6 + 2 n, 6).
        V_C: Twist that the acting controller wants, shape (6,) [rad/s, m/s].
        time: Time [s].
        memory: As `take_bounds` left it.
    """
    if time - memory[SWITCHED_AT] < law[DWELL]:
        return False
    k = e.shape[0]
    pose = memory[OF_POSE] + law[AHEAD] * growth(e, L, V_C, as_number(0), as_number(POSE_ROWS))
    image = memory[OF_IMAGE] + law[AHEAD] * growth(e, L, V_C, as_number(POSE_ROWS), k)
    # Products, since a bound may be zero.
    if memory[MODE] == POSE_MODE:
        other, bound, own, own_bound = image, memory[BOUND_OF_IMAGE], pose, memory[BOUND_OF_POSE]
    else:
        other, bound, own, own_bound = pose, memory[BOUND_OF_POSE], image, memory[BOUND_OF_IMAGE]
    if other < bound:
        return False
    return own < own_bound or other * own_bound > own * bound


@shared(types.void(types.float64, VECTOR))
@njit(cache=True)
def switch_mode(time: float, memory: Array) -> None:
    """Lets the other controller act; changes the memory."""
    memory[MODE] = IMAGE_MODE if memory[MODE] == POSE_MODE else POSE_MODE
    memory[SWITCHED_AT] = time
    memory[SWITCHES] += 1.0

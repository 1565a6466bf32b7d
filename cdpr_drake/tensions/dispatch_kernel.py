"""Any kernel of tension distribution behind one compiled call, by its address."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import call_at_address
from cdpr_drake.numerics.kernel_calls import kernel_address as address
from cdpr_drake.tensions.closed_form_kernel import NOT_FOUND
from cdpr_drake.tensions.problem import RESIDUAL_TOLERANCE, balance, check_into
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    SINGULAR,
    nearest_tensions_in,
)

NOT_FINITE = -3
"""Code of `solve_and_check`: a wrench matrix or a wrench with NaN or infinity."""

_MATRIX, _VECTOR = types.float64[:, ::1], types.float64[::1]
_SIGNATURE = types.int64(_MATRIX, _MATRIX, *[_VECTOR] * 6)


def kernel_address(kernel: Any) -> int:
    """Where the machine code of a kernel with the arguments of `TensionMethod.kernel` begins."""
    return address(kernel, _SIGNATURE)


@intrinsic
def _call(typing: Any, kernel: Any, work: Any, W: Any, w: Any, lower: Any, upper: Any,
          reference: Any, row_scale: Any, t: Any) -> Any:  # fmt: skip
    """What the kernel at an address returns."""
    return _SIGNATURE.return_type(types.intp, *_SIGNATURE.args), call_at_address(_SIGNATURE)


@njit(cache=True, inline="always")
def finish(
    code: int, exact: bool, work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, t: Array,
) -> int:  # fmt: skip
    """What becomes of a kernel's code and tensions: the exact program has the last word.

    Where rounding loses the line or the polygon of a barely feasible problem, the least tensions
    take its place; they are exact, and prove infeasibility where there is none.

    From what the kernel returned and whether its method is exact to what `solve_one` returns; all
    other arguments as `TensionMethod.kernel`.
    """
    if exact and code == NOT_FOUND:
        code = nearest_tensions_in(work, W, w, lower, upper, reference, t)
    elif code == FEASIBLE:  # by rounding at most out of bounds
        for i in range(t.shape[0]):
            t[i] = min(max(t[i], lower[i]), upper[i])
    return code


@njit(cache=True)
def solve_one(
    kernel: int, exact: bool, work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """One problem by the kernel at an address, which must fit the redundancy of W; 0: by none.

    The first two arguments as `TensionMethod.compiled` gives them, all others as
    `TensionMethod.kernel` takes them.

    Returns:
        1 feasible, 0 missed by this method, -1 infeasible, -2 singular W. Tensions that are not
        feasible are what the method came to (0), those of least slack (-1, methods that relax), or
        without meaning.
    """
    code = NOT_FOUND
    if kernel != 0:
        code = _call(kernel, work, W, w, lower, upper, reference, row_scale, t)
    return finish(code, exact, work, W, w, lower, upper, reference, t)


@njit(cache=True)
def checked_code(
    code: int, relaxes: bool, W: Array, w: Array, lower: Array, upper: Array, t: Array
) -> int:
    """The verdict on a code's tensions, by looking at them as `problem.check_tensions` does.

    Args:
        code: What `solve_one` returned.
        relaxes: Whether tensions count where the method found the problem infeasible.
        W: Wrench matrix, shape (n, m); with the following four as `TensionMethod.kernel`.
        w: Wrench, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        t: Tensions, shape (m,) [N]; by rounding out of bounds they are put on them.

    Returns:
        1 where they are within the bounds and balance the wrench; else the code, and 0 for 1.
    """
    if code == SINGULAR or (code == INFEASIBLE and not relaxes):
        return code
    inside, residual = balance(W, w, lower, upper, t)
    if inside and residual <= RESIDUAL_TOLERANCE:
        return FEASIBLE
    return code if code == INFEASIBLE else NOT_FOUND


@njit(cache=True)
def solve_and_check(
    method: tuple[int, bool, bool], work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array, active: np.ndarray, slack: Array,
) -> tuple[int, float]:  # fmt: skip
    """One problem from numbers to verdict: what `methods.distribute` does, in one call.

    Args:
        method: What `TensionMethod.compiled` gives.
        work: As `TensionMethod.kernel`, and so are the next six, and t.
        W: See work.
        w: See work.
        lower: See work.
        upper: See work.
        reference: See work.
        row_scale: See work.
        t: See work.
        active: As `check_into`.
        slack: As `check_into`.

    Returns:
        1 feasible, 0 missed although there are some, -1 infeasible, -2 singular W, `NOT_FINITE`;
        and the residual of t. Where infeasible, t counts only for a method that relaxes.
    """
    n, m = W.shape
    total = 0.0
    for i in range(n):
        total += abs(w[i])
        for j in range(m):
            total += abs(W[i, j])
    if not np.isfinite(total):
        return NOT_FINITE, np.nan
    kernel, exact, relaxes = method
    code = solve_one(kernel, exact, work, W, w, lower, upper, reference, row_scale, t)
    if code < INFEASIBLE or (code == INFEASIBLE and not relaxes):
        return code, np.nan
    exists = code != INFEASIBLE
    inside, residual = check_into(W, w, lower, upper, t, active, slack)
    if inside and residual <= RESIDUAL_TOLERANCE:
        return FEASIBLE, residual
    if not exists:
        return INFEASIBLE, residual
    zero, other = np.zeros(m), np.empty(m)
    return (
        NOT_FOUND
        if nearest_tensions_in(work, W, w, lower, upper, zero, other) == FEASIBLE
        else INFEASIBLE
    ), residual

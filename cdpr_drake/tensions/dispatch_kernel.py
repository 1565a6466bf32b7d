"""Any kernel of tension distribution behind one compiled call, by its address.

`solve` is the one way from a problem to checked tensions: a kernel, the exact program, bounds, the
check. It is compiled, and inlined in its callers, since steps of control and batches are compiled
as a whole; what is called from Python, `methods.Distributor`, calls it by `solution_of`.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import call_at_address
from cdpr_drake.numerics.kernel_calls import kernel_address as address
from cdpr_drake.tensions.closed_form_kernel import NOT_FOUND
from cdpr_drake.tensions.problem import RESIDUAL_TOLERANCE, balance, describe
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    SINGULAR,
    nearest_tensions_in,
)

NOT_FINITE = -3
"""Code of `solution_of`: a wrench matrix or a wrench with NaN or infinity."""

_MATRIX, _VECTOR = types.float64[:, ::1], types.float64[::1]
_SIGNATURE = types.int64(_MATRIX, _MATRIX, *[_VECTOR] * 6)


@cache
def kernel_address(kernel: Any) -> int:
    """Where the machine code of a kernel with the arguments of `TensionMethod.kernel` begins."""
    return address(kernel, _SIGNATURE)


@intrinsic
def _call(typing: Any, kernel: Any, work: Any, W: Any, w: Any, lower: Any, upper: Any,
          reference: Any, row_scale: Any, t: Any) -> Any:  # fmt: skip
    """What the kernel at an address returns."""
    return _SIGNATURE.return_type(types.intp, *_SIGNATURE.args), call_at_address(_SIGNATURE)


@njit(cache=True, inline="always")
def check(
    code: int, relaxes: bool, W: Array, w: Array, lower: Array, upper: Array, t: Array
) -> tuple[int, float]:
    """The code that tensions deserve, by looking at them and not at what a method believes.

    Args:
        code: What a method came to, as `TensionMethod.kernel` returns it.
        relaxes: Whether the residual of tensions is asked where the problem is infeasible.
        W: Wrench matrix, shape (n, m); with the following three as `TensionMethod.kernel`.
        w: Wrench, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        t: Tensions, shape (m,) [N]; by rounding out of bounds they are put on them.

    Returns:
        1 where they are within the bounds and balance the wrench, unless the problem is proven to
        be infeasible: off by less than shows is off; else the code, and 0 for 1. And their
        `TensionProblem.residual`, NaN where they do not count.
    """
    if code == SINGULAR or (code == INFEASIBLE and not relaxes):
        return code, np.nan
    inside, residual = balance(W, w, lower, upper, t)
    if code == INFEASIBLE:
        return INFEASIBLE, residual
    return (FEASIBLE if inside and residual <= RESIDUAL_TOLERANCE else NOT_FOUND), residual


@njit(cache=True, inline="always")
def solve(
    method: tuple[int, bool, bool], work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> tuple[int, float]:  # fmt: skip
    """Tensions by a method, checked: the way of single problems, batches and steps of control.

    Where the kernel of an exact method misses, as rounding loses the line or the polygon of a
    barely feasible problem, the nearest tensions to the reference take its place; they are exact,
    and prove infeasibility where there is none.

    Args:
        method: What `TensionMethod.compiled` gives, for the redundancy of W.
        work: As `TensionMethod.kernel`, and so are all others.
        W: See work.
        w: See work.
        lower: See work.
        upper: See work.
        reference: See work.
        row_scale: See work.
        t: See work.

    Returns:
        1 feasible, 0 missed by this method, -1 infeasible, -2 singular W; and the residual, as
        `check`. Tensions that are not feasible are what the method came to (0), those of least
        slack (-1, methods that relax), or without meaning.
    """
    kernel, exact, relaxes = method
    code = NOT_FOUND
    if kernel != 0:
        code = _call(kernel, work, W, w, lower, upper, reference, row_scale, t)
    if exact and code == NOT_FOUND:
        code = nearest_tensions_in(work, W, w, lower, upper, reference, t)
    elif code == FEASIBLE:  # by rounding at most out of bounds
        for i in range(t.shape[0]):
            t[i] = min(max(t[i], lower[i]), upper[i])
    return check(code, relaxes, W, w, lower, upper, t)


@njit(cache=True, inline="always")
def solve_or_prove(
    method: tuple[int, bool, bool], work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> tuple[int, float]:  # fmt: skip
    """As `solve`; where the method missed, 0 says that there are tensions, -1 that there are none.

    A step of control does without: it holds the last tensions in either case.
    """
    code, residual = solve(method, work, W, w, lower, upper, reference, row_scale, t)
    if code == NOT_FOUND:
        zero, other = np.zeros(t.shape[0]), np.empty(t.shape[0])
        code = min(NOT_FOUND, nearest_tensions_in(work, W, w, lower, upper, zero, other))
    return code, residual


@njit(cache=True)
def solution_of(
    method: tuple[int, bool, bool], work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array, active: np.ndarray, slack: Array,
) -> tuple[int, float]:  # fmt: skip
    """As `solve_or_prove`, with all that a `TensionSolution` says, or `NOT_FINITE`.

    `active` and `slack` are written as `TensionSolution` has them.
    """
    n, m = W.shape
    total = 0.0
    for i in range(n):
        total += abs(w[i])
        for j in range(m):
            total += abs(W[i, j])
    if not np.isfinite(total):
        return NOT_FINITE, np.nan
    code, residual = solve_or_prove(method, work, W, w, lower, upper, reference, row_scale, t)
    describe(W, w, lower, upper, t, active, slack)
    return code, residual

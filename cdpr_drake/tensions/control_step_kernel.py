"""From a wrench to checked tensions, in compiled code: one problem, or one step of a controller.

`solve` calls the kernel of a method by its address, the exact program where that misses, and checks
the result. It is inlined in its callers: batches, steps of control, and `solution_of`, which
`methods.Distributor` calls. A step of control computes the wrench matrix first, `update_tensions`.

A method is the triple that `TensionMethod.compiled` gives: address, whether the exact program
answers where the kernel misses, whether tensions count where there is no solution. All other
arguments are those of `quadratic_program_kernel`.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion, floating_motion, planar_motion
from cdpr_drake.geometry.pulley_kernel import pulley_line
from cdpr_drake.numerics import kernel_calls
from cdpr_drake.numerics.kernel_calls import integers_at, matrix_at, vector_at
from cdpr_drake.tensions.closed_form_kernel import within
from cdpr_drake.tensions.problem import RESIDUAL_TOLERANCE, balance, describe
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    NOT_FOUND,
    SINGULAR,
    nearest_tensions_in,
)

NOT_FINITE = -3
"""Code of `solution_of`: W or w has NaN or infinity."""

_MATRIX, _VECTOR = types.float64[:, ::1], types.float64[::1]
_SIGNATURE = types.int64(_MATRIX, _MATRIX, *[_VECTOR] * 6)


@cache
def kernel_address(kernel: Any) -> int:
    """Where the machine code of a kernel with the arguments of `TensionMethod.kernel` begins."""
    return kernel_calls.kernel_address(kernel, _SIGNATURE)


@intrinsic
def _call(typing: Any, kernel: Any, work: Any, W: Any, w: Any, lower: Any, upper: Any,
          reference: Any, row_scale: Any, t: Any) -> Any:  # fmt: skip
    """Result of the kernel at an address."""
    return (
        _SIGNATURE.return_type(types.intp, *_SIGNATURE.args),
        kernel_calls.call_at_address(_SIGNATURE),
    )


@njit(cache=True, inline="always")
def check(
    code: int, relaxes: bool, W: Array, w: Array, lower: Array, upper: Array, t: Array
) -> tuple[int, float]:
    """Code by what t is, whatever a method reported, and `TensionProblem.residual` of t.

    INFEASIBLE, which is a proof, stays: off by less than shows is off. Else FEASIBLE if t is within
    the bounds (up to rounding, then it is put on them) and balances w, and NOT_FOUND if not. The
    residual is NaN where t does not count.
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
    """Tensions by a method, checked; returns code and residual as `check`.

    Where the kernel of an exact method misses, because rounding lost a thin line or polygon, the
    tensions nearest to the reference replace its answer, or prove that there are none. Without
    FEASIBLE, t is the last iterate (NOT_FOUND) or has the least slack (INFEASIBLE, relaxed).
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
    """As `solve`, but NOT_FOUND only if there are tensions; a step of control need not know."""
    code, residual = solve(method, work, W, w, lower, upper, reference, row_scale, t)
    if code == NOT_FOUND:
        zero, scratch = np.zeros(t.shape[0]), np.empty(t.shape[0])
        code = min(NOT_FOUND, nearest_tensions_in(work, W, w, lower, upper, zero, scratch))
    return code, residual


@njit(cache=True)
def solution_of(
    method: tuple[int, bool, bool], work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array, active: np.ndarray, slack: Array,
) -> tuple[int, float]:  # fmt: skip
    """As `solve_or_prove`, or NOT_FINITE; writes the `active` and `slack` of a solution, too."""
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


@njit(cache=True)
def _write_wrench_matrix(X: Motion, cables: Array, planar: bool, W: Array) -> None:
    """Columns (moment about Po, force) of unit tensions, without moments where W has no such rows.

    Planar: (moment about z, f_x, f_y).
    """
    for i in range(cables.shape[0]):
        _, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
        if planar:
            if W.shape[0] == 3:
                W[0, i] = -(rx * uy - ry * ux)
            W[W.shape[0] - 2, i] = -ux
            W[W.shape[0] - 1, i] = -uy
        elif W.shape[0] == 3:
            W[0, i] = -ux
            W[1, i] = -uy
            W[2, i] = -uz
        else:
            W[0, i] = -(ry * uz - rz * uy)
            W[1, i] = -(rz * ux - rx * uz)
            W[2, i] = -(rx * uy - ry * ux)
            W[3, i] = -ux
            W[4, i] = -uy
            W[5, i] = -uz


@njit(cache=True)
def wrench_matrix_at(state: Array, cables: Array, height: float, W: Array) -> None:
    """Writes the wrench matrix of a platform.

    Args:
        state: State of the platform as the plant gives it, shape (13,), or (6,) for 2T1R.
        cables: Packed cables, shape (m, 17), see `CableSet.packed`.
        height: Height of the plane of a 2T1R platform [m]; else unused.
        W: Receives the matrix, shape (6, m), or (3, m) for 2T1R; to balance forces only, (3, m), or
            (2, m) for 2T1R.
    """
    planar = state.shape[0] == 6  # True and False written out would be compiled twice
    if planar:
        _write_wrench_matrix(planar_motion(state, height), cables, planar, W)
    else:
        _write_wrench_matrix(floating_motion(state), cables, planar, W)


@njit(cache=True)
def update_tensions(
    method: tuple[int, bool, bool], state: Array, desired: Array, cables: Array, height: float,
    bounds: Array, row_scale: Array, work: Array, W: Array, t: Array, held: Array, feasible: Array,
) -> int:  # fmt: skip
    """Tensions that put a desired wrench on a platform; `held` has the last feasible ones.

    Args:
        method: As `solve`; so are row_scale, work and t. W receives the wrench matrix.
        state: As `wrench_matrix_at`; so are cables and height.
        desired: F_P_W about Po that the cables shall put on the platform, shape (6,) [N m, N].
        bounds: Smallest, largest and reference tensions, shape (3, m) [N]; a method that starts
            begins at the last row.
        held: Becomes t if that is feasible, or in the bounds by a method that relaxes, (m,) [N].
        feasible: Becomes 1 or 0, shape (1,).

    Returns:
        The code of `solve`.
    """
    wrench_matrix_at(state, cables, height, W)
    n = W.shape[0]
    w = np.empty(n)
    first = (5 if state.shape[0] == 6 else 6) - n  # a planar platform has no f_z
    for i in range(n):
        w[i] = -desired[first + i]
    code, _ = solve(method, work, W, w, bounds[0], bounds[1], bounds[2], row_scale, t)
    feasible[0] = 1.0 if code == FEASIBLE else 0.0
    relaxed = method[2] and code != SINGULAR and within(t, bounds[0], bounds[1])
    if code == FEASIBLE or relaxed:
        for i in range(t.shape[0]):
            held[i] = t[i]
    return code


class TensionStep:
    """Arguments of `update_tensions` that stay the same for one controller, at one address.

    Attributes:
        W: Receives the wrench matrix, shape (n, m).
        t: Receives the tensions of a step, shape (m,) [N].
        table: Addresses of all arrays, for `update_tensions_at`.
    """

    def __init__(
        self, method: tuple[int, bool, bool], cables: Array, height: float, bounds: Array,
        row_scale: Array, *, room: tuple[int, ...], starts: bool = False,
    ) -> None:  # fmt: skip
        """Takes arguments of `update_tensions`; `room` is `workspace_shape`.

        If the method `starts`, the tensions of the last step replace the reference.
        """
        self.method, self.cables, self.height = method, np.ascontiguousarray(cables), height
        self.bounds, self.row_scale = np.ascontiguousarray(bounds), np.asarray(row_scale, float)
        self.work, self.t = np.empty(room), np.empty(len(cables))
        self.W = np.empty((len(row_scale), len(cables)))
        self._arrays = (
            np.array([int(part) for part in (*method, starts)]), self.cables, np.array([height]),
            self.bounds, np.ascontiguousarray(self.row_scale), self.work, self.W, self.t,
        )  # fmt: skip
        self.table = kernel_calls.array_addresses(self._arrays)


@njit(cache=True)
def update_tensions_at(
    table: np.ndarray, state: Array, desired: Array, held: Array, feasible: Array
) -> int:
    """`update_tensions` with the table of a `TensionStep`: few arguments cost less from Python."""
    numbers = integers_at(table, 0)
    method = (numbers[0], numbers[1] != 0, numbers[2] != 0)
    bounds = matrix_at(table, 3)
    if numbers[3] != 0:
        for i in range(held.shape[0]):
            bounds[2, i] = held[i]
    return update_tensions(
        method, state, desired, matrix_at(table, 1), vector_at(table, 2)[0], bounds,
        vector_at(table, 4), matrix_at(table, 5), matrix_at(table, 6), vector_at(table, 7), held,
        feasible,
    )  # fmt: skip

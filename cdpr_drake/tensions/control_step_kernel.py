"""One step of a tension controller as a numba kernel: wrench matrix, then tensions."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion, floating_motion, planar_motion
from cdpr_drake.geometry.pulley_kernel import pulley_line
from cdpr_drake.numerics.kernel_calls import array_addresses, integers_at, matrix_at, vector_at
from cdpr_drake.tensions.closed_form_kernel import within
from cdpr_drake.tensions.dispatch_kernel import solve
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, SINGULAR


@njit(cache=True)
def _write_wrench_matrix(X: Motion, cables: Array, planar: bool, W: Array) -> None:
    """Columns (moment about Po, force) of unit tensions; planar: (moment about z, f_x, f_y).

    Without the rows of moments where W has none.
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
        height: Height of the plane of a 2T1R platform [m]; not used otherwise.
        W: Gets the matrix, shape (6, m), or (3, m) for 2T1R; without moments, where forces alone
            are balanced, (3, m), or (2, m).
    """
    planar = state.shape[0] == 6  # True and False written out would be compiled twice
    if planar:
        _write_wrench_matrix(planar_motion(state, height), cables, planar, W)
    else:
        _write_wrench_matrix(floating_motion(state), cables, planar, W)


@njit(cache=True)
def update_tensions(
    method: tuple[int, bool, bool],
    state: Array,
    desired: Array,
    cables: Array,
    height: float,
    bounds: Array,
    row_scale: Array,
    work: Array,
    W: Array,
    t: Array,
    held: Array,
    feasible: Array,
) -> int:
    """Tensions that put a desired wrench on a platform; the last feasible ones are held.

    Args:
        method: What `TensionMethod.compiled` gives.
        state: As `wrench_matrix_at`.
        desired: F_P_W about Po that the cables shall put on the platform, shape (6,) [N m, N].
        cables: As `wrench_matrix_at`.
        height: As `wrench_matrix_at`.
        bounds: Smallest, largest and wanted tensions, shape (3, m) [N]; the last are zeros for
            methods that need no reference, or where a method starts.
        row_scale: As `TensionMethod.kernel`, shape (n,).
        work: Work space of `quadratic_program_kernel.workspace_shape`.
        W: Gets the wrench matrix, as `wrench_matrix_at`.
        t: Gets what the method computes, shape (m,) [N].
        held: Becomes t if that is feasible, or if it is within the bounds by a method that
            relaxes, shape (m,) [N].
        feasible: Becomes 1 or 0, shape (1,).

    Returns:
        The code of `dispatch_kernel.solve`.
    """
    wrench_matrix_at(state, cables, height, W)
    n = W.shape[0]
    w = np.empty(n)
    first = (5 if state.shape[0] == 6 else 6) - n  # a planar platform has f_z not
    for i in range(n):
        w[i] = -desired[first + i]
    code, _ = solve(method, work, W, w, bounds[0], bounds[1], bounds[2], row_scale, t)
    feasible[0] = 1.0 if code == FEASIBLE else 0.0
    answered = method[2] and code != SINGULAR and within(t, bounds[0], bounds[1])
    if code == FEASIBLE or answered:
        for i in range(t.shape[0]):
            held[i] = t[i]
    return code


class TensionStep:
    """What `update_tensions` needs besides state and wrench, at one address for one controller.

    Attributes:
        W: Gets the wrench matrix, shape (n, m).
        t: Gets what the method computes, shape (m,) [N].
        table: Where all of it is, for `update_tensions_at`.
    """

    def __init__(
        self,
        method: tuple[int, bool, bool],
        cables: Array,
        height: float,
        bounds: Array,
        row_scale: Array,
        *,
        room: tuple[int, ...],
        starts: bool = False,
    ) -> None:
        """Arguments as of `update_tensions`; room is `workspace_shape`.

        A method that `starts` gets the tensions of the last step in the place of wanted ones.
        """
        n, m = len(row_scale), len(cables)
        self.method, self.cables, self.height = method, np.ascontiguousarray(cables), height
        self.bounds, self.row_scale = np.ascontiguousarray(bounds), np.asarray(row_scale, float)
        self.work, self.W, self.t = np.empty(room), np.empty((n, m)), np.empty(m)
        self._kept = (
            np.array([int(part) for part in (*method, starts)]),
            self.cables,
            np.array([height]),
            self.bounds,
            np.ascontiguousarray(self.row_scale),
            self.work,
            self.W,
            self.t,
        )
        self.table = array_addresses(self._kept)


@njit(cache=True)
def update_tensions_at(
    table: np.ndarray, state: Array, desired: Array, held: Array, feasible: Array
) -> int:
    """`update_tensions` with what a `TensionStep` keeps: fewer arguments cost less from Python."""
    numbers = integers_at(table, 0)
    method = (numbers[0], numbers[1] != 0, numbers[2] != 0)
    bounds = matrix_at(table, 3)
    if numbers[3] != 0:
        for i in range(held.shape[0]):
            bounds[2, i] = held[i]
    return update_tensions(
        method,
        state,
        desired,
        matrix_at(table, 1),
        vector_at(table, 2)[0],
        bounds,
        vector_at(table, 4),
        matrix_at(table, 5),
        matrix_at(table, 6),
        vector_at(table, 7),
        held,
        feasible,
    )

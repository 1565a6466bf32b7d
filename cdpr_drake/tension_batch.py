"""Tension distribution for many poses or wrenches at once, on all cores."""

from __future__ import annotations

import numpy as np
from numba import get_num_threads, njit, prange, set_num_threads

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tension_closed_kernels import (
    MISSED,
    closed_form,
    improved_closed_form,
    kernel_line,
    pseudo_inverse,
    puncture,
    within,
)
from cdpr_drake.tension_null_space import null_space
from cdpr_drake.tension_polygon import polygon_barycenter, polygon_vertices
from cdpr_drake.tension_qp_kernel import (
    FEASIBLE,
    SINGULAR,
    nearest_tensions,
    nearest_tensions_in,
    workspace_shape,
)

BATCH_METHODS = (
    "quadratic_program",
    "pseudo_inverse",
    "closed_form",
    "improved_closed_form",
    "barycenter",
    "kernel",
    "puncture",
)
"""Methods with a batch form; their place is the code of the kernel."""

CHUNK = 64
"""Problems that one thread takes at a time, with one work space."""


@njit(cache=True)
def _barycenter(W: Array, w: Array, lower: Array, upper: Array, t: Array) -> int:
    n, m = W.shape
    N = np.empty((m - n, m))
    if not null_space(W, w, t, N):
        return SINGULAR
    vertices = polygon_vertices(t, N, lower, upper)
    if vertices.shape[1] == 0:
        return nearest_tensions(W, w, lower, upper, np.zeros(m), t)
    center = polygon_barycenter(vertices)
    for i in range(m):
        t[i] += N[0, i] * center[0] + N[1, i] * center[1]
    if not within(t, lower, upper):  # a polygon that is there by rounding only
        return nearest_tensions(W, w, lower, upper, np.zeros(m), t)
    for i in range(m):
        t[i] = min(max(t[i], lower[i]), upper[i])
    return FEASIBLE


def method_code(method: str) -> int:
    """Code of a method of `BATCH_METHODS` for `solve_one`."""
    return BATCH_METHODS.index(method)


@njit(cache=True)
def solve_one(
    method: int,
    work: Array,
    W: Array,
    w: Array,
    lower: Array,
    upper: Array,
    reference: Array,
    t: Array,
) -> int:
    """One problem by the method of a code; arguments and result as `nearest_tensions_in`.

    0 is returned where the method missed.
    """
    if method == 0:
        return nearest_tensions_in(work, W, w, lower, upper, reference, t)
    if method == 1:
        return pseudo_inverse(W, w, lower, upper, t)
    if method == 2:
        return closed_form(W, w, lower, upper, t)
    if method == 3:
        return improved_closed_form(W, w, lower, upper, t)
    if method == 4:
        return _barycenter(W, w, lower, upper, t)
    if method == 5:
        return kernel_line(W, w, lower, upper, t)
    return puncture(W, w, lower, upper, t)


@njit(cache=True, parallel=True)
def _many(
    method: int, W: Array, w: Array, lower: Array, upper: Array, reference: Array, t: Array
) -> np.ndarray:
    count, n, m = W.shape
    codes = np.empty(count, np.int8)
    for chunk in prange((count + CHUNK - 1) // CHUNK):
        work = np.empty(workspace_shape(n, m))
        other = np.empty(m)
        for k in range(chunk * CHUNK, min((chunk + 1) * CHUNK, count)):
            code = solve_one(method, work, W[k], w[k], lower, upper, reference, t[k])
            if code == MISSED:  # or is there nothing to find?
                exact = nearest_tensions_in(work, W[k], w[k], lower, upper, reference, other)
                code = MISSED if exact == FEASIBLE else exact
            codes[k] = code
    return codes


def distribute_batch(
    W: Array,
    wrenches: Array,
    lower: Array,
    upper: Array,
    method: str = "quadratic_program",
    reference: Array | None = None,
    threads: int | None = None,
) -> tuple[Array, np.ndarray]:
    """Distributes many wrenches; the problems are not checked one by one.

    Args:
        W: Wrench matrices, shape (k, n, m).
        wrenches: External wrenches about Po, shape (k, n) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        method: One of `BATCH_METHODS`.
        reference: Wanted tensions of the quadratic program, shape (m,) [N]; None: zeros.
        threads: Number of threads; None: all cores.

    Returns:
        Tensions, shape (k, m) [N], NaN where there are none, and codes, shape (k,): 1 feasible,
        0 missed by this method, -1 infeasible, -2 singular W.

    Raises:
        TensionProblemError: Unknown method, sizes that do not fit, or a redundancy that the
            method cannot take.
    """
    if method not in BATCH_METHODS:
        raise TensionProblemError(f"method: found {method}; accepted: {', '.join(BATCH_METHODS)}")
    W = np.ascontiguousarray(W, float)
    wrenches = np.ascontiguousarray(wrenches, float)
    if W.ndim != 3 or wrenches.shape != W.shape[:2]:
        raise TensionProblemError(
            f"W, wrenches: found shapes {W.shape}, {wrenches.shape}; accepted: (k, n, m), (k, n)"
        )
    count, n, m = W.shape
    needed = {"barycenter": 2, "kernel": 1}.get(method, m - n)
    if m - n != needed:
        raise TensionProblemError(f"{method}: found redundancy m - n = {m - n}; accepted: {needed}")
    wanted = np.zeros(m) if reference is None else np.ascontiguousarray(reference, float)
    for name, value in (("lower", lower), ("upper", upper), ("reference", wanted)):
        if np.shape(value) != (m,):
            raise TensionProblemError(f"{name}: found shape {np.shape(value)}; accepted: ({m},)")
    for name, value in (
        ("W", W), ("wrenches", wrenches), ("lower", lower), ("upper", upper), ("reference", wanted),
    ):  # fmt: skip
        if not np.all(np.isfinite(value)):
            raise TensionProblemError(f"{name}: found NaN or infinity; accepted: finite numbers")
    if np.any(np.asarray(lower) < 0.0) or np.any(np.asarray(lower) > np.asarray(upper)):
        raise TensionProblemError(
            "lower: found a tension below 0 or above upper; accepted: 0 <= lower <= upper [N]"
        )
    if threads is not None and threads < 1:
        raise TensionProblemError(f"threads: found {threads}; accepted: at least 1")
    t = np.empty((count, m))
    before = get_num_threads()
    if threads is not None:
        set_num_threads(min(threads, before))
    try:
        codes = _many(
            method_code(method),
            W,
            wrenches,
            np.ascontiguousarray(lower, float),
            np.ascontiguousarray(upper, float),
            wanted,
            t,
        )
    finally:
        set_num_threads(before)
    t[codes < 0] = np.nan
    return t, codes

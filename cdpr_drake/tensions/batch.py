"""Tension distribution for many poses or wrenches at once, on all cores."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.tensions.dispatch_kernel import solve_or_prove
from cdpr_drake.tensions.methods import method_for
from cdpr_drake.tensions.quadratic_program_kernel import SINGULAR, workspace_shape


@njit(cache=True, nogil=True)
def _many(
    first: int, past: int, method: tuple[int, bool, bool], W: Array, w: Array, lower: Array,
    upper: Array, reference: Array, row_scale: Array, t: Array, codes: np.ndarray,
) -> None:  # fmt: skip
    work = np.empty(workspace_shape(W.shape[1], W.shape[2]))
    for k in range(first, past):
        codes[k], _ = solve_or_prove(
            method, work, W[k], w[k], lower, upper, reference, row_scale, t[k]
        )


def distribute_batch(
    W: Array,
    wrenches: Array,
    lower: Array,
    upper: Array,
    method: str = "quadratic_program",
    reference: Array | None = None,
    *,
    threads: int | None = None,
    row_scale: Array | None = None,
) -> tuple[Array, np.ndarray]:
    """Distributes many wrenches; the problems are not checked one by one, but each result is.

    Tensions are feasible by the same limits as those of `distribute`.

    Args:
        W: Wrench matrices, shape (k, n, m).
        wrenches: External wrenches about Po, shape (k, n) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        method: A name of `methods.METHODS`.
        reference: Wanted tensions, shape (m,) [N], for `reference_program`.
        threads: Number of threads; None: all cores.
        row_scale: As in `TensionProblem`, shape (n,) [m, -], for methods that relax; None: ones.

    Returns:
        Tensions, shape (k, m) [N], NaN where there are none, and codes, shape (k,): 1 feasible,
        0 missed by this method, -1 infeasible, -2 singular W. What a method that `answers`
        gives for an infeasible problem is there, within the bounds and off balance.

    Raises:
        TensionProblemError: Unknown method, sizes that do not fit, numbers that make no sense, a
            redundancy that the method cannot take, or a reference that it needs and has not.
    """
    W = np.require(W, float, ("C", "W"))  # kernels at an address take nothing read-only
    wrenches = np.require(wrenches, float, ("C", "W"))
    if W.ndim != 3 or wrenches.shape != W.shape[:2]:
        raise TensionProblemError(
            f"W, wrenches: found shapes {W.shape}, {wrenches.shape}; accepted: (k, n, m), (k, n)"
        )
    count, n, m = W.shape
    if n > m:
        raise TensionProblemError(
            f"W: found {m} cables for {n} degrees of freedom; accepted: at least {n} cables"
        )
    chosen = method_for(method, m - n, reference is not None)
    if reference is None or not chosen.needs_reference:
        reference = np.zeros(m)
    parts = {
        "lower": (lower, m),
        "upper": (upper, m),
        "reference": (reference, m),
        "row_scale": (np.ones(n) if row_scale is None else row_scale, n),
    }
    given: dict[str, Array] = {}
    for name, (value, size) in parts.items():
        if np.shape(value) != (size,):
            raise TensionProblemError(f"{name}: found shape {np.shape(value)}; accepted: ({size},)")
        given[name] = np.require(value, float, ("C", "W"))
    for name, value in {"W": W, "wrenches": wrenches, **given}.items():
        if not np.all(np.isfinite(value)):
            raise TensionProblemError(f"{name}: found NaN or infinity; accepted: finite numbers")
    if np.any(given["lower"] < 0.0) or np.any(given["lower"] > given["upper"]):
        raise TensionProblemError(
            "lower: found a tension below 0 or above upper; accepted: 0 <= lower <= upper [N]"
        )
    if np.any(given["row_scale"] <= 0.0):
        raise TensionProblemError("row_scale: found one not above 0; accepted: above 0 [m, -]")
    if threads is not None and threads < 1:
        raise TensionProblemError(f"threads: found {threads}; accepted: at least 1")
    t, codes = np.empty((count, m)), np.empty(count, np.int8)
    solver = chosen.compiled(m - n)
    over_rows(_many, count, threads, solver, W, wrenches, *given.values(), t, codes)
    t[codes == SINGULAR if chosen.answers else codes < 0] = np.nan
    return t, codes

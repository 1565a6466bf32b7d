"""All kernels of tension distribution behind one call, by a number in the place of a name."""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.tensions.closed_form_kernel import (
    MISSED,
    closed_form,
    dykstra,
    improved_closed_form,
    kernel_line,
    pseudo_inverse,
    puncture,
)
from cdpr_drake.tensions.linear_goals_kernel import GOALS, search
from cdpr_drake.tensions.polygon_kernel import POINTS, polygon_point
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, INFEASIBLE, nearest_tensions_in
from cdpr_drake.tensions.slack_kernel import least_slack

METHOD_NAMES = (
    "quadratic_program",
    "reference_program",
    "polygon_2_norm",
    "slack_relaxed",
    "pseudo_inverse",
    "closed_form",
    "improved_closed_form",
    "puncture",
    "dykstra",
    "kernel",
    *GOALS,
    *POINTS,
)
"""The place of a method is its number. The first three are one kernel, with another reference."""

(
    QUADRATIC_PROGRAM,
    REFERENCE_PROGRAM,
    POLYGON_2_NORM,
    SLACK_RELAXED,
    PSEUDO_INVERSE,
    CLOSED_FORM,
    IMPROVED_CLOSED_FORM,
    PUNCTURE,
    DYKSTRA,
    KERNEL,
    LINEAR_PROGRAM,
    INFINITY_NORM,
    OPTIMALLY_SAFE,
    BARYCENTER,
    POLYGON_1_NORM,
    WEIGHTED_VERTICES,
) = range(len(METHOD_NAMES))


@njit(cache=True)
def solve_one(
    method: int,
    work: Array,
    W: Array,
    w: Array,
    lower: Array,
    upper: Array,
    reference: Array,
    row_scale: Array,
    t: Array,
) -> int:
    """One problem by the method of a number, which must fit the redundancy of W.

    With as many cables as degrees of freedom there is nothing to choose: every method solves.
    Where rounding loses the line or the polygon of a barely feasible problem, the least tensions
    take its place; they are exact, and prove infeasibility where there is none.

    Args:
        method: Place in `METHOD_NAMES`.
        work: Work space of `quadratic_program_kernel.workspace_shape`.
        W: Wrench matrix, shape (n, m).
        w: Wrench, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        reference: Wanted tensions, shape (m,) [N], zeros for all methods but `reference_program`.
        row_scale: As `slack_kernel.least_slack`, shape (n,).
        t: Gets the tensions, shape (m,) [N].

    Returns:
        1 feasible, 0 missed by this method, -1 infeasible, -2 singular W. Tensions that are not
        feasible are what the method came to (0), those of least slack (-1, `slack_relaxed`), or
        without meaning.
    """
    n, m = W.shape
    code = MISSED
    exact = method <= SLACK_RELAXED or n == m  # the exact program has the last word
    if method <= SLACK_RELAXED:
        pass
    elif method == PSEUDO_INVERSE or n == m:
        code = pseudo_inverse(W, w, lower, upper, t)
    elif method == CLOSED_FORM:
        code = closed_form(W, w, lower, upper, t)
    elif method == IMPROVED_CLOSED_FORM:
        code = improved_closed_form(W, w, lower, upper, t)
    elif method == PUNCTURE:
        code = puncture(W, w, lower, upper, t)
    elif method == DYKSTRA:
        code = dykstra(W, w, lower, upper, t)
    elif method == KERNEL or (method == WEIGHTED_VERTICES and m == n + 1):
        # With one cable to spare the polygon is a segment, of which both ends weigh the same.
        code = kernel_line(W, w, lower, upper, t)
        exact = True
    elif method <= OPTIMALLY_SAFE:
        code = search(method - LINEAR_PROGRAM, work, W, w, lower, upper, t)
    else:
        code = polygon_point(method - BARYCENTER, W, w, lower, upper, t)
        exact = True
    if exact and code == MISSED:
        code = nearest_tensions_in(work, W, w, lower, upper, reference, t)
        if method == SLACK_RELAXED and code == INFEASIBLE:
            least_slack(W, w, lower, upper, row_scale, t)
    elif code == FEASIBLE:  # by rounding at most out of bounds
        for i in range(m):
            t[i] = min(max(t[i], lower[i]), upper[i])
    return code

"""The methods of the field that distribute tensions, under one interface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions.dispatch_kernel import METHOD_NAMES, solve_one
from cdpr_drake.tensions.null_space_kernel import null_space
from cdpr_drake.tensions.polygon_kernel import polygon_vertices
from cdpr_drake.tensions.problem import (
    TensionProblem,
    TensionSolution,
    TensionStatus,
    judge_tensions,
    refuse,
)
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    SINGULAR,
    nearest_tensions,
    workspace_shape,
)


@dataclass(frozen=True)
class TensionMethod:
    """A method by name; what computes is the kernel of that name in `dispatch_kernel`.

    Attributes:
        name: Name, as in `distribute` and `cdpr tension --method`.
        title: What it does, in a few words.
        redundancies: The r = m - n that it takes; None: any.
        exact: Whether it finds tensions wherever there are some.
        needs_reference: Whether the problem must have a reference.
    """

    name: str
    title: str
    redundancies: tuple[int, ...] | None = None
    exact: bool = False
    needs_reference: bool = False

    @property
    def code(self) -> int:
        """Number of the method for `dispatch_kernel.solve_one`."""
        return METHOD_NAMES.index(self.name)

    def takes(self, redundancy: int) -> bool:
        """Whether it can distribute over n + redundancy cables."""
        return self.redundancies is None or redundancy in self.redundancies


METHODS: dict[str, TensionMethod] = {
    method.name: method
    for method in (
        TensionMethod("pseudo_inverse", "least 2-norm, bounds unknown"),
        TensionMethod("closed_form", "nearest to the middle of the bounds"),
        TensionMethod("improved_closed_form", "closed form, cables out of bounds put on them"),
        TensionMethod("kernel", "middle of the null line", (1,), exact=True),
        TensionMethod("linear_program", "least 1-norm", exact=True),
        TensionMethod("infinity_norm", "least largest tension", exact=True),
        TensionMethod("quadratic_program", "least 2-norm", exact=True),
        TensionMethod(
            "reference_program", "nearest to the reference", exact=True, needs_reference=True
        ),
        TensionMethod("barycenter", "centre of the feasible polygon", (2,), exact=True),
        TensionMethod("polygon_1_norm", "corner of least sum", (2,), exact=True),
        TensionMethod("polygon_2_norm", "point of the polygon of least 2-norm", (2,), exact=True),
        TensionMethod("puncture", "from the closed form to low tensions"),
        TensionMethod("dykstra", "alternating projections"),
        TensionMethod(
            "weighted_vertices", "vertices weighted by exterior angles", (0, 1, 2), exact=True
        ),
        TensionMethod("optimally_safe", "largest margin to the bounds", exact=True),
        TensionMethod("slack_relaxed", "least unbalanced wrench, always answers", exact=True),
    )
}
"""All methods by name, in the order of tables."""


def method_for(name: str, redundancy: int, has_reference: bool) -> TensionMethod:
    """The method of a name, which takes a redundancy m - n.

    Raises:
        TensionProblemError: There is no such method, or it needs another redundancy or a
            reference.
    """
    if name not in METHODS:
        raise TensionProblemError(f"method: found {name}; accepted: {', '.join(METHODS)}")
    method = METHODS[name]
    if not method.takes(redundancy):
        accepted = " or ".join(str(r) for r in method.redundancies or ())
        raise TensionProblemError(
            f"{name}: found redundancy m - n = {redundancy}; accepted: {accepted}"
        )
    if method.needs_reference and not has_reference:
        raise TensionProblemError(f"{name}: found no reference; accepted: tensions [N]")
    return method


def distribute(problem: TensionProblem, method: str = "quadratic_program") -> TensionSolution:
    """Distributes a wrench over the cables by a method, and judges the result.

    With as many cables as degrees of freedom there is nothing to choose: W t + w = 0 is solved.

    Args:
        problem: The problem.
        method: A name of `METHODS`.

    Raises:
        TensionProblemError: There is no such method, or it needs another redundancy or a
            reference; or W is singular to rounding.
    """
    n, m = problem.W.shape
    chosen = method_for(method, m - n, problem.reference is not None)
    wanted = problem.reference if chosen.needs_reference else None
    t = np.empty(m)
    # As Python, the choice compiles one kernel and not all of them.
    code = solve_one.py_func(
        chosen.code,
        np.empty(workspace_shape(n, m)),
        problem.W,
        problem.wrench,
        problem.lower,
        problem.upper,
        np.zeros(m) if wanted is None else wanted,
        np.ones(n) if problem.row_scale is None else problem.row_scale,
        t,
    )
    if code == SINGULAR:
        raise TensionProblemError(
            "W, wrench: found a wrench matrix that is singular to rounding, or numbers that "
            "overflow; accepted: full rank"
        )
    relaxed = code == INFEASIBLE and method == "slack_relaxed"
    if code == INFEASIBLE and not relaxed:
        return refuse(problem, method)
    solution = judge_tensions(problem, method, t, exists=not relaxed)
    if solution.status != TensionStatus.MISSED:
        return solution
    return solution if exact_tensions(problem) is not None else refuse(problem, method)


def exact_tensions(problem: TensionProblem, reference: Array | None = None) -> Array | None:
    """Tensions nearest to a reference (None: zero), shape (m,) [N]; None proves that none exist."""
    m = problem.W.shape[1]
    t = np.empty(m)
    wanted = np.zeros(m) if reference is None else reference
    code = nearest_tensions(problem.W, problem.wrench, problem.lower, problem.upper, wanted, t)
    return t if code == FEASIBLE else None


def solution_space(problem: TensionProblem) -> tuple[Array, Array]:
    """Least-norm solution t, shape (m,) [N], and orthonormal null space N, shape (m, r), of W."""
    n, m = problem.W.shape
    t, N = np.empty(m), np.empty((m - n, m))
    null_space(problem.W, problem.wrench, t, N)
    return t, np.ascontiguousarray(N.T)


def feasible_polygon(problem: TensionProblem) -> Array:
    """Corners of the polygon of feasible tensions in the null space, shape (2, k) [N].

    The corner eta stands for the tensions t + N eta of `solution_space`. Empty if infeasible.

    Raises:
        TensionProblemError: The redundancy is not 2.
    """
    if problem.redundancy != 2:
        raise TensionProblemError(
            f"feasible polygon: found redundancy {problem.redundancy}; accepted: 2"
        )
    t, N = solution_space(problem)
    rows = np.ascontiguousarray(N.T)
    return np.asarray(polygon_vertices(t, rows, problem.lower, problem.upper))

"""The methods of the field that distribute tensions, under one interface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from cdpr_drake import tension_closed_kernels as closed
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tension_lp_kernel import lowest_point
from cdpr_drake.tension_null_space import null_space
from cdpr_drake.tension_polygon import (
    polygon_barycenter,
    polygon_steiner_point,
    polygon_vertices,
)
from cdpr_drake.tension_problem import (
    TensionProblem,
    TensionSolution,
    TensionStatus,
    judge,
    refuse,
)
from cdpr_drake.tension_qp_kernel import FEASIBLE, nearest_tensions

DYKSTRA_ROUNDS = 20_000
"""After this many rounds the alternating projections are taken to have missed."""

RELAXING_STEPS = 1000
"""More than the active-set method of SciPy ever needs for a few cables."""

Finder = Callable[[TensionProblem], Array | None]


@dataclass(frozen=True)
class TensionMethod:
    """A method by name.

    Attributes:
        name: Name, as in `distribute` and `cdpr tension --method`.
        title: What it does, in a few words.
        find: Gives tensions, shape (m,) [N], to be judged, or None where it has none.
        redundancy: The r = m - n that it needs; None: any.
        exact: Whether it finds tensions wherever there are some.
        needs_reference: Whether the problem must have a reference.
    """

    name: str
    title: str
    find: Finder
    redundancy: int | None = None
    exact: bool = False
    needs_reference: bool = False


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
    return _vertices(problem, *solution_space(problem))


def _vertices(problem: TensionProblem, t: Array, N: Array) -> Array:
    rows = np.ascontiguousarray(N.T)
    return np.asarray(polygon_vertices(t, rows, problem.lower, problem.upper))


def _with_kernel(kernel: Callable[..., int]) -> Finder:
    def find(problem: TensionProblem) -> Array | None:
        t = np.empty(problem.W.shape[1])
        kernel(problem.W, problem.wrench, problem.lower, problem.upper, t)
        return t

    return find


def _on_polygon(choose: Callable[[Array], Array]) -> Finder:
    def find(problem: TensionProblem) -> Array | None:
        t, N = solution_space(problem)
        vertices = _vertices(problem, t, N)
        if vertices.shape[1] == 0:
            # Rounding may lose the polygon of a barely feasible problem, but not its nearest point.
            return exact_tensions(problem)
        return t + N @ choose(vertices)

    return find


def _polygon_1_norm(problem: TensionProblem) -> Array | None:
    t, N = solution_space(problem)
    vertices = _vertices(problem, t, N)
    if vertices.shape[1] == 0:
        return exact_tensions(problem)
    sums = N.sum(axis=0) @ vertices
    return np.asarray(t + N @ vertices[:, int(np.argmin(sums))])


def _linear_program(problem: TensionProblem) -> Array | None:
    start = exact_tensions(problem)
    if start is None:
        return None
    t, N = solution_space(problem)
    eta = np.ascontiguousarray(N.T @ start)
    if not lowest_point(N.sum(axis=0), N, problem.lower - t, problem.upper - t, eta):
        return start  # out of steps; feasible, if not the least
    return np.asarray(t + N @ eta)


def _infinity_norm(problem: TensionProblem) -> Array | None:
    start = exact_tensions(problem)
    if start is None:
        return None
    t, N = solution_space(problem)
    m, r = N.shape
    # Unknowns (eta, s): t + N eta - s <= 0 makes s the largest tension.
    rows = np.block([[N, np.zeros((m, 1))], [N, -np.ones((m, 1))]])
    low = np.concatenate([problem.lower - t, np.full(m, -np.inf)])
    high = np.concatenate([problem.upper - t, -t])
    x = np.append(N.T @ start, np.max(start))
    if not lowest_point(np.append(np.zeros(r), 1.0), rows, low, high, x):
        return start  # out of steps; feasible, if not the least
    return np.asarray(t + N @ x[:r])


def _optimally_safe(problem: TensionProblem) -> Array | None:
    t, N = solution_space(problem)
    m, r = N.shape
    middle = (problem.lower + problem.upper) / 2.0
    eta = N.T @ middle
    # Unknowns (eta, s): lower + s <= t + N eta <= upper - s; s may be negative at the start.
    rows = np.block([[N, -np.ones((m, 1))], [N, np.ones((m, 1))]])
    low = np.concatenate([problem.lower - t, np.full(m, -np.inf)])
    high = np.concatenate([np.full(m, np.inf), problem.upper - t])
    here = t + N @ eta
    margin = min(np.min(here - problem.lower), np.min(problem.upper - here))
    x = np.append(eta, margin)
    if not lowest_point(np.append(np.zeros(r), -1.0), rows, low, high, x):
        return exact_tensions(problem)  # out of steps
    return np.asarray(t + N @ x[:r])


def _dykstra(problem: TensionProblem) -> Array | None:
    t = np.empty(problem.W.shape[1])
    middle = (problem.lower + problem.upper) / 2.0
    closed.dykstra(
        problem.W, problem.wrench, problem.lower, problem.upper, middle, DYKSTRA_ROUNDS, t
    )
    return t


def _weighted_vertices(problem: TensionProblem) -> Array | None:
    if problem.redundancy == 0:
        return solution_space(problem)[0]
    if problem.redundancy == 1:  # two ends of a segment, equal weights
        return _with_kernel(closed.kernel_line)(problem)
    if problem.redundancy == 2:
        return _on_polygon(polygon_steiner_point)(problem)
    raise TensionProblemError(
        f"weighted_vertices: found redundancy {problem.redundancy}; accepted: 0, 1 or 2"
    )


def _slack_relaxed(problem: TensionProblem) -> Array | None:
    exact = exact_tensions(problem)
    if exact is not None:
        return exact
    fixed = problem.lower == problem.upper
    span = np.where(fixed, 1e-12 * np.maximum(problem.upper, 1.0), 0.0)
    result = lsq_linear(
        problem.W,
        -problem.wrench,
        (problem.lower, problem.upper + span),
        method="bvls",
        tol=1e-14,
        max_iter=RELAXING_STEPS,
    )
    return np.clip(result.x, problem.lower, problem.upper)


METHODS: dict[str, TensionMethod] = {
    method.name: method
    for method in (
        TensionMethod(
            "pseudo_inverse", "least 2-norm, bounds unknown", _with_kernel(closed.pseudo_inverse)
        ),
        TensionMethod(
            "closed_form", "nearest to the middle of the bounds", _with_kernel(closed.closed_form)
        ),
        TensionMethod(
            "improved_closed_form",
            "closed form, cables out of bounds put on them",
            _with_kernel(closed.improved_closed_form),
        ),
        TensionMethod(
            "kernel", "middle of the null line", _with_kernel(closed.kernel_line), redundancy=1,
            exact=True,
        ),
        TensionMethod("linear_program", "least 1-norm", _linear_program, exact=True),
        TensionMethod("infinity_norm", "least largest tension", _infinity_norm, exact=True),
        TensionMethod("quadratic_program", "least 2-norm", exact_tensions, exact=True),
        TensionMethod(
            "reference_program",
            "nearest to the reference",
            lambda problem: exact_tensions(problem, problem.reference),
            exact=True,
            needs_reference=True,
        ),
        TensionMethod(
            "barycenter", "centre of the feasible polygon", _on_polygon(polygon_barycenter), 2, True
        ),
        TensionMethod("polygon_1_norm", "corner of least sum", _polygon_1_norm, 2, True),
        TensionMethod(
            "polygon_2_norm", "point of the polygon of least 2-norm", exact_tensions, 2, True
        ),
        TensionMethod(
            "puncture", "from the closed form to low tensions", _with_kernel(closed.puncture)
        ),
        TensionMethod("dykstra", "alternating projections", _dykstra),
        TensionMethod(
            "weighted_vertices", "vertices weighted by exterior angles", _weighted_vertices,
            exact=True,
        ),
        TensionMethod(
            "optimally_safe", "largest margin to the bounds", _optimally_safe, exact=True
        ),
        TensionMethod(
            "slack_relaxed", "least unbalanced wrench, always answers", _slack_relaxed, exact=True
        ),
    )
}  # fmt: skip
"""All methods by name, in the order of tables."""


def distribute(problem: TensionProblem, method: str = "quadratic_program") -> TensionSolution:
    """Distributes a wrench over the cables by a method, and judges the result.

    With as many cables as degrees of freedom there is nothing to choose: W t + w = 0 is solved.

    Args:
        problem: The problem.
        method: A name of `METHODS`.

    Raises:
        TensionProblemError: There is no such method, or it needs another redundancy or a
            reference.
    """
    if method not in METHODS:
        raise TensionProblemError(f"method: found {method}; accepted: {', '.join(METHODS)}")
    chosen = METHODS[method]
    if problem.redundancy == 0 and chosen.redundancy is None and method != "slack_relaxed":
        chosen = replace(chosen, find=lambda p: solution_space(p)[0])
    elif chosen.redundancy is not None and problem.redundancy != chosen.redundancy:
        raise TensionProblemError(
            f"{method}: found redundancy m - n = {problem.redundancy}; "
            f"accepted: {chosen.redundancy}"
        )
    if chosen.needs_reference and problem.reference is None:
        raise TensionProblemError(f"{method}: found no reference; accepted: tensions [N]")
    tensions = chosen.find(problem)
    if tensions is None or not np.all(np.isfinite(tensions)):
        return refuse(problem, method)
    solution = judge(problem, method, tensions, exists=True)
    if solution.status == TensionStatus.FEASIBLE or method == "slack_relaxed":
        if solution.status == TensionStatus.MISSED:
            solution = replace(solution, status=TensionStatus.INFEASIBLE)
        return solution
    if exact_tensions(problem) is None:
        return refuse(problem, method)
    return solution

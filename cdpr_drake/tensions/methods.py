"""The methods that distribute tensions: their table, and one problem, a loop or a batch by them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit
from pydrake.solvers import MathematicalProgram

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError, accepted_names
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.tensions.barrier_kernel import log_barrier
from cdpr_drake.tensions.closed_form_kernel import (
    closed_form,
    dykstra,
    improved_closed_form,
    kernel_line,
    pseudo_inverse,
    puncture,
)
from cdpr_drake.tensions.control_step_kernel import (
    NOT_FINITE,
    kernel_address,
    solution_of,
    solve_or_prove,
)
from cdpr_drake.tensions.optimal_kernel import (
    infinity_norm,
    linear_program,
    optimally_safe,
    slack_relaxed,
)
from cdpr_drake.tensions.polygon_kernel import (
    barycenter,
    polygon_1_norm,
    polygon_vertices,
    weighted_vertices,
)
from cdpr_drake.tensions.problem import (
    TensionProblem,
    TensionSolution,
    TensionStatus,
    checked_numbers,
    refuse,
    writable,
)
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    NOT_FOUND,
    SINGULAR,
    median,
    nearest_tensions_in,
    null_space,
    workspace_shape,
)

if TYPE_CHECKING:
    from cdpr_drake.tensions.program_method import ProgramKernel, StepTimes

Goal = Callable[[MathematicalProgram, np.ndarray, TensionProblem, float], None]
"""Adds an objective to a program; takes its variables t / scale, the problem and the scale [N]."""

_STATUS = {
    FEASIBLE: TensionStatus.FEASIBLE,
    NOT_FOUND: TensionStatus.NOT_FOUND,
    INFEASIBLE: TensionStatus.INFEASIBLE,
}

_workspace_shape = workspace_shape.py_func
"""In Python, where a call of compiled code costs more than these sums."""


@dataclass(frozen=True)
class TensionMethod:
    """A method of `METHODS`.

    Attributes:
        title: What it finds, in a few words.
        kernel: Compiled by numba, `kernel(work, W, w, lower, upper, reference, row_scale, t)`:
            writes the tensions t and returns a code of `quadratic_program_kernel`, where the
            arguments are described; row_scale, shape (n,), is that of `TensionProblem` or ones, and
            the reference is zero unless it is needed. With m = n only kernels that relax are
            called; for the others W t + w = 0 is solved. None: the exact program is the method.
        redundancies: The r = m - n that it takes; None: any.
        exact: True if it finds tensions wherever there are some. Where its kernel misses, the
            exact program answers.
        needs_reference: True if the problem must have a reference.
        relaxes: True if its tensions count in loops of control where there is no solution, or it
            misses them.
        answers: True if `distribute` gives its tensions where there is no solution, too.
        central: True if it aims between the bounds, so that it needs finite upper ones.
        starts: True if its kernel starts at the reference, where that is within the bounds: with
            the tensions of the step before it is faster, and gives the same.
        program: Adds its goal to a program of Drake, see `make_program`; None: there is none.
        user_program: The programs of a method made by `from_program`; None for a kernel.
    """

    title: str
    kernel: Any | None
    redundancies: tuple[int, ...] | None = None
    exact: bool = False
    needs_reference: bool = False
    relaxes: bool = False
    answers: bool = False
    starts: bool = False
    central: bool = False
    program: Goal | None = None
    user_program: ProgramKernel | None = None

    @staticmethod
    def from_program(
        name: str, build: Callable[[TensionProblem], Any], title: str = ""
    ) -> TensionMethod:
        """Adds a method made of a program with own costs and constraints to `METHODS`.

        In this process `distribute`, batches, `TensionDistributor`, scenarios and commands called
        from Python take it by its name. It replaces an earlier method made so with the same name.

        Args:
            name: Name of the method.
            build: Makes a `TensionProgram` with all terms for a problem; called once for each set
                of bounds. Afterwards W and wrench in it change, and the solver starts at the
                tensions of the step before, or at the `start` of a `Distributor`.
            title: What it finds, in a few words.

        Raises:
            TensionProblemError: The name is empty, or that of a kernel.
        """
        if not name or (name in METHODS and METHODS[name].user_program is None):
            raise TensionProblemError(
                f"from_program: found the name {name!r}; accepted: one that no kernel has"
            )
        from cdpr_drake.tensions.program_method import ProgramKernel

        program = ProgramKernel(name, build)
        METHODS[name] = TensionMethod(
            title or "a program of one's own", program.kernel, starts=True, user_program=program
        )
        return METHODS[name]

    @property
    def step_times(self) -> StepTimes | None:
        """Times of the steps of its program since the last count began; None for a kernel."""
        return None if self.user_program is None else self.user_program.times

    def prepare(self, problem: TensionProblem, period: float | None = None) -> None:
        """Builds its program, if it has one; a period [s] restarts the count of its steps.

        Raises:
            TensionProblemError: Own terms do not fit the problem.
        """
        if self.user_program is not None:
            self.user_program.prepare(problem)
            if period is not None:
                self.user_program.times.restart(period)

    def takes(self, redundancy: int) -> bool:
        """True if it can distribute over n + redundancy cables."""
        return self.redundancies is None or redundancy in self.redundancies

    def compiled(self, redundancy: int) -> tuple[int, bool, bool]:
        """Address of the kernel (0: none), whether the exact program answers, `relaxes`."""
        kernel, exact = self.kernel, self.exact
        if redundancy == 0 and kernel is not None and not (self.relaxes or self.user_program):
            kernel, exact = pseudo_inverse, True
        return 0 if kernel is None else kernel_address(kernel), exact, self.relaxes


def _sum(program: Any, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    program.AddLinearCost(np.ones(len(t)), 0.0, t)


def _nearest(program: Any, t: np.ndarray, point: Array) -> None:
    program.AddQuadraticCost(
        2.0 * np.eye(len(t)), -2.0 * point, float(point @ point), t, is_convex=True
    )


def _two_norm(program: Any, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    program.AddQuadraticCost(2.0 * np.eye(len(t)), np.zeros(len(t)), t, is_convex=True)


def _nearest_reference(program: Any, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    assert problem.reference is not None
    _nearest(program, t, problem.reference / scale)


def _nearest_middle(program: Any, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    _nearest(program, t, (problem.lower + problem.upper) / (2.0 * scale))


def _largest(program: Any, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    m, bound = len(t), program.NewContinuousVariables(1, "largest")
    rows, unbounded = np.hstack([np.eye(m), -np.ones((m, 1))]), np.full(m, -np.inf)
    program.AddLinearConstraint(rows, unbounded, np.zeros(m), np.concatenate([t, bound]))
    program.AddLinearCost(np.ones(1), 0.0, bound)


def _margin(program: Any, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    m, margin = len(t), program.NewContinuousVariables(1, "margin")
    variables, infinite = np.concatenate([t, margin]), np.full(m, np.inf)
    above, below = (np.hstack([np.eye(m), sign * np.ones((m, 1))]) for sign in (-1.0, 1.0))
    program.AddLinearConstraint(above, problem.lower / scale, infinite, variables)
    program.AddLinearConstraint(below, -infinite, problem.upper / scale, variables)
    program.AddLinearCost(-np.ones(1), 0.0, margin)


def _slack(program: Any, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    """Instead of balance, in units of row_scale."""
    n = len(problem.wrench)
    slack = program.NewContinuousVariables(n, "slack")
    rows = np.hstack([problem.W, -np.diag(problem.scale_of_rows)])
    program.AddLinearEqualityConstraint(rows, -problem.wrench / scale, np.concatenate([t, slack]))
    program.AddQuadraticCost(2.0 * np.eye(n), np.zeros(n), slack, is_convex=True)


METHODS: dict[str, TensionMethod] = {
    "pseudo_inverse": TensionMethod("least 2-norm, bounds unknown", pseudo_inverse),
    "closed_form": TensionMethod("nearest to the middle of the bounds", closed_form, central=True),
    "improved_closed_form": TensionMethod(
        "closed form, cables out of bounds put on them", improved_closed_form, central=True
    ),
    "kernel": TensionMethod("middle of the null line", kernel_line, (1,), exact=True, central=True),
    "linear_program": TensionMethod("least 1-norm", linear_program, exact=True, program=_sum),
    "infinity_norm": TensionMethod(
        "least largest tension", infinity_norm, exact=True, program=_largest
    ),
    "quadratic_program": TensionMethod("least 2-norm", None, exact=True, program=_two_norm),
    "reference_program": TensionMethod(
        "nearest to the reference", None, exact=True, needs_reference=True,
        program=_nearest_reference,
    ),
    "barycenter": TensionMethod(
        "centre of the feasible polygon", barycenter, (2,), exact=True, central=True
    ),
    "polygon_1_norm": TensionMethod("corner of least sum", polygon_1_norm, (2,), exact=True),
    "polygon_2_norm": TensionMethod(
        "point of the polygon of least 2-norm", None, (2,), exact=True
    ),
    "puncture": TensionMethod("from the closed form to low tensions", puncture, central=True),
    "dykstra": TensionMethod("alternating projections", dykstra, central=True),
    "weighted_vertices": TensionMethod(
        "vertices weighted by exterior angles", weighted_vertices, (0, 1, 2), exact=True,
        central=True,
    ),
    "optimally_safe": TensionMethod(
        "largest margin to the bounds", optimally_safe, exact=True, central=True, program=_margin
    ),
    "slack_relaxed": TensionMethod(
        "least unbalanced wrench, always answers", slack_relaxed, exact=True, relaxes=True,
        answers=True, program=_slack,
    ),
    "median": TensionMethod(
        "nearest to the middle of the bounds within them", median, exact=True, central=True,
        program=_nearest_middle,
    ),
    "log_barrier": TensionMethod(
        "least 4-norm with barriers at the bounds, continuous rates", log_barrier, relaxes=True,
        starts=True, central=True,
    ),
}  # fmt: skip
"""All methods by name, in the order of tables. A new one is a kernel and a row."""


def method_for(name: str, redundancy: int, has_reference: bool) -> TensionMethod:
    """Method of a name for a redundancy m - n.

    Raises:
        TensionProblemError: Unknown name, a redundancy that it does not take, or no reference where
            it needs one.
    """
    if name not in METHODS:
        raise TensionProblemError(f"method: found {name}; {accepted_names(name, METHODS)}")
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
    """Distributes a wrench over the cables by a method of `METHODS`, and checks the result.

    With as many cables as degrees of freedom there is no choice: W t + w = 0 is solved.

    Raises:
        TensionProblemError: As `method_for`; or W is singular to rounding.
    """
    return Distributor(problem, method)._solution(writable(problem.W), writable(problem.wrench))


class Distributor:
    """A method prepared for many wrench matrices and wrenches of one robot, as in a loop.

    Bounds, reference, sizes and method are checked once. A call checks W and wrench in compiled
    code, and gives the solution of `distribute` in a tenth of the time.
    """

    def __init__(self, problem: TensionProblem, method: str = "quadratic_program") -> None:
        """Takes a problem like those that follow; they may differ in W and wrench.

        Raises:
            TensionProblemError: As `method_for`.
        """
        n, m = problem.W.shape
        self._method = method_for(method, m - n, problem.reference is not None)
        if self._method.central and np.any(np.isposinf(problem.upper)):
            raise TensionProblemError(
                f"{method}: found an infinite upper tension, and it aims between the bounds; "
                "accepted: finite ones [N], or quadratic_program"
            )
        self._method.prepare(problem)
        self._problem, self._name, self._shape = problem, method, (n, m)
        needed = problem.reference if self._method.needs_reference else None
        self._reference = np.zeros(m) if needed is None else writable(needed)
        self._bounds = writable(problem.lower), problem.finite_upper()
        self._scale = writable(problem.scale_of_rows)
        self._compiled = self._method.compiled(m - n)
        self._work_shape = _workspace_shape(n, m)

    def __call__(self, W: Array, wrench: Array, start: Array | None = None) -> TensionSolution:
        """Distributes a wrench, shape (n,) [N m, N], by a wrench matrix, shape (n, m).

        Args:
            W: Wrench matrix.
            wrench: External wrench.
            start: Tensions near the solution, such as those of the last call, shape (m,) [N]; a
                method that `starts` is faster with it, others ignore it.

        Raises:
            TensionProblemError: Shapes that do not fit, numbers that are not finite, or a W that is
                singular to rounding.
        """
        n, m = self._shape
        W, wrench = np.ascontiguousarray(W, float), np.ascontiguousarray(wrench, float)
        if W.shape != (n, m) or wrench.shape != (n,):
            raise TensionProblemError(
                f"W, wrench: found shapes {W.shape}, {wrench.shape}; accepted: {(n, m)}, {(n,)}"
            )
        if not (W.flags.writeable and wrench.flags.writeable):
            W, wrench = W.copy(), wrench.copy()  # kernels at an address take nothing read-only
        if start is None or not self._method.starts:
            return self._solution(W, wrench)
        start = np.array(start, float)
        if start.shape != (m,):
            raise TensionProblemError(f"start: found shape {start.shape}; accepted: {(m,)}")
        return self._solution(W, wrench, start)

    def _solution(self, W: Array, wrench: Array, start: Array | None = None) -> TensionSolution:
        problem, (n, m) = self._problem, self._shape
        t, slack, active = np.empty(m), np.empty(n), np.empty(m, np.int64)
        code, residual = solution_of(
            self._compiled, np.empty(self._work_shape), W, wrench, *self._bounds,
            self._reference if start is None else start, self._scale, t, active, slack,
        )  # fmt: skip
        if code == NOT_FINITE:
            raise TensionProblemError(
                "W, wrench: found NaN, infinity or overflow; accepted: finite"
            )
        if code == SINGULAR:
            raise TensionProblemError(
                "W, wrench: found a wrench matrix that is singular to rounding, or numbers that "
                "overflow; accepted: full rank"
            )
        if code == INFEASIBLE and not self._method.answers:
            return refuse(problem, self._name)
        return TensionSolution(self._name, _STATUS[code], t, residual, active, slack)


@njit(cache=True, nogil=True)
def _distribute_rows(
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
    """Distributes many wrenches on all cores; feasible by the same limits as `distribute`.

    Args:
        W: Wrench matrices, shape (k, n, m). A singular one spoils its own row only.
        wrenches: External wrenches about Po, shape (k, n) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        method: A name of `METHODS`.
        reference: Preferred tensions, shape (m,) [N], for `reference_program`.
        threads: Number of threads; None: all cores.
        row_scale: As in `TensionProblem`, shape (n,) [m, -]; None: ones.

    Returns:
        Tensions, shape (k, m) [N], NaN where there are none, and codes, shape (k,): 1 feasible,
        0 missed by this method, -1 infeasible, -2 singular W. With -1, a method that `answers`
        gives tensions within the bounds and off balance.

    Raises:
        TensionProblemError: As `TensionProblem`, except for the rank, and as `method_for`; or
            threads below 1.
    """
    numbers = checked_numbers(
        {"W": W, "wrenches": wrenches, "lower": lower, "upper": upper, "reference": reference,
         "row_scale": row_scale}, "(k, n, m)",
    )  # fmt: skip
    count, n, m = numbers["W"].shape
    chosen = method_for(method, m - n, reference is not None)
    if threads is not None and threads < 1:
        raise TensionProblemError(f"threads: found {threads}; accepted: at least 1")
    if not chosen.needs_reference:
        numbers["reference"] = np.zeros(m)
    t, codes = np.empty((count, m)), np.empty(count, np.int8)
    over_rows(
        _distribute_rows, count, threads, chosen.compiled(m - n), numbers["W"], numbers["wrenches"],
        numbers["lower"], numbers["upper"], numbers["reference"],
        numbers.get("row_scale", np.ones(n)), t, codes,
    )  # fmt: skip
    t[codes == SINGULAR if chosen.answers else codes < 0] = np.nan
    return t, codes


def exact_tensions(problem: TensionProblem, reference: Array | None = None) -> Array | None:
    """Tensions nearest to a reference (None: zero), shape (m,) [N]; None proves that none exist."""
    n, m = problem.W.shape
    t, work = np.empty(m), np.empty(_workspace_shape(n, m))
    point = np.zeros(m) if reference is None else reference
    arrays = [writable(array) for array in (problem.W, problem.wrench, problem.lower)]
    code = nearest_tensions_in(work, *arrays, problem.finite_upper(), point, t)
    return t if code == FEASIBLE else None


def solution_space(problem: TensionProblem) -> tuple[Array, Array]:
    """Least-norm solution t, shape (m,) [N], and orthonormal null space N, shape (m, r), of W."""
    n, m = problem.W.shape
    t, N = np.empty(m), np.empty((m - n, m))
    null_space(writable(problem.W), writable(problem.wrench), t, N)
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
    return np.asarray(polygon_vertices(t, rows, writable(problem.lower), problem.finite_upper()))

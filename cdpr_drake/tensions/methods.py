"""The methods of the field that distribute tensions, under one interface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError, accepted_names
from cdpr_drake.tensions import objectives
from cdpr_drake.tensions.barrier_kernel import log_barrier
from cdpr_drake.tensions.closed_form_kernel import (
    NOT_FOUND,
    closed_form,
    dykstra,
    improved_closed_form,
    kernel_line,
    pseudo_inverse,
    puncture,
)
from cdpr_drake.tensions.dispatch_kernel import NOT_FINITE, kernel_address, solution_of
from cdpr_drake.tensions.linear_goals_kernel import infinity_norm, linear_program, optimally_safe
from cdpr_drake.tensions.null_space_kernel import null_space
from cdpr_drake.tensions.objectives import Addition
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
    refuse,
    writable,
)
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    INFEASIBLE,
    SINGULAR,
    median,
    nearest_tensions_in,
    workspace_shape,
)
from cdpr_drake.tensions.slack_kernel import slack_relaxed

if TYPE_CHECKING:
    from cdpr_drake.tensions.program_method import Build, ProgramKernel, StepTimes

_workspace_shape = workspace_shape.py_func
"""As Python: a call of compiled code costs more than these sums."""


@dataclass(frozen=True)
class TensionMethod:
    """A method, as `METHODS` has it by the name for `distribute` and `cdpr tension --method`.

    Attributes:
        title: What it does, in a few words.
        kernel: What computes, compiled by numba: `kernel(work, W, w, lower, upper, reference,
            row_scale, t)` writes the tensions t, shape (m,) [N], and returns 1 feasible, 0 missed,
            -1 infeasible (a proof) or -2 singular W. `work` is a work space of `workspace_shape`,
            W the wrench matrix, shape (n, m), w the wrench, shape (n,) [N m, N]; the bounds and
            the reference, which is zero unless it is needed, have shape (m,) [N]; row_scale, shape
            (n,), is that of `TensionProblem` or ones. With m = n kernels that do not relax are not
            asked: W t + w = 0 is solved. None: the exact program is the method.
        redundancies: The r = m - n that it takes; None: any.
        exact: Whether it finds tensions wherever there are some. Where its kernel misses, the
            exact program answers.
        needs_reference: Whether the problem must have a reference.
        relaxes: Whether its tensions count in loops of control where there is no solution, or it
            misses them.
        answers: Whether `distribute` gives its tensions where there is no solution, too.
        central: Whether it aims between the bounds, so that it needs upper ones.
        starts: Whether its kernel starts at the reference, where that is within the bounds; with
            what it gave a step before it is faster, and gives the same.
        program: What it adds to a program of Drake, see `make_program`; None: there is none.
        asked: Of a method made by `from_program`, what asks the program; None: it is a kernel.
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
    program: Addition | None = None
    asked: ProgramKernel | None = None

    @staticmethod
    def from_program(name: str, build: Build, title: str = "") -> TensionMethod:
        """A method made of a program with costs and constraints of one's own, by name.

        It is a row of `METHODS` from then on, in this process: `distribute`, batches,
        `TensionDistributor`, scenarios and commands called from Python take it by its name. A name
        that was given before to such a method stands for the new one.

        Args:
            name: The name.
            build: From a problem to a `TensionProgram` with all terms; called once for each set of
                bounds. At every step W and wrench in it change, and the solver starts at the
                tensions of the step before, in a loop, or at what `Distributor` is given.
            title: What it does, in a few words.

        Raises:
            TensionProblemError: The name is that of a kernel, or none.
        """
        if not name or (name in METHODS and METHODS[name].asked is None):
            raise TensionProblemError(
                f"from_program: found the name {name!r}; accepted: one that no kernel has"
            )
        from cdpr_drake.tensions.program_method import ProgramKernel

        asked = ProgramKernel(name, build)
        words = title or "a program of one's own"
        METHODS[name] = TensionMethod(words, asked.kernel, starts=True, asked=asked)
        return METHODS[name]

    @property
    def step_times(self) -> StepTimes | None:
        """How long its steps took since they were counted anew; None: of kernels."""
        return None if self.asked is None else self.asked.times

    def prepare(self, problem: TensionProblem, period: float | None = None) -> None:
        """Builds its program, if it has one; counts steps anew where a period is given [s].

        Raises:
            TensionProblemError: Own terms do not fit the problem.
        """
        if self.asked is not None:
            self.asked.prepare(problem)
            if period is not None:
                self.asked.times.restart(period)

    def takes(self, redundancy: int) -> bool:
        """Whether it can distribute over n + redundancy cables."""
        return self.redundancies is None or redundancy in self.redundancies

    def compiled(self, redundancy: int) -> tuple[int, bool, bool]:
        """Address of the compiled solver, whether the exact program answers, `relaxes`."""
        kernel, exact = self.kernel, self.exact
        chooses = self.relaxes or self.asked is not None
        if redundancy == 0 and kernel is not None and not chooses:
            kernel, exact = pseudo_inverse, True
        return 0 if kernel is None else kernel_address(kernel), exact, self.relaxes


METHODS: dict[str, TensionMethod] = {
    "pseudo_inverse": TensionMethod("least 2-norm, bounds unknown", pseudo_inverse),
    "closed_form": TensionMethod("nearest to the middle of the bounds", closed_form, central=True),
    "improved_closed_form": TensionMethod(
        "closed form, cables out of bounds put on them", improved_closed_form, central=True
    ),
    "kernel": TensionMethod("middle of the null line", kernel_line, (1,), exact=True, central=True),
    "linear_program": TensionMethod(
        "least 1-norm", linear_program, exact=True, program=objectives.one_norm
    ),
    "infinity_norm": TensionMethod(
        "least largest tension", infinity_norm, exact=True, program=objectives.infinity_norm
    ),
    "quadratic_program": TensionMethod(
        "least 2-norm", None, exact=True, program=objectives.two_norm
    ),
    "reference_program": TensionMethod(
        "nearest to the reference", None, exact=True, needs_reference=True,
        program=objectives.nearest_reference,
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
        "largest margin to the bounds", optimally_safe, exact=True, central=True,
        program=objectives.largest_margin,
    ),
    "slack_relaxed": TensionMethod(
        "least unbalanced wrench, always answers", slack_relaxed, exact=True, relaxes=True,
        answers=True, program=objectives.least_slack,
    ),
    "median": TensionMethod(
        "nearest to the middle of the bounds within them", median, exact=True, central=True,
        program=objectives.nearest_middle,
    ),
    "log_barrier": TensionMethod(
        "least 4-norm with barriers at the bounds, continuous rates", log_barrier, relaxes=True,
        starts=True, central=True,
    ),
}  # fmt: skip
"""All methods by name, in the order of tables. A new one is a kernel and a row."""


def method_for(name: str, redundancy: int, has_reference: bool) -> TensionMethod:
    """The method of a name, which takes a redundancy m - n.

    Raises:
        TensionProblemError: There is no such method, or it needs another redundancy or a
            reference.
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
    """Distributes a wrench over the cables by a method, and judges the result.

    With as many cables as degrees of freedom there is nothing to choose: W t + w = 0 is solved.

    Args:
        problem: The problem.
        method: A name of `METHODS`.

    Raises:
        TensionProblemError: There is no such method, or it needs another redundancy or a
            reference; or W is singular to rounding.
    """
    return Distributor(problem, method)._solution(writable(problem.W), writable(problem.wrench))


class Distributor:
    """A method made ready for many wrench matrices and wrenches of one robot, as in a loop.

    What stays the same is checked once: bounds, reference, sizes, whether the method applies. A
    call checks the rest as `TensionProblem` does, in compiled code, and answers as `distribute`
    does, in a tenth of the time that both take.
    """

    def __init__(self, problem: TensionProblem, method: str = "quadratic_program") -> None:
        """For problems that differ from this one in W and in the wrench only.

        Raises:
            TensionProblemError: As `method_for`.
        """
        n, m = problem.W.shape
        chosen = method_for(method, m - n, problem.reference is not None)
        if chosen.central and np.any(np.isposinf(problem.upper)):
            raise TensionProblemError(
                f"{method}: found an infinite upper tension, and it aims between the bounds; "
                "accepted: finite ones [N], or quadratic_program"
            )
        chosen.prepare(problem)
        wanted = problem.reference if chosen.needs_reference else None
        self._problem, self._method, self._chosen = problem, method, chosen
        self._wanted = writable(problem.nothing_wanted if wanted is None else wanted)
        self._bounds = writable(problem.lower), problem.finite_upper()
        self._scale = writable(problem.scale_of_rows)
        self._compiled = chosen.compiled(m - n)
        self._shape, self._size, self._count = (n, m), (n,), m
        self._work_shape = _workspace_shape(n, m)

    def __call__(self, W: Array, wrench: Array, start: Array | None = None) -> TensionSolution:
        """Distributes a wrench, shape (n,) [N m, N], by a wrench matrix, shape (n, m).

        Args:
            W: Wrench matrix.
            wrench: External wrench.
            start: Tensions near the solution, such as those of the call before, shape (m,) [N];
                a method that `starts` is faster with it, and others ignore it.

        Raises:
            TensionProblemError: Sizes that do not fit, numbers that are not finite, or a W that is
                singular to rounding.
        """
        W, wrench = np.ascontiguousarray(W, float), np.ascontiguousarray(wrench, float)
        if W.shape != self._shape or wrench.shape != self._size:
            raise TensionProblemError(
                f"W, wrench: found shapes {W.shape}, {wrench.shape}; accepted: {self._shape}, "
                f"{self._size}"
            )
        if not (W.flags.writeable and wrench.flags.writeable):
            W, wrench = W.copy(), wrench.copy()  # kernels at an address take nothing read-only
        if start is None or not self._chosen.starts:
            return self._solution(W, wrench)
        start = np.array(start, float)
        if start.shape != (self._count,):
            raise TensionProblemError(
                f"start: found shape {start.shape}; accepted: ({self._count},)"
            )
        return self._solution(W, wrench, start)

    def _solution(self, W: Array, wrench: Array, start: Array | None = None) -> TensionSolution:
        problem, t, slack = self._problem, np.empty(self._count), np.empty(self._size)
        active = np.empty(self._count, np.int64)
        code, residual = solution_of(
            self._compiled, np.empty(self._work_shape), W, wrench, *self._bounds,
            self._wanted if start is None else start, self._scale, t, active, slack,
        )  # fmt: skip
        if code == FEASIBLE:
            return TensionSolution(self._method, TensionStatus.FEASIBLE, t, residual, active, slack)
        if code == NOT_FINITE:
            raise TensionProblemError(
                "W, wrench: found NaN, infinity or overflow; accepted: finite"
            )
        if code == SINGULAR:
            raise TensionProblemError(
                "W, wrench: found a wrench matrix that is singular to rounding, or numbers that "
                "overflow; accepted: full rank"
            )
        if code == INFEASIBLE and not self._chosen.answers:
            return refuse(problem, self._method)
        status = TensionStatus.NOT_FOUND if code == NOT_FOUND else TensionStatus.INFEASIBLE
        return TensionSolution(self._method, status, t, residual, active, slack)


def exact_tensions(problem: TensionProblem, reference: Array | None = None) -> Array | None:
    """Tensions nearest to a reference (None: zero), shape (m,) [N]; None proves that none exist."""
    n, m = problem.W.shape
    t, work = np.empty(m), np.empty(_workspace_shape(n, m))
    wanted = np.zeros(m) if reference is None else reference
    arrays = [writable(array) for array in (problem.W, problem.wrench, problem.lower)]
    code = nearest_tensions_in(work, *arrays, problem.finite_upper(), wanted, t)
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

"""Costs and constraints of one's own in a program, in the units of its values.

A program of this package keeps one MathematicalProgram, which `prog()` gives, as Drake's
InverseKinematics does. Its decision variables are scaled so that a solver's tolerances mean the
same for every robot; what users add is in the units that they know. While nothing was added, the
kernels answer. Once something was, Drake solves the whole program, and the result says by which
solver, how the cost is shared, and what no longer holds.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from pydrake.solvers import (
    Binding,
    ClarabelSolver,
    GetProgramType,
    IpoptSolver,
    MathematicalProgram,
    MathematicalProgramResult,
    ProgramType,
    ScsSolver,
    SnoptSolver,
    SolutionResult,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, accepted_names
from cdpr_drake.numerics.program_functions import Function, ValueCost, ValueFunction

CONVEX = (
    ProgramType.kLP,
    ProgramType.kQP,
    ProgramType.kSOCP,
    ProgramType.kSDP,
    ProgramType.kQuadraticCostConicConstraint,
)
"""Programs of which a solver finds the best, from wherever it starts."""

MISSED = 1e-5
"""A constraint that is missed by more, in the program's scaled units, is not kept: ten times what
solvers of nonlinear programs stop at."""

SNOPT_CANNOT_IMPROVE = 41

MOST_NAMED = 3
"""Constraints that a message names."""


@dataclass(frozen=True, eq=False)
class ProgramValues:
    """Values as users read them, affine in decision variables: offset + matrix @ variables.

    Attributes:
        variables: Shape (n,).
        matrix: Shape (k, n), in the units of the values.
        offset: Shape (k,), likewise.
        names: Of the values.
        transform: Makes the values of what is affine; None: that is what they are.
    """

    variables: np.ndarray
    matrix: Array
    offset: Array
    names: tuple[str, ...]
    transform: Function | None = None

    @property
    def size(self) -> int:
        """Number of values."""
        return len(self.names)

    def at(self, x: Array) -> Array:
        """The values where the variables are x, shape (n,)."""
        plain = self.offset + self.matrix @ x
        return plain if self.transform is None else np.asarray(self.transform(plain), float)

    def of_affine(self, function: Function) -> Function:
        """A function of the values as one of what is affine."""
        transform = self.transform
        if transform is None:
            return function
        return lambda plain: function(np.asarray(transform(plain), float))

    @staticmethod
    def scaled(
        variables: np.ndarray, scale: Array, offset: Array, names: Sequence[str]
    ) -> ProgramValues:
        """offset + scale * variable, one each."""
        return ProgramValues(variables, np.diag(scale), np.asarray(offset, float), tuple(names))

    def only(self, which: np.ndarray) -> ProgramValues:
        """Some of the values, by number, on the variables that they need."""
        matrix = self.matrix[which]
        used = np.any(matrix != 0.0, axis=0)
        return ProgramValues(
            self.variables[used], matrix[:, used], self.offset[which],
            tuple(np.array(self.names)[which].tolist()),
        )  # fmt: skip


def in_words(status: str) -> str:
    """How a solver ended, as Drake's SolutionResult has it, in words: `solution found`."""
    return re.sub(r"(?<!^)(?=[A-Z])", " ", status.removeprefix("k")).lower()


@dataclass(frozen=True)
class ProgramReport:
    """How a program with terms of one's own was solved.

    Attributes:
        solver: Which solver did it.
        status: What it said, as Drake's SolutionResult has it.
        cost: What the program wants by itself, in its unit.
        own_costs: The costs that were added, by name, in the same unit.
        own_constraints: Names of the constraints that were added.
        lost: What the kernels have and this solution has not, in words.
    """

    solver: str
    status: str
    cost: float
    own_costs: dict[str, float]
    own_constraints: tuple[str, ...]
    lost: tuple[str, ...] = ()

    def rows(self) -> list[tuple[str, str]]:
        """A label and words a row, as results show themselves."""
        costs = [f"{name} {value:.4g}" for name, value in self.own_costs.items()]
        found = [
            ("program", f"{in_words(self.status)} by {self.solver}"),
            ("cost", ", ".join([f"goal {self.cost:.4g}", *costs])),
        ]
        if self.own_constraints:
            found.append(("own constraints", ", ".join(self.own_constraints)))
        return [*found, *(("note", words) for words in self.lost)]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "solver": self.solver,
            "status": self.status,
            "cost": self.cost,
            "own_costs": dict(self.own_costs),
            "own_constraints": list(self.own_constraints),
            "lost": list(self.lost),
        }


class OwnTerms(ABC):
    """A program that grows by costs and constraints of one's own.

    `AddQuadraticCost`, `AddCost`, `AddLinearConstraint` and `AddConstraint` take values in the
    units that users read; what else Drake knows goes to `prog()`, in its scaled variables. Both
    count when the program is solved.
    """

    problem_kind: ClassVar[type[CdprError]]
    """The error of its room."""

    cost_unit: float = 1.0
    """What a cost of 1 in the program is in the unit of its goal."""

    _counts: tuple[int, int, int] | None = None
    _kept: tuple[list[Any], list[Any]] = ([], [])
    _built_in_costs: Sequence[Binding] = ()
    _watched: tuple[tuple[int, int, int], list[tuple[str, Any, list[int]]]] | None = None

    @abstractmethod
    def prog(self) -> MathematicalProgram:
        """The program: one object, to which terms may be added."""

    @abstractmethod
    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """Values by name, or all that costs usually are of."""

    @property
    def has_own_terms(self) -> bool:
        """Whether anything was added to the program."""
        return self._counts is not None and self._counts != _counts_of(self.prog())

    def AddQuadraticCost(
        self,
        wanted: float | Array,
        weight: float | Array = 1.0,
        of: str | Sequence[str] | None = None,
        name: str = "",
    ) -> Binding:
        """Adds (v - wanted)' Q (v - wanted) of values v.

        Args:
            wanted: One for all, or shape (k,), in the unit of the values.
            weight: Q: a number or shape (k,) for a diagonal, or shape (k, k), in the unit of the
                goal over that of the values squared.
            of: Names of the values; None: all.
            name: For messages and results; empty: a number.

        Raises:
            CdprError: Of the room; a shape, a name, or a Q that is not positive semidefinite.
        """
        v = self._chosen(of)
        k = v.size
        goal = self._numbers("wanted", wanted, (k,))
        Q = np.asarray(weight, float)
        if Q.ndim < 2:
            Q = np.diag(self._numbers("weight", Q, (k,)))
        Q = self._numbers("weight", Q, (k, k))
        Q = 0.5 * (Q + Q.T)
        least = float(np.min(np.linalg.eigvalsh(Q)))
        if least < -1e-12 * max(float(np.max(np.abs(Q))), 1e-300):
            raise self.problem_kind(
                f"weight: found a matrix with the eigenvalue {least:.4g}; accepted: none below 0"
            )
        if v.transform is not None:
            return self.AddCost(lambda u: (u - goal) @ Q @ (u - goal), of, name)
        off = v.offset - goal
        A, b, c = v.matrix.T @ Q @ v.matrix, v.matrix.T @ Q @ off, float(off @ Q @ off)
        unit = self.cost_unit
        binding = self.prog().AddQuadraticCost(
            2.0 * A / unit, 2.0 * b / unit, c / unit, v.variables, is_convex=True
        )
        return self._named(binding, "cost", name)

    def AddCost(
        self, function: Function, of: str | Sequence[str] | None = None, name: str = ""
    ) -> Binding:
        """Adds a smooth cost, function(v), of values v, shape (k,), in the unit of the goal.

        Its gradient is taken by central differences. Where it is not convex the best near the
        kernels' solution is found, and there may be a better one elsewhere.

        Raises:
            CdprError: Of the room; it does not give one finite number, or a name is not known.
        """
        v = self._chosen(of)
        found = self._tried(function, v)
        if found.size != 1:
            raise self.problem_kind(
                f"cost: found an array of shape {found.shape}; accepted: a function that gives one "
                f"number for {v.size} values"
            )
        cost = ValueCost(v.of_affine(function), v.matrix, v.offset, 1.0 / self.cost_unit)
        return self._named(self.prog().AddCost(cost, vars=v.variables), "cost", name)

    def AddLinearConstraint(
        self,
        A: npt.ArrayLike,
        lower: float | Array,
        upper: float | Array,
        of: str | Sequence[str] | None = None,
        name: str = "",
    ) -> Binding:
        """Adds lower <= A v <= upper of values v, in their units.

        Args:
            A: Shape (r, k), or (k,) for one row.
            lower: Shape (r,) or one number; -inf: none.
            upper: Likewise.
            of: Names of the values; None: all.
            name: For messages and results; empty: a number.

        Raises:
            CdprError: Of the room; a shape or a name, or bounds that cross.
        """
        v = self._chosen(of)
        rows = np.atleast_2d(np.asarray(A, float))
        rows = self._numbers("A", rows, (rows.shape[0], v.size))
        low, high = self._bounds(lower, upper, len(rows))
        if v.transform is not None:
            return self.AddConstraint(lambda u: rows @ u, low, high, of, name)
        whole, fixed = rows @ v.matrix, rows @ v.offset
        # Rows as long as one, so that solvers' tolerances mean the same for all.
        size = np.maximum(np.linalg.norm(whole, axis=1), 1e-300)
        binding = self.prog().AddLinearConstraint(
            whole / size[:, None], (low - fixed) / size, (high - fixed) / size, v.variables
        )
        return self._named(binding, "constraint", name)

    def AddConstraint(
        self,
        function: Function,
        lower: float | Array,
        upper: float | Array,
        of: str | Sequence[str] | None = None,
        name: str = "",
    ) -> Binding:
        """Adds lower <= function(v) <= upper of values v; smooth, its gradient by differences.

        Raises:
            CdprError: Of the room; it does not give finite numbers, or as `AddLinearConstraint`.
        """
        v = self._chosen(of)
        rows = self._tried(function, v).size
        low, high = self._bounds(lower, upper, rows)
        # Rows change by about one where the values change by their sizes.
        bounds = np.vstack([low, high])
        size = np.where(np.isfinite(bounds), np.abs(bounds), 0.0).max(axis=0)
        size = np.where(size > 0.0, size, 1.0)
        made = ValueFunction(v.of_affine(function), v.matrix, v.offset, 1.0 / size)
        binding = self.prog().AddConstraint(made, low / size, high / size, vars=v.variables)
        return self._named(binding, "constraint", name)

    def _seal(self) -> None:
        """What is in the program now is its own; what comes later, somebody's."""
        program = self.prog()
        self._counts = _counts_of(program)
        self._built_in_costs = program.GetAllCosts()
        # The evaluators themselves: pydrake makes a new object of one that nobody holds.
        self._kept = (
            [b.evaluator() for b in self._built_in_costs],
            [b.evaluator() for b in program.GetAllConstraints()],
        )
        self._watched = None

    def _own(self) -> tuple[list[Binding], list[Binding]]:
        """Costs and constraints that were added."""
        kept = [{id(one) for one in part} for part in self._kept]
        program = self.prog()
        every = program.GetAllCosts(), program.GetAllConstraints()
        costs, constraints = (
            [b for b in part if id(b.evaluator()) not in known]
            for part, known in zip(every, kept, strict=True)
        )
        return costs, constraints

    def _report(
        self, x: Array, solver: str, status: str, lost: Sequence[str] = ()
    ) -> ProgramReport:
        """What is to be said of a solution, shape (num_vars,)."""
        program, unit = self.prog(), self.cost_unit
        own = {
            _word(b, "own cost", k): unit * float(program.EvalBinding(b, x)[0])
            for k, b in enumerate(self._own()[0])
        }
        built_in = sum(unit * float(program.EvalBinding(b, x)[0]) for b in self._built_in_costs)
        names = tuple(word for word, _, _ in self._own_constraints())
        return ProgramReport(solver, status, built_in, own, names, tuple(lost))

    def _missed(self, x: Array, tolerance: float = MISSED) -> list[str]:
        """Names of the constraints that were added and are not kept."""
        return [
            word
            for word, evaluator, places in self._own_constraints()
            if not evaluator.CheckSatisfied(x[places], tolerance)
        ]

    def _own_constraints(self, anew: bool = True) -> list[tuple[str, Any, list[int]]]:
        """Names, evaluators and places of the variables of constraints that were added."""
        program = self.prog()
        if self._watched is None or (anew and self._watched[0] != _counts_of(program)):
            found = [
                (
                    _word(b, "own constraint", k),
                    b.evaluator(),
                    list(program.FindDecisionVariableIndices(b.variables())),
                )
                for k, b in enumerate(self._own()[1])
            ]
            self._watched = _counts_of(program), found
        return self._watched[1]

    def _solve_whole(
        self, guess: Array, what: str, program: MathematicalProgram | None = None
    ) -> tuple[Array, str, str]:
        """The solution of the whole program, its solver and what that said.

        Args:
            guess: Where it starts, shape (num_vars,).
            what: What is sought, in words, for the message.
            program: One with the same terms, in another form; None: `prog()`.

        Raises:
            CdprError: Of the room, where nothing keeps all constraints, or no solver came to an
                end.
        """
        program = self.prog() if program is None else program
        said, named = [], []
        for solver in _solvers_for(program):
            word = solver.solver_id().name()
            try:
                result = solver.Solve(program, guess, None)
            except RuntimeError as problem:  # what Drake makes of an error in a function
                words = " ".join(str(problem).split())
                raise self.problem_kind(
                    f"{what}: {word}: {words}; accepted: own terms that can be evaluated near the "
                    "solution"
                ) from problem
            status = str(result.get_solution_result()).rpartition(".")[2]
            if result.is_success():
                return np.asarray(result.get_x_val(), float), word, status
            if _cannot_improve(result) and not result.GetInfeasibleConstraints(program):
                return np.asarray(result.get_x_val(), float), word, "cannot be improved, info 41"
            said.append(f"{status} by {word}")
            named = self._named_misses(result)
            if result.get_solution_result() == SolutionResult.kInfeasibleConstraints:
                break  # another solver would say so later
        names = named or [word for word, _, _ in self._own_constraints()]
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        own = f" with {', '.join(names[:MOST_NAMED])}{more}" if names else ""
        raise self.problem_kind(
            f"{what}: found none{own} ({', '.join(said)}); accepted: own terms that leave some"
        )

    def _named_misses(self, result: MathematicalProgramResult) -> list[str]:
        x = np.asarray(result.get_x_val(), float)
        whole = x.size == self.prog().num_vars() and np.all(np.isfinite(x))
        return self._missed(x) if whole else []

    def _named(self, binding: Binding, kind: str, name: str) -> Binding:
        if name:
            binding.evaluator().set_description(name)
        return binding

    def _chosen(self, of: str | Sequence[str] | None) -> ProgramValues:
        self.prog()
        return self.values(of)

    def _tried(self, function: Function, v: ProgramValues) -> Array:
        """What a function gives where the variables are zero, or in the middle of their bounds."""
        program = self.prog()
        places = program.FindDecisionVariableIndices(v.variables)
        start = np.nan_to_num(np.asarray(program.initial_guess(), float)[places])
        found = np.asarray(function(v.at(start)))
        try:
            found = found.astype(float)
        except (TypeError, ValueError) as problem:
            raise self.problem_kind("own term: found no numbers; accepted: numbers") from problem
        if not np.all(np.isfinite(found)):
            raise self.problem_kind(
                "own term: found NaN or infinity where the search starts; accepted: finite numbers"
            )
        return np.atleast_1d(found)

    def _bounds(self, lower: float | Array, upper: float | Array, rows: int) -> tuple[Array, Array]:
        low, high = (
            self._numbers(word, value, (rows,), finite=False)
            for word, value in (("lower", lower), ("upper", upper))
        )
        if np.any(low > high):
            r = int(np.argmax(low > high))
            raise self.problem_kind(
                f"own constraint: found lower {low[r]:g} above upper {high[r]:g}; accepted: lower "
                "<= upper"
            )
        return low, high

    def _numbers(
        self, word: str, value: object, shape: tuple[int, ...], finite: bool = True
    ) -> Array:
        """An array of a shape; one number stands for all of a vector."""
        try:
            found = np.asarray(value, float)
        except (TypeError, ValueError) as problem:
            raise self.problem_kind(
                f"{word}: found no numbers; accepted: shape {shape}"
            ) from problem
        if found.ndim == 0 and len(shape) == 1:
            found = np.full(shape, float(found))
        if found.shape != shape:
            raise self.problem_kind(f"{word}: found shape {found.shape}; accepted: {shape}")
        if np.any(np.isnan(found)) or (finite and not np.all(np.isfinite(found))):
            raise self.problem_kind(f"{word}: found NaN or infinity; accepted: finite numbers")
        return found


def chosen_names(
    names: Sequence[str], of: str | Sequence[str], error: type[CdprError]
) -> np.ndarray:
    """Numbers of the values with these names.

    Raises:
        CdprError: Of the kind given; a name is not known.
    """
    asked = [of] if isinstance(of, str) else list(of)
    unknown = [one for one in asked if one not in names]
    if unknown:
        raise error(f"of: found {unknown[0]!r}; {accepted_names(unknown[0], names)}")
    return np.array([list(names).index(one) for one in asked], dtype=int)


def is_convex(program: MathematicalProgram) -> bool:
    """Whether a solver finds the best solution of a program from anywhere."""
    return GetProgramType(program) in CONVEX


def _cannot_improve(result: MathematicalProgramResult) -> bool:
    """Whether SNOPT ended where rounding of costs hides any further descent, its info 41.

    So it ends where it starts near a minimum, with slopes by differences.
    """
    if result.get_solver_id() != SnoptSolver.id():
        return False
    return int(result.get_solver_details().info) == SNOPT_CANNOT_IMPROVE


def _solvers_for(program: MathematicalProgram) -> list[Any]:
    kinds: tuple[Any, ...] = (SnoptSolver, IpoptSolver)
    if is_convex(program):
        kinds = (ClarabelSolver, ScsSolver)
    return [kind() for kind in kinds if kind().available() and kind().enabled()]


def _counts_of(program: MathematicalProgram) -> tuple[int, int, int]:
    return len(program.GetAllCosts()), len(program.GetAllConstraints()), program.num_vars()


def _word(binding: Binding, kind: str, number: int) -> str:
    given = str(binding.evaluator().get_description())
    return given or f"{kind} {number + 1}"

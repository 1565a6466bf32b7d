"""Constraints of a platform for any MathematicalProgram: values and Jacobians from kernels."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, InitializeAutoDiff
from pydrake.solvers import Binding, MathematicalProgram, PyFunctionConstraint
from pydrake.symbolic import DecomposeAffineExpressions, Expression, Variable, Variables

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.pose_coordinates import Coordinates

Differentiable = Callable[[Array], tuple[Array, Array]]
"""A function of numbers, shape (k,), that gives its values, shape (r,), and Jacobian, (r, k)."""


class PoseConstraint(ABC):
    """lower <= values <= upper, of a pose or a motion of the platform.

    Attributes:
        coordinates: How the program describes the platform.
        lower: Shape (r,).
        upper: Shape (r,).
        description: What it is, in a word or two.
        rows: What each row is, in words.
        extra: Numbers that it takes behind those of the platform, such as tensions.
        order: Derivatives of the pose by time that it needs.
        highest: Derivatives that count where they are given, at least `order`.
        kept_within: By less than this it may be missed between the samples of a program.
        own_variables: Whether the further numbers are variables of nobody else, for which `guess`
            gives numbers.
        radius: Of the farthest point of the platform from Po whose way its values follow [m].
    """

    description = ""
    extra = 0
    order = 0
    highest = 0
    kept_within = 1e-5
    own_variables = False
    radius = 0.0

    def __init__(
        self, coordinates: Coordinates, lower: Array, upper: Array, rows: Sequence[str]
    ) -> None:
        """With its bounds, shape (r,)."""
        self.coordinates, self.rows = coordinates, tuple(rows)
        self.lower, self.upper = np.asarray(lower, float), np.asarray(upper, float)

    @abstractmethod
    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """Values and derivatives at points of a motion.

        Args:
            points: Shape (N, 19), see `pose_coordinates_kernel`.
            extra: Further numbers, shape (N, e).

        Returns:
            Values, shape (N, r); their derivatives by the seeds, shape (N, r, 18), and by the
            further numbers, shape (N, r, e), None without any. NaN where a cable cannot run.
        """

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Values, shape (N, r), and Jacobians, shape (N, r, k), of many sets of numbers at once.

        Args:
            x: Numbers of the platform, and further ones behind them, shape (N, k).

        Raises:
            PlanningError: There are other numbers of them.
        """
        x = np.ascontiguousarray(x, float)
        k = x.shape[1] - self.extra
        self._check(k)
        points, seeds = self.coordinates.points(np.ascontiguousarray(x[:, :k]))
        values, slopes, columns = self.at_points(points, np.ascontiguousarray(x[:, k:]))
        jacobian = slopes @ seeds
        if columns is not None:
            jacobian = np.concatenate([jacobian, columns], axis=2)
        return values, jacobian

    def smooth_parts(self) -> tuple[PoseConstraint, ...]:
        """Constraints that together say the same, for solvers that kinks would stop."""
        return (self,)

    def guess(self, x: Array) -> Array:
        """Further numbers that suit coordinates of a pose, shape (e,), see `own_variables`."""
        return np.zeros(self.extra)

    def reach(self) -> float | None:
        """By how much a value changes at most, per way of any point of the platform in `radius`.

        None: that is not known, or it is no distance.
        """
        return None

    def missed(self, values: Array) -> Array:
        """By how much values, shape (N, r), are out of bounds, shape (N, r); infinite for NaN."""
        gaps = np.maximum(np.maximum(self.lower - values, values - self.upper), 0.0)
        return np.where(np.isnan(values), np.inf, gaps)

    def AddTo(
        self, prog: MathematicalProgram, variables: Any, through: Differentiable | None = None
    ) -> Binding:
        """Adds the constraint to a program.

        Args:
            prog: The program.
            variables: The platform's coordinates, with velocity and acceleration as far as they
                are meant, and further numbers behind them; variables of the program, or affine
                expressions of these.
            through: From the program's variables to these numbers, where it is no affine map.

        Raises:
            PlanningError: Their number is not accepted.
        """
        given = np.asarray(variables).ravel()
        if through is None:
            given, through = _affine(given)
        if through is None:
            self._check(len(given) - self.extra)
        evaluate = self._one if through is None else _chained(self._one, through)
        bound = prog.AddConstraint(
            drake_function(evaluate), lb=self.lower, ub=self.upper, vars=given
        )
        bound.evaluator().set_description(self.description)
        return bound

    def as_drake(self, order: int | None = None) -> PyFunctionConstraint:
        """The constraint as an object of Drake, for programs that take such.

        Args:
            order: Derivatives of the pose by time among its variables; None: those it needs.
        """
        size = self.coordinates.sizes[self.order if order is None else order]
        self._check(size)
        return PyFunctionConstraint(
            size + self.extra, drake_function(self._one), self.lower, self.upper, self.description
        )

    def _one(self, x: Array) -> tuple[Array, Array]:
        values, jacobian = self.evaluate(x[np.newaxis])
        return values[0], jacobian[0]

    def _check(self, count: int) -> None:
        accepted = self.coordinates.sizes[self.order :]
        if count not in accepted:
            raise PlanningError(
                f"{self.description}: found {count} variables of the platform; accepted: "
                f"{' or '.join(str(size) for size in accepted)}"
            )


def drake_function(evaluate: Differentiable) -> Callable[[Any], Any]:
    """A function of numbers or AutoDiffXd, for Drake, of one that gives values and Jacobian."""

    def function(x: Any) -> Any:
        if x.dtype != object:
            return evaluate(x)[0]
        # Half of a call is Drake's, which makes these numbers; taking them one by one is faster.
        values, jacobian = evaluate(np.fromiter(map(AutoDiffXd.value, x), float, len(x)))
        slopes = ExtractGradient(x)
        if slopes.shape[1]:
            jacobian = np.dot(jacobian, slopes)
            return InitializeAutoDiff(values, jacobian).ravel()
        return np.array([AutoDiffXd(value) for value in values])

    return function


def _chained(outer: Differentiable, inner: Differentiable) -> Differentiable:
    def both(x: Array) -> tuple[Array, Array]:
        y, by_x = inner(x)
        values, by_y = outer(y)
        return values, by_y @ by_x

    return both


def _affine(given: Any) -> tuple[Any, Differentiable | None]:
    """The variables of affine expressions, and the map from these to them; None where they are."""
    if all(isinstance(one, Variable) for one in given):
        return given, None
    expressions = np.array([
        one if isinstance(one, Expression) else Expression(one) for one in given
    ])  # fmt: skip
    found = Variables()
    for one in expressions:
        found += one.GetVariables()
    variables = np.array(list(found))
    try:
        M, b = DecomposeAffineExpressions(expressions, variables)
    except RuntimeError as problem:
        raise PlanningError(
            "variables: found an expression that is not affine; accepted: variables, or affine "
            "expressions of them"
        ) from problem
    offset = np.asarray(b, float).ravel()

    def through(x: Array) -> tuple[Array, Array]:
        return M @ x + offset, M

    return variables, through

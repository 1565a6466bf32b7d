"""Weighted equations of an identification, and their least squares over what robots can have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydrake.solvers import MathematicalProgram, Solve
from scipy.linalg import null_space

from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError
from cdpr_drake.identification.motion_term import OFF_WITHIN, MotionTerm
from cdpr_drake.identification.parameters import Layout
from cdpr_drake.identification.physical_bounds import make_program, violated
from cdpr_drake.identification.terms import Prior, Rows, Term

HUBER = 4.0
"""From how many sigmas on a residual counts linearly."""

MOST_STEPS = 30
CLOSE, SETTLED = 1e-9, 1e-5
"""Steps end where the vector changes by less, in typical sizes or in standard errors."""

ROUGHLY_SETTLED = 1e-2
"""The same where a solver of nonlinear programs takes the steps."""

MOST_WEIGHINGS = 6
"""Times that the error of poses is estimated, each from the last parameters."""

MOST_HALVINGS = 8
NOTHING = 1.0
"""Chi-square by which a vector may be worse than another and no data would tell, of residuals that
are as large as their noise."""


def huber_limit(rest: Array) -> float:
    """From where residuals count linearly: `HUBER` of their own spread, which is at least 1.

    Sigmas may be wrong by a factor for a whole kind of measurement: an outlier is one among others.
    """
    return HUBER * (max(1.4826 * float(np.median(np.abs(rest))), 1.0) if len(rest) else 1.0)


def huber_weights(rest: Array, limit: float) -> Array:
    """Weights with which least squares make a step down the cost, shape (r,)."""
    return np.asarray(np.minimum(1.0, limit / np.maximum(np.abs(rest), 1e-300)))


def huber_cost(rest: Array, limit: float) -> float:
    """Sum of squares, of |x| limit (2 - limit / |x|) beyond the limit."""
    size = np.abs(rest)
    inner = np.minimum(size, limit)
    return float(np.sum(inner**2 + 2.0 * inner * (size - inner)))


@dataclass(frozen=True, eq=False)
class Point:
    """Equations at a vector.

    Attributes:
        theta: The vector, shape (n,).
        x: The same over its typical sizes.
        rows: Equations in x of each term, and of priors.
        rests: Their residuals [sigma].
    """

    theta: Array
    x: Array
    rows: list[Rows]
    rests: list[Array]

    def weights(self, limits: Sequence[float]) -> list[Array]:
        """Huber's weights beyond a limit of each term [sigma]."""
        return [huber_weights(*each) for each in zip(self.rests, limits, strict=True)]

    def cost(self, limits: Sequence[float]) -> float:
        """Robust chi-square."""
        return sum(huber_cost(*each) for each in zip(self.rests, limits, strict=True))

    def indifferent(self, cost: float) -> float:
        """`NOTHING` of residuals as large as those of a cost."""
        return NOTHING * max(1.0, cost / max(sum(len(r.b) for r in self.rows), 1))

    def normal(self, weights: Sequence[Array] | None = None) -> tuple[Array, Array, float]:
        """H, g, c of chi-square x' H x - 2 g' x + c."""
        H, g, c = np.zeros((len(self.x),) * 2), np.zeros(len(self.x)), 0.0
        weights = [np.ones(len(r.b)) for r in self.rows] if weights is None else weights
        for r, w in zip(self.rows, weights, strict=True):
            H += (w[:, None] * r.A).T @ r.A
            g += r.A.T @ (w * r.b)
            c += float(r.b @ (w * r.b))
        return H, g, c


@dataclass(frozen=True, eq=False)
class Fit:
    """A least squares solution.

    Attributes:
        terms: Terms, with the errors of poses that they are weighed with.
        belief: Equations at the belief.
        point: The solution.
        weights: Huber's weights, of each term and of priors.
        limits: From where residuals count linearly, of each [sigma].
        Z: Directions that are free, over typical sizes, shape (n, f).
        H: Information along them, shape (f, f).
        steps: Times that it was solved.
        last_step: Length of the last step, in standard errors.
        active: What no robot has of the solution without inequalities, in words.
        solver: The solver of the vector.
    """

    terms: list[Term]
    belief: Point
    point: Point
    weights: list[Array]
    limits: list[float]
    Z: Array
    H: Array
    steps: int
    last_step: float
    active: tuple[str, ...] = ()
    solver: str = "least squares"


class Equations:
    """What was measured and what is known beforehand, as equations in the vector of a layout."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.terms: list[Term] = []
        self.priors: list[Prior] = []

    def at(self, theta: Array, terms: Sequence[Term] | None = None) -> Point:
        """Equations at a vector, of other terms if any are given."""
        typical = self.layout.typical
        tables = [term.rows(theta) for term in (self.terms if terms is None else terms)]
        rows = [Rows(r.A * typical, r.b) for r in tables]
        A, b = np.zeros((len(self.priors), len(typical))), np.zeros(len(self.priors))
        for r, (entries, value, std) in enumerate(self.priors):
            for k, factor in entries.items():
                A[r, k] = factor * typical[k] / std
            b[r] = value / std
        rows, x = [*rows, Rows(A, b)], theta / typical
        return Point(theta, x, rows, [r.A @ x - r.b for r in rows])

    def equalities(self, theta: Array) -> tuple[Array, Array]:
        """What is known of the vector over its typical sizes, with rows of length one."""
        E, e = self.layout.constraints(theta)
        E = E * self.layout.typical
        size = np.linalg.norm(E, axis=1)
        return E / size[:, None], e / size

    def directions(self, theta: Array) -> Array:
        """Orthonormal basis of what is free, shape (n, f)."""
        E, _ = self.equalities(theta)
        return np.asarray(null_space(E)) if len(E) else np.eye(len(theta))

    def program(self, point: Point, weights: Sequence[Array] | None = None) -> MathematicalProgram:
        """Equations at a point for Drake's solvers."""
        return make_program(self.layout, point.normal(weights), self.equalities(point.theta))

    def weighed(self, outliers: bool) -> Fit:
        """Least squares with the error of poses where they are off by more than they jitter."""
        terms = self.terms
        fit = self.least_squares(terms, outliers)
        for _ in range(MOST_WEIGHINGS):
            theta = fit.point.theta
            again = [
                t.with_errors_of_poses(theta, outliers) if isinstance(t, MotionTerm) else t
                for t in terms
            ]
            if np.allclose(offs_of(terms), offs_of(again), rtol=OFF_WITHIN, atol=0.0):
                break
            terms = again
            fit = self.least_squares(terms, outliers, theta)
        return fit

    def least_squares(self, terms: list[Term], outliers: bool, start: Array | None = None) -> Fit:
        """Without inequalities, until weights and what is not quite linear do not change.

        Steps are those of Gauss and Newton, halved while the cost grows. They begin at the belief,
        or at another vector, shape (n,).
        """
        typical = self.layout.typical
        belief = self.at(self.layout.model.vector(), terms)
        point = belief if start is None else self.at(start, terms)
        limits = [np.inf] * len(point.rows)
        for step in range(1, MOST_STEPS + 1):
            if outliers and step > 1:
                limits = [*(huber_limit(rest) for rest in point.rests[:-1]), np.inf]
            weights = point.weights(limits)
            (E, e), Z = self.equalities(point.theta), self.directions(point.theta)
            fixed = np.linalg.lstsq(E, e, rcond=None)[0] if len(e) else np.zeros(len(typical))
            pairs = list(zip(point.rows, weights, strict=True))
            A = np.vstack([np.sqrt(w)[:, None] * r.A for r, w in pairs])
            b = np.concatenate([np.sqrt(w) * r.b for r, w in pairs])
            y = np.linalg.lstsq(A @ Z, b - A @ fixed, rcond=None)[0]
            way = (fixed + Z @ y) * typical - point.theta
            moved = float(np.max(np.abs(way / typical)))
            length = float(np.linalg.norm(A @ (way / typical)))
            cost = point.cost(limits)
            for k in range(MOST_HALVINGS):
                trial = self.at(point.theta + 0.5**k * way, terms)
                if trial.cost(limits) <= cost + point.indifferent(cost):
                    point = trial
                    break
            else:
                length = 0.0  # nothing along it is better
            if length < SETTLED or (moved < CLOSE and step > 2):
                break
        H = (A @ Z).T @ (A @ Z)
        return Fit(terms, belief, point, weights, limits, Z, H, step, length)

    def some_robot(self, fit: Fit) -> Fit:
        """The same with inequalities, where least squares end at what no robot has.

        Noise, and so weights, depend on the body: those at a body that cannot be are of no use.
        So the program is solved again and again, weighted as at its last solution, or at the belief
        if that is better than the first, by steps that do not raise the cost.

        Raises:
            IdentificationError: The program has no solution.
        """
        layout, limits = self.layout, fit.limits
        active = violated(layout, fit.point.theta)
        if not active:
            return fit
        theta, solver = self._solved(fit.point, fit.weights)
        point = self.at(theta, fit.terms)
        if not violated(layout, fit.belief.theta) and fit.belief.cost(limits) < point.cost(limits):
            point = fit.belief
        far, step = np.inf, 0
        while far >= ROUGHLY_SETTLED and step < MOST_STEPS:
            step += 1
            weights = point.weights(limits)
            way = self._solved(point, weights)[0] - point.theta
            x = way / layout.typical
            far = float(np.sqrt(max(float(x @ point.normal(weights)[0] @ x), 0.0)))
            for k in range(MOST_HALVINGS):
                trial = self.at(point.theta + 0.5**k * way, fit.terms)
                if trial.cost(limits) <= point.cost(limits):
                    point = trial
                    break
            else:
                break  # nothing along it is better
        weights, Z = point.weights(limits), self.directions(point.theta)
        H = np.asarray(Z.T @ point.normal(weights)[0] @ Z)
        return replace(
            fit, point=point, weights=weights, Z=Z, H=H, steps=fit.steps + step, last_step=far,
            active=active, solver=solver,
        )  # fmt: skip

    def _solved(self, point: Point, weights: Sequence[Array]) -> tuple[Array, str]:
        """The solution of the program at a point, and its solver."""
        program = self.program(point, weights)
        solution = Solve(program)
        if not solution.is_success():
            raise IdentificationError(
                f"identification: found {solution.get_solution_result()} by "
                f"{solution.get_solver_id().name()}; accepted: data that some body can have"
            )
        x = solution.GetSolution(program.decision_variables())
        return x * self.layout.typical, solution.get_solver_id().name()

    def check_end(self, fit: Fit) -> None:
        """Refuses a solution that explains the measurements less well than the belief.

        Raises:
            IdentificationError: It does; says by how much.
        """
        end, start = fit.point.cost(fit.limits), fit.belief.cost(fit.limits)
        if end > start + fit.point.indifferent(start):
            raise IdentificationError(
                f"identification: found parameters with chi-square {end:.4g}, where those "
                f"that are believed have {start:.4g}; accepted: an end that is no worse than "
                "its start, as with fewer unknowns, priors or another belief"
            )


def offs_of(terms: Sequence[Term]) -> list[float]:
    """Errors of poses that motions are weighed with [m]."""
    return [term.off for term in terms if isinstance(term, MotionTerm)]


def scatter_of_blocks(fit: Fit) -> float:
    """By how much estimates scatter more, in variance, than independent residuals make them.

    Errors of poses last longer than a sample. With gradients g_b = A_b' r_b of the blocks b,
    B of them and p unknowns, it is B / (B - 1) sum g_b' H^-1 g_b / p: the mean, over
    directions, of the ratio of the variance that groups of rows tell to that of single rows.

    Source: Liang, Zeger, Longitudinal data analysis using generalized linear models, 1986.
    """
    total, count = 0.0, 0
    for k, term in enumerate(fit.terms):
        if isinstance(term, MotionTerm):
            root = np.sqrt(fit.weights[k])
            A, rest = root[:, None] * (fit.point.rows[k].A @ fit.Z), root * fit.point.rests[k]
            for block in term.samples.blocks():
                rows = slice(6 * block.start, 6 * block.stop)
                g = A[rows].T @ rest[rows]
                total, count = total + float(g @ np.linalg.solve(fit.H, g)), count + 1
    return total / len(fit.H) * count / max(count - 1, 1)

"""An identification as a program that grows by what was measured, as Drake's InverseKinematics."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np
import numpy.typing as npt
from pydrake.solvers import Binding, MathematicalProgram, Solve
from scipy.linalg import null_space

from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError, accepted_names
from cdpr_drake.identification.identifiability import unidentifiable_words
from cdpr_drake.identification.motion_term import OFF_WITHIN, MotionTerm
from cdpr_drake.identification.parameters import GROUPS, DynamicModel, Layout, offsets_needed
from cdpr_drake.identification.physical_bounds import make_program, smooth_program, violated
from cdpr_drake.identification.result import (
    AT_THE_RIM,
    MISFIT,
    MISFIT_FACTOR,
    OPTIMAL,
    IdentificationResult,
    TermFit,
)
from cdpr_drake.identification.robust_cost import huber_cost, huber_limit, huber_weights
from cdpr_drake.identification.samples import LoggedMotion, WinchSamples
from cdpr_drake.identification.terms import CableTerm, Prior, Rows, Term, WinchTerm, prior_rows
from cdpr_drake.numerics.own_terms import OwnTerms, ProgramReport, ProgramValues, is_convex

BY_LIKELIHOOD = (
    "standard errors, covariance and chi-square are those of measurements and priors alone; own "
    "terms are not in them"
)
NOT_SETTLED = "weights and own terms did not settle: the last step went {0:.2g} standard errors"
STILL_MOVED = "after {0} steps the parameters still moved by {1:.2g} standard errors"
CONTRADICTED = (
    "priors are passed by up to {0:.3g} of their standard deviations: they contradict the log, or "
    "each other"
)

MOST_STEPS = 30
CLOSE, SETTLED = 1e-9, 1e-5
"""Steps end where the vector changes by less, in typical sizes or in standard errors."""

ROUGHLY_SETTLED = 1e-2
"""The same where a solver of nonlinear programs takes the steps."""

UNSETTLED, CONTRADICTION = 0.1, 4.0
"""Standard errors of the last step, and of priors, from which on a remark says so."""

MOST_WEIGHINGS = 6
"""Times that the error of poses is estimated, each from the last parameters."""

MOST_HALVINGS = 8
NOTHING = 1.0
"""Chi-square by which a vector may be worse than another and no data would tell, of residuals that
are as large as their noise."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """A least squares solution: vector, directions that are free, information along them, and
    what the belief left unexplained.

    Attributes:
        active: What no robot has of the solution without inequalities, in words.
        solver: What found the vector.
    """

    theta: Array
    Z: Array
    H: Array
    first: list[Array]
    rows: list[Rows]
    weights: list[Array]
    limits: list[float]
    steps: int
    last_step: float
    active: tuple[str, ...] = ()
    solver: str = "least squares"

    def pairs(self) -> list[tuple[Rows, Array]]:
        """Rows and weights of each term, and of priors."""
        return list(zip(self.rows, self.weights, strict=True))


class IdentificationProgram(OwnTerms):
    """Finds unknown constants of a robot's dynamics in what was measured while it moved.

    `Add...` methods add measurements and priors; `Solve` finds the most likely parameters that
    some body has. All equations are linear in `layout`'s vector, weighted by the noise that they
    are measured with; what weights, corrected poses and a few known constants make of it is solved
    again until it does not change, by steps that do not raise the cost.

    `prog()` is one step as a MathematicalProgram: a convex quadratic cost with a linear matrix
    inequality, once everything measured was added. `AddQuadraticCost`, `AddCost`,
    `AddLinearConstraint` and `AddConstraint` add terms of one's own to it. They are of `values`,
    the parameters as users read them, in their units. A cost counts beside half of chi-square, so
    that 0.5 ((v - a) / s)^2 says as much as a measurement of a with the standard error s. With own
    terms Drake solves the whole program, again and again until weights settle: by Clarabel where it
    is convex, as with bounds on single parameters, costs of masses, friction and offsets; else by
    SNOPT, to the best that is near.

    Attributes:
        layout: The unknown vector.
        terms: What was measured.
        gravity: Acceleration of a falling body in W, shape (3,) [m/s^2].
    """

    problem_kind = IdentificationError

    def __init__(
        self,
        model: DynamicModel,
        unknown: Sequence[str],
        *,
        common: Sequence[str] = (),
        gravity: Array = np.array([0.0, 0.0, -9.81]),  # noqa: B008  never changed
        size: float = 0.1,
    ) -> None:
        """For a robot as it is believed.

        Args:
            model: The belief, which is kept where nothing is unknown.
            unknown: Groups of parameters, see `GROUPS`.
            common: Groups that are one for all cables or winches.
            gravity: As the attribute.
            size: Length scale of the platform [m].

        Raises:
            IdentificationError: No group is unknown, or one is not known by name.
        """
        if not unknown:
            raise IdentificationError(f"unknown: found nothing; accepted: {', '.join(GROUPS)}")
        groups = tuple(dict.fromkeys(unknown))
        self.layout = Layout(model, groups, tuple(common), offsets_needed(groups), size)
        self.gravity = np.asarray(gravity, float)
        self.terms: list[Term] = []
        self._weighed = self.terms
        self._priors: list[Prior] = []
        self._prog: MathematicalProgram | None = None

    def AddMotion(self, samples: LoggedMotion) -> MotionTerm:
        """The wrench that the cables put on the platform, and the motion that it made."""
        self._still_grows("AddMotion")
        term = MotionTerm.make(samples, self.gravity, self.layout.size)
        self.terms.append(term)
        return term

    def AddCableLengths(
        self,
        samples: LoggedMotion,
        counted: Array,
        sigma: float = 5e-5,
        slack_below: float = 0.5,
    ) -> CableTerm:
        """Lengths that winches count, beside those that the poses have.

        Args:
            samples: The motion.
            counted: Unstrained lengths at its samples, up to a constant, shape (s, m) [m].
            sigma: Their standard deviation, with what is wrong of the geometry [m].
            slack_below: Cables with less tension tell nothing [N].
        """
        self._still_grows("AddCableLengths")
        if np.shape(counted) != (samples.count, len(self.layout.model.names)):
            raise IdentificationError(
                f"counted lengths: found shape {np.shape(counted)}; accepted: "
                f"{(samples.count, len(self.layout.model.names))}"
            )
        _positive("cable lengths", sigma)
        term = CableTerm.make(
            samples, np.asarray(counted, float), sigma, slack_below, self.layout.model.names
        )
        self.terms.append(term)
        return term

    def AddWinches(self, samples: WinchSamples) -> WinchTerm:
        """What turning winches lose."""
        self._still_grows("AddWinches")
        term = WinchTerm.make(samples, self.layout.model.names)
        self.terms.append(term)
        return term

    def AddPrior(self, group: str, std: float) -> None:
        """A group is known up to a standard deviation.

        [kg]; [m]; [kg m^2] about Po; [N]; [s]; of Coulomb and of static less Coulomb friction
        [N m], of viscous friction 1 s/rad of Coulomb's.
        """
        self._still_grows("AddPrior")
        _positive("prior", std)
        if group not in GROUPS:
            raise IdentificationError(f"priors: found {group!r}; {accepted_names(group, GROUPS)}")
        self._priors += prior_rows(self.layout.model, group, std)

    def names(self) -> tuple[str, ...]:
        """Names of the unknown parameters."""
        return tuple(one[0] for one in self.layout.parameters())

    def FindUnidentifiable(self) -> tuple[str, ...]:
        """What these measurements and priors cannot tell, in words, at the believed model."""
        theta = self.layout.model.vector()
        Z = self._directions(self._scaled(theta)[0])
        told: list[Term] = [t.told() if isinstance(t, MotionTerm) else t for t in self.terms]
        information = self._information(self._rows(theta, told), [])
        H = np.asarray(Z.T @ information @ Z)
        return unidentifiable_words(self.layout, theta, Z, H, self.terms)

    def FindCovariance(self) -> Array:
        """Covariance of the parameters by these measurements at the believed model, shape (f, f).

        With the true model it is the Cramer-Rao bound, as far as smoothing keeps what was measured.
        """
        theta = self.layout.model.vector()
        Z = self._directions(self._scaled(theta)[0])
        H = Z.T @ self._information(self._rows(theta, self.terms), []) @ Z
        J = self.layout.jacobian(theta, self.layout.typical[:, None] * Z)
        return np.asarray(J @ np.linalg.solve(H, J.T))

    def Solve(self, outliers: bool = True) -> IdentificationResult:
        """The most likely parameters.

        Args:
            outliers: Whether residuals beyond four sigmas count linearly.

        Raises:
            IdentificationError: Nothing was measured; a parameter cannot be told and has no prior:
                names which from which, and why; the end explains less than the belief.
        """
        began = time.perf_counter()
        if not self.terms:
            raise IdentificationError("measurements: found none; accepted: at least one")
        untold = self.FindUnidentifiable()
        if untold:
            more = f" (and {len(untold) - 2} more such)" if len(untold) > 2 else ""
            raise IdentificationError(
                f"unknown: {'; '.join(untold[:2])}{more}; accepted: fewer unknowns, a prior for "
                "them, or a log of a motion that excites them"
            )
        fit = self._weighed_fit(outliers)
        if self.has_own_terms:
            return self._with_own_terms(fit, began)
        fit = self._some_robot(fit)
        self._check_end(fit.theta, fit)
        how = AT_THE_RIM if fit.active else OPTIMAL, fit.solver, fit.active
        return self._result(fit, fit.theta, how, time.perf_counter() - began)

    def _with_own_terms(self, fit: _Fit, began: float) -> IdentificationResult:
        """The whole program, again and again until its weights do not change what it finds."""
        theta, typical, program = fit.theta, self.layout.typical, self.prog()
        step, far = 0, np.inf
        while step < MOST_STEPS:
            step += 1
            rows = self._rows(theta)
            rests = [r.A @ (theta / typical) - r.b for r in rows]
            weights = [huber_weights(*each) for each in zip(rests, fit.limits, strict=True)]
            self._weigh(rows, weights, theta)
            convex = is_convex(program)
            x, solver, said = self._solve_whole(
                theta / typical,
                "parameters that some robot has",
                None if convex else smooth_program(self.layout, program),
            )
            way = x - theta / typical
            said_by = float(way @ self._information(rows, weights) @ way)
            far = float(np.sqrt(max(said_by, 0.0)))
            theta = x * typical
            # A solver of nonlinear programs comes no nearer than its tolerance.
            if far < (SETTLED if convex else ROUGHLY_SETTLED):
                break
        words = [BY_LIKELIHOOD]
        if far > ROUGHLY_SETTLED:
            words.append(NOT_SETTLED.format(far))
        active = violated(self.layout, fit.theta)
        how = AT_THE_RIM if active else OPTIMAL, solver, active
        end = replace(fit, theta=theta, rows=rows, weights=weights, steps=step, last_step=far)
        found = self._result(end, theta, how, time.perf_counter() - began)
        report: ProgramReport = self._report(x, solver, said, words)
        return replace(found, program=report)

    def prog(self) -> MathematicalProgram:
        """The same problem for Drake's solvers, weighted as at the believed model; one object.

        Variables are the vector over its typical sizes, by name; what is known are linear
        equations, the pseudo-inertia is positive semidefinite, friction and compliance are not
        negative. Measurements and priors come before it; what is added to it counts in `Solve`.
        """
        if self._prog is None:
            theta = self.layout.model.vector()
            rows = self._rows(theta)
            self._prog = self._program(rows, [np.ones(len(r.b)) for r in rows], theta)
            self._prog.SetInitialGuess(self._prog.decision_variables(), theta / self.layout.typical)
            self._seal()
        return self._prog

    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """Parameters as users read them, in their units, in the order of `names`.

        Args:
            of: Names, with * and ?, or groups of `GROUPS` that are unknown; None: all.

        Raises:
            IdentificationError: No unknown parameter has the name.
        """
        program, layout = self.prog(), self.layout
        chosen = self._which(of)
        names, ratios = self.names(), layout.ratios()
        x, typical = program.decision_variables(), layout.typical
        told = tuple(names[k] for k in chosen)
        forms = [ratios[k] for k in chosen]
        matrix, offset = np.zeros((len(chosen), len(x))), np.zeros(len(chosen))
        for r, form in enumerate(forms):
            if form is None or form[1] != {-1: 1.0}:
                break
            matrix[r], offset[r] = self._form(form[0])
        else:
            return ProgramValues(x, matrix, offset, told)
        return ProgramValues(
            x, np.diag(typical), np.zeros(len(x)), told, lambda theta: layout.values(theta)[chosen]
        )

    def AddLinearConstraint(
        self,
        A: npt.ArrayLike,
        lower: float | Array,
        upper: float | Array,
        of: str | Sequence[str] | None = None,
        name: str = "",
    ) -> Binding:
        """As of `OwnTerms`; bounds on single parameters keep the program convex.

        A centre of mass is a ratio of two linear forms, stiffness and retardation time too: a bound
        on one, times what is below, is linear.
        """
        v, ratios = self._chosen(of), self.layout.ratios()
        rows = np.atleast_2d(np.asarray(A, float))
        forms = [ratios[k] for k in self._which(of)]
        single = rows.shape[1] == v.size and np.all(np.sum(rows != 0.0, axis=1) == 1)
        places = [int(np.argmax(row != 0.0)) for row in rows] if single else []
        if v.transform is None or not single or any(forms[k] is None for k in places):
            return super().AddLinearConstraint(A, lower, upper, of, name)
        low, high = self._bounds(lower, upper, len(rows))
        parts, most = [], []
        for row, k, ends in zip(rows, places, zip(low, high, strict=True), strict=True):
            form = forms[k]
            assert form is not None
            above, below = (self._form(one) for one in form)
            for sign, end in ((-1.0, ends[0]), (1.0, ends[1])):
                if np.isfinite(end):  # sign (a above - end below) <= 0, below > 0
                    line = sign * (row[k] * above[0] - end * below[0])
                    rest = sign * (row[k] * above[1] - end * below[1])
                    size = float(np.linalg.norm(line))
                    parts.append(line / size)
                    most.append(-rest / size)
        if not parts:
            raise IdentificationError("own constraint: found no finite bound; accepted: one")
        binding = self.prog().AddLinearConstraint(
            np.array(parts), np.full(len(parts), -np.inf), np.array(most), v.variables
        )
        return self._named(binding, "constraint", name)

    def _form(self, form: dict[int, float]) -> tuple[Array, float]:
        """A linear form of the vector by the program's variables, and its constant."""
        typical = self.layout.typical
        line = np.zeros(len(typical))
        for k, factor in form.items():
            if k >= 0:
                line[k] = factor * typical[k]
        return line, form.get(-1, 0.0)

    def _which(self, of: str | Sequence[str] | None) -> list[int]:
        """Numbers of the parameters that are meant."""
        names = self.names()
        if of is None:
            return list(range(len(names)))
        chosen: set[int] = set()
        for one in [of] if isinstance(of, str) else of:
            mine = [k for k, name in enumerate(names) if fnmatchcase(name, one)]
            mine = mine or [k for k, name in enumerate(names) if name.startswith(f"{one}.")]
            if not mine:
                raise IdentificationError(f"of: found {one!r}; {accepted_names(one, names)}")
            chosen |= set(mine)
        return sorted(chosen)

    def _still_grows(self, what: str) -> None:
        """Measurements and priors are in the program from its beginning."""
        if self._prog is not None:
            raise IdentificationError(
                f"{what}: found a program that was already made for own terms; accepted: "
                "measurements and priors first"
            )

    def _weigh(self, rows: list[Rows], weights: list[Array], theta: Array) -> None:
        """Puts the weights and what is known at a vector into the program that is kept."""
        program = self.prog()
        g, c = self._gradient(rows, weights)
        cost = self._built_in_costs[0].evaluator()
        cost.UpdateCoefficients(self._information(rows, weights), -g, 0.5 * c, is_convex=True)
        E, e = self._scaled(theta)
        if len(e):
            program.linear_equality_constraints()[0].evaluator().UpdateCoefficients(E, e)

    def _program(self, rows: list[Rows], weights: list[Array], theta: Array) -> MathematicalProgram:
        g, c = self._gradient(rows, weights)
        cost = (self._information(rows, weights), g, c)
        return make_program(self.layout, cost, self._scaled(theta))

    def _scaled(self, theta: Array) -> tuple[Array, Array]:
        """Constraints on the vector over its typical sizes, with rows of length one."""
        E, e = self.layout.constraints(theta)
        E = E * self.layout.typical
        size = np.linalg.norm(E, axis=1)
        return E / size[:, None], e / size

    def _directions(self, E: Array) -> Array:
        """Orthonormal basis of what the constraints leave free, shape (n, f)."""
        n = len(self.layout.typical)
        return np.asarray(null_space(E)) if len(E) else np.eye(n)

    def _rows(self, theta: Array, terms: Sequence[Term] | None = None) -> list[Rows]:
        """Of all terms, or some others, and priors, by the vector over its typical sizes."""
        typical = self.layout.typical
        found = [term.rows(theta) for term in (self._weighed if terms is None else terms)]
        found = [Rows(r.A * typical, r.b) for r in found]
        A, b = np.zeros((len(self._priors), len(typical))), np.zeros(len(self._priors))
        for r, (entries, value, std) in enumerate(self._priors):
            for k, factor in entries.items():
                A[r, k] = factor * typical[k] / std
            b[r] = value / std
        return [*found, Rows(A, b)]

    def _information(self, rows: list[Rows], weights: list[Array]) -> Array:
        H = np.zeros((len(self.layout.typical),) * 2)
        for k, r in enumerate(rows):
            w = weights[k][:, None] if weights else 1.0
            H += (w * r.A).T @ r.A
        return H

    def _gradient(self, rows: list[Rows], weights: list[Array]) -> tuple[Array, float]:
        g, c = np.zeros(len(self.layout.typical)), 0.0
        for r, w in zip(rows, weights, strict=True):
            g += r.A.T @ (w * r.b)
            c += float(r.b @ (w * r.b))
        return g, c

    def _weighed_fit(self, outliers: bool) -> _Fit:
        """With the error of poses where they are off by more than they jitter."""
        self._weighed = self.terms
        fit = self._least_squares(outliers)
        for _ in range(MOST_WEIGHINGS):
            found = [
                t.with_errors_of_poses(fit.theta, outliers) if isinstance(t, MotionTerm) else t
                for t in self._weighed
            ]
            offs = _offs(self._weighed), _offs(found)
            if np.allclose(*offs, rtol=OFF_WITHIN, atol=0.0):
                break
            self._weighed = found
            fit = self._least_squares(outliers, fit.theta)
        return fit

    def _some_robot(self, fit: _Fit) -> _Fit:
        """The same with inequalities, where least squares found what no robot has.

        Noise, and so weights, depend on the body: those at a body that cannot be are of no use.
        So the program is solved again and again, weighted as at its last solution, or at the belief
        if that is better than the first, by steps that do not raise the cost.

        Raises:
            IdentificationError: The program has no solution.
        """
        active, typical = violated(self.layout, fit.theta), self.layout.typical
        if not active:
            return fit

        def at(theta: Array) -> tuple[float, list[Rows], list[Array]]:
            rows = self._rows(theta)
            rests = [r.A @ (theta / typical) - r.b for r in rows]
            weights = [huber_weights(*each) for each in zip(rests, fit.limits, strict=True)]
            return _cost(rests, fit.limits), rows, weights

        theta, solver = self._solved(fit.rows, fit.weights, fit.theta)
        cost, rows, weights = at(theta)
        belief = self.layout.model.vector()
        if not violated(self.layout, belief):
            there = at(belief)
            if there[0] < cost:
                theta, (cost, rows, weights) = belief, there
        far, step = np.inf, 0
        while far >= ROUGHLY_SETTLED and step < MOST_STEPS:
            step += 1
            way = self._solved(rows, weights, theta)[0] - theta
            x = way / typical
            far = float(np.sqrt(max(float(x @ self._information(rows, weights) @ x), 0.0)))
            for k in range(MOST_HALVINGS):
                there = at(theta + 0.5**k * way)
                if there[0] <= cost:
                    theta, (cost, rows, weights) = theta + 0.5**k * way, there
                    break
            else:
                break  # nothing along it is better
        Z = self._directions(self._scaled(theta)[0])
        H = np.asarray(Z.T @ self._information(rows, weights) @ Z)
        return replace(
            fit, theta=theta, Z=Z, H=H, rows=rows, weights=weights, steps=fit.steps + step,
            last_step=far, active=active, solver=solver,
        )  # fmt: skip

    def _solved(self, rows: list[Rows], weights: list[Array], theta: Array) -> tuple[Array, str]:
        """What Drake finds of the program, weighted as at a vector, and by which solver.

        Raises:
            IdentificationError: It finds nothing.
        """
        program = self._program(rows, weights, theta)
        found = Solve(program)
        if not found.is_success():
            raise IdentificationError(
                f"identification: found {found.get_solution_result()} by "
                f"{found.get_solver_id().name()}; accepted: data that some body can have"
            )
        x = found.GetSolution(program.decision_variables())
        return x * self.layout.typical, found.get_solver_id().name()

    def _least_squares(self, outliers: bool, start: Array | None = None) -> _Fit:
        """Without inequalities, until weights and what is not quite linear do not change.

        Steps are those of Gauss and Newton, halved while the cost grows. They begin at the belief,
        or at another vector, shape (n,).
        """
        typical, believed = self.layout.typical, self.layout.model.vector()
        theta = believed if start is None else start
        rows = self._rows(believed)
        limits = [np.inf] * len(rows)
        first = [r.A @ (believed / typical) - r.b for r in rows]
        rows = rows if start is None else self._rows(theta)
        for step in range(1, MOST_STEPS + 1):
            rests = [r.A @ (theta / typical) - r.b for r in rows]
            if outliers and step > 1:
                limits = [*(huber_limit(rest) for rest in rests[:-1]), np.inf]
            weights = [huber_weights(*each) for each in zip(rests, limits, strict=True)]
            E, e = self._scaled(theta)
            Z = self._directions(E)
            known = np.linalg.lstsq(E, e, rcond=None)[0] if len(e) else np.zeros(len(typical))
            A = np.vstack([np.sqrt(w)[:, None] * r.A for r, w in zip(rows, weights, strict=True)])
            b = np.concatenate([np.sqrt(w) * r.b for r, w in zip(rows, weights, strict=True)])
            y = np.linalg.lstsq(A @ Z, b - A @ known, rcond=None)[0]
            way = (known + Z @ y) * typical - theta
            moved = float(np.max(np.abs(way / typical)))
            said = float(np.linalg.norm(A @ (way / typical)))
            before, share = _cost(rests, limits), 1.0
            for _ in range(MOST_HALVINGS):
                tried = theta + share * way
                rows_there = self._rows(tried)
                there = _cost([r.A @ (tried / typical) - r.b for r in rows_there], limits)
                if there <= before + _indifferent(before, rows):
                    theta, rows = tried, rows_there
                    break
                share *= 0.5
            else:
                said = 0.0  # nothing along it is better
            if said < SETTLED or (moved < CLOSE and step > 2):
                break
        H = (A @ Z).T @ (A @ Z)
        return _Fit(theta, Z, H, first, rows, weights, limits, step, said)

    def _check_end(self, theta: Array, fit: _Fit) -> None:
        """Refuses a vector that explains the measurements less well than the belief.

        Raises:
            IdentificationError: It does; says by how much.
        """
        rows, x = self._rows(theta), theta / self.layout.typical
        end = _cost([r.A @ x - r.b for r in rows], fit.limits)
        start = _cost(fit.first, fit.limits)
        if end > start + _indifferent(start, rows):
            raise IdentificationError(
                f"identification: found parameters with chi-square {end:.4g}, where those "
                f"that are believed have {start:.4g}; accepted: an end that is no worse than "
                "its start, as with fewer unknowns, priors or another belief"
            )

    def _between_blocks(self, fit: _Fit, x: Array) -> float:
        """By how much estimates scatter more, in variance, than independent residuals make them.

        Errors of poses last longer than a sample. With gradients g_b = A_b' r_b of the blocks b,
        B of them and p unknowns, it is B / (B - 1) sum g_b' H^-1 g_b / p: the mean, over
        directions, of the ratio of the variance that groups of rows tell to that of single rows.

        Source: Liang, Zeger, Longitudinal data analysis using generalized linear models, 1986.
        """
        total, count = 0.0, 0
        for term, (r, w) in zip(self.terms, fit.pairs(), strict=False):
            if isinstance(term, MotionTerm):
                A = np.sqrt(w)[:, None] * (r.A @ fit.Z)
                rest = np.sqrt(w) * (r.A @ x - r.b)
                for block in term.samples.blocks():
                    rows = slice(6 * block.start, 6 * block.stop)
                    g = A[rows].T @ rest[rows]
                    total, count = total + float(g @ np.linalg.solve(fit.H, g)), count + 1
        return total / len(fit.H) * count / max(count - 1, 1)

    def _result(
        self, fit: _Fit, theta: Array, how: tuple[str, str, tuple[str, ...]], wall: float
    ) -> IdentificationResult:
        layout = self.layout
        x = theta / layout.typical
        offs = _offs(self._weighed)
        fitted = sum(float(np.sum(w * (r.A @ x - r.b) ** 2)) for r, w in fit.pairs())
        off = sum(int(np.sum(w < 1.0)) for w in fit.weights[:-1])
        known, weights = fit.rows, fit.weights
        if any(offs):  # as sensors are: weights are not those of the fit
            known = self._rows(theta, self.terms)
            rests = [r.A @ x - r.b for r in known]
            limited = np.isfinite(fit.limits)
            limits = [
                huber_limit(r) if at else np.inf for r, at in zip(rests, limited, strict=True)
            ]
            weights = [huber_weights(*each) for each in zip(rests, limits, strict=True)]
        fits, chi, count = {}, 0.0, 0
        for term, r, w in zip(self.terms, known[:-1], weights[:-1], strict=True):
            rest = np.sqrt(w) * (r.A @ x - r.b)
            fits[term.name] = TermFit(
                len(r.b), float(np.sqrt(np.mean(rest**2))) if len(rest) else 0.0,
                term.misfit(theta),
            )  # fmt: skip
            chi, count = chi + float(rest @ rest), count + len(rest)
        prior = known[-1].A @ x - known[-1].b
        chi, count = chi + float(prior @ prior), count + len(prior)
        degrees = max(count - fit.Z.shape[1], 1)
        J = layout.jacobian(theta, layout.typical[:, None] * fit.Z)
        covariance = J @ np.linalg.solve(fit.H, J.T)
        spread = float(np.sqrt(chi / degrees))
        larger = fitted / degrees
        if any(offs):
            larger *= max(self._between_blocks(fit, x), 1.0)
        status = MISFIT if spread > MISFIT_FACTOR else how[0]
        remarks = []
        if fit.last_step > UNSETTLED:
            remarks.append(STILL_MOVED.format(fit.steps, fit.last_step))
        if np.max(np.abs(prior), initial=0.0) > CONTRADICTION:
            remarks.append(CONTRADICTED.format(np.max(np.abs(prior))))
        largest = [one for term in self.terms for one in term.largest(theta)]
        parameters = layout.parameters()
        return IdentificationResult(
            status=status, solver=how[1], model=layout.model.moved(theta), believed=layout.model,
            names=tuple(p[0] for p in parameters), units=tuple(p[2] for p in parameters),
            values=layout.values(theta), before=layout.values(layout.model.vector()),
            covariance=covariance * max(larger, 1.0),
            condition=float(np.sqrt(np.linalg.cond(fit.H))), terms=fits, chi_square=chi,
            degrees=degrees, spread=spread, active=how[2], outliers=off,
            largest=tuple(sorted(largest, key=lambda one: -one.sigmas)), steps=fit.steps,
            last_step=fit.last_step, wall_time=wall, pose_error=max(offs, default=0.0),
            remarks=tuple(remarks),
        )  # fmt: skip


def _offs(terms: Sequence[Term]) -> list[float]:
    """Errors of poses that motions are weighed with [m]."""
    return [term.off for term in terms if isinstance(term, MotionTerm)]


def _cost(rests: list[Array], limits: list[float]) -> float:
    """Robust chi-square of all terms."""
    return sum(huber_cost(*each) for each in zip(rests, limits, strict=True))


def _indifferent(cost: float, rows: list[Rows]) -> float:
    """`NOTHING` of residuals as large as these."""
    return NOTHING * max(1.0, cost / max(sum(len(r.b) for r in rows), 1))


def _positive(what: str, sigma: float) -> None:
    if not (np.isfinite(sigma) and sigma > 0.0):
        raise IdentificationError(f"{what}: sigma: found {sigma:g}; accepted: a finite number > 0")

"""An identification as a program that grows by what was measured, as Drake's InverseKinematics."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np
import numpy.typing as npt
from pydrake.solvers import Binding, MathematicalProgram

from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError, accepted_names
from cdpr_drake.identification.equations import (
    MOST_STEPS,
    ROUGHLY_SETTLED,
    SETTLED,
    Equations,
    Fit,
    Point,
    huber_limit,
    offs_of,
    scatter_of_blocks,
)
from cdpr_drake.identification.motion_term import MotionTerm
from cdpr_drake.identification.parameters import GROUPS, DynamicModel, Form, Layout, offsets_needed
from cdpr_drake.identification.physical_bounds import smooth_program, violated
from cdpr_drake.identification.result import (
    AT_THE_RIM,
    MISFIT,
    MISFIT_FACTOR,
    OPTIMAL,
    IdentificationResult,
    TermFit,
)
from cdpr_drake.identification.samples import LoggedMotion, WinchSamples
from cdpr_drake.identification.terms import CableTerm, Term, WinchTerm, prior_rows
from cdpr_drake.numerics.null_directions import named_direction, sparse_basis
from cdpr_drake.numerics.own_terms import OwnTerms, ProgramValues, is_convex

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

UNSETTLED, CONTRADICTION = 0.1, 4.0
"""Standard errors of the last step, and of priors, from which on a remark says so."""

UNTOLD = 1.0
"""A direction is told where its standard deviation is below this many typical sizes."""

LITTLE_TURN = np.radians(2.0)
LITTLE_ACCELERATION = 0.05
"""Turns [rad] and accelerations, over gravity, that count as none."""


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
        self.equations = Equations(self.layout)
        self.terms = self.equations.terms
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
            samples: A motion.
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
        self.equations.priors += prior_rows(self.layout.model, group, std)

    def names(self) -> tuple[str, ...]:
        """Names of the unknown parameters."""
        return tuple(one.name for one in self.layout.parameters)

    def FindUnidentifiable(self) -> tuple[str, ...]:
        """What these measurements and priors cannot tell, in words, at the believed model."""
        told: list[Term] = [t.told() if isinstance(t, MotionTerm) else t for t in self.terms]
        theta, Z, H = self._information(told)
        parameters = self.layout.parameters
        J = self.layout.jacobian(theta, self.layout.typical[:, None] * Z)
        back = np.linalg.inv(J / np.array([p.size for p in parameters])[:, None])
        values, V = np.linalg.eigh(back.T @ H @ back)
        N, why = V[:, values < 1.0 / UNTOLD**2], _reason(self.terms)
        words = [p.words for p in parameters]
        return tuple(named_direction(v, words) + why for v in sparse_basis(N).T)

    def FindCovariance(self) -> Array:
        """Covariance of the parameters by these measurements at the believed model, shape (f, f).

        With the true model it is the Cramer-Rao bound, as far as smoothing keeps what was measured.
        """
        return self._covariance(*self._information(self.terms))

    def Solve(self, outliers: bool = True) -> IdentificationResult:
        """The most likely parameters.

        Args:
            outliers: True if residuals beyond four sigmas count linearly.

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
        fit = self.equations.weighed(outliers)
        if self.has_own_terms:
            result = self._with_own_terms(fit)
        else:
            fit = self.equations.some_robot(fit)
            self.equations.check_end(fit)
            result = self._result(fit)
        return replace(result, wall_time=time.perf_counter() - began)

    def _with_own_terms(self, fit: Fit) -> IdentificationResult:
        """The whole program, again and again until its weights do not change its solution."""
        layout, program, point = self.layout, self.prog(), fit.point
        step, far, convex = 0, np.inf, True
        # A solver of nonlinear programs comes no nearer than its tolerance.
        while far >= (SETTLED if convex else ROUGHLY_SETTLED) and step < MOST_STEPS:
            step += 1
            point = self.equations.at(point.theta, fit.terms)
            weights = point.weights(fit.limits)
            H = self._weigh(point, weights)
            convex = is_convex(program)
            smooth = None if convex else smooth_program(layout, program)
            x, solver, said = self._solve_whole(point.x, "parameters that some robot has", smooth)
            far = float(np.sqrt(max(float((x - point.x) @ H @ (x - point.x)), 0.0)))
            theta = x * layout.typical
            rests = [r.A @ (theta / layout.typical) - r.b for r in point.rows]
            point = Point(theta, theta / layout.typical, point.rows, rests)
        words = [BY_LIKELIHOOD]
        if far > ROUGHLY_SETTLED:
            words.append(NOT_SETTLED.format(far))
        end = replace(
            fit, point=point, weights=weights, steps=step, last_step=far, solver=solver,
            active=violated(layout, fit.point.theta),
        )  # fmt: skip
        return replace(self._result(end), program=self._report(x, solver, said, words))

    def prog(self) -> MathematicalProgram:
        """The same problem for Drake's solvers, weighted as at the believed model; one object.

        Variables are the vector over its typical sizes, by name; what is known are linear
        equations, the pseudo-inertia is positive semidefinite, friction and compliance are not
        negative. Measurements and priors come before it; what is added to it counts in `Solve`.
        """
        if self._prog is None:
            belief = self.equations.at(self.layout.model.vector())
            self._prog = self.equations.program(belief)
            self._prog.SetInitialGuess(self._prog.decision_variables(), belief.x)
            self._seal()
        return self._prog

    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """Parameters as users read them, in their units, in the order of `names`.

        Args:
            of: Names, with * and ?, or groups of `GROUPS` that are unknown; None: all.

        Raises:
            IdentificationError: No unknown parameter has the name.
        """
        x, layout, chosen = self.prog().decision_variables(), self.layout, self._which(of)
        names = tuple(layout.parameters[k].name for k in chosen)
        ratios = [layout.parameters[k].ratio for k in chosen]
        forms = [self._form(r[0]) for r in ratios if r is not None and r[1] == {-1: 1.0}]
        if len(forms) == len(chosen):
            matrix, offset = (np.array(part) for part in zip(*forms, strict=True))
            return ProgramValues(x, matrix, offset, names)
        return ProgramValues(
            x, np.diag(layout.typical), np.zeros(len(x)), names,
            lambda theta: layout.values(theta)[chosen],
        )  # fmt: skip

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
        v, rows = self._chosen(of), np.atleast_2d(np.asarray(A, float))
        ratios = [self.layout.parameters[k].ratio for k in self._which(of)]
        single = rows.shape[1] == v.size and np.all(np.sum(rows != 0.0, axis=1) == 1)
        mine = [ratios[int(np.argmax(row != 0.0))] for row in rows] if single else [None]
        if v.transform is None or any(ratio is None for ratio in mine):
            return super().AddLinearConstraint(A, lower, upper, of, name)
        low, high = self._bounds(lower, upper, len(rows))
        parts, most = [], []
        for row, ratio, ends in zip(rows, mine, zip(low, high, strict=True), strict=True):
            assert ratio is not None
            factor, (above, below) = float(np.sum(row)), map(self._form, ratio)
            for sign, end in ((-1.0, ends[0]), (1.0, ends[1])):
                if np.isfinite(end):  # sign (a above - end below) <= 0, below > 0
                    line = sign * (factor * above[0] - end * below[0])
                    size = float(np.linalg.norm(line))
                    parts.append(line / size)
                    most.append(-sign * (factor * above[1] - end * below[1]) / size)
        if not parts:
            raise IdentificationError("own constraint: found no finite bound; accepted: one")
        binding = self.prog().AddLinearConstraint(
            np.array(parts), np.full(len(parts), -np.inf), np.array(most), v.variables
        )
        return self._named(binding, "constraint", name)

    def _form(self, form: Form) -> tuple[Array, float]:
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

    def _weigh(self, point: Point, weights: list[Array]) -> Array:
        """Puts weights and what is known at a point into the program; the information."""
        program, (H, g, c) = self.prog(), point.normal(weights)
        cost = self._built_in_costs[0].evaluator()
        cost.UpdateCoefficients(H, -g, 0.5 * c, is_convex=True)
        E, e = self.equations.equalities(point.theta)
        if len(e):
            program.linear_equality_constraints()[0].evaluator().UpdateCoefficients(E, e)
        return H

    def _information(self, terms: Sequence[Term]) -> tuple[Array, Array, Array]:
        """The believed vector, directions that are free there, and information along them."""
        point = self.equations.at(self.layout.model.vector(), terms)
        Z = self.equations.directions(point.theta)
        return point.theta, Z, np.asarray(Z.T @ point.normal()[0] @ Z)

    def _covariance(self, theta: Array, Z: Array, H: Array) -> Array:
        """Of the parameters, by information along directions, shape (f, f)."""
        J = self.layout.jacobian(theta, self.layout.typical[:, None] * Z)
        return np.asarray(J @ np.linalg.solve(H, J.T))

    def _result(self, fit: Fit) -> IdentificationResult:
        layout, point, offs = self.layout, fit.point, offs_of(fit.terms)
        fitted = sum(
            float(np.sum(w * rest**2)) for w, rest in zip(fit.weights, point.rests, strict=True)
        )
        rests, weights = point.rests, fit.weights
        if any(offs):  # as sensors are: weights are not those of the fit
            exact = self.equations.at(point.theta)
            limits = [
                huber_limit(r) if np.isfinite(limit) else np.inf
                for r, limit in zip(exact.rests, fit.limits, strict=True)
            ]
            rests, weights = exact.rests, exact.weights(limits)
        fits, chi, count = {}, 0.0, 0
        for term, rest, w in zip(self.terms, rests[:-1], weights[:-1], strict=True):
            off, n = np.sqrt(w) * rest, len(rest)
            rms = float(np.sqrt(np.mean(off**2))) if n else 0.0
            fits[term.name] = TermFit(n, rms, term.misfit(point.theta))
            chi, count = chi + float(off @ off), count + n
        prior = rests[-1]
        chi, count = chi + float(prior @ prior), count + len(prior)
        degrees = max(count - fit.Z.shape[1], 1)
        spread, larger = float(np.sqrt(chi / degrees)), fitted / degrees
        if any(offs):
            larger *= max(scatter_of_blocks(fit), 1.0)
        remarks = []
        if fit.last_step > UNSETTLED:
            remarks.append(STILL_MOVED.format(fit.steps, fit.last_step))
        if np.max(np.abs(prior), initial=0.0) > CONTRADICTION:
            remarks.append(CONTRADICTED.format(np.max(np.abs(prior))))
        largest = [one for term in self.terms for one in term.largest(point.theta)]
        status = MISFIT if spread > MISFIT_FACTOR else AT_THE_RIM if fit.active else OPTIMAL
        return IdentificationResult(
            status=status, solver=fit.solver, model=layout.model.moved(point.theta),
            believed=layout.model, names=self.names(),
            units=tuple(p.unit for p in layout.parameters), values=layout.values(point.theta),
            before=layout.values(layout.model.vector()),
            covariance=self._covariance(point.theta, fit.Z, fit.H) * max(larger, 1.0),
            condition=float(np.sqrt(np.linalg.cond(fit.H))), terms=fits, chi_square=chi,
            degrees=degrees, spread=spread, active=fit.active,
            outliers=sum(int(np.sum(w < 1.0)) for w in fit.weights[:-1]),
            largest=tuple(sorted(largest, key=lambda one: -one.sigmas)), steps=fit.steps,
            last_step=fit.last_step, pose_error=max(offs, default=0.0), remarks=tuple(remarks),
        )  # fmt: skip


def _positive(what: str, sigma: float) -> None:
    if not (np.isfinite(sigma) and sigma > 0.0):
        raise IdentificationError(f"{what}: sigma: found {sigma:g}; accepted: a finite number > 0")


def _reason(terms: Sequence[Term]) -> str:
    for term in terms:
        if isinstance(term, MotionTerm):
            s = term.samples
            turned = np.einsum("ij,nij->n", s.R_WP[0], s.R_WP)
            turn = float(np.max(np.arccos(np.clip(0.5 * (turned - 1.0), -1.0, 1.0))))
            if turn < LITTLE_TURN:
                return ": no rotation in the log"
            gravity = max(float(np.linalg.norm(term.gravity)), 1.0)
            fast = float(np.sqrt(np.mean(s.A_WP[:, 3:] ** 2))) / gravity
            if fast < LITTLE_ACCELERATION:
                return ": hardly any acceleration in the log"
            return ""
    return ""

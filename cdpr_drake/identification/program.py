"""An identification as a program that grows by what was measured, as Drake's InverseKinematics."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.solvers import MathematicalProgram, Solve
from pydrake.symbolic import Variable
from scipy.linalg import null_space

from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError
from cdpr_drake.identification.identifiability import untold_words
from cdpr_drake.identification.parameters import (
    COMPLIANCE,
    COULOMB,
    DAMPING,
    EXCESS,
    FRICTION,
    GROUPS,
    LAG,
    PER_CABLE,
    PLATFORM,
    STIFFNESS,
    VISCOUS,
    DynamicModel,
    Layout,
    column,
    offsets_needed,
)
from cdpr_drake.identification.priors import Prior, prior_rows
from cdpr_drake.identification.regressor import SIZE, pseudo_inertia
from cdpr_drake.identification.result import IdentificationResult, TermFit
from cdpr_drake.identification.samples import MotionSamples, WinchSamples
from cdpr_drake.identification.terms import CableTerm, MotionTerm, Rows, Term, WinchTerm

HUBER = 4.0
"""From how many sigmas on a residual counts linearly."""

MOST_STEPS = 12
CLOSE = 1e-9
"""Steps end where the vector changes by less, in typical sizes."""

LEAST_INERTIA = 1e-9
"""Smallest eigenvalue of the pseudo-inertia that counts as inside of what bodies can have, over its
largest."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """A least squares solution: vector, directions that are free, information along them."""

    theta: Array
    Z: Array
    H: Array
    rows: list[Rows]
    weights: list[Array]
    steps: int


class IdentificationProgram:
    """Finds unknown constants of a robot's dynamics in what was measured while it moved.

    `Add...` methods add measurements and priors; `Solve` finds the most likely parameters that
    some body has. All equations are linear in `layout`'s vector, weighted by the noise that they
    are measured with; what weights and a few known constants make of it is solved again until it
    does not change. `prog()` is the same problem as a MathematicalProgram: a convex quadratic cost
    with a linear matrix inequality.

    Attributes:
        layout: The unknown vector.
        terms: What was measured.
        gravity: Acceleration of a falling body in W, shape (3,) [m/s^2].
    """

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
        self._priors: list[Prior] = []

    def AddMotion(self, samples: MotionSamples) -> MotionTerm:
        """The wrench that the cables put on the platform, and the motion that it made."""
        term = MotionTerm.make(samples, self.gravity)
        self.terms.append(term)
        return term

    def AddCableLengths(
        self,
        samples: MotionSamples,
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
        if np.shape(counted) != (samples.count, len(self.layout.model.names)):
            raise IdentificationError(
                f"counted lengths: found shape {np.shape(counted)}; accepted: "
                f"{(samples.count, len(self.layout.model.names))}"
            )
        _positive("cable lengths", sigma)
        term = CableTerm.make(samples, np.asarray(counted, float), sigma, slack_below)
        self.terms.append(term)
        return term

    def AddWinches(self, samples: WinchSamples) -> WinchTerm:
        """What turning winches lose."""
        term = WinchTerm.make(samples, len(self.layout.model.names))
        self.terms.append(term)
        return term

    def AddPrior(self, group: str, std: float) -> None:
        """A group is known up to a standard deviation.

        [kg]; [m]; [kg m^2] about Po; [N]; [s]; of Coulomb and of static less Coulomb friction
        [N m], of viscous friction 1 s/rad of Coulomb's.
        """
        _positive("prior", std)
        if group not in GROUPS:
            raise IdentificationError(f"prior: found {group!r}; accepted: {', '.join(GROUPS)}")
        self._priors += prior_rows(self.layout.model, group, std)

    def names(self) -> tuple[str, ...]:
        """Names of the unknown parameters."""
        return tuple(one[0] for one in self.layout.parameters())

    def FindUntold(self) -> tuple[str, ...]:
        """What these measurements and priors cannot tell, in words, at the believed model."""
        theta = self.layout.model.vector()
        Z = self._directions(self._scaled(theta)[0])
        told: list[Term] = [t.told() if isinstance(t, MotionTerm) else t for t in self.terms]
        information = self._information(self._rows(theta, told), [])
        H = np.asarray(Z.T @ information @ Z)
        return untold_words(self.layout, theta, Z, H, self.terms)

    def FindCovariance(self) -> Array:
        """Covariance of the parameters by these measurements at the believed model, shape (f, f).

        With the true model it is the Cramer-Rao bound, as far as smoothing keeps what was measured.
        """
        theta = self.layout.model.vector()
        Z = self._directions(self._scaled(theta)[0])
        H = Z.T @ self._information(self._rows(theta), []) @ Z
        J = self.layout.jacobian(theta, self.layout.typical[:, None] * Z)
        return np.asarray(J @ np.linalg.solve(H, J.T))

    def Solve(self, outliers: bool = True) -> IdentificationResult:
        """The most likely parameters.

        Args:
            outliers: Whether residuals beyond four sigmas count linearly.

        Raises:
            IdentificationError: Nothing was measured, or a parameter cannot be told and has no
                prior: names which from which, and why.
        """
        began = time.perf_counter()
        if not self.terms:
            raise IdentificationError("measurements: found none; accepted: at least one")
        untold = self.FindUntold()
        if untold:
            more = f" (and {len(untold) - 2} more such)" if len(untold) > 2 else ""
            raise IdentificationError(
                f"unknown: {'; '.join(untold[:2])}{more}; accepted: fewer unknowns, a prior for "
                "them, or a log of a motion that excites them"
            )
        fit = self._least_squares(outliers)
        status, solver, active = "optimal", "least squares", self._violated(fit.theta)
        theta = fit.theta
        if active:
            program = self._program(fit.rows, fit.weights, theta)
            found = Solve(program)
            if not found.is_success():
                raise IdentificationError(
                    f"identification: found {found.get_solution_result()} by "
                    f"{found.get_solver_id().name()}; accepted: data that some body can have"
                )
            theta = found.GetSolution(program.decision_variables()) * self.layout.typical
            status, solver = "at the rim of what bodies can have", found.get_solver_id().name()
        return self._result(fit, theta, (status, solver, active), time.perf_counter() - began)

    def prog(self) -> MathematicalProgram:
        """The same problem for Drake's solvers, weighted as at the believed model.

        Variables are the vector over its typical sizes, by name; what is known are linear
        equations, the pseudo-inertia is positive semidefinite, friction and compliance are not
        negative.
        """
        theta = self.layout.model.vector()
        rows = self._rows(theta)
        return self._program(rows, [np.ones(len(r.b)) for r in rows], theta)

    def _program(self, rows: list[Rows], weights: list[Array], theta: Array) -> MathematicalProgram:
        typical, program = self.layout.typical, MathematicalProgram()
        x = np.array([Variable(name) for name in self._vector_names()], dtype=object)
        program.AddDecisionVariables(x)
        H = self._information(rows, weights)
        g, c = self._gradient(rows, weights)
        program.AddQuadraticCost(H, -g, 0.5 * c, x, is_convex=True)
        E, e = self._scaled(theta)
        if len(e):
            program.AddLinearEqualityConstraint(E, e, x)
        if any(group in PLATFORM for group in self.layout.unknown):
            F = [np.zeros((4, 4))]
            for k in range(SIZE):
                one = np.zeros(SIZE)
                one[k] = 1.0
                F.append(self._squeezed(pseudo_inertia(one * typical[:SIZE])))
            program.AddLinearMatrixInequalityConstraint(F, x[:SIZE])
        for k in self._not_negative():
            program.AddBoundingBoxConstraint(0.0, np.inf, x[k])
        return program

    def _squeezed(self, J: Array) -> Array:
        """The pseudo-inertia by masses and lengths of order one, so that solvers see its rim."""
        model, L = self.layout.model, self.layout.size
        scale = np.array([1.0 / L] * 3 + [1.0]) / np.sqrt(model.mass)
        return np.asarray(J * np.outer(scale, scale))

    def _not_negative(self) -> list[int]:
        free = self.layout.unknown
        what = [COMPLIANCE] * (STIFFNESS in free) + [LAG] * (DAMPING in free)
        what += [COULOMB, VISCOUS] * (FRICTION in free) + [EXCESS] * ("static_friction" in free)
        return [column(i, k) for i in range(len(self.layout.model.names)) for k in what]

    def _violated(self, theta: Array) -> tuple[str, ...]:
        """What no robot has of a vector, in words."""
        words = []
        if any(group in PLATFORM for group in self.layout.unknown):
            values = np.linalg.eigvalsh(self._squeezed(pseudo_inertia(theta[:SIZE])))
            if values[0] < LEAST_INERTIA * values[-1]:
                words.append("mass and inertia: no body has them (pseudo-inertia not positive)")
        names = self._vector_names()
        words += [f"{names[k]}: below 0" for k in self._not_negative() if theta[k] < 0.0]
        return tuple(words)

    def _vector_names(self) -> list[str]:
        names = ["mass", "moment_x", "moment_y", "moment_z"]
        names += [f"inertia_{ab}" for ab in ("xx", "yy", "zz", "xy", "xz", "yz")]
        per = ("compliance", "lag", "offset", "coulomb", "excess", "viscous")
        assert len(per) == PER_CABLE
        assert len(names) == SIZE
        return names + [f"{cable}_{one}" for cable in self.layout.model.names for one in per]

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
        found = [term.rows(theta) for term in (self.terms if terms is None else terms)]
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

    def _least_squares(self, outliers: bool) -> _Fit:
        """Without inequalities, until weights and what is not quite linear do not change."""
        typical = self.layout.typical
        theta = self.layout.model.vector()
        weights: list[Array] = []
        for step in range(1, MOST_STEPS + 1):
            rows = self._rows(theta)
            E, e = self._scaled(theta)
            Z = self._directions(E)
            start = np.linalg.lstsq(E, e, rcond=None)[0] if len(e) else np.zeros(len(typical))
            weights = weights or [np.ones(len(r.b)) for r in rows]
            A = np.vstack([np.sqrt(w)[:, None] * r.A for r, w in zip(rows, weights, strict=True)])
            b = np.concatenate([np.sqrt(w) * r.b for r, w in zip(rows, weights, strict=True)])
            y = np.linalg.lstsq(A @ Z, b - A @ start, rcond=None)[0]
            x = start + Z @ y
            moved = float(np.max(np.abs(x - theta / typical)))
            theta = x * typical
            if outliers:
                # Sigmas may be wrong by a factor for a whole term: who is off is so beside others.
                weights = [_huber(r.A @ x - r.b) for r in rows[:-1]] + [weights[-1]]
            if moved < CLOSE and step > 2:
                break
        H = (A @ Z).T @ (A @ Z)
        return _Fit(theta, Z, H, rows, weights, step)

    def _result(
        self, fit: _Fit, theta: Array, how: tuple[str, str, tuple[str, ...]], wall: float
    ) -> IdentificationResult:
        layout = self.layout
        x = theta / layout.typical
        fits, chi, count, off = {}, 0.0, 0, 0
        for term, r, w in zip(self.terms, fit.rows[:-1], fit.weights[:-1], strict=True):
            rest = np.sqrt(w) * (r.A @ x - r.b)
            off += int(np.sum(w < 1.0))
            fits[term.name] = TermFit(
                len(r.b), float(np.sqrt(np.mean(rest**2))) if len(rest) else 0.0,
                term.misfit(theta),
            )  # fmt: skip
            chi, count = chi + float(rest @ rest), count + len(rest)
        prior = fit.rows[-1].A @ x - fit.rows[-1].b
        chi, count = chi + float(prior @ prior), count + len(prior)
        degrees = max(count - fit.Z.shape[1], 1)
        J = layout.jacobian(theta, layout.typical[:, None] * fit.Z)
        covariance = J @ np.linalg.solve(fit.H, J.T)
        spread = float(np.sqrt(chi / degrees))
        parameters = layout.parameters()
        return IdentificationResult(
            status=how[0], solver=how[1], model=layout.model.moved(theta), believed=layout.model,
            names=tuple(p[0] for p in parameters), units=tuple(p[2] for p in parameters),
            values=layout.values(theta), before=layout.values(layout.model.vector()),
            covariance=covariance * max(spread, 1.0) ** 2,
            condition=float(np.sqrt(np.linalg.cond(fit.H))), terms=fits, chi_square=chi,
            degrees=degrees, spread=spread, active=how[2], outliers=off, steps=fit.steps,
            wall_time=wall,
        )  # fmt: skip


def _huber(rest: Array) -> Array:
    """Weights of residuals: beyond `HUBER` of their own spread, at least of 1, by their size."""
    if not len(rest):
        return np.ones(0)
    spread = max(1.4826 * float(np.median(np.abs(rest))), 1.0)
    return np.minimum(1.0, HUBER * spread / np.maximum(np.abs(rest), 1e-300))


def _positive(what: str, sigma: float) -> None:
    if not (np.isfinite(sigma) and sigma > 0.0):
        raise IdentificationError(f"{what}: sigma: found {sigma:g}; accepted: a finite number > 0")

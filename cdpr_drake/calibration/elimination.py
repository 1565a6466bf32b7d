"""Least squares over parameters and poses: each pose is eliminated by itself.

Residuals at one pose depend on all parameters, but on no other pose, so the normal equations are
bordered block-diagonal: the blocks of the poses (six unknowns, or six and the tensions) are solved
at once, and what is left is a dense system as large as the parameters alone (Schur complement).
Forty poses with sixty parameters are a system of sixty instead of three hundred.

Source: Triggs et al., Bundle adjustment, a modern synthesis, 2000, section 6.1; Levenberg and
Marquardt for the damping; Huber for the loss.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import LinAlgError, eigh

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.parameters import CalibrationModel, model_difference
from cdpr_drake.calibration.pose_freedom import BODY, PoseFreedom
from cdpr_drake.calibration.stations import Point, inverse_turn_slope
from cdpr_drake.calibration.terms import Term
from cdpr_drake.errors import CableModelError, CalibrationError

UNTOLD = 1e-3
"""A direction of parameters whose standard deviation is above a thousand times what is typical
cannot be told: metres of an exit point, where centimetres are asked for."""

SETTLED = 1e-8
"""By how much half the sum of squares may still fall: parameters are then within 1e-4 of their
standard deviations."""

MOST_STEPS = 100
SMALLEST_DAMPING, LARGEST_DAMPING = 1e-12, 1e12

MOST_POSES = 500
"""Poses whose derivatives are in memory at a time."""

SINGULAR = 1e-13
"""Smallest over largest eigenvalue of a pose's own normal equations; below, nothing determines
it."""


IMPOSSIBLE = (
    "start: found cables that cannot run, or a tag that was seen behind the camera; accepted: a "
    "robot file, first pose and measurements that are nearer to the truth"
)


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of parameters beforehand.

    Attributes:
        model: The model around which they are known.
        std: Standard deviations, shape (n,); infinite where nothing is known.
    """

    model: CalibrationModel
    std: Array

    def evaluate(self, at: Point, free: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
        """Residuals over their deviations, shape (f,), and derivatives, shape (f, f)."""
        difference = model_difference(at.model, self.model)
        slope = np.eye(len(difference))
        for begin in at.layout.pose_starts():
            turn = slice(begin, begin + 3)
            slope[turn, turn] = inverse_turn_slope(difference[turn])
        weight = 1.0 / self.std[free]
        return difference[free] * weight, slope[np.ix_(free, free)] * weight[:, None]


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """What is left of least squares once poses are eliminated, in typical sizes.

    Attributes:
        S: Information on the free parameters, shape (f, f), prior included.
        S_data: Without the prior.
        rhs: Minus the gradient, shape (f,).
        back: How poses follow parameters, shape (k, q, f).
        alone: Steps of poses while parameters stay, shape (k, q).
        H: Information on each pose, shape (k, q, q).
    """

    S: Array
    S_data: Array
    rhs: Array
    back: Array
    alone: Array
    H: Array


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """Terms, free parameters and prior of one problem.

    Attributes:
        terms: What was measured.
        free: Which parameters are unknown, shape (n,).
        prior: What is known of them.
        freedom: Which coordinates of poses are unknown.
        huber: From how many sigmas on a residual counts linearly; infinite: squares.
        dropped: Rows of terms that do not count, each shape (k, rows); or None.
    """

    terms: Sequence[Term]
    free: npt.NDArray[np.bool_]
    prior: Prior
    freedom: PoseFreedom = BODY
    huber: float = np.inf
    dropped: Sequence[npt.NDArray[np.bool_]] | None = None

    def used(self, at: Point) -> npt.NDArray[np.bool_]:
        """Which parameters, unknown or not, measurements depend on, shape (n,)."""
        slopes = [
            np.any(term.evaluate(there)[1] != 0.0, axis=(0, 1))
            for part, there in self.blocks(at)
            for term in part.terms
        ]
        return np.any(np.array(slopes), axis=0)

    def blocks(self, at: Point) -> Iterator[tuple[LeastSquares, Point]]:
        """The problem at `MOST_POSES` poses after the other, and these poses."""
        count = at.stations.count
        if count <= MOST_POSES:
            yield self, at
            return
        for begin in range(0, count, MOST_POSES):
            some = slice(begin, begin + MOST_POSES)
            terms = [term.only(some) for term in self.terms]
            gone = None if self.dropped is None else [rows[some] for rows in self.dropped]
            yield replace(self, terms=terms, dropped=gone), at.only(some)

    def station_scale(self, at: Point) -> Array:
        """Typical sizes of the unknowns of a pose that move."""
        return self.freedom.scale(at.stations.width)

    def evaluate(self, at: Point) -> tuple[Array, Array, Array]:
        """All residuals, shape (k, rows), and derivatives in typical sizes."""
        parts = [list(term.evaluate(at)) for term in self.terms]
        for part in parts:
            part[1] = part[1][:, :, self.free]
        for part, gone in zip(parts, self.dropped or (), strict=False):
            part[0] = np.where(gone, 0.0, part[0])
            part[1] = np.where(gone[:, :, None], 0.0, part[1])
            part[2] = np.where(gone[:, :, None], 0.0, part[2])
        r = np.concatenate([part[0] for part in parts], axis=1)
        A = np.concatenate([part[1] for part in parts], axis=1)
        B = self.freedom.narrow(np.concatenate([part[2] for part in parts], axis=1), at.stations.R)
        return r, A * at.layout.typical[self.free], B * self.station_scale(at)

    def cost(self, at: Point) -> float:
        """Half the sum of squares, of Huber's function and of the prior."""
        parts = [term.by_poses(at)[0] for term in self.terms]
        for k, gone in enumerate(self.dropped or ()):
            parts[k] = np.where(gone, 0.0, parts[k])
        r = np.abs(np.concatenate(parts, axis=1))
        h = self.huber
        lin = np.minimum(r, h)
        total = float(np.sum(0.5 * lin**2 + (h * (r - lin) if np.isfinite(h) else 0.0)))
        prior, _ = self.prior.evaluate(at, self.free)
        total += 0.5 * float(prior @ prior)
        return total if np.isfinite(total) else np.inf

    def _undetermined(self, pose: int, first: int) -> str:
        """That nothing determines a pose, in words; or nothing that fits.

        Args:
            pose: Number of it among these poses.
            first: Number of their first one.
        """
        where = f"pose {first + pose + 1}: what was measured there does not determine where"
        gone = sum(int(np.sum(rows[pose])) for rows in self.dropped or ())
        if not gone:
            return f"{where} the platform is; accepted: more measurements at it, or none of it"
        whole = sum(int(np.sum(term.measured()[pose])) for term in self.terms)
        return (
            f"{where} the platform is without the {gone} of {whole} readings that do "
            "not fit; accepted: readings that agree, or another start"
        )

    def normal_equations(self, at: Point, damping: float, robust: bool = True) -> NormalEquations:
        """Eliminates the poses.

        Raises:
            CalibrationError: Nothing determines a pose; names it.
        """
        parts = [
            part._of_block(there, damping, robust, k * MOST_POSES)
            for k, (part, there) in enumerate(self.blocks(at))
        ]
        S, rhs = (sum(part[i] for part in parts[1:]) + parts[0][i] for i in (0, 1))
        back, alone, H = (
            parts[0][i] if len(parts) == 1 else np.concatenate([part[i] for part in parts])
            for i in (2, 3, 4)
        )
        typical = at.layout.typical[self.free]
        prior, P = self.prior.evaluate(at, self.free)
        P = P * typical
        S = 0.5 * (S + S.T)
        return NormalEquations(S + P.T @ P, S, rhs - P.T @ prior, back, alone, H)

    def _of_block(
        self, at: Point, damping: float, robust: bool, first: int
    ) -> tuple[Array, Array, Array, Array, Array]:
        """What some poses add to S_data and rhs, and back, alone and H of them.

        Args:
            at: The model and these poses.
            damping: Of the steps.
            robust: True if residuals beyond `huber` count linearly.
            first: Number of the first of them, for messages.
        """
        r, A, B = self.evaluate(at)
        if robust and np.isfinite(self.huber):
            weight = np.sqrt(self.huber / np.maximum(np.abs(r), self.huber))
            r, A, B = r * weight, A * weight[:, :, None], B * weight[:, :, None]
        if not (np.all(np.isfinite(r)) and np.all(np.isfinite(A)) and np.all(np.isfinite(B))):
            raise CalibrationError(IMPOSSIBLE)
        Bt = np.swapaxes(B, 1, 2)
        H, C, g = Bt @ B, Bt @ A, Bt @ r[:, :, None]
        if damping == 0.0:
            spread = np.linalg.eigvalsh(H)
            bad = spread[:, 0] <= SINGULAR * spread[:, -1]
            if bad.any():
                raise CalibrationError(self._undetermined(int(np.argmax(bad)), first))
        damped = H + damping * np.eye(H.shape[1])
        solved = np.linalg.solve(damped, np.concatenate([C, g], axis=2))
        back, alone = solved[:, :, :-1], solved[:, :, -1]
        flat = A.reshape(r.size, A.shape[2])
        S = flat.T @ flat - np.einsum("kqf,kqh->fh", C, back)
        return S, -(flat.T @ r.ravel() - np.einsum("kqf,kq->f", C, alone)), back, alone, H


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where least squares ended.

    Attributes:
        at: Model and poses.
        cost: Half the sum of squares there.
        steps: Steps tried.
        settled: Whether it is a minimum within `SETTLED`.
    """

    at: Point
    cost: float
    steps: int
    settled: bool


def minimize(problem: LeastSquares, at: Point, most: int = MOST_STEPS) -> Minimum:
    """The nearest minimum, or where so many steps lead.

    Directions that cannot be told get no step, so that a gauge stays where it was.

    Raises:
        CalibrationError: The start is impossible, such as a tag that was seen behind the camera.
    """
    cost, damping = problem.cost(at), 1e-4
    if not np.isfinite(cost):
        raise CalibrationError(IMPOSSIBLE)
    typical = at.layout.typical
    for step_number in range(1, most + 1):
        try:
            equations = problem.normal_equations(at, damping)
            told = symmetric_solve(equations.S, equations.rhs, damping)
        except (LinAlgError, np.linalg.LinAlgError):
            damping *= 10.0
            continue
        theta = np.zeros(at.layout.size)
        theta[problem.free] = told * typical[problem.free]
        moved = -(equations.alone + equations.back @ told) * problem.station_scale(at)
        steps = problem.freedom.widen(moved, at.stations.R, at.stations.width)
        try:
            candidate = at.moved(theta, steps)
            new = problem.cost(candidate)
        except CableModelError:  # a radius below zero
            candidate, new = at, np.inf
        expected = 0.5 * float(told @ equations.rhs) + _alone_gain(equations)
        if new <= cost:
            at, gain, cost = candidate, cost - new, new
            if expected <= SETTLED * (1.0 + 1e-6 * cost) or gain <= 1e-14 * cost:
                return Minimum(at, cost, step_number, True)
            damping = max(damping / 10.0, SMALLEST_DAMPING)
            continue
        if expected <= SETTLED * (1.0 + 1e-6 * cost):
            return Minimum(at, cost, step_number, True)  # rounding alone makes it larger
        damping *= 10.0
        if damping > LARGEST_DAMPING:
            break
    return Minimum(at, cost, most, False)


def _alone_gain(equations: NormalEquations) -> float:
    """By how much half the squares fall if poses alone move, to second order."""
    return 0.5 * float(np.einsum("kq,kqp,kp->", equations.alone, equations.H, equations.alone))


def symmetric_solve(S: Array, rhs: Array, damping: float = 0.0) -> Array:
    """The least solution of S x = rhs in what S tells; shape (f,)."""
    if not len(rhs):
        return np.zeros(0)
    values, V = eigh(S)
    told = values > UNTOLD**2
    parts = (V.T @ rhs)[told] / (values[told] + damping)
    return np.asarray(V[:, told] @ parts)

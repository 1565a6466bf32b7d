"""What a calibration found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import (
    LeastSquares,
    Minimum,
    NormalEquations,
    symmetric_solve,
)
from cdpr_drake.calibration.identifiability import (
    Identifiability,
    frame_basis,
    identifiability,
    loose_frames,
)
from cdpr_drake.calibration.parameters import (
    CalibrationModel,
    model_difference,
    moved_frames,
    parameter_layout,
)
from cdpr_drake.calibration.stations import POSE, Point, Stations

OUTLIER = 4.0
"""A residual of more sigmas is an outlier: one of 16 thousand normal ones is."""

ARC_STEPS = 10
"""Steps by which frames are moved; each leaves a share of what is left as large as the turn."""

CONVERGED, NOT_CONVERGED = "converged", "not_converged"


class Outlier(NamedTuple):
    """A measurement that does not fit.

    Attributes:
        pose: Number of the pose, from 0.
        what: What was measured, in words.
        residual: Model less measurement, in the unit of its term.
        sigmas: That over its standard deviation.
    """

    pose: int
    what: str
    residual: float
    sigmas: float


@dataclass(frozen=True)
class Fit:
    """How well measurements of one kind fit.

    Attributes:
        count: Numbers that were measured and not dropped.
        rms: Root mean square of their residuals over sigma [-]; about 1 or below where sigmas are
            right.
        largest: Largest of them in size [-].
    """

    count: int
    rms: float
    largest: float


@dataclass(frozen=True, eq=False)
class CalibrationResult:
    """A calibrated robot, and how far it is to be trusted.

    Attributes:
        status: "converged", or "not_converged" where the steps ran out.
        model: All parameters, those that were not unknown included.
        stations: Poses and, where they were unknown, tensions.
        names: Of the unknown parameters.
        units: Their units.
        typical: By how much each is usually unknown, shape (f,).
        values: By how much each differs from the start, shape (f,).
        std: Standard deviations without the gauge, shape (f,); infinite where not told.
        covariance: Shape (f, f), zero along what is not told.
        information: Its inverse in typical sizes, shape (f, f), priors included [-].
        pose_std: Of each pose, the root of the summed variances of its turn [rad] and of its place
            [m], shape (k, 2), with those of the parameters in it; motions of frames that nothing
            tells are left out.
        residuals: Fit of each kind of measurement.
        gauge: Motions of frames that the measurements do not see, in words; the start stays there.
        loose: Motions of frames that they hardly see, in words.
        frames: Orthonormal basis of both in typical sizes, shape (f, d): `without_frames`.
        twists: Of the frames in these motions, shape (12, d), see `moved_frames`.
        prior_only: What is known from the prior alone, in words.
        outliers: Measurements that do not fit, largest first; they did not count in the end.
        chi_square: Sum of squared residuals over sigma, prior included [-].
        degrees: Degrees of freedom of it.
        steps: Steps of the solver.
        seconds: Time it took [s].
    """

    status: str
    model: CalibrationModel
    stations: Stations
    names: tuple[str, ...]
    units: tuple[str, ...]
    typical: Array
    values: Array
    std: Array
    covariance: Array
    information: Array
    pose_std: Array
    residuals: dict[str, Fit]
    gauge: tuple[str, ...]
    loose: tuple[str, ...]
    frames: Array
    twists: Array
    prior_only: tuple[str, ...]
    outliers: tuple[Outlier, ...]
    chi_square: float
    degrees: int
    steps: int
    seconds: float

    @property
    def correlation(self) -> Array:
        """Correlation of the unknown parameters, shape (f, f) [-]."""
        root = np.sqrt(np.diag(self.covariance))
        root = np.where(root > 0.0, root, np.inf)
        return np.asarray(self.covariance / np.outer(root, root))

    def without_frames(self, values: Array) -> Array:
        """Values of the unknown parameters, shape (f,), less what only moves frames.

        To first order: of small differences, such as errors.
        """
        typical = self.typical
        scaled = values / typical
        return np.asarray((scaled - self.frames @ (self.frames.T @ scaled)) * typical)

    def errors_from(self, true: CalibrationModel) -> Array:
        """Errors of the unknown parameters, shape (f,), for which the covariance holds.

        Turns of a frame carry points along arcs. Where a frame is hardly told but what is in it is,
        half a turn squared times a lever is larger than a shape's own deviation, and a straight
        difference, `model_difference`, leaves a covariance that is right. Here such frames are
        moved along their arcs, and what is left counts along coordinates. Both are the same to
        first order.

        Args:
            true: The model that it is compared with; what was not unknown is not looked at.
        """
        unknown = set(self.names)
        free = np.array([name in unknown for name in parameter_layout(self.model).names])
        along = np.zeros(self.twists.shape[1])
        for _ in range(ARC_STEPS):
            moved = moved_frames(self.model, self.twists @ along)
            rest = model_difference(moved, true)[free] / self.typical
            along = along - self.frames.T @ rest
        rest = rest - self.frames @ (self.frames.T @ rest)
        return np.asarray((rest - self.frames @ along) * self.typical)

    def spread(self) -> float:
        """Root of chi-square per degree of freedom: 1 where sigmas are right [-]."""
        return float(np.sqrt(self.chi_square / self.degrees)) if self.degrees > 0 else float("nan")


def make_result(
    problem: LeastSquares,
    found: Minimum,
    start: CalibrationModel,
    outliers: tuple[Outlier, ...],
    seconds: float,
) -> CalibrationResult:
    """All that is to be said about a minimum.

    Args:
        problem: What was solved last, with the rows that were dropped.
        found: Its minimum.
        start: The model at the start.
        outliers: What was dropped.
        seconds: Time since the start [s].
    """
    at, free = found.at, problem.free
    equations = problem.normal_equations(at, 0.0, robust=False)
    used = problem.used(at)
    open_now = identifiability(equations.S, at, free, used)
    by_data = identifiability(equations.S_data, at, free, used)
    frames, twists = frame_basis(equations.S_data, at, free, used)
    typical = at.layout.typical[free]
    count = int(np.sum(free))
    scaled = np.array([symmetric_solve(equations.S, e) for e in np.eye(count)]).reshape(count, -1)
    covariance = 0.5 * (scaled + scaled.T) * np.outer(typical, typical)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    std[_untold_share(open_now) > 1e-6] = np.inf
    fits, rows, squares = {}, 0, 0.0
    for k, term in enumerate(problem.terms):
        counts = used_rows(problem, k)
        r = term.evaluate(at)[0][counts]
        fits[term.kind] = _fit(r)
        rows, squares = rows + len(r), squares + float(r @ r)
    prior, _ = problem.prior.evaluate(at, free)
    known = int(np.sum(np.isfinite(problem.prior.std[free])))
    told = count - open_now.gauge_basis.shape[1] - open_now.untold_basis.shape[1]
    unknown = told + at.stations.count * len(problem.columns(at))
    return CalibrationResult(
        status=CONVERGED if found.settled else NOT_CONVERGED,
        model=at.model, stations=at.stations,
        names=tuple(np.array(at.layout.names)[free]), units=tuple(np.array(at.layout.units)[free]),
        typical=typical, values=model_difference(at.model, start)[free], std=std,
        covariance=covariance, information=equations.S,
        pose_std=_pose_std(problem, at, equations, scaled),
        residuals=fits, gauge=by_data.gauge,
        loose=loose_frames(equations.S_data, at, free, used),
        frames=frames, twists=twists, prior_only=by_data.untold,
        outliers=outliers,
        chi_square=squares + float(prior @ prior), degrees=rows + known - unknown,
        steps=found.steps, seconds=seconds,
    )  # fmt: skip


def _pose_std(problem: LeastSquares, at: Point, equations: NormalEquations, scaled: Array) -> Array:
    """Of turns [rad] and places [m], shape (k, 2); `scaled`: covariance in typical sizes.

    A pose follows the parameters, and is told by what was measured at it: P = H^-1 + B S^-1 B',
    the blocks of the inverse of the whole normal equations.
    """
    scale = problem.station_scale(at)
    back, columns = equations.back, problem.columns(at)
    whole = np.linalg.inv(equations.H) + back @ scaled @ np.swapaxes(back, 1, 2)
    variances = np.diagonal(whole, axis1=1, axis2=2) * scale**2
    turns = np.sum(variances[:, columns < 3], axis=1)
    places = np.sum(variances[:, (columns >= 3) & (columns < POSE)], axis=1)
    return np.sqrt(np.column_stack([turns, places]))


def used_rows(problem: LeastSquares, k: int) -> npt.NDArray[np.bool_]:
    """Which rows of a term were measured and not dropped, shape (k, rows)."""
    measured = problem.terms[k].measured()
    return measured if problem.dropped is None else measured & ~problem.dropped[k]


def find_outliers(problem: LeastSquares, found: Minimum) -> list[Outlier]:
    """Measurements that do not fit at a minimum, largest first."""
    outliers = []
    for k, term in enumerate(problem.terms):
        r, sigma = term.evaluate(found.at)[0], term.sigmas()
        for pose, row in np.argwhere(used_rows(problem, k) & (np.abs(r) > OUTLIER)):
            what = term.row_name(int(row), found.at.model.names)
            size = float(r[pose, row])
            outliers.append(Outlier(int(pose), what, size * float(sigma[pose, row]), size))
    return sorted(outliers, key=lambda one: -abs(one.sigmas))


def outlying_rows(problem: LeastSquares, found: Minimum) -> list[npt.NDArray[np.bool_]]:
    """Rows of each term that do not fit at a minimum, each shape (k, rows)."""
    return [np.abs(term.evaluate(found.at)[0]) > OUTLIER for term in problem.terms]


def _untold_share(found: Identifiability) -> Array:
    """How much of each parameter lies in what cannot be told beyond the gauge, shape (f,)."""
    return np.asarray(np.sum(found.untold_basis**2, axis=1))


def _fit(r: Array) -> Fit:
    if not len(r):
        return Fit(0, 0.0, 0.0)
    return Fit(len(r), float(np.sqrt(np.mean(r**2))), float(np.max(np.abs(r))))

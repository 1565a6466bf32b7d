"""What a calibration found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
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
from cdpr_drake.calibration.pose_search import OUTLIER, robust_costs
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.numerics.own_terms import ProgramReport

MOST_LARGEST = 10
"""Largest residuals that a result names."""

ARC_STEPS = 10
"""Steps by which frames are moved; each leaves a share of what is left as large as the turn."""

CONVERGED, NOT_CONVERGED = "converged", "not_converged"


class Outlier(NamedTuple):
    """A measurement that does not fit.

    Attributes:
        pose: Number of the pose, from 0.
        what: What was measured, in words.
        residual: Model less measurement, in the unit.
        sigmas: That over its standard deviation.
        kind: Of the measurement.
        unit: Of the residual.
    """

    pose: int
    what: str
    residual: float
    sigmas: float
    kind: str
    unit: str


@dataclass(frozen=True)
class Fit:
    """How well measurements of one kind fit.

    Attributes:
        count: Numbers that were measured and not dropped.
        rms: Root mean square of their residuals over sigma [-]; about 1 or below where sigmas are
            right.
        largest: Largest of them in size [-].
        dropped: Numbers that were measured and dropped.
    """

    count: int
    rms: float
    largest: float
    dropped: int = 0


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
        readings: How many numbers each sensor measured, by what they are in words.
        gauge: Motions of frames that the measurements do not see, in words; the start stays there.
        loose: Motions of frames that they hardly see, in words.
        frames: Orthonormal basis of both in typical sizes, shape (f, d): `without_frames`.
        twists: Of the frames in these motions, shape (12, d), see `moved_frames`.
        prior_only: What is known from the prior alone, in words.
        outliers: Measurements that do not fit, largest first; they did not count in the end.
        largest: Measurements with the largest residuals, whether they counted or not.
        robust_cost: Sum of squared residuals over sigma, prior included, in which an outlier costs
            16: what minima are compared by [-].
        chi_square: Sum of squared residuals over sigma, prior included [-].
        degrees: Degrees of freedom of it.
        steps: Steps of the solver.
        seconds: Time it took [s].
        program: With own terms, how the program was solved; None: by Gauss-Newton.
        at_bounds: Parameters that are held at a bound, by name, and by how much they changed; they
            are not among the unknown ones.
        by_row: Root mean square of residuals over sigma at each pose that counted, shape (k,), by
            kind; NaN where none did.
        surplus: By how many the numbers that counted at each pose are more than its unknown
            coordinates and tensions, shape (k,); a pose without any tells nothing of the robot.
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
    readings: dict[str, int]
    gauge: tuple[str, ...]
    loose: tuple[str, ...]
    frames: Array
    twists: Array
    prior_only: tuple[str, ...]
    outliers: tuple[Outlier, ...]
    largest: tuple[Outlier, ...]
    robust_cost: float
    chi_square: float
    degrees: int
    steps: int
    seconds: float
    program: ProgramReport | None = None
    at_bounds: Mapping[str, float] = field(default_factory=dict)
    by_row: Mapping[str, Array] = field(default_factory=dict)
    surplus: Array = field(default_factory=lambda: np.zeros(0, int))

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
    seconds: float,
) -> CalibrationResult:
    """All that is to be said about a minimum.

    Args:
        problem: What was solved last, with the rows that were dropped.
        found: Its minimum.
        start: The model at the start.
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
    scaled = np.array([symmetric_solve(equations.S, e) for e in np.eye(count)]).reshape(
        count, count
    )
    covariance = 0.5 * (scaled + scaled.T) * np.outer(typical, typical)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    std[_untold_share(open_now) > 1e-6] = np.inf
    fits, rows, squares = {}, 0, 0.0
    by_row: dict[str, Array] = {}
    readings: dict[str, int] = {}
    surplus = np.full(at.stations.count, -problem.freedom.count(at.stations.width))
    for k, term in enumerate(problem.terms):
        counts = used_rows(problem, k)
        whole = np.where(counts, term.by_poses(at)[0], np.nan)
        number = np.sum(counts, axis=1)
        surplus += number
        by_row[term.kind] = np.sqrt(np.nansum(whole**2, axis=1) / np.where(number, number, np.nan))
        r = whole[counts]
        fits[term.kind] = _fit(r, int(np.sum(term.measured() & ~counts)))
        rows, squares = rows + len(r), squares + float(r @ r)
        for row, read in enumerate(np.sum(term.measured(), axis=0)):
            readings[term.row_name(row, at.model.names)] = int(read)
    prior, _ = problem.prior.evaluate(at, free)
    known = int(np.sum(np.isfinite(problem.prior.std[free])))
    told = count - open_now.gauge_basis.shape[1] - open_now.untold_basis.shape[1]
    unknown = told + at.stations.count * problem.freedom.count(at.stations.width)
    return CalibrationResult(
        status=CONVERGED if found.settled else NOT_CONVERGED,
        model=at.model, stations=at.stations,
        names=tuple(np.array(at.layout.names)[free]), units=tuple(np.array(at.layout.units)[free]),
        typical=typical, values=model_difference(at.model, start)[free], std=std,
        covariance=covariance, information=equations.S,
        pose_std=_pose_std(problem, at, equations, scaled),
        residuals=fits, readings=readings, gauge=by_data.gauge,
        loose=loose_frames(equations.S_data, at, free, used),
        frames=frames, twists=twists, prior_only=by_data.untold,
        outliers=() if problem.dropped is None else tuple(find_outliers(problem, at)),
        largest=tuple(find_outliers(problem, at, 0.0, MOST_LARGEST)),
        robust_cost=robust_cost(problem, at),
        chi_square=squares + float(prior @ prior), degrees=rows + known - unknown,
        steps=found.steps, seconds=seconds, by_row=by_row, surplus=surplus,
    )  # fmt: skip


def _pose_std(problem: LeastSquares, at: Point, equations: NormalEquations, scaled: Array) -> Array:
    """Of turns [rad] and places [m], shape (k, 2); `scaled`: covariance in typical sizes.

    A pose follows the parameters, and is told by what was measured at it: P = H^-1 + B S^-1 B',
    the blocks of the inverse of the whole normal equations.
    """
    scale = problem.station_scale(at)
    back, motion = equations.back, problem.freedom.motion
    whole = np.linalg.inv(equations.H) + back @ scaled @ np.swapaxes(back, 1, 2)
    variances = np.diagonal(whole, axis1=1, axis2=2) * scale**2
    turns = np.sum(variances[:, : motion.num_turns], axis=1)
    places = np.sum(variances[:, motion.num_turns : motion.freedom], axis=1)
    return np.sqrt(np.column_stack([turns, places]))


def used_rows(problem: LeastSquares, k: int) -> npt.NDArray[np.bool_]:
    """Which rows of a term were measured and not dropped, shape (k, rows)."""
    measured = problem.terms[k].measured()
    return measured if problem.dropped is None else measured & ~problem.dropped[k]


def find_outliers(
    problem: LeastSquares, at: Point, least: float = OUTLIER, most: int | None = None
) -> list[Outlier]:
    """Measurements with residuals of more than so many sigmas, dropped ones too; largest first, and
    so many at most."""
    places: list[tuple[int, int, int]] = []
    sizes: list[Array] = [np.zeros(0)]
    for k, term in enumerate(problem.terms):
        r = term.by_poses(at)[0]
        rows = np.argwhere(term.measured() & (np.abs(r) > least))
        places += [(k, int(pose), int(row)) for pose, row in rows]
        sizes.append(r[tuple(rows.T)])
    r = np.concatenate(sizes)
    outliers = []
    for n in np.argsort(-np.abs(r), kind="stable")[:most]:
        (k, pose, row), size = places[n], float(r[n])
        term = problem.terms[k]
        outliers.append(
            Outlier(
                pose, term.row_name(row, at.model.names), size * float(term.sigmas()[pose, row]),
                size, term.kind, term.row_unit(row),
            )
        )  # fmt: skip
    return outliers


def outlying_rows(problem: LeastSquares, at: Point) -> list[npt.NDArray[np.bool_]]:
    """Rows of each term that do not fit, each shape (k, rows)."""
    return [np.abs(term.by_poses(at)[0]) > OUTLIER for term in problem.terms]


def robust_cost(problem: LeastSquares, at: Point) -> float:
    """Squares over sigma of measurements and prior, 16 for each outlier, dropped or not."""
    prior, _ = problem.prior.evaluate(at, problem.free)
    return float(np.sum(robust_costs(problem.terms, at)) + prior @ prior)


def _untold_share(found: Identifiability) -> Array:
    """How much of each parameter lies in what cannot be told beyond the gauge, shape (f,)."""
    return np.asarray(np.sum(found.untold_basis**2, axis=1))


def _fit(r: Array, dropped: int) -> Fit:
    if not len(r):
        return Fit(0, 0.0, 0.0, dropped)
    return Fit(len(r), float(np.sqrt(np.mean(r**2))), float(np.max(np.abs(r))), dropped)

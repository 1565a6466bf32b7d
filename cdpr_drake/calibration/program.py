"""A calibration as a program that grows by what was measured, as Drake's InverseKinematics does."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.bounded_search import solve_within
from cdpr_drake.calibration.elimination import LeastSquares, Minimum, Prior, minimize
from cdpr_drake.calibration.identifiability import Identifiability, identifiability
from cdpr_drake.calibration.parameters import CalibrationModel, parameter_layout
from cdpr_drake.calibration.pose_freedom import PoseFreedom
from cdpr_drake.calibration.pose_search import HUBER
from cdpr_drake.calibration.result import CalibrationResult, make_result, outlying_rows, robust_cost
from cdpr_drake.calibration.sensor_terms import (
    Course,
    TagCorners,
    Tilts,
    TrackedPoints,
    TrackedPoses,
)
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.calibration.terms import Lengths, Rest, Swivels, Tensions, Term, ZeroedCables
from cdpr_drake.calibration.whole_program import WholeProgram
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.motion_type import FREE, MotionType
from cdpr_drake.vision.mark_reading import read_corners
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.winches.drum import Drum

AnyTerm = TypeVar("AnyTerm", bound=Term)

NO_WORSE = 1e-6
"""Share of a cost by which rounding may make an end worse than its start."""

MOST_ROUNDS = 10
"""Times that outliers are dropped and the rest is solved again."""

BY_LIKELIHOOD = (
    "standard deviations, covariance and chi-square are those of measurements and priors alone; "
    "own terms are not in them"
)
WITHOUT_LOSS = "the loss for outliers is not in the program: those beyond four sigmas are dropped"


class CalibrationProgram(WholeProgram):
    """Finds unknown constants of a robot from what was measured at some poses.

    The poses themselves are unknown, too. `Add...` methods add measurements and priors, and refuse
    shapes and sigmas that are not accepted by a `CalibrationError`; `Solve` finds the most likely
    parameters by Gauss-Newton with the poses eliminated, since general solvers of `prog()` do not
    know that poses meet in the parameters alone.

    `prog()` is the same problem as a MathematicalProgram, with variables by name, once everything
    measured was added. `AddQuadraticCost`, `AddCost`, `AddLinearConstraint` and `AddConstraint` add
    terms of one's own to it. They are of `values`: by how much unknown parameters differ from the
    model that is believed, in their units, as `CalibrationResult.values`. A cost counts beside half
    the sum of squared residuals over sigma, so that 0.5 ((v - a) / s)^2 says as much as a
    measurement of a with the standard deviation s. With own terms Drake solves the whole program,
    from the minimum without them.

    Attributes:
        model: The robot as it is believed.
        layout: Its parameters.
        free: Which of them are unknown, shape (n,).
        stations: The poses from which the search starts.
    """

    def __init__(
        self,
        model: CalibrationModel,
        poses: Sequence[RigidTransform],
        unknown: Sequence[str],
        motion: MotionType = FREE,
    ) -> None:
        """With guesses of the poses X_WP.

        Args:
            model: The robot as it is believed.
            poses: Where the platform is believed to have been [m].
            unknown: Groups and names of parameters, as `ParameterLayout.select` takes them.
            motion: The platform's motion type.

        Raises:
            CalibrationError: No poses, or no such parameter.
        """
        if not poses:
            raise CalibrationError("poses: found none; accepted: at least one")
        self.model, self.layout = model, parameter_layout(model)
        self.free = self.layout.select(unknown)
        self.stations = Stations.at(poses)
        self.terms: list[Term] = []
        super().__init__(PoseFreedom(motion))

    def AddLengths(
        self,
        readings: Array,
        sigma: float | Array,
        start: Array | None = None,
        strain: Array | None = None,
    ) -> Lengths:
        """Lengths that winches counted.

        Args:
            readings: Shape (k, m) [m]; NaN where there is none.
            sigma: Their standard deviation, or one for each [m].
            start: Readings from which winches count, shape (m,) [m]; None: the first of each.
            strain: By how much cables are longer than counted, shape (k, m) [-]; None: not.
        """
        readings = self._table("lengths", readings)
        start = first_readings(readings) if start is None else start
        strain = np.zeros(readings.shape) if strain is None else np.asarray(strain, float)
        return self._added(Lengths(readings, _sigmas("lengths", sigma, readings), start, strain))

    def AddZeroedCables(
        self,
        readings: Array,
        sigma: float | Array,
        zero: RigidTransform | None,
        drum: Drum | None = None,
        *,
        strain: Array | None = None,
        advantage: Array | float = 1.0,
    ) -> ZeroedCables:
        """Lengths, or motor angles, of winches that stood at zero at a known pose or somewhere.

        Args:
            readings: Shape (k, m), lengths [m] or, with a drum, angles [rad]; NaN: none.
            sigma: Standard deviation of the lengths, or one for each [m].
            zero: The pose X_WP at zero [m]; None: `length_offsets` are whole lengths at zero.
            drum: The drums as they are believed; None: readings are lengths.
            strain: By how much cables are longer than counted, shape (k, m) [-]; None: not.
            advantage: Parts of line side by side, shape (m,) [-].
        """
        readings = self._table("lengths", readings)
        sigmas, blank = _sigmas("lengths", sigma, readings), np.zeros(readings.shape)
        return self._added(
            ZeroedCables(
                readings, sigmas, zero, drum, blank if strain is None else strain, blank, advantage
            )
        )

    def AddTrackedPoints(
        self,
        points: Array,
        sigma: float,
        *,
        normal: Array | None = None,
        sigma_along: float | None = None,
        times: Array | None = None,
    ) -> TrackedPoints:
        """Positions that a tracker measured without rotations.

        Args:
            points: Of a marker, in the tracker's frame, shape (k, 3) [m]; NaN: none.
            sigma: Standard deviation of a coordinate [m].
            normal: Direction in W in which it is another, shape (3,); None: in none.
            sigma_along: That one [m].
            times: Of the poses, growing, shape (k,) [s]: the tracker's clock may be another.
        """
        points = self._table("tracked positions", points, 3)
        along = sigma if sigma_along is None else sigma_along
        course = None if times is None else Course.of(np.asarray(times, float), points)
        axis = np.zeros(3) if normal is None else np.asarray(normal, float)
        return self._added(TrackedPoints(points, sigma, axis, along, course), sigma, along)

    def AddTrackedPoses(
        self, poses: Sequence[RigidTransform | None], sigma_turn: float, sigma_place: float
    ) -> TrackedPoses:
        """Poses that a tracker measured, None where it did not, with sigmas [rad, m].

        They are X_KM, of a marker in the tracker's frame; X_WP where the model has neither.
        """
        if len(poses) != self.stations.count:
            raise CalibrationError(
                f"tracked poses: found {len(poses)}; accepted: {self.stations.count}"
            )
        R = np.array(
            [np.full((3, 3), np.nan) if X is None else X.rotation().matrix() for X in poses]
        )
        p = np.array([np.full(3, np.nan) if X is None else X.translation() for X in poses])
        return self._added(TrackedPoses(R, p, sigma_turn, sigma_place), sigma_turn, sigma_place)

    def AddTagCorners(
        self, points: dict[int, Array], uv: Array, sigma: float, pinhole: Pinhole
    ) -> TagCorners:
        """Images of tags in the camera on the platform.

        Args:
            points: Corners of each tag in its frame, shape (3, 4) [m], by its number.
            uv: Their images, shape (k, tags, 4, 2) [px]; NaN where a corner was not seen.
            sigma: Standard deviation of a coordinate [px].
            pinhole: The camera; what its lens distorts is read first.
        """
        unknown = [tag for tag in points if tag not in self.model.tags]
        if unknown:
            raise CalibrationError(f"tags: found {unknown}; accepted: {list(self.model.tags)}")
        wanted = (self.stations.count, len(points), 4, 2)
        if np.shape(uv) != wanted:
            raise CalibrationError(f"uv: found shape {np.shape(uv)}; accepted: {wanted}")
        corners, read = np.array(list(points.values())), read_corners(np.asarray(uv), pinhole)
        return self._added(TagCorners(tuple(points), corners, read, sigma, pinhole.ideal), sigma)

    def AddSwivels(self, readings: Array, sigma: float) -> Swivels:
        """Angles of pulleys about their swivel axes, shape (k, m) [rad]; NaN: none."""
        return self._added(Swivels(self._table("swivel angles", readings), sigma), sigma)

    def AddTilts(self, angles: Array, sigma_tilt: float, sigma_yaw: float) -> Tilts:
        """Roll, pitch and yaw by an inclinometer or IMU, shape (k, 3) [rad]; NaN: none.

        The rotation of P in W is Rz(yaw) Ry(pitch) Rx(roll); sigmas of roll and pitch, and of yaw.
        """
        angles = self._table("inclination", angles, 3)
        return self._added(Tilts(angles, sigma_tilt, sigma_yaw), sigma_tilt, sigma_yaw)

    def AddRest(
        self,
        weight: Array,
        p_PPcm: Array,
        sigma_moment: float,
        sigma_force: float,
        tensions: Array,
    ) -> Rest:
        """The platform rests at all poses; tensions become unknowns.

        Args:
            weight: Mass times gravity, in W, shape (3,) [N].
            p_PPcm: Centre of mass, shape (3,) [m].
            sigma_moment: What moments may miss: friction, cables' weight [N m].
            sigma_force: What forces may miss [N].
            tensions: Guess of the tensions, shape (k, m) [N].
        """
        guess, motion = self._table("tensions", tensions), self._freedom.motion
        whole = motion.is_free or motion.is_horizontal_body
        term = Rest(
            self.stations.count, np.asarray(weight, float), np.asarray(p_PPcm, float),
            sigma_moment, sigma_force, None if whole else motion,
        )  # fmt: skip
        self._added(term, sigma_moment, sigma_force)
        self.stations = replace(self.stations, tensions=guess)
        return term

    def AddTensions(self, readings: Array, sigma: float | Array) -> Tensions:
        """Tensions that sensors measured, shape (k, m) [N], after `AddRest`; NaN: none."""
        if self.stations.tensions is None:
            raise CalibrationError("tensions: found no equilibrium that needs them; AddRest first")
        readings = self._table("tensions", readings)
        return self._added(Tensions(readings, _sigmas("tensions", sigma, readings)))

    def AddPrior(self, patterns: Sequence[str], std: float) -> None:
        """Parameters are known up to a standard deviation, each in its unit."""
        self._still_grows("AddPrior")
        _positive("prior", std)
        self._std[self.layout.select(patterns)] = std

    def AddBound(self, patterns: Sequence[str], most: float) -> None:
        """Parameters change by no more than this, each in its unit; `prog()` has bounds, too."""
        self._still_grows("AddBound")
        _positive("bound", most)
        self._largest[self.layout.select(patterns)] = most

    def FindIdentifiability(self) -> Identifiability:
        """What these measurements and priors can tell, at the start."""
        return _told(self.least_squares(), self.at())

    def Approach(self, steps: int, start: Point | None = None) -> Minimum:
        """Where some steps with linear loss for outliers lead: to tell starts apart cheaply.

        Args:
            steps: Steps at most.
            start: Model and poses from which they go; None: as the program has them.

        Raises:
            CalibrationError: The start is impossible.
        """
        return minimize(self.least_squares(HUBER), self.at() if start is None else start, steps)

    def Solve(
        self, outliers: bool = True, start: Point | None = None, *, straight: bool = False
    ) -> CalibrationResult:
        """The most likely parameters and poses.

        With outliers, residuals beyond three sigmas count linearly at first; then those beyond four
        are dropped, until no others are. Where that ends worse than it began, by a cost in which
        a measurement counts its square over sigma, or 16 as an outlier, those beyond four are
        dropped from the start on, which lowers that cost in every step.

        Args:
            outliers: Whether outliers are sought.
            start: Model and poses where the search begins; None: as the program has them.
            straight: Whether outliers are dropped from there on, without linear loss before.

        Raises:
            CalibrationError: A parameter cannot be told and has no prior: names which from which;
                a pose is not determined; the start is impossible; or the end is worse.
        """
        at = self.at() if start is None else start
        if np.isinf(self._largest[self.free]).all() or self.has_own_terms:
            return self._solve(self.free, at, outliers, straight)[0]
        found, held = solve_within(
            lambda free, begin: self._solve(free, begin, outliers, straight),
            self.free, self._largest, at, self.model,
        )  # fmt: skip
        return replace(found, at_bounds={self.layout.names[k]: v for k, v in held.items()})

    def SolvedProblem(self, result: CalibrationResult, outliers: bool = True) -> LeastSquares:
        """The problem of which a result is the minimum, without what it dropped.

        Args:
            result: Of `Solve`; parameters that it holds at bounds are not unknown in it.
            outliers: Whether outliers were sought.
        """
        unknown = set(result.names)
        free = np.array([name in unknown for name in self.layout.names])
        at = Point(result.model, result.stations, self.layout)
        problem = replace(self.least_squares(), free=free)
        return replace(problem, dropped=outlying_rows(problem, at)) if outliers else problem

    def _solve(
        self, free: npt.NDArray[np.bool_], at: Point, outliers: bool, straight: bool
    ) -> tuple[CalibrationResult, LeastSquares]:
        """As `Solve`, for some of the parameters and without bounds; and the last problem."""
        began = time.perf_counter()
        plain = replace(self.least_squares(), free=free)
        self._require_told(_told(plain, self.at()))
        problem, found = self._by_gauss_newton(plain, at, outliers, straight)
        if self.has_own_terms:
            return self._with_own_terms(problem, found, outliers, began), problem
        return make_result(problem, found, self.model, time.perf_counter() - began), problem

    def _by_gauss_newton(
        self, plain: LeastSquares, at: Point, outliers: bool, straight: bool
    ) -> tuple[LeastSquares, Minimum]:
        """What was solved last, and its minimum, as `Solve` without own terms and bounds."""
        if not outliers:
            return plain, minimize(plain, at)
        before, steps = robust_cost(plain, at), 0
        if not straight:
            bent = minimize(replace(plain, huber=HUBER), at)
            problem, found = _dropping(plain, bent.at)
            steps = bent.steps + found.steps
        if straight or robust_cost(plain, found.at) > before * (1.0 + NO_WORSE):
            problem, found = _dropping(plain, at)
            steps += found.steps
        after = robust_cost(plain, found.at)
        if not after <= before * (1.0 + NO_WORSE) + NO_WORSE:
            raise CalibrationError(
                f"search: found an end with cost {after:.6g} after a start with {before:.6g}; "
                "accepted: one that is no worse, so from another first pose or with other sigmas"
            )
        return problem, replace(found, steps=steps)

    def _with_own_terms(
        self, problem: LeastSquares, found: Minimum, outliers: bool, began: float
    ) -> CalibrationResult:
        """The minimum of the whole program, from one without own terms."""
        steps, start = found.steps, self.at()
        for _ in range(MOST_ROUNDS):
            self._leave_out(problem)
            x, solver, said = self._solve_whole(
                self._steps_to(found.at), "a robot that the measurements fit"
            )
            at = self._point(x, start)
            found, steps = Minimum(at, problem.cost(at), 1, True), steps + 1
            gone = outlying_rows(problem, at) if outliers else None
            if gone is None or problem.dropped is None or all(
                np.array_equal(a, b) for a, b in zip(gone, problem.dropped, strict=True)
            ):  # fmt: skip
                break
            problem = replace(problem, dropped=gone)
        lost = (BY_LIKELIHOOD, WITHOUT_LOSS) if outliers else (BY_LIKELIHOOD,)
        report = self._report(x, solver, said, lost)
        end = replace(found, steps=steps)
        result = make_result(problem, end, self.model, time.perf_counter() - began)
        return replace(result, program=report, at_bounds=self._bounds_met(found.at))

    def _require_told(self, found: Identifiability) -> None:
        if found.untold:
            more = f" (and {len(found.untold) - 2} more such)" if len(found.untold) > 2 else ""
            raise CalibrationError(
                f"unknown: {'; '.join(found.untold[:2])}{more}; accepted: fewer unknowns, a prior "
                "for them, or measurements at other poses"
            )

    def at(self, stations: Stations | None = None) -> Point:
        """The start, or the believed model at other poses."""
        return Point(self.model, self.stations if stations is None else stations, self.layout)

    def least_squares(self, huber: float = np.inf) -> LeastSquares:
        """The problem as it is now.

        Raises:
            CalibrationError: Nothing was measured.
        """
        if not any(term.measured().any() for term in self.terms):
            raise CalibrationError("measurements: found none; accepted: at least one")
        prior = Prior(self.model, self._std)
        return LeastSquares(tuple(self.terms), self.free, prior, self._freedom, huber)

    def _added(self, term: AnyTerm, *sigmas: float) -> AnyTerm:
        """A term with these standard deviations, which is in the program from here on."""
        self._still_grows(f"Add{type(term).__name__}")
        _positive(term.kind, *sigmas)
        self.terms.append(term)
        return term

    def _still_grows(self, what: str) -> None:
        """Measurements and priors are in the program from its beginning."""
        if self._prog is not None:
            raise CalibrationError(
                f"{what}: found a program that was already made for own terms; accepted: "
                "measurements and priors first"
            )

    def _table(self, what: str, values: Array, columns: int | None = None) -> Array:
        values = np.asarray(values, float)
        wanted = (self.stations.count, columns or self.model.cables.count)
        if values.shape != wanted:
            raise CalibrationError(f"{what}: found shape {values.shape}; accepted: {wanted}")
        return values


def first_readings(readings: Array) -> Array:
    """The first reading of each cable that is there, shape (m,) [m]; zero where there is none."""
    seen = np.isfinite(readings)
    first = np.argmax(seen, axis=0)
    values = readings[first, np.arange(readings.shape[1])]
    return np.where(seen.any(axis=0), values, 0.0)


def _sigmas(what: str, sigma: float | Array, like: Array) -> Array:
    values = np.broadcast_to(np.asarray(sigma, float), like.shape).copy()
    _positive(what, *values[np.isfinite(like)].tolist())
    return values


def _positive(what: str, *sigmas: float) -> None:
    bad = [s for s in sigmas if not (np.isfinite(s) and s > 0.0)]
    if bad:
        raise CalibrationError(f"{what}: sigma: found {bad[0]:g}; accepted: a finite number > 0")


def _told(problem: LeastSquares, at: Point) -> Identifiability:
    S = problem.normal_equations(at, 0.0).S
    return identifiability(S, at, problem.free, problem.used(at))


def _dropping(problem: LeastSquares, at: Point) -> tuple[LeastSquares, Minimum]:
    """The minimum without outliers of its own, and the problem without them."""
    steps, gone = 0, outlying_rows(problem, at)
    for _ in range(MOST_ROUNDS):
        problem = replace(problem, dropped=gone)
        found = minimize(problem, at)
        at, steps, now = found.at, steps + found.steps, outlying_rows(problem, found.at)
        if all(np.array_equal(a, b) for a, b in zip(now, gone, strict=True)):
            break
        gone = now
    return problem, replace(found, steps=steps)

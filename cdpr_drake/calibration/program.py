"""A calibration as a program that grows by what was measured, as Drake's InverseKinematics does."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform
from pydrake.solvers import MathematicalProgram
from pydrake.symbolic import Variable

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.bounded_search import solve_within
from cdpr_drake.calibration.elimination import LeastSquares, Minimum, Prior, minimize
from cdpr_drake.calibration.identifiability import Identifiability, identifiability
from cdpr_drake.calibration.parameters import CalibrationModel, model_difference, parameter_layout
from cdpr_drake.calibration.pose_freedom import PoseFreedom
from cdpr_drake.calibration.pose_search import HUBER
from cdpr_drake.calibration.program_costs import PriorCost, StationCost
from cdpr_drake.calibration.result import CalibrationResult, make_result, outlying_rows, robust_cost
from cdpr_drake.calibration.sensor_terms import (
    Course,
    TagCorners,
    Tilts,
    TrackedPoints,
    TrackedPoses,
)
from cdpr_drake.calibration.stations import Point, Stations, turn_vectors
from cdpr_drake.calibration.terms import (
    EquilibriumTerm,
    Lengths,
    Swivels,
    Tensions,
    Term,
    ZeroedCables,
)
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.motion_type import FREE, LEVEL, MotionType
from cdpr_drake.numerics.own_terms import OwnTerms, ProgramValues
from cdpr_drake.vision.mark_reading import read_corners
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.winches.drum import Drum

NO_WORSE = 1e-6
"""Share of a cost by which rounding may make an end worse than its start."""

AT_BOUND = 1e-4
"""Share of a bound within which a parameter is told to be at it, where interior points stop."""

MOST_ROUNDS = 10
"""Times that outliers are dropped and the rest is solved again."""

BY_LIKELIHOOD = (
    "standard deviations, covariance and chi-square are those of measurements and priors alone; "
    "own terms are not in them"
)
WITHOUT_LOSS = "the loss for outliers is not in the program: those beyond four sigmas are dropped"


class CalibrationProgram(OwnTerms):
    """Finds unknown constants of a robot from what was measured at some poses.

    The poses themselves are unknown, too. `Add...` methods add measurements and priors; `Solve`
    finds the most likely parameters by Gauss-Newton with the poses eliminated, since general
    solvers of `prog()` do not know that poses meet in the parameters alone.

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

    problem_kind = CalibrationError

    def __init__(
        self,
        model: CalibrationModel,
        poses: Sequence[RigidTransform],
        unknown: Sequence[str],
        planar: bool = False,
        motion: MotionType | None = None,
    ) -> None:
        """With guesses of the poses X_WP.

        Args:
            model: The robot as it is believed.
            poses: Where the platform is believed to have been [m].
            unknown: Groups and names of parameters, as `ParameterLayout.select` takes them.
            planar: Whether the platform slides in a horizontal plane.
            motion: In the place of it: the platform's motion type; None: a body in space, or as
                `planar` says.

        Raises:
            CalibrationError: No poses, or no such parameter.
        """
        if not poses:
            raise CalibrationError("poses: found none; accepted: at least one")
        self.model, self.layout = model, parameter_layout(model)
        self.free = self.layout.select(unknown)
        self.stations = Stations.at(poses)
        self.terms: list[Term] = []
        self._freedom = PoseFreedom(motion or (LEVEL if planar else FREE))
        self._std = np.full(self.layout.size, np.inf)
        self._prog: MathematicalProgram | None = None
        self._theta = np.empty(0, object)
        self._own_poses: list[npt.NDArray[np.object_]] = []
        self._costs: list[StationCost] = []
        self._largest = np.full(self.layout.size, np.inf)

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

        Raises:
            CalibrationError: A shape or sigma is not accepted.
        """
        self._still_grows("AddLengths")
        readings = self._table("lengths", readings)
        if start is None:
            start = first_readings(readings)
        strain = np.zeros(readings.shape) if strain is None else np.asarray(strain, float)
        term = Lengths(readings, _sigmas("lengths", sigma, readings), start, strain)
        self.terms.append(term)
        return term

    def AddZeroedCables(
        self,
        readings: Array,
        sigma: float | Array,
        zero: RigidTransform | None,
        drum: Drum | None = None,
        **more: Array | None,
    ) -> ZeroedCables:
        """Lengths, or motor angles, of winches that stood at zero at a known pose or somewhere.

        Args:
            readings: Shape (k, m), lengths [m] or, with a drum, angles [rad]; NaN: none.
            sigma: Standard deviation of the lengths, or one for each [m].
            zero: The pose X_WP at zero [m]; None: `length_offsets` are whole lengths at zero.
            drum: The drums as they are believed; None: readings are lengths.
            more: `strain`, by how much cables are longer than counted, shape (k, m) [-];
                `advantage`, parts of line side by side, shape (m,) [-]; None or missing: 0, 1.

        Raises:
            CalibrationError: A shape or sigma is not accepted.
        """
        self._still_grows("AddZeroedCables")
        readings = self._table("lengths", readings)
        strain, advantage = more.get("strain"), more.get("advantage")
        blank = np.zeros(readings.shape)
        term = ZeroedCables(
            readings, _sigmas("lengths", sigma, readings), zero, drum,
            blank if strain is None else strain, blank, 1.0 if advantage is None else advantage,
        )  # fmt: skip
        self.terms.append(term)
        return term

    def AddTrackedPoints(
        self,
        points: Array,
        sigma: float,
        *,
        normal: Array | None = None,
        sigma_along: float | None = None,
        times: Array | None = None,
    ) -> TrackedPoints:
        """Positions that a tracker measured without rotations, shape (k, 3) [m]; NaN: none.

        Args:
            points: Of a marker, in the tracker's frame.
            sigma: Standard deviation of a coordinate [m].
            normal: Direction in W in which it is another, shape (3,); None: in none.
            sigma_along: That one [m].
            times: Of the poses, growing, shape (k,) [s]: the tracker's clock may be another.

        Raises:
            CalibrationError: A shape or sigma is not accepted.
        """
        self._still_grows("AddTrackedPoints")
        points = np.asarray(points, float)
        if points.shape != (self.stations.count, 3):
            raise CalibrationError(
                f"tracked positions: found shape {points.shape}; accepted: "
                f"({self.stations.count}, 3)"
            )
        along = sigma if sigma_along is None else sigma_along
        _positive("tracked positions", sigma, along)
        course = None if times is None else Course.of(np.asarray(times, float), points)
        axis = np.zeros(3) if normal is None else np.asarray(normal, float)
        term = TrackedPoints(points, sigma, axis, along, course)
        self.terms.append(term)
        return term

    def AddTrackedPoses(
        self, poses: Sequence[RigidTransform | None], sigma_turn: float, sigma_place: float
    ) -> TrackedPoses:
        """Poses that a tracker measured, None where it did not, with sigmas [rad, m].

        They are X_KM, of a marker in the tracker's frame; X_WP where the model has neither.
        """
        self._still_grows("AddTrackedPoses")
        self._count("tracked poses", len(poses))
        R = np.array(
            [np.full((3, 3), np.nan) if X is None else X.rotation().matrix() for X in poses]
        )
        p = np.array([np.full(3, np.nan) if X is None else X.translation() for X in poses])
        _positive("tracked poses", sigma_turn, sigma_place)
        term = TrackedPoses(R, p, sigma_turn, sigma_place)
        self.terms.append(term)
        return term

    def AddTagCorners(
        self, points: dict[int, Array], uv: Array, sigma: float, pinhole: Pinhole
    ) -> TagCorners:
        """Images of tags in the camera on the platform.

        Args:
            points: Corners of each tag in its frame, shape (3, 4) [m], by its number.
            uv: Their images, shape (k, tags, 4, 2) [px]; NaN where a corner was not seen.
            sigma: Standard deviation of a coordinate [px].
            pinhole: The camera; what its lens distorts is read first.

        Raises:
            CalibrationError: A tag is not in the model, or a shape or sigma is not accepted.
        """
        self._still_grows("AddTagCorners")
        unknown = [tag for tag in points if tag not in self.model.tags]
        if unknown:
            raise CalibrationError(f"tags: found {unknown}; accepted: {list(self.model.tags)}")
        wanted = (self.stations.count, len(points), 4, 2)
        if np.shape(uv) != wanted:
            raise CalibrationError(f"uv: found shape {np.shape(uv)}; accepted: {wanted}")
        _positive("tag corners", sigma)
        corners = np.array(list(points.values()))
        read = read_corners(np.asarray(uv, float), pinhole)
        term = TagCorners(tuple(points), corners, read, sigma, pinhole.ideal)
        self.terms.append(term)
        return term

    def AddSwivels(self, readings: Array, sigma: float) -> Swivels:
        """Angles of pulleys about their swivel axes, shape (k, m) [rad]; NaN: none."""
        self._still_grows("AddSwivels")
        _positive("swivel angles", sigma)
        term = Swivels(self._table("swivel angles", readings), sigma)
        self.terms.append(term)
        return term

    def AddTilts(self, angles: Array, sigma_tilt: float, sigma_yaw: float) -> Tilts:
        """Roll, pitch and yaw by an inclinometer or IMU, shape (k, 3) [rad]; NaN: none.

        The rotation of P in W is Rz(yaw) Ry(pitch) Rx(roll); sigmas of roll and pitch, and of yaw.
        """
        self._still_grows("AddTilts")
        _positive("inclination", sigma_tilt, sigma_yaw)
        if np.shape(angles) != (self.stations.count, 3):
            raise CalibrationError(
                f"inclination: found shape {np.shape(angles)}; accepted: ({self.stations.count}, 3)"
            )
        term = Tilts(np.asarray(angles, float), sigma_tilt, sigma_yaw)
        self.terms.append(term)
        return term

    def AddRest(
        self,
        weight: Array,
        p_PPcm: Array,
        sigma_moment: float,
        sigma_force: float,
        tensions: Array,
    ) -> EquilibriumTerm:
        """The platform rests at all poses; tensions become unknowns.

        Args:
            weight: Mass times gravity, in W, shape (3,) [N].
            p_PPcm: Centre of mass, shape (3,) [m].
            sigma_moment: What moments may miss: friction, cables' weight [N m].
            sigma_force: What forces may miss [N].
            tensions: Guess of the tensions, shape (k, m) [N].

        Raises:
            CalibrationError: A shape or sigma is not accepted.
        """
        self._still_grows("AddRest")
        _positive("equilibrium", sigma_moment, sigma_force)
        guess = self._table("tensions", tensions)
        self.stations = replace(self.stations, tensions=guess)
        known = (
            self.stations.count, np.asarray(weight, float), np.asarray(p_PPcm, float),
            sigma_moment, sigma_force,
        )  # fmt: skip
        motion = self._freedom.motion
        whole = motion.is_free or motion.is_horizontal_body
        term = EquilibriumTerm(*known, None if whole else motion)
        self.terms.append(term)
        return term

    def AddTensions(self, readings: Array, sigma: float | Array) -> Tensions:
        """Tensions that sensors measured, shape (k, m) [N], after `AddRest`; NaN: none."""
        self._still_grows("AddTensions")
        if self.stations.tensions is None:
            raise CalibrationError("tensions: found no equilibrium that needs them; AddRest first")
        readings = self._table("tensions", readings)
        term = Tensions(readings, _sigmas("tensions", sigma, readings))
        self.terms.append(term)
        return term

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

    def _bounds_met(self, at: Point) -> dict[str, float]:
        """Parameters at their bounds, by name, and by how much they changed."""
        step = model_difference(at.model, self.model)
        met = self.free & (np.abs(step) >= (1.0 - AT_BOUND) * self._largest)
        return {self.layout.names[k]: float(step[k]) for k in np.flatnonzero(met)}

    def _leave_out(self, problem: LeastSquares) -> None:
        """Drops in the program what is dropped in a problem."""
        for k, cost in enumerate(self._costs):
            cost.drop(problem.dropped, k)

    def _steps_to(self, at: Point) -> Array:
        """The program's variables at a point."""
        problem, start, program = self.least_squares(), self.at(), self.prog()
        step = model_difference(at.model, start.model) / start.layout.typical
        x = np.zeros(program.num_vars())
        x[program.FindDecisionVariableIndices(self._theta)] = step[self.free]
        R = at.stations.R @ np.swapaxes(start.stations.R, 1, 2)
        steps = [turn_vectors(R), at.stations.p - start.stations.p]
        if at.stations.tensions is not None and start.stations.tensions is not None:
            steps.append(at.stations.tensions - start.stations.tensions)
        own_steps = problem.freedom.coordinates(np.hstack(steps), start.stations.R)
        rows = own_steps / problem.station_scale(start)
        for own, row in zip(self._own_poses, rows, strict=True):
            x[program.FindDecisionVariableIndices(own)] = row
        return x

    def _point(self, x: Array, start: Point) -> Point:
        """The model and poses of the program's variables."""
        problem, program = self.least_squares(), self.prog()
        step = np.zeros(start.layout.size)
        theta = x[program.FindDecisionVariableIndices(self._theta)]
        step[self.free] = theta * start.layout.typical[self.free]
        rows = np.array([x[program.FindDecisionVariableIndices(own)] for own in self._own_poses])
        rows = rows * problem.station_scale(start)
        steps = problem.freedom.widen(rows, start.stations.R, start.stations.width)
        return start.moved(step, steps)

    def prog(self) -> MathematicalProgram:
        """The same problem for Drake's solvers, without loss for outliers; one object.

        Variables are steps from the start: one for each unknown parameter, by its name, in its
        typical size, and for each pose k turn0_k.., place0_k.., in hundredths of a radian and of a
        metre, and its tensions in newtons. Gradients are analytic. Measurements and priors come
        before it; what is added to it counts in `Solve`.

        Raises:
            CalibrationError: Nothing was measured, or the platform is a beam, whose turns do not
                add up to one that it has.
        """
        if self._prog is None:
            self._make()
        assert self._prog is not None
        return self._prog

    def parameters(self, of: str | Sequence[str] | None = None) -> npt.NDArray[np.object_]:
        """Variables of unknown parameters over their typical sizes, as `values` chooses them."""
        return self.values(of).variables

    def pose(self, k: int) -> npt.NDArray[np.object_]:
        """Variables of pose k, from 0: turn, place and, where they are unknown, tensions."""
        self.prog()
        if not 0 <= k < len(self._own_poses):
            raise CalibrationError(f"pose: found {k}; accepted: 0 to {len(self._own_poses) - 1}")
        return self._own_poses[k]

    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """By how much unknown parameters differ from the believed model, in their units.

        Args:
            of: Groups and names as `ParameterLayout.select` takes them, in the layout's order;
                None: all that are unknown.

        Raises:
            CalibrationError: A parameter is not there, or none of a pattern is unknown.
        """
        self.prog()
        names, typical = self.names(), self.layout.typical[self.free]
        every = ProgramValues.scaled(self._theta, typical, np.zeros(len(names)), names)
        if of is None:
            return every
        asked = [of] if isinstance(of, str) else list(of)
        for one in asked:
            if not np.any(self.layout.select([one]) & self.free):
                raise CalibrationError(
                    f"of: found {one!r}, which is not unknown; accepted: {', '.join(names[:6])} "
                    "and the other unknown ones"
                )
        return every.only(np.flatnonzero(self.layout.select(asked)[self.free]))

    def _make(self) -> None:
        if self._freedom.motion.num_turns == 2:
            raise CalibrationError("motion: found 2R3T; accepted by prog(): another, or Solve")
        problem, start = self.least_squares(), self.at()
        program = MathematicalProgram()
        self._theta = theta = _variables(self.names())
        program.AddDecisionVariables(theta)
        most = self._largest[self.free] / self.layout.typical[self.free]
        if np.isfinite(most).any():
            program.AddBoundingBoxConstraint(-most, most, theta)
        labels = problem.freedom.labels(start.stations.width)
        for k in range(start.stations.count):
            own = _variables([f"{label}_{k}" for label in labels])
            program.AddDecisionVariables(own)
            one = replace(problem, terms=tuple(t.only(slice(k, k + 1)) for t in self.terms))
            cost = StationCost(one, self.at(self.stations.only(slice(k, k + 1))))
            program.AddCost(cost, vars=np.concatenate([theta, own]))
            self._costs.append(cost)
            self._own_poses.append(own)
        if np.isfinite(self._std[self.free]).any():
            program.AddCost(PriorCost(problem, start), vars=theta)
        self._prog = program
        self._seal()

    def _require_told(self, found: Identifiability) -> None:
        if found.untold:
            more = f" (and {len(found.untold) - 2} more such)" if len(found.untold) > 2 else ""
            raise CalibrationError(
                f"unknown: {'; '.join(found.untold[:2])}{more}; accepted: fewer unknowns, a prior "
                "for them, or measurements at other poses"
            )

    def names(self) -> tuple[str, ...]:
        """Names of the unknown parameters."""
        return tuple(np.array(self.layout.names)[self.free])

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

    def _still_grows(self, what: str) -> None:
        """Measurements and priors are in the program from its beginning."""
        if self._prog is not None:
            raise CalibrationError(
                f"{what}: found a program that was already made for own terms; accepted: "
                "measurements and priors first"
            )

    def _table(self, what: str, values: Array) -> Array:
        values = np.asarray(values, float)
        wanted = (self.stations.count, self.model.cables.count)
        if values.shape != wanted:
            raise CalibrationError(f"{what}: found shape {values.shape}; accepted: {wanted}")
        return values

    def _count(self, what: str, found: int) -> None:
        if found != self.stations.count:
            raise CalibrationError(f"{what}: found {found}; accepted: {self.stations.count}")


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


def _variables(names: Sequence[str]) -> npt.NDArray[np.object_]:
    return np.array([Variable(name) for name in names], dtype=object)


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

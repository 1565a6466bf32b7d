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
from cdpr_drake.calibration.elimination import MOST_STEPS, LeastSquares, Minimum, Prior, minimize
from cdpr_drake.calibration.identifiability import Identifiability, identifiability
from cdpr_drake.calibration.onboard_terms import TagCorners, Tilts
from cdpr_drake.calibration.parameters import CalibrationModel, parameter_layout
from cdpr_drake.calibration.pose_search import HUBER
from cdpr_drake.calibration.program_costs import PriorCost, StationCost
from cdpr_drake.calibration.result import CalibrationResult, make_result, outlying_rows, robust_cost
from cdpr_drake.calibration.stations import POSE, Point, Stations
from cdpr_drake.calibration.terms import (
    EquilibriumTerm,
    Lengths,
    Swivels,
    Tensions,
    Term,
    TrackedPoses,
)
from cdpr_drake.errors import CalibrationError
from cdpr_drake.vision.mark_reading import read_corners
from cdpr_drake.vision.pinhole import Pinhole

NO_WORSE = 1e-6
"""Share of a cost by which rounding may make an end worse than its start."""

MOST_ROUNDS = 10
"""Times that outliers are dropped and the rest is solved again."""


class CalibrationProgram:
    """Finds unknown constants of a robot from what was measured at some poses.

    The poses themselves are unknown, too. `Add...` methods add measurements and priors; `Solve`
    finds the most likely parameters by Gauss-Newton with the poses eliminated, since general
    solvers of `prog()` do not know that poses meet in the parameters alone. `prog()` is the same
    problem as a MathematicalProgram, with variables by name, for constraints of one's own and for
    other solvers.

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
        planar: bool = False,
    ) -> None:
        """With guesses of the poses X_WP.

        Args:
            model: The robot as it is believed.
            poses: Where the platform is believed to have been [m].
            unknown: Groups and names of parameters, as `ParameterLayout.select` takes them.
            planar: Whether the platform slides in a plane.

        Raises:
            CalibrationError: No poses, or no such parameter.
        """
        if not poses:
            raise CalibrationError("poses: found none; accepted: at least one")
        self.model, self.layout = model, parameter_layout(model)
        self.free = self.layout.select(unknown)
        self.stations = Stations.at(poses)
        self.terms: list[Term] = []
        self._planar = planar
        self._std = np.full(self.layout.size, np.inf)

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
        readings = self._table("lengths", readings)
        if start is None:
            start = first_readings(readings)
        strain = np.zeros(readings.shape) if strain is None else np.asarray(strain, float)
        term = Lengths(readings, _sigmas("lengths", sigma, readings), start, strain)
        self.terms.append(term)
        return term

    def AddTrackedPoses(
        self, poses: Sequence[RigidTransform | None], sigma_turn: float, sigma_place: float
    ) -> TrackedPoses:
        """Poses that a tracker measured, None where it did not, with sigmas [rad, m].

        They are X_KM, of a marker in the tracker's frame; X_WP where the model has neither.
        """
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
        _positive("swivel angles", sigma)
        term = Swivels(self._table("swivel angles", readings), sigma)
        self.terms.append(term)
        return term

    def AddTilts(self, angles: Array, sigma_tilt: float, sigma_yaw: float) -> Tilts:
        """Roll, pitch and yaw by an inclinometer or IMU, shape (k, 3) [rad]; NaN: none.

        The rotation of P in W is Rz(yaw) Ry(pitch) Rx(roll); sigmas of roll and pitch, and of yaw.
        """
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
        _positive("equilibrium", sigma_moment, sigma_force)
        guess = self._table("tensions", tensions)
        self.stations = replace(self.stations, tensions=guess)
        term = EquilibriumTerm(
            self.stations.count,
            np.asarray(weight, float),
            np.asarray(p_PPcm, float),
            sigma_moment,
            sigma_force,
        )
        self.terms.append(term)
        return term

    def AddTensions(self, readings: Array, sigma: float | Array) -> Tensions:
        """Tensions that sensors measured, shape (k, m) [N], after `AddRest`; NaN: none."""
        if self.stations.tensions is None:
            raise CalibrationError("tensions: found no equilibrium that needs them; AddRest first")
        readings = self._table("tensions", readings)
        term = Tensions(readings, _sigmas("tensions", sigma, readings))
        self.terms.append(term)
        return term

    def AddPrior(self, patterns: Sequence[str], std: float) -> None:
        """Parameters are known up to a standard deviation, each in its unit."""
        _positive("prior", std)
        self._std[self.layout.select(patterns)] = std

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
        return LeastSquares(tuple(self.terms), self.free, prior, self._planar, huber)

    def FindIdentifiability(self) -> Identifiability:
        """What these measurements and priors can tell, at the start."""
        problem, at = self.least_squares(), self.at()
        S = problem.normal_equations(at, 0.0).S
        return identifiability(S, at, self.free, problem.used(at))

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
        began = time.perf_counter()
        self._require_told(self.FindIdentifiability())
        plain, at = self.least_squares(), self.at() if start is None else start
        if not outliers:
            found = minimize(plain, at)
            return make_result(plain, found, self.model, time.perf_counter() - began)
        before, steps = robust_cost(plain, at), 0
        if not straight:
            bent = self.Approach(MOST_STEPS, at)
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
        return make_result(
            problem, replace(found, steps=steps), self.model, time.perf_counter() - began
        )

    def prog(self) -> MathematicalProgram:
        """The same problem for Drake's solvers, without loss for outliers.

        Variables are steps from the start: one for each unknown parameter, by its name, in its
        typical size, and for each pose k turn0_k.., place0_k.., in hundredths of a radian and of a
        metre, and its tensions in newtons. Gradients are analytic.
        """
        problem, start = self.least_squares(), self.at()
        program = MathematicalProgram()
        theta = _variables(self.names())
        program.AddDecisionVariables(theta)
        columns = problem.columns(start)
        labels = [f"{w}{i}" for w in ("turn", "place") for i in range(3)]
        labels += [f"tension{i}" for i in range(start.stations.width - POSE)]
        for k in range(start.stations.count):
            own = _variables([f"{labels[c]}_{k}" for c in columns])
            program.AddDecisionVariables(own)
            one = replace(problem, terms=tuple(t.only(slice(k, k + 1)) for t in self.terms))
            cost = StationCost(one, self.at(self.stations.only(slice(k, k + 1))))
            program.AddCost(cost, vars=np.concatenate([theta, own]))
        if np.isfinite(self._std[self.free]).any():
            program.AddCost(PriorCost(problem, start), vars=theta)
        return program

    def _require_told(self, found: Identifiability) -> None:
        if found.untold:
            more = f" (and {len(found.untold) - 2} more such)" if len(found.untold) > 2 else ""
            raise CalibrationError(
                f"unknown: {'; '.join(found.untold[:2])}{more}; accepted: fewer unknowns, a prior "
                "for them, or measurements at other poses"
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


def _variables(names: Sequence[str]) -> npt.NDArray[np.object_]:
    return np.array([Variable(name) for name in names], dtype=object)


def first_readings(readings: Array) -> Array:
    """The first reading of each cable that is there, shape (m,) [m]; zero where there is none."""
    seen = np.isfinite(readings)
    first = np.argmax(seen, axis=0)
    values = readings[first, np.arange(readings.shape[1])]
    return np.where(seen.any(axis=0), values, 0.0)


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


def _sigmas(what: str, sigma: float | Array, like: Array) -> Array:
    values = np.broadcast_to(np.asarray(sigma, float), like.shape).copy()
    _positive(what, *values[np.isfinite(like)].tolist())
    return values


def _positive(what: str, *sigmas: float) -> None:
    bad = [s for s in sigmas if not (np.isfinite(s) and s > 0.0)]
    if bad:
        raise CalibrationError(f"{what}: sigma: found {bad[0]:g}; accepted: a finite number > 0")

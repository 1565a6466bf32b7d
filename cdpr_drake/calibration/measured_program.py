"""What a calibration is made of: the believed robot, poses, measurements, priors and bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform
from pydrake.solvers import MathematicalProgram

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import LeastSquares, Prior
from cdpr_drake.calibration.parameters import (
    CalibrationModel,
    parameter_layout,
)
from cdpr_drake.calibration.pose_freedom import PoseFreedom
from cdpr_drake.calibration.program_costs import StationCost
from cdpr_drake.calibration.sensor_terms import (
    Course,
    TagCorners,
    Tilts,
    TrackedPoints,
    TrackedPoses,
)
from cdpr_drake.calibration.stations import Point, Stations
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
from cdpr_drake.numerics.own_terms import OwnTerms
from cdpr_drake.vision.mark_reading import read_corners
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.winches.drum import Drum


class MeasuredCalibration(OwnTerms):
    """The problem of a calibration, which grows by what was measured.

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

"""A log and what is unknown of its robot, checked, as programs of a calibration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.fits.fit import refuse_late_tracker
from cdpr_drake.analyses.fits.robots import calibration_model, find_mount
from cdpr_drake.analyses.fits.tags import TagPlace
from cdpr_drake.analyses.logs.measurements import Measurements, off_plane, on_motion
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.guesses import guessed_tags, guessed_tracker, poses_by_tags, with_tags
from cdpr_drake.calibration.parameters import CalibrationModel, parameter_layout
from cdpr_drake.calibration.pose_freedom import PoseFreedom
from cdpr_drake.calibration.pose_search import guessed_from
from cdpr_drake.calibration.program import CalibrationProgram, first_readings
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError, CdprError
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.numerics.time_shift import tracker_shift
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget


@dataclass(frozen=True)
class Sigmas:
    """Standard deviations of measurements.

    Attributes:
        lengths: Cable length [m].
        lengths_share: Further part of it, over the length [-].
        place: Coordinate of a tracked position [m].
        turn: Tracked rotation about each axis [rad].
        corners: Coordinate of a corner [px].
        tensions: Tension [N].
        tensions_share: Further part of it, over the tension [-].
        swivels: Swivel angle [rad].
        tilt: Roll and pitch by an inclinometer or IMU [rad].
        yaw: Yaw by an IMU [rad].
        moments: Moment that the balance at rest may miss [N m].
        forces: Force that it may miss [N].
        off_plane: Tracked position across the plane in which a platform moves [m]; None: `place`.
    """

    lengths: float = 1e-3
    lengths_share: float = 0.0
    place: float = 1e-3
    turn: float = 2e-3
    corners: float = 0.2
    tensions: float = 1.0
    tensions_share: float = 0.0
    swivels: float = 2e-3
    tilt: float = 5e-3
    yaw: float = 2e-2
    moments: float = 0.05
    forces: float = 0.5
    off_plane: float | None = None


HOMING = Sigmas(
    lengths=0.01, tensions=10.0, swivels=np.pi / 180.0, tilt=np.pi / 90.0, yaw=np.pi / 90.0
)
"""Default of a robot with fewer cables than degrees of freedom that searches for the zeros of its
sensors: 10 mm, 10 N, 1 deg and 2 deg.

Source: Zoffoli, UACDPR_SelfCalibration, UACDPR_AutoSelfCalibration.m, 2025, `sensor_disturb`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CalibrationTask:
    """A log, and what is unknown of its robot.

    Attributes:
        robot: The robot as it is believed.
        log: The measurements.
        unknown: Groups and names of parameters; poses of tags whose place is unknown or has a
            deviation, and zeros of swivel angles, are unknown in any case.
        priors: Standard deviations by group or name, in their units.
        bounds: Largest changes of parameters by group or name, in their units.
        sigmas: Standard deviations of the measurements.
        tags: Tags by their numbers.
        mount: The camera's mounting; None: the first on the platform.
        image_size: Width and height of images [px]; None: as in the camera's data sheet.
        start: Believed pose of the first row; None: home.
        zero: Pose at which lengths or motor angles were zero [m]; None: they count from anywhere.
        rest: True if the platform rested in all rows; None: if tensions or swivel angles, and
            neither tracker nor tags, were measured.
        outliers: True if outliers are sought.
    """

    robot: Robot
    log: Measurements
    unknown: tuple[str, ...]
    priors: dict[str, float] = field(default_factory=dict)
    bounds: dict[str, float] = field(default_factory=dict)
    sigmas: Sigmas = field(default_factory=Sigmas)
    tags: dict[int, TagPlace] = field(default_factory=dict)
    mount: str | None = None
    image_size: tuple[int, int] | None = None
    start: RigidTransform | None = None
    zero: RigidTransform | None = None
    rest: bool | None = None
    outliers: bool = True

    @property
    def blind(self) -> bool:
        """True if nothing but the robot itself tells where the platform is."""
        point = self.log.points is not None and self.robot.motion_type().is_point
        return self.log.poses is None and not self.log.corners and not point

    @property
    def rests(self) -> bool:
        """True if the platform rested in all rows, see `rest`."""
        if self.rest is not None:
            return self.rest
        return self.blind and (self.log.tensions is not None or self.log.swivels is not None)


class StartPoint(NamedTuple):
    """A start of a search: a model with guesses of what readings count from, and poses X_WP [m]."""

    model: CalibrationModel
    poses: list[RigidTransform]


@dataclass(frozen=True, eq=False)
class Setup:
    """A checked task.

    Attributes:
        task: The task.
        model: The robot as it is believed, with the tags whose place is known.
        unknown: Groups and names of all that is unknown.
        priors: Standard deviations by group or name, with those of tags.
        first: Believed pose of the first row, X_WP [m].
        lengths, sigma: Readings of winches and their deviations, shape (k, m) [m]; or None.
        mount, pinhole: The camera's mounting, and the camera, if there are images.
        targets: The tags in the images.
        tracked: Poses X_WP by the tracker and the model; None where it has none, or while nothing
            is known of its frame or marker. Positions of a point mass are poses.
        points: Positions of a tracker without rotations, shape (k, 3) [m]; or None.
    """

    task: CalibrationTask
    model: CalibrationModel
    unknown: tuple[str, ...]
    priors: dict[str, float]
    first: RigidTransform
    lengths: Array | None = None
    sigma: Array | None = None
    mount: str | None = None
    pinhole: Pinhole | None = None
    targets: dict[int, PointTarget] = field(default_factory=dict)
    tracked: list[RigidTransform | None] | None = None
    points: Array | None = None

    @property
    def freedom(self) -> PoseFreedom:
        """The coordinates of poses that are unknown."""
        return PoseFreedom(self.task.robot.motion_type())

    @property
    def zeroed(self) -> bool:
        """True if cables count from zero, or drums turn angles into lengths in the fit."""
        free = self.free()
        slices = parameter_layout(self.model).slices
        drums = any(free[slices[key]].any() for key in ("drum_radii", "common_drum_radius"))
        return self.task.zero is not None or (drums and self.task.log.lengths is None)

    def free(self, without: Iterable[str] = ()) -> npt.NDArray[np.bool_]:
        """Flags of unknown parameters but tags, which the model may not have yet."""
        layout = parameter_layout(self.model)
        known = layout.select([name for name in without if not name.startswith("tag")])
        return layout.select([n for n in self.unknown if not n.startswith("tag")]) & ~known

    def frames_unknown(self) -> tuple[str, ...]:
        """The tracker's frame and marker, if they are unknown without any prior.

        Of a tracker of positions: its frame, if nothing is known of how it is turned.
        """
        free, slices = self.free(self.task.priors), parameter_layout(self.model).slices
        if self.points is None:
            return tuple(key for key in ("tracker", "marker") if free[slices[key]].any())
        begin = slices["tracker"].start
        return ("tracker",) if free[begin : begin + 3].all() else ()

    def program(self, start: StartPoint) -> CalibrationProgram:
        """The program, with poses and tags guessed from a start."""
        task, log, sigmas = self.task, self.task.log, self.task.sigmas
        model, poses = start
        if self.tracked is not None:
            poses = [g if X is None else X for g, X in zip(poses, self.tracked, strict=True)]
        if self.targets:
            assert self.pinhole is not None
            missing = {t: T for t, T in self.targets.items() if t not in model.tags}
            if missing:
                corners = self._corners(missing)
                guesses = guessed_tags(model, poses, missing, corners, self.pinhole)
                model = with_tags(model, guesses)
            if self.tracked is None:
                corners = self._corners(self.targets)
                poses = poses_by_tags(model, poses, self.targets, corners, self.pinhole)
        program = CalibrationProgram(model, poses, self.unknown, motion=self.freedom.motion)
        self.add_winches(program, self.guessed_tensions(poses) if self.task.rests else None)
        if log.poses is not None:
            program.AddTrackedPoses(log.poses, sigmas.turn, sigmas.place)
        if self.points is not None:
            clock = program.free[program.layout.slices["clock"]].any()
            program.AddTrackedPoints(
                self.points, sigmas.place, normal=off_plane(task.robot),
                sigma_along=sigmas.off_plane, times=log.time if clock else None,
            )  # fmt: skip
        if self.targets:
            assert self.pinhole is not None
            order = [tag for tag in model.tags if tag in self.targets]
            points = {tag: self.targets[tag].points for tag in order}
            program.AddTagCorners(points, self._corners(order), sigmas.corners, self.pinhole)
        for name, std in self.priors.items():
            program.AddPrior([name], std)
        for name, most in task.bounds.items():
            program.AddBound([name], most)
        return program

    def _corners(self, tags: Iterable[int]) -> Array:
        return np.stack([self.task.log.corners[tag] for tag in tags], axis=1)

    def add_winches(self, program: CalibrationProgram, tensions: Array | None) -> None:
        """Adds what a robot measures of itself.

        Args:
            program: Gets it.
            tensions: Guesses, shape (k, m) [N]; None leaves out the balance.
        """
        log, robot, sigmas = self.task.log, self.task.robot, self.task.sigmas
        if self.lengths is not None and self.sigma is not None:
            strain = None
            if log.tensions is not None:
                strain = np.nan_to_num(log.tensions) / robot.stiffness()
            if not self.zeroed:
                start = first_readings(self.lengths)
                program.AddLengths(self.lengths, self.sigma, start, strain)
            elif log.lengths is not None or log.angles is None:
                program.AddZeroedCables(self.lengths, self.sigma, self.task.zero, strain=strain)
            else:
                advantage = np.array([cable.mechanical_advantage for cable in robot.cables])
                program.AddZeroedCables(
                    log.angles, self.sigma, self.task.zero, robot.drum(), strain=strain,
                    advantage=advantage,
                )  # fmt: skip
        if log.swivels is not None:
            program.AddSwivels(log.swivels, sigmas.swivels)
        if log.tilts is not None:
            program.AddTilts(log.tilts, sigmas.tilt, sigmas.yaw)
        if tensions is not None:
            weight, com = robot.platform.mass * robot.gravity_vector(), robot.center_of_mass()
            program.AddRest(weight, com, sigmas.moments, sigmas.forces, tensions)
            if log.tensions is not None:
                share = sigmas.tensions_share * np.nan_to_num(np.abs(log.tensions))
                program.AddTensions(log.tensions, np.hypot(sigmas.tensions, share))

    def start_points(self, firsts: Sequence[RigidTransform]) -> list[StartPoint]:
        """Guesses of what readings count from, and of all poses, for each pose of the first row.

        The poses are those of a tracker, if it has all; else one follows from the other.

        Raises:
            CalibrationError: A start is impossible.
        """
        log, tracked = self.task.log, self.tracked
        seen = next((X for X in tracked or () if X is not None), None)
        seeds = list(firsts) if seen is None else [seen] * len(firsts)
        models = [self._counting(seed) for seed in seeds]
        if tracked is not None and all(X is not None for X in tracked):
            known = [X for X in tracked if X is not None]
            return [StartPoint(model, known) for model in models]
        count, freedom, m = log.count, self.freedom, self.model.cables.count
        # Balance is hard to follow from afar; it counts if lengths and the like are too few.
        readings = m * ((self.lengths is not None) + (log.swivels is not None))
        tensions = None
        if self.task.rests and readings < freedom.motion.freedom:
            tensions = np.array([self.guessed_tensions([seed] * count) for seed in seeds])
        trial = CalibrationProgram(models[0], [seeds[0]] * count, (), motion=freedom.motion)
        self.add_winches(trial, None if tensions is None else tensions[0])
        guesses = guessed_from(
            models, trial.terms, seeds, count=count, tensions=tensions, freedom=freedom,
            sure=not self._offsets_unknown(),
        )  # fmt: skip
        pairs = zip(models, guesses, strict=True)
        return [StartPoint(model, stations.poses()) for model, stations in pairs]

    def _offsets_unknown(self) -> bool:
        """True if nothing is known of what lengths count from."""
        offsets = self.free()[parameter_layout(self.model).slices["length_offsets"]]
        unsure = bool(offsets.any()) and "length_offsets" not in self.task.priors
        return unsure and self.task.zero is None

    def _counting(self, seed: RigidTransform) -> CalibrationModel:
        """The model with guesses of what readings count from: as if that were the first pose."""
        model, swivels = self.model, self.task.log.swivels
        at = Point(model, Stations.at([seed])).numbers[0]
        if self.lengths is not None and self._offsets_unknown():
            offsets = self.free()[parameter_layout(model).slices["length_offsets"]]
            guess = np.where(offsets, at[:, 0] - first_readings(self.lengths), 0.0)
            model = replace(model, length_offset=guess)
        if swivels is not None:
            model = replace(model, swivel_offset=at[:, 2] - first_readings(swivels))
        return model

    def guessed_tensions(self, poses: Sequence[RigidTransform]) -> Array:
        """Measured tensions, or else tensions that nearly hold the platform, shape (k, m) [N]."""
        robot, measured = self.task.robot, self.task.log.tensions
        share = robot.platform.mass * robot.gravity / self.model.cables.count
        guess = np.full((len(poses), self.model.cables.count), share)
        tensions: Array | None = None
        for k, X_WP in enumerate(poses):
            if k == 0 or X_WP is not poses[k - 1]:
                tensions = _holding_tensions(robot, X_WP)
            if tensions is not None:
                guess[k] = np.maximum(tensions, 0.01 * share)
        if measured is not None:
            guess = np.where(np.isfinite(measured), measured, guess)
        return guess


def _holding_tensions(robot: Robot, X_WP: RigidTransform) -> Array | None:
    """Tensions that hold the platform; None outside of the frame, or where it is singular."""
    try:  # where a search begins: straight cables are near enough
        problem = tension_problem(robot, X_WP, cables=robot.cable_set(pulleys=False))
        tensions = np.asarray(distribute(problem, "quadratic_program").tensions, float)
    except CdprError:
        return None
    return tensions if np.isfinite(tensions).all() else None


def prepare(task: CalibrationTask) -> Setup:
    """Checks a task.

    Raises:
        CalibrationError: The log does not hold what the task needs; names it.
    """
    robot, log, sigmas = task.robot, task.log, task.sigmas
    lengths = log.wound(robot)
    if lengths is None and log.swivels is None:
        raise CalibrationError(
            f"{log.path}: cable lengths: found none; accepted: columns such as C1_length_m, or "
            "motor angles such as C1_motor_angle_rad"
        )
    mount = find_mount(robot, task.mount).name if log.corners else None
    pinhole = None if mount is None else _camera(task, mount)
    places = {tag: task.tags[tag] for tag in log.corners}
    known = {tag: place.X_WT for tag, place in places.items() if place.X_WT is not None}
    unknown, priors = list(task.unknown), dict(task.priors)
    for tag, place in places.items():
        if tag in known and place.sigma_place > 0.0:
            priors[f"tag{tag}.pose.[xyz]"] = place.sigma_place
            priors[f"tag{tag}.pose.r?"] = place.sigma_turn
        if "tags" not in task.unknown and (tag not in known or place.sigma_place > 0.0):
            unknown.append(f"tag{tag}.*")
    if log.swivels is not None and "swivel_offsets" not in unknown:
        unknown.append("swivel_offsets")
    points, tracked = log.positions(robot), log.platform_poses(robot)
    setup = Setup(
        task, with_tags(calibration_model(robot, mount), known), tuple(unknown), priors,
        first=on_motion(robot, task.start or robot.home.transform()), lengths=lengths,
        mount=mount, pinhole=pinhole, tracked=tracked, points=points,
        targets={tag: TagTarget(tag, place.size) for tag, place in places.items()},
    )  # fmt: skip
    if setup.frames_unknown():
        setup = replace(setup, tracked=None)
    if lengths is None:
        return setup
    # Readings may count from anything: lengths are those at the first pose and what came since.
    seed = next((X for X in setup.tracked or () if X is not None), setup.first)
    whole = Point(setup.model, Stations.at([seed])).numbers[0, :, 0]
    whole = np.abs(whole + lengths - first_readings(lengths))
    return replace(setup, sigma=np.hypot(sigmas.lengths, sigmas.lengths_share * whole))


def _camera(task: CalibrationTask, mount: str) -> Pinhole:
    """The camera of a mounting; checks corners and tags."""
    log, camera = task.log, load_camera(find_mount(task.robot, mount).model)
    width, height = task.image_size or (camera.width, camera.height)
    for tag, uv in log.corners.items():
        outside = (
            (uv[..., 0] > width - 0.5) | (uv[..., 1] > height - 0.5) | np.any(uv < -0.5, axis=-1)
        )
        if np.any(outside):
            k = int(np.argmax(np.any(outside, axis=1)))
            u, v = uv[k][outside[k]][0]
            raise CalibrationError(
                f"{log.path}: row {k + 1}: tag {tag}: found a corner at ({u:g}, {v:g}) px; "
                f"accepted: within the image of {width} x {height} px, see image_size"
            )
    missing = [str(tag) for tag in log.corners if tag not in task.tags]
    if missing:
        raise CalibrationError(
            f"tags: found no size of tag {', '.join(missing)}, which {log.path} shows; "
            "accepted: tag_size, or a row for each"
        )
    return camera.pinhole(width, height)


def with_tracker(setup: Setup) -> Setup:
    """With guesses of the frame and marker of a tracker of which nothing is known yet.

    Raises:
        CalibrationError: No or too few poses were tracked, or its clock is off; says by how much.
    """
    if setup.tracked is None and (
        setup.task.log.poses is not None
        or (setup.points is not None and setup.freedom.motion.is_point)
    ):
        poses = setup.start_points([setup.first])[0].poses
        setup = _turned(setup, poses) if setup.points is not None else _placed(setup, poses)
    _check_clock(setup)
    return setup


def _placed(setup: Setup, poses: Sequence[RigidTransform]) -> Setup:
    """With guesses of a tracker of poses, by the poses that winches tell."""
    tracked = setup.task.log.poses
    assert tracked is not None
    model = guessed_tracker(setup.model, poses, tracked, setup.frames_unknown())
    X_MP = model.X_PM.inverse()
    told = [None if X is None else model.X_WK @ X @ X_MP for X in tracked]
    return replace(setup, model=model, tracked=told)


def _turned(setup: Setup, poses: Sequence[RigidTransform]) -> Setup:
    """With a guess of the frame of a tracker of positions of a point mass.

    Source: Kabsch, A solution for the best rotation to relate two sets of vectors, 1976.
    """
    points = setup.points
    assert points is not None
    rows = np.asarray(np.isfinite(points).all(axis=1))
    if np.sum(rows) < 3:
        raise CalibrationError(
            f"{setup.task.log.path}: tracked positions: found {np.sum(rows)}; accepted: at least "
            "3, where nothing is known of how the tracker's frame is turned"
        )
    there, here = np.array([X.translation() for X in poses])[rows], points[rows]
    U, _, Vt = np.linalg.svd((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    place = there.mean(axis=0) - R @ here.mean(axis=0)
    X_WK = RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), place)
    tracked = [
        on_motion(setup.task.robot, RigidTransform(X.rotation(), X_WK @ p)) if known else None
        for X, p, known in zip(poses, points, rows, strict=True)
    ]
    return replace(setup, model=replace(setup.model, X_WK=X_WK), tracked=tracked)


def _check_clock(setup: Setup) -> None:
    """Refuses a tracker that is out of sync with the winches; a clock may be fitted instead."""
    log, poses, lengths = setup.task.log, setup.tracked, setup.lengths
    if poses is None or log.time is None or lengths is None or "clock" in setup.unknown:
        return
    tracked = np.full(lengths.shape, np.nan)
    rows = [k for k, X in enumerate(poses) if X is not None]
    at = Point(setup.model, Stations.at([X for X in poses if X is not None]))
    tracked[rows] = at.numbers[:, :, 0]
    shift, step = tracker_shift(log.time, lengths, tracked), float(np.median(np.diff(log.time)))
    refuse_late_tracker(log, "cable lengths", shift, step, CalibrationError)


def is_homing(robot: Robot, log: Measurements) -> bool:
    """True if a robot with fewer cables than degrees of freedom has only its own sensors."""
    seen = log.poses is not None or log.points is not None or bool(log.corners)
    return robot.is_underactuated() and not seen


def default_unknown(robot: Robot, log: Measurements) -> tuple[str, ...]:
    """Groups and names of parameters that are unknown by default.

    A robot with fewer cables than degrees of freedom and only its own sensors first has to know
    where these count from: nothing else follows from so few numbers. A point mass cannot tell
    anchor points from exit points; other robots look for both. In a plane across an axis of W, but
    for a body's horizontal one, coordinates across it are left out.
    """
    motion, normal = robot.motion_type(), off_plane(robot)
    if is_homing(robot, log):
        yaw = log.tilts is not None and bool(np.isfinite(log.tilts[:, 2]).any())
        lengths = log.lengths is not None or log.angles is not None
        zeros = [("length_offsets", lengths), ("swivel_offsets", log.swivels is not None)]
        return tuple(name for name, there in [*zeros, ("tilt_zero.yaw", yaw)] if there)
    if normal is None or motion.is_horizontal_body or motion.rows is None:
        return ("exit_points",) if motion.is_point else ("exit_points", "anchor_points")
    # To first order nothing tells how far points are out of a plane.
    inside = "".join(axis for axis, part in zip("xyz", normal, strict=True) if part == 0.0)
    points = ("exit_point",) if motion.is_point else ("exit_point", "anchor_point")
    return tuple(f"*.{point}.[{inside}]" for point in points)

"""What is asked of a log, and the log and the robot checked against it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.calibrated_robots import calibration_model, find_mount
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.analyses.calibration.log_fit import wound_lengths
from cdpr_drake.analyses.calibration.motion_start import off_plane, on_motion
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.guesses import with_tags
from cdpr_drake.calibration.parameters import CalibrationModel, parameter_layout
from cdpr_drake.calibration.pose_freedom import PoseFreedom
from cdpr_drake.calibration.program import first_readings
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget


class TagPlace(NamedTuple):
    """What is known of a tag beforehand.

    Attributes:
        size: Its edge [m].
        X_WT: Where it is [m]; None: nothing is known.
        sigma_place: Standard deviation of each coordinate of that [m]; 0: it is exact.
        sigma_turn: Of its turn about each axis [rad].
    """

    size: float
    X_WT: RigidTransform | None = None
    sigma_place: float = 0.0
    sigma_turn: float = 0.0


TagPlaces = dict[int, TagPlace]


@dataclass(frozen=True)
class Sigmas:
    """Standard deviations of what is measured.

    Attributes:
        lengths: Of a cable's length [m].
        lengths_share: Of it, besides, over the length [-].
        place: Of a coordinate of a tracked position [m].
        turn: Of a tracked rotation about each axis [rad].
        corners: Of a coordinate of a corner [px].
        tensions: Of a tension [N].
        tensions_share: Of it, besides, over the tension [-].
        swivels: Of a swivel angle [rad].
        tilt: Of roll and pitch by an inclinometer or IMU [rad].
        yaw: Of yaw by an IMU [rad].
        moments: What moments may miss of the balance at rest [N m].
        forces: What forces may miss of it [N].
        off_plane: Of a tracked position across the plane in which a platform moves [m]; None: as
            `place`.
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
"""What sensors of a robot with fewer cables than degrees of freedom are taken to miss, while it
looks for where they count from and nothing else is said: 10 mm, 10 N, 1 deg and 2 deg.

Source: Zoffoli, UACDPR_SelfCalibration, UACDPR_AutoSelfCalibration.m, 2025, `sensor_disturb`."""


@dataclass(frozen=True, eq=False)
class CalibrationTask:
    """What is asked of a log.

    Attributes:
        robot: The robot as it is believed.
        unknown: Groups and names of parameters; the poses of tags whose place is unknown or has a
            deviation, and zeros of swivel angles, are unknown in any case.
        priors: Standard deviations by group or name, in their units.
        sigmas: Of what was measured.
        tags: What is known of tags, by their numbers.
        mount: The camera's mounting; None: the first on the platform.
        image_size: Width and height [px]; None: those of the camera's data sheet.
        start: Pose where the platform is believed to have been in the first row; None: home.
        rest: Whether the platform rested in all rows; None: where tensions or swivel angles, and
            neither tracker nor tags, were measured.
        outliers: Whether outliers are sought.
        zero: Pose at which lengths or motor angles were zero [m]; None: they count from anywhere.
        bounds: By how much parameters may change at most, by group or name, in their units.
        hold_out: Rows that are not fitted but predicted, see `held_groups`; None: none.
    """

    robot: Robot
    unknown: tuple[str, ...]
    priors: dict[str, float] = field(default_factory=dict)
    sigmas: Sigmas = field(default_factory=Sigmas)
    tags: TagPlaces = field(default_factory=dict)
    mount: str | None = None
    image_size: tuple[int, int] | None = None
    start: RigidTransform | None = None
    rest: bool | None = None
    outliers: bool = True
    zero: RigidTransform | None = None
    bounds: dict[str, float] = field(default_factory=dict)
    hold_out: str | int | None = None


@dataclass(frozen=True, eq=False)
class Prepared:
    """A log and a task, checked.

    Attributes:
        task, log: What was asked of what.
        model: The robot as it is believed, with the tags whose place is known.
        lengths, sigma: Readings of winches and their deviations, shape (k, m) [m]; or None.
        first: Where the platform is believed to have been in the first row, X_WP [m].
        rest: Whether it rested in all rows.
        mount, pinhole: The camera's mounting, and the camera, if there are images.
        targets: The tags that are seen.
        unknown: Groups and names of all that is unknown.
        priors: Standard deviations by group or name, those of tags included.
        tracked: Poses X_WP as the tracker tells them by the model; None where it has none, or
            while nothing is known of its frame or marker. Positions of a point mass are poses.
        points: Positions that a tracker told without rotations, shape (k, 3) [m]; or None.
    """

    task: CalibrationTask
    log: CalibrationLog
    model: CalibrationModel
    lengths: Array | None
    sigma: Array | None
    first: RigidTransform
    rest: bool
    mount: str | None
    pinhole: Pinhole | None
    targets: dict[int, PointTarget]
    unknown: tuple[str, ...]
    priors: dict[str, float]
    tracked: list[RigidTransform | None] | None
    points: Array | None = None

    @property
    def freedom(self) -> PoseFreedom:
        """Which coordinates of poses are unknown."""
        return PoseFreedom(self.task.robot.motion_type())

    def is_zeroed(self) -> bool:
        """Whether cables were counted from zero, or drums turn angles into lengths in the fit."""
        layout = parameter_layout(self.model)
        free = layout.select(self.unknown_of_robot())
        drums = [free[layout.slices[key]].any() for key in ("drum_radii", "common_drum_radius")]
        return self.task.zero is not None or (any(drums) and self.log.lengths is None)

    def unknown_of_robot(self) -> list[str]:
        """Names of what is unknown but tags, which the model may not have yet."""
        return [name for name in self.unknown if not name.startswith("tag")]


def prepare(task: CalibrationTask, log: CalibrationLog) -> Prepared:
    """Checks a log and a task.

    Raises:
        CalibrationError: The log does not hold what is asked; names it.
    """
    robot, sigmas = task.robot, task.sigmas
    lengths = wound_lengths(robot, log)
    if lengths is None and log.swivels is None:
        raise CalibrationError(
            f"{log.path}: cable lengths: found none; accepted: columns such as C1_length_m, or "
            "motor angles such as C1_motor_angle_rad"
        )
    mount, pinhole = None, None
    targets: dict[int, PointTarget] = {}
    if log.corners:
        mount = task.mount or next((m.name for m in robot.cameras if m.parent == "platform"), None)
        if mount is None:
            raise CalibrationError(f"mount: found none on the platform of {robot.name}")
        camera = load_camera(find_mount(robot, mount).model)
        width, height = task.image_size or (camera.width, camera.height)
        pinhole = camera.pinhole(width, height)
        _check_images(log, width, height)
        missing = [str(tag) for tag in log.corners if tag not in task.tags]
        if missing:
            raise CalibrationError(
                f"tags: found no size of tag {', '.join(missing)}, which {log.path} shows; "
                "accepted: tag_size, or a row for each"
            )
        targets = {tag: TagTarget(tag, task.tags[tag].size) for tag in log.corners}
    model = calibration_model(robot, mount)
    unknown = list(task.unknown)
    places = {tag: task.tags[tag] for tag in targets}
    known = {tag: place.X_WT for tag, place in places.items() if place.X_WT is not None}
    priors, measured = dict(task.priors), set()
    for tag, place in places.items():
        if tag in known and place.sigma_place > 0.0:
            measured.add(tag)
            priors[f"tag{tag}.pose.[xyz]"] = place.sigma_place
            priors[f"tag{tag}.pose.r?"] = place.sigma_turn
    sure = set(known) - measured
    unknown += [f"tag{tag}.*" for tag in places if tag not in sure and "tags" not in unknown]
    if log.swivels is not None and "swivel_offsets" not in unknown:
        unknown.append("swivel_offsets")
    points = _points_of(task, log)
    is_point = robot.motion_type().is_point
    first = on_motion(robot, task.start or robot.home.transform())
    tracked = None if log.poses is None else list(log.poses)
    if points is not None and is_point:
        tracked = [_at_point(robot, p) for p in points]
    made = Prepared(
        task, log, with_tags(model, known), lengths, None, first, rests(task, log), mount,
        pinhole, targets, tuple(unknown), priors, tracked, points,
    )  # fmt: skip
    if unknown_frames(made) if points is None else turns_unknown(made):
        made = replace(made, tracked=None)
    seed = next((X for X in made.tracked or () if X is not None), first)
    if lengths is None:
        return made
    # Readings may count from anything: lengths are those at the first pose and what came since.
    whole = Point(model, Stations.at([seed])).numbers[0, :, 0]
    whole = np.abs(whole + lengths - first_readings(lengths))
    return replace(made, sigma=np.hypot(sigmas.lengths, sigmas.lengths_share * whole))


def rests(task: CalibrationTask, log: CalibrationLog) -> bool:
    """True if the platform is said to rest in all rows, or if tensions or swivel angles, and
    neither tracker nor tags, were measured."""
    if task.rest is not None:
        return task.rest
    seen = log.points is not None and task.robot.motion_type().is_point
    blind = log.poses is None and not log.corners and not seen
    return blind and (log.tensions is not None or log.swivels is not None)


def unknown_frames(prepared: Prepared) -> tuple[str, ...]:
    """Which of a tracker's frame and marker are unknown without any prior."""
    layout = parameter_layout(prepared.model)
    free = layout.select(prepared.unknown_of_robot())
    known = layout.select([n for n in prepared.task.priors if not n.startswith("tag")])
    open_now = free & ~known
    return tuple(key for key in ("tracker", "marker") if open_now[layout.slices[key]].any())


def turns_unknown(prepared: Prepared) -> bool:
    """Whether nothing is known of how the frame of a tracker of positions is turned."""
    layout = parameter_layout(prepared.model)
    free = layout.select(prepared.unknown_of_robot())
    known = layout.select([n for n in prepared.task.priors if not n.startswith("tag")])
    begin = layout.slices["tracker"].start
    return bool((free & ~known)[begin : begin + 3].all())


def is_homing(robot: Robot, log: CalibrationLog) -> bool:
    """Whether a robot with fewer cables than degrees of freedom has nothing but its own sensors."""
    seen = log.poses is not None or log.points is not None or bool(log.corners)
    return robot.is_underactuated() and not seen


def default_unknown(robot: Robot, log: CalibrationLog) -> tuple[str, ...]:
    """What is looked for where nothing is said.

    A robot with fewer cables than degrees of freedom, whose own sensors are all there is, first has
    to know where these count from: nothing else follows from so few numbers. A point mass cannot
    tell anchor points from exit points; other robots look for both. In a plane across an axis of W,
    but for a body's horizontal one, coordinates across it are left out.
    """
    motion = robot.motion_type()
    if is_homing(robot, log):
        yaw = log.tilts is not None and bool(np.isfinite(log.tilts[:, 2]).any())
        lengths = log.lengths is not None or log.angles is not None
        zeros = [("length_offsets", lengths), ("swivel_offsets", log.swivels is not None)]
        return tuple(name for name, there in [*zeros, ("tilt_zero.yaw", yaw)] if there)
    normal = off_plane(robot)
    if normal is None or motion.is_horizontal_body or motion.rows is None:
        return ("exit_points",) if motion.is_point else ("exit_points", "anchor_points")
    # To first order nothing tells how far points are out of a plane.
    inside = "".join(axis for axis, part in zip("xyz", normal, strict=True) if part == 0.0)
    points = ("exit_point",) if motion.is_point else ("exit_point", "anchor_point")
    return tuple(f"*.{point}.[{inside}]" for point in points)


def _points_of(task: CalibrationTask, log: CalibrationLog) -> Array | None:
    """Positions of a tracker without rotations; in a plane those across it may be missing.

    Raises:
        CalibrationError: A coordinate is missing that the platform moves along.
    """
    if log.points is None:
        return None
    points, normal = log.points.copy(), off_plane(task.robot)
    for axis in np.flatnonzero(~np.isfinite(points).any(axis=0)):
        if normal is None or abs(normal[axis]) < 1.0:
            raise CalibrationError(
                f"{log.path}: position: found no {'xyz'[axis]}; accepted: x_m, y_m and z_m, or "
                "those in which the platform moves"
            )
        seen = np.isfinite(np.delete(points, axis, axis=1)).all(axis=1)
        points[seen, axis] = task.robot.home.position[axis]
    return points


def _at_point(robot: Robot, p_WP: Array) -> RigidTransform | None:
    """A position of a point mass as its pose, where there is one."""
    if not np.isfinite(p_WP).all():
        return None
    return on_motion(robot, RigidTransform(robot.home.transform().rotation(), p_WP))


def _check_images(log: CalibrationLog, width: int, height: int) -> None:
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

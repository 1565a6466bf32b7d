"""A robot as calibrations model it, a file of what was fitted, and poses at which it rests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits.fit import Fit, fitted_robot
from cdpr_drake.analyses.logs.measurements import on_motion
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.errors import CalibrationError, CdprError
from cdpr_drake.formats.robot_exchange import Deviations, export_robot, with_comment
from cdpr_drake.formats.robot_exports import export_omissions, omission_words
from cdpr_drake.geometry.poses import angles_from_rotation, place_error, pose_from_angles
from cdpr_drake.models.robot_schema import CameraMount, Pose, Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import distribute

MACHINE = "machine"
"""Name of a results folder's file for the machine's own configuration, without its ending."""

DRAWS = 60
"""Poses drawn for each pose that is needed, before the search ends."""

LARGEST_TURN = 0.35
"""Turns about each axis, from the pose at home [rad]."""

RIM = 0.12
"""Share of the frame's size that poses keep from its sides."""


def calibration_model(robot: Robot, mount: str | None = None) -> CalibrationModel:
    """A robot as its file says, with the camera of a mounting, if one is named.

    Raises:
        CalibrationError: There is no such mounting on the platform.
    """
    model = CalibrationModel(tuple(cable.name for cable in robot.cables), robot.cable_set())
    if mount is None:
        return model
    return replace(model, X_PC=find_mount(robot, mount).pose.transform())


def find_mount(robot: Robot, name: str | None) -> CameraMount:
    """A camera on the platform by the name of its mounting; without a name the first.

    Raises:
        CalibrationError: There is none.
    """
    mounts = {mount.name: mount for mount in robot.cameras if mount.parent == "platform"}
    if not mounts and not name:
        raise CalibrationError(f"mount: found none on the platform of {robot.name}")
    name = name or next(iter(mounts))
    if name not in mounts:
        raise CalibrationError(
            f"mount: found {name!r}; accepted: {', '.join(mounts) or 'none'}, on the platform of "
            f"{robot.name}"
        )
    return mounts[name]


def calibrated_robot(
    robot: Robot, result: CalibrationResult, mount: str | None = None
) -> tuple[Robot, tuple[str, ...]]:
    """A robot with the fitted constants, and in words what its file has no place for.

    Args:
        robot: The robot as it was believed.
        result: Its calibration.
        mount: The camera's mounting that was calibrated.
    """
    model, moved = result.model, set(result.names)
    cables, stretch = [], model.common_length_scale
    for k, cable in enumerate(robot.cables):
        drum, pulley = cable.drum_radius, cable.pulley_radius
        if f"{cable.name}.drum_radius" in moved:
            drum = (robot.winch.drum_radius if drum is None else drum) + float(model.drum_radius[k])
        if f"{cable.name}.pulley_radius" in moved:
            pulley = float(model.cables.pulley_radius[k])
        cables.append(
            replace(
                cable,
                exit_point=cable.base_of(model.cables.p_WA[:, k]),
                anchor_point=np.array(model.cables.p_PB[:, k]),
                pulley_radius=pulley,
                drum_radius=None if drum is None else drum * stretch + model.common_drum_radius,
            )
        )
    cameras = [
        replace(camera, pose=schema_pose(model.X_PC))
        if camera.name == mount and camera.parent == "platform"
        else camera
        for camera in robot.cameras
    ]
    winch, left, scales = robot.winch, [], model.length_scale
    if any(name.endswith(".length_scale") for name in moved):
        mean = float(np.mean(scales))
        winch = replace(winch, drum_radius=winch.drum_radius * mean)
        left.append(
            f"drum radii: the file has one for all, their mean; each over it: "
            f"{', '.join(f'{s / mean:.5f}' for s in scales)}"
        )
    if "common_length_scale" in moved:
        winch = replace(winch, drum_radius=winch.drum_radius * stretch)
        left.append(
            f"the stretch of all lengths, {stretch:.6g}, is in the drum radii; that of a tape is "
            "none of the robot's: undo it there"
        )
    if model.common_drum_radius:
        winch = replace(winch, drum_radius=winch.drum_radius + model.common_drum_radius)
    for group in ("length_offset", "swivel_offset"):
        if any(name.endswith(group) for name in moved):
            left.append(f"{group.replace('_', ' ')}s belong to the log; they are in results.json")
    frames = [key for key in ("tracker", "marker") if any(n.startswith(f"{key}.") for n in moved)]
    if frames:
        left.append(f"the {' and the '.join(frames)} belong to the log; they are in results.json")
    if any(name == "clock" or name.startswith("tilt_zero.") for name in moved):
        left.append("zeros of tilts and the tracker's clock belong to the log, as well")
    changes = {"cables": cables, "cameras": cameras, "winch": winch}
    return fitted_robot(robot, "Calibrated", result.status, result.names, **changes), tuple(left)


def with_machine_lines(fit: Fit, format: str) -> Fit:
    """A calibration with its robot as lines of a firmware's configuration, deviations as comments.

    Args:
        fit: The calibration.
        format: A name of `FIRMWARES`.

    Raises:
        RobotFileError: The format cannot hold the robot.
    """
    robot, lost = fit.model, export_omissions(fit.model, format)
    ((name, text),) = export_robot(robot, format, cable_deviations(robot, fit.result)).items()
    verdict = "" if fit.fits else ", which does not fit what was measured: do not use it"
    text = with_comment(text, f"Of a calibration: {fit.status}{verdict}.")
    file = f"{MACHINE}{Path(name).suffix}"
    words = (f"Configuration for {format}, in {file}:", text.rstrip(), *omission_words(lost))
    machine = {"format": format, "file": file, "text": text, "not_written": lost}
    more = fit.with_more(details={"machine": machine}, texts={file: text})
    return replace(more, words=(*fit.words, *words))


def cable_deviations(robot: Robot, result: CalibrationResult) -> list[Deviations]:
    """Standard deviations of points and drums of all cables."""
    names = {name: k for k, name in enumerate(result.names)}

    def std(weights: Mapping[str, float]) -> float:
        """Of a weighted sum of parameters; NaN if none of them was fitted."""
        sums = np.zeros(len(names))
        for name, weight in weights.items():
            if name in names:
                sums[names[name]] = weight
        return float(np.sqrt(sums @ result.covariance @ sums)) if sums.any() else np.nan

    share = robot.winch.drum_radius / len(robot.cables)  # of a mean of scales, see above
    scales = {f"{cable.name}.length_scale": share for cable in robot.cables}
    return [
        Deviations(
            np.array([
                std({f"{name}.exit_point.{axis}": 1.0, f"{name}.anchor_point.{axis}": -1.0})
                for axis in "xyz"
            ]),
            std({f"{name}.drum_radius": 1.0, "common_drum_radius": 1.0, **scales}),
        )
        for name in (cable.name for cable in robot.cables)
    ]  # fmt: skip


def schema_pose(X: RigidTransform) -> Pose:
    """A pose as files of robots and scenarios have it."""
    angles = np.degrees(angles_from_rotation(X.rotation()))
    return Pose(position=np.array(X.translation()), angles_deg=angles)


def in_short_hops(poses: Sequence[RigidTransform], start: RigidTransform) -> list[RigidTransform]:
    """Poses in an order in which each is the nearest one that is left, from a start X_WP [m]."""
    left, ordered, here = list(poses), [], start
    while left:
        here = left.pop(min(range(len(left)), key=lambda k: place_error(left[k], here)))
        ordered.append(here)
    return ordered


def rest_poses(
    robot: Robot, count: int, random: np.random.Generator, least: float | None = None
) -> tuple[list[RigidTransform], Array]:
    """Poses that tensions within the robot's limits hold, and those tensions.

    Args:
        robot: The robot.
        count: Number of poses k.
        random: Draws them from the robot's frame.
        least: Smallest tension [N]; default: a hundredth of the platform's weight, or the robot's.

    Returns:
        Poses X_WP [m], and tensions of least squares, shape (k, m) [N].

    Raises:
        CalibrationError: Hardly any pose can be held.
    """
    lower, upper = np.asarray(robot.frame.lower, float), np.asarray(robot.frame.upper, float)
    low, high = robot.tension_limits()
    if least is None:
        least = max(low, 0.01 * robot.platform.mass * robot.gravity)
    rim, R_WH = RIM * (upper - lower), robot.home.transform().rotation()
    cables = robot.cable_set()
    poses: list[RigidTransform] = []
    tensions: list[Array] = []
    for _ in range(DRAWS * count):
        place, turn = random.uniform(lower + rim, upper - rim), random.uniform(-1.0, 1.0, 3)
        if robot.is_planar():
            place[2], turn[:2] = robot.plane_height or 0.0, 0.0
        R = R_WH @ pose_from_angles(np.zeros(3), LARGEST_TURN * turn).rotation()
        X_WP = on_motion(robot, RigidTransform(R, place))
        try:
            problem = tension_problem(robot, X_WP, limits=(least, high), cables=cables)
            solution = distribute(problem, "quadratic_program")
        except CdprError:
            continue
        if solution.status == "feasible":
            poses.append(X_WP)
            tensions.append(np.asarray(solution.tensions, float))
            if len(poses) == count:
                return poses, np.array(tensions)
    raise CalibrationError(
        f"poses: found {len(poses)} of {DRAWS * count} drawn in the frame of {robot.name} that "
        f"tensions of {least:g} to {high:g} N hold; accepted: at least {count}"
    )

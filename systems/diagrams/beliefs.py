"""The robot as controller and estimators believe it to be, and what its winches truly do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.controllers.perturbation_settings import PoseShift
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.vision.pinhole import Pinhole

_POINTS, _INITIAL_POSE, _CAMERA, _WINCHES, _EXTERNAL_CAMERA, _TOLD_OBJECT = 1, 2, 3, 4, 5, 6
"""Streams of random numbers of one seed, so that one perturbation does not change another."""


def unshifted_robot(settings: VisualServoSettings, robot: Robot) -> BelievedRobot:
    """What is believed of the robot before anything is drawn or points are shifted.

    Of settings that differ in nothing but the seed it is the same.

    Raises:
        RobotFileError: The file that is believed cannot be read.
    """
    perturbations = settings.perturbations
    file = perturbations.believed_robot
    base = robot if file is None else load_robot(file)
    X_PC = base.camera_mount(settings.camera.mount).pose.transform()
    if perturbations.camera_pose is not None:
        X_PC = X_PC @ perturbations.camera_pose.transform()
    return BelievedRobot(
        cables=base.cable_set(),
        X_PC=X_PC,
        X_WP0=(perturbations.initial_pose or settings.initial_pose).transform(),
        motions=robot.servo_rows("a visual servo"),
        cable_speed=robot.winch.rated_cable_speed(),
    )


def believed_robot(
    settings: VisualServoSettings, robot: Robot, unshifted: BelievedRobot | None = None
) -> BelievedRobot:
    """The robot as controller and estimators believe it to be.

    Args:
        settings: The servo.
        robot: The robot.
        unshifted: What `unshifted_robot` gave for them, or for another seed; None: found here.

    Raises:
        RobotFileError: The file that they believe cannot be read.
    """
    perturbations = settings.perturbations
    before = unshifted_robot(settings, robot) if unshifted is None else unshifted

    def stream(number: int) -> np.random.Generator:
        return np.random.default_rng([settings.seed, number])

    true = before.cables
    m, points = true.count, stream(_POINTS)
    p_WA = true.p_WA + random_shifts(
        m, perturbations.exit_points, points, perturbations.exit_points_together
    )
    p_PB = true.p_PB + random_shifts(
        m, perturbations.anchor_points, points, perturbations.anchor_points_together
    )
    if perturbations.exit_point_shifts is not None:
        p_WA = p_WA + perturbations.exit_point_shifts.T
    if perturbations.anchor_point_shifts is not None:
        p_PB = p_PB + perturbations.anchor_point_shifts.T
    planar = before.motions == PLANAR_ROWS
    start, shift = before.X_WP0, perturbations.initial_pose_shift
    return replace(
        before,
        cables=replace(true, p_WA=p_WA, p_PB=p_PB),
        X_PC=shifted_pose(before.X_PC, perturbations.camera_pose_shift, stream(_CAMERA)),
        X_WP0=shifted_pose(start, shift, stream(_INITIAL_POSE), planar),
    )


def read_camera(settings: VisualServoSettings, robot: Robot) -> Pinhole:
    """The servo's camera with the belief by which its images are read.

    Raises:
        RobotFileError: A camera is unknown, or its file describes none.
    """
    camera, wrong = servo_pinhole(settings.camera, robot), settings.perturbations
    if wrong.camera_model is None and wrong.camera_distortion is None:
        return camera
    believed = camera
    if wrong.camera_model is not None:
        believed = load_camera(wrong.camera_model).pinhole(camera.width, camera.height)
    if wrong.camera_distortion is not None:
        believed = replace(believed, distortion=wrong.camera_distortion.lens())
    return replace(camera, believed=believed)


def believed_external_camera(settings: VisualServoSettings, robot: Robot) -> RigidTransform | None:
    """X_WE of the camera that looks at the platform's tag, as believed [m]; None without one."""
    tag, perturbations = settings.estimator.platform_tag, settings.perturbations
    if tag is None:
        return None
    X_WE = robot.camera_mount(tag.mount).pose.transform()
    if perturbations.external_camera is not None:
        X_WE = X_WE @ perturbations.external_camera.transform()
    random = np.random.default_rng([settings.seed, _EXTERNAL_CAMERA])
    return shifted_pose(X_WE, perturbations.external_camera_shift, random)


def told_object(settings: VisualServoSettings, X_WO: RigidTransform) -> RigidTransform:
    """Pose of the target as fusion is told of it, from the true one at time 0 [m]."""
    perturbations = settings.perturbations
    if perturbations.told_object is not None:
        X_WO = X_WO @ perturbations.told_object.transform()
    random = np.random.default_rng([settings.seed, _TOLD_OBJECT])
    return shifted_pose(X_WO, perturbations.told_object_shift, random)


def winch_offsets(settings: VisualServoSettings, count: int) -> Array | None:
    """Velocities by which winches pay out more than they are told, shape (count,) [m/s]; or None.

    True ones, of which neither controller nor estimators know.
    """
    mean = settings.perturbations.winch_offset
    spread = settings.perturbations.winch_offset_spread
    if mean == 0.0 and spread == 0.0:
        return None
    random = np.random.default_rng([settings.seed, _WINCHES])
    return np.asarray(mean + spread * random.uniform(-1.0, 1.0, count), float)


def random_shifts(
    count: int, distance: float, random: np.random.Generator, together: bool = False
) -> Array:
    """Vectors of one length in random directions, shape (3, count) [m].

    The directions are independent, or the same for all.
    """
    directions = random.standard_normal((3, 1 if together else count))
    shifts = distance * directions / np.linalg.norm(directions, axis=0)
    return np.asarray(np.broadcast_to(shifts, (3, count)), float).copy()


def shifted_pose(
    X_AB: RigidTransform, shift: PoseShift, random: np.random.Generator, planar: bool = False
) -> RigidTransform:
    """A pose off by a distance in a random direction of A and an angle about a random axis [m].

    If planar, the direction lies in the plane of x and y and the axis is z, with random sign.
    """
    direction, axis = random.standard_normal((2, 3))
    if planar:
        direction[2] = 0.0
        axis[:2] = 0.0
    turn = np.radians(shift.angle_deg) * axis / np.linalg.norm(axis)
    return RigidTransform(
        X_AB.rotation() @ rotation_from_vector(turn),
        X_AB.translation() + shift.distance * direction / np.linalg.norm(direction),
    )

"""What the fusing filter is made for, from the settings of a servo."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.sensor_catalogue import DepthSensorModel, load_depth_sensor
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.estimators.estimator_kinds import SENSOR_FUSION
from cdpr_drake.systems.estimators.fusion_task import CameraModel, FusionTask
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget, Target


def is_asked_for(settings: VisualServoSettings) -> bool:
    """Whether an estimator of a servo is of kind sensor_fusion."""
    estimator = settings.estimator
    return SENSOR_FUSION in (estimator.kind, *estimator.compare)


def steers(settings: VisualServoSettings) -> bool:
    """Whether a servo sees the target where the fused poses put it."""
    estimator = settings.estimator
    return estimator.kind == SENSOR_FUSION and estimator.sensor_fusion.steer


def fusion_task(
    settings: VisualServoSettings,
    robot: Robot,
    believed: BelievedRobot,
    seen: tuple[Target, Pinhole],
    told: tuple[RigidTransform | None, RigidTransform],
) -> FusionTask | None:
    """What the filter is made for; None where nobody asks for it.

    Args:
        settings: The servo, checked.
        robot: The robot's data.
        believed: That robot as it is believed to be.
        seen: The target, and the servo's camera.
        told: The camera in the world as it is believed, if there is one, and the target's pose as
            the filter is told of it [m].
    """
    if not is_asked_for(settings):
        return None
    tuning, camera, tag = settings.estimator.sensor_fusion, settings.camera, None
    (target, pinhole), (X_WE, X_WO) = seen, told
    on_board = external = None
    if tuning.on_board or steers(settings):
        assert isinstance(target, PointTarget)  # the settings were checked
        on_board = CameraModel(
            points=target.points,
            pinhole=pinhole,
            rate=camera.rate,
            latency=camera.latency_frames / camera.rate,
            used=tuning.on_board,
            depth=_depth_sensor(tuning.on_board_depth),
        )
    if tuning.external:
        tag = settings.estimator.platform_tag
        assert tag is not None  # the settings were checked
        mount = robot.camera_mount(tag.mount)
        rate = camera.rate if tag.rate is None else tag.rate
        frames = camera.latency_frames if tag.latency_frames is None else tag.latency_frames
        external = CameraModel(
            points=tag.target().points,
            pinhole=load_camera(mount.model).pinhole(camera.width, camera.height),
            rate=rate,
            latency=frames / rate,
            depth=_depth_sensor(tuning.external_depth),
        )
    imu = settings.sensors.imu if tuning.imu else None
    return FusionTask(
        X_WP0=believed.X_WP0,
        X_PC=believed.X_PC,
        counted=EncoderLengths(
            believed.cables if settings.controller.pulleys else believed.cables.without_pulleys(),
            True,
        ),
        tuning=tuning,
        rate=settings.controller.rate,
        on_board=on_board,
        external=external,
        X_WE=X_WE,
        X_PQ=None if tag is None else tag.pose.transform(),
        X_WO=None if tuning.told_object is None else X_WO,
        imu=None if imu is None else imu.model(),
        p_PS=np.zeros(3) if imu is None else imu.pose.transform().translation(),
        gravity=robot.gravity_vector(),
    )


def _depth_sensor(name: str | None) -> DepthSensorModel | None:
    return None if name is None else load_depth_sensor(name)

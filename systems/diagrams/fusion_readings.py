"""The camera in the world, and what depth cameras and an IMU read for the fusing filter."""

from __future__ import annotations

from collections.abc import Iterable

from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.sensor_catalogue import load_depth_sensor
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.estimators.sensor_fusion import SensorFusion
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.systems.sensors.depth_at_points import DepthAtPoints
from cdpr_drake.systems.sensors.sensor_settings import add_imu
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

PLATFORM_TAG_SEED = 15_485_863
"""Added to the seed, so that the pixel noise of the platform's tag is not that of the target."""

ON_BOARD_DEPTHS, EXTERNAL_DEPTHS = "on_board_depths", "external_depths"
"""Readings of depth cameras, and names of their blocks."""


def platform_camera(settings: VisualServoSettings, robot: Robot) -> ProjectedCamera:
    """The projected camera in the world that looks at the platform's tag."""
    camera, tag = settings.camera, settings.estimator.platform_tag
    assert tag is not None  # the settings were checked
    mount = robot.camera_mount(tag.mount)
    return ProjectedCamera(
        tag.target(),
        CameraMounting(mount.pose.transform(), tag.pose.transform()),
        load_camera(mount.model).pinhole(camera.width, camera.height),
        camera.rate if tag.rate is None else tag.rate,
        latency_frames=camera.latency_frames if tag.latency_frames is None else tag.latency_frames,
        pixel_noise=tag.pixel_noise,
        seed=settings.seed + PLATFORM_TAG_SEED,
        fault=tag.fault,
    )


def fusion_ports(estimators: Iterable[System]) -> dict[str, OutputPort]:
    """What a run logs of a fusing filter among estimators, by the name in the log."""
    found = [system for system in estimators if isinstance(system, SensorFusion)]
    names = ("fusion_sources", "fusion_nis", "fusion_covariance", "fusion_calibration")
    return {name: system.GetOutputPort(name) for system in found for name in names}


class FusionReadings:
    """Adds what reads depths and motion for the filter, when first asked."""

    def __init__(
        self,
        builder: DiagramBuilder,
        robot: RobotBlock,
        settings: VisualServoSettings,
        *,
        pinhole: Pinhole,
        X_WO: OutputPort | None,
        prefix: str = "",
    ) -> None:
        """With the builder that has the robot, the servo's camera and its target in the world;
        `prefix` stands before the names of blocks."""
        self._builder, self._robot, self._settings = builder, robot, settings
        self._pinhole, self._X_WO, self._prefix = pinhole, X_WO, prefix

    def inertial_motion(self) -> OutputPort:
        """What the IMU feels since the start."""
        imu = self._settings.sensors.imu
        assert imu is not None  # the settings were checked
        name = self._prefix + "imu"
        sensor = add_imu(self._builder, self._robot, imu, seed=self._settings.seed, name=name)
        return sensor.GetOutputPort("inertial_motion")

    def on_board_depths(self) -> OutputPort:
        """Depths of the target's points."""
        settings, camera = self._settings, self._settings.camera
        target = settings.target.target()
        kind = settings.estimator.sensor_fusion.on_board_depth
        assert isinstance(target, PointTarget)  # the settings were checked
        assert kind is not None
        mount = self._robot.robot.camera_mount(camera.mount)
        sensor = DepthAtPoints(
            load_depth_sensor(kind), target, CameraMounting(mount.pose.transform()), self._pinhole,
            camera.rate, latency_frames=camera.latency_frames, seed=settings.seed,
            name=ON_BOARD_DEPTHS, fault=camera.fault,
        )  # fmt: skip
        self._builder.AddNamedSystem(self._prefix + ON_BOARD_DEPTHS, sensor)
        assert self._X_WO is not None
        self._builder.Connect(self._X_WO, sensor.GetInputPort("X_WO"))
        return self._connected(sensor)

    def external_depths(self) -> OutputPort:
        """Depths of the points of the platform's tag."""
        settings, tag = self._settings, self._settings.estimator.platform_tag
        kind = settings.estimator.sensor_fusion.external_depth
        assert kind is not None
        assert tag is not None  # the settings were checked
        mount, camera = self._robot.robot.camera_mount(tag.mount), settings.camera
        sensor = DepthAtPoints(
            load_depth_sensor(kind),
            tag.target(),
            CameraMounting(mount.pose.transform(), tag.pose.transform()),
            load_camera(mount.model).pinhole(camera.width, camera.height),
            camera.rate if tag.rate is None else tag.rate,
            latency_frames=camera.latency_frames
            if tag.latency_frames is None
            else tag.latency_frames,
            seed=settings.seed,
            name=EXTERNAL_DEPTHS,
            fault=tag.fault,
        )
        self._builder.AddNamedSystem(self._prefix + EXTERNAL_DEPTHS, sensor)
        return self._connected(sensor)

    def _connected(self, sensor: DepthAtPoints) -> OutputPort:
        self._builder.Connect(self._robot.GetOutputPort("X_WP"), sensor.GetInputPort("X_WP"))
        return sensor.GetOutputPort("depths")

"""Adds the sensors that look round to a robot in somebody's builder."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import FrameId
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import Sine

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.rendered_camera import add_renderer, make_depth_camera
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.sensors.depth_sensor import DepthSensor, depth_pinhole
from cdpr_drake.systems.sensors.inertial_sensor import InertialMotion
from cdpr_drake.systems.sensors.pan_tilt import PanTilt
from cdpr_drake.systems.sensors.range_sensor import RangeSensor
from cdpr_drake.systems.sensors.scene_shapes import ROLES
from cdpr_drake.systems.sensors.sensor_settings import (
    HEAD,
    PLATFORM,
    WORLD,
    DepthSettings,
    InertialSettings,
    OdometrySettings,
    PanTiltSettings,
    RangeSettings,
    SensorSuite,
)
from cdpr_drake.systems.sensors.wheel_odometry import WheelOdometry
from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion
from cdpr_drake.trajectories.pose_trajectory import MovingPose


@dataclass(kw_only=True)
class PerceptionSensors:
    """The sensors that look round, in a builder.

    Attributes:
        ranges: Laser scanners and beams by name.
        imu: The inertial measurement unit, or None.
        depth: The depth camera, or None.
        pan_tilt: The head on two joints, or None.
        odometry: Odometry of the mobile robot, or None.
        logged: What a run logs of them, by the name in the log.
    """

    ranges: dict[str, RangeSensor] = field(default_factory=dict)
    imu: InertialMotion | None = None
    depth: DepthSensor | None = None
    pan_tilt: PanTilt | None = None
    odometry: WheelOdometry | None = None
    logged: dict[str, OutputPort] = field(default_factory=dict)


def add_perception_sensors(
    builder: DiagramBuilder,
    robot: RobotBlock,
    suite: SensorSuite,
    *,
    seed: int = 0,
    motion: MovingPose | None = None,
    name: str = "",
) -> PerceptionSensors:
    """Adds what a section `sensors` asks for beside what estimators read.

    Args:
        builder: The builder that has the robot.
        robot: The robot, with a scene graph.
        suite: The section.
        seed: Seed of all noise; each sensor draws from a stream of its own.
        motion: How the target moves, for odometry.
        name: Put before the names of the blocks: scan_NAME, imu, depth_camera, depth, pan_tilt,
            pan_tilt_command, odometry.

    Raises:
        RenderingError: There is a depth camera, and EGL is missing.
        ScenarioError: Odometry is asked for of a target that no mobile robot carries, or something
            that is not there carries a sensor.
    """
    adder = _Adder(builder, robot, seed, f"{name}_" if name else "")
    if suite.pan_tilt is not None:
        adder.add_pan_tilt(suite.pan_tilt)
    for sensor in suite.range_sensors:
        adder.add_range_sensor(sensor)
    if suite.imu is not None:
        adder.add_imu(suite.imu)
    if suite.depth is not None:
        adder.add_depth(suite.depth)
    if suite.odometry is not None:
        adder.add_odometry(suite.odometry, motion)
    return adder.added


def add_imu(
    builder: DiagramBuilder,
    robot: RobotBlock,
    settings: InertialSettings,
    *,
    seed: int = 0,
    name: str = "imu",
) -> InertialMotion:
    """Adds an inertial measurement unit to a robot, or returns that of this name; its settings are
    those of the section `sensors`, its noise depends on the seed."""
    if builder.HasSubsystemNamed(name):
        there: InertialMotion = builder.GetSubsystemByName(name)
        return there
    sensor = builder.AddNamedSystem(
        name,
        InertialMotion(
            settings.model(), settings.pose.transform(),
            body=int(robot.in_plant.body_index),
            gravity=robot.robot.gravity_vector(), seed=seed,
        ),
    )  # fmt: skip
    for port in ("X_WP", "body_velocities", "body_accelerations"):
        builder.Connect(robot.GetOutputPort(port), sensor.GetInputPort(port))
    return sensor


class _Adder:
    """The builder, the robot and what was added so far."""

    def __init__(self, builder: DiagramBuilder, robot: RobotBlock, seed: int, prefix: str) -> None:
        self._builder, self._robot, self._seed, self._prefix = builder, robot, seed, prefix
        self._head_carrier = ""
        self.added = PerceptionSensors()

    def _frame(self, carrier: str, sees: str = "perception") -> FrameId:
        """Geometry frame of what carries a sensor, or the head on which it is.

        A thing that is both seen and touched can have two frames of its name, which move as one:
        that with the shapes which the sensor sees, since it is not to see its carrier.
        """
        plant, scene_graph = self._robot.plant, self._robot.scene_graph
        if carrier == HEAD:
            carrier = self._head_carrier
        if carrier in (PLATFORM, WORLD):
            body = plant.world_body() if carrier == WORLD else self._robot.in_plant.body
            return plant.GetBodyFrameIdOrThrow(body.index())
        assert scene_graph is not None
        inspector = scene_graph.model_inspector()
        frames = {
            inspector.GetName(frame).split("::")[-1]: frame
            for frame in sorted(
                inspector.GetAllFrameIds(),
                key=lambda frame: inspector.NumGeometriesForFrameWithRole(frame, ROLES[sees]),
            )
            if frame != inspector.world_frame_id()
        }
        if carrier not in frames:
            raise ScenarioError(
                f"sensors: carrier: found {carrier}; accepted: {PLATFORM}, {WORLD}, {HEAD}, or "
                "what moves in the scene: " + ", ".join(sorted(frames))[:200]
            )
        return frames[carrier]

    def add_pan_tilt(self, settings: PanTiltSettings) -> None:
        """The head, and the sines that command it."""
        head = self._builder.AddNamedSystem(
            self._prefix + "pan_tilt",
            PanTilt(
                settings.joints(), settings.pose.transform(), arm=settings.arm,
                mode=settings.mode, rate=settings.rate, seed=self._seed,
            ),
        )  # fmt: skip
        frequencies = 2.0 * np.pi / settings.swing_period
        sines = self._builder.AddNamedSystem(
            self._prefix + "pan_tilt_command",
            Sine(np.radians(settings.swing_deg), frequencies, np.zeros(2)),
        )
        wanted = 0 if settings.mode == "position" else 1
        self._builder.Connect(sines.get_output_port(wanted), head.GetInputPort("command"))
        self._head_carrier = settings.carrier
        self.added.pan_tilt = head
        self.added.logged["pan_tilt_angles"] = head.GetOutputPort("angles")
        self.added.logged["pan_tilt_encoders"] = head.GetOutputPort("encoder_angles")

    def add_range_sensor(self, settings: RangeSettings) -> None:
        """A laser scanner or a beam."""
        title = f"scan_{settings.name}"
        carrier = self._head_carrier if settings.carrier == HEAD else settings.carrier
        sensor = self._builder.AddNamedSystem(
            self._prefix + title,
            RangeSensor(
                settings.model(), self._frame(settings.carrier, settings.sees),
                settings.pose.transform(), name=settings.name, seed=self._seed, sees=settings.sees,
                sees_parent=carrier == WORLD,
            ),
        )  # fmt: skip
        self._builder.Connect(
            self._robot.GetOutputPort("query_object"), sensor.GetInputPort("query_object")
        )
        if settings.carrier == HEAD:
            assert self.added.pan_tilt is not None
            self._builder.Connect(
                self.added.pan_tilt.GetOutputPort("X_BH"), sensor.GetInputPort("X_BH")
            )
        self.added.ranges[settings.name] = sensor
        self.added.logged[title] = sensor.GetOutputPort("ranges")

    def add_imu(self, settings: InertialSettings) -> None:
        """The inertial measurement unit."""
        sensor = add_imu(
            self._builder, self._robot, settings, seed=self._seed, name=self._prefix + "imu"
        )
        self.added.imu = sensor
        for port in ("specific_force", "angular_velocity", "imu_biases"):
            self.added.logged[port] = sensor.GetOutputPort(port)

    def add_depth(self, settings: DepthSettings) -> None:
        """The depth camera and what Drake renders for it."""
        scene_graph, model = self._robot.scene_graph, settings.model()
        assert scene_graph is not None
        add_renderer(scene_graph)
        camera = self._builder.AddNamedSystem(
            self._prefix + "depth_camera",
            make_depth_camera(
                self._frame(settings.carrier), settings.pose.transform(), depth_pinhole(model),
                (float(model.limits[0]), float(model.limits[1])),
            ),
        )  # fmt: skip
        sensor = self._builder.AddNamedSystem(
            self._prefix + "depth", DepthSensor(model, seed=self._seed)
        )
        self._builder.Connect(
            self._robot.GetOutputPort("query_object"), camera.GetInputPort("geometry_query")
        )
        self._builder.Connect(
            camera.GetOutputPort("depth_image_32f"), sensor.GetInputPort("rendered")
        )
        self.added.depth = sensor
        self.added.logged["depth_row"] = sensor.GetOutputPort("depth_row")

    def add_odometry(self, settings: OdometrySettings, motion: MovingPose | None) -> None:
        """Odometry of the mobile robot."""
        if not isinstance(motion, MobileRobotMotion):
            raise ScenarioError(
                "sensors.odometry: found a target that no mobile robot carries; accepted: null, or "
                "target.motion.mobile_robot"
            )
        sensor = self._builder.AddNamedSystem(
            self._prefix + "odometry",
            WheelOdometry(motion, settings.wheels(), seed=self._seed, rate=settings.rate),
        )
        self.added.odometry = sensor
        self.added.logged["X_WO_odometry"] = sensor.GetOutputPort("X_WO_odometry")
        self.added.logged["wheel_distances"] = sensor.GetOutputPort("wheel_distances")

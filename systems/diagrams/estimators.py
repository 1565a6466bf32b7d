"""What estimators read: ports of servo and camera, sensors, and a camera's view of a known tag."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import ConstantValueSource

from cdpr_drake.errors import CdprError, accepted_names
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, REGION
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.target_measurement import TargetDetector
from cdpr_drake.systems.diagrams.camera import add_region_camera, projected_camera
from cdpr_drake.systems.diagrams.fusion_readings import FusionReadings, platform_camera
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS, EstimatorTask
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS
from cdpr_drake.systems.sensors.sensor_readings import SensorReadings
from cdpr_drake.vision.pinhole import Pinhole

KNOWN_TAG_SEED = 7919
"""Added to the seed, so that the pixel noise of the known tag is not that of the target."""


class EstimatorInputs:
    """Offers ports to estimators by name, and adds the sensors behind them when first asked.

    ================= ============== ===== ====================================================
    name              type           unit  meaning
    ================= ============== ===== ====================================================
    platform_velocity vector(6)      rad/s from the servo
                                     m/s
    X_CO, found       as the camera  m, -  from the camera
    measured_lengths  vector(m)      m     lengths that the encoders count
    measured_tensions vector(m)      N     from the tension sensors
    X_WP_measured     RigidTransform m     from the tracker
    X_CK              RigidTransform m     pose of the known tag in the camera
    known_tag_found   vector(1)      -     1 while it is seen
    X_CQ              RigidTransform m     pose of the tag on the platform in the second camera
    platform_tag_found vector(1)     -     1 while it is seen
    inertial_motion   vector(19)     rad m what the IMU feels since the start
    on_board_depths   vector(n)      m     depths of the target's points
    external_depths   vector(n)      m     depths of the points of the tag on the platform
    ================= ============== ===== ====================================================

    Those from sensors are those of `SensorReadings`.
    """

    def __init__(
        self,
        builder: DiagramBuilder,
        robot: RobotBlock,
        settings: VisualServoSettings,
        *,
        pinhole: Pinhole,
        readings: SensorReadings,
        ports: Mapping[str, OutputPort],
        X_WO: OutputPort | None = None,
        name: str = "",
    ) -> None:
        """With the builder that has the robot, the ports that are there already, and the true pose
        of a target in the world; `name` stands before the names of blocks."""
        self._builder, self._settings, self._block = builder, settings, robot
        self._pinhole, self._prefix = pinhole, f"{name}_" if name else ""
        self._ports = dict(ports)
        fusion = FusionReadings(
            builder, robot, settings, pinhole=pinhole, X_WO=X_WO, prefix=self._prefix
        )
        self._makers: dict[str, Callable[[], OutputPort]] = {
            **{k.reading: partial(readings.port, k.reading) for k in SENSORS.values()},
            "X_CK": lambda: self._known_tag("X_CO"),
            "known_tag_found": lambda: self._known_tag("found"),
            "X_CQ": lambda: self._platform_tag("X_CO"),
            "platform_tag_found": lambda: self._platform_tag("found"),
            "inertial_motion": fusion.inertial_motion,
            "on_board_depths": fusion.on_board_depths,
            "external_depths": fusion.external_depths,
        }

    def connect(self, estimator: System) -> None:
        """Connects every input of an estimator that was added to the builder.

        Raises:
            CdprError: An input has a name that nothing offers; names what there is.
        """
        for index in range(estimator.num_input_ports()):
            port = estimator.get_input_port(index)
            self._builder.Connect(self.port(port.get_name()), port)

    def port(self, name: str) -> OutputPort:
        """The port of that name.

        Raises:
            CdprError: Nothing of that name is offered; names what is.
        """
        if name not in self._ports and name not in self._makers:
            offered = sorted({*self._ports, *self._makers})
            raise CdprError(
                f"input port of an estimator: found {name!r}; {accepted_names(name, offered)}"
            )
        if name not in self._ports:
            self._ports[name] = self._makers[name]()
        return self._ports[name]

    def _platform_tag(self, name: str) -> OutputPort:
        """A second camera, in the world, that sees a tag on the platform."""
        block = self._prefix + "platform_tag_camera"
        if not self._builder.HasSubsystemNamed(block):
            projected = platform_camera(self._settings, self._block.robot)
            self._builder.AddNamedSystem(block, projected)
            self._builder.Connect(self._block.GetOutputPort("X_WP"), projected.GetInputPort("X_WP"))
        return self._builder.GetSubsystemByName(block).GetOutputPort(name)

    def _known_tag(self, name: str) -> OutputPort:
        camera = self._prefix + "known_tag_camera"
        if not self._builder.HasSubsystemNamed(camera):
            self._add_known_tag_camera(camera)
        return self._builder.GetSubsystemByName(camera).GetOutputPort(name)

    def _add_known_tag_camera(self, name: str) -> None:
        """A second look at the image, a second region of it, or a second projection, by the camera
        of the servo."""
        settings, builder = self._settings, self._builder
        camera, tag = settings.camera, settings.estimator.known_tag
        assert tag is not None  # the settings were checked
        target, bias = tag.target(), settings.perturbations.image_bias
        if camera.kind == PROJECTED:
            projected = builder.AddNamedSystem(
                name, known_tag_camera(settings, self._block.robot, self._pinhole)
            )
            pose = builder.AddNamedSystem(
                self._prefix + "known_tag", ConstantValueSource(Value(tag.pose.transform()))
            )
            builder.Connect(self._block.GetOutputPort("X_WP"), projected.GetInputPort("X_WP"))
            builder.Connect(pose.get_output_port(), projected.GetInputPort("X_WO"))
        elif camera.region == REGION:
            add_region_camera(
                builder,
                self._block,
                camera,
                target=target,
                mounting=CameraMounting(
                    self._block.robot.camera_mount(camera.mount).pose.transform()
                ),
                pinhole=self._pinhole,
                image_bias=bias,
                name=name,
            )
        else:
            detector = TargetDetector(
                target, self._pinhole, camera.rate, camera.latency_frames, bias
            )
            builder.AddNamedSystem(name, detector)
            sensor = builder.GetSubsystemByName(self._prefix + "camera")
            builder.Connect(
                sensor.GetOutputPort("color_image"), detector.GetInputPort("color_image")
            )


def known_tag_camera(
    settings: VisualServoSettings, robot: Robot, pinhole: Pinhole
) -> ProjectedCamera:
    """The projected camera of a servo as it sees the known tag."""
    camera, tag = settings.camera, settings.estimator.known_tag
    assert tag is not None  # the settings were checked
    mounting = CameraMounting(robot.camera_mount(camera.mount).pose.transform())
    return projected_camera(
        camera, tag.target(), mounting, pinhole,
        seed=settings.seed + KNOWN_TAG_SEED, image_bias=settings.perturbations.image_bias,
    )  # fmt: skip


def add_estimator(
    builder: DiagramBuilder,
    kind: str,
    task: EstimatorTask,
    inputs: EstimatorInputs,
    *,
    name: str = "estimator",
) -> System:
    """Adds an estimator of the platform's pose with all that it reads; its output is X_WP.

    Args:
        builder: The builder that has the robot.
        kind: A name of `ESTIMATORS`.
        task: What it is made for.
        inputs: Where it reads.
        name: Name of the block.
    """
    estimator = builder.AddNamedSystem(name, ESTIMATORS[kind].make(task))
    inputs.connect(estimator)
    return estimator

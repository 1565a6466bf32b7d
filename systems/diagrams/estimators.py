"""What estimators read: ports of servo and camera, sensors, and a camera's view of a known tag."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import ConstantValueSource

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.cameras.camera_mounting import Sight
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.target_detector import TargetDetector
from cdpr_drake.systems.diagrams.estimator_kinds import ESTIMATORS, EstimatorTask
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.readings import READINGS, ScenarioReadings
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
    ================= ============== ===== ====================================================

    Those from sensors are those of `ScenarioReadings`.
    """

    def __init__(
        self,
        builder: DiagramBuilder,
        scenario: Scenario,
        robot: Robot,
        block: CableRobot,
        pinhole: Pinhole,
        readings: ScenarioReadings,
        ports: Mapping[str, OutputPort],
    ) -> None:
        """With the builder of the scenario's diagram, and the ports that are there already."""
        self._builder, self._scenario, self._robot = builder, scenario, robot
        self._block, self._pinhole = block, pinhole
        self._ports = dict(ports)
        self._makers: dict[str, Callable[[], OutputPort]] = {
            **{name: partial(readings.port, name) for name in READINGS.values()},
            "X_CK": lambda: self._known_tag("X_CO"),
            "known_tag_found": lambda: self._known_tag("found"),
        }

    def connect(self, estimator: System) -> None:
        """Connects every input of an estimator that was added to the builder."""
        for index in range(estimator.num_input_ports()):
            port = estimator.get_input_port(index)
            self._builder.Connect(self.port(port.get_name()), port)

    def port(self, name: str) -> OutputPort:
        """The port of that name."""
        if name not in self._ports:
            self._ports[name] = self._makers[name]()
        return self._ports[name]

    def _known_tag(self, name: str) -> OutputPort:
        if not self._builder.HasSubsystemNamed("known_tag_camera"):
            self._add_known_tag_camera()
        return self._builder.GetSubsystemByName("known_tag_camera").GetOutputPort(name)

    def _add_known_tag_camera(self) -> None:
        """A second look at the image, or a second projection, by the camera of the scenario."""
        camera, tag = self._scenario.camera, self._scenario.estimator.known_tag
        assert tag is not None  # the scenario was checked
        builder, block = self._builder, self._block
        target = tag.target()
        if camera.kind == "projected":
            projected = ProjectedCamera(
                target,
                Sight(self._robot.camera_mount(camera.mount).pose.transform()),
                self._pinhole,
                camera.rate,
                camera.latency_frames,
                camera.pixel_noise,
                self._scenario.seed + KNOWN_TAG_SEED,
                self._scenario.perturbations.image_bias,
            )
            builder.AddNamedSystem("known_tag_camera", projected)
            pose = builder.AddNamedSystem(
                "known_tag", ConstantValueSource(Value(tag.pose.transform()))
            )
            builder.Connect(block.GetOutputPort("X_WP"), projected.GetInputPort("X_WP"))
            builder.Connect(pose.get_output_port(), projected.GetInputPort("X_WO"))
        else:
            detector = TargetDetector(
                target,
                self._pinhole,
                camera.rate,
                camera.latency_frames,
                self._scenario.perturbations.image_bias,
            )
            builder.AddNamedSystem("known_tag_camera", detector)
            sensor = builder.GetSubsystemByName("camera")
            builder.Connect(
                sensor.GetOutputPort("color_image"), detector.GetInputPort("color_image")
            )


def add_estimators(
    builder: DiagramBuilder,
    task: EstimatorTask,
    robot: Robot,
    block: CableRobot,
    measurement: System,
    servo: System,
    readings: ScenarioReadings,
) -> list[System]:
    """Adds the scenario's estimator, then those to compare it with, with all that they read."""
    ports = {
        name: system.GetOutputPort(name)
        for system, names in (
            (measurement, ("X_CO", "found")),
            (servo, ("platform_velocity",)),
        )
        for name in names
    }
    inputs = EstimatorInputs(builder, task.scenario, robot, block, task.pinhole, readings, ports)
    settings = task.scenario.estimator
    kinds = {"estimator": settings.kind, **{f"estimator_{k}": k for k in settings.compare}}
    estimators = []
    for name, kind in kinds.items():
        estimators.append(builder.AddNamedSystem(name, ESTIMATORS[kind].make(task)))
        inputs.connect(estimators[-1])
    return estimators

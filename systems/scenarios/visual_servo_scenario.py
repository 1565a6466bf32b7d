"""The schema of a scenario file for one run of a visual servo, with units and accepted ranges.

`VisualServoSettings` are all settings of a visual servo on a robot: what it looks at, how it moves,
what it believes. `Scenario` adds the robot, and when and how it is run.
"""

from typing import Annotated

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, filled, settings
from cdpr_drake.systems.cameras.camera_settings import CameraSettings
from cdpr_drake.systems.cameras.targets import TargetSettings
from cdpr_drake.systems.controllers.open_loop_servo import OpenLoopSettings
from cdpr_drake.systems.controllers.perturbation_settings import Perturbations
from cdpr_drake.systems.controllers.servo_settings import (
    ControllerSettings,
    FeatureTrajectory,
    NextTask,
)
from cdpr_drake.systems.controllers.tension_management_settings import TensionManagement
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.estimators.estimator_kinds import EstimatorSettings
from cdpr_drake.systems.robots.settings import CableRobotSettings
from cdpr_drake.systems.scenarios.files import VISUAL_SERVO
from cdpr_drake.systems.scenarios.run_settings import (
    IntegrationSettings,
    ScenarioHeader,
    StopSettings,
)
from cdpr_drake.systems.sections import with_sections
from cdpr_drake.systems.sensors.sensor_settings import SensorSuite


@settings
@with_sections("visual_servo")
class VisualServoSettings:
    """A visual servo on a robot: camera, target, law, estimator, sensors and model errors."""

    seed: Annotated[int, In(ge=0), "Seed of noise and random directions."] = 0
    initial_pose: Annotated[Pose, "Pose of the platform in W at time 0."]
    desired: Annotated[Pose, "Desired pose of the target in the camera frame."]
    next_tasks: Annotated[
        list[NextTask], "Desired poses that take over later, without a jump of the velocity."
    ] = filled(list)
    target: Annotated[TargetSettings, "What the camera looks at."]
    camera: Annotated[CameraSettings, "The camera."] = filled(CameraSettings)
    controller: Annotated[ControllerSettings, "The visual servo."]
    trajectory: Annotated[
        FeatureTrajectory | None,
        "A path of the features to track; null: straight for the desired ones.",
    ] = None
    open_loop: Annotated[
        OpenLoopSettings | None,
        "A planned motion of the platform instead of visual servoing; null: none.",
    ] = None
    estimator: Annotated[EstimatorSettings, "The estimator."] = filled(EstimatorSettings)
    sensors: Annotated[SensorSuite, "Sensors."] = filled(SensorSuite)
    tension_management: Annotated[
        TensionManagement | None,
        "What takes up slack beside the servo; null: nobody looks after the tensions.",
    ] = None
    torque_control: Annotated[
        TorqueControl | None,
        "How winches are commanded by torque, with winches.mode torque; null: its defaults.",
    ] = None
    perturbations: Annotated[Perturbations, "Model errors."] = filled(Perturbations)

    def tasks(self) -> list[NextTask]:
        """The desired poses in the order of their times; the first one holds from time 0."""
        return [NextTask(time=0.0, desired=self.desired), *self.next_tasks]

    def target_rests(self) -> bool:
        """Whether the target rests in the world, so that images tell how the platform moves."""
        return self.target.carrier == "world" and not self.target.path().is_moving()


DEFAULT_SCENARIO = "acrobot_pbvs_taut"


@settings
class Scenario(VisualServoSettings, CableRobotSettings, ScenarioHeader):
    """One run of a visual servo on a cable robot: both, and when and how it is run."""

    kind: Annotated[str, OneOf((VISUAL_SERVO,)), "Kind of run."] = VISUAL_SERVO
    stop: Annotated[StopSettings, "When the run ends."]
    integration: Annotated[IntegrationSettings, "Integration."] = filled(IntegrationSettings)
    log_rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Rows of the log per second."] = 50.0

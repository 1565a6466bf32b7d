"""The schema of a scenario file for one run of a visual servo, with units and accepted ranges.

`VisualServoSettings` are all settings of a visual servo on a robot: what it looks at, how it moves,
what it believes. `Scenario` adds the robot, and when and how it is run.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import (
    FASTEST,
    number,
    optional_section,
    section,
    sections,
    text,
    whole,
)
from cdpr_drake.systems.cameras.camera_settings import CameraSettings
from cdpr_drake.systems.cameras.targets import TargetSettings
from cdpr_drake.systems.controllers.emergency import EmergencySettings
from cdpr_drake.systems.controllers.open_loop_servo import OpenLoopSettings
from cdpr_drake.systems.controllers.perturbation_settings import Perturbations
from cdpr_drake.systems.controllers.planned_pose_servo import PosePlanSettings
from cdpr_drake.systems.controllers.servo_settings import (
    ControllerSettings,
    FeatureTrajectory,
    NextTask,
)
from cdpr_drake.systems.controllers.tension_management_settings import TensionManagement
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.estimators.estimator_kinds import EstimatorSettings
from cdpr_drake.systems.estimators.geometry_learner import Adaptation
from cdpr_drake.systems.estimators.wrench_estimator import WrenchEstimation
from cdpr_drake.systems.monitoring.stability_watch import StabilitySettings
from cdpr_drake.systems.remote.settings import RemoteSettings
from cdpr_drake.systems.robots.settings import CableRobotSettings
from cdpr_drake.systems.scenarios.files import VISUAL_SERVO
from cdpr_drake.systems.scenarios.run_settings import (
    IntegrationSettings,
    ScenarioHeader,
    StopSettings,
)
from cdpr_drake.systems.sensors.sensor_settings import SensorSuite


@dataclass(kw_only=True)
class VisualServoSettings:
    """A visual servo on a robot: camera, target, law, estimator, sensors and model errors."""

    seed: int = whole("Seed of noise and random directions.", 0, at_least=0)
    initial_pose: Pose = section("Pose of the platform in W at time 0.", Pose)
    desired: Pose = section("Desired pose of the target in the camera frame.", Pose)
    next_tasks: list[NextTask] = sections(
        "Desired poses that take over later, without a jump of the velocity.", required=False
    )
    target: TargetSettings = section("What the camera looks at.", TargetSettings)
    camera: CameraSettings = section("The camera.", CameraSettings, required=False)
    controller: ControllerSettings = section("The visual servo.", ControllerSettings)
    trajectory: FeatureTrajectory | None = optional_section(
        "A path of the features to track; null: straight for the desired ones."
    )
    open_loop: OpenLoopSettings | None = optional_section(
        "A planned motion of the platform instead of visual servoing; null: none."
    )
    pose_plan: PosePlanSettings | None = optional_section(
        "A planned way to the pose from which the target is seen as desired, instead of visual "
        "servoing; null: none."
    )
    estimator: EstimatorSettings = section("The estimator.", EstimatorSettings, required=False)
    sensors: SensorSuite = section("Sensors.", SensorSuite, required=False)
    tension_management: TensionManagement | None = optional_section(
        "What takes up slack beside the servo; null: nobody looks after the tensions."
    )
    wrench_estimation: WrenchEstimation | None = optional_section(
        "An estimate of what pushes the platform, which is logged; null: none."
    )
    adaptation: Adaptation | None = optional_section(
        "Exit and anchor points and lengths at the start, learnt while the servo runs; null: what "
        "is believed at the start stays."
    )
    torque_control: TorqueControl | None = optional_section(
        "How winches are commanded by torque, with winches.mode torque; null: its defaults."
    )
    perturbations: Perturbations = section("Model errors.", Perturbations, required=False)
    remote: RemoteSettings | None = optional_section(
        "A process outside in the place of a block, see cdpr serve; null: none."
    )

    def tasks(self) -> list[NextTask]:
        """The desired poses in the order of their times; the first one holds from time 0."""
        return [NextTask(time=0.0, desired=self.desired), *self.next_tasks]

    def target_rests(self) -> bool:
        """Whether the target rests in the world, so that images tell how the platform moves."""
        return self.target.carrier == "world" and not self.target.path().is_moving()


DEFAULT_SCENARIO = "acrobot_pbvs_taut"


@dataclass(kw_only=True)
class Scenario(VisualServoSettings, CableRobotSettings, ScenarioHeader):
    """One run of a visual servo on a cable robot: both, and when and how it is run."""

    kind: str = text("Kind of run.", VISUAL_SERVO, choices=(VISUAL_SERVO,))
    stop: StopSettings = section("When the run ends.", StopSettings)
    integration: IntegrationSettings = section("Integration.", IntegrationSettings, required=False)
    stability: StabilitySettings | None = optional_section(
        "The stability criterion along the run, in its log; null: not logged."
    )
    emergency: EmergencySettings | None = optional_section(
        "What is done when a cable has broken, beside section failures; null: nothing."
    )
    log_rate: float = number("Rows of the log per second.", "Hz", 50.0, above=0.0, at_most=FASTEST)

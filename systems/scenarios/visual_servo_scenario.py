"""The schema of a scenario file: one servo run, with units and accepted ranges.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import number, optional_section, section, sections, text, whole
from cdpr_drake.systems.cameras.settings import CameraSettings
from cdpr_drake.systems.cameras.target_settings import Target
from cdpr_drake.systems.estimators.settings import EstimatorSettings
from cdpr_drake.systems.robots.settings import CableSettings, DampingSettings, WinchSettings
from cdpr_drake.systems.scenarios.files import VISUAL_SERVO
from cdpr_drake.systems.scenarios.run_settings import IntegrationSettings, StopSettings
from cdpr_drake.systems.sensors.settings import SensorSettings
from cdpr_drake.systems.servos.open_loop_settings import OpenLoopSettings
from cdpr_drake.systems.servos.perturbation_settings import Perturbations
from cdpr_drake.systems.servos.settings import ControllerSettings, FeatureTrajectory, NextTask

DEFAULT_SCENARIO = "acrobot_pbvs"


@dataclass(kw_only=True)
class Scenario:
    """One run of a visual servo on a cable robot."""

    kind: str = text("Kind of run.", VISUAL_SERVO, choices=(VISUAL_SERVO,))
    name: str = text("Name, the same as that of its file.")
    title: str = text("What it shows, in one line.")
    source: str = text("Where its values stand.", "")
    robot: str = text(
        "Robot by name, or path of a robot file, from this file or the working folder."
    )
    duration: float = number("Longest simulated time.", "s", above=0.0)
    seed: int = whole("Seed of noise and random directions.", 0, at_least=0)
    initial_pose: Pose = section("Pose of the platform in W at time 0.", Pose)
    desired: Pose = section("Desired pose of the target in the camera frame.", Pose)
    next_tasks: list[NextTask] = sections(
        "Desired poses that take over later, without a jump of the velocity.", required=False
    )
    cables: CableSettings = section("The simulated cables.", CableSettings, required=False)
    damping: DampingSettings = section(
        "What brakes the platform beside its cables.", DampingSettings, required=False
    )
    target: Target = section("What the camera looks at.", Target)
    winches: WinchSettings = section("The winches.", WinchSettings, required=False)
    camera: CameraSettings = section("The camera.", CameraSettings, required=False)
    controller: ControllerSettings = section("The visual servo.", ControllerSettings)
    trajectory: FeatureTrajectory | None = optional_section(
        "A way of the features to track; null: straight for the desired ones."
    )
    open_loop: OpenLoopSettings | None = optional_section(
        "A planned motion of the platform instead of visual servoing; null: none."
    )
    estimator: EstimatorSettings = section("The estimator.", EstimatorSettings, required=False)
    sensors: SensorSettings = section("Sensors.", SensorSettings, required=False)
    perturbations: Perturbations = section("Model errors.", Perturbations, required=False)
    stop: StopSettings = section("When the run ends.", StopSettings)
    integration: IntegrationSettings = section("Integration.", IntegrationSettings, required=False)
    log_rate: float = number("Rows of the log per second.", "Hz", 50.0, above=0.0)

"""The schema of a scenario file: one servo run, with units and accepted ranges.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from cdpr_drake.fields import number, optional_section, section, sections, text, whole
from cdpr_drake.models import Pose
from cdpr_drake.systems.scenario_cables import CableSettings
from cdpr_drake.systems.scenario_camera import CameraSettings
from cdpr_drake.systems.scenario_checks import check_scenario
from cdpr_drake.systems.scenario_controller import ControllerSettings, NextTask
from cdpr_drake.systems.scenario_damping import DampingSettings
from cdpr_drake.systems.scenario_estimator import EstimatorSettings
from cdpr_drake.systems.scenario_files import VISUAL_SERVO, load_with_robot
from cdpr_drake.systems.scenario_open_loop import OpenLoopSettings
from cdpr_drake.systems.scenario_perturbations import Perturbations
from cdpr_drake.systems.scenario_run import IntegrationSettings, StopSettings
from cdpr_drake.systems.scenario_sensors import SensorSettings
from cdpr_drake.systems.scenario_target import Target
from cdpr_drake.systems.scenario_trajectory import FeatureTrajectory
from cdpr_drake.systems.scenario_winches import WinchSettings

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


def load_scenario(name: str, overrides: Sequence[str] = ()) -> Scenario:
    """Reads a scenario by name or by path to a YAML file, and checks it against its robot.

    Args:
        name: Name or path.
        overrides: Items "key.subkey=value" that replace what the file says.

    Raises:
        ScenarioError: Unknown or malformed scenario, or its robot cannot do what it asks.
        RobotFileError: Its robot's file does not describe a possible robot.
    """
    scenario, robot, path = load_with_robot(Scenario, name, overrides)
    check_scenario(scenario, robot, path)
    return scenario

"""The schema of a scenario file: one servo run, with units and accepted ranges.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.apriltag import TAG_COUNT
from cdpr_drake.errors import RobotFileError, ScenarioError
from cdpr_drake.explicit_step import explicit_integrators
from cdpr_drake.fields import number, optional_section, section, text, whole
from cdpr_drake.models import Pose, Robot, load_robot
from cdpr_drake.systems.scenario_files import VISUAL_SERVO, robot_beside, scenario_file
from cdpr_drake.typed_yaml import closest, load_typed

DEFAULT_SCENARIO = "acrobot_pbvs"


@dataclass(kw_only=True)
class Target:
    """The AprilTag 36h11 that the camera servos on."""

    tag_id: int = whole("Identity of the tag.", 0, at_least=0, at_most=TAG_COUNT - 1)
    size: float = number("Edge of the black square.", "m", above=0.0)
    pose: Pose = section("Pose of the tag frame O in W: x right, y up, z out of the tag.", Pose)


@dataclass(kw_only=True)
class CameraSettings:
    """The camera that looks at the target."""

    kind: str = text(
        "rendered draws images and detects the tag in them; projected projects its corners.",
        "rendered",
        choices=("rendered", "projected"),
    )
    mount: str = text("Which of the robot's camera mountings.", "onboard")
    width: int = whole("Image width.", 640, "px", at_least=16, at_most=8192)
    height: int = whole("Image height.", 480, "px", at_least=16, at_most=8192)
    rate: float = number("Images per second.", "Hz", 25.0, above=0.0)
    latency_frames: int = whole("Delay from image to controller.", 0, "frames", at_least=0)
    pixel_noise: float = number(
        "Standard deviation of a corner's coordinates; projected camera only.",
        "px",
        0.1,
        at_least=0.0,
    )


@dataclass(kw_only=True)
class ControllerSettings:
    """The visual servo."""

    scheme: str = text("Visual servoing scheme.", "pbvs", choices=("pbvs",))
    rate: float = number("Control steps per second.", "Hz", 25.0, above=0.0)
    lambda_0: float = number("Gain at zero error.", "1/s", above=0.0)
    lambda_infinity: float = number("Gain at large errors.", "1/s", above=0.0)
    lambda_slope: float = number("Slope of the gain at zero error.", "1/s", at_least=0.0)
    sigma: float | None = number(
        "Rate of the continuous start; null starts abruptly.", "1/s", None, above=0.0
    )


@dataclass(kw_only=True)
class EstimatorSettings:
    """The estimator of the platform's pose."""

    kind: str = text("Estimator.", "control_integration", choices=("control_integration",))


@dataclass(kw_only=True)
class Perturbations:
    """What the controller believes wrongly; the simulated robot stays as its file says."""

    initial_pose: Pose | None = optional_section(
        "Pose of the platform in W that the estimator starts from; null: the true one."
    )
    camera_pose: Pose | None = optional_section(
        "Pose, in the true camera frame, of the camera frame that the controller assumes."
    )
    exit_points: float = number(
        "Distance of each assumed exit point from the true one, in a random direction.",
        "m",
        0.0,
        at_least=0.0,
    )
    anchor_points: float = number(
        "Distance of each assumed anchor point from the true one, in a random direction.",
        "m",
        0.0,
        at_least=0.0,
    )


@dataclass(kw_only=True)
class StopSettings:
    """When the run ends before its duration is over."""

    position: float = number("Measured distance that counts as reached.", "m", above=0.0)
    rotation_deg: float = number("Measured angle that counts as reached.", "deg", above=0.0)
    hold: float = number("Time for which both must hold.", "s", 0.5, at_least=0.0)
    target_lost: float = number(
        "Time without the target after which the run ends.", "s", 2.0, above=0.0
    )


@dataclass(kw_only=True)
class IntegrationSettings:
    """How the plant is integrated."""

    integrator: str = text(
        "Explicit integrator of Drake, fixed step.", "runge_kutta3", choices=explicit_integrators()
    )
    max_step: float | None = number(
        "Step; null: a share of the largest stable one, from the robot's vibrations.",
        "s",
        None,
        above=0.0,
    )


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
    desired: Pose = section("Desired pose of the tag in the camera frame.", Pose)
    target: Target = section("The tag.", Target)
    camera: CameraSettings = section("The camera.", CameraSettings, required=False)
    controller: ControllerSettings = section("The visual servo.", ControllerSettings)
    estimator: EstimatorSettings = section("The estimator.", EstimatorSettings, required=False)
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
    path = scenario_file(name)
    scenario = load_typed(Scenario, path, error=ScenarioError, overrides=overrides)
    scenario.robot = robot_beside(path, scenario.robot)
    try:
        robot = load_robot(scenario.robot)
    except RobotFileError as problem:
        raise RobotFileError(f"{path}: robot: {problem}") from problem
    _check(scenario, robot, path)
    return scenario


def _check(scenario: Scenario, robot: Robot, path: Path) -> None:
    """What needs more than one field, or the robot."""
    mounts = [mount.name for mount in robot.cameras if mount.parent == "platform"]
    if scenario.camera.mount not in mounts:
        raise ScenarioError(
            f"{path}: camera.mount: {scenario.camera.mount!r} is not on the platform of "
            f"{robot.name}; {closest(scenario.camera.mount, mounts)}"
        )
    poses = {"initial_pose": scenario.initial_pose}
    if scenario.perturbations.initial_pose is not None:
        poses["perturbations.initial_pose"] = scenario.perturbations.initial_pose
    for key, pose in poses.items():
        if np.any(pose.position < robot.frame.lower) or np.any(pose.position > robot.frame.upper):
            raise ScenarioError(
                f"{path}: {key}.position: found {_words(pose.position)}, outside the frame; "
                f"accepted: {_words(robot.frame.lower)} to {_words(robot.frame.upper)} [m]"
            )
    controller = scenario.controller
    if controller.lambda_infinity > controller.lambda_0:
        raise ScenarioError(
            f"{path}: controller.lambda_infinity: found {controller.lambda_infinity:g}; "
            f"accepted: at most lambda_0 = {controller.lambda_0:g} [1/s]"
        )
    if robot.is_planar():
        for key, pose in poses.items():
            _check_planar(key, pose, robot, path)
    if scenario.desired.position[2] <= 0.0:
        raise ScenarioError(
            f"{path}: desired.position: found {_words(scenario.desired.position)}; "
            "accepted: z > 0 [m], in front of the camera"
        )


def _check_planar(key: str, pose: Pose, robot: Robot, path: Path) -> None:
    if pose.position[2] != robot.plane_height or np.any(pose.angles_deg[:2] != 0.0):
        raise ScenarioError(
            f"{path}: {key}: found {_words(pose.position)} m, {_words(pose.angles_deg)} "
            f"deg; accepted for the planar {robot.name}: z = {robot.plane_height:g} m, "
            "phi = theta = 0"
        )


def _words(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"

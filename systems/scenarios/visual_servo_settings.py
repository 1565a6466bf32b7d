"""All settings of a visual servo on a robot: what it looks at, how it moves, what it believes.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.models import Pose
from cdpr_drake.schema import optional_section, section, sections, whole
from cdpr_drake.systems.cameras import CameraSettings, TargetSettings
from cdpr_drake.systems.estimators import EstimatorSettings
from cdpr_drake.systems.perception import SensorSuite
from cdpr_drake.systems.remote import RemoteSettings
from cdpr_drake.systems.servos import (
    ControllerSettings,
    FeatureTrajectory,
    NextTask,
    OpenLoopSettings,
    Perturbations,
    PosePlanSettings,
)
from cdpr_drake.systems.tension_control import TensionManagement, TorqueControl


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

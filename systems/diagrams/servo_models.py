"""What a visual servo is about, whoever steps it: task, geometry, beliefs, law."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pydrake.math import RigidTransform

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.pose_features import seen_pose_error
from cdpr_drake.servoing.servo_task import BelievedRobot, CameraMounting
from cdpr_drake.systems.cameras.turning_camera import turning_camera
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.systems.controllers.open_loop_servo import OpenLoopServo, open_loop_plan
from cdpr_drake.systems.diagrams.beliefs import (
    believed_external_camera,
    believed_robot,
    read_camera,
    told_object,
    unshifted_robot,
)
from cdpr_drake.systems.diagrams.controller import controller_of, make_controller
from cdpr_drake.systems.diagrams.fusion_models import fusion_task
from cdpr_drake.systems.estimators.estimator_kinds import EstimatorTask
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario, VisualServoSettings
from cdpr_drake.systems.sections import sections_of
from cdpr_drake.trajectories.pose_trajectory import MovingPose, PoseTrajectory
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target


@dataclass(frozen=True, kw_only=True)
class ServoModel:
    """A visual servo without what steps it: where camera and target truly are, what is believed.

    Attributes:
        robot: The robot's data.
        unshifted: What is believed of it before a seed is drawn from, see `unshifted_robot`.
        believed: That robot as it is believed to be.
        target: What the camera looks at.
        motion: How the target moves in its carrier.
        mounting: Where camera and target truly are.
        pinhole: The camera's intrinsic parameters, its lens, and as which it is read.
        X_CdO: Desired pose of the target in the camera, that of the last task [m].
        begins: Time at which the last task takes over [s].
        controller: The law.
        plan: The platform's motion, if that is planned without looking.
    """

    robot: Robot
    unshifted: BelievedRobot
    believed: BelievedRobot
    target: Target
    motion: MovingPose
    mounting: CameraMounting
    pinhole: Pinhole
    X_CdO: RigidTransform
    begins: float
    controller: ServoController
    plan: PoseTrajectory | None

    @property
    def X_PC(self) -> RigidTransform:
        """True camera on the platform, for eye in hand [m]."""
        return self.mounting.X_BC

    @property
    def X_WO(self) -> RigidTransform:
        """Object in W at time 0, for eye in hand [m]."""
        return self.motion.at(0.0)

    @property
    def free_rotation(self) -> bool:
        """Whether the rotation about the optical axis is left free."""
        return self.controller.tasks[-1].features.rank < 6

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Names of the features, with their units."""
        return self.controller.tasks[-1].features.names

    def X_CO(self, X_WP: RigidTransform, time: float) -> RigidTransform:
        """True pose of the object in the camera for a pose of the platform at a time [s]."""
        return self.mounting.X_CO(X_WP, self.motion.at(time))

    def desired_platform_pose(self, time: float = 0.0) -> RigidTransform:
        """Pose X_WP from which the object is seen as desired at a time [s]."""
        return self.mounting.X_WP(self.X_CdO, self.motion.at(time))

    def seen_error(self, X_WP: RigidTransform, time: float) -> tuple[float, float]:
        """True distance [m] and angle [rad] of the object in the camera from its desired pose."""
        return seen_pose_error(self.X_CO(X_WP, time), self.X_CdO, self.free_rotation)

    def make_servo(self, settings: VisualServoSettings) -> FeatureServo:
        """The block of the law, or of a plan, or what a section has in its place."""
        controller, target, pinhole = self.controller, self.target, self.pinhole
        rate = settings.controller.rate
        for _, section in sections_of(settings):
            servo: FeatureServo | None = section.make_servo(self, settings)
            if servo is not None:
                return servo
        if self.plan is not None:
            return OpenLoopServo(controller, target, pinhole, rate, self.plan)
        return FeatureServo(controller, target, pinhole, rate)

    def estimator_task(self, settings: VisualServoSettings) -> EstimatorTask:
        """What estimators are made for."""
        X_WE = believed_external_camera(settings, self.robot)
        return EstimatorTask(
            robot=self.believed,
            X_WP0=settings.initial_pose.transform(),
            target=self.target,
            target_rests=settings.target_rests(),
            pinhole=self.pinhole,
            rate=settings.controller.rate,
            known_tag=settings.estimator.known_tag,
            fusion=settings.estimator.fusion,
            platform_tag=_platform_tag(settings, X_WE),
            sensor_fusion=fusion_task(
                settings,
                self.robot,
                self.believed,
                (self.target, self.pinhole),
                (X_WE, told_object(settings, self.motion.at(0.0))),
            ),
        )


def _platform_tag(
    settings: VisualServoSettings, X_WE: RigidTransform | None
) -> tuple[RigidTransform, RigidTransform] | None:
    """X_WE of the second camera and X_PQ of its tag on the platform, if there are any [m]."""
    tag = settings.estimator.platform_tag
    if tag is None or X_WE is None:
        return None
    return X_WE, tag.pose.transform()


@dataclass(frozen=True, kw_only=True)
class LoopServo(ServoModel):
    """A servo that a loop stepped without a diagram; see `systems.loops`.

    Attributes:
        scenario: The scenario.
        max_step: Integration step [s].
    """

    scenario: Scenario
    max_step: float


def servo_model(
    settings: VisualServoSettings, robot: Robot, known: ServoModel | None = None
) -> ServoModel:
    """The servo that settings ask for, on a robot.

    Args:
        settings: The settings.
        robot: The robot.
        known: One of the same robot, and of settings that differ in nothing but the seed: what no
            seed changes is taken over. Where the seed makes no difference to what is believed, to
            the last bit, that is all of it.

    Raises:
        VisualFeatureError: The target does not have what the scheme needs.
    """
    if known is not None:
        return _of_another_seed(settings, known)
    unshifted = unshifted_robot(settings, robot)
    believed, pinhole = believed_robot(settings, robot, unshifted), read_camera(settings, robot)
    mount = robot.camera_mount(settings.camera.mount)
    target, motion = settings.target.target(), settings.target.path()
    on_platform = settings.target.carrier == "platform"
    mounting = CameraMounting(
        mount.pose.transform(),
        motion.at(0.0) if on_platform else None,
        turning_camera(settings)[1] is not None,
    )
    last_task = settings.tasks()[-1]
    X_CdO = last_task.desired.transform()
    return ServoModel(
        robot=robot,
        unshifted=unshifted,
        believed=believed,
        target=target,
        motion=motion,
        mounting=mounting,
        pinhole=pinhole,
        X_CdO=X_CdO,
        begins=last_task.time,
        controller=make_controller(settings, believed, target, pinhole),
        plan=open_loop_plan(settings.open_loop, believed, mounting.X_WP(X_CdO, motion.at(0.0))),
    )


def _of_another_seed(settings: VisualServoSettings, known: ServoModel) -> ServoModel:
    """As `servo_model` with `known`."""
    believed = believed_robot(settings, known.robot, known.unshifted)
    if _shifts(believed) == _shifts(known.believed):
        return known
    X_WP = known.mounting.X_WP(known.X_CdO, known.motion.at(0.0))
    return replace(
        known,
        believed=believed,
        controller=controller_of(settings, believed, known.controller.law, known.controller.tasks),
        plan=open_loop_plan(settings.open_loop, believed, X_WP),
    )


def _shifts(believed: BelievedRobot) -> bytes:
    """All that a seed changes of a belief, to the last bit, signs of zeros included."""
    cables, poses = believed.cables, (believed.X_PC, believed.X_WP0)
    arrays = (cables.p_WA, cables.p_PB, *(X.GetAsMatrix34() for X in poses))
    return b"".join(array.tobytes() for array in arrays)

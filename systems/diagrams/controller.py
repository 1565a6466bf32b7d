"""Makes the law of a visual servo from its settings and the believed robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import Refusal
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.feature_plan import FeaturePlan
from cdpr_drake.servoing.servo_law import (
    AdaptiveGain,
    AxisPartition,
    EdgeField,
    ModeSwitching,
    ServoLaw,
    YawTask,
)
from cdpr_drake.servoing.servo_task import BelievedRobot, ServoTask, make_task
from cdpr_drake.servoing.target_motion import MotionFilter
from cdpr_drake.servoing.visual_features import Sighting, VisualFeatures
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.controllers.schemes import ideal_sighting, make_features
from cdpr_drake.systems.controllers.servo_settings import PartitionSettings, SwitchSettings
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario, VisualServoSettings
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget, Target


def _plan(
    settings: VisualServoSettings, features: VisualFeatures, seen: Sighting, target: Target
) -> FeaturePlan | None:
    path = settings.trajectory
    if path is None:
        return None
    speeds = {"m": path.speed, "rad": float(np.radians(path.rotation_speed_deg))}
    passed = [
        features.evaluate(ideal_sighting(target, pose.transform()))[0] for pose in path.waypoints
    ]
    return FeaturePlan(
        final=np.array(features.evaluate(seen)[0]),
        duration=path.duration,
        speeds=np.array([speeds.get(unit, path.image_speed) for unit in features.units()]),
        waypoints=np.array(passed) if passed else None,
        profile=path.profile,
        replan_error=path.replan_error,
    )


def make_controller(
    settings: VisualServoSettings, robot: BelievedRobot, target: Target, pinhole: Pinhole
) -> ServoController:
    """The servo for the robot as the controller believes it to be.

    Args:
        settings: The servo.
        robot: The believed robot.
        target: What the camera looks at.
        pinhole: The camera, at whose edges a field may push points back.

    Raises:
        VisualFeatureError: The target does not have what the scheme needs; names the field.
    """
    c = settings.controller
    compensation = None
    if c.compensation != "none":
        compensation = MotionFilter(c.compensation, c.compensation_ratio, 1.0 / c.rate)
    law = ServoLaw(
        gain=AdaptiveGain(c.lambda_0, c.lambda_infinity, c.lambda_slope),
        sigma=c.sigma,
        compensation=compensation,
        yaw=None if c.yaw is None else YawTask(float(np.radians(c.yaw.angle_deg)), c.yaw.gain),
        frame=c.frame,
        smoothing=c.smoothing,
        partition=_partition(settings, pinhole) if c.scheme == "partitioned" else None,
        switching=_switching(settings) if c.scheme == "switching" else None,
    )
    return controller_of(settings, robot, law, make_tasks(settings, target))


def controller_of(
    settings: VisualServoSettings,
    robot: BelievedRobot,
    law: ServoLaw,
    tasks: Sequence[ServoTask],
) -> ServoController:
    """The servo of a law and tasks that were made for these settings, or for another seed."""
    c = settings.controller
    cables = robot.cables if c.pulleys else robot.cables.without_pulleys()
    return ServoController(
        law,
        tasks,
        replace(robot, cables=cables),
        1.0 / c.rate,
        settings.target.pose.transform() if settings.target.carrier == "platform" else None,
    )


def _partition(settings: VisualServoSettings, pinhole: Pinhole) -> AxisPartition:
    chosen = settings.controller.partition or PartitionSettings()
    if chosen.edge_distance is None:
        return AxisPartition(chosen.axis_gain, goal=chosen.goal)
    # The outer rims of the outermost pixels; a mean focal length makes one distance for both axes.
    edges = np.array([
        (-0.5 - pinhole.cx) / pinhole.fx, (pinhole.width - 0.5 - pinhole.cx) / pinhole.fx,
        (-0.5 - pinhole.cy) / pinhole.fy, (pinhole.height - 0.5 - pinhole.cy) / pinhole.fy,
    ])  # fmt: skip
    distance = chosen.edge_distance / float(np.sqrt(pinhole.fx * pinhole.fy))
    return AxisPartition(
        chosen.axis_gain, EdgeField(chosen.edge_gain, distance, edges), chosen.goal
    )


def scheme_refusals(settings: Scenario, robot: Robot, target: Target) -> Iterator[Refusal]:
    """What `partitioned` cannot do.

    That is a planar robot, which cannot move along an axis and across it at will, and points that a
    field pushes from where they are desired.
    """
    c = settings.controller
    if c.scheme != "partitioned":
        return
    if robot.motion_type().is_horizontal_body:
        found = f"partitioned on {robot.name}, a planar robot"
        yield "controller.scheme", found, "there: pbvs, pbvs-line, ibvs, 2.5d, switching"
        return
    pinhole = servo_pinhole(settings.camera, robot)
    field = _partition(settings, pinhole).field
    if field is None or not isinstance(target, PointTarget):
        return
    scale = float(np.sqrt(pinhole.fx * pinhole.fy))
    for task in settings.tasks():
        x, y = target.ideal_marks(task.desired.transform())
        left, right, top, bottom = field.edges
        room = float(np.min([x - left, right - x, y - top, bottom - y]))
        if room <= field.distance:
            found, most = f"{field.distance * scale:g} [px]", max(room * scale, 0.0)
            accepted = (
                f"below {most:.0f}, the distance of a point from an edge at the desired pose, "
                "where the field would push it away"
            )
            yield "controller.partition.edge_distance", found, accepted


def _switching(settings: VisualServoSettings) -> ModeSwitching:
    chosen = settings.controller.switching or SwitchSettings()
    return ModeSwitching(
        pose_bound=chosen.pose_bound,
        image_bound=chosen.image_bound,
        bound_ratio=chosen.bound_ratio,
        dwell=chosen.dwell,
        first=chosen.first,
    )


def make_tasks(settings: VisualServoSettings, target: Target) -> list[ServoTask]:
    """The tasks of a servo: its desired pose, and those that take over later."""
    c = settings.controller
    tasks = []
    for task in settings.tasks():
        X_CdO = task.desired.transform()
        features = make_features(c, target, X_CdO)
        seen = ideal_sighting(target, X_CdO)
        plan = _plan(settings, features, seen, target)
        tasks.append(make_task(features, seen, c.interaction, plan, task.time))
    return tasks

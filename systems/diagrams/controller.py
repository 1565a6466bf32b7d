"""Makes the law of a visual servo from its settings and the believed robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr_drake.features import Sighting, VisualFeatures
from cdpr_drake.servoing import (
    AdaptiveGain,
    BelievedRobot,
    FeaturePlan,
    MotionFilter,
    ServoController,
    ServoLaw,
    ServoTask,
    YawTask,
    make_task,
)
from cdpr_drake.systems.scenarios import VisualServoSettings
from cdpr_drake.systems.servos import ideal_sighting, make_features
from cdpr_drake.vision import Target


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
    settings: VisualServoSettings, robot: BelievedRobot, target: Target
) -> ServoController:
    """The servo for the robot as the controller believes it to be.

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
    )
    cables = robot.cables if c.pulleys else robot.cables.without_pulleys()
    return ServoController(
        law,
        make_tasks(settings, target),
        replace(robot, cables=cables),
        1.0 / c.rate,
        settings.target.pose.transform() if settings.target.carrier == "platform" else None,
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

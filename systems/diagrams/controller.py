"""TODO docstring."""

from __future__ import annotations

import numpy as np

from cdpr_drake.features.visual_features import Sighting, VisualFeatures
from cdpr_drake.servoing.controller import CameraPlace, ServoController, ServoLaw, YawTask
from cdpr_drake.servoing.feature_plan import FeaturePlan
from cdpr_drake.servoing.gain import AdaptiveGain
from cdpr_drake.servoing.target_motion import MotionFilter
from cdpr_drake.servoing.task import ServoTask, make_task
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.servos.believed_robot import ServoModel
from cdpr_drake.systems.servos.schemes import ideal_sighting, make_features
from cdpr_drake.vision.target import Target


def _plan(
    scenario: Scenario, features: VisualFeatures, seen: Sighting, target: Target
) -> FeaturePlan | None:
    way = scenario.trajectory
    if way is None:
        return None
    speeds = {"m": way.speed, "rad": float(np.radians(way.rotation_speed_deg))}
    passed = [
        features.evaluate(ideal_sighting(target, pose.transform()))[0] for pose in way.waypoints
    ]
    return FeaturePlan(
        final=np.array(features.evaluate(seen)[0]),
        duration=way.duration,
        speeds=np.array([speeds.get(unit, way.image_speed) for unit in features.units()]),
        waypoints=np.array(passed) if passed else None,
        profile=way.profile,
        replan_error=way.replan_error,
    )


def make_controller(scenario: Scenario, model: ServoModel, target: Target) -> ServoController:
    """The servo of a scenario for the robot as the controller believes it to be.

    Raises:
        VisualFeatureError: The target does not have what the scheme needs; names the field.
    """
    c = scenario.controller
    compensation = None
    if c.compensation != "none":
        compensation = MotionFilter(c.compensation, c.compensation_ratio, 1.0 / c.rate)
    law = ServoLaw(
        gain=AdaptiveGain(c.lambda_0, c.lambda_infinity, c.lambda_slope),
        sigma=c.sigma,
        compensation=compensation,
        yaw=None if c.yaw is None else YawTask(float(np.radians(c.yaw.angle_deg)), c.yaw.gain),
        frame=c.frame,
    )
    on_platform = scenario.target.carrier == "platform"
    place = CameraPlace(
        model.X_PC, scenario.target.pose.transform() if on_platform else None, model.motions
    )
    return ServoController(
        law,
        make_tasks(scenario, target),
        place,
        model.p_WA,
        model.p_PB,
        model.cable_speed,
        1.0 / c.rate,
    )


def make_tasks(scenario: Scenario, target: Target) -> list[ServoTask]:
    """The tasks of a scenario: its desired pose, and those that take over later."""
    c = scenario.controller
    desired = [
        (0.0, scenario.desired),
        *((task.time, task.desired) for task in scenario.next_tasks),
    ]
    tasks = []
    for begins, pose in desired:
        X_CdO = pose.transform()
        features = make_features(c, target, X_CdO)
        seen = ideal_sighting(target, X_CdO)
        plan = _plan(scenario, features, seen, target)
        tasks.append(make_task(features, seen, c.interaction, plan, begins))
    return tasks

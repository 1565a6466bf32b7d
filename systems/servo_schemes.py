"""The visual servoing schemes that a scenario can name; a new one is one entry of `SCHEMES`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.circle_target import CircleTarget
from cdpr_drake.errors import VisualFeatureError
from cdpr_drake.feature_trajectory import FeaturePlan
from cdpr_drake.motion_filter import MotionFilter
from cdpr_drake.servo_controller import CameraPlace, ServoController, ServoLaw, YawTask
from cdpr_drake.servo_law import AdaptiveGain
from cdpr_drake.servo_task import ServoTask, make_task
from cdpr_drake.target import PointTarget, Target
from cdpr_drake.visual_features import (
    CameraPoseFeatures,
    CircleFeatures,
    DepthRule,
    HybridFeatures,
    ObjectPoseFeatures,
    PointFeatures,
    Sighting,
    VisualFeatures,
    WithoutFeature,
    sighting,
)

if TYPE_CHECKING:
    # The schema takes the names of the schemes from here.
    from cdpr_drake.systems.scenario import Scenario
    from cdpr_drake.systems.scenario_controller import ControllerSettings
    from cdpr_drake.systems.servo_model import ServoModel

SchemeFactory = Callable[["ControllerSettings", Target, RigidTransform], VisualFeatures]
"""Makes the features of a scheme for a target and its desired pose in the camera.

Raises VisualFeatureError where the target does not have what the scheme needs.
"""


def _depth(settings: ControllerSettings) -> DepthRule:
    return DepthRule(settings.depth, settings.depth_estimate)


def _with_pose(target: Target, scheme: str) -> None:
    if isinstance(target, CircleTarget):
        raise VisualFeatureError(
            f"controller.scheme: found {scheme} on circles, whose rotation about their middle is "
            "not seen; accepted: circles, or a target of another kind"
        )


def _pbvs(c: ControllerSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    _with_pose(target, c.scheme)
    return ObjectPoseFeatures(X_CdO)


def _pbvs_line(c: ControllerSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    _with_pose(target, c.scheme)
    return CameraPoseFeatures(X_CdO)


def _hybrid(c: ControllerSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    _with_pose(target, c.scheme)
    return HybridFeatures(X_CdO, _depth(c))


def _ibvs(c: ControllerSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    if not isinstance(target, PointTarget):
        raise VisualFeatureError(
            "controller.scheme: found ibvs on circles; accepted: circles, or a target with points"
        )
    chosen = None
    count = target.points.shape[1]
    if c.points is not None:
        chosen = tuple(int(number) for number in c.points)
        if np.any(c.points != np.round(c.points)) or np.any(c.points >= count):
            raise VisualFeatureError(
                f"controller.points: found {c.points.tolist()}; accepted: whole numbers below "
                f"{count}, the target's points"
            )
        if len(set(chosen)) != len(chosen):
            raise VisualFeatureError(
                f"controller.points: found {list(chosen)}; accepted: each point once"
            )
    try:
        return PointFeatures(target.points, X_CdO, _depth(c), chosen)
    except VisualFeatureError as problem:
        raise VisualFeatureError(f"controller.points: {problem}") from problem


def _circles(c: ControllerSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    if not isinstance(target, CircleTarget):
        raise VisualFeatureError(
            "controller.scheme: found circles on a target without; accepted: target.kind=circles"
        )
    axis, p = X_CdO.rotation().matrix()[:, 2], X_CdO.translation()
    if np.hypot(axis[0], axis[1]) > 1e-9 or np.hypot(p[0], p[1]) > 1e-9:
        raise VisualFeatureError(
            "desired: found circles beside or tilted to the optical axis, where a rotation about "
            "it would be seen; accepted: position (0, 0, z), phi = 180, theta = 0"
        )
    return CircleFeatures(target.radii, X_CdO, _depth(c))


SCHEMES: dict[str, SchemeFactory] = {
    "pbvs": _pbvs,
    "pbvs-line": _pbvs_line,
    "2.5d": _hybrid,
    "ibvs": _ibvs,
    "circles": _circles,
}
"""By the name that a scenario gives as `controller.scheme`."""


def make_features(c: ControllerSettings, target: Target, X_CdO: RigidTransform) -> VisualFeatures:
    """The features that a controller uses.

    Raises:
        VisualFeatureError: The target does not have what they need; names the field.
    """
    features = SCHEMES[c.scheme](c, target, X_CdO)
    if not c.free_rotation:
        return features
    if c.scheme in ("ibvs", "circles"):
        raise VisualFeatureError(
            f"controller.free_rotation: found true with {c.scheme}; accepted with: pbvs, "
            "pbvs-line, 2.5d (circles leave it free anyway)"
        )
    return WithoutFeature(features)


def ideal_sighting(target: Target, X_CO: RigidTransform) -> Sighting:
    """What an endless noiseless image shows of a target at a pose in front of the camera."""
    return sighting(X_CO, target.ideal_marks(X_CO))


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

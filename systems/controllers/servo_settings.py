"""Scenario section `controller`: the visual servo."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import (
    FASTEST,
    In,
    OneOf,
    Refusal,
    Scope,
    Switch,
    filled,
    settings,
)
from cdpr_drake.servoing.feature_plan import PROFILES
from cdpr_drake.servoing.servo_law import FRAMES, GOALS, MODES
from cdpr_drake.servoing.servo_task import INTERACTIONS
from cdpr_drake.servoing.target_motion import KINDS
from cdpr_drake.systems.controllers.schemes import SCHEMES


@settings
class FeatureTrajectory:
    """The path from the features that are seen first to the desired ones."""

    duration: Annotated[
        float | None, In("s", gt=0.0), "Time that it takes; null: from the speeds."
    ] = None
    speed: Annotated[float, In("m/s", gt=0.0), "Mean speed of features in metres."] = 0.05
    rotation_speed_deg: Annotated[float, In("deg/s", gt=0.0), "Mean speed of angles."] = 10.0
    image_speed: Annotated[
        float, In("1/s", gt=0.0), "Mean speed of features of the image, at unit focal length."
    ] = 0.05
    profile: Annotated[
        str, OneOf(PROFILES), "constant: constant speed; smooth: from rest to rest."
    ] = "constant"
    waypoints: Annotated[
        list[Pose],
        "Poses of the target in the camera to pass on the way; none: straight in the features.",
    ] = filled(list)
    replan_error: Annotated[
        float | None,
        In("-", gt=0.0),
        "Norm of the features' error beyond which the path is planned again; null: never.",
    ] = None


@settings
class YawSettings:
    """Secondary task: turns the platform about the vertical as far as the features let it."""

    angle_deg: Annotated[float, In("deg"), "Wanted yaw of the platform's x axis in W."] = 0.0
    gain: Annotated[float, In("1/s", gt=0.0), "Gain."] = 0.5


@settings
class NextTask:
    """A desired pose that takes over while the servo moves."""

    time: Annotated[float, In("s", gt=0.0), "When it takes over."]
    desired: Annotated[Pose, "Desired pose of the target in the camera frame."]


@settings
class PartitionSettings:
    """How `partitioned` moves about and along the optical axis, and its field at the edges."""

    axis_gain: Annotated[
        float, In("-", gt=0.0), "Gain about and along the optical axis, as a share of lambda."
    ] = 1.0
    segment: Annotated[
        np.ndarray | None,
        In("-", 2, ge=0.0),
        "Numbers of the two points whose segment gives alpha; null: the longest one of "
        "the desired image.",
    ] = None
    goal: Annotated[
        str,
        OneOf(GOALS),
        "Where the other four motions want the points: fixed, in the desired image, as "
        "published; turned, there as far as alpha and sigma still differ, which turns by "
        "more than 90 deg need.",
    ] = "fixed"
    edge_distance: Annotated[
        float | None,
        In("px", gt=0.0),
        "Distance from the image's edges within which points are pushed back; null: no field.",
    ] = None
    edge_gain: Annotated[float, In("1/s", gt=0.0), "Gain of that field."] = 1.0


@settings
class SwitchSettings:
    """When `switching` goes from image-based to pose-based control and back."""

    pose: Annotated[str, OneOf(("pbvs-line", "pbvs")), "Which pose-based scheme."] = "pbvs-line"
    first: Annotated[str, OneOf(MODES), "Which acts first."] = "image"
    pose_bound: Annotated[
        float | None,
        In("-", gt=0.0),
        "Bound of L_P, half the square of the pose's error, in rad and m; null: by bound_ratio.",
    ] = None
    image_bound: Annotated[
        float | None,
        In("-", gt=0.0),
        "Bound of L_I, half the square of the points' error at unit focal length; null: "
        "by bound_ratio.",
    ] = None
    bound_ratio: Annotated[
        float, In("-", gt=1.0), "Bounds as multiples of what L_P and L_I are when the task begins."
    ] = 1.5
    dwell: Annotated[float, In("s", ge=0.0), "Least time between two switches."] = 0.1


@settings
class ControllerSettings:
    """The visual servo."""

    scheme: Annotated[str, OneOf(SCHEMES), "Visual servoing scheme."] = "pbvs"
    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Control steps per second."] = 25.0
    lambda_0: Annotated[float, In("1/s", gt=0.0), "Gain at zero error."]
    lambda_infinity: Annotated[float, In("1/s", gt=0.0), "Gain at large errors."]
    lambda_slope: Annotated[float, In("1/s", ge=0.0), "Slope of the gain at zero error."]
    sigma: Annotated[
        float | None, In("1/s", gt=0.0), "Rate of the continuous start; null starts abruptly."
    ] = None
    smoothing: Annotated[
        float | None,
        In("s", gt=0.0),
        "Time constant of a first-order filter of the error; null: none.",
    ] = None
    free_rotation: Annotated[
        Switch,
        "Leaves the rotation about the optical axis free: five features; pbvs, pbvs-line, 2.5d.",
    ] = False
    points: Annotated[
        np.ndarray | None,
        In("-", None, ge=0.0),
        "Numbers, from 0, of the target's points that ibvs, partitioned and switching "
        "use; null: all.",
    ] = None
    interaction: Annotated[
        str, OneOf(INTERACTIONS), "Which interaction matrix the control uses."
    ] = "current"
    depth: Annotated[
        str,
        OneOf(("pose", "desired", "constant")),
        "Where the depth in the interaction matrix comes from; ibvs, 2.5d, circles, "
        "partitioned, switching.",
    ] = "pose"
    depth_estimate: Annotated[float, In("m", gt=0.0), "The constant depth."] = 1.0
    pulleys: Annotated[
        Switch, "Whether cable velocities are reckoned with the robot's pulleys, where it has any."
    ] = False
    frame: Annotated[str, OneOf(FRAMES), "Frame in which twists become cable velocities."] = (
        "platform"
    )
    compensation: Annotated[str, OneOf(KINDS), "How the target's motion is estimated."] = "none"
    compensation_ratio: Annotated[
        float,
        In("-", gt=0.0),
        "Standard deviation of the motion's change within a second, per standard "
        "deviation of its measurement; Kalman filters only.",
    ] = 2.0
    yaw: Annotated[YawSettings | None, "Secondary task for free rotations; null: none."] = None
    partition: Annotated[
        PartitionSettings | None, "Settings of the scheme partitioned; null: their defaults."
    ] = None
    switching: Annotated[
        SwitchSettings | None, "Settings of the scheme switching; null: their defaults."
    ] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A gain that grows with the error."""
        if self.lambda_infinity > self.lambda_0:
            accepted = f"at most lambda_0 = {self.lambda_0:g} [1/s]"
            yield "lambda_infinity", f"{self.lambda_infinity:g}", accepted

"""Scenario section `controller`: the visual servo.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import (
    FASTEST,
    array,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
)
from cdpr_drake.servoing.feature_plan import PROFILES
from cdpr_drake.servoing.servo_law import FRAMES, GOALS, MODES
from cdpr_drake.servoing.servo_task import INTERACTIONS
from cdpr_drake.servoing.target_motion import KINDS
from cdpr_drake.systems.controllers.schemes import SCHEMES


@dataclass(kw_only=True)
class FeatureTrajectory:
    """The path from the features that are seen first to the desired ones."""

    duration: float | None = number(
        "Time that it takes; null: from the speeds.", "s", None, above=0.0
    )
    speed: float = number("Mean speed of features in metres.", "m/s", 0.05, above=0.0)
    rotation_speed_deg: float = number("Mean speed of angles.", "deg/s", 10.0, above=0.0)
    image_speed: float = number(
        "Mean speed of features of the image, at unit focal length.", "1/s", 0.05, above=0.0
    )
    profile: str = text(
        "constant: constant speed; smooth: from rest to rest.", "constant", choices=PROFILES
    )
    waypoints: list[Pose] = sections(
        "Poses of the target in the camera to pass on the way; none: straight in the features.",
        required=False,
    )
    replan_error: float | None = number(
        "Norm of the features' error beyond which the path is planned again; null: never.",
        "-",
        None,
        above=0.0,
    )


@dataclass(kw_only=True)
class YawSettings:
    """Secondary task: turns the platform about the vertical as far as the features let it."""

    angle_deg: float = number("Wanted yaw of the platform's x axis in W.", "deg", 0.0)
    gain: float = number("Gain.", "1/s", 0.5, above=0.0)


@dataclass(kw_only=True)
class NextTask:
    """A desired pose that takes over while the servo moves."""

    time: float = number("When it takes over.", "s", above=0.0)
    desired: Pose = section("Desired pose of the target in the camera frame.", Pose)


@dataclass(kw_only=True)
class PartitionSettings:
    """How `partitioned` moves about and along the optical axis, and its field at the edges."""

    axis_gain: float = number(
        "Gain about and along the optical axis, as a share of lambda.", "-", 1.0, above=0.0
    )
    segment: np.ndarray | None = array(
        "Numbers of the two points whose segment gives alpha; null: the longest one of the desired "
        "image.",
        "-",
        (2,),
        None,
        at_least=0.0,
    )
    goal: str = text(
        "Where the other four motions want the points: fixed, in the desired image, as published; "
        "turned, there as far as alpha and sigma still differ, which turns by more than 90 deg "
        "need.",
        "fixed",
        choices=GOALS,
    )
    edge_distance: float | None = number(
        "Distance from the image's edges within which points are pushed back; null: no field.",
        "px",
        None,
        above=0.0,
    )
    edge_gain: float = number("Gain of that field.", "1/s", 1.0, above=0.0)


@dataclass(kw_only=True)
class SwitchSettings:
    """When `switching` goes from image-based to pose-based control and back."""

    pose: str = text("Which pose-based scheme.", "pbvs-line", choices=("pbvs-line", "pbvs"))
    first: str = text("Which acts first.", "image", choices=MODES)
    pose_bound: float | None = number(
        "Bound of L_P, half the square of the pose's error, in rad and m; null: by bound_ratio.",
        "-",
        None,
        above=0.0,
    )
    image_bound: float | None = number(
        "Bound of L_I, half the square of the points' error at unit focal length; null: by "
        "bound_ratio.",
        "-",
        None,
        above=0.0,
    )
    bound_ratio: float = number(
        "Bounds as multiples of what L_P and L_I are when the task begins.", "-", 1.5, above=1.0
    )
    dwell: float = number("Least time between two switches.", "s", 0.1, at_least=0.0)


@dataclass(kw_only=True)
class ControllerSettings:
    """The visual servo."""

    scheme: str = text("Visual servoing scheme.", "pbvs", choices=SCHEMES)
    rate: float = number("Control steps per second.", "Hz", 25.0, above=0.0, at_most=FASTEST)
    lambda_0: float = number("Gain at zero error.", "1/s", above=0.0)
    lambda_infinity: float = number("Gain at large errors.", "1/s", above=0.0)
    lambda_slope: float = number("Slope of the gain at zero error.", "1/s", at_least=0.0)
    sigma: float | None = number(
        "Rate of the continuous start; null starts abruptly.", "1/s", None, above=0.0
    )
    smoothing: float | None = number(
        "Time constant of a first-order filter of the error; null: none.", "s", None, above=0.0
    )
    free_rotation: bool = switch(
        "Leaves the rotation about the optical axis free: five features; pbvs, pbvs-line, 2.5d.",
        False,
    )
    points: np.ndarray | None = array(
        "Numbers, from 0, of the target's points that ibvs, partitioned and switching use; null: "
        "all.",
        "-",
        (None,),
        None,
        at_least=0.0,
    )
    interaction: str = text(
        "Which interaction matrix the control uses.", "current", choices=INTERACTIONS
    )
    depth: str = text(
        "Where the depth in the interaction matrix comes from; ibvs, 2.5d, circles, "
        "partitioned, switching.",
        "pose",
        choices=("pose", "desired", "constant"),
    )
    depth_estimate: float = number("The constant depth.", "m", 1.0, above=0.0)
    pulleys: bool = switch(
        "Whether cable velocities are reckoned with the robot's pulleys, where it has any.", False
    )
    frame: str = text("Frame in which twists become cable velocities.", "platform", choices=FRAMES)
    compensation: str = text("How the target's motion is estimated.", "none", choices=KINDS)
    compensation_ratio: float = number(
        "Standard deviation of the motion's change within a second, per standard deviation of its "
        "measurement; Kalman filters only.",
        "-",
        2.0,
        above=0.0,
    )
    yaw: YawSettings | None = optional_section("Secondary task for free rotations; null: none.")
    partition: PartitionSettings | None = optional_section(
        "Settings of the scheme partitioned; null: their defaults."
    )
    switching: SwitchSettings | None = optional_section(
        "Settings of the scheme switching; null: their defaults."
    )

"""Scenario section `estimator`: how the controller knows the platform's pose.

`ESTIMATORS` is the table of the estimators that a scenario can name; a new one is one entry of it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import System

from cdpr_drake.geometry.motion_type import FREE, LEVEL
from cdpr_drake.schema.declarations import OneOf, filled, settings
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.estimators.basic_estimators import (
    ControlIntegration,
    MeasuredPose,
    ShiftedPose,
)
from cdpr_drake.systems.estimators.fusion_task import FusionTask
from cdpr_drake.systems.estimators.image_estimators import (
    ConsecutiveImages,
    FirstImage,
    KnownObject,
    PlatformTagEstimator,
)
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths, LengthEstimator
from cdpr_drake.systems.estimators.pose_estimator import KnownTag
from cdpr_drake.systems.estimators.pose_fusion import Landmark, PoseFusion, SeenObject
from cdpr_drake.systems.estimators.sensor_fusion import SensorFusion
from cdpr_drake.systems.estimators.sensor_fusion_settings import SensorFusionSettings
from cdpr_drake.systems.estimators.tuning import (
    FusionSettings,
    KnownTagSettings,
    PlatformTagSettings,
)
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget, Target

SENSOR_FUSION = "sensor_fusion"
"""The kind that takes sources by its own section of settings."""


@dataclass(frozen=True, kw_only=True)
class EstimatorTask:
    """What an estimator is made for.

    Attributes:
        robot: The robot as it is believed to be.
        X_WP0: True pose of the platform at the start, which only `shifted` knows [m].
        target: What the camera looks at.
        target_rests: Whether it rests in W, so that images tell how the platform moves.
        pinhole: The camera's intrinsic parameters.
        rate: Control steps per second [Hz].
        known_tag: A tag whose pose is known, if there is one.
        fusion: Tuning of kind fusion.
        platform_tag: Where a second camera stands, X_WC, and its tag on the platform, X_PQ, if
            there are any [m].
        sensor_fusion: What kind sensor_fusion is made for, where that is asked for.
    """

    robot: BelievedRobot
    X_WP0: RigidTransform
    target: Target
    target_rests: bool
    pinhole: Pinhole
    rate: float
    known_tag: KnownTagSettings | None = None
    fusion: FusionSettings = field(default_factory=FusionSettings)
    platform_tag: tuple[RigidTransform, RigidTransform] | None = None
    sensor_fusion: FusionTask | None = None

    def restarts(self) -> KnownTag | None:
        """The known tag at which estimates begin anew, if there is one."""
        tag = self.known_tag
        return None if tag is None else KnownTag(tag.pose.transform(), self.robot.X_PC, tag.period)


@dataclass(frozen=True)
class EstimatorKind:
    """A kind of estimator.

    Attributes:
        label: Words for legends and tables.
        make: Makes one; its input ports bear names of `EstimatorInputs`, its output is
            X_WP, which must not depend on the servo's outputs of the same instant but through the
            servo's discrete state.
        needs_images: Whether it compares images of the target, which must then rest in the world.
    """

    label: str
    make: Callable[[EstimatorTask], System]
    needs_images: bool = False


def _control_integration(task: EstimatorTask) -> System:
    return ControlIntegration(task.robot.X_WP0, task.rate, task.restarts())


def _consecutive_images(task: EstimatorTask) -> System:
    model = task.robot
    return ConsecutiveImages(model.X_WP0, model.X_PC, task.rate, task.restarts())


def _first_image(task: EstimatorTask) -> System:
    return FirstImage(task.robot.X_WP0, task.robot.X_PC, task.rate, task.restarts())


def _cable_lengths(elastic: bool, pulleys: bool) -> Callable[[EstimatorTask], System]:
    def make(task: EstimatorTask) -> System:
        model = task.robot
        cables = model.cables if pulleys else model.cables.without_pulleys()
        counted = EncoderLengths(cables, elastic)
        motion = LEVEL if model.is_planar() else FREE
        return LengthEstimator(model.X_WP0, counted, task.rate, motion, task.restarts())

    return make


def _known_tag(task: EstimatorTask) -> System:
    tag = task.known_tag
    assert tag is not None  # the settings were checked
    model = task.robot
    return KnownObject(model.X_WP0, model.X_PC, tag.pose.transform(), task.rate)


def _eye_to_hand(task: EstimatorTask) -> System:
    assert task.platform_tag is not None  # the settings were checked
    return PlatformTagEstimator(task.robot.X_WP0, *task.platform_tag, task.rate)


def _measured(task: EstimatorTask) -> System:
    return MeasuredPose(task.robot.X_WP0)


def _shifted(task: EstimatorTask) -> System:
    return ShiftedPose(task.X_WP0, task.robot.X_WP0)


def _fusion(task: EstimatorTask) -> System:
    model, fusion, known = task.robot, task.fusion, task.known_tag
    focal = float(np.sqrt(task.pinhole.fx * task.pinhole.fy))
    seen = None
    if isinstance(task.target, PointTarget) and task.target_rests:
        seen = SeenObject(task.target.points, focal)
    landmark = None
    if known is not None:
        points = SeenObject(known.target().points, focal)
        landmark = Landmark(points, known.pose.transform())
    return PoseFusion(
        model.X_WP0,
        model.X_PC,
        EncoderLengths(model.cables if fusion.pulleys else model.cables.without_pulleys(), True),
        fusion,
        task.rate,
        target=seen,
        known=landmark,
        planar=model.is_planar(),
    )


def _sensor_fusion(task: EstimatorTask) -> System:
    assert task.sensor_fusion is not None  # who asks for that kind makes its task
    return SensorFusion(task.sensor_fusion)


ESTIMATORS: dict[str, EstimatorKind] = {
    "control_integration": EstimatorKind("control integration", _control_integration),
    "consecutive_images": EstimatorKind("consecutive images", _consecutive_images, True),
    "first_image": EstimatorKind("first and current image", _first_image, True),
    "cable_lengths": EstimatorKind("cable lengths", _cable_lengths(False, False)),
    "cable_lengths_elastic": EstimatorKind("cable lengths, elastic", _cable_lengths(True, False)),
    "cable_lengths_pulleys": EstimatorKind("cable lengths, pulleys", _cable_lengths(False, True)),
    "cable_lengths_elastic_pulleys": EstimatorKind(
        "cable lengths, elastic, pulleys", _cable_lengths(True, True)
    ),
    "measured": EstimatorKind("measured", _measured),
    "shifted": EstimatorKind("measured, off by the error of the start", _shifted),
    "known_tag": EstimatorKind("known tag", _known_tag),
    "eye_to_hand": EstimatorKind("second camera, eye to hand", _eye_to_hand),
    "fusion": EstimatorKind("fusion", _fusion),
    SENSOR_FUSION: EstimatorKind("fusion of two cameras and more", _sensor_fusion),
}
"""By the name that a scenario gives as `estimator.kind`; the first seven are the servoing thesis'
estimators 1 to 7, in its order."""


@settings
class EstimatorSettings:
    """The estimator of the platform's pose."""

    kind: Annotated[str, OneOf(ESTIMATORS), "Estimator."] = "control_integration"
    compare: Annotated[
        list[str],
        OneOf(ESTIMATORS),
        "Estimators that run beside it and are logged; nothing uses what they say.",
    ] = filled(list)
    known_tag: Annotated[
        KnownTagSettings | None,
        "A tag whose pose is known, at which the estimate begins anew from time to time.",
    ] = None
    platform_tag: Annotated[
        PlatformTagSettings | None,
        "A tag on the platform and a second camera, in the world, that sees it; for kinds"
        " eye_to_hand and sensor_fusion.",
    ] = None
    fusion: Annotated[FusionSettings, "Tuning of kind fusion."] = filled(FusionSettings)
    sensor_fusion: Annotated[SensorFusionSettings, "Sources and tuning of kind sensor_fusion."] = (
        filled(SensorFusionSettings)
    )

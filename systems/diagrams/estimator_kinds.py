"""The pose estimators that a scenario can name; a new one is one entry of `ESTIMATORS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydrake.systems.framework import System

from cdpr_drake.systems.estimators.control_integration import ControlIntegration
from cdpr_drake.systems.estimators.counted_lengths import CountedLengths
from cdpr_drake.systems.estimators.image_estimators import (
    ConsecutiveImages,
    FirstImage,
    KnownObject,
)
from cdpr_drake.systems.estimators.length_estimator import LengthEstimator
from cdpr_drake.systems.estimators.measured_pose import MeasuredPose
from cdpr_drake.systems.estimators.pose_estimator import KnownTag
from cdpr_drake.systems.estimators.pose_fusion import FusionTuning, Landmark, PoseFusion, SeenObject
from cdpr_drake.systems.estimators.shifted_pose import ShiftedPose
from cdpr_drake.vision.target import PointTarget, Target

if TYPE_CHECKING:
    # The schema takes the names of the estimators from here.
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
    from cdpr_drake.systems.servos.believed_robot import ServoModel
    from cdpr_drake.vision.pinhole import Pinhole


@dataclass(frozen=True)
class EstimatorTask:
    """What an estimator is made for.

    Attributes:
        scenario: The scenario.
        model: The robot as it is believed to be.
        target: What the camera looks at.
        pinhole: The camera's intrinsic parameters.
    """

    scenario: Scenario
    model: ServoModel
    target: Target
    pinhole: Pinhole

    def target_rests(self) -> bool:
        """Whether the target rests in the world, so that images tell how the platform moves."""
        target = self.scenario.target
        return target.carrier == "world" and not target.path().is_moving()

    def known_tag(self) -> KnownTag | None:
        """The known tag at which estimates begin anew, if the scenario has one."""
        settings = self.scenario.estimator.known_tag
        if settings is None:
            return None
        return KnownTag(settings.pose.transform(), self.model.X_PC, settings.period)


@dataclass(frozen=True)
class EstimatorKind:
    """A kind of estimator.

    Attributes:
        label: Words for legends and tables.
        make: Makes one; its input ports bear names of `estimators.INPUTS`, its output is
            X_WP, which must not depend on the servo's outputs of the same instant but through the
            servo's discrete state.
        needs_images: Whether it compares images of the target, which must then rest in the world.
    """

    label: str
    make: Callable[[EstimatorTask], System]
    needs_images: bool = False


def _rate(task: EstimatorTask) -> float:
    return task.scenario.controller.rate


def _control_integration(task: EstimatorTask) -> System:
    return ControlIntegration(task.model.X_WP0, _rate(task), task.known_tag())


def _consecutive_images(task: EstimatorTask) -> System:
    model = task.model
    return ConsecutiveImages(model.X_WP0, model.X_PC, _rate(task), task.known_tag())


def _first_image(task: EstimatorTask) -> System:
    return FirstImage(task.model.X_WP0, task.model.X_PC, _rate(task), task.known_tag())


def _cable_lengths(elastic: bool, pulleys: bool) -> Callable[[EstimatorTask], System]:
    def make(task: EstimatorTask) -> System:
        model = task.model
        cables = model.cables if pulleys else model.cables.without_pulleys()
        counted = CountedLengths(cables, elastic)
        return LengthEstimator(
            model.X_WP0, counted, _rate(task), model.is_planar(), task.known_tag()
        )

    return make


def _known_tag(task: EstimatorTask) -> System:
    settings = task.scenario.estimator.known_tag
    assert settings is not None  # the scenario was checked
    model = task.model
    return KnownObject(model.X_WP0, model.X_PC, settings.pose.transform(), _rate(task))


def _measured(task: EstimatorTask) -> System:
    return MeasuredPose(task.model.X_WP0)


def _shifted(task: EstimatorTask) -> System:
    return ShiftedPose(task.scenario.initial_pose.transform(), task.model.X_WP0)


def _fusion(task: EstimatorTask) -> System:
    scenario, model = task.scenario, task.model
    f, known = scenario.estimator.fusion, scenario.estimator.known_tag
    tuning = FusionTuning(
        start_position=f.start_position,
        start_rotation=float(np.radians(f.start_rotation_deg)),
        velocity=f.velocity,
        angular_velocity=float(np.radians(f.angular_velocity_deg)),
        camera_position=f.camera_position,
        camera_rotation=float(np.radians(f.camera_rotation_deg)),
        points=f.points,
        pixel=f.pixel,
        length=f.length,
        length_drift=f.length_drift,
        start_slack=f.start_slack,
        taut=f.taut,
    )
    focal = float(np.sqrt(task.pinhole.fx * task.pinhole.fy))
    seen = None
    if isinstance(task.target, PointTarget) and task.target_rests():
        seen = SeenObject(task.target.points, focal)
    landmark = None
    if known is not None:
        points = SeenObject(known.target().points, focal)
        landmark = Landmark(points, known.pose.transform())
    return PoseFusion(
        model.X_WP0,
        model.X_PC,
        CountedLengths(model.cables if f.pulleys else model.cables.without_pulleys(), True),
        tuning,
        _rate(task),
        seen,
        landmark,
        model.is_planar(),
    )


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
    "fusion": EstimatorKind("fusion", _fusion),
}
"""By the name that a scenario gives as `estimator.kind`; the first seven are the servoing thesis'
estimators 1 to 7, in its order."""

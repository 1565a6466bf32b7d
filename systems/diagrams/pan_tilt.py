"""The servo's camera on two joints: what is refused of it, and its blocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.arrays import Array
from cdpr_drake.schema.declarations import Refusal, Scope
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.servoing.turned_view import pointing_angles
from cdpr_drake.systems.cameras.camera_settings import CameraSettings
from cdpr_drake.systems.cameras.pan_tilt_settings import CameraPanTilt
from cdpr_drake.systems.cameras.steady_view import SteadyView
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.controllers.centring import CentringLaw
from cdpr_drake.systems.sensors.pan_tilt import PanTilt, PanTiltJoints, head_pose
from cdpr_drake.systems.sensors.sampled_sensor import CAMERA_JOINTS
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

if TYPE_CHECKING:
    pass

UNFIT_ESTIMATORS = ("fusion", "sensor_fusion", "known_tag", "eye_to_hand")
"""Estimators with cameras or errors of images of their own, which know nothing of joints."""

LATER = {
    "stability": ", and run_stability.stability_along after the run, which reckons with the joints"
}
"""What does the same for a camera that turns."""

LOGGED_JOINTS, LOGGED_ENCODERS = "camera_joints", "camera_encoders"
LOGGED_IMAGE, LOGGED_FOUND = "turned_corners_px", "turned_found"


@dataclass(frozen=True)
class TurningCamera:
    """The blocks of a camera on two joints.

    Attributes:
        joints: The joints; their outputs X_BH and X_BH_encoder are X_BC of the camera.
        law: What turns them.
        view: What the camera measures, as at rest.
    """

    joints: PanTilt
    law: CentringLaw
    view: SteadyView


def camera_joints(settings: CameraPanTilt) -> PanTiltJoints:
    """The joints of a section."""
    return PanTiltJoints(
        lower=np.radians(settings.lower_deg),
        upper=np.radians(settings.upper_deg),
        speed=np.radians(settings.speed_deg),
        counts_per_turn=settings.counts_per_turn,
        zero_error=float(np.radians(settings.zero_error_deg)),
        offset=np.radians(settings.offset_deg),
        noise=float(np.radians(settings.noise_deg)),
    )


def turned_mounting(
    mounting: CameraMounting, settings: CameraPanTilt, angles: Array
) -> CameraMounting:
    """The mounting of a camera while its joints are at angles, shape (2,) [rad]."""
    arm = np.asarray(settings.arm, float)
    X_BM = mounting.X_BC @ RigidTransform(-arm)
    return replace(mounting, X_BC=head_pose(X_BM, arm, angles))


def aimed_mounting(
    mounting: CameraMounting, settings: CameraPanTilt, X_C0O: RigidTransform
) -> CameraMounting:
    """The mounting of a camera that its joints aim at a target, as far as they can.

    Args:
        mounting: The mounting, with both angles zero.
        settings: The joints.
        X_C0O: Pose of the target in the camera with both angles zero [m].
    """
    p_MO = X_C0O.translation() + np.asarray(settings.arm, float)
    lower, upper = np.radians(settings.lower_deg), np.radians(settings.upper_deg)
    return turned_mounting(mounting, settings, np.clip(pointing_angles(p_MO), lower, upper))


def add_camera_joints(
    builder: DiagramBuilder,
    settings: CameraPanTilt,
    mounting: CameraMounting,
    *,
    seed: int,
    name: str,
) -> PanTilt:
    """Adds the joints that turn a camera about its mounting."""
    joints = PanTilt(
        camera_joints(settings),
        mounting.X_BC @ RigidTransform(-np.asarray(settings.arm, float)),
        arm=settings.arm,
        mode="velocity",
        rate=settings.rate,
        seed=seed,
        start=np.radians(settings.start_deg),
        stream=CAMERA_JOINTS,
    )
    return builder.AddNamedSystem(name, joints)


def add_centring(
    builder: DiagramBuilder,
    camera: CameraSettings,
    joints: PanTilt,
    measurement: TargetMeasurement,
    *,
    mounting: CameraMounting,
    pinhole: Pinhole,
    prefix: str,
) -> TurningCamera:
    """Adds what turns a camera's joints by what it measures, and what makes its view steady."""
    settings, target = camera.pan_tilt, measurement.target
    assert settings is not None
    assert isinstance(target, PointTarget)  # the scenario was checked
    view = builder.AddNamedSystem(
        prefix + "steady_view",
        SteadyView(target, pinhole, mounting.X_BC, camera.rate, camera.latency_frames),
    )
    law = builder.AddNamedSystem(
        prefix + "centring",
        CentringLaw(
            target, pinhole, camera.rate,
            gain=settings.gain,
            limits=(joints.joints.lower, joints.joints.upper),
            patience=settings.patience,
            search=float(np.radians(settings.search_deg)),
        ),
    )  # fmt: skip
    for name, source in (("X_CO", "turned_X_CO"), ("found", "turned_found")):
        builder.Connect(measurement.GetOutputPort(name), view.GetInputPort(source))
    builder.Connect(measurement.GetOutputPort(target.mark), view.GetInputPort("turned_marks"))
    builder.Connect(joints.GetOutputPort("X_BH_encoder"), view.GetInputPort("X_BC_encoder"))
    builder.Connect(measurement.GetOutputPort("found"), law.GetInputPort("found"))
    builder.Connect(measurement.GetOutputPort(target.mark), law.GetInputPort("corners"))
    builder.Connect(joints.GetOutputPort("encoder_angles"), law.GetInputPort("encoder_angles"))
    builder.Connect(law.GetOutputPort("joint_rates"), joints.GetInputPort("command"))
    return TurningCamera(joints, law, view)


def turning_ports(turning: TurningCamera, measurement: TargetMeasurement) -> dict[str, OutputPort]:
    """What is logged of a camera that turns, by its names in the log."""
    return {
        LOGGED_JOINTS: turning.joints.GetOutputPort("angles"),
        LOGGED_ENCODERS: turning.joints.GetOutputPort("encoder_angles"),
        LOGGED_FOUND: measurement.GetOutputPort("found"),
        LOGGED_IMAGE: measurement.GetOutputPort(measurement.target.mark),
    }


def pan_tilt_refusals(scope: Scope) -> Iterator[Refusal]:
    """What does not take a camera that turns."""
    scenario = scope.whole
    if scenario.camera.pan_tilt is None or any(scenario.target.refusals(scope)):
        return
    if not isinstance(scenario.target.target(), PointTarget):
        found = f"{scenario.target.kind} with camera.pan_tilt"
        yield "target.kind", found, "targets whose marks are points"
    kinds = {"estimator.kind": scenario.estimator.kind}
    kinds |= {f"estimator.compare[{k}]": x for k, x in enumerate(scenario.estimator.compare)}
    for key, kind in kinds.items():
        if kind in UNFIT_ESTIMATORS:
            accepted = f"none of {', '.join(UNFIT_ESTIMATORS)}"
            yield key, f"{kind} with camera.pan_tilt", accepted
    sections = {
        "estimator.known_tag": scenario.estimator.known_tag,
        "adaptation": scenario.adaptation,
        "stability": scenario.stability,
    }
    for key, section in sections.items():
        if section is not None:
            found = "a section with camera.pan_tilt, of whose joints it knows nothing"
            yield key, found, f"null{LATER.get(key, '')}"

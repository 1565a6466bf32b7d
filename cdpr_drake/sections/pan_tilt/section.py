"""Scenario section `camera.pan_tilt`: two joints that turn the servo's camera."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.arrays import Array
from cdpr_drake.schema.declarations import (
    FASTEST,
    In,
    Refusal,
    Scope,
    number_words,
    settings,
    values,
)
from cdpr_drake.sections.pan_tilt.centring import CentringLaw
from cdpr_drake.sections.pan_tilt.steady_view import SteadyView
from cdpr_drake.sections.perception.head import PanTilt, PanTiltJoints, head_pose
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.servoing.turned_view import pointing_angles
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.cameras.turning_camera import TurningCamera
from cdpr_drake.systems.sensors.sampled_sensor import CAMERA_JOINTS
from cdpr_drake.vision.target import PointTarget

UNFIT_ESTIMATORS = ("fusion", "sensor_fusion", "known_tag", "eye_to_hand")
"""Estimators with cameras or errors of images of their own, which know nothing of joints."""

LATER = {
    "stability": ", and run_stability.stability_along after the run, which reckons with the joints"
}
"""What does the same for a camera that turns."""

JOINTS, ENCODERS = "camera_joints", "camera_encoders"
IMAGE, FOUND = "turned_corners_px", "turned_found"
"""What is logged: angles of the joints, true and read [rad], and what the turned camera sees."""


@settings
class CameraPanTilt(TurningCamera):
    """Two joints that carry the camera and keep the target in the middle of its image.

    With both angles zero the camera is where its mounting has it. Pan turns to its right, then tilt
    upwards.
    """

    words = "Two joints that turn it and keep the target in view"
    columns: ClassVar = {
        JOINTS: ("pan_rad", "tilt_rad"), ENCODERS: ("pan_rad", "tilt_rad"), FOUND: ("flag",),
        IMAGE: (),
    }  # fmt: skip
    report = "cdpr_drake.sections.pan_tilt.report:SUBJECTS"

    arm: Annotated[
        np.ndarray,
        In("m", 3),
        "Position of the camera from where the axes meet, both angles zero, in the camera frame.",
    ] = values(0.0, 0.0, 0.0)
    lower_deg: Annotated[np.ndarray, In("deg", 2), "Smallest angles, pan and tilt."] = values(
        -75.0, -75.0
    )
    upper_deg: Annotated[np.ndarray, In("deg", 2), "Largest angles."] = values(75.0, 75.0)
    speed_deg: Annotated[np.ndarray, In("deg/s", 2, gt=0.0), "Largest speeds."] = values(
        120.0, 120.0
    )
    start_deg: Annotated[np.ndarray, In("deg", 2), "Angles at the start."] = values(0.0, 0.0)
    gain: Annotated[
        float,
        In("1/s", gt=0.0, le=1000.0),
        "Of the law that takes the target to the middle of the image.",
    ] = 4.0
    rate: Annotated[
        float, In("Hz", gt=0.0, le=FASTEST), "Looks of the joints at their command."
    ] = 100.0
    patience: Annotated[
        float,
        In("s", ge=0.0),
        "Time without the target after which the joints look for it, in a spiral; 0: at once.",
    ] = 0.2
    search_deg: Annotated[float, In("deg/s", gt=0.0, le=10000.0), "Speed of the look-out."] = 60.0
    counts_per_turn: Annotated[int, In(ge=4), "Counts of an encoder per turn."] = 4096
    zero_error_deg: Annotated[
        float, In("deg", ge=0.0), "Standard deviation of an encoder's zero."
    ] = 0.0
    offset_deg: Annotated[
        np.ndarray, In("deg", 2), "What the encoders read too much beside that, pan and tilt."
    ] = values(0.0, 0.0)
    noise_deg: Annotated[
        float, In("deg", ge=0.0), "Standard deviation of a reading of an encoder."
    ] = 0.0

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Limits with nothing between, or beyond half a turn, a start outside of them, and what
        does not take a camera that turns."""
        lower, upper, start = self.lower_deg, self.upper_deg, self.start_deg
        if np.any(lower > upper):
            yield "lower_deg", f"{_pair(lower)}", f"at most upper_deg, {_pair(upper)}"
        elif np.any(np.maximum(np.abs(lower), np.abs(upper)) > 180.0):
            yield "", f"limits {_pair(lower)} and {_pair(upper)}", "-180 to 180 [deg]"
        elif np.any(start < lower) or np.any(start > upper):
            yield "start_deg", _pair(start), f"{_pair(lower)} to {_pair(upper)}"
        whole, flaws = scope.whole, scope.whole.camera.flaws
        if flaws is not None and flaws.flaws().moves:
            found = "images that take time with camera.pan_tilt"
            yield "/camera.flaws", found, "exposure and readout 0"
        if any(whole.target.refusals(scope)):
            return
        if not isinstance(whole.target.target(), PointTarget):
            found = f"{whole.target.kind} with camera.pan_tilt"
            yield "/target.kind", found, "targets whose marks are points"
        kinds = {"/estimator.kind": whole.estimator.kind}
        kinds |= {f"/estimator.compare[{k}]": x for k, x in enumerate(whole.estimator.compare)}
        for key, kind in kinds.items():
            if kind in UNFIT_ESTIMATORS:
                yield key, f"{kind} with camera.pan_tilt", f"none of {', '.join(UNFIT_ESTIMATORS)}"
        unfit = {"estimator.known_tag": whole.estimator.known_tag}
        unfit |= {name: getattr(whole, name, None) for name in ("adaptation", "stability")}
        for key, section in unfit.items():
            if section is not None:
                found = "a section with camera.pan_tilt, of whose joints it knows nothing"
                yield f"/{key}", found, f"null{LATER.get(key, '')}"

    def joints(self) -> PanTiltJoints:
        """The joints."""
        return PanTiltJoints(
            lower=np.radians(self.lower_deg),
            upper=np.radians(self.upper_deg),
            speed=np.radians(self.speed_deg),
            counts_per_turn=self.counts_per_turn,
            zero_error=float(np.radians(self.zero_error_deg)),
            offset=np.radians(self.offset_deg),
            noise=float(np.radians(self.noise_deg)),
        )

    def turned(self, mounting: CameraMounting, angles: Array) -> CameraMounting:
        """The mounting while the joints are at angles, shape (2,) [rad]."""
        X_BM = mounting.X_BC @ RigidTransform(-np.asarray(self.arm, float))
        return replace(mounting, X_BC=head_pose(X_BM, np.asarray(self.arm, float), angles))

    def aimed(self, mounting: CameraMounting, X_C0O: RigidTransform) -> CameraMounting:
        """See `TurningCamera`."""
        p_MO = X_C0O.translation() + np.asarray(self.arm, float)
        lower, upper = np.radians(self.lower_deg), np.radians(self.upper_deg)
        return self.turned(mounting, np.clip(pointing_angles(p_MO), lower, upper))

    def mountings(
        self, mounting: CameraMounting, log: Mapping[str, Array], rows: Any, believed: bool = False
    ) -> list[CameraMounting]:
        """See `TurningCamera`."""
        joints = np.asarray(log[ENCODERS if believed else JOINTS])[rows]
        return [self.turned(mounting, angles) for angles in joints]

    def add_view(
        self,
        builder: DiagramBuilder,
        model: Any,
        measurement: TargetMeasurement,
        settings: Any,
        prefix: str,
    ) -> SteadyView:
        """Adds a `PanTilt` as camera_joints, a `CentringLaw` as centring, and the steady view."""
        target, pinhole, X_BC = model.target, model.pinhole, model.mounting.X_BC
        rate, latency = settings.camera.rate, settings.camera.latency_frames
        assert isinstance(target, PointTarget)  # the scenario was checked
        joints = builder.AddNamedSystem(
            prefix + JOINTS,
            PanTilt(
                self.joints(), X_BC @ RigidTransform(-np.asarray(self.arm, float)), arm=self.arm,
                mode="velocity", rate=self.rate, seed=settings.seed,
                start=np.radians(self.start_deg), stream=CAMERA_JOINTS,
            ),
        )  # fmt: skip
        law = builder.AddNamedSystem(
            prefix + "centring",
            CentringLaw(
                target, pinhole, rate, gain=self.gain,
                limits=(joints.joints.lower, joints.joints.upper), patience=self.patience,
                search=float(np.radians(self.search_deg)),
            ),
        )  # fmt: skip
        view = builder.AddNamedSystem(
            prefix + "steady_view", SteadyView(target, pinhole, X_BC, rate, latency)
        )
        camera = builder.GetSubsystemByName(prefix + "camera")
        for source, port, block, name in (
            (joints, "X_BH", camera, "X_BC"),
            (measurement, "X_CO", view, "turned_X_CO"),
            (measurement, "found", view, "turned_found"),
            (measurement, target.mark, view, "turned_marks"),
            (joints, "X_BH_encoder", view, "X_BC_encoder"),
            (measurement, "found", law, "found"),
            (measurement, target.mark, law, "corners"),
            (joints, "encoder_angles", law, "encoder_angles"),
            (law, "joint_rates", joints, "command"),
        ):
            builder.Connect(source.GetOutputPort(port), block.GetInputPort(name))
        return view

    def add_to(
        self, builder: DiagramBuilder, blocks: Any, settings: Any
    ) -> Mapping[str, OutputPort]:
        """Logs the joints, and what the turned camera sees."""
        joints, measurement = builder.GetSubsystemByName(blocks.prefix + JOINTS), blocks.measurement
        return {
            JOINTS: joints.GetOutputPort("angles"),
            ENCODERS: joints.GetOutputPort("encoder_angles"),
            FOUND: measurement.GetOutputPort("found"),
            IMAGE: measurement.GetOutputPort(blocks.target.mark),
        }


def _pair(angles: np.ndarray) -> str:
    return f"{number_words(angles)} [deg]"

"""Scenario section `camera`: its settings, and checks of them that need more than one field."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cdpr_drake.errors import RobotFileError, ScenarioError
from cdpr_drake.models.camera_catalogue import CameraFault, Distortion, fold_problem, load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, Text, settings
from cdpr_drake.systems.cameras.pan_tilt_settings import CameraPanTilt
from cdpr_drake.vision.image_flaws import ImageFlaws
from cdpr_drake.vision.pinhole import Pinhole

RENDERED, PROJECTED = "rendered", "projected"
WHOLE, REGION = "whole", "target"


@settings
class FlawSettings:
    """What spoils rendered images beside the lens."""

    noise: Annotated[
        float, In("-", ge=0.0, le=255.0), "Standard deviation of every colour of a pixel, of 255."
    ] = 0.0
    defocus: Annotated[
        float, In("px", ge=0.0, le=100.0), "Standard deviation of the blur of a lens out of focus."
    ] = 0.0
    exposure: Annotated[
        float,
        In("s", ge=0.0, le=1.0),
        "How long a row of pixels is exposed, while what moves blurs.",
    ] = 0.0
    readout: Annotated[
        float,
        In("s", ge=0.0, le=1.0),
        "Rolling shutter: by how much the last row is exposed after the first; 0: all at once.",
    ] = 0.0
    renders: Annotated[
        int,
        In(ge=2, le=256),
        "Pictures that are drawn of an image that takes time, at instants of it.",
    ] = 8

    def flaws(self) -> ImageFlaws:
        """The same without a file."""
        return ImageFlaws(self.noise, self.defocus, self.exposure, self.readout, self.renders)


@settings
class CameraSettings:
    """The camera that looks at the target."""

    kind: Annotated[
        str,
        OneOf((RENDERED, PROJECTED)),
        "rendered draws images and detects the tag in them; projected projects its corners.",
    ] = RENDERED
    mount: Annotated[Text, "Which of the robot's camera mountings."] = "onboard"
    model: Annotated[
        Text | None,
        "Camera by name, or path of a camera file, in the place of the mounting's; null: that.",
    ] = None
    distortion: Annotated[
        Distortion | None,
        "What the lens does to images, in the place of what the camera's file says; null: that.",
    ] = None
    width: Annotated[int, In("px", ge=16, le=8192), "Image width."] = 640
    height: Annotated[int, In("px", ge=16, le=8192), "Image height."] = 480
    region: Annotated[
        str,
        OneOf((WHOLE, REGION)),
        "What of an image is drawn and read; rendered camera only. whole: all of it; "
        "target: a window round where the target is expected, and all of it where it is "
        "not found there.",
    ] = WHOLE
    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Images per second."] = 25.0
    latency_frames: Annotated[
        int, In("frames", ge=0, le=1000), "Delay from image to controller."
    ] = 0
    pixel_noise: Annotated[
        float,
        In("px", ge=0.0),
        "Standard deviation of a corner's coordinates; projected camera only.",
    ] = 0.1
    focus_zoom: Annotated[
        float,
        In("-", ge=0.0, le=0.5),
        "Auto-focus: share by which the focal length goes up and down; projected camera only.",
    ] = 0.0
    focus_period: Annotated[
        float, In("s", gt=0.0), "Time of one up and down of the auto-focus."
    ] = 2.0
    flaws: Annotated[
        FlawSettings | None,
        "What spoils images; null: nothing; rendered camera with region whole only.",
    ] = None
    fault: Annotated[CameraFault | None, "When it fails; null: never; projected camera only."] = (
        None
    )
    pan_tilt: Annotated[
        CameraPanTilt | None,
        "Two joints that turn it and keep the target in view; null: it is fixed.",
    ] = None


def check_camera(camera: CameraSettings, path: Path) -> None:
    """Refuses what a camera of its kind cannot do.

    Args:
        camera: The settings.
        path: Of the scenario's file, for the message.

    Raises:
        ScenarioError: A projected camera shall look at a region, or a rendered one zoom.
    """
    if camera.region == REGION and camera.kind != RENDERED:
        raise ScenarioError(
            f"{path}: camera.region: found {REGION} with camera.kind {camera.kind}, which draws no "
            f"image; accepted: whole, or camera.kind {RENDERED}"
        )
    if camera.flaws is not None and (camera.kind != RENDERED or camera.region != WHOLE):
        raise ScenarioError(
            f"{path}: camera.flaws: found a section with camera.kind {camera.kind} and "
            f"camera.region {camera.region}; accepted: null, or {RENDERED} and {WHOLE}"
        )
    if camera.flaws is not None:
        taken = camera.flaws.exposure + camera.flaws.readout
        if taken > 1.0 / camera.rate:
            raise ScenarioError(
                f"{path}: camera.flaws: found exposure and readout of {taken:g} s; accepted: at "
                f"most {1.0 / camera.rate:g} s, the time of an image at camera.rate"
            )
    if camera.focus_zoom > 0.0 and camera.kind != PROJECTED:
        raise ScenarioError(
            f"{path}: camera.focus_zoom: found {camera.focus_zoom:g} with camera.kind "
            f"{camera.kind}, whose focal length does not change; accepted: 0, or camera.kind "
            f"{PROJECTED}"
        )


def servo_pinhole(camera: CameraSettings, robot: Robot) -> Pinhole:
    """Intrinsic parameters and lens of the camera of some settings on a robot.

    Raises:
        RobotFileError: There is no such camera, or its file describes none.
    """
    model = camera.model or robot.camera_mount(camera.mount).model
    pinhole = load_camera(model).pinhole(camera.width, camera.height)
    if camera.distortion is None:
        return pinhole
    return replace(pinhole, distortion=camera.distortion.lens())


def check_lens(camera: CameraSettings, robot: Robot, path: Path) -> None:
    """Refuses a camera that is none, and a lens that folds its image over.

    Args:
        camera: The settings, with a mounting that the robot has.
        robot: The robot.
        path: Of the scenario's file, for the message.

    Raises:
        ScenarioError: As said; names the field.
    """
    if camera.distortion is not None and camera.distortion.problem():
        raise ScenarioError(f"{path}: camera.distortion.{camera.distortion.problem()}")
    try:
        pinhole = servo_pinhole(camera, robot)
    except RobotFileError as problem:
        raise ScenarioError(*problem.within(f"{path}: camera.model")) from problem
    fold = fold_problem(pinhole)
    if fold:
        raise ScenarioError(f"{path}: camera.distortion: {fold}")

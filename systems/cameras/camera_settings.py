"""Scenario section `camera`: its settings, and checks of them that need more than one field."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.camera_catalogue import CameraFault, Distortion, fold_refusals, load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, Refusal, Scope, Text, settings, told
from cdpr_drake.systems.sections import with_sections
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
@with_sections("camera")
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

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """What a camera of its kind cannot do, and one that is none."""
        if self.region == REGION and self.kind != RENDERED:
            found = f"{REGION} with camera.kind {self.kind}, which draws no image"
            yield "region", found, f"whole, or camera.kind {RENDERED}"
        if self.flaws is not None and (self.kind != RENDERED or self.region != WHOLE):
            found = f"a section with camera.kind {self.kind} and camera.region {self.region}"
            yield "flaws", found, f"null, or {RENDERED} and {WHOLE}"
        if self.flaws is not None:
            taken, image = self.flaws.exposure + self.flaws.readout, 1.0 / self.rate
            if taken > image:
                found = f"exposure and readout of {taken:g} s"
                yield "flaws", found, f"at most {image:g} s, the time of an image at camera.rate"
        if self.focus_zoom > 0.0 and self.kind != PROJECTED:
            found = f"{self.focus_zoom:g} with camera.kind {self.kind}, which cannot zoom"
            yield "focus_zoom", found, f"0, or camera.kind {PROJECTED}"
        if self.fault is not None and self.kind != PROJECTED:
            found = f"a fault with camera.kind {self.kind}"
            yield "fault", found, f"null, or camera.kind {PROJECTED}"
        if self.mount not in [mount.name for mount in scope.robot.cameras] or (
            self.distortion is not None and any(self.distortion.refusals(scope))
        ):
            return
        try:
            yield from fold_refusals(servo_pinhole(self, scope.robot), "distortion")
        except RobotFileError as problem:
            yield told(problem, "model")


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

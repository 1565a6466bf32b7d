"""Scenario section `camera`: its settings, and checks of them that need more than one field.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from pathlib import Path

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.camera_catalogue import CameraFault
from cdpr_drake.schema.fields import FASTEST, number, optional_section, text, whole

RENDERED, PROJECTED = "rendered", "projected"
WHOLE, REGION = "whole", "target"


@dataclass(kw_only=True)
class CameraSettings:
    """The camera that looks at the target."""

    kind: str = text(
        "rendered draws images and detects the tag in them; projected projects its corners.",
        RENDERED,
        choices=(RENDERED, PROJECTED),
    )
    mount: str = text("Which of the robot's camera mountings.", "onboard")
    width: int = whole("Image width.", 640, "px", at_least=16, at_most=8192)
    height: int = whole("Image height.", 480, "px", at_least=16, at_most=8192)
    region: str = text(
        "What of an image is drawn and read; rendered camera only. whole: all of it; target: a "
        "window round where the target is expected, and all of it where it is not found there.",
        WHOLE,
        choices=(WHOLE, REGION),
    )
    rate: float = number("Images per second.", "Hz", 25.0, above=0.0, at_most=FASTEST)
    latency_frames: int = whole(
        "Delay from image to controller.", 0, "frames", at_least=0, at_most=1000
    )
    pixel_noise: float = number(
        "Standard deviation of a corner's coordinates; projected camera only.",
        "px",
        0.1,
        at_least=0.0,
    )
    focus_zoom: float = number(
        "Auto-focus: share by which the focal length goes up and down; projected camera only.",
        "-",
        0.0,
        at_least=0.0,
        at_most=0.5,
    )
    focus_period: float = number("Time of one up and down of the auto-focus.", "s", 2.0, above=0.0)
    fault: CameraFault | None = optional_section(
        "When it fails; null: never; projected camera only."
    )


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
    if camera.focus_zoom > 0.0 and camera.kind != PROJECTED:
        raise ScenarioError(
            f"{path}: camera.focus_zoom: found {camera.focus_zoom:g} with camera.kind "
            f"{camera.kind}, whose focal length does not change; accepted: 0, or camera.kind "
            f"{PROJECTED}"
        )

"""Scenario section `camera`.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.models import CameraFault
from cdpr_drake.schema import FASTEST, number, optional_section, text, whole

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

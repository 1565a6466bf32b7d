"""Scenario section `camera`.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.schema import HIGHEST_RATE, number, text, whole


@dataclass(kw_only=True)
class CameraSettings:
    """The camera that looks at the target."""

    kind: str = text(
        "rendered draws images and detects the tag in them; projected projects its corners.",
        "rendered",
        choices=("rendered", "projected"),
    )
    mount: str = text("Which of the robot's camera mountings.", "onboard")
    width: int = whole("Image width.", 640, "px", at_least=16, at_most=8192)
    height: int = whole("Image height.", 480, "px", at_least=16, at_most=8192)
    rate: float = number("Images per second.", "Hz", 25.0, above=0.0, at_most=HIGHEST_RATE)
    latency_frames: int = whole("Delay from image to controller.", 0, "frames", at_least=0)
    pixel_noise: float = number(
        "Standard deviation of a corner's coordinates; projected camera only.",
        "px",
        0.1,
        at_least=0.0,
    )

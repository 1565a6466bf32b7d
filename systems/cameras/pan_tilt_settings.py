"""Scenario section `camera.pan_tilt`: two joints that turn the servo's camera."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np

from cdpr_drake.schema.declarations import (
    FASTEST,
    In,
    Refusal,
    Scope,
    number_words,
    settings,
    values,
)


@settings
class CameraPanTilt:
    """Two joints that carry the camera and keep the target in the middle of its image.

    With both angles zero the camera is where its mounting has it. Pan turns to its right, then tilt
    upwards.
    """

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
        """Limits with nothing between, or beyond half a turn, and a start outside of them."""
        lower, upper, start = self.lower_deg, self.upper_deg, self.start_deg
        if np.any(lower > upper):
            yield "lower_deg", f"{_pair(lower)}", f"at most upper_deg, {_pair(upper)}"
        elif np.any(np.maximum(np.abs(lower), np.abs(upper)) > 180.0):
            yield "", f"limits {_pair(lower)} and {_pair(upper)}", "-180 to 180 [deg]"
        elif np.any(start < lower) or np.any(start > upper):
            yield "start_deg", _pair(start), f"{_pair(lower)} to {_pair(upper)}"


def _pair(angles: np.ndarray) -> str:
    return f"{number_words(angles)} [deg]"

"""Scenario section `camera.pan_tilt`: two joints that turn the servo's camera.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.schema.fields import FASTEST, array, number, whole


@dataclass(kw_only=True)
class CameraPanTilt:
    """Two joints that carry the camera and keep the target in the middle of its image.

    With both angles zero the camera is where its mounting has it. Pan turns to its right, then tilt
    upwards.
    """

    arm: np.ndarray = array(
        "Position of the camera from where the axes meet, both angles zero, in the camera frame.",
        "m",
        (3,),
        (0.0, 0.0, 0.0),
    )
    lower_deg: np.ndarray = array("Smallest angles, pan and tilt.", "deg", (2,), (-75.0, -75.0))
    upper_deg: np.ndarray = array("Largest angles.", "deg", (2,), (75.0, 75.0))
    speed_deg: np.ndarray = array("Largest speeds.", "deg/s", (2,), (120.0, 120.0), above=0.0)
    start_deg: np.ndarray = array("Angles at the start.", "deg", (2,), (0.0, 0.0))
    gain: float = number(
        "Of the law that takes the target to the middle of the image.",
        "1/s",
        4.0,
        above=0.0,
        at_most=1000.0,
    )
    rate: float = number(
        "Looks of the joints at their command.", "Hz", 100.0, above=0.0, at_most=FASTEST
    )
    patience: float = number(
        "Time without the target after which the joints look for it, in a spiral; 0: at once.",
        "s",
        0.2,
        at_least=0.0,
    )
    search_deg: float = number("Speed of the look-out.", "deg/s", 60.0, above=0.0, at_most=10_000.0)
    counts_per_turn: int = whole("Counts of an encoder per turn.", 4096, at_least=4)
    zero_error_deg: float = number(
        "Standard deviation of an encoder's zero.", "deg", 0.0, at_least=0.0
    )
    offset_deg: np.ndarray = array(
        "What the encoders read too much beside that, pan and tilt.", "deg", (2,), (0.0, 0.0)
    )
    noise_deg: float = number(
        "Standard deviation of a reading of an encoder.", "deg", 0.0, at_least=0.0
    )

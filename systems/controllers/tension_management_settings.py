"""Scenario section `tension_management`: what takes up slack beside a visual servo.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.schema.fields import FASTEST, array, number, text
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.tensions.slack_correction import SHAPES

CONSTANT, ADAPTIVE, BY_LENGTH, DISTRIBUTION, LENGTH, POLYGON, IMAGE = (
    "constant", "adaptive", "by_length", "distribution", "length", "polygon", "image"
)  # fmt: skip
"""Kinds of tension management."""


@dataclass(kw_only=True)
class TensionManagement:
    """Cable velocities beside the servo's, which take up slack."""

    kind: str = text(
        "constant: a cable below its threshold is wound up; adaptive: the faster, the more it is "
        "too long; by_length: shorter cables have higher thresholds; distribution: tensions for "
        "the believed pose are followed; length: the two cables of least tension go to their "
        "length at the believed pose; polygon: tensions are kept inside the feasible polygon of "
        "the believed pose, without moving the platform; image: as constant, and as fast as what a "
        "camera in the world sees to hang through needs.",
        CONSTANT,
        choices=(CONSTANT, ADAPTIVE, BY_LENGTH, DISTRIBUTION, LENGTH, POLYGON, IMAGE),
    )
    rate: float | None = number(
        "Corrections per second; null: as often as the controller.", "Hz", None, above=0.0
    )
    threshold: np.ndarray = array(
        "Measured tension below which a cable counts as slack, one for all or one for each; kinds "
        "distribution and polygon: smallest wanted tension, one for all.",
        "N",
        (None,),
        (1.0,),
    )
    gain: float | None = number(
        "Velocity per missing tension, k_c; kinds constant, by_length, polygon and image; null: "
        "from the cables' stiffness, the rate and the delay, so that the loop is stable.",
        "m/(N s)",
        None,
        above=0.0,
    )
    delay: float | None = number(
        "From a tension to the velocity that it asks for, beside the period of the corrections, "
        "with which a gain of null reckons; null: the period of the tension sensors.",
        "s",
        None,
        at_least=0.0,
        at_most=10.0,
    )
    gain_per_length: float = number(
        "That gain per metre that a cable is too long, k_c,a; kind adaptive.",
        "1/(N s)",
        2.0,
        above=0.0,
    )
    highest: np.ndarray | None = array(
        "Threshold of the shortest cables, one for all or one for each; kind by_length.",
        "N",
        (None,),
        None,
    )
    shortest: float | None = number(
        "Cables up to this length have that threshold; kind by_length.", "m", None, above=0.0
    )
    longest: float | None = number(
        "Cables from this length on have the lower one; kind by_length.", "m", None, above=0.0
    )
    shape: str = text(
        "How the threshold falls in between; kind by_length.", SHAPES[0], choices=SHAPES
    )
    method: str = text(
        "How tensions are distributed; kind distribution.", "quadratic_program", choices=METHODS
    )
    proportional: float = number(
        "Velocity per missing tension; kind distribution.", "m/(N s)", 0.01, above=0.0
    )
    integral: float = number(
        "Velocity per missing tension and second; kind distribution.", "m/(N s2)", 0.0, at_least=0.0
    )
    derivative: float = number(
        "Velocity per rate of the missing tension; kind distribution.", "m/N", 0.0, at_least=0.0
    )
    fastest: float | None = number(
        "Largest velocity that is added; kinds distribution, polygon and image; null: the winches' "
        "rated speed.",
        "m/s",
        None,
        above=0.0,
    )
    margin: float = number(
        "Distance to keep from the smallest wanted and the largest tension; kind polygon.",
        "N",
        1.0,
        at_least=0.0,
    )
    set_point: str = text(
        "Distribution that tensions nearer than that are brought back towards; kind polygon.",
        "barycenter",
        choices=METHODS,
    )
    allowance: float = number(
        "Surplus of length that is left alone, l_t; kinds length and image.",
        "m",
        0.01,
        at_least=0.0,
    )
    slowness: float = number(
        "Number of corrections that a surplus takes, k_l; kind length.", "-", 5.0, at_least=1.0
    )
    sight_mount: str = text(
        "Which of the robot's camera mountings in the world; kind image.", "overview"
    )
    sight_rate: float = number(
        "Images of the cables per second; kind image.", "Hz", 25.0, above=0.0, at_most=FASTEST
    )
    sight_noise: float = number(
        "Standard deviation of a point of a cable in the image; kind image, projected camera.",
        "px",
        0.5,
        at_least=0.0,
    )
    sight_grain: float = number(
        "Standard deviation of every colour of a pixel, of 255; kind image with a rendered camera.",
        "-",
        2.0,
        at_least=0.0,
        at_most=255.0,
    )
    sight_ends: float = number(
        "Standard deviation of where a cable is believed to begin and end; kind image with a "
        "rendered camera.",
        "m",
        0.002,
        above=0.0,
    )
    closing_time: float = number(
        "Time in which what is seen to hang through is wound in; kind image.", "s", 0.2, above=0.0
    )

    def needs_gain(self) -> bool:
        """Whether a gain must be found, since the kind has one and none is stated."""
        return self.gain is None and self.kind in (CONSTANT, BY_LENGTH, POLYGON, IMAGE)

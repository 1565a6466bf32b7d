"""Scenario section `tension_management`: what takes up slack beside a visual servo."""

from typing import Annotated

import numpy as np

from cdpr_drake.schema.declarations import FASTEST, In, OneOf, Text, settings, values
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.tensions.slack_correction import SHAPES

CONSTANT, ADAPTIVE, BY_LENGTH, DISTRIBUTION, LENGTH, POLYGON, IMAGE = (
    "constant", "adaptive", "by_length", "distribution", "length", "polygon", "image"
)  # fmt: skip
"""Kinds of tension management."""


@settings
class TensionManagement:
    """Cable velocities beside the servo's, which take up slack."""

    kind: Annotated[
        str,
        OneOf((CONSTANT, ADAPTIVE, BY_LENGTH, DISTRIBUTION, LENGTH, POLYGON, IMAGE)),
        "constant: a cable below its threshold is wound up; adaptive: the faster, the "
        "more it is too long; by_length: shorter cables have higher thresholds; "
        "distribution: tensions for the believed pose are followed; length: the two "
        "cables of least tension go to their length at the believed pose; polygon: "
        "tensions are kept inside the feasible polygon of the believed pose, without "
        "moving the platform; image: as constant, and as fast as what a camera in the "
        "world sees to hang through needs.",
    ] = CONSTANT
    rate: Annotated[
        float | None, In("Hz", gt=0.0), "Corrections per second; null: as often as the controller."
    ] = None
    threshold: Annotated[
        np.ndarray,
        In("N", None),
        "Measured tension below which a cable counts as slack, one for all or one for "
        "each; kinds distribution and polygon: smallest wanted tension, one for all.",
    ] = values(1.0)
    gain: Annotated[
        float | None,
        In("m/(N s)", gt=0.0),
        "Velocity per missing tension, k_c; kinds constant, by_length, polygon and image;"
        " null: from the cables' stiffness, the rate and the delay, so that the loop is "
        "stable.",
    ] = None
    delay: Annotated[
        float | None,
        In("s", ge=0.0, le=10.0),
        "From a tension to the velocity that it asks for, beside the period of the "
        "corrections, with which a gain of null reckons; null: the period of the tension "
        "sensors.",
    ] = None
    gain_per_length: Annotated[
        float,
        In("1/(N s)", gt=0.0),
        "That gain per metre that a cable is too long, k_c,a; kind adaptive.",
    ] = 2.0
    highest: Annotated[
        np.ndarray | None,
        In("N", None),
        "Threshold of the shortest cables, one for all or one for each; kind by_length.",
    ] = None
    shortest: Annotated[
        float | None,
        In("m", gt=0.0),
        "Cables up to this length have that threshold; kind by_length.",
    ] = None
    longest: Annotated[
        float | None,
        In("m", gt=0.0),
        "Cables from this length on have the lower one; kind by_length.",
    ] = None
    shape: Annotated[str, OneOf(SHAPES), "How the threshold falls in between; kind by_length."] = (
        SHAPES[0]
    )
    method: Annotated[str, OneOf(METHODS), "How tensions are distributed; kind distribution."] = (
        "quadratic_program"
    )
    proportional: Annotated[
        float, In("m/(N s)", gt=0.0), "Velocity per missing tension; kind distribution."
    ] = 0.01
    integral: Annotated[
        float, In("m/(N s2)", ge=0.0), "Velocity per missing tension and second; kind distribution."
    ] = 0.0
    derivative: Annotated[
        float, In("m/N", ge=0.0), "Velocity per rate of the missing tension; kind distribution."
    ] = 0.0
    fastest: Annotated[
        float | None,
        In("m/s", gt=0.0),
        "Largest velocity that is added; kinds distribution, polygon and image; null: the"
        " winches' rated speed.",
    ] = None
    margin: Annotated[
        float,
        In("N", ge=0.0),
        "Distance to keep from the smallest wanted and the largest tension; kind polygon.",
    ] = 1.0
    set_point: Annotated[
        str,
        OneOf(METHODS),
        "Distribution that tensions nearer than that are brought back towards; kind polygon.",
    ] = "barycenter"
    allowance: Annotated[
        float, In("m", ge=0.0), "Surplus of length that is left alone, l_t; kinds length and image."
    ] = 0.01
    slowness: Annotated[
        float, In("-", ge=1.0), "Number of corrections that a surplus takes, k_l; kind length."
    ] = 5.0
    sight_mount: Annotated[
        Text, "Which of the robot's camera mountings in the world; kind image."
    ] = "overview"
    sight_rate: Annotated[
        float, In("Hz", gt=0.0, le=FASTEST), "Images of the cables per second; kind image."
    ] = 25.0
    sight_noise: Annotated[
        float,
        In("px", ge=0.0),
        "Standard deviation of a point of a cable in the image; kind image, projected camera.",
    ] = 0.5
    sight_grain: Annotated[
        float,
        In("-", ge=0.0, le=255.0),
        "Standard deviation of every colour of a pixel, of 255; kind image with a rendered camera.",
    ] = 2.0
    sight_ends: Annotated[
        float,
        In("m", gt=0.0),
        "Standard deviation of where a cable is believed to begin and end; kind image "
        "with a rendered camera.",
    ] = 0.002
    closing_time: Annotated[
        float,
        In("s", gt=0.0),
        "Time in which what is seen to hang through is wound in; kind image.",
    ] = 0.2

    def needs_gain(self) -> bool:
        """Whether a gain must be found, since the kind has one and none is stated."""
        return self.gain is None and self.kind in (CONSTANT, BY_LENGTH, POLYGON, IMAGE)

"""Pulleys at both ends of cables.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.schema import array, number


@dataclass(kw_only=True)
class Pulley:
    """The swivelling pulleys at the exit points."""

    radius: float = number("Radius of the groove.", "m", at_least=0.0)
    swivel_axis: np.ndarray = array(
        "Direction in W in which the cable arrives at the exit point from its winch, and about "
        "which the pulley swivels; of any length.",
        "-",
        (3,),
        (0.0, 0.0, 1.0),
    )


@dataclass(kw_only=True)
class PlatformPulley:
    """Swivelling pulleys at the anchor points, where the platform has them."""

    radius: float = number("Radius of the groove.", "m", at_least=0.0)
    swivel_axis: np.ndarray = array(
        "Direction in P in which the cable arrives at the anchor point from where it is fixed, and "
        "about which the pulley swivels; of any length.",
        "-",
        (3,),
        (0.0, 0.0, 1.0),
    )

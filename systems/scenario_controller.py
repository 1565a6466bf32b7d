"""Scenario section `controller`: the visual servo.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.fields import number, text
from cdpr_drake.systems.servo_schemes import SCHEMES


@dataclass(kw_only=True)
class ControllerSettings:
    """The visual servo."""

    scheme: str = text("Visual servoing scheme.", "pbvs", choices=tuple(SCHEMES))
    rate: float = number("Control steps per second.", "Hz", 25.0, above=0.0)
    lambda_0: float = number("Gain at zero error.", "1/s", above=0.0)
    lambda_infinity: float = number("Gain at large errors.", "1/s", above=0.0)
    lambda_slope: float = number("Slope of the gain at zero error.", "1/s", at_least=0.0)
    sigma: float | None = number(
        "Rate of the continuous start; null starts abruptly.", "1/s", None, above=0.0
    )

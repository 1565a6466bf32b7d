"""Scenario sections `stop` and `integration`: how a run is simulated and when it ends.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.schema.fields import number, switch, text


@dataclass(kw_only=True)
class StopSettings:
    """When the run ends before its duration is over."""

    position: float = number("Measured distance that counts as reached.", "m", above=0.0)
    rotation_deg: float = number("Measured angle that counts as reached.", "deg", above=0.0)
    hold: float = number("Time for which both must hold.", "s", 0.5, at_least=0.0)
    target_lost: float = number(
        "Time without the target after which the run ends.", "s", 2.0, above=0.0
    )
    broken_cable: bool = switch(
        "Whether the run ends when a cable passes the breaking load that the robot's file gives.",
        False,
    )


@dataclass(kw_only=True)
class IntegrationSettings:
    """How the plant is integrated."""

    integrator: str = text(
        "Explicit integrator of Drake, fixed step.", "runge_kutta3", choices=explicit_integrators()
    )
    max_step: float | None = number(
        "Step; null: a share of the largest stable one, from the robot's vibrations.",
        "s",
        None,
        above=0.0,
    )

"""Scenario section `stability`: the stability criterion along a run, as signals of its log.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.schema import number


@dataclass(kw_only=True)
class StabilitySettings:
    """Logs how many cables pull, the rank of their Jacobian, and the criterion's margin."""

    threshold: float | None = number(
        "Tension from which a cable counts as taut; null: one that is not slack.",
        "N",
        None,
        at_least=0.0,
    )

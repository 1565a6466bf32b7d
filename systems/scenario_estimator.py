"""Scenario section `estimator`: how the controller knows the platform's pose.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.fields import text
from cdpr_drake.systems.pose_estimators import ESTIMATORS


@dataclass(kw_only=True)
class EstimatorSettings:
    """The estimator of the platform's pose."""

    kind: str = text("Estimator.", "control_integration", choices=tuple(ESTIMATORS))

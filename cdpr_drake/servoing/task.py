"""What a visual servo is asked to do: features, where they should be, and on which path."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.features import Sighting, VisualFeatures
from cdpr_drake.servoing.feature_plan import FeaturePlan

INTERACTIONS = ("current", "desired", "mean")


@dataclass(frozen=True)
class ServoTask:
    """One task of a visual servo.

    Attributes:
        features: The features.
        final: s* at the end, shape (k,).
        L_desired: Interaction matrix there, shape (k, 6).
        interaction: Which interaction matrix the control uses: one of `INTERACTIONS`.
        plan: The path there; None: s* is `final` from the start.
        begins: Time at which this task takes over [s].
        resting: s*(t), ds*/dt and the drift b without plan and motion of the object, shape (3, k).
    """

    features: VisualFeatures
    final: Array
    L_desired: Array
    interaction: str = "current"
    plan: FeaturePlan | None = None
    begins: float = 0.0
    resting: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """What is asked for at rest follows from the rest."""
        k = len(self.final)
        object.__setattr__(self, "resting", np.vstack([self.final, np.zeros((2, k))]))

    def chosen_interaction(self, L: Array) -> Array:
        """The matrix that the control uses, from the current one, shape (k, 6)."""
        if self.interaction == "current":
            return L
        if self.interaction == "desired":
            return self.L_desired
        return 0.5 * (L + self.L_desired)


def make_task(
    features: VisualFeatures,
    desired: Sighting,
    interaction: str = "current",
    plan: FeaturePlan | None = None,
    begins: float = 0.0,
) -> ServoTask:
    """The task of seeing what is seen at the desired pose; see `ServoTask`."""
    final, L = features.evaluate(desired)
    return ServoTask(features, np.array(final), np.array(L), interaction, plan, begins)

"""What else makes a pose good: stiffness, vibrations, dexterity, an even share of the load.

The platform is held by the tensions of least 2-norm where a number depends on them. Turns and
moments are compared with translations and forces by `StaticCase.arm`.

Source: servoing thesis 1.2.4; Gazebo thesis 2.5; Pham et al., 2009.
"""

from cdpr_drake.workspaces.conditions.stiffness import (
    StiffnessAtPoses,
    first_frequencies,
    stiffness_at,
)
from cdpr_drake.workspaces.conditions.tension_factor import (
    REGULAR,
    dexterities,
    tension_factors,
)

__all__ = [
    "REGULAR", "StiffnessAtPoses", "dexterities", "first_frequencies", "stiffness_at",
    "tension_factors",
]  # fmt: skip

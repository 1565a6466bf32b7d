"""The section `cables` of a scenario: how the simulated cables behave.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.cable_models import CABLE_MODELS, INEXTENSIBLE, KELVIN_VOIGT
from cdpr_drake.cable_set import CableSet
from cdpr_drake.fields import switch, text
from cdpr_drake.models import Robot


@dataclass(kw_only=True)
class CableSettings:
    """Which cables a simulated robot has; their values stand in the robot's file.

    Inextensible cables are not among the models: with more cables than degrees of freedom their
    tensions are not determined. Stiff Kelvin-Voigt cables are what comes nearest.
    """

    model: str = text(
        "How a cable answers to its length.",
        KELVIN_VOIGT,
        choices=tuple(name for name in CABLE_MODELS if name != INEXTENSIBLE),
    )
    pulleys: bool = switch("Whether the cables run over the robot's pulleys.", False)

    def cable_set(self, robot: Robot) -> CableSet:
        """The cables of a robot, over its pulleys or from fixed exit points."""
        cables = robot.cable_set()
        return cables if self.pulleys else cables.without_pulleys()

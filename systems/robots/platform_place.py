"""Where forces on a platform act: what force systems keep of the robot in its plant.

A plant itself cannot be kept, since a system that is converted to another scalar is copied without
it.
"""

from __future__ import annotations

from dataclasses import dataclass

from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.models.robot_in_plant import RobotInPlant


@dataclass(frozen=True)
class PlatformPlace:
    """A platform among the states and velocities of a plant.

    Attributes:
        joint: How it moves.
        start: Number of its first generalized velocity in the plant.
        num_velocities: Generalized velocities of the plant.
        num_states: States of its model instance.
    """

    joint: PlatformJoint
    start: int
    num_velocities: int
    num_states: int

    @staticmethod
    def of(in_plant: RobotInPlant) -> PlatformPlace:
        """That of a robot whose plant is finalized."""
        plant = in_plant.plant
        return PlatformPlace(
            in_plant.robot.joint(),
            in_plant.first_velocity(),
            plant.num_velocities(),
            plant.num_multibody_states(in_plant.model_instance),
        )

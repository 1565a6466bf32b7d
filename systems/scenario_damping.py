"""The section `damping` of a scenario: what brakes the platform beside its cables.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.fields import number
from cdpr_drake.models import RobotInPlant


@dataclass(kw_only=True)
class DampingSettings:
    """Viscous damping of the platform's motion about Po: air, and friction at pulleys and joints.

    A platform that hangs on fewer cables than it has degrees of freedom swings, and nothing in
    the cables damps that.
    """

    translation: float = number("Force per velocity of Po.", "N s/m", 0.0, at_least=0.0)
    rotation: float = number("Moment per angular velocity.", "N m s/rad", 0.0, at_least=0.0)

    def is_there(self) -> bool:
        """Whether there is any damping."""
        return self.translation > 0.0 or self.rotation > 0.0

    def block(self, in_plant: RobotInPlant) -> MatrixGain:
        """Generalized forces on the plant, shape (nv,), from the platform's state."""
        plant = in_plant.plant
        planar = in_plant.robot.is_planar()
        t, r = self.translation, self.rotation
        damping = np.array([t, t, r] if planar else [r, r, r, t, t, t])
        D = np.zeros((plant.num_velocities(), plant.num_multibody_states(in_plant.model_instance)))
        for k, value in enumerate(damping):
            D[in_plant.first_velocity() + k, D.shape[1] - len(damping) + k] = -value
        return MatrixGain(D)

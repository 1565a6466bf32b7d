"""The platform's pose as a port of its own."""

from __future__ import annotations

from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem

from cdpr_drake.models import RobotInPlant, pose_from_state


class PlatformPose(LeafSystem):
    """The platform's pose from the state that the plant puts on its port.

    ============== ============== ==== =============================================
    port           type           unit meaning
    ============== ============== ==== =============================================
    platform_state vector         m    in, as `CableForces` takes it
    X_WP           RigidTransform m    out, pose of the platform
    ============== ============== ==== =============================================
    """

    def __init__(self, in_plant: RobotInPlant) -> None:
        """For a robot whose plant is finalized."""
        super().__init__()
        self._robot = in_plant.robot
        size = in_plant.plant.num_multibody_states(in_plant.model_instance)
        self._state = self.DeclareVectorInputPort("platform_state", size)
        self.DeclareAbstractOutputPort("X_WP", lambda: Value(RigidTransform()), self._calc)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        output.set_value(pose_from_state(self._robot, self._state.Eval(context)))

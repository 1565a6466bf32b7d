"""Small blocks that turn poses into what another block takes."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem

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


class PoseToVector(LeafSystem):
    """A pose as numbers, for loggers.

    ====== ============== ==== ====================================================
    port   type           unit meaning
    ====== ============== ==== ====================================================
    pose   RigidTransform m    in
    vector vector(7)      -, m out, (qw, qx, qy, qz, x, y, z) with qw not negative
    ====== ============== ==== ====================================================
    """

    def __init__(self) -> None:
        """For any pose."""
        super().__init__()
        self._pose = self.DeclareAbstractInputPort("pose", Value(RigidTransform()))
        self.DeclareVectorOutputPort("vector", 7, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        X = self._pose.Eval(context)
        q = X.rotation().ToQuaternion().wxyz()
        output.set_value(np.concatenate([q if q[0] >= 0.0 else -q, X.translation()]))

"""The platform's pose as a port of its own."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from pydrake.autodiffutils import AutoDiffXd
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform_
from pydrake.systems.framework import Context, LeafSystem, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_on_joint
from cdpr_drake.systems.robots.templates import class_for_floats


# With its scope, since Drake would search the whole call stack for it.
@TemplateSystem.define("PlatformPose_", T_list=(float, AutoDiffXd), scope=sys.modules[__name__])
def PlatformPose_(T: Any) -> type[LeafSystem]:
    """The class for scalars of type T, float or AutoDiffXd; `PlatformPose` is the one for float."""

    class Impl(LeafSystem_[T]):
        """The platform's pose from the state that the plant puts on its port.

        ============== ============== ==== =============================================
        port           type           unit meaning
        ============== ============== ==== =============================================
        platform_state vector         m    in, as `CableForces` takes it
        X_WP           RigidTransform m    out, pose of the platform
        ============== ============== ==== =============================================
        """

        def _construct(self, in_plant: RobotInPlant, converter: Any = None) -> None:
            """For a robot whose plant is finalized."""
            size = in_plant.plant.num_multibody_states(in_plant.model_instance)
            self._declare(in_plant.robot.joint(), size, converter)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._declare(self, other._joint, other._size, converter)

        def _declare(self, joint: PlatformJoint, size: int, converter: Any) -> None:
            LeafSystem_[T].__init__(self, converter=converter)
            self._joint, self._size = joint, size
            self._state = self.DeclareVectorInputPort("platform_state", size)
            self.DeclareAbstractOutputPort("X_WP", lambda: Value[RigidTransform_[T]](), self._calc)

        def _calc(self, context: Context, output: AbstractValue) -> None:
            output.set_value(pose_on_joint(self._joint, self._state.Eval(context)))

    return Impl


if TYPE_CHECKING:  # what an editor cannot see in a template

    class PlatformPose(LeafSystem):
        """`PlatformPose_` for float."""

        def __init__(self, in_plant: RobotInPlant) -> None: ...
else:
    PlatformPose = class_for_floats(PlatformPose_)

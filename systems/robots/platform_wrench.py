"""A wrench on a robot's platform as a generalized force on its plant."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.framework import BasicVector, Context, LeafSystem, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.systems.robots.templates import class_for_floats

APPLIED_WRENCH = "applied_wrench"
"""Input of a robot block: moment about Po and force on the platform, in W, (6,) [N m, N]."""


# With its scope, since Drake would search the whole call stack for it.
@TemplateSystem.define("PlatformWrench_", T_list=(float, AutoDiffXd), scope=sys.modules[__name__])
def PlatformWrench_(T: Any) -> type[LeafSystem]:
    """The class for scalars of type T; `PlatformWrench` is the one for float."""

    class Impl(LeafSystem_[T]):
        """What pushes the platform beside its cables and its weight.

        ================= ========== ======= ====================================================
        port              type       unit    meaning
        ================= ========== ======= ====================================================
        applied_wrench    vector(6)  N m, N  in, moment about Po and force on the platform, in W;
                                             left open: nothing pushes
        generalized_force vector(nv) N, N m  out, for the plant's applied_generalized_force
        ================= ========== ======= ====================================================

        What the platform's joint cannot do is held by the joint.
        """

        def _construct(self, in_plant: RobotInPlant, converter: Any = None) -> None:
            """For a robot whose plant is finalized."""
            force = in_plant.robot.joint().wrench_map()
            start, nv = in_plant.first_velocity(), in_plant.plant.num_velocities()
            whole = np.zeros((nv, 6))
            whole[start : start + len(force)] = force
            self._declare(whole, converter)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._declare(self, other._map, converter)

        def _declare(self, whole: Array, converter: Any) -> None:
            LeafSystem_[T].__init__(self, converter=converter)
            self._map = whole
            self._wrench = self.DeclareVectorInputPort(APPLIED_WRENCH, 6)
            self.DeclareVectorOutputPort(
                "generalized_force", len(whole), self._calc, {self._wrench.ticket()}
            )

        def _calc(self, context: Context, output: BasicVector) -> None:
            if self._wrench.HasValue(context):
                output.SetFromVector(self._map @ self._wrench.Eval(context))
            else:
                output.SetFromVector(np.zeros(len(self._map)))

    return Impl


if TYPE_CHECKING:  # what an editor cannot see in a template

    class PlatformWrench(LeafSystem):
        """`PlatformWrench_` for float."""

        def __init__(self, in_plant: RobotInPlant) -> None: ...
else:
    PlatformWrench = class_for_floats(PlatformWrench_)

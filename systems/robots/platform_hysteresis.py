"""Friction against turns of a robot's platform as a generalized force on its plant."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    LeafSystem,
    LeafSystem_,
)
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis, contact_rates
from cdpr_drake.dynamics.contact_kernel import SLIP, pack_contacts, rub
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_on_joint
from cdpr_drake.systems.robots.cable_forces import with_derivatives
from cdpr_drake.systems.robots.platform_place import PlatformPlace
from cdpr_drake.systems.robots.templates import class_for_floats

BENT = "bent"
"""Output port where a platform rubs: how far contacts are bent, shape (3,) in P or (1,) [rad]."""


# With its scope, since Drake would search the whole call stack for it.
@TemplateSystem.define(
    "PlatformHysteresis_", T_list=(float, AutoDiffXd), scope=sys.modules[__name__]
)
def PlatformHysteresis_(T: Any) -> type[LeafSystem]:
    """The class for scalars of type T; `PlatformHysteresis` is the one for float."""

    class Impl(LeafSystem_[T]):
        """Friction in what a platform hangs on, by Dahl; see `dynamics.contact_hysteresis`.

        ================= ================= ======= =============================================
        port              type              unit    meaning
        ================= ================= ======= =============================================
        platform_state    vector(13 or 6)   m       in, from the plant
        generalized_force vector(nv)        N, N m  out, for the plant's applied_generalized_force
        bent              vector(3 or 1)    rad     out, how far contacts are bent, in P, or about
                                                    the normal of a plane
        ================= ================= ======= =============================================

        Its continuous state is that of the last port, zero where a run begins.
        """

        def _construct(
            self, in_plant: RobotInPlant, contacts: ContactHysteresis, converter: Any = None
        ) -> None:
            """For a robot whose plant is finalized.

            Args:
                in_plant: The robot in its plant; its platform turns.
                contacts: The law.
                converter: Of the template.
            """
            place = PlatformPlace.of(in_plant)
            self._declare(place, *pack_contacts(contacts, place.joint), converter)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._declare(self, other._place, other._turns, other._law, converter)

        def _declare(self, place: PlatformPlace, turns: int, law: Array, converter: Any) -> None:
            LeafSystem_[T].__init__(self, converter=converter)
            self._place, self._turns, self._law = place, turns, law
            self._force, self._rates = np.zeros(6), np.zeros(turns)
            state = self.DeclareVectorInputPort("platform_state", place.num_states)
            self._state = state.Eval
            self.DeclareContinuousState(turns)
            self.DeclareVectorOutputPort(
                "generalized_force", place.num_velocities, self._calc,
                {state.ticket(), self.xc_ticket()},
            )  # fmt: skip
            self.DeclareVectorOutputPort(BENT, turns, self._write_bent, {self.xc_ticket()})

        def _bent(self, context: Context) -> Any:
            return context.get_continuous_state_vector().CopyToVector()

        def _write_bent(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._bent(context))

        def _act(self, context: Context) -> tuple[Any, Any]:
            """Generalized force on the platform, and dz/dt."""
            state, bent = self._state(context), self._bent(context)
            if T is float:
                self._force[:] = 0.0
                rub(state, bent, self._law, self._force, self._rates)
                return self._force, self._rates
            if self._turns == 1:
                rates = contact_rates(bent, state[5:6], self._law[SLIP])
                return np.array([0.0, 0.0, -self._law[0] * bent[0]]), rates
            R = pose_on_joint(self._place.joint, state).rotation().matrix()
            rates = contact_rates(bent, R.T @ state[7:10], self._law[SLIP])
            moment = -(R @ (self._law[:3] * bent))
            return np.concatenate([moment, np.zeros(3)]), rates

        def _calc(self, context: Context, output: BasicVector) -> None:
            acting, _ = self._act(context)
            force = np.zeros(self._place.num_velocities, dtype=object if T is not float else float)
            size = self._place.joint.num_velocities
            force[self._place.start : self._place.start + size] = acting[:size]
            output.SetFromVector(force if T is float else with_derivatives(force))

        def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
            """How fast contacts bend."""
            derivatives.get_mutable_vector().SetFromVector(self._act(context)[1])

    return Impl


if TYPE_CHECKING:  # what an editor cannot see in a template

    class PlatformHysteresis(LeafSystem):
        """`PlatformHysteresis_` for float."""

        def __init__(self, in_plant: RobotInPlant, contacts: ContactHysteresis) -> None: ...
else:
    PlatformHysteresis = class_for_floats(PlatformHysteresis_)

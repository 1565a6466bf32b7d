"""What is known of a robot in its world while it moves: clearances and contact."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import GeometryId
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.systems.worlds.clearances import WorldClearances


class ClearanceMeter(LeafSystem):
    """Measures how far platform and cables are from the bodies of a world.

    =============== ============== ==== =======================================================
    port            type           unit meaning
    =============== ============== ==== =======================================================
    X_WP            RigidTransform m    in, pose of the platform
    clearance       vector(b)      m    out, platform from each body, below 0 where they overlap
    cable_clearance vector(b)      m    out, nearest cable from each body; NaN if not compared
    =============== ============== ==== =======================================================
    """

    def __init__(self, clearances: WorldClearances) -> None:
        """For a robot in a world of b bodies."""
        super().__init__()
        self._clearances = clearances
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform())).Eval
        needs = {self.all_input_ports_ticket(), self.time_ticket()}
        size = len(clearances.world.bodies)
        self.DeclareVectorOutputPort("clearance", size, self._calc_platform, needs)
        self.DeclareVectorOutputPort("cable_clearance", size, self._calc_cables, needs)

    def _calc_platform(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._clearances.platform(self._X_WP(context), context.get_time()))

    def _calc_cables(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._clearances.cables(self._X_WP(context), context.get_time()))


class ContactMeter(LeafSystem):
    """Sums up what presses on a platform.

    =============== ============== ==== ==============================================
    port            type           unit meaning
    =============== ============== ==== ==============================================
    contact_results ContactResults -    in, from the plant
    contact_force   vector(3)      N    out, on the platform, in W
    contact_count   vector(1)      -    out, points or areas of contact
    =============== ============== ==== ==============================================
    """

    def __init__(self, in_plant: RobotInPlant) -> None:
        """For a platform in a finalized plant, which is all that touches anything there."""
        super().__init__()
        self._platform = in_plant.body_index
        self._shapes: set[GeometryId] = set(
            in_plant.plant.GetCollisionGeometriesForBody(in_plant.body)
        )
        self._results = self.DeclareAbstractInputPort(
            "contact_results", AbstractValue.Make(ContactResults())
        ).Eval
        needs = {self.all_input_ports_ticket()}
        self.DeclareVectorOutputPort("contact_force", 3, self._calc_force, needs)
        self.DeclareVectorOutputPort("contact_count", 1, self._calc_count, needs)

    def _forces(self, context: Context) -> list[Array]:
        """Of each point or area of contact, on the platform [N]."""
        results = self._results(context)
        forces = []
        for k in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(k)
            sign = 1.0 if info.bodyB_index() == self._platform else -1.0
            forces.append(sign * info.contact_force())  # on body B
        for k in range(results.num_hydroelastic_contacts()):
            area = results.hydroelastic_contact_info(k)
            sign = 1.0 if area.contact_surface().id_M() in self._shapes else -1.0
            forces.append(sign * area.F_Ac_W().translational())  # on the body of M
        return forces

    def _calc_force(self, context: Context, output: BasicVector) -> None:
        output.set_value(sum(self._forces(context), start=np.zeros(3)))

    def _calc_count(self, context: Context, output: BasicVector) -> None:
        results = self._results(context)
        count = results.num_point_pair_contacts() + results.num_hydroelastic_contacts()
        output.set_value([float(count)])


class ContactStop(LeafSystem):
    """Ends a simulation when the platform touches something.

    ============= ========= ==== ==================================================
    port          type      unit meaning
    ============= ========= ==== ==================================================
    clearance     vector(b) m    in; none above 0 ends the run
    ============= ========= ==== ==================================================

    It looks at every step of the simulator.
    """

    def __init__(self, bodies: int) -> None:
        """For a world of so many bodies."""
        super().__init__()
        self._clearance = self.DeclareVectorInputPort("clearance", bodies).Eval
        self.DeclarePerStepPublishEvent(self._look)

    def _look(self, context: Context) -> EventStatus:
        if np.all(self._clearance(context) > 0.0):
            return EventStatus.DidNothing()
        return EventStatus.ReachedTermination(self, "contact")

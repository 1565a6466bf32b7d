"""Ideal cables between any bodies of a plant, whose tensions are commanded."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_route_kernel import commanded_tree_force, make_pulls
from cdpr_drake.cables.models import STRAIGHT
from cdpr_drake.cables.route_kernel import make_route_room, make_tree_room
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.plant_tree import PlantTree


class TensionDrivenRoutes(LeafSystem):
    """Massless, inextensible cables that pull on the bodies of a plant with commanded tensions.

    ================= ========== ====== =======================================================
    port              type       unit   meaning
    ================= ========== ====== =======================================================
    plant_state       vector     m, rad in, the plant's state port, shape (nq + nv,)
    tensions          vector(m)  N      in, commanded
    generalized_force vector(nv) N, N m out, -J_l' t, for the plant's applied_generalized_force
    lengths           vector(m)  m      out, over pulleys and eyelets
    length_rates      vector(m)  m/s    out, J_l v, positive while a cable gets longer
    slack             vector(m)  -      out, 1 where the command is zero or below, else 0
    ================= ========== ====== =======================================================

    A cable cannot push: a command below zero acts as zero. What moves is free to go where the
    tensions take it; `length_rates` says how fast the winches have to follow.

    Raises CableGeometryError in a simulation where a cable cannot run; names it.
    """

    def __init__(self, plant: MultibodyPlant, routes: CableRoutes) -> None:
        """For a finalized plant.

        Args:
            plant: The plant that the routes were made for.
            routes: The cables.

        Raises:
            CableModelError: A joint is not known to `models.PlantTree`; names it.
        """
        super().__init__()
        tree = PlantTree.of(plant, routes.touched_bodies())
        packed, m = routes.packed(tree.rows), routes.count
        self._names = routes.names
        self._constants = (
            *packed,
            make_route_room(packed[0], m, STRAIGHT),
            make_tree_room(tree.table),
            make_pulls(m, tree.table),
        )
        self._tree, self._work = tree.table, np.zeros((2, m))
        self._force, self._none = np.zeros(tree.num_velocities), np.zeros(m)
        state = self.DeclareVectorInputPort("plant_state", tree.num_states)
        tensions = self.DeclareVectorInputPort("tensions", m)
        self._state, self._tensions = state.Eval, tensions.Eval
        self.DeclareVectorOutputPort(
            "generalized_force",
            tree.num_velocities,
            self._calc_force,
            {self.all_input_ports_ticket()},
        )
        # What a port reads decides what may be wired in a loop: lengths may feed the tensions.
        from_state = {self.input_port_ticket(state.get_index())}
        for row, name in enumerate(("lengths", "length_rates")):
            self.DeclareVectorOutputPort(name, m, self._row_writer(row), from_state)
        self.DeclareVectorOutputPort(
            "slack", m, self._calc_slack, {self.input_port_ticket(tensions.get_index())}
        )

    def _evaluate(self, context: Context, tensions: Array, force: Array) -> None:
        bad = commanded_tree_force(
            self._tree, self._state(context), tensions, *self._constants, force, self._work
        )
        if bad >= 0:
            raise CableGeometryError(
                f"at {context.get_time():g} s: {self._names[bad]} cannot run: an anchor point lies "
                "in the groove of its pulley or on its swivel axis, or the cable has no length; "
                "accepted: a motion without that"
            )

    def _calc_force(self, context: Context, output: BasicVector) -> None:
        self._evaluate(context, self._tensions(context), output.get_mutable_value())

    def _row_writer(self, row: int) -> Callable[[Context, BasicVector], None]:
        def write(context: Context, output: BasicVector) -> None:
            self._evaluate(context, self._none, self._force)
            output.set_value(self._work[row])

        return write

    def _calc_slack(self, context: Context, output: BasicVector) -> None:
        output.set_value((self._tensions(context) <= 0.0).astype(float))

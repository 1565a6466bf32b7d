"""Ideal cables whose tensions are commanded."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cdpr_drake.models import RobotInPlant
from cdpr_drake.tension_kernel import (
    floating_cable_motions,
    floating_tension_force,
    planar_cable_motions,
    planar_tension_force,
)


class TensionDrivenCables(LeafSystem):
    """Massless, inextensible cables that pull on the platform with commanded tensions.

    ================= ========== ===== ========================================================
    port              type       unit  meaning
    ================= ========== ===== ========================================================
    platform_state    vector     m     in, as `CableForces` takes it
    tensions          vector(m)  N     in, commanded
    generalized_force vector(nv) N, Nm out, for the plant's applied_generalized_force
    lengths           vector(m)  m     out, |A_i B_i|
    length_rates      vector(m)  m/s   out, positive while a cable gets longer
    slack             vector(m)  -     out, 1 where the command is zero or below, else 0
    ================= ========== ===== ========================================================

    A cable cannot push: a command below zero acts as zero. The platform is free to move where the
    tensions take it; `length_rates` says how fast the winches have to follow.
    """

    def __init__(self, in_plant: RobotInPlant) -> None:
        """For a robot whose plant is finalized; see `cdpr_drake.models.add_robot`."""
        super().__init__()
        robot, plant = in_plant.robot, in_plant.plant
        self._cables = robot.packed_cables()
        m = len(robot.cables)
        self._work = np.zeros((2, m))
        self._start = in_plant.first_velocity()
        planar = robot.is_planar()
        self._height = float(robot.plane_height) if planar else 0.0  # type: ignore[arg-type]
        num_states = plant.num_multibody_states(in_plant.model_instance)
        state = self.DeclareVectorInputPort("platform_state", num_states)
        tensions = self.DeclareVectorInputPort("tensions", m)
        # Looked up once: these are called several thousand times per simulated second.
        self._state, self._tensions = state.Eval, tensions.Eval
        self.DeclareVectorOutputPort(
            "generalized_force",
            plant.num_velocities(),
            self._calc_planar_force if planar else self._calc_floating_force,
            {self.all_input_ports_ticket()},
        )
        # What a port reads decides what may be wired in a loop: lengths may feed the tensions.
        from_state = {self.input_port_ticket(state.get_index())}
        for row, name in enumerate(("lengths", "length_rates")):
            self.DeclareVectorOutputPort(name, m, self._row_writer(row, planar), from_state)
        self.DeclareVectorOutputPort(
            "slack", m, self._calc_slack, {self.input_port_ticket(tensions.get_index())}
        )

    def _calc_floating_force(self, context: Context, output: BasicVector) -> None:
        floating_tension_force(
            self._state(context),
            self._tensions(context),
            self._cables,
            self._start,
            output.get_mutable_value(),
        )

    def _calc_planar_force(self, context: Context, output: BasicVector) -> None:
        planar_tension_force(
            self._state(context),
            self._tensions(context),
            self._cables,
            self._start,
            output.get_mutable_value(),
            self._height,
        )

    def _row_writer(self, row: int, planar: bool) -> Callable[[Context, BasicVector], None]:
        def write(context: Context, output: BasicVector) -> None:
            if planar:
                planar_cable_motions(self._state(context), self._cables, self._work, self._height)
            else:
                floating_cable_motions(self._state(context), self._cables, self._work)
            output.set_value(self._work[row])

        return write

    def _calc_slack(self, context: Context, output: BasicVector) -> None:
        output.set_value((self._tensions(context) <= 0.0).astype(float))

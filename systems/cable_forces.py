"""The cables of a robot as a force system beside a MultibodyPlant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cable_kernel import floating_cables, floating_force, planar_cables, planar_force
from cdpr_drake.models import RobotInPlant


class CableForces(LeafSystem):
    """Straight elastic cables that pull on the platform of a robot, and transmit nothing slack.

    ======================= ========== ===== ==================================================
    port                    type       unit  meaning
    ======================= ========== ===== ==================================================
    platform_state          vector     m     in, from the plant's state port of the robot's
                                             model instance, shape (13,) or, planar, (6,)
    unstrained_lengths      vector(m)  m     in
    unstrained_length_rates vector(m)  m/s   in
    generalized_force       vector(nv) N, Nm out, for the plant's applied_generalized_force
    tensions                vector(m)  N     out, exactly 0 where slack
    lengths                 vector(m)  m     out, straight distances |A_i B_i|
    slack                   vector(m)  -     out, 1 where a cable transmits nothing, else 0
    ======================= ========== ===== ==================================================
    """

    def __init__(self, in_plant: RobotInPlant) -> None:
        """For a robot whose plant is finalized; see `cdpr_drake.models.add_robot`."""
        super().__init__()
        robot, plant = in_plant.robot, in_plant.plant
        self._cables = robot.packed_cables()
        m = len(robot.cables)
        self._work = np.zeros((3, m))
        self._start = in_plant.first_velocity()
        num_states = plant.num_multibody_states(in_plant.model_instance)
        # Looked up once: these are called several thousand times per simulated second.
        self._state = self.DeclareVectorInputPort("platform_state", num_states).Eval
        self._l0 = self.DeclareVectorInputPort("unstrained_lengths", m).Eval
        self._l0_dot = self.DeclareVectorInputPort("unstrained_length_rates", m).Eval
        planar = robot.is_planar()
        self._height = float(robot.plane_height) if planar else 0.0  # type: ignore[arg-type]
        self.DeclareVectorOutputPort(
            "generalized_force",
            plant.num_velocities(),
            self._calc_planar_force if planar else self._calc_floating_force,
            {self.all_input_ports_ticket()},
        )
        for row, name in enumerate(("tensions", "lengths", "slack")):
            self.DeclareVectorOutputPort(
                name, m, self._row_writer(row, planar), {self.all_input_ports_ticket()}
            )

    def _calc_floating_force(self, context: Context, output: BasicVector) -> None:
        floating_force(
            self._state(context),
            self._l0(context),
            self._l0_dot(context),
            self._cables,
            self._start,
            output.get_mutable_value(),
        )

    def _calc_planar_force(self, context: Context, output: BasicVector) -> None:
        planar_force(
            self._state(context),
            self._l0(context),
            self._l0_dot(context),
            self._cables,
            self._start,
            output.get_mutable_value(),
            self._height,
        )

    def _row_writer(self, row: int, planar: bool) -> Callable[[Context, BasicVector], None]:
        def write(context: Context, output: BasicVector) -> None:
            inputs = self._state(context), self._l0(context), self._l0_dot(context)
            if planar:
                planar_cables(*inputs, self._cables, self._work, self._height)
            else:
                floating_cables(*inputs, self._cables, self._work)
            output.set_value(self._work[row])

        return write

    def cables(self) -> Array:
        """The packed cables, shape (m, 8), as `cdpr_drake.cable_kernel` explains them."""
        return self._cables

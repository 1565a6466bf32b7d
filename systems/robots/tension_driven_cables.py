"""Ideal cables whose tensions are commanded."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cdpr_drake.cables.commanded_tension_kernel import cable_motions, tension_force
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_on_joint


class TensionDrivenCables(LeafSystem):
    """Massless, inextensible cables that pull on the platform with commanded tensions.

    ================= ========== ===== ========================================================
    port              type       unit  meaning
    ================= ========== ===== ========================================================
    platform_state    vector     m     in, as `CableForces` takes it
    tensions          vector(m)  N     in, commanded
    generalized_force vector(nv) N, Nm out, for the plant's applied_generalized_force
    lengths           vector(m)  m     out, |A_i B_i|, or along the groove and then straight
    length_rates      vector(m)  m/s   out, positive while a cable gets longer
    slack             vector(m)  -     out, 1 where the command is zero or below, else 0
    ================= ========== ===== ========================================================

    A cable cannot push: a command below zero acts as zero. The platform is free to move where the
    tensions take it; `length_rates` says how fast the winches have to follow.

    Raises CableGeometryError in a simulation where an anchor point comes into the groove of its
    pulley or onto its swivel axis.
    """

    def __init__(
        self, in_plant: RobotInPlant, push: bool = False, cables: CableSet | None = None
    ) -> None:
        """For a robot whose plant is finalized; see `cdpr_drake.models.add_robot`.

        Args:
            in_plant: The robot in its plant.
            push: Whether a command below zero pushes after all, as rods in place of the cables
                would; `slack` still tells where a cable would not.
            cables: The cables as they really are; None: the robot's, from fixed exit points.
        """
        super().__init__()
        robot, plant = in_plant.robot, in_plant.plant
        joint = self._joint = robot.joint()
        self._set = robot.cable_set().without_pulleys() if cables is None else cables
        self._cables = joint.turned(self._set).packed()
        m = self._set.count
        self._work = np.zeros((2, m))
        self._height = joint.height
        num_states = plant.num_multibody_states(in_plant.model_instance)
        state = self.DeclareVectorInputPort("platform_state", num_states)
        tensions = self.DeclareVectorInputPort("tensions", m)
        self._state, self._tensions = state.Eval, tensions.Eval
        self.DeclareVectorOutputPort(
            "generalized_force",
            plant.num_velocities(),
            self._force_writer(in_plant.first_velocity(), push),
            {self.all_input_ports_ticket()},
        )
        # What a port reads decides what may be wired in a loop: lengths may feed the tensions.
        from_state = {self.input_port_ticket(state.get_index())}
        for row, name in enumerate(("lengths", "length_rates")):
            self.DeclareVectorOutputPort(name, m, self._row_writer(row), from_state)
        self.DeclareVectorOutputPort(
            "slack", m, self._calc_slack, {self.input_port_ticket(tensions.get_index())}
        )

    def _force_writer(self, start: int, push: bool) -> Callable[[Context, BasicVector], None]:
        # Called several thousand times per simulated second: local names cost least.
        state, tensions = self._state, self._tensions
        cables, height = self._cables, self._height

        def write(context: Context, output: BasicVector) -> None:
            tension_force(
                state(context),
                tensions(context),
                cables,
                height,
                push,
                start,
                output.get_mutable_value(),
            )

        if not self._set.has_pulleys():
            return write

        def write_checked(context: Context, output: BasicVector) -> None:
            write(context, output)
            if np.isnan(output.get_value()[start]):
                self._refuse_impossible(context)

        return write_checked

    def _refuse_impossible(self, context: Context) -> None:
        """Raises an error if a cable cannot run; a state or tension that is NaN is none."""
        X_WP = pose_on_joint(self._joint, self._state(context))
        try:
            cable_paths(X_WP, self._set)
        except CableGeometryError as problem:
            raise CableGeometryError(f"at {context.get_time():g} s: {problem}") from None

    def _row_writer(self, row: int) -> Callable[[Context, BasicVector], None]:
        def write(context: Context, output: BasicVector) -> None:
            cable_motions(self._state(context), self._cables, self._height, self._work)
            output.set_value(self._work[row])

        return write

    def _calc_slack(self, context: Context, output: BasicVector) -> None:
        output.set_value((self._tensions(context) <= 0.0).astype(float))

"""Drives bodies of a plant along their motions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_vector
from cdpr_drake.systems.worlds.contact import DRIVEN_MASS, MODEL_INSTANCE
from cdpr_drake.systems.worlds.world import WorldBody

RATE = 20.0
"""At which a body comes back to its motion, critically damped [1/s]: what the integration of its
acceleration leaves, and what meets it, is taken back; slow against every step."""


class BodyDriver(LeafSystem):
    """Gives bodies that move freely the accelerations of their motions.

    ================= ========== ===== =========================================================
    port              type       unit  meaning
    ================= ========== ===== =========================================================
    state             vector     m     in, of the bodies, from the plant's port of their instance
    generalized_force vector(nv) N, Nm out, for the plant's applied_generalized_force
    ================= ========== ===== =========================================================

    A body's own turning takes no force: its inertia is the same about every axis.
    """

    def __init__(
        self, plant: MultibodyPlant, bodies: Sequence[tuple[WorldBody, RigidBody]]
    ) -> None:
        """For bodies that `add_contact` has put into a plant, which is finalized."""
        super().__init__()
        self._plant = plant
        self._instance = plant.GetModelInstanceByName(MODEL_INSTANCE)
        self._bodies = list(bodies)
        self._nv, own_nq = plant.num_velocities(), plant.num_positions(self._instance)
        first_q = min(body.floating_positions_start() for _, body in self._bodies)
        first_v = min(body.floating_velocities_start_in_v() for _, body in self._bodies)
        self._places = [
            (
                world_body.motion,
                body.floating_positions_start() - first_q,
                own_nq + body.floating_velocities_start_in_v() - first_v,
                body.floating_velocities_start_in_v(),
            )
            for world_body, body in self._bodies
        ]
        size = plant.num_multibody_states(self._instance)
        self._state = self.DeclareVectorInputPort("state", size).Eval
        self.DeclareVectorOutputPort("generalized_force", self._nv, self._calc)

    def bodies(self) -> list[tuple[WorldBody, RigidBody]]:
        """The bodies of the world that it drives, each with its body in the plant."""
        return list(self._bodies)

    def start(self, plant_context: Context, time: float = 0.0) -> None:
        """Puts the bodies where they are at a time [s], with their velocities there."""
        for world_body, body in self._bodies:
            row = world_body.motion.motion(time)
            self._plant.SetFreeBodyPose(plant_context, body, world_body.motion.at(time))
            velocities = self._plant.GetVelocities(plant_context)
            start = body.floating_velocities_start_in_v()
            velocities[start : start + 6] = row[7:13]
            self._plant.SetVelocities(plant_context, velocities)

    def _calc(self, context: Context, output: BasicVector) -> None:
        state, time = self._state(context), context.get_time()
        force: Array = np.zeros(self._nv)
        for motion, q, v, out in self._places:
            row = motion.motion(time)
            R_now = RigidTransform(
                Quaternion(state[q : q + 4] / np.linalg.norm(state[q : q + 4])), np.zeros(3)
            ).rotation()
            wanted = RigidTransform(Quaternion(row[:4]), row[4:7])
            off = np.concatenate([
                rotation_vector(wanted.rotation() @ R_now.inverse()),
                row[4:7] - state[q + 4 : q + 7],
            ])  # fmt: skip
            rate_off = row[7:13] - state[v : v + 6]
            force[out : out + 6] = DRIVEN_MASS * (
                row[13:] + 2.0 * RATE * rate_off + RATE * RATE * off
            )
        output.set_value(force)

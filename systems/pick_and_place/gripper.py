"""A gripper that holds a box by a compliance: a force between two bodies of a plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.systems.pick_and_place.grip_kernel import FORCES, grip_forces

OPEN, HOLDING, MISSED, TORN = 0.0, 1.0, 2.0, 3.0
"""What a gripper is: open; closed with a box; closed without, for nothing was near; closed after a
force that was too large."""

WATCH_RATE = 200.0
"""At which a gripper looks at its command and at its force [Hz]."""


@dataclass(frozen=True)
class GripLaw:
    """What a gripper can do.

    Attributes:
        p_PT: Its tip in P, whose axis is -z of P [m].
        p_BF: Middle of the upper face in B, whose normal is z of B [m].
        reach: Largest distance of tip and face along the normal [m].
        sideways: Largest distance across [m].
        tilt: Largest angle of axis and normal [rad].
        stiffness: [N/m].
        damping: [N s/m].
        rotational_stiffness: [N m].
        rotational_damping: [N m s].
        strength: Force beyond which it tears off [N].
    """

    p_PT: Array
    p_BF: Array
    reach: float
    sideways: float
    tilt: float
    stiffness: float
    damping: float
    rotational_stiffness: float
    rotational_damping: float
    strength: float

    def offsets(self, X_WP: RigidTransform, X_WB: RigidTransform) -> Array:
        """Distance along the normal and across [m], and tilt [rad], of tip and face, shape (3,)."""
        p_B = X_WB.inverse() @ (X_WP @ self.p_PT) - self.p_BF
        axes = X_WP.rotation().matrix()[:, 2] @ X_WB.rotation().matrix()[:, 2]
        return np.array([
            abs(p_B[2]), np.hypot(p_B[0], p_B[1]), np.arccos(np.clip(axes, -1.0, 1.0))
        ])  # fmt: skip

    def can_grip(self, X_WP: RigidTransform, X_WB: RigidTransform) -> bool:
        """Whether a box is within reach."""
        return bool(np.all(self.offsets(X_WP, X_WB) <= [self.reach, self.sideways, self.tilt]))


def body_state(state: Array) -> tuple[RigidTransform, Array, Array]:
    """Pose in W [m], angular velocity [rad/s] and velocity of the origin [m/s] of a floating body,
    from its state as the plant's port gives it, shape (13,)."""
    q = state[:4] / np.linalg.norm(state[:4])
    return RigidTransform(Quaternion(q), state[4:7]), state[7:10], state[10:13]


class Gripper(LeafSystem):
    """Holds the box, while it is closed and holds it, where the box was when it closed.

    ============== ================== ==== ====================================================
    port           type               unit meaning
    ============== ================== ==== ====================================================
    platform_state vector(13)         m    in, as `CableForces` takes it
    box_state      vector(13)         m    in, of the box, from the plant's port
    gripper_closed vector(1)          -    in, 1 while it shall be closed
    forces         vector(nv)         N,   out, generalized, for the plant
                                      N m
    X_WB           RigidTransform     m    out, true pose of the box
    holding        vector(1)          -    out, 1 while it holds the box: the vacuum is there
    load           vector(1)          N    out, force on the box along the tip's axis, up
    grip           vector(5)          m,   out, what it is (OPEN, HOLDING, MISSED, TORN); distance
                                      rad, along the normal and across, and tilt when it closed;
                                      N    largest force since then
    ============== ================== ==== ====================================================

    Closing changes neither pose nor velocity: the compliance rests where the box is. It looks at
    its command `WATCH_RATE` times a second; what it does in between is continuous. The force on the
    box is that of a spring and a damper along all axes, the moment likewise, both at the middle of
    its upper face, and the opposite of both is on the platform there: momentum is kept, and the
    box's weight and inertia come onto the platform by these forces alone.
    """

    def __init__(self, law: GripLaw, plant: MultibodyPlant, bodies: Sequence[RigidBody]) -> None:
        """For two floating bodies, platform and box, of a finalized plant."""
        super().__init__()
        self.law, self._size = law, plant.num_velocities()
        self._starts = [int(body.floating_velocities_start_in_v()) for body in bodies]
        self._constants = np.array([
            law.stiffness, law.damping, law.rotational_stiffness, law.rotational_damping
        ])  # fmt: skip
        self._memory = self.DeclareDiscreteState(np.zeros(5))
        self._hold = self.DeclareDiscreteState(pose_row(RigidTransform()))
        self._platform = self.DeclareVectorInputPort("platform_state", 13)
        self._box = self.DeclareVectorInputPort("box_state", 13)
        self._closed = self.DeclareVectorInputPort("gripper_closed", 1)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / WATCH_RATE, 0.0, self._update)
        own = {self.discrete_state_ticket(self._memory), self.discrete_state_ticket(self._hold)}
        states = {self.input_port_ticket(port.get_index()) for port in (self._platform, self._box)}
        self.DeclareVectorOutputPort("forces", self._size, self._calc_forces, own | states)
        self.DeclareAbstractOutputPort(
            "X_WB", lambda: Value(RigidTransform()), self._calc_box,
            {self.input_port_ticket(self._box.get_index())},
        )  # fmt: skip
        self.DeclareVectorOutputPort("holding", 1, self._calc_holding, own)
        self.DeclareVectorOutputPort("load", 1, self._calc_load, own | states)
        self.DeclareVectorOutputPort("grip", 5, self._calc_grip, own)

    def status(self, context: Context) -> Array:
        """What stands on the port `grip`, from this block's own context."""
        return np.array(context.get_discrete_state(self._memory).value())

    def _update(self, context: Context, values: DiscreteValues) -> None:
        memory = self.status(context)
        wanted = bool(self._closed.Eval(context)[0])
        if not wanted:
            memory[0] = OPEN
        elif memory[0] == OPEN:
            X_WP, X_WB = (body_state(p.Eval(context))[0] for p in (self._platform, self._box))
            near = self.law.can_grip(X_WP, X_WB)
            memory = np.array([
                HOLDING if near else MISSED, *self.law.offsets(X_WP, X_WB), 0.0
            ])  # fmt: skip
            values.set_value(self._hold, pose_row(X_WP.inverse() @ X_WB))
        elif memory[0] == HOLDING:
            force = float(self.forces(context)[13])
            memory[4] = max(memory[4], force)
            if force > self.law.strength:
                memory[0] = TORN
        values.set_value(self._memory, memory)

    def forces(self, context: Context) -> Array:
        """What the grip does, as `grip_kernel.grip_forces` writes it; zeros while it is open."""
        work = np.zeros(FORCES)
        if context.get_discrete_state(self._memory).value()[0] == HOLDING:
            hold = context.get_discrete_state(self._hold).value()
            grip_forces(
                self._platform.Eval(context), self._box.Eval(context), hold, self.law.p_BF,
                self._constants, work,
            )  # fmt: skip
        return work

    def _calc_forces(self, context: Context, output: BasicVector) -> None:
        all_forces: Array = np.zeros(self._size)
        work = self.forces(context)
        for start, first in zip(self._starts, (0, 6), strict=True):
            all_forces[start : start + 6] = work[first : first + 6]
        output.set_value(all_forces)

    def _calc_box(self, context: Context, output: AbstractValue) -> None:
        output.set_value(body_state(self._box.Eval(context))[0])

    def _calc_holding(self, context: Context, output: BasicVector) -> None:
        output.set_value([float(self.status(context)[0] == HOLDING)])

    def _calc_load(self, context: Context, output: BasicVector) -> None:
        output.set_value([float(self.forces(context)[12])])

    def _calc_grip(self, context: Context, output: BasicVector) -> None:
        output.set_value(self.status(context))

"""Motors of the mobile bases."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.tree import JointIndex, PrismaticJoint
from pydrake.systems.framework import LeafSystem


class DrivenBases(LeafSystem):
    """Motors that make the bases follow sines, by feedback, and what they are asked for."""

    STIFF, DAMPED, WAY, TURN = 2e5, 6e3, 0.06, 1.5
    told = 1.0

    def __init__(self, plant):
        super().__init__()
        joints = [plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices()]
        self._joints = [joint for joint in joints if isinstance(joint, PrismaticJoint)]
        self._nq, self._nv = plant.num_positions(), plant.num_velocities()
        states = plant.num_multibody_states()
        self._state = self.DeclareVectorInputPort("plant_state", states)
        self.DeclareVectorOutputPort("force", self._nv, self._calc_force)
        # What a servo is told: measured velocities would close a loop through elastic cables.
        self.DeclareVectorOutputPort("believed_state", states, self._calc_believed)

    def _wanted(self, context):
        for k, joint in enumerate(self._joints):
            turn = self.TURN * (1.0 if k % 2 else 0.8)
            phase = turn * context.get_time()
            speed = turn * self.WAY * np.sin(phase)
            yield joint, self.WAY * (1.0 - np.cos(phase)), speed

    def _calc_force(self, context, output):
        state, force = self._state.Eval(context), np.zeros(self._nv)
        for joint, way, speed in self._wanted(context):
            v = joint.velocity_start()
            off, slow = way - state[joint.position_start()], speed - state[self._nq + v]
            force[v] = self.STIFF * off + self.DAMPED * slow
        output.SetFromVector(force)

    def _calc_believed(self, context, output):
        state = np.array(self._state.Eval(context))
        for joint, _, speed in self._wanted(context):
            state[self._nq + joint.velocity_start()] = self.told * speed
        output.SetFromVector(state)

"""The phases of a task as a block: from sightings to what the servo shall do."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DependencyTicket,
    DiscreteValues,
    LeafSystem,
)

from cdpr_drake.systems.pick_and_place.pick_and_place_task import (
    CLOSED,
    LOOKS_AT_GOAL,
    LOOKS_AT_OBJECT,
    PickAndPlaceState,
    PickAndPlaceTask,
    Reading,
)

X_CdV = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.0, 0.0, 0.1])
"""Where the servo wants to see what stands for the platform's aim: anything in view of the camera
does, since only what is apart of it counts."""


class PickAndPlaceStateMachine(LeafSystem):
    """Tells the servo where to go, the cameras whether to look, and the gripper whether to close.

    =============== ============== ==== ==========================================================
    port            type           unit meaning
    =============== ============== ==== ==========================================================
    X_WP            RigidTransform m    in, estimated pose of the platform
    X_CO            RigidTransform m    in, box's tag in its camera
    object_found    vector(1)      -    in, 1 while that is seen
    X_CT            RigidTransform m    in, goal's tag in its camera
    goal_found      vector(1)      -    in, 1 while that is seen
    holding         vector(1)      -    in, 1 while the gripper holds something
    load            vector(1)      N    in, force that the grip carries along its axis
    X_CV            RigidTransform m    out, what the servo looks at: seen as `X_CdV` once the
                                        platform is where it shall be
    platform_moving vector(1)      -    out, 1 while the platform shall move; 0 for one step where a
                                        phase begins, so that the servo begins anew
    gripper_closed  vector(1)      -    out, 1 while the gripper shall be closed
    enabled         vector(2)      -    out, 1 for each camera, box and goal, that shall look
    phase           vector(2)      -, s out, number of the phase, and when it began
    X_WP_aim        RigidTransform m    out, where the platform shall go, as poses are estimated
    =============== ============== ==== ==========================================================

    What is seen came from the images of the step before, and is taken together with the pose that
    was estimated then; where to go is said with the pose that is estimated now.
    """

    def __init__(self, task: PickAndPlaceTask, X_WP0: RigidTransform, X_PC: RigidTransform) -> None:
        """For a task, the pose that is believed at time 0, and the camera of the servo [m]."""
        super().__init__()
        self.task, self._X_PC = task, X_PC
        self._memory = self.DeclareDiscreteState(task.start(X_WP0).packed())
        for name in ("X_WP", "X_CO", "X_CT"):
            self.DeclareAbstractInputPort(name, Value(RigidTransform()))
        for name in ("object_found", "goal_found", "holding", "load"):
            self.DeclareVectorInputPort(name, 1)
        self.DeclarePeriodicDiscreteUpdateEvent(task.rules.period, 0.0, self._update)
        state = {self.discrete_state_ticket(self._memory)}
        pose = {self.input_port_ticket(self.GetInputPort("X_WP").get_index())}

        def declare(name: str, calc: Any, tickets: set[DependencyTicket]) -> None:
            self.DeclareAbstractOutputPort(name, lambda: Value(RigidTransform()), calc, tickets)

        declare("X_CV", self._calc_view, state | pose)
        declare("X_WP_aim", self._calc_aim, state | pose)
        self.DeclareVectorOutputPort("platform_moving", 1, self._calc_moves, state)
        self.DeclareVectorOutputPort("gripper_closed", 1, self._calc_closed, state)
        self.DeclareVectorOutputPort("enabled", 2, self._calc_looks, state)
        self.DeclareVectorOutputPort("phase", 2, self._calc_phase, state)

    def state(self, context: Context) -> PickAndPlaceState:
        """Where the task stands, from this block's own context."""
        return PickAndPlaceState.unpacked(context.get_discrete_state(self._memory).value())

    def _read(self, context: Context, name: str) -> Any:
        return self.GetInputPort(name).Eval(context)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        def seen(pose: str, found: str) -> RigidTransform | None:
            return self._read(context, pose) if self._read(context, found)[0] else None

        reading = Reading(
            time=context.get_time(),
            X_WP=self._read(context, "X_WP"),
            X_CO=seen("X_CO", "object_found"),
            X_CT=seen("X_CT", "goal_found"),
            holding=bool(self._read(context, "holding")[0]),
            load=float(self._read(context, "load")[0]),
        )
        values.set_value(self._memory, self.task.step(self.state(context), reading).packed())

    def _aim(self, context: Context) -> RigidTransform:
        aim = self.task.aim(self.state(context))
        return self._read(context, "X_WP") if aim is None else aim

    def _calc_aim(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._aim(context))

    def _calc_view(self, context: Context, output: AbstractValue) -> None:
        X_PA = self._read(context, "X_WP").inverse() @ self._aim(context)
        output.set_value(self._X_PC.inverse() @ X_PA @ self._X_PC @ X_CdV)

    def _calc_moves(self, context: Context, output: BasicVector) -> None:
        state = self.state(context)
        rests = self.task.aim(state) is None
        output.set_value([float(not (rests or state.is_new()))])

    def _calc_closed(self, context: Context, output: BasicVector) -> None:
        output.set_value([float(self.state(context).phase in CLOSED)])

    def _calc_looks(self, context: Context, output: BasicVector) -> None:
        phase = self.state(context).phase
        output.set_value([float(phase in LOOKS_AT_OBJECT), float(phase in LOOKS_AT_GOAL)])

    def _calc_phase(self, context: Context, output: BasicVector) -> None:
        state = self.state(context)
        output.set_value([float(state.phase), state.began])

"""Section `pose_plan` of a visual servo, and its block: vision-based position control.

A plan leads to where the camera sees the target as desired, in the place of its features.
"""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiscreteValues

from cdpr_drake.arrays import Array
from cdpr_drake.control.planned_goal import GoalPlan, goal_offset, goal_pose
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.schema.declarations import In, Refusal, Scope, settings
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.servo_law import saturation_share
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.systems.sections import Section
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target

TASK, BEGAN, DURATION = range(3)
"""Memory of a plan: number of its task, -1 before the first; when it began, and its T [s]."""


@settings
class PosePlanSettings(Section):
    """The way of the platform to where it sees the target as desired: straight, quintic in time."""

    words = (
        "A planned way to the pose from which the target is seen as desired, instead of visual "
        "servoing"
    )

    speed: Annotated[float, In("m/s", gt=0.0), "Largest speed of the platform."] = 0.15
    rotation_speed_deg: Annotated[float, In("deg/s", gt=0.0), "Largest angular speed."] = 20.0
    gain: Annotated[
        float, In("1/s", gt=0.0), "Rate at which what is left fades at the end of the way."
    ] = 2.0

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """What contradicts a planned way to the pose that the camera asks for."""
        scenario = scope.whole
        for key in ("open_loop", "trajectory"):
            if getattr(scenario, key) is not None:
                yield f"/{key}", "a section with pose_plan", "null"
        if scenario.target.carrier != "world":
            yield "/target.carrier", f"{scenario.target.carrier} with pose_plan", "world"
        if scenario.target.kind == "circles":
            found = "circles, which do not tell a pose, with pose_plan"
            yield "/target.kind", found, "another kind"
        if scenario.controller.free_rotation:
            accepted = "false: all of the pose is controlled"
            yield "/controller.free_rotation", "true with pose_plan", accepted

    def make_servo(self, model: Any, settings: Any) -> "PlannedPoseServo":
        """A `PlannedPoseServo`."""
        return PlannedPoseServo(
            model.controller, model.target, model.pinhole, settings.controller.rate,
            GoalPlan(self.speed, float(np.radians(self.rotation_speed_deg)), self.gain),
            [task.desired.transform() for task in settings.tasks()],
        )  # fmt: skip


class PlannedPoseServo(FeatureServo):
    """Vision-based position control: the camera says where to, a plan how, the model by what.

    Ports are those of `FeatureServo`, so that the two are exchanged for each other, and

    ========= ============== ==== ==========================================================
    port      type           unit meaning
    ========= ============== ==== ==========================================================
    X_WP_goal RigidTransform m    out, pose X_WP* where the platform shall be, by the last image
                                  that showed the target; before the first the pose of the start
    ========= ============== ==== ==========================================================

    Every image corrects the goal, and the platform heads for it from where it is believed to be;
    see `GoalPlan`. The gain is that plan's rate. While the target is not found the cables
    stop; then, and with a new task, the plan begins anew. Winches by velocity or position follow
    its cable velocities, winches by torque its twist.

    Source: servoing thesis 5.2.4, Figs 5.9 and 5.10, (5.9).
    """

    def __init__(
        self,
        controller: ServoController,
        target: Target,
        pinhole: Pinhole,
        rate: float,
        plan: GoalPlan,
        goals: Sequence[RigidTransform],
    ) -> None:
        """With features whose error is logged, a rate [Hz], a plan, and X_C*O of each task [m]."""
        super().__init__(controller, target, pinhole, rate)
        self._plan, self._goals = plan, tuple(goals)
        self._begins = np.array([task.begins for task in controller.tasks])
        self._planned = self.DeclareDiscreteState(np.array([-1.0, 0.0, 0.0]))
        self._goal = self.DeclareDiscreteState(pose_row(controller.robot.X_WP0))
        self.DeclareAbstractOutputPort(
            "X_WP_goal", lambda: Value(RigidTransform()), self._calc_goal,
            {self.discrete_state_ticket(self._goal)},
        )  # fmt: skip

    def logged(self) -> tuple[str, ...]:
        """As of `FeatureServo`, and the goal."""
        return (*super().logged(), "X_WP_goal")

    def _task(self, time: float) -> int:
        return int(np.searchsorted(self._begins, time, side="right")) - 1

    def _seen_goal(self, context: Context) -> RigidTransform | None:
        """X_WP* by the image of now; None where it does not show the target."""
        if self.GetInputPort("found").Eval(context)[0] == 0.0:
            return None
        return goal_pose(
            self.GetInputPort("X_WP").Eval(context),
            self.controller.robot.X_PC,
            self.GetInputPort("X_CO").Eval(context),
            self._goals[self._task(context.get_time())],
        )

    def _update(self, context: Context, state: DiscreteValues) -> None:
        super()._update(context, state)
        goal, now = self._seen_goal(context), context.get_time()
        if goal is None:
            state.set_value(self._planned, [-1.0, 0.0, 0.0])
            return
        state.set_value(self._goal, pose_row(goal))
        robot, X_WP = self.controller.robot, self.GetInputPort("X_WP").Eval(context)
        offset, task = goal_offset(X_WP, goal), self._task(now)
        memory = context.get_discrete_state(self._planned).value()
        if int(memory[TASK]) != task:
            memory = np.array([task, now, self._plan.duration(offset)])
        state.set_value(self._planned, memory)
        passed = now - memory[BEGAN]
        V_P: Array = np.zeros(6)
        moves = list(robot.motions)
        V_P[moves] = self._plan.twist(offset, passed, memory[DURATION])[moves]
        R = X_WP.rotation().matrix()
        V_WP = np.concatenate([R @ V_P[:3], R @ V_P[3:]])
        rates = cable_jacobian(X_WP, robot.cables) @ V_WP
        share = saturation_share(rates, robot.cable_speed)
        state.set_value(self._outputs["cable_velocities"], share * rates)
        state.set_value(self._outputs["platform_velocity"], share * V_P)
        state.set_value(self._outputs["gain"], [self._plan.rate(passed, memory[DURATION])])

    def _calc_goal(self, context: Context, output: AbstractValue) -> None:
        output.set_value(pose_from_row(context.get_discrete_state(self._goal).value()))

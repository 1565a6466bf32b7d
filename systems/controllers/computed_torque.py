"""Computed-torque control of the platform in task space, along a trajectory of poses.

Source: see `control.task_space.computed_torque`.
"""

from __future__ import annotations

from dataclasses import replace

from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DependencyTicket, LeafSystem

from cdpr_drake.control.force_balance import FORCE, WRENCH
from cdpr_drake.control.task_space import (
    PlatformDynamics,
    TaskGains,
    TrackingStep,
    tracking_wrench_at,
)
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.robot_in_plant import RobotInPlant, platform_inertia, pose_on_joint
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory


def platform_dynamics(
    robot: Robot, balance: str = WRENCH, damping: tuple[float, float] | None = None
) -> PlatformDynamics:
    """The dynamics of a robot's platform, exactly as the plant has them.

    Args:
        robot: The robot.
        balance: A name of `force_balance.BALANCES`; by forces alone it is taken for a point mass.
        damping: Of the platform, [N s/m] and [N m s/rad]; None: the robot file's.

    Raises:
        RobotFileError: It is of a motion type that computed torque does not know, or its gravity
            is tilted.
    """
    motions = robot.servo_rows("computed torque")
    if robot.gravity > 0.0 and robot.down() != (0.0, 0.0, -1.0):
        raise RobotFileError(
            f"robot {robot.name}: gravity_direction: found {robot.gravity_direction.tolist()}; "
            "accepted by computed torque: along -z of W"
        )
    if damping is None:
        damping = robot.damping.translation, robot.damping.rotation
    return PlatformDynamics(
        platform_inertia(robot), robot.gravity, motions, balance == FORCE, damping
    )


class PoseTracking(LeafSystem):
    """Asks for the wrench that makes the platform follow a trajectory.

    ============== ============== ===== ========================================================
    port           type           unit  meaning
    ============== ============== ===== ========================================================
    platform_state vector         m     in, as `CableForces` takes it
    desired_wrench vector(6)      Nm, N out, F_P_W about Po that the cables must put on the
                                        platform
    X_WP           RigidTransform m     out, pose of the platform
    X_WP_desired   RigidTransform m     out, pose where it should be now
    ============== ============== ===== ========================================================

    Where forces alone are balanced, the wrench is a force through the centre of mass, which follows
    where the desired pose has it; the platform turns as it will.

    Trajectory and controller in one: in a fast loop a call of a block costs more than what it
    computes. The wrench follows the state at once; what holds it samples it.

    Source: see `task_space.computed_torque`.

    Attributes:
        dynamics: What the controller believes of the platform.
    """

    def __init__(
        self,
        in_plant: RobotInPlant,
        trajectory: PoseTrajectory,
        gains: TaskGains,
        dynamics: PlatformDynamics | None = None,
        *,
        balance: str = WRENCH,
    ) -> None:
        """For a robot whose plant is finalized.

        Args:
            in_plant: The robot in its plant; only its kind of joint and its state's size matter.
            trajectory: The desired motion.
            gains: Kp and Kd.
            dynamics: What the controller believes of the platform; None for the exact model, with
                the damping of the robot's file.
            balance: What tensions balance, a name of `force_balance.BALANCES`.
        """
        super().__init__()
        robot = in_plant.robot
        believed = dynamics or platform_dynamics(robot)
        if balance == FORCE:
            believed = replace(believed, point_mass=True)
        self.dynamics = believed
        self._joint, self._trajectory = robot.joint(), trajectory
        self._step = TrackingStep(
            trajectory.stretches(),
            believed.packed(),
            gains.packed(),
            float(robot.plane_height or 0.0),
        )
        self._table = self._step.table
        size = in_plant.plant.num_multibody_states(in_plant.model_instance)
        remembered = self._declare_memory()
        state = self.DeclareVectorInputPort("platform_state", size)
        self._state = state.Eval  # looked up once: called at every step of control
        now, here = {self.time_ticket()}, {self.input_port_ticket(state.get_index())}
        self.DeclareVectorOutputPort(
            "desired_wrench", 6, self._calc_wrench, now | here | remembered
        )
        for name, calc, sources in (
            ("X_WP", self._calc_pose, here),
            ("X_WP_desired", self._calc_desired_pose, now),
        ):
            self.DeclareAbstractOutputPort(name, lambda: Value(RigidTransform()), calc, sources)

    def _declare_memory(self) -> set[DependencyTicket]:
        """Declares what the wrench depends on beside time and the platform's state."""
        return set()

    def logged(self) -> tuple[str, ...]:
        """Names of the outputs that a log keeps, which are vectors."""
        return ("desired_wrench",)

    def packed(self) -> TrackingStep:
        """Its constants, for loops that are compiled as a whole."""
        return self._step

    def _calc_wrench(self, context: Context, output: BasicVector) -> None:
        tracking_wrench_at(
            self._table, context.get_time(), self._state(context), output.get_mutable_value()
        )

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(pose_on_joint(self._joint, self._state(context)))

    def _calc_desired_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._trajectory.pose(context.get_time()))

"""Computed-torque control of the platform in task space, along a trajectory of poses.

`PoseTrajectorySource` gives a trajectory on ports, `ComputedTorque` the wrench that makes the
platform follow it; `PoseTracking` is both in one block.

Source: see `control.task_space.computed_torque`.
"""

from __future__ import annotations

from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import (
    PlatformDynamics,
    TaskGains,
    TrackingStep,
    floating_wrench,
    planar_wrench,
    tracking_wrench_at,
)
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.robot_in_plant import RobotInPlant, platform_inertia, pose_on_joint
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, PoseTrajectory, write_motion

CONTROL_RATE = 1000.0
"""Usual rate of a controller of cable tensions [Hz]."""


def platform_dynamics(robot: Robot) -> PlatformDynamics:
    """The dynamics of a robot's platform, exactly as the plant has them.

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
    return PlatformDynamics(platform_inertia(robot), robot.gravity, motions)


class ComputedTorque(LeafSystem):
    """Asks for the wrench that makes the platform follow a desired motion.

    ============== ========== ===== =========================================================
    port           type       unit  meaning
    ============== ========== ===== =========================================================
    platform_state vector     m     in, as `CableForces` takes it
    desired_motion vector(19) m     in, quaternion wxyz and origin of the desired pose, V_WP and
                                    A_WP, as `PoseTrajectorySource` gives it on its port motion
    desired_wrench vector(6)  Nm, N out, F_P_W about Po that the cables must put on the platform
    ============== ========== ===== =========================================================

    Discrete updates at a rate of its own, and the wrench is held between them. A block that
    samples by itself would read the wrench of the period before: put it after a `ComputedTorque`
    without rate, whose wrench follows its inputs at once, or after a `PoseTracking`.

    Source: see `task_space.computed_torque`.
    """

    def __init__(
        self,
        in_plant: RobotInPlant,
        gains: TaskGains,
        rate: float | None = CONTROL_RATE,
        dynamics: PlatformDynamics | None = None,
    ) -> None:
        """For a robot whose plant is finalized.

        Args:
            in_plant: The robot in its plant; only its kind of joint and its state's size matter.
            gains: Kp and Kd.
            rate: Updates per second [Hz]; None for none, the output then follows the inputs.
            dynamics: What the controller believes of the platform; None for the exact model.
        """
        super().__init__()
        robot, plant = in_plant.robot, in_plant.plant
        self._dynamics = (dynamics or platform_dynamics(robot)).packed()
        self._gains = gains.packed()
        self._height = robot.plane_height
        num_states = plant.num_multibody_states(in_plant.model_instance)
        # Looked up once: these are called at every step of control.
        self._state = self.DeclareVectorInputPort("platform_state", num_states).Eval
        self._desired = self.DeclareVectorInputPort("desired_motion", MOTION_SIZE).Eval
        if rate is None:
            inputs = {self.all_input_ports_ticket()}
            self.DeclareVectorOutputPort("desired_wrench", 6, self._calc_wrench, inputs)
            return
        self._held = self.DeclareDiscreteState(6)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareStateOutputPort("desired_wrench", self._held)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        self._write(context, state.get_mutable_value(self._held))

    def _calc_wrench(self, context: Context, output: BasicVector) -> None:
        self._write(context, output.get_mutable_value())

    def _write(self, context: Context, out: Array) -> None:
        state, desired = self._state(context), self._desired(context)
        if self._height is None:
            floating_wrench(state, desired, self._dynamics, self._gains, out)
        else:
            planar_wrench(state, desired, self._dynamics, self._gains, self._height, out)


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

    What a `PoseTrajectorySource` and a `ComputedTorque` without rate do together; in a fast loop
    a call of a block costs more than what it computes, and here there is one call.
    """

    def __init__(
        self,
        in_plant: RobotInPlant,
        trajectory: PoseTrajectory,
        gains: TaskGains,
        dynamics: PlatformDynamics | None = None,
    ) -> None:
        """For a robot whose plant is finalized.

        Args:
            in_plant: The robot in its plant; only its kind of joint and its state's size matter.
            trajectory: The desired motion.
            gains: Kp and Kd.
            dynamics: What the controller believes of the platform; None for the exact model.
        """
        super().__init__()
        robot = in_plant.robot
        self._joint, self._trajectory = robot.joint(), trajectory
        self._step = TrackingStep(
            trajectory.stretches(),
            (dynamics or platform_dynamics(robot)).packed(),
            gains.packed(),
            float(robot.plane_height or 0.0),
        )
        self._table = self._step.table
        size = in_plant.plant.num_multibody_states(in_plant.model_instance)
        state = self.DeclareVectorInputPort("platform_state", size)
        self._state = state.Eval  # looked up once: called at every step of control
        now, here = {self.time_ticket()}, {self.input_port_ticket(state.get_index())}
        self.DeclareVectorOutputPort("desired_wrench", 6, self._calc_wrench, now | here)
        for name, calc, sources in (
            ("X_WP", self._calc_pose, here),
            ("X_WP_desired", self._calc_desired_pose, now),
        ):
            self.DeclareAbstractOutputPort(name, lambda: Value(RigidTransform()), calc, sources)

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


class PoseTrajectorySource(LeafSystem):
    """What a trajectory of the platform asks for at the time of the context.

    ====== ============== ========== ========================================================
    port   type           unit       meaning
    ====== ============== ========== ========================================================
    X_WP   RigidTransform m          out, pose
    V_WP   vector(6)      rad/s, m/s out, (w, v) of P in W, v that of Po
    A_WP   vector(6)      rad/s^2,   out, (alpha, a) of P in W, a that of Po
                          m/s^2
    motion vector(19)     all these  out, the three in one row, the pose as quaternion wxyz
                                     and origin; one port of numbers is cheap in a control loop
    ====== ============== ========== ========================================================
    """

    def __init__(self, trajectory: PoseTrajectory) -> None:
        """For a trajectory that begins at its own start time."""
        super().__init__()
        self._trajectory, self._stretches = trajectory, trajectory.stretches()
        time = {self.time_ticket()}
        self.DeclareAbstractOutputPort(
            "X_WP", lambda: Value(RigidTransform()), self._calc_pose, time
        )
        self.DeclareVectorOutputPort("V_WP", 6, self._calc_velocity, time)
        self.DeclareVectorOutputPort("A_WP", 6, self._calc_acceleration, time)
        self.DeclareVectorOutputPort("motion", MOTION_SIZE, self._calc_motion, time)

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._trajectory.pose(context.get_time()))

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._trajectory.velocity(context.get_time()))

    def _calc_acceleration(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._trajectory.acceleration(context.get_time()))

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        write_motion(context.get_time(), self._stretches, output.get_mutable_value())

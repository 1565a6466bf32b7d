"""Computed-torque control of the platform in task space."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.control import PlatformDynamics, TaskGains, floating_wrench, planar_wrench
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models import Robot, RobotInPlant, platform_inertia
from cdpr_drake.trajectories import MOTION_SIZE

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

    Source: see `control.computed_torque`.
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

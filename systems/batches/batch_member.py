"""One robot of a batch: what was made of its parameters, and where it rests."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import KELVIN_VOIGT
from cdpr_drake.cables.states import cable_state
from cdpr_drake.dynamics.robot_arrays import TENSIONS, Drive, RobotArrays, pack_robot
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.models.robot_holding import check_pulleys
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import check_pose, rigid_platform
from cdpr_drake.statics.static_tensions import lengths_for_tensions
from cdpr_drake.systems.robots.assembly import equilibrium_start
from cdpr_drake.systems.robots.cable_forces import simulated_cables
from cdpr_drake.systems.robots.compiled_cable_robot import winch_drive
from cdpr_drake.systems.robots.compiled_step import resting_state
from cdpr_drake.systems.robots.settings import CableRobotSettings


@dataclass(frozen=True)
class BatchMember:
    """A robot as `CompiledCableRobot`, or `motion_by_tensions`, has it.

    Attributes:
        robot: The robot.
        cables: Its cables as they are simulated.
        model: Their model.
        drive: What drives them.
        joint: What the platform moves by.
        home: Unstrained lengths where the motors' angles are zero, shape (m,) [m].
        arrays: The robot as the kernels take it.
    """

    robot: Robot
    cables: CableSet
    model: str
    drive: Drive
    joint: PlatformJoint
    home: Array
    arrays: RobotArrays

    @staticmethod
    def of(robot: Robot, settings: CableRobotSettings, by_tensions: bool) -> BatchMember:
        """Makes a robot of settings, or one of which tensions are commanded.

        Raises:
            CableModelError: The cables' model cannot describe the robot's cables.
            CableGeometryError: At the home pose a cable cannot run over its pulley.
            RobotFileError: Winches with motors are asked for that the robot's file does not
                describe.
        """
        cables = settings.cables.cable_set(robot)
        if by_tensions:
            model, drive = KELVIN_VOIGT, Drive(kind=TENSIONS)
        else:
            model = settings.cables.model_of(robot)
            cables, drive = simulated_cables(cables, model), winch_drive(robot, settings.winches)
        home, joint, damping = (
            cable_paths(robot.home.transform(), cables).lengths,
            robot.joint(),
            settings.damping.of(robot),
        )
        arrays = pack_robot(
            rigid_platform(robot), cables, model, drive, home=home, joint=joint, damping=damping
        )
        return BatchMember(robot, cables, model, drive, joint, home, arrays)

    def at_rest(self, X_WP: RigidTransform, tensions: Array | None = None) -> tuple[Array, Array]:
        """State at rest, shape (n,), and tensions at the platform, shape (m,) [N].

        Args:
            X_WP: The pose [m].
            tensions: At the platform, shape (m,) [N]; None: those that hold it.

        Raises:
            InfeasibleTensionError: As `equilibrium_start`.
            CableGeometryError: A cable cannot run there, or cannot have so little tension.
            TensionProblemError: The pose lies outside the frame.
        """
        robot, cables, model = self.robot, self.cables, self.model
        if tensions is None:
            X_WP, held = equilibrium_start(robot, cables, model, X_WP, slack=None, at_rest=False)
            lengths, drums, tensions = held.unstrained_lengths, held.drum_tensions, held.tensions
        else:
            check_pose(robot, X_WP)
            check_pulleys(robot, X_WP, cables)
            lengths = lengths_for_tensions(cables, model, X_WP, tensions)
            drums = cable_state(cables, model, X_WP, lengths).drum_tensions
        state = resting_state(robot, self.drive, X_WP, lengths, drums, home=self.home)
        return state, tensions

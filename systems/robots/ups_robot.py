"""A robot with rigid rods in place of cables, as one block that tensions drive."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.ups_robot import UpsInPlant, add_ups_robot
from cdpr_drake.systems.robots.platform_pose import PlatformPose


class UpsRobot(Diagram):
    """Platform on rods with universal, prismatic and spherical joints, driven by tensions.

    ======== ============== ==== ==============================================================
    port     type           unit meaning
    ======== ============== ==== ==============================================================
    tensions vector(m)      N    in, with which the rods are pulled into their guides
    X_WP     RigidTransform m    out, pose of the platform
    ======== ============== ==== ==============================================================

    The plant is discrete; its solver closes the loops.
    """

    def __init__(self, robot: Robot | str | Path, masses: Array, time_step: float) -> None:
        """With masses of the rods, shape (m,) [kg], and the plant's time step [s].

        Raises:
            RobotFileError: The robot is planar.
        """
        super().__init__()
        robot = as_robot(robot, "UpsRobot")
        builder = DiagramBuilder()
        plant = builder.AddNamedSystem("plant", MultibodyPlant(time_step))
        self.ups: UpsInPlant = add_ups_robot(plant, robot, masses)
        plant.Finalize()
        m, in_plant = len(robot.cables), self.ups.in_plant
        pull = builder.AddNamedSystem("pull", MatrixGain(-np.eye(m)))
        pose = builder.AddNamedSystem("platform_pose", PlatformPose(in_plant))
        builder.Connect(pull.get_output_port(), plant.get_actuation_input_port(self.ups.rods))
        state = plant.get_state_output_port(in_plant.model_instance)
        builder.Connect(state, pose.GetInputPort("platform_state"))
        builder.ExportInput(pull.get_input_port(), "tensions")
        builder.ExportOutput(pose.GetOutputPort("X_WP"), "X_WP")
        builder.BuildInto(self)
        self.plant: MultibodyPlant = plant

    def set_pose(self, context: Context, X_WP: RigidTransform) -> None:
        """Puts the robot at rest at a pose [m], in this diagram's own context."""
        self.ups.set_pose(self.GetMutableSubsystemContext(self.plant, context), X_WP)

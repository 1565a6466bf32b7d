"""A cable robot as one block: plant, cables and winches."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import Adder, Demultiplexer

from cdpr_drake.arrays import Array
from cdpr_drake.cables.elastic_law import cable_stiffness_matrix
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_in_plant import RobotInPlant, add_robot, platform_inertia
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.models.scene import add_frame, add_ground
from cdpr_drake.numerics.explicit_integration import largest_stable_step, vibration_eigenvalues
from cdpr_drake.systems.robots.cable_forces import PORTS, CableForces
from cdpr_drake.systems.robots.platform_pose import PlatformPose
from cdpr_drake.systems.robots.settings import CableSettings, DampingSettings, WinchSettings
from cdpr_drake.systems.robots.winches import make_winches
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.winches.motor import MODES

STEP_SHARE = 0.8
"""Share of the largest stable step that an automatic step takes; stiffness changes on the way."""


class CableRobot(Diagram):
    """A robot with its scene, cables and winches.

    ======================= ==================== ===== =========================================
    port                    type                 unit  meaning
    ======================= ==================== ===== =========================================
    cable_velocities        vector(m)            m/s   in, commanded, positive pays out
    platform_state          vector(13 or 6)      m     out, as `CableForces` takes it
    X_WP                    RigidTransform       m     out, pose of the platform
    tensions                vector(m)            N     out, at the platform
    drum_tensions           vector(m)            N     out, at the exit points
    lengths                 vector(m)            m     out
    slack                   vector(m)            -     out, 1 where slack
    slack_lengths           vector(m)            m     out, beyond the straight way
    sags                    vector(m)            m     out
    unstrained_lengths      vector(m)            m     out
    unstrained_length_rates vector(m)            m/s   out
    body_poses              list[RigidTransform] m     out, from the plant
    query_object            QueryObject          -     out, from the scene graph, for cameras
    ======================= ==================== ===== =========================================

    Subsystems: plant, scene_graph, cables, winches, platform_pose. With motors on the winches, the
    block has the inputs and further outputs of `MotorWinch`, tensions connected. A default context
    has the platform at the robot's home pose with cables that are just not taut; see `hang`.
    """

    def __init__(
        self,
        robot: Robot,
        add_to_scene: Callable[[DiagramBuilder, RobotInPlant, SceneGraph], None] | None = None,
        *,
        cables: CableSettings | None = None,
        winches: WinchSettings | None = None,
        damping: DampingSettings | None = None,
    ) -> None:
        """Builds the robot.

        Args:
            robot: The robot.
            add_to_scene: May add bodies and tags to the plant before Finalize, objects that move
                by themselves to the scene graph, and systems and ports to this block.
            cables: How the cables behave; straight ones without pulleys, by Kelvin and Voigt,
                if None.
            winches: Which winches; ideal ones if None.
            damping: What brakes the platform beside its cables; nothing if None.

        Raises:
            CableModelError: The cables' model cannot describe the robot's cables.
            CableGeometryError: At the home pose a cable cannot run over its pulley.
            RobotFileError: Winches with motors are asked for that the robot's file does not
                describe.
        """
        super().__init__()
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
        plant.set_name("plant")
        scene_graph.set_name("scene_graph")
        in_plant = add_robot(plant, robot)
        add_frame(plant, robot)
        add_ground(plant, robot)
        if add_to_scene is not None:
            add_to_scene(builder, in_plant, scene_graph)
        plant.Finalize()
        settings = cables or CableSettings()
        cable_set = settings.cable_set(robot)
        forces = builder.AddNamedSystem("cables", CableForces(in_plant, cable_set, settings.model))
        home = cable_paths(robot.home.transform(), cable_set).lengths
        winch = builder.AddNamedSystem(
            "winches", make_winches(robot, winches or WinchSettings(), home)
        )
        pose = builder.AddNamedSystem("platform_pose", PlatformPose(in_plant))
        state = plant.get_state_output_port(in_plant.model_instance)
        builder.Connect(state, forces.GetInputPort("platform_state"))
        builder.Connect(state, pose.GetInputPort("platform_state"))
        applied, drums = forces.GetOutputPort("generalized_force"), None
        if winches is not None and winches.has_motors():
            sizes = [plant.num_velocities(), cable_set.count]
            both = builder.AddNamedSystem("force_and_drums", Demultiplexer(sizes))
            builder.Connect(forces.GetOutputPort("force_and_drums"), both.get_input_port())
            applied, drums = both.get_output_port(0), both.get_output_port(1)
        if damping is not None and damping.is_there():
            brake = builder.AddNamedSystem("damping", damping.block(in_plant))
            total = builder.AddNamedSystem("applied_force", Adder(2, plant.num_velocities()))
            builder.Connect(state, brake.get_input_port())
            builder.Connect(applied, total.get_input_port(0))
            builder.Connect(brake.get_output_port(), total.get_input_port(1))
            applied = total.get_output_port()
        builder.Connect(applied, plant.get_applied_generalized_force_input_port())
        for port in map(winch.get_input_port, range(winch.num_input_ports())):
            if drums is not None and port.get_name() == "tensions":
                builder.Connect(drums, port)
            else:
                builder.ExportInput(port, port.get_name())
        builder.ExportOutput(state, "platform_state")
        builder.ExportOutput(pose.GetOutputPort("X_WP"), "X_WP")
        for name in PORTS:
            builder.ExportOutput(forces.GetOutputPort(name), name)
        for name in ("unstrained_lengths", "unstrained_length_rates"):
            builder.Connect(winch.GetOutputPort(name), forces.GetInputPort(name))
        for port in map(winch.get_output_port, range(winch.num_output_ports())):
            builder.ExportOutput(port, port.get_name())
        builder.ExportOutput(plant.get_body_poses_output_port(), "body_poses")
        builder.ExportOutput(scene_graph.get_query_output_port(), "query_object")
        builder.BuildInto(self)
        self.robot: Robot = robot
        self.in_plant: RobotInPlant = in_plant
        self.plant: MultibodyPlant = plant
        self.scene_graph = scene_graph
        self.winches: Any = winch
        self.forces: Any = forces

    def hang(self, context: Context, X_WP: RigidTransform, slack: Array | None = None) -> Array:
        """Puts the platform at rest at a pose and sets lengths that hold it there.

        Args:
            context: This diagram's own context.
            X_WP: Pose of the platform [m].
            slack: Lengths to pay out beyond that, shape (m,) [m]; none if None.

        Returns:
            The tensions that hold it, of least 2-norm within the bounds, shape (m,) [N].

        Raises:
            InfeasibleTensionError: No tensions within the robot's bounds hold this pose.
            CableGeometryError: A cable cannot run there, would break, or a pulley reaches into
                the platform.
            TensionProblemError: The pose lies outside the frame, or the cables hold nothing there.
        """
        holding = hold_robot(self.robot, X_WP, self.forces.cable_set(), self.forces.model())
        self.in_plant.set_pose(self.GetMutableSubsystemContext(self.plant, context), X_WP)
        unstrained = holding.unstrained_lengths
        if slack is not None:
            unstrained = unstrained + slack
        self.winches.hold(
            self.GetMutableSubsystemContext(self.winches, context),
            unstrained,
            holding.drum_tensions,
        )
        return holding.tensions


def holding_tensions(robot: Robot, X_WP: RigidTransform) -> Array:
    """Tensions of least 2-norm within the robot's bounds that hold the platform, shape (m,) [N].

    Raises:
        InfeasibleTensionError: There are none; names the robot and the pose.
        TensionProblemError: The pose lies outside the frame, or W is singular there.
    """
    tensions = exact_tensions(tension_problem(robot, X_WP))
    if tensions is None:
        position = ", ".join(f"{x:g}" for x in X_WP.translation())
        raise InfeasibleTensionError(
            f"{robot.name} cannot hold the platform at ({position}) m: no tensions within "
            f"{robot.tension_bounds.lower:g}..{robot.tension_bounds.upper:g} N balance its weight"
        )
    return tensions


def automatic_step(
    robot: Robot,
    X_WP: RigidTransform,
    integrator: str,
    winches: WinchSettings | None = None,
    cables: CableSettings | None = None,
) -> float:
    """Integration step [s] for an explicit integrator: `STEP_SHARE` of the largest stable one.

    From the vibrations about X_WP with all cables taut and straight, which sag only makes softer;
    motors of the winches vibrate with the platform.
    """
    settings = cables or CableSettings()
    paths = cable_paths(X_WP, settings.cable_set(robot))
    J = paths.J
    R = np.kron(np.eye(2), X_WP.rotation().matrix())
    M = R @ platform_inertia(robot).CopyToFullMatrix6() @ R.T
    if robot.is_planar():
        J, M = J[:, list(PLANAR_ROWS)], M[np.ix_(PLANAR_ROWS, PLANAR_ROWS)]
    poles = np.zeros(0)
    if winches is not None and winches.has_motors():
        law, m = robot.winch_law(), len(robot.cables)
        poles = law.poles(MODES[winches.mode])
        per_angle = law.drum.length_per_angle(np.zeros(m))
        J = np.hstack([J, -np.eye(m)])
        M = scipy.linalg.block_diag(M, np.diag(law.inertia / per_angle**2))
    K = cable_stiffness_matrix(J, robot.stiffness(), paths.lengths)
    retardation = 0.0 if settings.model == ELASTIC else robot.cable.retardation_time
    eigenvalues = vibration_eigenvalues(M, K, retardation)
    return STEP_SHARE * largest_stable_step(np.concatenate([eigenvalues, poles]), integrator)

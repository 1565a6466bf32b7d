"""A cable robot as one block: plant, cables and winches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import behaviour_of, tangent_stiffness
from cdpr_drake.cables.elastic_law import cable_stiffness_matrix
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_holding import missed_by
from cdpr_drake.models.robot_in_plant import RobotInPlant, platform_inertia
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.numerics.explicit_integration import largest_stable_step, vibration_eigenvalues
from cdpr_drake.systems.robots.assembly import (
    SceneAdder,
    add_cable_robot,
    equilibrium_start,
    fill_scene,
    own_context,
    set_robot_at_equilibrium,
)
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.random_pose import RandomPose
from cdpr_drake.systems.robots.settings import CableRobotSettings
from cdpr_drake.tensions.methods import exact_tensions
from cdpr_drake.winches.failed_winches import HOLD
from cdpr_drake.winches.motor import MODES

STEP_SHARE = 0.8
"""Share of the largest stable step that an automatic step takes; stiffness changes on the way."""

SEMI_IMPLICIT = "semi_implicit"
SEMI_IMPLICIT_STEP = 1e-3
"""Automatic step of the semi-implicit method [s], which no stiffness limits."""

DEFAULT_STEP = 1e-3
"""Largest step of `default_rule` [s]."""


class CableRobot(Diagram):
    """A robot with its scene, cables and winches.

    ======================= ========================= ======= =================================
    port                    type                      unit    meaning
    ======================= ========================= ======= =================================
    cable_velocities        vector(m)                 m/s     in, commanded, positive pays out
    applied_wrench          vector(6)                 N m, N  in, may stay open: moment about Po
                                                              and force on the platform, in W
    broken                  vector(m)                 -       in, only with `failures`, may stay
                                                              open: not 0 for each cable that is
                                                              broken
    jammed                  vector(k)                 -       in, as broken, for each winch that
                                                              stands still
    powerless               vector(k)                 -       in, as broken, for each motor
                                                              without power; only with motors
    platform_state          vector                    m       out, as `CableForces` takes it
    X_WP                    RigidTransform            m       out, pose of the platform
    tensions                vector(m)                 N       out, at the platform
    drum_tensions           vector(m)                 N       out, at the exit points
    lengths                 vector(m)                 m       out
    slack                   vector(m)                 -       out, 1 where slack
    surplus_lengths         vector(m)                 m       out, beyond the straight path
    sags                    vector(m)                 m       out
    unstrained_lengths      vector(m)                 m       out
    unstrained_length_rates vector(m)                 m/s     out
    bent                    vector(3 or 1)            rad     out, only of a platform that rubs as
                                                              it turns, see `PlatformHysteresis`
    body_poses              list[RigidTransform]      m       out, from the plant
    body_velocities         list[SpatialVelocity]     rad/s   out, from the plant, of bodies in W
                                                      m/s
    body_accelerations      list[SpatialAcceleration] rad/s^2 out, from the plant, of bodies in W
                                                      m/s^2
    query_object            QueryObject               -       out, from the scene graph, for cameras
    broken, jammed, powerless                         -       out, only with `failures`: these
                                                              and the inputs
    ======================= ========================= ======= =================================

    Subsystems: plant, scene_graph, cables, winches, platform_pose, platform_wrench. With motors on
    the winches, the block has the inputs and further outputs of `MotorWinch`, tensions connected. A
    default context has the platform at rest at the robot's home pose, as `set_at_equilibrium` puts
    it there, so that `Simulator.reset_context` and `SetRandomContext` start at rest, too; where
    nothing holds it, `not_at_rest` says why, and cables are just not taut.
    """

    def __init__(
        self,
        robot: Robot | str | Path,
        settings: CableRobotSettings | None = None,
        *,
        add_to_scene: SceneAdder | None = None,
        floor: bool = True,
        random_pose: RandomPose | None = None,
    ) -> None:
        """Builds the robot.

        Args:
            robot: The robot, by name, path, or itself.
            settings: Cables, winches and damping; straight cables without pulleys, by Kelvin and
                Voigt, on ideal winches, if None.
            add_to_scene: May add bodies and tags to the plant before Finalize, objects that move
                by themselves to the scene graph, and systems and ports to this block; what it
                returns, if anything, is called once the plant is finalized.
            floor: Whether there is a visible floor below the frame.
            random_pose: Poses of random contexts about the home pose; None: the home pose.

        Raises:
            CableModelError: The cables' model cannot describe the robot's cables.
            CableGeometryError: At the home pose a cable cannot run over its pulley.
            RobotFileError: Winches with motors are asked for that the robot's file does not
                describe.
        """
        super().__init__()
        robot = as_robot(robot, "CableRobot")
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
        plant.set_name("plant")
        scene_graph.set_name("scene_graph")
        in_plant = fill_scene(
            builder, robot, plant, scene_graph, add_to_scene=add_to_scene, floor=floor
        )
        blocks = add_cable_robot(
            builder, in_plant, settings, scene_graph=scene_graph, random_pose=random_pose
        )
        for name, port in blocks.inputs.items():
            builder.ExportInput(port, name)
        for name, port in blocks.outputs.items():
            builder.ExportOutput(port, name)
        builder.BuildInto(self)
        self.robot: Robot = robot
        self.in_plant: RobotInPlant = in_plant
        self.plant: MultibodyPlant = plant
        self.scene_graph: SceneGraph = scene_graph
        self.winches: Any = blocks.winches
        self.forces: CableForces = blocks.forces
        self.not_at_rest: str = blocks.not_at_rest

    def set_at_equilibrium(
        self,
        context: Context,
        X_WP: RigidTransform,
        slack_lengths: Array | None = None,
        at_rest: bool = False,
    ) -> Array:
        """Puts the platform at rest at a pose and sets lengths that hold it there.

        With fewer cables than degrees of freedom it starts where it comes to rest on cables as long
        as their paths at the pose, see `models.rest_as_long`.

        Args:
            context: Root context of the diagram that this block is in, or the block's own.
            X_WP: Pose of the platform [m].
            slack_lengths: Lengths to pay out beyond that, shape (m,) [m]; none if None.
            at_rest: Whether the platform starts where it comes to rest with them; else it starts
                at the pose, and falls.

        Returns:
            The tensions that hold it, of least 2-norm within the bounds, shape (m,) [N]; with
            slack at rest, those at rest.

        Raises:
            InfeasibleTensionError: No tensions within the robot's bounds hold this pose.
            CableGeometryError: A cable cannot run there, would break, or a pulley reaches into
                the platform.
            TensionProblemError: The pose lies outside the frame, or the cables hold nothing there.
            EquilibriumError: The platform does not come to rest with that slack.
        """
        context = own_context(self, context)
        cables, model = self.forces.cable_set(), self.forces.model()
        X_WP, holding = equilibrium_start(
            self.robot, cables, model, X_WP, slack=slack_lengths, at_rest=at_rest
        )
        cable_context = self.GetMutableSubsystemContext(self.forces, context)
        self.forces.relax(cable_context, X_WP, holding.unstrained_lengths)
        return set_robot_at_equilibrium(
            self,
            self.GetMutableSubsystemContext(self.plant, context),
            self.GetMutableSubsystemContext(self.winches, context),
            X_WP,
            holding,
        )


def holding_tensions(
    robot: Robot | str | Path, X_WP: RigidTransform, cables: CableSet | None = None
) -> Array:
    """Tensions of least 2-norm within the robot's bounds that hold the platform, shape (m,) [N].

    Args:
        robot: The robot.
        X_WP: Pose of the platform [m].
        cables: The cables; None: the robot's, pulleys included.

    Raises:
        InfeasibleTensionError: There are none; names the robot and the pose.
        TensionProblemError: The pose lies outside the frame, or W is singular there.
    """
    robot = as_robot(robot, "holding_tensions")
    tensions = exact_tensions(tension_problem(robot, X_WP, cables=cables))
    if tensions is None:
        position = ", ".join(f"{x:g}" for x in X_WP.translation())
        low, high = robot.tension_limits()
        raise InfeasibleTensionError(
            f"{robot.name} cannot hold the platform at ({position}) m: no tensions within "
            f"{low:g}..{high:g} N balance its weight{missed_by(robot, X_WP, cables)}"
        )
    return tensions


def automatic_step(
    robot: Robot | str | Path,
    X_WP: RigidTransform,
    integrator: str,
    settings: CableRobotSettings | None = None,
) -> float:
    """Integration step [s]: of an explicit integrator `STEP_SHARE` of the largest stable one.

    From the vibrations about X_WP with all cables taut and straight, which sag only makes softer;
    motors of the winches vibrate with the platform.
    """
    if integrator == SEMI_IMPLICIT:
        return SEMI_IMPLICIT_STEP
    robot, settings = as_robot(robot, "automatic_step"), settings or CableRobotSettings()
    cables, winches = settings.cables, settings.winches
    simulated = cables.cable_set(robot)
    paths = cable_paths(X_WP, simulated)
    J = paths.J
    R = np.kron(np.eye(2), X_WP.rotation().matrix())
    M = R @ platform_inertia(robot).CopyToFullMatrix6() @ R.T
    motion = robot.motion_type()
    if not motion.is_free:
        turned = X_WP.rotation().matrix()
        J, M = motion.columns(J, turned), motion.part(M, turned)
    behaviour, most = behaviour_of(simulated), np.full(len(robot.cables), robot.tension_limits()[1])
    stiffest = tangent_stiffness(most, simulated.stiffness, behaviour.stiffening)
    stiffest = stiffest + behaviour.creep_stiffness * simulated.stiffness
    poles = np.zeros(0)
    if winches.has_motors():
        law, m = robot.winch_law(), len(robot.cables)
        if settings.failures is not None:  # what stands still settles as dry friction does
            law = replace(law, brake_torque=max(law.brake_torque, HOLD))
        poles = law.poles(MODES[winches.mode])
        groups, per_angle = robot.winch_groups(), law.drum.length_per_angle(np.zeros(m))
        J = np.hstack([J, -groups.to_cables()])
        own = per_angle[list(groups.first_cables())]
        inertia = law.inertia / own**2
        M = scipy.linalg.block_diag(M, np.diag(inertia))
        if behaviour.sheave_friction > 0.0:  # in a groove, as a damper of each drum
            slope = behaviour.sheave_friction * np.pi * most[0] / behaviour.sliding_speed
            poles = np.concatenate([poles, -slope / inertia])
    K = cable_stiffness_matrix(J, stiffest, paths.lengths)
    contacts = robot.contact_hysteresis()
    if contacts is not None:  # that stick
        whole = np.zeros((6, 6))
        whole[:3, :3] = contacts.stiffness_in_world(X_WP.rotation().matrix())
        own = whole if motion.is_free else motion.part(whole, X_WP.rotation().matrix())
        K[: len(own), : len(own)] += own
    retardation = 0.0 if cables.model_of(robot) == ELASTIC else float(np.max(simulated.retardation))
    eigenvalues = vibration_eigenvalues(M, K, retardation)
    return STEP_SHARE * largest_stable_step(np.concatenate([eigenvalues, poles]), integrator)


def default_rule(
    robot: Robot | str | Path,
    settings: CableRobotSettings | None = None,
    by_tensions: bool = False,
) -> StepRule:
    """Default integration rule of `CompiledCableRobot`, `motion_by_tensions` and `BatchRobots`.

    Runge-Kutta of third order with fixed steps: `DEFAULT_STEP`, or `automatic_step` at the home
    pose where that is shorter.

    Args:
        robot: The robot.
        settings: Cables, winches and damping; the defaults if None.
        by_tensions: Tensions are commanded, so that no stiffness limits the step.
    """
    robot, step = as_robot(robot, "default_rule"), DEFAULT_STEP
    if not by_tensions:
        step = min(step, automatic_step(robot, robot.home.transform(), "runge_kutta3", settings))
    return StepRule(method="runge_kutta3", max_step=step)

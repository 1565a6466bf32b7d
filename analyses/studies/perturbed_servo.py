"""A visual servo whose model is off by one given perturbation, and its case for verdicts."""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import angles_from_rotation, rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose, Robot
from cdpr_drake.servoing.visual_features import VisualFeatures
from cdpr_drake.stability.criterion import ModelAtPose, stability_margin, stability_matrix
from cdpr_drake.stability.desired_view import FixedObject
from cdpr_drake.stability.perturbation_bounds import (
    POSE_BLOCKS,
    PerturbationBounds,
    vector_size,
)
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.systems.controllers.schemes import ideal_sighting, make_features
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.target import Target


@dataclass(frozen=True)
class Perturbation:
    """What a servo believes wrongly, in parts; see `stability.perturbation_bounds`.

    Attributes:
        turn: Rotation of the platform's pose, in P.
        shift: Shift of the platform's pose, in W, shape (3,) [m].
        camera_turn: Rotation of the camera's mounting, in C.
        camera_shift: Shift of the camera's mounting, in P, shape (3,) [m].
        exits: Shifts of the exit points, in W, shape (3, m) [m].
        anchors: Shifts of the anchor points, in P, shape (3, m) [m].
    """

    turn: RotationMatrix
    shift: Array
    camera_turn: RotationMatrix
    camera_shift: Array
    exits: Array
    anchors: Array

    @staticmethod
    def from_vector(d: Array) -> Perturbation:
        """The parts of a vector as `draw_perturbations` makes it, shape (18 + 6 m,) [rad, m].

        The object is taken to be seen as it is, as by a camera without error.
        """
        blocks = np.asarray(d, float).reshape(-1, 3)
        m = (len(blocks) - POSE_BLOCKS) // 2
        return Perturbation(
            rotation_from_vector(blocks[0]),
            blocks[1],
            rotation_from_vector(blocks[2]),
            blocks[3],
            blocks[POSE_BLOCKS : POSE_BLOCKS + m].T,
            blocks[POSE_BLOCKS + m :].T,
        )

    def platform(self, X_WP: RigidTransform) -> RigidTransform:
        """The believed pose of a platform."""
        return RigidTransform(X_WP.rotation() @ self.turn, X_WP.translation() + self.shift)

    def camera(self, X_PC: RigidTransform) -> RigidTransform:
        """The believed mounting of a camera."""
        return RigidTransform(
            X_PC.rotation() @ self.camera_turn, X_PC.translation() + self.camera_shift
        )


def pose_of(X: RigidTransform) -> Pose:
    """A pose as scenarios write it."""
    return Pose(
        position=np.array(X.translation()),
        angles_deg=np.degrees(angles_from_rotation(X.rotation())),
    )


def perturbed_scenario(
    scenario: Scenario,
    X_WP: RigidTransform,
    perturbation: Perturbation,
    X_PC: RigidTransform | None = None,
) -> Scenario:
    """A scenario that starts at a pose [m], with a perturbation of what the servo believes.

    Args:
        scenario: The scenario; it stays as it is.
        X_WP: Where the platform starts.
        perturbation: What is believed wrongly.
        X_PC: True camera on the platform, who knows it saves reading the robot's file [m].
    """
    if X_PC is None:
        X_PC = load_robot(scenario.robot).camera_mount(scenario.camera.mount).pose.transform()
    made = copy.deepcopy(scenario)
    made.initial_pose = pose_of(X_WP)
    made.perturbations.initial_pose = pose_of(perturbation.platform(X_WP))
    made.perturbations.camera_pose = pose_of(X_PC.inverse() @ perturbation.camera(X_PC))
    made.perturbations.exit_point_shifts = perturbation.exits.T.copy()
    made.perturbations.anchor_point_shifts = perturbation.anchors.T.copy()
    return made


@dataclass(frozen=True, kw_only=True, eq=False)
class PerturbedServo:
    """A servo's features, its true robot, and the one it believes in.

    Attributes:
        scenario: The task.
        robot: The true robot.
        features: What the servo controls.
        target: What the camera looks at.
        final: Features at the desired pose, shape (k,).
        X_PC: True camera on the platform [m].
        X_WO: Object in W [m].
        perturbation: What the servo believes wrongly.
    """

    scenario: Scenario
    robot: Robot
    features: VisualFeatures
    target: Target
    final: Array
    X_PC: RigidTransform
    X_WO: RigidTransform
    perturbation: Perturbation

    def X_CO(self, X_WP: RigidTransform) -> RigidTransform:
        """True pose of the object in the camera [m]."""
        return (X_WP @ self.X_PC).inverse() @ self.X_WO

    def error(self, X_WP: RigidTransform) -> tuple[Array, Array]:
        """e = s - s*, shape (k,), and L, shape (k, 6), of an image without noise."""
        s, L = self.features.evaluate(ideal_sighting(self.target, self.X_CO(X_WP)))
        return s - self.final, np.array(L)

    def models(
        self, X_WP: RigidTransform, believed: RigidTransform | None = None
    ) -> tuple[ModelAtPose, ModelAtPose]:
        """What is true and what is believed at a pose [m].

        Args:
            X_WP: True pose of the platform.
            believed: Estimated pose; None: the true one with the perturbation.
        """
        _, L = self.error(X_WP)
        d = self.perturbation
        cables = self.robot.cable_set().without_pulleys()
        wrong = replace(cables, p_WA=cables.p_WA + d.exits, p_PB=cables.p_PB + d.anchors)
        return (
            ModelAtPose(X_WP, cables, self.X_PC, L),
            ModelAtPose(believed or d.platform(X_WP), wrong, d.camera(self.X_PC), L),
        )

    def margin(self, X_WP: RigidTransform, believed: RigidTransform | None = None) -> float:
        """Smallest eigenvalue of the symmetric part of Pi for this one perturbation [-]."""
        local = self.scenario.controller.scheme == "ibvs"
        return stability_margin(stability_matrix(*self.models(X_WP, believed), local=local))


def perturbed_servo(scenario: Scenario, perturbation: Perturbation) -> PerturbedServo:
    """The servo of a scenario under a perturbation."""
    robot = load_robot(scenario.robot)
    target = scenario.target.target()
    X_CdO = scenario.desired.transform()
    features = make_features(scenario.controller, target, X_CdO)
    return PerturbedServo(
        scenario=scenario,
        robot=robot,
        features=features,
        target=target,
        final=np.array(features.evaluate(ideal_sighting(target, X_CdO))[0]),
        X_PC=robot.camera_mount(scenario.camera.mount).pose.transform(),
        X_WO=scenario.target.pose.transform(),
        perturbation=perturbation,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class ServoCase:
    """A servo and the same for verdicts.

    Attributes:
        servo: Without errors of its model.
        case: The same for the verdicts; it knows no pulleys.
        bounds: What limits the errors, of the robot's workspace by default.
        box: Lower and upper corner of where Po may start, shape (3,) each [m].
    """

    servo: PerturbedServo
    case: StabilityCase
    bounds: PerturbationBounds
    box: tuple[Array, Array]


def servo_case(scenario: Scenario, lowest: float) -> ServoCase:
    """The servo of a scenario with a robot that ships.

    Args:
        scenario: The task of the servo.
        lowest: Least height of Po at the start [m].
    """
    robot = load_robot(scenario.robot)
    defaults = workspace_defaults(robot, scenario.robot)
    none = Perturbation.from_vector(np.zeros(vector_size(len(robot.cables))))
    servo = perturbed_servo(scenario, none)
    return ServoCase(
        servo=servo,
        case=StabilityCase(
            robot.cable_set().without_pulleys(),
            scenario.controller.scheme,
            X_PC=servo.X_PC,
            target=FixedObject(servo.X_WO, scenario.desired.transform()),
            lever="object",
        ),
        bounds=defaults.bounds,
        box=(np.maximum(defaults.lower, [-np.inf, -np.inf, lowest]), defaults.upper),
    )

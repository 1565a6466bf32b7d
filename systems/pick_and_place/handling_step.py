"""What is settled before a box is handled: the integration step, and the robot as it is believed.

`box_step` is the step that follows a box on its corners, in a grip. `believed_robot` and
`camera_poses` are the robot and its cameras as it believes them to be while it handles a box.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import SpatialInertia

from cdpr_drake.geometry.poses import cross_matrix
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.explicit_integration import largest_stable_step
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.diagrams.beliefs import random_shifts, shifted_pose
from cdpr_drake.systems.pick_and_place.gripper import GripLaw
from cdpr_drake.systems.pick_and_place.workpiece import contact_dissipation, contact_stiffness
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.pick_and_place_settings import WorkpieceSettings

PRESSED = 2.0
"""Force with which a box may be pressed onto what it stands on, beside its weight [N]."""

STEEPEST = 1.875
"""Largest slope of Drake's friction coefficient over speed, times slip speed over coefficient."""


def box_step(
    settings: WorkpieceSettings, law: GripLaw, gravity: float, slip_speed: float, integrator: str
) -> float:
    """The largest stable step of an explicit method for a box that is held and stands [s].

    Args:
        settings: The box.
        law: The grip, whose platform counts as fixed.
        gravity: Acceleration of free fall [m/s^2].
        slip_speed: That of contact [m/s].
        integrator: One of `explicit_integration.explicit_integrators()`.
    """
    M = SpatialInertia.SolidBoxWithMass(
        settings.mass, *(float(edge) for edge in settings.size)
    ).CopyToFullMatrix6()
    k = contact_stiffness(settings, gravity)
    normal = (settings.mass * gravity + PRESSED) / 4.0
    slipping = STEEPEST * settings.friction * normal / slip_speed
    upright = contact_dissipation(gravity) * normal
    J = np.hstack([-cross_matrix(law.p_BF), np.eye(3)])
    turning = np.zeros((6, 6))
    turning[:3, :3] = np.eye(3)
    K = law.stiffness * J.T @ J + law.rotational_stiffness * turning
    D = law.damping * J.T @ J + law.rotational_damping * turning
    for x, y in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        corner = 0.5 * settings.size * np.array([x, y, -1.0])
        J = np.hstack([-cross_matrix(corner), np.eye(3)])
        K += J.T @ np.diag([0.0, 0.0, k]) @ J
        D += J.T @ np.diag([slipping, slipping, upright]) @ J
    A = np.block([
        [np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]
    ])  # fmt: skip
    return largest_stable_step(np.linalg.eigvals(A), integrator)


_POINTS, _INITIAL_POSE, _CAMERAS = 1, 2, (3, 5)
"""Streams of random numbers of one seed; the first ones are those of a visual servo."""


def camera_poses(
    scenario: PickAndPlaceScenario, robot: Robot, *, believed: bool
) -> tuple[RigidTransform, RigidTransform]:
    """Poses X_PC of the cameras that look at box and goal, true or believed [m]."""
    first = robot.camera_mount(scenario.camera.mount).pose.transform()
    other = scenario.goal_camera
    poses = [first, first if other is None else other.pose.transform()]
    if believed:
        shift = scenario.perturbations.camera_pose_shift
        streams = _CAMERAS if other is not None else (_CAMERAS[0],) * 2
        poses = [
            shifted_pose(pose, shift, np.random.default_rng([scenario.seed, stream]))
            for pose, stream in zip(poses, streams, strict=True)
        ]
    return poses[0], poses[1]


def believed_robot(scenario: PickAndPlaceScenario, robot: Robot) -> BelievedRobot:
    """The robot as servo and dead reckoning believe it to be."""
    errors, true = scenario.perturbations, robot.cable_set()

    def stream(number: int) -> np.random.Generator:
        return np.random.default_rng([scenario.seed, number])

    points = stream(_POINTS)
    return BelievedRobot(
        cables=replace(
            true,
            p_WA=true.p_WA + random_shifts(true.count, errors.exit_points, points),
            p_PB=true.p_PB + random_shifts(true.count, errors.anchor_points, points),
        ),
        X_PC=camera_poses(scenario, robot, believed=True)[0],
        X_WP0=shifted_pose(
            scenario.initial_pose.transform(), errors.initial_pose_shift, stream(_INITIAL_POSE)
        ),
        motions=robot.servo_rows("pick and place"),
        cable_speed=robot.winch.rated_cable_speed(),
    )

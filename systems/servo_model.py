"""The robot as controller and estimators believe it to be, with the scenario's perturbations."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cable_set import CableSet
from cdpr_drake.models import Robot
from cdpr_drake.poses import rotation_from_vector
from cdpr_drake.systems.scenario import Scenario
from cdpr_drake.systems.scenario_perturbations import PoseShift

ALL_MOTIONS = (0, 1, 2, 3, 4, 5)
PLANAR_MOTIONS = (2, 3, 4)

_POINTS, _INITIAL_POSE, _CAMERA = 1, 2, 3
"""Streams of random numbers of one seed, so that one perturbation does not change another."""


@dataclass(frozen=True)
class ServoModel:
    """What controller and estimators believe about the robot; the simulated robot may differ.

    Attributes:
        cables: All constants of the cables.
        X_PC: Camera C on the platform [m].
        X_WP0: Pose of the platform at the start [m].
        motions: Components of the platform's twist in P, ordered (rotation, translation), that
            the robot can move: all six, or (2, 3, 4) for 2T1R.
        cable_speed: Largest cable speed to ask for [m/s].
    """

    cables: CableSet
    X_PC: RigidTransform
    X_WP0: RigidTransform
    motions: tuple[int, ...]
    cable_speed: float

    @property
    def p_WA(self) -> Array:
        """Exit points, shape (3, m) [m]."""
        return self.cables.p_WA

    @property
    def p_PB(self) -> Array:
        """Anchor points, shape (3, m) [m]."""
        return self.cables.p_PB

    def is_planar(self) -> bool:
        """Whether the platform slides in a plane, 2T1R."""
        return self.motions == PLANAR_MOTIONS


def random_shifts(
    count: int, distance: float, random: np.random.Generator, together: bool = False
) -> Array:
    """Vectors of one length in random directions, shape (3, count) [m].

    The directions are independent, or the same for all.
    """
    directions = random.standard_normal((3, 1 if together else count))
    shifts = distance * directions / np.linalg.norm(directions, axis=0)
    return np.asarray(np.broadcast_to(shifts, (3, count)), float).copy()


def shifted_pose(
    X_AB: RigidTransform, shift: PoseShift, random: np.random.Generator, planar: bool = False
) -> RigidTransform:
    """A pose off by a distance in a random direction of A and an angle about a random axis [m].

    If planar, the direction lies in the plane of x and y and the axis is z, with random sign.
    """
    direction, axis = random.standard_normal((2, 3))
    if planar:
        direction[2] = 0.0
        axis[:2] = 0.0
    turn = np.radians(shift.angle_deg) * axis / np.linalg.norm(axis)
    return RigidTransform(
        X_AB.rotation() @ rotation_from_vector(turn),
        X_AB.translation() + shift.distance * direction / np.linalg.norm(direction),
    )


def make_servo_model(scenario: Scenario, robot: Robot) -> ServoModel:
    """The robot as controller and estimators believe it to be."""
    perturbations = scenario.perturbations

    def stream(number: int) -> np.random.Generator:
        return np.random.default_rng([scenario.seed, number])

    true = robot.cable_set()
    m, points = true.count, stream(_POINTS)
    p_WA = true.p_WA + random_shifts(
        m, perturbations.exit_points, points, perturbations.exit_points_together
    )
    p_PB = true.p_PB + random_shifts(
        m, perturbations.anchor_points, points, perturbations.anchor_points_together
    )
    if perturbations.exit_point_shifts is not None:
        p_WA = p_WA + perturbations.exit_point_shifts.T
    if perturbations.anchor_point_shifts is not None:
        p_PB = p_PB + perturbations.anchor_point_shifts.T
    X_PC = robot.camera_mount(scenario.camera.mount).pose.transform()
    if perturbations.camera_pose is not None:
        X_PC = X_PC @ perturbations.camera_pose.transform()
    X_WP0 = (perturbations.initial_pose or scenario.initial_pose).transform()
    planar = robot.is_planar()
    return ServoModel(
        cables=replace(true, p_WA=p_WA, p_PB=p_PB),
        X_PC=shifted_pose(X_PC, perturbations.camera_pose_shift, stream(_CAMERA)),
        X_WP0=shifted_pose(X_WP0, perturbations.initial_pose_shift, stream(_INITIAL_POSE), planar),
        motions=PLANAR_MOTIONS if planar else ALL_MOTIONS,
        cable_speed=robot.winch.rated_cable_speed(),
    )

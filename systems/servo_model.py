"""The robot as the controller believes it to be, with the scenario's perturbations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.models import Robot
from cdpr_drake.systems.scenario import Scenario

ALL_MOTIONS = (0, 1, 2, 3, 4, 5)
PLANAR_MOTIONS = (2, 3, 4)


@dataclass(frozen=True)
class ServoModel:
    """What the controller believes about the robot; the simulated robot may differ.

    Attributes:
        p_WA: Exit points, shape (3, m) [m].
        p_PB: Anchor points, shape (3, m) [m].
        X_PC: Camera C on the platform [m].
        motions: Components of the platform's twist in P, ordered (rotation, translation), that
            the robot can move: all six, or (2, 3, 4) for 2T1R.
        cable_speed: Largest cable speed to ask for [m/s].
    """

    p_WA: Array
    p_PB: Array
    X_PC: RigidTransform
    motions: tuple[int, ...]
    cable_speed: float


def random_shifts(count: int, distance: float, random: np.random.Generator) -> Array:
    """Vectors of one length in independent random directions, shape (3, count) [m]."""
    directions = random.standard_normal((3, count))
    return np.asarray(distance * directions / np.linalg.norm(directions, axis=0), float)


def make_servo_model(scenario: Scenario, robot: Robot) -> ServoModel:
    """The robot as the controller believes it to be, with the scenario's perturbations."""
    perturbations = scenario.perturbations
    random = np.random.default_rng([scenario.seed, 1])
    m = len(robot.cables)
    X_PC = robot.camera_mount(scenario.camera.mount).pose.transform()
    if perturbations.camera_pose is not None:
        X_PC = X_PC @ perturbations.camera_pose.transform()
    return ServoModel(
        p_WA=robot.exit_points() + random_shifts(m, perturbations.exit_points, random),
        p_PB=robot.anchor_points() + random_shifts(m, perturbations.anchor_points, random),
        X_PC=X_PC,
        motions=PLANAR_MOTIONS if robot.is_planar() else ALL_MOTIONS,
        cable_speed=robot.winch.rated_cable_speed(),
    )

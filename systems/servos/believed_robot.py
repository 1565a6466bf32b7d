"""The robot as controller and estimators believe it to be, with the scenario's perturbations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.spatial.poses import rotation_from_vector
from cdpr_drake.systems.servos.perturbation_settings import PoseShift

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

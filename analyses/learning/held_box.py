"""A box of places round home in which a robot holds its platform, and where episodes are drawn."""

from __future__ import annotations

from itertools import product

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.assembly import equilibrium_start
from cdpr_drake.systems.robots.cable_forces import simulated_cables
from cdpr_drake.systems.robots.settings import CableRobotSettings

SHRINK, MOST_SHRINKS = 0.8, 16
"""By how much a box shrinks that the robot does not hold at a corner, and how often at most."""


class HeldBox:
    """Places that the robot's motion type has, along orthonormal directions from home.

    The platform is held at the corners, at the middles of edges and faces, and in the middle; in
    between that is likely, but not proven.

    Attributes:
        robot: The robot.
        home: Its pose at home, as its joint has it [m].
        directions: Of motion in W, shape (3, k).
        turns: Axes of turning in W at home, shape (3, r).
        half: Half of its edges [m].
    """

    def __init__(self, robot: Robot, settings: CableRobotSettings, half: float) -> None:
        """The largest cube that is held, at most of this half edge [m].

        Raises:
            CdprError: Hardly any box is held.
        """
        self.robot, self._model = robot, settings.cables.model_of(robot)
        self._cables = simulated_cables(settings.cables.cable_set(robot), self._model)
        joint = robot.joint()
        self.home = joint.nearest(robot.home.transform())
        basis = robot.motion_type().basis(self.home.rotation().matrix())
        moves = np.any(basis[3:] != 0.0, axis=0)
        self.directions, self.turns = basis[3:, moves], basis[:3, ~moves]
        self.half = half
        why = ""
        for _ in range(MOST_SHRINKS):
            why = self._refused()
            if not why:
                return
            self.half *= SHRINK
        raise CdprError(
            f"robot {robot.name}: found no box round home of at least {self.half:.2g} m that it "
            f"holds ({why}); accepted: a home well inside the workspace"
        )

    def _refused(self) -> str:
        """Why some corner, edge or face is not held; empty: they are."""
        for point in product((-1.0, 1.0, 0.0), repeat=self.directions.shape[1]):
            try:
                self.rest(self.at(np.array(point)))
            except CdprError as problem:
                return str(problem)
        return ""

    def at(self, point: Array, turn: Array | None = None) -> RigidTransform:
        """A pose of the box [m].

        Args:
            point: Along the directions, from -1 to 1, shape (k,).
            turn: Rotation along the axes of turning, shape (r,) [rad]; None: none.
        """
        R = self.home.rotation()
        if turn is not None and self.turns.shape[1]:
            R = rotation_from_vector(self.turns @ turn) @ R
        return RigidTransform(R, self.home.translation() + self.directions @ (self.half * point))

    def rest(self, X_WP: RigidTransform) -> RigidTransform:
        """Where the platform rests at a pose: there, or near it with few cables [m].

        Raises:
            CdprError: It is not held.
        """
        return equilibrium_start(
            self.robot, self._cables, self._model, X_WP, slack=None, at_rest=False
        )[0]

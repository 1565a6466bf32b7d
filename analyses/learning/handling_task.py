"""PickAndPlace: take a cube from a table and set it down where it shall stand.

A tool hangs under the platform. The last number of an action closes it where it is above 0. What
closes with the tool's tip within `GRASP_SHARE` of the reach of the cube's top holds it: from then
on the platform has the mass and inertia of both, and their common velocity, as after a collision
in which both stick together. A cube that is let go within the same distance of the table stands on
it; one that is let go higher falls, and the episode is lost. Table and cube push nothing: they are
touched by the tip alone.

    reward = 0.3 (1 - tanh(d / 0.25 reach)) with the tip d from the cube's top, while it is free
           = 0.3 + 0.5 (1 - tanh(d / 0.25 reach)) with the cube d from its goal, while it is held
           = 1 while it stands at its goal
    each less costs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydrake.geometry import Box, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from cdpr_drake.analyses.learning.loaded_platform import loaded_robot
from cdpr_drake.analyses.learning.robot_picture import GOAL_COLOR, add_shown_body
from cdpr_drake.analyses.learning.robot_task import DISTANCE_SHARE, TWIST, RobotTask, TaskOptions
from cdpr_drake.analyses.learning.task_kernel import (
    LENGTH,
    add_closeness,
    place_points,
    write_distances,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_schema import Robot

GRASP_SHARE = 0.1
"""Of the reach: how near the tip must be to the cube's top, and the cube to the table or goal."""

TOOL_SHARE, EDGE_SHARE = 0.3, 0.2
"""Length of the tool under Po, and edge of the cube, of the reach."""

TIP_SHARE = 0.15
"""Radius at which the tip is drawn, of the cube's edge."""

CUBE_COLOR = np.array([0.8, 0.4, 0.1, 1.0])

APPROACH, CARRY = 0.3, 0.5
"""What free and held cubes are worth at most, see the module."""


@dataclass(frozen=True, kw_only=True)
class HandlingOptions(TaskOptions):
    """What the task takes.

    Attributes:
        action: As of `TaskOptions`.
        payload: Mass of the cube [kg]; None: a tenth of the platform's.
    """

    action: str = TWIST
    payload: float | None = None


class HandlingTask(RobotTask):
    """The observation ends with tip to cube (3), cube to goal (3), whether it is held, and stands
    at its goal."""

    Options: ClassVar[type[TaskOptions]] = HandlingOptions
    steps: ClassVar[int] = 500
    more_actions: ClassVar[int] = 1

    def __init__(self, count: int, options: HandlingOptions) -> None:
        """As `RobotTask`."""
        super().__init__(count, options)
        mass = options.payload
        if mass is not None and not (np.isfinite(mass) and mass > 0.0):
            raise CdprError(f"payload: found {mass!r}; accepted: above 0 [kg]")
        self.payload = 0.1 * self.robot.platform.mass if mass is None else mass
        half = self.reach
        self._edge, self._grasp = EDGE_SHARE * half, GRASP_SHARE * half
        R = self.box.home.rotation().matrix()
        self._down = np.array(self.robot.gravity_vector(), float)
        size = float(np.linalg.norm(self._down))
        self._down = np.array([0.0, 0.0, -1.0]) if size == 0.0 else self._down / size
        self._tip = np.tile(R.T @ (TOOL_SHARE * half * self._down), (count, 1))
        self._cubes, self._goals, self._p_PL = np.zeros((3, count, 3))
        self._tips = np.zeros((count, 3))
        self._held, self._placed = np.zeros((2, count), bool)
        self._own_robots: list[Robot] = [self.robot] * count
        self._to_cube, self._to_goal = np.zeros((2, count))
        self._dropped = np.zeros(count, bool)

    def _aimed(self) -> int:
        return 8

    def _restore(self, row: int, random: np.random.Generator) -> None:
        if self._held[row]:
            self.batch.exchange(row, self._own_robots[row])
        super()._restore(row, random)
        self._own_robots[row] = self.batch.robots[row]
        self._held[row] = self._placed[row] = self._dropped[row] = False

    def _begin(self, row: int, random: np.random.Generator) -> RigidTransform:
        self._cubes[row], self._goals[row] = (self._on_table(random) for _ in range(2))
        return self._drawn_pose(random)

    def _on_table(self, random: np.random.Generator) -> Array:
        """Middle of a cube under the box's lowest places, where the tip reaches its top [m]."""
        point = np.array(random.uniform(-1.0, 1.0, self.box.directions.shape[1]), float)
        fall = self.box.directions.T @ self._down
        low = np.abs(fall) > 0.5
        point[low] = np.sign(fall[low])
        place = self.box.rest(self.box.at(point)).translation()
        return np.asarray(place + (TOOL_SHARE * self.reach + 0.5 * self._edge) * self._down)

    def _act(self, actions: Array) -> None:
        """Grasps and lets go."""
        self._dropped[:] = False
        for row in range(self.count):
            closed = actions[row, -1] > 0.0
            if closed and not self._held[row] and self._to_cube[row] <= self._grasp:
                self._take(row)
            elif not closed and self._held[row]:
                self._let_go(row)

    def _take(self, row: int) -> None:
        X_WP = pose_from_row(self.batch.poses[row])
        own = self._own_robots[row]
        self._p_PL[row] = X_WP.inverse() @ self._cubes[row]
        both = loaded_robot(own, self.payload, self._p_PL[row], self._edge)
        twist = self.batch.twists[row]
        self.batch.exchange(row, both)
        self.batch.set_twists([row], _common_twist(own, both, X_WP, twist))
        self._held[row], self._placed[row] = True, False

    def _let_go(self, row: int) -> None:
        self.batch.exchange(row, self._own_robots[row])
        self._held[row] = False
        height = float((self._goals[row] - self._cubes[row]) @ self._down)
        if abs(height) > self._grasp:
            self._dropped[row] = True
            return
        self._cubes[row] += height * self._down  # it stands
        self._placed[row] = np.linalg.norm(self._goals[row] - self._cubes[row]) <= self._grasp

    def _look(self, rows: np.ndarray, moved: bool) -> None:
        poses = self.batch.poses
        carried = np.empty((self.count, 3))
        place_points(poses, self._p_PL, carried)
        self._cubes[self._held] = carried[self._held]
        place_points(poses, self._tip, self._tips)
        own, length = self._own(), float(self.scales[LENGTH])
        tops = self._cubes - 0.5 * self._edge * self._down
        write_distances(self._tips, tops, length, own[:, :3], self._to_cube)
        write_distances(self._cubes, self._goals, length, own[:, 3:6], self._to_goal)
        own[:, 6], own[:, 7] = self._held, self._placed

    def _judge(self, actions: Array) -> None:
        scale = np.array([DISTANCE_SHARE * self.reach])
        held = self._held.astype(float)
        free = 1.0 - held - self._placed
        add_closeness(self._to_cube[:, None], scale, APPROACH * free, self.rewards)
        add_closeness(self._to_goal[:, None], scale, CARRY * held, self.rewards)
        self.rewards += APPROACH * held + self._placed
        self.lost |= self._dropped

    def add_bodies(self, plant: MultibodyPlant) -> list[RigidBody]:
        """The cube, where it shall stand, and the tool's tip."""
        bodies = [add_shown_body(plant, name) for name in ("cube", "goal", "tip")]
        cube, tip = Box(*(3 * [self._edge])), Sphere(TIP_SHARE * self._edge)
        looks = ((cube, CUBE_COLOR), (cube, GOAL_COLOR), (tip, CUBE_COLOR))
        for body, (shape, color) in zip(bodies, looks, strict=True):
            plant.RegisterVisualGeometry(body, RigidTransform(), shape, body.name(), color)
        return bodies

    def places(self, row: int) -> list[RigidTransform]:
        """Those of the cube, unturned while it is free, of its goal, and of the tip."""
        R_WP = pose_from_row(self.batch.poses[row]).rotation()
        turned = R_WP if self._held[row] else RotationMatrix()
        return [
            RigidTransform(turned, self._cubes[row]),
            RigidTransform(self._goals[row]),
            RigidTransform(self._tips[row]),
        ]

    def infos(self) -> dict[str, np.ndarray]:
        """Distances of tip and cube's top, cube and goal [m]; whether it is held, stands there."""
        return {
            "tip_distance": self._to_cube.copy(), "goal_distance": self._to_goal.copy(),
            "held": self._held.copy(), "success": self._placed.copy(),
        }  # fmt: skip


def _common_twist(alone: Robot, both: Robot, X_WP: RigidTransform, twist: Array) -> Array:
    """Twist of a platform that takes up a body at rest, momentum kept, shape (6,).

    Args:
        alone: The robot without the body.
        both: The robot with it.
        X_WP: Pose of the platform [m].
        twist: Of the platform before, shape (6,) [rad/s, m/s].
    """
    R = np.kron(np.eye(2), X_WP.rotation().matrix())
    before, after = (R @ platform_inertia(one).CopyToFullMatrix6() @ R.T for one in (alone, both))
    motion, turned = alone.motion_type(), X_WP.rotation().matrix()
    basis = motion.basis(turned)
    momentum = basis.T @ before @ twist
    return np.asarray(basis @ np.linalg.solve(basis.T @ after @ basis, momentum))

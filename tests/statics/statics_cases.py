"""Robots at rest, platforms on few cables, differences, and an exhaustive search for plane ones."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.inextensible_problem import HangingPlatform
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.systems.robots.cable_robot import holding_tensions

WEIGHT = 10.0
UPRIGHT = {"num_turns": 1, "num_moves": 2, "axis": (0.0, 1.0, 0.0)}
"""A body in the plane y = 0; turns about y."""


@dataclass(frozen=True)
class Scene:
    """A robot with the unstrained lengths that give tensions [N] at a pose."""

    robot: object
    cables: CableSet
    platform: RigidPlatform
    lengths: np.ndarray
    tensions: np.ndarray
    X_WP: RigidTransform

    def rest(self, model="elastic"):
        """Pose of rest nearest to the pose."""
        return equilibrium_near(self.cables, model, self.platform, self.lengths, self.X_WP)


@cache
def scene(name, pulleys=False, at=(0.05, -0.03, 0.1), turn=0.03, preload=5.0):
    """Beside the home pose, with tensions that hold it; those of a planar robot with a preload."""
    robot = load_robot(name)
    at = np.array([*at[:2], 0.0 if robot.is_planar() else at[2]])
    X = pose_from_angles(robot.home.transform().translation() + at, [0.0, 0.0, turn])
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    tensions = holding_tensions(robot, X, cables.without_pulleys())
    tensions = tensions + (preload if robot.is_planar() else 0.0)
    paths = ForwardKinematics(cables, robot.motion_type()).lengths(X)
    l0 = unstrained_lengths(paths, tensions, cables.stiffness)
    return Scene(robot, cables, rigid_platform(robot), l0, tensions, X)


def cables_at(exits, anchors, weight=0.0, stiffness=1e5):
    """Cables from points, one a row."""
    points = (np.array(points, float).T for points in (exits, anchors))
    return CableSet.make(*points, stiffness, linear_weight=weight)


def displaced(X, d):
    """A pose after a small turn and move, shape (6,) [rad, m]."""
    return RigidTransform(rotation_from_vector(d[:3]) @ X.rotation(), X.translation() + d[3:])


def stiffness_by_differences(wrench, X, step):
    """Minus the derivative of a wrench, a function of the pose, shape (6, 6)."""
    columns = [wrench(displaced(X, -d)) - wrench(displaced(X, d)) for d in step * np.eye(6)]
    return np.column_stack(columns) / (2.0 * step)


# Inextensible cables.


def hanging(exits, anchors, center, home=None, **motions):
    """A platform of 10 N."""
    cables = cables_at(exits, anchors)
    weight, home = np.array([0.0, 0.0, -WEIGHT]), home or RigidTransform()
    center = np.array(center, float)
    return HangingPlatform(cables=cables, weight_W=weight, p_PCo=center, home=home, **motions)


def flat(points):
    """Points (x, z) in the plane y = 0."""
    return [(x, 0.0, z) for x, z in points]


def random_problem(random, cables, upright):
    """A random platform, and lengths that often hold it: those of a pose, some longer."""
    exits = random.normal(size=(cables, 3)) * [1.0, 1.0, 0.3] + [0.0, 0.0, 2.0]
    anchors, center = 0.3 * random.normal(size=(cables, 3)), 0.2 * random.normal(size=3)
    if upright:
        exits[:, 1], anchors[:, 1], center[1] = 0.0, 0.0, 0.0
    platform = hanging(exits, anchors, center, **(UPRIGHT if upright else {}))
    place = np.array([*random.normal(size=2) * 0.3, random.normal() * 0.5])
    place[1] *= not upright
    lengths = np.linalg.norm(exits - anchors - place, axis=1) * random.uniform(1.0, 1.3, cables)
    return platform, lengths


def rests_on_a_linkage(platform, lengths, steps=4000):
    """Poses (x, z, turn) on two taut cables in the plane y = 0, with positive tensions.

    Independent of polynomials: the cables and the platform are a linkage of four bars, of which the
    angle of the first cable runs over a circle; at rest the height of the centre of mass does not
    change with it.
    """
    A, B = platform.cables.p_WA[[0, 2]], platform.cables.p_PB[[0, 2]]
    c, bar = platform.p_PCo[[0, 2]], B[:, 1] - B[:, 0]
    size, found = np.linalg.norm(bar), []

    def pose(angle, side):
        """Height of the centre of mass, turn, position; NaN where the linkage does not close."""
        B1 = A[:, :1] + lengths[0] * np.array([np.cos(angle), np.sin(angle)])
        to = A[:, 1:] - B1
        d = np.linalg.norm(to, axis=0)
        with np.errstate(invalid="ignore"):
            bend = np.arccos((size**2 + d**2 - lengths[1] ** 2) / (2.0 * size * d))
        turn = np.arctan2(to[1], to[0]) + side * bend - np.arctan2(bar[1], bar[0])
        cos, sin = np.cos(turn), np.sin(turn)
        p = B1 - np.array([cos * B[0, 0] - sin * B[1, 0], sin * B[0, 0] + cos * B[1, 0]])
        return p[1] + sin * c[0] + cos * c[1], turn, p

    for side in (1.0, -1.0):
        angles = np.linspace(0.0, 2.0 * np.pi, steps) + 0.1234
        step = angles[1] - angles[0]
        slope = (pose(angles + 1e-6, side)[0] - pose(angles - 1e-6, side)[0]) / 2e-6
        for i in np.flatnonzero(slope[:-1] * slope[1:] < 0.0):
            low, high = angles[i], angles[i] + step
            for _ in range(60):
                mid = 0.5 * (low + high)
                now = pose(np.array([mid + 1e-6]), side)[0] - pose(np.array([mid - 1e-6]), side)[0]
                low, high = (mid, high) if now[0] * slope[i] > 0.0 else (low, mid)
            _, turn, p = pose(np.array([low]), side)
            cos, sin = np.cos(turn[0]), np.sin(turn[0])
            arms = np.array([[cos, -sin], [sin, cos]]) @ np.column_stack([B, c])
            lines = p + arms[:, :2] - A
            W = np.vstack([lines, arms[0, :2] * lines[1] - arms[1, :2] * lines[0]])
            w = np.array([0.0, -1.0, -arms[0, 2]])
            tight = np.linalg.lstsq(W, w, rcond=None)[0]
            if np.max(np.abs(W @ tight - w)) < 1e-4 and np.all(tight > 1e-9):
                found.append((p[0, 0], p[1, 0], np.angle(np.exp(1j * turn[0]))))
    return found

"""A robot that moves, as others meet it: its platform, its cables, its beams.

Its motion is known by polynomials of time between samples. What a point does between two samples is
off the line between its places by |acceleration| step^2 / 8 at most; what it does in an interval of
many samples is off the chord by the largest distance that samples have from it, and that much more.
Cables go from a point of the platform to the exit point; over a pulley they leave its rim, which is
somewhere within twice its radius of the exit point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.trajectories.timed_path import TimedPath
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.moving_shapes import PoseSpan

MOST_POSES = 5
"""Poses of a span, at most."""

STEP = 5e-3
"""Between samples of a motion [s]."""

SAFETY = 2.0
"""By which accelerations between samples may be larger than the largest at samples; with it points
are off the lines between samples by some 1e-6 m."""


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """A motion that was planned, in some frame; before and after it rests.

    Attributes:
        trajectory: X_WP over time, of the robot's own W.
        X_FW: Pose of that W in the frame that others measure in.
    """

    trajectory: TimedPath
    X_FW: RigidTransform

    @cached_property
    def _samples(self) -> tuple[Array, Array, Array, tuple[float, float]]:
        """Times, positions and rotations in F, and how far points are off lines between them.

        The latter is a number of its own [m], and one over the distance from Po.
        """
        motion = self.trajectory
        span = motion.end_time - motion.start_time
        times = np.linspace(motion.start_time, motion.end_time, int(np.ceil(span / STEP)) + 2)
        rows = np.array([motion.motion(float(t)) for t in times])
        poses = [self.X_FW @ pose_from_row(row[:7]) for row in rows]
        square = SAFETY * float(times[1] - times[0]) ** 2 / 8.0
        spins = np.linalg.norm(rows[:, 13:16], axis=1) + np.sum(rows[:, 7:10] ** 2, axis=1)
        moves = np.linalg.norm(rows[:, 16:19], axis=1)
        return (
            times,
            np.array([X.translation() for X in poses]),
            np.array([X.rotation().matrix() for X in poses]),
            (square * float(np.max(moves)), square * float(np.max(spins))),
        )

    def at(self, time: float) -> RigidTransform:
        """Pose of the platform in F at a time [s]."""
        return self.X_FW @ self.trajectory.pose(time)

    def settled(self) -> float:
        """From when on it rests for ever [s]."""
        return self.trajectory.end_time

    def span(self, first: float, last: float, points: Array) -> tuple[PoseSpan, float]:
        """Poses, and how far points of the platform are off their hull between, at most [m].

        Args:
            first: From when [s].
            last: To when [s].
            points: In P, shape (k, 3) [m].
        """
        low, high = self.trajectory.start_time, self.trajectory.end_time
        first, last = (min(max(t, low), high) for t in (first, last))
        ends = np.linspace(first, last, MOST_POSES) if last > first else np.array([first])
        poses = tuple(self.at(float(t)) for t in ends)
        if len(poses) == 1:
            return PoseSpan(poses), 0.0
        times, p, R, (off, off_by_arm) = self._samples
        worst = 0.0
        for (a, X), (b, Y) in pairwise(zip(ends.tolist(), poses, strict=True)):
            inner = slice(np.searchsorted(times, a), np.searchsorted(times, b, "right"))
            places = p[inner, np.newaxis] + np.einsum("nij,kj->nki", R[inner], points)
            worst = max(worst, _off_chord(places, (X @ points.T).T, (Y @ points.T).T))
        far = float(np.max(np.linalg.norm(points, axis=1)))
        return PoseSpan(poses), worst + off + off_by_arm * far


def _off_chord(places: Array, starts: Array, ends: Array) -> float:
    """Largest distance of places, shape (n, k, 3), from segments of shape (k, 3) [m]; 0 of none."""
    way = ends - starts
    square = np.maximum(np.sum(way**2, axis=1), 1e-30)
    share = np.clip(np.sum((places - starts) * way, axis=2) / square, 0.0, 1.0)
    off = np.linalg.norm(places - starts - share[:, :, np.newaxis] * way, axis=2)
    return float(np.max(off, initial=0.0))


@dataclass(frozen=True, eq=False)
class MovingRobot:
    """Platform and cables of a robot along a planned motion, and its beams.

    Attributes:
        around: Its cables and platform, in its own W; what stands around is not looked at.
        motion: How it moves.
        name: How messages call it.
        beams: Whether the beams of its frame are there, too.
    """

    around: Surroundings
    motion: PlannedMotion
    name: str = ""
    beams: bool = True

    def at(self, time: float) -> tuple[ConvexShape, ...]:
        """As `MovingObstacle` has it; cables as they run."""
        X, X_FW = self.motion.at(time), self.motion.X_FW
        run = cable_paths(self.motion.trajectory.pose(time), self.around.cables)
        starts, ends = X_FW @ run.p_WT, X_FW @ (run.p_WT + run.free * run.u_W)
        shapes = [shape.moved(X) for shape in self.around.platform_shapes()]
        shapes += [
            ConvexShape.capsule(starts[:, k], ends[:, k], float(radius), f"cable {k + 1}")
            for k, radius in enumerate(self.around.radius)
        ]
        return (*shapes, *self._frame())

    def swept(self, first: float, last: float) -> tuple[ConvexShape, ...]:
        """As `MovingObstacle` has it."""
        found = []
        for shape in self.around.platform_shapes():
            span, off = self.motion.span(first, last, shape.points)
            places = np.concatenate([(X @ shape.points.T).T for X in span.poses])
            found.append(ConvexShape(np.unique(places, axis=0), shape.radius + off, shape.name))
        cables = self.around.cables
        anchors = cables.p_PB.T
        span, off = self.motion.span(first, last, anchors)
        places = np.array([(X @ anchors.T).T for X in span.poses])
        for k, radius in enumerate(self.around.radius):
            rim = 2.0 * float(cables.pulley_radius[k])
            exits = cables.p_WA[:, k] + rim * (_CORNERS if rim > 0.0 else np.zeros((1, 3)))
            points = np.concatenate([(self.motion.X_FW @ exits.T).T, places[:, k]])
            wide = float(radius) + off + 2.0 * float(cables.anchor_pulley_radius[k])
            found.append(ConvexShape(np.unique(points, axis=0), wide, f"cable {k + 1}"))
        return (*found, *self._frame())

    def settled(self) -> float:
        """As `MovingObstacle` has it."""
        return self.motion.settled()

    def _frame(self) -> list[ConvexShape]:
        if not self.beams:
            return []
        frame = [ConvexShape.box(row, f"frame {k}")
                 for k, row in enumerate(self.around.fixtures, 1)]  # fmt: skip
        return [shape.moved(self.motion.X_FW) for shape in frame]

    def shown(self, times: Array) -> Sequence[tuple[ConvexShape, Sequence[RigidTransform]]]:
        """As `MovingObstacle` has it; a cable is as long as it ever is, from the platform on."""
        at = [self.motion.at(float(time)) for time in times]
        found = [(shape, at) for shape in self.around.platform_shapes()]
        runs = [self.at(float(time))[len(found) :] for time in times]
        for k, radius in enumerate(self.around.radius):
            lines = np.array([run[k].points for run in runs])
            longest = float(np.max(np.linalg.norm(lines[:, 0] - lines[:, 1], axis=1)))
            shape = ConvexShape(
                np.array([[0.0, 0.0, 0.0], [0.0, 0.0, longest]]), float(radius), f"cable {k + 1}"
            )
            poses = [
                RigidTransform(RotationMatrix.MakeFromOneVector(line[0] - line[1], 2), line[1])
                for line in lines
            ]
            found.append((shape, poses))
        return [*found, *((shape, [RigidTransform()] * len(times)) for shape in self._frame())]


_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))

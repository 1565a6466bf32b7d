"""Constraints of where the platform and its cables are, for any MathematicalProgram."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.convex_distance_kernel import convex_work
from cdpr_drake.geometry.convex_shapes import ConvexShape, packed
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.geometry.straight_cables import ALL_ROWS
from cdpr_drake.planning.clearance_kernel import (
    VIEW_ROWS,
    cable_gaps,
    obstacle_gaps,
    plane_gaps,
    view_gaps,
)
from cdpr_drake.planning.pose_constraint import PoseConstraint
from cdpr_drake.planning.pose_coordinates import Coordinates
from cdpr_drake.planning.pose_coordinates_kernel import SEEDS
from cdpr_drake.planning.rate_kernel import least_stiffness
from cdpr_drake.planning.tension_constraints import USED, cable_names, check_cables

SHORTEST = 0.5
"""Least length of the normal of a plane: one of none would separate all that touches."""

SHARED = 1e-9
"""Cables whose exit or anchor points are nearer share it, and always touch there [m]."""


class PlaceWithin(PoseConstraint):
    """Po within a box of W."""

    description = "place"

    def __init__(self, coordinates: Coordinates, lower: Array, upper: Array) -> None:
        """With its corners, shape (3,) [m].

        Raises:
            PlanningError: The box has no inside.
        """
        low, high = np.asarray(lower, float), np.asarray(upper, float)
        if not np.all(low < high):
            raise PlanningError(
                f"box: found {low} to {high} m with its margin; accepted: an inside"
            )
        super().__init__(coordinates, low, high, ("x", "y", "z"))
        self._slopes = np.zeros((3, SEEDS))
        self._slopes[:, 3:6] = np.eye(3)

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        return points[:, 4:7], np.broadcast_to(self._slopes, (len(points), 3, SEEDS)), None


class PlatformSpeed(PoseConstraint):
    """Speed of Po within a limit: one row, its square over the limit's."""

    description, order, highest = "speed of Po", 1, 1
    kept_within = USED

    def __init__(self, coordinates: Coordinates, limit: float) -> None:
        """With the largest speed [m/s]."""
        super().__init__(coordinates, np.zeros(1), np.ones(1), ("Po",))
        self._limit = limit

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        v = points[:, 10:13] / self._limit
        slopes = np.zeros((len(points), 1, SEEDS))
        slopes[:, 0, 9:12] = 2.0 * v / self._limit
        return np.sum(v * v, axis=1, keepdims=True), slopes, None


class CableClearance(PoseConstraint):
    """Centre lines of cables that share no point stay a distance apart, a row for each pair [m].

    Over pulleys they are lines from the tangent points. A distance is at least 0, and has no
    derivative where cables cross.
    """

    description = "cables apart"

    def __init__(
        self,
        cables: CableSet,
        coordinates: Coordinates,
        distance: float,
        names: Sequence[str] | None = None,
    ) -> None:
        """With the least distance [m].

        Raises:
            PlanningError: It is negative, or cables run over pulleys of the platform.
        """
        check_cables(cables)
        if not (np.isfinite(distance) and distance >= 0.0):
            raise PlanningError(f"distance: found {distance:g} m; accepted: at least 0")
        words = names or cable_names(cables.count)
        A, B = cables.p_WA.T, cables.p_PB.T
        pairs = [
            (i, j)
            for i, j in combinations(range(cables.count), 2)
            if np.linalg.norm(A[i] - A[j]) > SHARED and np.linalg.norm(B[i] - B[j]) > SHARED
        ]
        rows = [f"{words[i]} and {words[j]}" for i, j in pairs]
        p = len(pairs)
        super().__init__(coordinates, np.full(p, distance), np.full(p, np.inf), rows)
        self._over_pulleys = cables.has_pulleys()
        self.radius = float(np.max(np.linalg.norm(B, axis=1)))
        self._cables, self.pairs = cables.packed(), np.array(pairs, np.int64).reshape(-1, 2)

    def reach(self) -> float | None:
        """2: of two lines that both move; None over pulleys, where tangent points move, too."""
        return None if self._over_pulleys else 2.0

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        shape = (len(points), len(self.pairs))
        values, slopes = np.empty(shape), np.empty((*shape, SEEDS))
        cable_gaps(points, self._cables, self.pairs, values, slopes)
        return values, slopes, None


class ObstacleClearance(PoseConstraint):
    """Cables and the platform's bodies stay a distance from obstacles, a row each [m].

    Of centre lines of the cables, from tangent points, and of surfaces of the convex shapes as they
    are; below 0 where they overlap, by how deep. The distance of two faces or edges that are
    parallel has a kink, and then the derivative is that of one of their points.
    """

    description = "obstacles"

    def __init__(
        self,
        cables: CableSet,
        coordinates: Coordinates,
        obstacles: Sequence[ConvexShape],
        bodies: Sequence[ConvexShape],
        cable_distance: float,
        platform_distance: float,
        *,
        names: Sequence[str] | None = None,
    ) -> None:
        """With what stands in the way.

        Args:
            cables: The cables.
            coordinates: As of the base class.
            obstacles: In W, at least one.
            bodies: Of the platform, in P.
            cable_distance: Least distance of the cables' centre lines [m].
            platform_distance: Least distance of the bodies [m].
            names: Of the cables.

        Raises:
            PlanningError: There is no obstacle, or cables run over pulleys of the platform.
        """
        check_cables(cables)
        if not obstacles:
            raise PlanningError("obstacles: found none; accepted: at least one")
        words = names or cable_names(cables.count)
        own = [body.name or "the platform" for body in bodies]
        rows = [
            f"{who} and {one.name or f'obstacle {number}'}"
            for number, one in enumerate(obstacles, 1)
            for who in (*words, *own)
        ]
        each = [cable_distance] * cables.count + [platform_distance] * len(bodies)
        low = np.tile(each, len(obstacles))
        super().__init__(coordinates, low, np.full(len(low), np.inf), rows)
        self._over_pulleys = cables.has_pulleys()
        every = np.vstack([cables.p_PB.T, *(body.points for body in bodies)])
        self.radius = float(np.max(np.linalg.norm(every, axis=1)))
        most = max(2, *(len(body.points) for body in bodies)) if bodies else 2
        work = convex_work(most, max(len(one.points) for one in obstacles))
        self._given = (
            cables, tuple(obstacles), tuple(bodies), cable_distance, platform_distance, names
        )  # fmt: skip
        self._arguments = (cables.packed(), *packed(bodies), *packed(obstacles), work)

    def smooth_parts(self) -> tuple[PoseConstraint, ...]:
        """Of the cables the distances, of the bodies planes between them and the obstacles."""
        cables, obstacles, bodies, lines, apart, names = self._given
        here = self.coordinates
        return (
            ObstacleClearance(cables, here, obstacles, (), lines, apart, names=names),
            *(SeparatingPlane(here, body, one, apart) for one in obstacles for body in bodies),
        )

    def reach(self) -> float | None:
        """1; None over pulleys, where tangent points move, too."""
        return None if self._over_pulleys else 1.0

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        shape = (len(points), len(self.rows))
        values, slopes = np.empty(shape), np.empty((*shape, SEEDS))
        obstacle_gaps(points, *self._arguments, values, slopes)
        return values, slopes, None


class SeparatingPlane(PoseConstraint):
    """A plane stands between a body of the platform and an obstacle, which are a distance apart.

    The further numbers are the plane's normal n, no longer than 1, and its offset d [m]: n' p >= d
    and a distance more for all corners p of the body, n' o <= d for those of the obstacle. Unlike
    their distance it has no kinks; convex shapes that are apart have such a plane.
    """

    description = "obstacles"
    extra = 4
    own_variables = True

    def __init__(
        self, coordinates: Coordinates, body: ConvexShape, obstacle: ConvexShape, distance: float
    ) -> None:
        """With a body in P, an obstacle in W, and their least distance [m]."""
        k, l = len(body.points), len(obstacle.points)  # noqa: E741
        low = [*np.full(k, distance + body.radius), *np.full(l, obstacle.radius), SHORTEST**2]
        high = np.append(np.full(k + l, np.inf), 1.0)
        name = f"{body.name or 'the platform'} and {obstacle.name or 'the obstacle'}"
        super().__init__(coordinates, np.array(low), high, [name] * (k + l + 1))
        self._body, self._obstacle = body, obstacle

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        shape = (len(points), len(self.rows))
        values, slopes = np.empty(shape), np.empty((*shape, SEEDS))
        columns = np.empty((*shape, 4))
        corners = self._body.points, self._obstacle.points
        plane_gaps(points, *corners, extra, values, slopes, columns)
        return values, slopes, columns

    def guess(self, x: Array) -> Array:
        """The plane halfway between both, or halfway in what overlaps, shape (4,).

        Args:
            x: Coordinates of a pose.
        """
        point = self.coordinates.points(x[np.newaxis])[0][0]
        found = self._body.moved(pose_from_row(point[:7])).distance(self._obstacle)
        _, on_body, on_obstacle, n = found
        return np.append(n, n @ (0.5 * (on_body + on_obstacle)))


class TargetInView(PoseConstraint):
    """Points of W are in the view of a camera on the platform; five rows each [m].

    Source: servoing thesis, chapter 4, where the target stays in view.
    """

    description = "view"

    def __init__(
        self,
        coordinates: Coordinates,
        X_PC: RigidTransform,
        slopes: tuple[float, float],
        points: Array,
        nearest: float,
    ) -> None:
        """With the camera and what it shall see.

        Args:
            coordinates: As of the base class.
            X_PC: Pose of the camera C, z forward [m].
            slopes: Tangents of half of the view's angles along x and y of C.
            points: p_WQ, shape (3, q) [m].
            nearest: Least depth z of the points in C, above 0 [m].

        Raises:
            PlanningError: The depth or the slopes are not above 0, or there are no points.
        """
        marks = np.ascontiguousarray(np.asarray(points, float).T)
        if marks.ndim != 2 or marks.shape[0] == 0 or marks.shape[1] != 3:
            raise PlanningError(
                f"points: found shape {np.shape(points)}; accepted: (3, q), at least one"
            )
        if not (nearest > 0.0 and min(slopes) > 0.0):
            raise PlanningError(
                f"view: found a nearest depth of {nearest:g} m and slopes {slopes}; accepted: "
                "above 0"
            )
        low = np.tile([0.0, 0.0, 0.0, 0.0, nearest], len(marks))
        sides = ("right edge", "left edge", "lower edge", "upper edge", "nearness")
        rows = [f"point {k + 1}, {side}" for k in range(len(marks)) for side in sides]
        super().__init__(coordinates, low, np.full(len(low), np.inf), rows)
        self._marks, self._slopes = marks, np.array(slopes, float)
        R, p = X_PC.rotation().matrix(), X_PC.translation()
        self._camera = np.concatenate([R.ravel(), p])

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        shape = (len(points), VIEW_ROWS * len(self._marks))
        values, slopes = np.empty(shape), np.empty((*shape, SEEDS))
        view_gaps(points, self._camera, self._slopes, self._marks, values, slopes)
        return values, slopes, None


class StiffnessAbove(PoseConstraint):
    """The cables hold the platform at least so stiffly against any small displacement.

    One row [N/m]: the least eigenvalue of the elastic stiffness J' diag(E S / l) J, displacements
    (turn times a length, translation). l is the length from A to B: what tensions stretch, and the
    stiffness of the tensions themselves, about t / l beside E S / l, is left out. Its gradient is
    exact; where two eigenvalues are the same it has none, and that of one of them is given.

    Source: Gazebo thesis (2.25) to (2.28), the passive part.
    """

    description = "stiffness"

    def __init__(
        self,
        cables: CableSet,
        coordinates: Coordinates,
        least: float,
        length: float,
        motions: tuple[int, ...] = ALL_ROWS,
    ) -> None:
        """With the least stiffness.

        Args:
            cables: The cables, with their axial stiffness.
            coordinates: As of the base class.
            least: The least eigenvalue [N/m].
            length: By which turns count as lengths, above 0 [m].
            motions: Components that the platform can move, see `PlatformDynamics`.

        Raises:
            PlanningError: A number is not accepted, or cables run over pulleys of the platform.
        """
        check_cables(cables)
        if not (np.isfinite(least) and np.isfinite(length) and length > 0.0):
            raise PlanningError(
                f"stiffness: found at least {least:g} N/m with a length of {length:g} m; "
                "accepted: a number, and a length above 0"
            )
        super().__init__(coordinates, np.array([least]), np.array([np.inf]), ("least eigenvalue",))
        self._packed, self._rows = cables.packed(), np.array(motions, np.int64)
        self._length = float(length)

    def at_points(self, points: Array, extra: Array) -> tuple[Array, Array, Array | None]:
        """As the base class says."""
        N = len(points)
        values, slopes = np.empty((N, 1)), np.empty((N, 1, SEEDS))
        least_stiffness(points, self._packed, self._rows, self._length, values, slopes)
        return values, slopes, None

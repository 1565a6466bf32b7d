"""Cables between any frames of a plant, over eyelets on any of its bodies.

`CableSet` is the case of a robot with one platform: cables from the world to one body. A route is
more: its points lie on any bodies of a MultibodyPlant, and the cable runs through them freely, with
one tension. Its length and its rate are sums over the segments between two points,

    l = sum_k l_k,      l_dot = J_l(q) v,      tau = -J_l(q)' t,

with J_l the length Jacobian of the plant and tau the generalized force of tensions t.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_set import CableSet

if TYPE_CHECKING:
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import Frame

Integers = np.typing.NDArray[np.int64]

WORLD_BODY = 0
"""Index of the world's body in every plant."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CableRoute:
    """One cable, as a user describes it.

    Attributes:
        points: Where it runs: (frame, p_FQ [m]) from the exit point, by eyelets, to the anchor
            point. Frames are those of a plant, or bodies; at least two points.
        stiffness: Axial stiffness E S [N].
        name: Its name; empty: cable and its number.
        retardation: Retardation time T of the viscous damping [s].
        linear_weight: Weight per unstrained length, along -z of W [N/m].
        breaking_load: Tension at which it breaks [N].
        pulley_radius: Radius of a pulley at the exit point; 0: none [m].
        swivel_axis: Axis of that pulley in the frame of the exit point, see `CableSet`.
        anchor_pulley_radius: Radius of a pulley at the anchor point; 0: none [m].
        anchor_swivel_axis: Axis of that pulley in the frame of the anchor point.
    """

    points: Sequence[tuple[Frame, Array]]
    stiffness: float
    name: str = ""
    retardation: float = 0.0
    linear_weight: float = 0.0
    breaking_load: float = np.inf
    pulley_radius: float = 0.0
    swivel_axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    anchor_pulley_radius: float = 0.0
    anchor_swivel_axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))


@dataclass(frozen=True, kw_only=True, eq=False)
class CableRoutes:
    """Cables between bodies of one plant, in the order in which they were given.

    Attributes:
        names: Names of the cables.
        bodies: Body index of each point, the points of one cable behind those of the one before,
            shape (s,).
        p_BQ: The points in the frames of their bodies, shape (3, s) [m].
        first: Where the points of each cable begin, and at last s, shape (m + 1,).
        ends: What else there is to say of the cables, as a `CableSet` whose `p_WA` and `p_PB` are
            the exit and anchor points in their bodies' frames, and whose swivel axes are, too.
    """

    names: tuple[str, ...]
    bodies: Integers
    p_BQ: Array
    first: Integers
    ends: CableSet

    @staticmethod
    def of(plant: MultibodyPlant, routes: Sequence[CableRoute]) -> CableRoutes:
        """Routes on the frames of a plant.

        Args:
            plant: The plant; it need not be finalized.
            routes: The cables; frames may be `Frame`s or bodies.

        Raises:
            CableModelError: There are none, a cable has fewer than two points, a name is there
                twice, a frame is not of this plant, or a number is not accepted.
        """
        if not routes:
            raise CableModelError("routes: found none; accepted: at least one cable")
        names = tuple(route.name or f"cable {i + 1}" for i, route in enumerate(routes))
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise CableModelError(f"routes: found two cables named {twice[0]}; accepted: one")
        bodies, points, first = [], [], [0]
        axes: dict[str, list[Array]] = {"swivel_axis": [], "anchor_swivel_axis": []}
        for name, route in zip(names, routes, strict=True):
            if len(route.points) < 2:
                raise CableModelError(
                    f"points of {name}: found {len(route.points)}; accepted: at least an exit and "
                    "an anchor point"
                )
            for where, p in route.points:
                frame = _frame_of(where, plant, name)
                p_FQ = np.array(p, dtype=float)
                if p_FQ.shape != (3,) or not np.all(np.isfinite(p_FQ)):
                    raise CableModelError(
                        f"points of {name}: found {p}; accepted: three finite numbers [m]"
                    )
                bodies.append(int(frame.body().index()))
                points.append(frame.GetFixedPoseInBodyFrame().multiply(p_FQ))
            first.append(len(bodies))
            for key, end in (("swivel_axis", 0), ("anchor_swivel_axis", -1)):
                R_BF = _frame_of(
                    route.points[end][0], plant, name
                ).GetFixedRotationMatrixInBodyFrame()
                axes[key].append(R_BF.multiply(np.array(getattr(route, key), dtype=float)))
        p_BQ, starts = np.array(points).T, np.array(first)
        given = {
            key: np.array([getattr(route, key) for route in routes], dtype=float)
            for key in (
                "stiffness", "retardation", "linear_weight", "breaking_load", "pulley_radius",
                "anchor_pulley_radius",
            )
        }  # fmt: skip
        ends = CableSet(
            p_WA=p_BQ[:, starts[:-1]],
            p_PB=p_BQ[:, starts[1:] - 1],
            **given,
            **{key: np.array(rows).T for key, rows in axes.items()},
        )
        return CableRoutes(names=names, bodies=np.array(bodies), p_BQ=p_BQ, first=starts, ends=ends)

    @staticmethod
    def of_cable_set(
        cables: CableSet, body: int, names: Sequence[str] = (), exit_body: int = WORLD_BODY
    ) -> CableRoutes:
        """The routes of a robot with one platform.

        Args:
            cables: Its cables.
            body: Index of the platform's body, with the platform frame as its own.
            names: Names of the cables.
            exit_body: Index of the body with the exit points, whose frame they are given in.
        """
        m = cables.count
        points = np.empty((3, 2 * m))
        points[:, ::2], points[:, 1::2] = cables.p_WA, cables.p_PB
        return CableRoutes(
            names=tuple(names) or tuple(f"cable {i + 1}" for i in range(m)),
            bodies=np.array([exit_body, body] * m),
            p_BQ=points,
            first=np.arange(0, 2 * m + 1, 2),
            ends=cables,
        )

    @property
    def count(self) -> int:
        """Number of cables m."""
        return len(self.names)

    def touched_bodies(self) -> tuple[int, ...]:
        """Indices of the bodies with points of cables, the world's left out, ascending."""
        return tuple(int(b) for b in np.unique(self.bodies) if b != WORLD_BODY)

    def has_eyelets(self) -> bool:
        """Whether a cable has points between its ends."""
        return bool(np.any(np.diff(self.first) > 2))

    def as_cable_set(self, body: int) -> CableSet | None:
        """The same cables as a `CableSet`, where all run straight from the world to one body.

        Args:
            body: Index of that body.

        Returns:
            The cables with exit points in W and anchor points in the body's frame; None: some have
            other ends, or eyelets.
        """
        if self.has_eyelets():
            return None
        if np.any(self.bodies[::2] != WORLD_BODY) or np.any(self.bodies[1::2] != body):
            return None
        return self.ends

    def with_cables(self, ends: CableSet) -> Self:
        """The same routes with other constants of their cables.

        Args:
            ends: `ends` with another stiffness, other pulleys, and the like.

        Raises:
            CableModelError: Its points are others.
        """
        same = np.array_equal(ends.p_WA, self.ends.p_WA) and np.array_equal(
            ends.p_PB, self.ends.p_PB
        )
        if not same:
            raise CableModelError(
                "with_cables: found cables with other exit or anchor points; accepted: those of "
                "the routes"
            )
        return replace(self, ends=ends)

    def without_pulleys(self) -> Self:
        """The same cables from fixed exit points to fixed anchor points."""
        return replace(self, ends=self.ends.without_pulleys())

    def packed(self, rows: Mapping[int, int]) -> tuple[Array, Integers, Integers]:
        """What kernels take of the routes.

        Args:
            rows: Row of each body in a tree, by its index.

        Returns:
            Segments as rows of `CableSet.packed()`, pulleys at the ends of cables only, shape
            (s - m, 17); rows in the tree of where each begins and ends, shape (s - m, 2); where
            the segments of each cable begin, and at last s - m, shape (m + 1,).
        """
        per_cable = self.ends.packed()
        segments, places, first = [], [], [0]
        for i in range(self.count):
            start, end = int(self.first[i]), int(self.first[i + 1])
            for k in range(start, end - 1):
                row = per_cable[i].copy()
                row[0:3], row[3:6] = self.p_BQ[:, k], self.p_BQ[:, k + 1]
                if k > start:
                    row[8] = 0.0
                if k < end - 2:
                    row[13] = 0.0
                segments.append(row)
                places.append([rows[int(self.bodies[k])], rows[int(self.bodies[k + 1])]])
            first.append(len(segments))
        return np.array(segments), np.array(places, dtype=np.int64), np.array(first, dtype=np.int64)


def _frame_of(where: Any, plant: MultibodyPlant, cable: str) -> Any:
    """The frame that a user gave, as itself or as a body."""
    frame = where.body_frame() if hasattr(where, "body_frame") else where
    if not hasattr(frame, "GetFixedPoseInBodyFrame"):
        raise CableModelError(
            f"points of {cable}: found {type(where).__name__} for a frame; accepted: a Frame or a "
            "body of the plant"
        )
    index = frame.index()
    if int(index) >= plant.num_frames() or plant.get_frame(index) is not frame:
        raise CableModelError(
            f"points of {cable}: found the frame {frame.name()} of another plant; accepted: one of "
            "the plant that the cables are in"
        )
    return frame

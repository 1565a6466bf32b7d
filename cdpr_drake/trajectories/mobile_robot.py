"""A mobile robot with two driven wheels that goes round on a closed track."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array


@dataclass(frozen=True)
class RoundedTrack:
    """A rectangle with rounded corners, driven round anticlockwise.

    Attributes:
        length: Along the heading at the start [m].
        width: Across it [m].
        corner_radius: Radius of the middle of the track in the corners [m]; at most half the
            width, and half the length.

    The start is the middle of a long side; the frame S stands there, x ahead, y to the left.
    """

    length: float
    width: float
    corner_radius: float

    def sides(self) -> Array:
        """Lengths of the straight and round pieces from the start on, in turn, shape (9,) [m]."""
        r = self.corner_radius
        along, across = self.length - 2.0 * r, self.width - 2.0 * r
        corner = 0.5 * np.pi * r
        return np.array([
            0.5 * along, corner, across, corner, along, corner, across, corner, 0.5 * along
        ])  # fmt: skip

    def perimeter(self) -> float:
        """Length of a lap [m]."""
        return float(np.sum(self.sides()))

    def point(self, piece: int, distance: float) -> tuple[float, float, float]:
        """Place x, y [m] and heading [rad] in S, a distance [m] into one of `sides`."""
        return self._ahead(piece, distance, *self._starts[piece])

    @cached_property
    def _starts(self) -> list[tuple[float, float, float]]:
        """Place [m] and heading [rad] where each of `sides` begins."""
        starts = [(0.0, 0.0, 0.0)]
        for piece, side in enumerate(self.sides()[:-1].tolist()):
            starts.append(self._ahead(piece, side, *starts[-1]))
        return starts

    def _ahead(
        self, piece: int, s: float, x: float, y: float, heading: float
    ) -> tuple[float, float, float]:
        """Place [m] and heading [rad] a distance [m] further on a piece."""
        if piece % 2 == 0:
            return float(x + s * np.cos(heading)), float(y + s * np.sin(heading)), heading
        r = self.corner_radius
        turned = heading + s / r
        x += r * (np.sin(turned) - np.sin(heading))
        y -= r * (np.cos(turned) - np.cos(heading))
        return float(x), float(y), float(turned)


class MobileRobotMotion:
    """A robot with differential drive that follows a track, and the object on it.

    The middle between its two wheels is on the track, and it looks along it. The faster wheel runs
    at one speed all the time, so that the robot is slower in the corners. A point p of it moves as
    differential drive has it: v = (v_l + v_r) / 2 ahead, w = (v_r - v_l) / wheel_base about z.
    """

    def __init__(
        self, X_WO: RigidTransform, track: RoundedTrack, *, wheel_base: float, lap_time: float
    ) -> None:
        """From the pose at time 0, where x of O looks ahead and z is the vertical of the track.

        Args:
            X_WO: Pose of the object, in the middle between the wheels, at time 0 [m].
            track: The track, through the object at time 0.
            wheel_base: Distance of the wheels [m].
            lap_time: Time of a lap [s].
        """
        self._X_WS, self._track, self._base = X_WO, track, wheel_base
        self._lap = lap_time
        sides = track.sides()
        slowness = np.ones(len(sides))
        slowness[1::2] = 1.0 + 0.5 * wheel_base / track.corner_radius
        weights = sides * slowness
        self._speed = float(np.sum(weights)) / lap_time
        self._speeds = self._speed / slowness
        self._ends = np.cumsum(weights) / self._speed

    def at(self, time: float) -> RigidTransform:
        """X_WO at a time [s]."""
        piece, since = self._piece(time)
        x, y, heading = self._track.point(piece, since * self._speeds[piece])
        X_SO = RigidTransform(RotationMatrix.MakeZRotation(heading), [x, y, 0.0])
        return self._X_WS @ X_SO

    def is_moving(self) -> bool:
        """It is."""
        return True

    def wheel_speeds(self, time: float) -> tuple[float, float]:
        """Speeds of the left and the right wheel on the ground at a time [m/s]."""
        piece, _ = self._piece(time)
        v = float(self._speeds[piece])
        w = v / self._track.corner_radius if piece % 2 else 0.0
        return v - 0.5 * w * self._base, v + 0.5 * w * self._base

    def wheel_distances(self, time: float) -> tuple[float, float]:
        """How far the left and the right wheel have rolled since time 0, at a time [m]."""
        piece, since = self._piece(time)
        sides, r = self._track.sides(), self._track.corner_radius
        into = [*sides[:piece].tolist(), since * float(self._speeds[piece])]
        way = sum(into) + (time // self._lap) * self._track.perimeter()
        turned = sum(s / r for k, s in enumerate(into) if k % 2)
        turned += (time // self._lap) * 2.0 * np.pi
        return way - 0.5 * turned * self._base, way + 0.5 * turned * self._base

    def wheel_base(self) -> float:
        """Distance of the wheels [m]."""
        return self._base

    def _piece(self, time: float) -> tuple[int, float]:
        """The piece of the track at a time [s], and since when it is driven [s]."""
        into = time % self._lap
        piece = min(int(np.searchsorted(self._ends, into, side="right")), len(self._ends) - 1)
        return piece, into - (float(self._ends[piece - 1]) if piece else 0.0)

"""A geometric path with a law of time, as a trajectory that whatever tracks one can track."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TrajectoryError
from cdpr_drake.trajectories.pose_path import PosePath, shifted_pieces
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory


@dataclass(frozen=True, eq=False)
class TimedPath(PoseTrajectory):
    """A motion along a path whose acceleration d2s/dt2 is constant between stations.

    Between two stations (ds/dt)^2 changes linearly with s. Before its start and after its end it
    rests.

    Attributes:
        path: The path; None only before `make` has set it.
        stations: Parameters of the stations, shape (n + 1,), growing [m].
        squared_speeds: (ds/dt)^2 there, shape (n + 1,); 0 at the ends, and not at two stations in
            a row [m^2/s^2].
    """

    path: PosePath | None = None
    stations: Array = field(default_factory=lambda: np.empty(0), repr=False)
    squared_speeds: Array = field(default_factory=lambda: np.empty(0), repr=False)

    @staticmethod
    def make(
        path: PosePath, stations: Array, squared_speeds: Array, start_time: float = 0.0
    ) -> TimedPath:
        """From a path and the speeds along it; all breaks of the path must be stations.

        Raises:
            TrajectoryError: A speed is negative, NaN, or zero at two stations in a row.
        """
        x = np.asarray(squared_speeds, float)
        speeds = np.sqrt(x)
        if not (np.all(np.isfinite(speeds)) and np.all(speeds[1:] + speeds[:-1] > 0.0)):
            raise TrajectoryError(
                "speeds along a path: found one that is negative or NaN, or two zeros in a row; "
                "accepted: others"
            )
        steps = 2.0 * np.diff(stations) / (speeds[1:] + speeds[:-1])
        poses = path.pose(float(stations[0])), path.pose(float(stations[-1]))
        return TimedPath(poses, (float(np.sum(steps)),), start_time, path, stations, x)

    def __post_init__(self) -> None:
        """Packs the stretches, one from station to station.

        Raises:
            TrajectoryError: The start is not finite.
        """
        super().__post_init__()
        assert self.path is not None
        ways, speeds = np.diff(self.stations), np.sqrt(self.squared_speeds)
        steps = 2.0 * ways / (speeds[1:] + speeds[:-1])
        rows = np.column_stack(
            [
                self.start_time + np.cumsum([0.0, *steps[:-1]]),
                steps,
                speeds[:-1],
                np.diff(self.squared_speeds) / (2.0 * ways),
                shifted_pieces(self.path, self.stations[:-1]),
            ]
        )
        object.__setattr__(self, "_stretches", rows)

    def times(self) -> Array:
        """When it is at the stations, shape (n + 1,) [s]."""
        rows = self.stretches()
        return np.append(rows[:, 0], self.end_time)

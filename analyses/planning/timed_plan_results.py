"""A motion among what moves with all that is told of it: what is proven, when it waits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cdpr_drake.analyses.planning.runs_in_sets import RunInSets
from cdpr_drake.arrays import Array
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.planning.timed_motion import MotionInTime
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.moving_shapes import MovingObstacle
from cdpr_drake.workspaces.timed_sets import TimedSets

RESTING, SHORTEST_WAIT = 2e-3, 0.2
"""Below this speed [m/s] for so long [s] a platform is said to wait."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class TimedRun(RunInSets):
    """A motion of a robot in sets of poses and time.

    Attributes:
        found: The motion.
        things: What moves.
        around: The robot's cables and platform.
    """

    found: MotionInTime
    things: Sequence[MovingObstacle]
    around: Surroundings

    @property
    def plan(self) -> PathPlan:
        """The motion as one of the robot."""
        return self.found.plan

    @property
    def sets(self) -> TimedSets:
        """The sets."""
        return self.found.sets

    @property
    def about(self) -> str:
        """What it is, in words for titles."""
        return (
            f"{self.robot.name}, {self.geometry}, proven motion among what moves, "
            f"least {self.found.cost}: "
            f"{self.way:.4g} m, {self.found.plan.duration:.4g} s"
        )

    @cached_property
    def track(self) -> tuple[Array, Array]:
        """Times, shape (n,) [s], and positions of Po in W, shape (n, 3) [m], of the motion."""
        times = np.linspace(0.0, self.motion.end_time, 2000)
        return times, self.motion.path.points(times)[:, 4:7]  # type: ignore[union-attr]

    @cached_property
    def way(self) -> float:
        """Length of the way of Po [m]."""
        return float(np.sum(np.linalg.norm(np.diff(self.track[1], axis=0), axis=1)))

    def waits(self) -> list[tuple[float, float]]:
        """When the platform waits on its way: from, to [s]."""
        times, points = self.track
        slow = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times) < RESTING
        edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]]).astype(int)))
        spans = [(float(times[a]), float(times[b])) for a, b in edges.reshape(-1, 2)]
        return [(a, b) for a, b in spans if b - a >= SHORTEST_WAIT]

    def proven(self) -> tuple[list[str], list[str]]:
        """What is proven at every instant, and what is not, in words."""
        about, lim = self.sets.about, self.task.limits
        least, most = about["tension_limits_n"]
        yes = [
            f"tensions from {least:g} to {most:g} N give the motion, its acceleration and any "
            "other in the box",
            "cables touch neither each other, platform, frame nor obstacles that rest or move",
            "the platform touches neither frame nor obstacles that rest or move",
            self._afterwards(),
        ]
        if np.isfinite(lim.cable_speed):
            yes.insert(1, f"cables are not faster than {lim.cable_speed:.4g} m/s")
        no = self.kept_at_samples()
        if not self._settles():
            no.append(f"what obstacles do at the goal after {self.sets.horizon:.4g} s")
        return yes, no

    def _settles(self) -> bool:
        return all(thing.settled() <= self.sets.horizon for thing in self.things)

    def _afterwards(self) -> str:
        until = "for ever" if self._settles() else f"until {self.sets.horizon:.4g} s"
        return f"the platform can stay at the goal {until}"

    def time_bound(self) -> float:
        """No motion within these limits arrives earlier [s].

        From rest to rest over the distance along each axis with the acceleration of the box, over
        the straight line with the largest speed, and not before the goal is clear.
        """
        lim = self.task.limits
        ends = self.track[1][[0, -1]]
        ways = np.abs(ends[1] - ends[0])
        box = np.array(self.sets.about["accelerations_m_s2"], float)
        bound = float(np.max(2.0 * np.sqrt(ways / box)))
        speed = min(lim.speed, lim.cable_speed)
        if np.isfinite(speed):
            bound = max(bound, float(np.linalg.norm(ways)) / speed)
        return bound

    def details(self) -> dict[str, Any]:
        """As the base class says."""
        found, plan = self.found, self.found.plan
        yes, no = self.proven()
        time = found.cost == "time"
        straight = float(np.linalg.norm(np.diff(self.track[1][[0, -1]], axis=0)))
        return {
            "duration_s": plan.duration,
            "path_length_m": self.way,
            "proven": {"path": True, "motion": True, "of": yes, "not_of": no},
            "least": found.cost,
            "cost": plan.duration if time else self.way,
            "lower_bound": self.time_bound() if time else straight,
            "straight_m": straight,
            "curve_at_most_m": found.length,
            "largest_accelerations_m_s2": found.accelerations.tolist(),
            "largest_speed_m_s": found.speed,
            "waits": [{"from_s": a, "to_s": b} for a, b in self.waits()],
            "goal_clear_from_s": found.goal_from,
            "moving": [thing.name for thing in self.things],
            "stretches": [
                {"from_s": a, "to_s": b, "set": int(n)} for a, b, n in found.stretches()
            ],
            "sets": {"count": len(self.sets), "overlaps": len(self.sets.graph), **self.sets.about},
            "judged_samples": self.judged[0],
            "judged_infeasible": dict(self.judged[1]),
            "sets_time_s": self.sets_time,
            "planning_time_s": self.planning_time,
        }  # fmt: skip

    def more_rows(self) -> list[tuple[str, str]]:
        """As the base class says."""
        waits = ", ".join(f"{a:.4g} to {b:.4g} s" for a, b in self.waits())
        return [("waits", waits or "nowhere")]

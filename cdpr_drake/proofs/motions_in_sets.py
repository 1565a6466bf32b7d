"""Motions in proven sets: their numbers, what of them is proven, exact checks of samples."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.planning.plans import Plan
from cdpr_drake.arrays import Array
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.proofs.moving_clearances import moving_clearances
from cdpr_drake.proofs.path_in_sets import ProvenMotion
from cdpr_drake.proofs.proven_sets import PoseSets
from cdpr_drake.proofs.robot_sets import ProvenSets
from cdpr_drake.proofs.timed_motion import MotionInTime
from cdpr_drake.proofs.timed_sets import TimedSets
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.moving_shapes import MovingObstacle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLATFORM_KIND = "collision-free"  # the kind that keeps the platform off obstacles
JUDGED = 2000  # samples of a motion that are judged by the exact checks of poses

MOVING_CHECKS = ("cables off what moves", "platform off what moves")
"""Names of the checks in addition to the kinds."""

SETS, REPLAY = "sets.yaml", "replay.html"
"""The sets, in Drake's format of regions, of sets of poses and time the last number is time; and
the page of the replay."""

RESTING, SHORTEST_WAIT = 2e-3, 0.2
"""A platform that is slower than this [m/s] for so long [s] waits."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MotionInSets(Plan):
    """A motion in proven sets, of any kind.

    Attributes:
        solution: The motion as one of the robot.
        sets_time: Time that the sets took [s].
        judged: Samples of the motion, and of each kind of check at how many it fails by the exact
            checks of poses.
    """

    solution: PathPlan
    sets_time: float
    judged: tuple[int, Mapping[str, int]]

    @property
    @abstractmethod
    def sets(self) -> PoseSets | TimedSets:
        """The sets."""

    @abstractmethod
    def proof(self) -> tuple[list[str], list[str]]:
        """What is proven at every instant, and what is not, in words."""

    def proof_details(self, path: bool, motion: bool) -> dict[str, Any]:
        """Duration, what is proven, the sets, and exact checks of samples."""
        yes, no = self.proof()
        return {
            "duration_s": self.solution.duration,
            "proven": {"path": path, "motion": motion, "of": yes, "not_of": no},
            "sets": {"count": len(self.sets), "overlaps": len(self.sets.graph), **self.sets.about},
            "judged_samples": self.judged[0],
            "judged_infeasible": dict(self.judged[1]),
            "sets_time_s": self.sets_time,
        }

    def kept_at_samples(self) -> list[str]:
        """What the motion keeps only at samples, in words."""
        lim, (by_move, by_turn) = self.task.limits, self.task.dynamics.damping
        lines = []
        if np.isfinite(lim.torque) or np.isfinite(lim.cable_acceleration):
            lines.append("torques of motors and accelerations of cables, kept at samples")
        if self.task.dynamics.is_damped:
            lines.append(
                f"tensions against the platform's damping, {by_move:g} N s/m and {by_turn:g} N m "
                "s/rad, kept at samples"
            )
        return lines

    def description(self) -> list[str]:
        """Length and cost, what is proven and what is not, and exact checks of samples."""
        details, (count, failed) = self.details(), self.judged
        proven, unit = details["proven"], "s" if details["least"] == "time" else "m"
        path = "the path" if proven["path"] else "CABLES ALONE"
        wrong = sum(failed.values())
        return [
            f"{details['duration_s']:.4f} s along {details['path_length_m']:.4g} m, in "
            f"{len(details['stretches'])} of {details['sets']['count']} proven sets",
            f"least {details['least']}: {details['cost']:.4g} {unit}, no less than "
            f"{details['lower_bound']:.4g} {unit} in these sets; straight "
            f"{details['straight_m']:.4g} m",
            f"proven at every instant: {'the motion' if proven['motion'] else path}",
            *(f"waits from {wait['from_s']:.4g} to {wait['to_s']:.4g} s"
              for wait in details.get("waits", [])),
            *(f"  {line}" for line in proven["of"]),
            *(f"  not proven: {line}" for line in proven["not_of"]),
            f"{count} samples by the checks of poses: "
            f"{'all kinds hold' if not wrong else f'{wrong} FAIL'}",
        ]  # fmt: skip

    def write(self, folder: Folder) -> None:
        """Writes the sets, too."""
        with folder.file(SETS) as part:
            self.sets.save(part)
        super().write(folder)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ProvenPlan(MotionInSets):
    """A motion of a robot in proven sets of poses.

    Attributes:
        in_sets: The motion with its path in the sets.
    """

    in_sets: ProvenMotion

    @property
    def sets(self) -> PoseSets:
        """The sets."""
        return self.in_sets.path.sets

    @property
    def title(self) -> str:
        """What it is, in words for titles."""
        what = "motion" if self.motion_proven else "path" if self.path_proven else "cables only"
        return (
            f"{self.robot.name}, {self.geometry}, proven {what}, least {self.in_sets.cost}: "
            f"{self.in_sets.path.path.length:.4g} m, {self.solution.duration:.4g} s"
        )

    @property
    def path_proven(self) -> bool:
        """True if all that a path needs is proven at every instant.

        With obstacles that needs the platform to be proven clear of them, too.
        """
        return PLATFORM_KIND in self.sets.about["kinds"] or not self.sets.about["obstacles"]

    @property
    def motion_proven(self) -> bool:
        """True if tensions within the limits are proven at every instant of the motion, too."""
        return self.path_proven and self.in_sets.box is not None

    def proof(self) -> tuple[list[str], list[str]]:
        """What is proven at every instant, and what is not, in words."""
        about, lim, box = self.sets.about, self.task.limits, self.in_sets.box
        least, most = about["tension_limits_n"]
        tensions = f"tensions from {least:g} to {most:g} N"
        yes, no = [], []
        if box is not None:
            what = "its acceleration and any other in the box"
            if box.moments is not None:
                what = (
                    "its accelerations, angular and gyroscopic terms with them, and any others in "
                    "the boxes of accelerations and moments"
                )
            yes.append(f"{tensions} give the motion, {what}")
            if np.isfinite(lim.cable_speed):
                yes.append(f"cables are not faster than {lim.cable_speed:.4g} m/s")
        else:
            yes.append(f"{tensions} hold the platform at rest")
            why = "no accelerations were asked for"
            if self.in_sets.turns:
                why = "angles vary, and no angular accelerations were asked for"
            no.append(f"tensions of the motion, looked at between stations by samples: {why}")
        kinds = {
            "interference-free": "cables touch neither each other, platform, frame nor obstacles",
            PLATFORM_KIND: "the platform touches neither frame nor obstacles",
        }
        yes += [kinds[kind] for kind in about["kinds"] if kind in kinds]
        if not self.path_proven:
            no.append("the platform stays off the obstacles")
        return yes, no + self.kept_at_samples()

    def details(self) -> dict[str, Any]:
        """Path, bounds, proof, sequences of sets, and exact checks of samples."""
        in_sets, path, plan, box = self.in_sets, self.in_sets.path, self.solution, self.in_sets.box
        in_time = in_sets.cost == "time"
        details = self.proof_details(self.path_proven, self.motion_proven) | {
            "path_length_m": path.path.length,
            "least": in_sets.cost,
            "method": path.method,
            "cost": plan.duration if in_time else path.length,
            "lower_bound": in_sets.time_bound() if in_time else path.lower_bound,
            "straight_m": path.straight,
            "shortest_polyline_m": path.length,
            "curve_at_most_m": path.curve.polygon,
            "largest_accelerations_m_s2": None if box is None else box.accelerations.tolist(),
            "largest_speed_m_s": None if box is None else box.speed,
            "stretches": [
                {"from_m": a, "to_m": b, "set": int(n)} for a, b, n in path.stretches()
            ],
            "sequences": [
                {"length_m": length, "sets": [int(n) for n in sets]}
                for length, sets in path.looked_at
            ],
            "stations": len(plan.trajectory.stations),
        }  # fmt: skip
        if box is not None and box.moments is not None:
            details["largest_moments_n_m"] = box.moments.tolist()
        return details

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Sets, obstacles and the path first; accelerations if they are proven."""
        from cdpr_drake.proofs import set_figures as draw

        figures: dict[str, Callable[[], Figure]] = {
            "sets": partial(draw.sets_figure, self),
            **super().figures(),
        }
        if self.in_sets.box is not None:
            turns = self.in_sets.box.moments is not None
            figures["accelerations"] = partial(draw.acceleration_figure, self, turns)
        return figures


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class TimedPlan(MotionInSets):
    """A motion of a robot in sets of poses and time, among what moves.

    Attributes:
        in_sets: The motion with its path in the sets.
        things: What moves.
        around: The robot's cables and platform.
    """

    in_sets: MotionInTime
    things: Sequence[MovingObstacle]
    around: Surroundings

    @property
    def sets(self) -> TimedSets:
        """The sets."""
        return self.in_sets.sets

    @property
    def title(self) -> str:
        """What it is, in words for titles."""
        return (
            f"{self.robot.name}, {self.geometry}, proven motion among what moves, least "
            f"{self.in_sets.cost}: {self.way:.4g} m, {self.solution.duration:.4g} s"
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

    def proof(self) -> tuple[list[str], list[str]]:
        """What is proven at every instant, and what is not, in words."""
        (least, most), lim = self.sets.about["tension_limits_n"], self.task.limits
        settled = all(thing.settled() <= self.sets.horizon for thing in self.things)
        until = "for ever" if settled else f"until {self.sets.horizon:.4g} s"
        yes = [
            f"tensions from {least:g} to {most:g} N give the motion, its acceleration and any "
            "other in the box",
            "cables touch neither each other, platform, frame nor obstacles that rest or move",
            "the platform touches neither frame nor obstacles that rest or move",
            f"the platform can stay at the goal {until}",
        ]
        if np.isfinite(lim.cable_speed):
            yes.insert(1, f"cables are not faster than {lim.cable_speed:.4g} m/s")
        no = self.kept_at_samples()
        if not settled:
            no.append(f"what obstacles do at the goal after {self.sets.horizon:.4g} s")
        return yes, no

    def time_bound(self) -> float:
        """No motion within these limits arrives earlier [s].

        From rest to rest over the distance along each axis with the acceleration of the box, and
        over the straight line with the largest speed.
        """
        lim = self.task.limits
        ways = np.abs(self.track[1][-1] - self.track[1][0])
        box = np.array(self.sets.about["accelerations_m_s2"], float)
        bound = float(np.max(2.0 * np.sqrt(ways / box)))
        return max(bound, float(np.linalg.norm(ways)) / min(lim.speed, lim.cable_speed))

    def details(self) -> dict[str, Any]:
        """Way, bounds, proof, waits, and exact checks of samples."""
        in_sets, in_time = self.in_sets, self.in_sets.cost == "time"
        straight = float(np.linalg.norm(self.track[1][-1] - self.track[1][0]))
        return self.proof_details(True, True) | {
            "path_length_m": self.way,
            "least": in_sets.cost,
            "cost": self.solution.duration if in_time else self.way,
            "lower_bound": self.time_bound() if in_time else straight,
            "straight_m": straight,
            "curve_at_most_m": in_sets.length,
            "largest_accelerations_m_s2": in_sets.accelerations.tolist(),
            "largest_speed_m_s": in_sets.speed,
            "waits": [{"from_s": a, "to_s": b} for a, b in self.waits()],
            "goal_clear_from_s": in_sets.goal_from,
            "moving": [thing.name for thing in self.things],
            "stretches": [
                {"from_s": a, "to_s": b, "set": int(n)} for a, b, n in in_sets.stretches()
            ],
        }

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The way in space and time first."""
        from cdpr_drake.proofs import set_figures as draw

        return {
            "space_time": partial(draw.space_time_figure, self),
            "sets": partial(draw.sets_over_time_figure, self),
            **super().figures(),
            "accelerations": partial(draw.acceleration_figure, self, False),
        }

    def pages(self) -> dict[str, Callable[[Path], object]]:
        """A replay, in which obstacles move, too."""
        from cdpr_drake.proofs.set_figures import write_timed_replay

        return {REPLAY: partial(write_timed_replay, self)}


def judged(
    sets: ProvenSets, plan: PathPlan, among: Sequence[MovingObstacle] = (), count: int = JUDGED
) -> tuple[int, dict[str, int]]:
    """Samples of a motion, evenly in time, and of each check at how many it fails exactly."""
    motion = plan.trajectory
    times = np.linspace(motion.start_time, motion.end_time, count)
    poses = [motion.pose(float(t)) for t in times]
    p = np.array([X.translation() for X in poses])
    R = np.array([X.rotation().matrix() for X in poses])
    failed = {name: int(np.count_nonzero(~holds)) for name, holds in sets.judge(p, R).items()}
    if among:
        assert sets.conditions is not None
        assert sets.conditions.around is not None
        gaps = moving_clearances(sets.conditions.around, among, times, p[:, None], R[:, None])
        hits = np.count_nonzero(~(gaps[:, 0] > float(sets.about["clearance_m"])), axis=0)
        failed |= dict(zip(MOVING_CHECKS, hits.tolist(), strict=True))
    return count, failed

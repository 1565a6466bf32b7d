"""A planned motion with all that is told of it: numbers, a table of the motion, its stretches."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.planning.plan_tracking import RATE, TrackedPlan
from cdpr_drake.analyses.reporting.exported_logs import write_columns
from cdpr_drake.analyses.reporting.log_files import finite, write_json
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import MotionSamples, PathTask, pose_words, sample_motion
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.planning.resistance import CornerMargins, resisted_along, wrench_words
from cdpr_drake.summaries import Tabulated, numbers
from cdpr_drake.trajectories.sampled_motion import MOTION_COLUMNS, TIME_COLUMN
from cdpr_drake.trajectories.timed_path import TimedPath

SUMMARY, MOTION = "summary.json", "motion.csv"

REACHED = 0.99
"""A limit counts as reached from this share of it on."""

POSITION = slice(4, 7)
"""Of a row of `MOTION_COLUMNS`."""

MOMENT = 1e-9
"""Instants that are nearer are one [s]."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MotionRun(Tabulated):
    """A planned motion of a robot, of any kind, as figures and tables ask it.

    Attributes:
        robot: The robot.
        limits: Limits of the robot, without reserve.
        arguments: What was asked, for JSON.
        planning_time: Time that planning took, with what it loads at its first use [s].
        tracked: What the simulated robot did; None where it was not simulated.
    """

    robot: Robot
    limits: MotionLimits
    arguments: dict[str, Any]
    planning_time: float
    tracked: TrackedPlan | None = None

    @property
    @abstractmethod
    def task(self) -> PathTask:
        """The robot as it was planned with."""

    @property
    @abstractmethod
    def motion(self) -> TimedPath:
        """The motion."""

    @property
    @abstractmethod
    def samples(self) -> MotionSamples:
        """What it asks, as often as it is controlled."""

    @property
    @abstractmethod
    def about(self) -> str:
        """What it is, in words for titles."""

    @property
    def geometry(self) -> str:
        """Geometry of the planned robot's cables in words, as `Robot.geometry_words`."""
        return self.robot.geometry_words(self.task.cables.has_pulleys())

    @abstractmethod
    def details(self) -> dict[str, Any]:
        """What is its own in `as_dict`."""

    def more_rows(self) -> list[tuple[str, str]]:
        """What is its own in its summary."""
        return []

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        told: dict[str, Any] = finite(
            {
                "robot": self.robot.name,
                "geometry": self.geometry,
                "arguments": self.arguments,
                **self.details(),
                **limits_told(self),
            }
        )
        return told

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        samples, limits = self.samples, self.task.limits
        reached = {
            name: int(np.sum(np.any(holds, axis=1))) for name, holds in samples.active().items()
        }
        most = max(reached, key=lambda name: reached[name])
        start, end = (self.motion.motion(t)[POSITION] for t in (0.0, self.motion.end_time))
        rows = [
            ("duration", f"{self.motion.end_time:.4f} s, planned in {self.planning_time:.3g} s"),
            ("positions", f"({numbers(start)}) to ({numbers(end)}) m"),
            ("tensions", f"{np.min(samples.tensions):.4g} to {np.max(samples.tensions):.4g} N, "
             f"limits {limits.lower:g} to {limits.upper:g} N"),
            ("cable speed", f"up to {np.max(np.abs(samples.cable_speeds)):.4g} m/s, "
             f"limit {limits.cable_speed:.4g} m/s"),
            ("largest share", f"{np.max(samples.uses):.4f} of a limit"),
            ("most reached", most if reached[most] else "none"),
            *self.more_rows(),
        ]  # fmt: skip
        if self.tracked is not None:
            told = self.tracked.as_dict()
            words = "all limits kept" if told["keeps_limits"] else "limits missed"
            error = 1e3 * told["largest_position_error_m"]
            rows.append(("tracked", f"{words}, error up to {error:.3g} mm"))
        return self.about, rows

    def columns(self) -> dict[str, Array]:
        """A row a step of control: pose, velocity, acceleration, and what cables do."""
        return motion_columns(self)

    def write(self, folder: Path) -> dict[str, Any]:
        """Writes summary and motion into an existing folder; returns the summary."""
        told = self.as_dict()
        write_columns(folder / MOTION, self.columns())
        write_json(folder / SUMMARY, told)
        return told


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PlanRun(MotionRun):
    """A time-optimal plan of a robot.

    Attributes:
        plan: The plan.
        source: What the path is, in words.
    """

    plan: PathPlan
    source: str

    @property
    def task(self) -> PathTask:
        """The robot as it was planned with."""
        return self.plan.task

    @property
    def motion(self) -> TimedPath:
        """The motion."""
        return self.plan.trajectory

    @property
    def about(self) -> str:
        """What it is, in words for titles."""
        name, source = f"{self.robot.name}, {self.geometry}", self.source
        return f"{name}: time-optimal along {source}, {self.plan.duration:.4g} s"

    def more_rows(self) -> list[tuple[str, str]]:
        """As the base class says."""
        if (found := self.resisted) is None:
            return []
        k = found.worst
        return [(
            "resists", f"{len(found.corners)} wrenches, {wrench_words(found.corners[k])} with the "
            f"least margin, {found.margins[k]:.4f} at s = {found.parameters[k]:.4g} m",
        )]  # fmt: skip

    @cached_property
    def samples(self) -> MotionSamples:
        """The plan, as often as it is controlled."""
        return self.plan.samples(RATE)

    @cached_property
    def resisted(self) -> CornerMargins | None:
        """How well it resists each of the wrenches that it must, at its stations; None: none."""
        if not len(self.task.resist):
            return None
        return resisted_along(self.task, self.plan.trajectory)

    def reached_share(self) -> float:
        """Share of the instants at which a limit is reached, see `REACHED`."""
        return float(np.mean(np.max(self.samples.uses, axis=1) >= REACHED))

    def details(self) -> dict[str, Any]:
        """As the base class says."""
        plan = self.plan
        return {
            "duration_s": plan.duration,
            "path_length_m": plan.path.length,
            "stations": len(plan.trajectory.stations),
            "rests": len(plan.path.rests),
            "planning_time_s": self.planning_time,
            **({} if self.resisted is None else {"resist": corners_told(self)}),
        }


def corners_told(run: PlanRun) -> dict[str, Any]:
    """How well a plan resists each of the wrenches that it must, for JSON."""
    found, samples = run.resisted, run.samples
    assert found is not None
    assert samples.resisted is not None
    between = int(np.argmax(samples.resisted))
    names = ("wrench_n_m_n", "least_margin", "at_s_m")
    corners = [
        dict(zip(names, (corner.tolist(), float(margin), float(s)), strict=True))
        for corner, margin, s in zip(found.corners, found.margins, found.parameters, strict=True)
    ]
    return {
        "corners": corners,
        "worst": corners[found.worst] | {"pose": pose_words(run.plan.path.points(
            found.parameters[[found.worst]])[0])},
        "largest_share_between_stations": float(samples.resisted[between]),
        "at_s_m": float(samples.parameters[between]),
    }  # fmt: skip


def limits_told(run: MotionRun) -> dict[str, Any]:
    """Limits of a motion and how they are used, for JSON."""
    lim, samples = run.task.limits, run.samples
    return {
        "limits_of_the_plan": {
            "tension_n": [lim.lower, lim.upper],
            "cable_speed_m_s": lim.cable_speed,
            "cable_acceleration_m_s2": lim.cable_acceleration,
            "torque_nm": lim.torque,
            "speed_m_s": lim.speed,
        },
        "largest_share_of_limits": float(np.max(samples.uses)),
        "instants_at_a_limit": float(np.mean(np.max(samples.uses, axis=1) >= REACHED)),
        "reached": {
            name: int(np.sum(np.any(holds, axis=1)))
            for name, holds in samples.active().items()
            if np.any(holds)
        },
        "tracked": None if run.tracked is None else run.tracked.as_dict(),
        "versions": package_versions(),
    }


def motion_columns(run: MotionRun) -> dict[str, Array]:
    """A motion as a table: pose, velocity, acceleration, and what it asks of the cables.

    Its last row is the end of the motion, wherever that lies between two steps of control.
    """
    motion, samples = run.motion, run.samples
    parts = [samples]
    if motion.end_time > samples.times[-1] + MOMENT:
        parts.append(sample_motion(run.task, motion, np.array([motion.end_time])))

    def joined(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    times = joined("times")
    rows = np.array([motion.motion(t) for t in times])
    table = {TIME_COLUMN: times, "s_m": joined("parameters"), "ds_dt_m_s": joined("speeds")}
    table |= {name: rows[:, k] for k, name in enumerate(MOTION_COLUMNS)}
    for quantity, name, unit in (
        ("tension", "tensions", "n"),
        ("cable_speed", "cable_speeds", "m_s"),
        ("cable_acceleration", "cable_accelerations", "m_s2"),
        ("torque", "torques", "nm"),
    ):
        values = joined(name)
        for k, cable in enumerate(run.robot.cables):
            table[f"{quantity}_{cable.name}_{unit}"] = values[:, k]
    table["largest_share_of_limits"] = np.max(joined("uses"), axis=1)
    return table

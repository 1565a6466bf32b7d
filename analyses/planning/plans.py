"""A planned motion of any kind: its numbers, tables, figures and files."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder, write_result
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.planning.cable_streams import CableStream, cable_stream
from cdpr_drake.analyses.planning.plan_tracking import MOMENT, RATE, TrackedPlan, track_plan
from cdpr_drake.analyses.reporting.exported_logs import write_columns
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import DESIRED, PLATFORM
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import MotionSamples, PathTask, sample_motion
from cdpr_drake.planning.path_timing import PathPlan
from cdpr_drake.trajectories.sampled_motion import MOTION_COLUMNS, TIME_COLUMN
from cdpr_drake.trajectories.timed_path import TimedPath

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUMMARY, MOTION = "summary.json", "motion.csv"

REACHED = 0.99  # a limit counts as reached from this share of it on


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Plan(Result):
    """A planned motion of a robot, of any kind.

    Attributes:
        robot: The robot.
        limits: Limits of the robot, without reserve.
        arguments: What was asked, for JSON.
        planning_time: Time that planning took, with what it loads at its first use [s].
        solution: The motion that was planned, with numbers of its solver.
        tracked: What the simulated robot did; None if it was not simulated.
        stream: The motion as drives follow it; None if nobody asked.
        folder: Results folder; None if nothing was kept.
        failed: Of files that could not be written, the name and why.
    """

    robot: Robot
    limits: MotionLimits
    arguments: Mapping[str, Any]
    planning_time: float
    solution: PathPlan | FreePathSolution
    tracked: TrackedPlan | None = None
    stream: CableStream | None = None
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    @property
    @abstractmethod
    def title(self) -> str:
        """What it is, in words for titles."""

    @abstractmethod
    def details(self) -> dict[str, Any]:
        """What `as_dict` has of this kind alone."""

    @abstractmethod
    def description(self) -> list[str]:
        """Lines on this kind of motion alone."""

    @property
    def task(self) -> PathTask:
        """The robot as it was planned with."""
        return self.solution.task

    @property
    def motion(self) -> TimedPath:
        """The motion."""
        plan = self.solution
        return plan.motion() if isinstance(plan, FreePathSolution) else plan.trajectory

    @cached_property
    def samples(self) -> MotionSamples:
        """What the motion needs of cables and motors, as often as it is controlled."""
        return self.solution.samples(RATE)

    @cached_property
    def shares(self) -> Array:
        """Largest share of a limit at each sample, shape (n,)."""
        return np.asarray(np.max(self.samples.uses, axis=1))

    @property
    def geometry(self) -> str:
        """Geometry of the planned robot's cables in words, as `Robot.geometry_words`."""
        return self.robot.geometry_words(self.task.cables.has_pulleys())

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        limits = self.task.limits
        result: dict[str, Any] = finite({
            "robot": self.robot.name, "geometry": self.geometry, "arguments": self.arguments,
            **self.details(),
            "planning_time_s": self.planning_time,
            "limits_of_the_plan": {
                "tension_n": [limits.lower, limits.upper],
                "cable_speed_m_s": limits.cable_speed,
                "cable_acceleration_m_s2": limits.cable_acceleration,
                "torque_nm": limits.torque,
                "speed_m_s": limits.speed,
            },
            "largest_share_of_limits": float(np.max(self.shares)),
            "instants_at_a_limit": self.reached_share(),
            "reached": self.reached(),
            "tracked": None if self.tracked is None else self.tracked.as_dict(),
            **({} if self.stream is None else {"stream": self.stream.as_dict()}),
            "versions": package_versions(),
        })  # fmt: skip
        return result

    def reached_share(self) -> float:
        """Share of the instants at which a limit is reached."""
        return float(np.mean(self.shares >= REACHED))

    def reached(self) -> dict[str, int]:
        """Steps of control at which each limit is reached, of those that are."""
        holds = self.samples.active().items()
        counts = {name: int(np.sum(np.any(rows, axis=1))) for name, rows in holds}
        return {name: count for name, count in counts.items() if count}

    def tables(self) -> list[Table]:
        """Limits that are reached, and limits that the simulated robot uses."""
        rows = [(name, str(count)) for name, count in self.reached().items()]
        limits = Table(self.title, ("limit", "reached [ms]"), rows)
        return [limits, *([] if self.tracked is None else self.tracked.tables())]

    def lines(self) -> list[str]:
        """Duration, what is special of the kind, limits, tracking, stream."""
        tensions, limits = self.samples.tensions, self.task.limits
        lines = [
            *self.description(),
            f"at a limit in {self.reached_share():.1%} of all instants; largest share "
            f"of a limit {np.max(self.shares):.4f}",
            f"tensions {np.min(tensions):.4g} to {np.max(tensions):.4g} N, limits "
            f"{limits.lower:g} to {limits.upper:g} N",
        ]
        for part in (self.tracked, self.stream):
            lines += [] if part is None else part.lines()
        return lines + ([] if self.folder is None else [f"results: {self.folder}"])

    def columns(self) -> dict[str, Array]:
        """A row a step of control: pose, velocity, acceleration, and what cables do.

        The last row is the end of the motion, wherever that lies between two steps of control.
        """
        parts = [self.samples]
        if self.motion.end_time > parts[0].times[-1] + MOMENT:
            end = np.array([self.motion.end_time])
            parts.append(sample_motion(self.task, self.motion, end))

        def joined(name: str) -> Array:
            return np.concatenate([getattr(part, name) for part in parts])

        times = joined("times")
        rows = np.array([self.motion.motion(t) for t in times])
        table = {TIME_COLUMN: times, "s_m": joined("parameters"), "ds_dt_m_s": joined("speeds")}
        table |= {name: rows[:, k] for k, name in enumerate(MOTION_COLUMNS)}
        for quantity, name, unit in (
            ("tension", "tensions", "n"),
            ("cable_speed", "cable_speeds", "m_s"),
            ("cable_acceleration", "cable_accelerations", "m_s2"),
            ("torque", "torques", "nm"),
        ):
            for cable, values in zip(self.robot.cables, joined(name).T, strict=True):
                table[f"{quantity}_{cable.name}_{unit}"] = values
        table["largest_share_of_limits"] = np.max(joined("uses"), axis=1)
        return table

    def to_dataframe(self) -> Any:
        """The columns as a pandas DataFrame."""
        import pandas as pd  # takes half a second

        return pd.DataFrame(self.columns())

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Tensions, winches and the path in space; the stream if there is one."""
        figures: dict[str, Callable[[], Figure]] = {
            "tensions": self._tension_figure, "winches": self._winch_figure,
            "path": self._path_figure,
        }  # fmt: skip
        return figures | ({} if self.stream is None else {"stream": self.stream.plot})

    def titled(self, words: str) -> str:
        """Title of a figure."""
        return f"{words}\n{self.title}"

    def _tension_figure(self) -> Figure:
        """Tensions with their limits: where one is reached, there is no choice."""
        from cdpr_drake.analyses.visualization.cable_figures import cable_figure

        tensions, limits = self.samples.tensions, self.samples.limits
        log = {
            "time": self.samples.times, "tensions": tensions, "slack": np.zeros(tensions.shape),
        }  # fmt: skip
        return cable_figure(
            self.titled("Tensions of the plan, as far from their limits as can be"), self.robot,
            log, "tensions", "tension [N]",
            bounds=(round(limits.lower, 3), round(limits.upper, 3)),
        )  # fmt: skip

    def _winch_figure(self) -> Figure:
        """Speeds and accelerations of the cables, and torques of the motors, with their limits."""
        from cdpr_drake.analyses.planning.plan_figures import Panel, panel_figure

        samples, limits = self.samples, self.samples.limits
        names, panels = [cable.name for cable in self.robot.cables], []
        for label, values, bound in (
            ("cable speed [m/s]", samples.cable_speeds, limits.cable_speed),
            ("cable acceleration [m/s²]", samples.cable_accelerations, limits.cable_acceleration),
            ("motor torque [N m]", samples.torques, limits.torque),
        ):
            if np.all(np.isfinite(values)):  # torques are not, of motors without data
                near = bound <= 2.0 * float(np.max(np.abs(values)))
                curves = dict(zip(names, values.T, strict=True))
                panels.append(Panel(label, curves, (-bound, bound) if near else ()))
        title, size = self.titled("What the plan asks of winches"), (11.0, 1.2 + 3.0 * len(panels))
        return panel_figure(title, size, samples.times, panels, one_legend=True)

    def _path_figure(self) -> Figure:
        """Where the platform goes: the plan, and the simulated robot where it was tracked."""
        from cdpr_drake.analyses.visualization.path_figures import Path3D, path_figure

        way = self.motion.path
        assert way is not None
        points = way.points(np.linspace(0.0, way.length, 400))
        paths, rows = [Path3D(points[:, 4:7], "Po of the plan", DESIRED)], points[:, :7]
        if self.tracked is not None:
            rows = self.tracked.log["X_WP"]
            paths.append(Path3D(rows[:, 4:], "Po of the simulated robot", PLATFORM))
        log = {"X_WP": rows, "slack": np.zeros((len(rows), len(self.robot.cables)))}
        title = self.titled("Path of the platform")
        return path_figure(title, self.robot, self.task.cables, log, paths)

    def write(self, folder: Folder) -> None:
        """Writes motion, stream and summary."""
        with folder.file(MOTION) as part:
            write_columns(part, self.columns())
        if self.stream is not None:
            self.stream.write(folder)
        folder.write_json(SUMMARY, self.as_dict())

    def pages(self) -> dict[str, Callable[[Path], object]]:
        """Writers of files that are drawn like figures, by name."""
        return {}


Planned = TypeVar("Planned", bound=Plan)


def finished(
    plan: Planned, results: Folder | None, *, track: bool | None, stream: float | None,
    stream_model: str | None, formats: Sequence[str], follow: Follow,
) -> Planned:  # fmt: skip
    """A plan that is tracked and streamed, if that is asked for, and written into a folder.

    Raises:
        CdprError: The simulated robot or the stream cannot follow the motion, or a file cannot be
            written.
        StoppedError: The work was asked to stop.
    """
    if track is None and results is not None:
        track = not plan.robot.motion_type().is_point
        if not track:
            follow.say("note: not tracked: computed torque moves bodies alone")
    tracked = None
    if track:
        end, words = plan.motion.end_time, f"Tracking the plan of {plan.robot.name}"
        follow.doing(words)
        tracked = track_plan(
            plan.robot, plan.solution, plan.limits,
            lambda now: follow.doing(f"{words}: {now:.0f} of {end:.0f} s"),
        )  # fmt: skip
    plan = replace(
        plan, tracked=tracked, folder=None if results is None else results.path,
        stream=None if stream is None else cable_stream(plan, stream, stream_model),
    )  # fmt: skip
    if results is not None:
        write_result(plan, results, formats, follow, plan.pages())
    return plan

"""A planned motion as cable lengths and motor angles over time, as drives follow them.

Lengths are unstrained: what a winch has to have let out for the cable to have the plan's tension at
the platform there, with its stretch and, by the model catenary, its sag. Drives go from one point
of the stream to the next at constant rate, while the platform goes on along its curve: the check
asks the cables' tensions between points, where a stream that is too coarse lets them go slack.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.planning.plan_tracking import MOMENT
from cdpr_drake.analyses.reporting.exported_logs import write_columns
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.arrays import Array
from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.cables.models import (
    CABLE_MODELS,
    CATENARY,
    ELASTIC,
    cable_derivatives,
    cable_state,
)
from cdpr_drake.errors import CdprError, PlanningError, accepted_names
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.path_task import PathTask, sample_motion
from cdpr_drake.trajectories.sampled_motion import TIME_COLUMN
from cdpr_drake.trajectories.timed_path import TimedPath

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODELS = (ELASTIC, CATENARY)
"""Cable models whose tension follows from their length."""

LENGTHS, ANGLES, CHECK = "lengths.csv", "motor_angles.csv", "stream.json"

RATES = (1.0, 10_000.0)
"""Least and largest rate of a stream [Hz]."""

BETWEEN = 4
"""Instants between two points at which tensions are asked."""

MOST_POINTS = 200_000

ROUNDS = 40
"""Steps of Newton for a sagging cable; six do, a cable that starts slack takes more."""

CLOSE = 1e-9
"""Of the tension, where they end."""

_POSE = 7


@dataclass(frozen=True, eq=False)
class StreamCheck:
    """Tensions along a stream, at its points and between them.

    Attributes:
        least: Least tension of each cable, shape (m,) [N].
        least_at: When each has it, shape (m,) [s].
        largest: Largest tension of each cable, shape (m,) [N].
        slack: Instants at which a cable is slack, for each cable, shape (m,).
        instants: Instants that were asked.
    """

    least: Array
    least_at: Array
    largest: Array
    slack: Array
    instants: int

    @property
    def keeps_taut(self) -> bool:
        """Whether no cable is slack anywhere."""
        return not np.any(self.slack)


@dataclass(frozen=True, eq=False, repr=False)
class CableStream(Result):
    """A motion as drives follow it.

    Attributes:
        robot: The robot.
        model: Name of the cable model.
        rate: Points a second; the last point is the end of the motion [Hz].
        times: Shape (k,) [s].
        lengths: Unstrained lengths from exit to anchor point, shape (k, m) [m].
        motor_angles: Zero at the home pose at rest, positive pays out, shape (k, m) [rad].
        zero_lengths: Unstrained lengths at the zero of the angles, shape (m,) [m].
        stretch: By how much cables are longer under load, shape (k, m) [m].
        check: Tensions that drives give which follow it.
    """

    robot: Robot
    model: str
    rate: float
    times: Array
    lengths: Array
    motor_angles: Array
    zero_lengths: Array
    stretch: Array
    check: StreamCheck

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        names = [cable.name for cable in self.robot.cables]
        check = self.check
        result: dict[str, Any] = finite(
            {
                "model": self.model,
                "rate_hz": self.rate,
                "points": len(self.times),
                "zero_lengths_m": dict(zip(names, self.zero_lengths.tolist(), strict=True)),
                "largest_stretch_mm": 1e3 * float(np.max(self.stretch)),
                "instants_checked": check.instants,
                "least_tension_n": dict(zip(names, check.least.tolist(), strict=True)),
                "least_tension_at_s": dict(zip(names, check.least_at.tolist(), strict=True)),
                "largest_tension_n": dict(zip(names, check.largest.tolist(), strict=True)),
                "slack_instants": dict(zip(names, check.slack.tolist(), strict=True)),
                "keeps_taut": check.keeps_taut,
            }
        )
        return result

    @property
    def verdict(self) -> str:
        """Whether it keeps cables taut, in words."""
        return "no cable goes slack" if self.check.keeps_taut else "CABLES GO SLACK"

    def tables(self) -> list[Table]:
        """Tensions of drives that follow it."""
        check = self.check
        rows = [
            (cable.name, f"{check.least[k]:.4g}", f"{check.least_at[k]:.4g}",
             f"{check.largest[k]:.4g}", str(check.slack[k]))
            for k, cable in enumerate(self.robot.cables)
        ]  # fmt: skip
        headings = ("cable", "least [N]", "at [s]", "largest [N]", "slack instants")
        return [Table(f"{self.robot.name}: tensions of the stream", headings, rows)]

    def lines(self) -> list[str]:
        """Its points, and whether it keeps cables taut."""
        k = int(np.argmin(self.check.least))
        return [
            f"stream of {len(self.times)} points at {self.rate:g} Hz, {self.model}: {self.verdict} "
            f"at points or between them; least tension {self.check.least[k]:.4g} N in "
            f"{self.robot.cables[k].name} at {self.check.least_at[k]:.4g} s"
        ]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Lengths and motor angles over time, and by how much lengths are below straight ways."""
        return {"stream": self._draw}

    def _draw(self) -> Figure:
        from cdpr_drake.analyses.visualization.cable_figures import draw_cables
        from cdpr_drake.analyses.visualization.figure_style import bare_figure, styled

        title = (
            f"{self.robot.name}: stream of {len(self.times)} points at {self.rate:g} Hz, "
            f"{self.model} cables\n{self.verdict}; angles are zero at the home pose at rest"
        )
        below = "stretch less sag" if CABLE_MODELS[self.model].sags else "stretch"
        shown: list[tuple[str, Any]] = [
            ("unstrained length [m]", self.lengths),
            ("motor angle [turns],\npositive pays out", self.motor_angles / (2.0 * np.pi)),
            (f"{below} [mm]", 1e3 * self.stretch),
        ]
        figure = bare_figure((11.0, 9.0), title)
        with styled():
            panels = figure.subplots(len(shown), 1, sharex=True)
            for panel, (label, values) in zip(panels, shown, strict=True):
                draw_cables(panel, self.robot, self.times, values)
                panel.set(ylabel=label)
                panel.margins(x=0.01)
            panels[0].legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
            panels[-1].set(xlabel="time [s]")
        return figure

    def write(self, folder: Folder) -> None:
        """Writes lengths, motor angles and what was checked."""
        names = [cable.name for cable in self.robot.cables]
        for file, values, unit in (
            (LENGTHS, self.lengths, "unstrained_length_m"),
            (ANGLES, self.motor_angles, "motor_angle_rad"),
        ):
            columns = {f"{name}_{unit}": values[:, k] for k, name in enumerate(names)}
            with folder.file(file) as part:
                write_columns(part, {TIME_COLUMN: self.times, **columns})
        folder.write_json(CHECK, self.as_dict())


class Planned(Protocol):
    """A motion of a robot with its cables, such as a `Plan`."""

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def task(self) -> PathTask:
        """The robot as it was planned with."""

    @property
    def motion(self) -> TimedPath:
        """The motion."""


def cable_stream(plan: Planned, rate: float, model: str | None = None) -> CableStream:
    """A planned motion as unstrained lengths and motor angles, and whether cables stay taut.

    Args:
        plan: The plan.
        rate: Points a second [Hz].
        model: A name of `MODELS`. Default: catenary if the robot file's cables sag, else elastic.

    Raises:
        PlanningError: The rate or the model is not accepted, the plan's tensions are none that a
            cable can have, or winches hold several cables.
    """
    robot = plan.robot
    if model is None:
        sags = robot.cable_model is not None and CABLE_MODELS[robot.cable_model].sags
        model = CATENARY if sags else ELASTIC
    if model not in MODELS:
        raise PlanningError(f"stream: model: found {model!r}; {accepted_names(model, MODELS)}")
    if not RATES[0] <= rate <= RATES[1]:
        raise PlanningError(
            f"stream: rate: found {rate:g} Hz; accepted: {RATES[0]:g} to {RATES[1]:g} Hz"
        )
    end = plan.motion.end_time
    if end * rate > MOST_POINTS:
        raise PlanningError(
            f"stream: found {end * rate:.0f} points; accepted: at most {MOST_POINTS}"
        )
    cables = plan.task.cables
    times = np.arange(int(end * rate + MOMENT) + 1) / rate
    if end > times[-1] + MOMENT:
        times = np.append(times, end)
    samples = sample_motion(plan.task, plan.motion, times)
    poses = [_pose(plan, t) for t in times]
    lengths = np.array(
        [
            _unstrained(cables, model, X, t, when)
            for X, t, when in zip(poses, samples.tensions, times, strict=True)
        ]
    )
    straight = np.array([cable_paths(X, cables).lengths for X in poses])
    zero = _zero_lengths(robot, cables, model, lengths[0])
    drum = robot.drum()
    return CableStream(
        robot, model, rate, times, lengths, np.asarray(drum.motor_angles(lengths - zero)), zero,
        straight - lengths, _checked(plan, cables, model, times, lengths),
    )  # fmt: skip


def _pose(plan: Planned, time: float) -> RigidTransform:
    return pose_from_row(np.asarray(plan.motion.motion(float(time)))[:_POSE])


def _zero_lengths(robot: Robot, cables: CableSet, model: str, first: Array) -> Array:
    """Unstrained lengths at rest at home; where nothing holds that, those of the first point."""
    try:
        return hold_robot(robot, robot.home.transform(), cables, model).unstrained_lengths
    except CdprError:
        return first


def _unstrained(cables: CableSet, model: str, X: RigidTransform, t: Array, when: float) -> Array:
    """Unstrained lengths at which cables have these tensions at the platform, shape (m,) [m]."""
    straight = cable_paths(X, cables).lengths
    l0 = unstrained_lengths(straight, t, cables.stiffness)
    if not CABLE_MODELS[model].sags:
        return l0
    for _ in range(ROUNDS):
        off = cable_state(cables, model, X, l0).tensions - t
        if np.all(np.abs(off) <= CLOSE * np.maximum(t, 1.0)):
            return l0
        slope = cable_derivatives(cables, model, X, l0).tensions_by_length
        step = np.clip(off / np.minimum(slope, -1e-6), -0.02 * straight, 0.02 * straight)
        l0 = l0 - step
    k = int(np.argmax(np.abs(off)))
    raise PlanningError(
        f"stream: at {when:.4g} s: found no length at which cable {k + 1} has {t[k]:.4g} N with "
        "its weight; accepted: tensions that carry the cable, by --limits"
    )


def _checked(
    plan: Planned, cables: CableSet, model: str, times: Array, lengths: Array
) -> StreamCheck:
    share = np.arange(BETWEEN + 1) / (BETWEEN + 1)
    instants = (times[:-1, None] + share * np.diff(times)[:, None]).ravel()
    instants = np.append(instants, times[-1])
    between = np.column_stack([np.interp(instants, times, column) for column in lengths.T])
    states = [
        cable_state(cables, model, _pose(plan, t), l0)
        for t, l0 in zip(instants, between, strict=True)
    ]
    tensions = np.array([state.tensions for state in states])
    return StreamCheck(
        tensions.min(axis=0), instants[np.argmin(tensions, axis=0)], tensions.max(axis=0),
        np.sum([state.slack for state in states], axis=0), len(instants),
    )  # fmt: skip

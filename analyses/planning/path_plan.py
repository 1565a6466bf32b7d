"""The fastest motion of a robot along a path, within limits of tensions and winches."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter, Token

from cdpr_drake.analyses.frame.folder import results_folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    Limits,
    OutFolder,
    RobotWord,
    Switch,
    Word,
    one_of,
    poses,
    value_of,
    with_word,
    words,
)
from cdpr_drake.analyses.planning.path_files import path_poses
from cdpr_drake.analyses.planning.plans import Plan, finished
from cdpr_drake.analyses.planning.robot_path_task import (
    CORNERS,
    RESERVE,
    TOLERANCE,
    make_path,
    path_task,
    pose_in_degrees,
    robot_limits,
)
from cdpr_drake.cables.models import CATENARY, ELASTIC
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.palette import BOUND, DESIRED, DISTANCE, IDEAL
from cdpr_drake.planning.margin_kernel import TENSION_USE
from cdpr_drake.planning.path_task import pose_words, sample_motion
from cdpr_drake.planning.path_timing import STATIONS, PathPlan, plan_along_path
from cdpr_drake.planning.resistance import CornerMargins, resisted_along, wrench_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRACKING = "computed torque, which tracking needs"

ALONG = "way s along the path [m], turns by the length scale"  # label of axes


def _waypoints(word: str) -> list[Any]:
    result = poses(word)
    if len(result) < 2:
        raise ValueError(word)
    return result


_WAYPOINTS = words(
    with_word(_waypoints), "at least two poses x,y,z or x,y,z,phi,theta,psi [m, deg] with ; "
    "between them", "POSES",
)  # fmt: skip


def _path(kind: Any, tokens: Sequence[Token]) -> Any:
    """A file behind --path, poses behind --waypoints."""
    if tokens[0].keyword == "--waypoints":
        return _WAYPOINTS.converter(kind, tokens)  # type: ignore[misc, operator]
    return Path(tokens[0].value)


PathWord = Annotated[
    Any,
    Parameter(name=("--path", "--waypoints"), converter=_path, n_tokens=1, metavar="FILE|POSES"),
]
StreamModel = Annotated[str | None, one_of((ELASTIC, CATENARY))]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PathMotion(Plan):
    """The fastest motion along a path.

    Attributes:
        solution: The motion.
        source: What the path is, in words.
    """

    solution: PathPlan
    source: str

    @property
    def title(self) -> str:
        """What it is, in words for titles."""
        name, duration = f"{self.robot.name}, {self.geometry}", self.solution.duration
        return f"{name}: time-optimal along {self.source}, {duration:.4g} s"

    @cached_property
    def resisted(self) -> CornerMargins | None:
        """How well it resists each of the wrenches that it must, at its stations; None: none."""
        return resisted_along(self.task, self.motion) if len(self.task.resist) else None

    def details(self) -> dict[str, Any]:
        """Duration, path, and wrenches that are resisted."""
        plan = self.solution
        return {
            "duration_s": plan.duration,
            "path_length_m": plan.path.length,
            "stations": len(plan.trajectory.stations),
            "rests": len(plan.path.rests),
            **({} if self.resisted is None else {"resist": self._resist(self.resisted)}),
        }

    def _resist(self, margins: CornerMargins) -> dict[str, Any]:
        shares = self.samples.resisted
        assert shares is not None
        between = int(np.argmax(shares))
        corners = [
            {"wrench_n_m_n": corner.tolist(), "least_margin": float(margin), "at_s_m": float(s)}
            for corner, margin, s in zip(
                margins.corners, margins.margins, margins.parameters, strict=True
            )
        ]
        row = self.solution.path.points(margins.parameters[[margins.worst]])[0]
        return {
            "corners": corners,
            "worst": corners[margins.worst] | {"pose": pose_words(row)},
            "largest_share_between_stations": float(shares[between]),
            "at_s_m": float(self.samples.parameters[between]),
        }

    def description(self) -> list[str]:
        """Duration and path, and the wrench that is resisted with the least margin."""
        plan, margins = self.solution, self.resisted
        lines = [
            f"{plan.duration:.4f} s along {plan.path.length:.4g} m, planned at "
            f"{len(plan.trajectory.stations)} stations"
        ]
        if margins is not None:
            k = margins.worst
            lines.append(
                f"resists {len(margins.corners)} wrenches; the least margin, "
                f"{margins.margins[k]:.4f} of half the range, has "
                f"{wrench_words(margins.corners[k])} at s = {margins.parameters[k]:.4g} m"
            )
        return lines

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The phase plane first: speed along the path with its limits."""
        figures = {"phase_plane": self._phase_figure, **super().figures()}
        return figures | ({} if self.resisted is None else {"resistance": self._resistance_figure})

    def _phase_figure(self) -> Figure:
        """Speed along the path below the largest speeds, and which limits are reached where."""
        from cdpr_drake.analyses.frame.figures import COVERED_LINE, line_style
        from cdpr_drake.analyses.planning.plan_figures import reached_figure

        solution, samples = self.solution, self.samples
        stations, top = solution.trajectory.stations, np.sqrt(solution.largest)

        def draw(axes: Any) -> None:
            axes.plot(
                stations, np.sqrt(solution.reachable[:, 1]),
                label="largest from which the end can be reached",
                **COVERED_LINE | {"color": DESIRED.color, "marker": ""},
            )  # fmt: skip
            axes.plot(stations, top, label="largest at this point by itself", **line_style(BOUND))
            axes.plot(samples.parameters, samples.speeds, label="plan", **line_style(DISTANCE))
            most = float(np.max(samples.speeds))
            axes.set_ylim(0.0, min(float(np.nanmax(top, initial=most)), 2.5 * most) * 1.05)
            axes.set(ylabel="ds/dt [m/s]")
            axes.legend(loc="lower center")

        title = self.titled("Speed along the path, and the limits that it reaches")
        return reached_figure(title, self.robot, samples, samples.parameters, ALONG, 4.6, draw)

    def _resistance_figure(self) -> Figure:
        """What the motion leaves of tensions and torques, alone and under wrenches to resist."""
        from cdpr_drake.analyses.frame.figures import line_style, new_figure, styled

        margins, samples = self.resisted, self.samples
        assert margins is not None
        assert samples.resisted is not None
        s, k = samples.parameters, margins.worst
        free = replace(self.task, resist=np.empty((0, 6)))
        alone = sample_motion(free, self.motion, samples.times).uses[:, TENSION_USE]
        mark: dict[str, Any] = {"color": "black", "linestyle": "none"}
        title = self.titled("What is left under the wrenches to resist")
        figure, axes = new_figure(1, 1, (11.0, 4.6), title)
        with styled():
            axes.plot(s, 1.0 - alone, label="motion alone", **line_style(IDEAL))
            label = f"with the worst of {len(margins.corners)} wrenches at each point"
            axes.plot(s, 1.0 - samples.resisted, label=label, **line_style(DISTANCE))
            axes.plot(
                margins.parameters, margins.margins, marker="o", markersize=4.0,
                markerfacecolor="none", label="each wrench where it is worst", **mark,
            )  # fmt: skip
            axes.plot(
                margins.parameters[k], margins.margins[k], marker="D",
                label=f"the worst: {wrench_words(margins.corners[k])}", **mark,
            )  # fmt: skip
            axes.axhline(0.0, label="limit", **line_style(BOUND))
            axes.set(xlabel=ALONG, ylabel="margin, share of half the range [-]")
            axes.margins(x=0.01)
            axes.legend(loc="best")
        return figure


@verb()
def plan_path(
    robot: RobotWord, path: PathWord, *, limits: Limits = None, cable_speed: float | None = None,
    cable_acceleration: float | None = None, speed: float | None = None, reserve: float = RESERVE,
    feeds: bool = True, corners: Annotated[str, one_of(CORNERS)] = "smooth",
    tolerance: float = TOLERANCE, stations: int = STATIONS, pulleys: bool = True,
    resist: InputFile = None, track: bool | None = None, stream: float | None = None,
    stream_model: StreamModel = None, folder: OutFolder = None, overwrite: Switch = False,
    formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> PathMotion:  # fmt: skip
    """Plans the fastest motion along a path within limits of tensions and winches.

    Scenarios of dynamic control track the motion by `trajectory.file`.

    Args:
        robot: Robot by name or file.
        path: Path through poses: a file, .csv of x,y,z or x,y,z,phi,theta,psi [m, deg], or G-code
            (lines, arcs, feeds), or the poses themselves, at least two, with ; between them.
        limits: Smallest and largest tension [N]; default: the robot's.
        cable_speed: Largest cable speed [m/s]; default: at the motors' rated speed.
        cable_acceleration: Largest cable acceleration [m/s^2]; default: no limit.
        speed: Largest speed of Po [m/s]; default: no limit.
        reserve: Share of every limit that is left for feedback.
        feeds: Take feed rates of G-code as largest speeds of Po.
        corners: At the poses: smooth (a spline), blend (lines, corners rounded) or rest (lines, a
            rest in each corner).
        tolerance: Largest distance of rounded corners from a pose [m].
        stations: Number of points of the path at which limits are checked.
        pulleys: Take the robot's pulleys into account; without them cables run from fixed exit
            points.
        resist: Wrenches on the platform that must be resisted all along the path [N m, N], YAML as
            of cdpr workspace --wrench-set: vertices, a box.
        track: Also have the simulated robot track the plan at 1 kHz; default: if results are kept,
            bodies do, point masses do not.
        stream: Also compute unstrained cable lengths and motor angles at so many points a second
            [Hz]: lengths.csv, motor_angles.csv, and stream.json, which says whether cables stay
            taut between points.
        stream_model: Cables of the stream: elastic, stretched by their tension, or catenary, which
            sag, too. Default: catenary if the robot file's cables sag.
        folder: Results folder, with motion.csv, summary.json and figures; default: plans/ROBOT, or
            ROBOT-2, ...; in Python nothing is kept.
        overwrite: Replace earlier results in the folder.
        formats: Formats of the figures in the folder.
        follow: Who follows the work.

    Raises:
        PlanningError: No motion keeps the limits, or an argument is not accepted; names the place
            and the cable.
        CdprError: A file cannot be read, or the robot or the path is not accepted.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = as_robot(robot, "plan_path")
    if track:
        loaded.servo_rows(TRACKING)  # a refusal comes before the work
    bounds = robot_limits(
        loaded, limits, cable_speed=cable_speed, cable_acceleration=cable_acceleration, speed=speed
    )
    cables = loaded.cable_set(pulleys)
    task = path_task(loaded, bounds, cables, reserve=reserve, resist=resist)
    route = path_poses(loaded, value_of(path))
    for remark in route.remarks:
        follow.say(f"note: {path}: {remark}")
    moves = route.moves if feeds else tuple(replace(move, speed=np.inf) for move in route.moves)
    way = make_path(loaded, route.poses, corners, tolerance, moves)
    is_file = isinstance(path, Path | str) and not isinstance(path, Word)
    rows = path if isinstance(path, Word) else [pose_in_degrees(X) for X in route.poses]
    arguments: dict[str, Any] = {
        "limits_n": limits, "cable_speed_m_s": cable_speed,
        "cable_acceleration_m_s2": cable_acceleration, "speed_m_s": speed, "reserve": reserve,
        "pulleys": pulleys, "path": str(path) if is_file else None,
        "waypoints": None if is_file else rows, "corners": corners, "tolerance_m": tolerance,
        "stations": stations,
    }  # fmt: skip
    if moves:
        feed_rates = [move.speed for move in moves if np.isfinite(move.speed)]
        arguments |= {
            "feeds": feeds, "arcs": sum(move.arc is not None for move in moves),
            "feed_range_m_s": [min(feed_rates), max(feed_rates)] if feed_rates else None,
        }  # fmt: skip
    if resist is not None:
        of_file = isinstance(resist, Path | str)
        arguments["resist"] = str(resist) if of_file else task.resist.tolist()
    name = f"plans/{loaded.name}"
    with results_folder(name, arguments, folder, overwrite, follow.results) as results:
        follow.doing(f"Planning for {loaded.name}")
        begin = time.perf_counter()
        solution = plan_along_path(task, way, stations)
        plan = PathMotion(
            robot=loaded, limits=bounds, arguments=arguments, solution=solution,
            planning_time=time.perf_counter() - begin, source=route.source,
        )  # fmt: skip
        return finished(
            plan, results, track=track, stream=stream, stream_model=stream_model, formats=formats,
            follow=follow,
        )  # fmt: skip

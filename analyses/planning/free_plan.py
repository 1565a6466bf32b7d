"""A motion of a robot from one pose to another whose path is free, within limits."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.folder import results_folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    Formats,
    InputFile,
    Limits,
    OutFolder,
    RobotWord,
    Switch,
    Word,
    numbers,
    one_of,
    pose,
    value_of,
    with_word,
    words,
)
from cdpr_drake.analyses.planning.free_motion import (
    LEAST,
    NEAREST,
    FreeSettings,
    camera_view,
    solve_free_motion,
)
from cdpr_drake.analyses.planning.path_plan import StreamModel
from cdpr_drake.analyses.planning.plans import Plan, finished, reached_rows
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    pose_in_degrees,
    robot_task,
)
from cdpr_drake.analyses.visualization.curves import draw_bars, draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.analyses.visualization.figure_style import bare_figure, line_style, styled
from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.palette import BOUND, nth_look
from cdpr_drake.planning.free_path import KNOTS
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.trajectories.sampled_motion import read_motion
from cdpr_drake.workspaces.cable_interference import PART_NAMES, Surroundings, box_row, clearances

USES = ("tensions and torques", "cable speeds", "cable accelerations", "speed of Po")
"""Columns of `MotionSamples.uses`."""

LOOKS = 200
"""Instants at which distances and the view are checked, from start to goal."""

TOLERANCE = 2e-5
"""A distance that is missed by less is kept [m]: plans refine to about half of it."""


def points(word: str) -> Array:
    """Points of x,y,z with ; between them, shape (3, p) [m]."""
    return np.array([numbers(3)(part) for part in word.split(";")]).T


_POSE = with_word(pose), "x,y,z [m] or x,y,z,phi,theta,psi [m, deg]", "X,Y,Z[,PHI,THETA,PSI]"
Start = Annotated[Any, words(*_POSE, name="--from")]
Goal = Annotated[Any, words(*_POSE, name="--to")]
Points = Annotated[
    Any, words(with_word(points), "points x,y,z [m], with ; between", "POINTS",
               name="--keep-in-view"),
]  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class FreeMotion(Plan):
    """A motion whose path was free.

    Attributes:
        solution: What the program found.
        settings: What was asked of the motion.
    """

    solution: FreePathSolution
    settings: FreeSettings

    @property
    def title(self) -> str:
        """What it is, in words for titles."""
        name, least = f"{self.robot.name}, {self.geometry}", self.settings.least
        return f"{name}: free path, least {least}, {self.solution.duration:.4g} s"

    @cached_property
    def looks(self) -> Array:
        """Instants of `distances` and `view`, shape (n,) [s]."""
        return np.linspace(0.0, self.motion.end_time, LOOKS + 1)

    @cached_property
    def distances(self) -> dict[str, Array]:
        """Of cables from each other, and of cables and platform from obstacles, shape (n,) [m].

        They are distances of surfaces, between the knots, too; obstacles and platform are their
        boxes. Empty if no clearance is asked for.
        """
        if self.settings.clearance is None:
            return {}
        obstacles = self.settings.solids()
        body = box_row(self.robot.box_center(), self.robot.platform.size)
        around = Surroundings(
            self.task.cables, self.robot.diameters() / 2.0, body[np.newaxis],
            obstacles=obstacles.boxes, solids=obstacles.solids,
        )  # fmt: skip
        poses = [self.motion.pose(t) for t in self.looks]
        distances = clearances(
            around,
            np.array([X.translation() for X in poses]),
            np.array([X.rotation().matrix() for X in poses]),
        )
        names = ["cable-cable"] + ["cable-obstacle", "platform"] * bool(obstacles.shapes())
        return {name: distances[:, PART_NAMES.index(name)] for name in names}

    @cached_property
    def view(self) -> dict[str, Array]:
        """Of each point that shall stay in view: how far inside it is, shape (n,) [-].

        The view's tangent less the point's, over the view's: 1 in the middle, 0 at an edge; below
        0 also if the point is nearer than asked. Empty if no point shall stay in view.
        """
        if self.settings.in_view is None:
            return {}
        view = camera_view(self.robot, self.settings.camera)
        cameras = [(self.motion.pose(t) @ view.X_PC).inverse() for t in self.looks]
        shares = {}
        for number, point in enumerate(self.settings.in_view.T, 1):
            p = np.array([X @ point for X in cameras])
            inside = 1.0 - np.max(np.abs(p[:, :2]) / np.array(view.slopes) / p[:, 2:], axis=1)
            near = p[:, 2] < self.settings.nearest - TOLERANCE
            shares[f"point {number}"] = np.where(near, np.minimum(inside, -1.0), inside)
        return shares

    def keeps_asked(self) -> bool:
        """True if distances and view are as asked between the knots, too."""
        least = (self.settings.clearance or 0.0) - TOLERANCE if self.distances else 0.0
        apart = all(np.min(values) >= least for values in self.distances.values())
        return apart and all(np.min(values) >= -TOLERANCE for values in self.view.values())

    def details(self) -> dict[str, Any]:
        """Duration, cost, solver, and what is missed between knots."""
        solution = self.solution
        return {
            "duration_s": solution.duration,
            "least": self.settings.least,
            "cost": solution.cost,
            "solver": solution.solver,
            "status": solution.status,
            "knots": len(solution.times),
            "planning_time_s": self.planning_time,
            "violations": dict(solution.violations),
            "between_knots": {
                name: {
                    "missed": missed.missed,
                    "missed_at_most": missed.bound,
                    "of": missed.who,
                    "at_time_s": missed.where * solution.duration,
                }
                for name, missed in solution.between.items()
            },
            "least_distances_m": {k: float(np.min(a)) for k, a in self.distances.items()},
            "least_share_of_view": {k: float(np.min(a)) for k, a in self.view.items()},
            "keeps_distances_and_view": self.keeps_asked(),
        }

    def description(self) -> list[str]:
        """Duration and solver, distances, view, and what is missed between knots."""
        solution = self.solution
        lines = [
            f"{solution.duration:.4f} s with the least {self.settings.least}, by "
            f"{solution.solver} at {len(solution.times)} knots"
        ]
        for name, distances in self.distances.items():
            lines.append(f"least distance, {name}: {1e3 * np.min(distances):.2f} mm")
        for name, shares in self.view.items():
            lines.append(f"{name}: {np.min(shares):.1%} of the view inside its edge")
        for name, missed in solution.between.items():
            if missed.missed > 0.0:
                most = missed.bound
                finite = most is not None and np.isfinite(most)
                bound = f", nowhere by more than {most:.3g}" if finite else ""
                lines.append(
                    f"between knots: {name} missed by {missed.missed:.3g} ({missed.who}) at "
                    f"{missed.where * solution.duration:.3f} s{bound}"
                )
        if not self.keeps_asked():
            lines.append("BETWEEN KNOTS DISTANCES OR VIEW ARE MISSED; plan with more knots")
        return lines

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Shares of limits over time first; distances and view if they are asked for."""
        figures: dict[str, Callable[[], Figure]] = {
            "limits": partial(limits_figure, self),
            **super().figures(),
        }
        if self.distances or self.view:
            figures["distances"] = partial(distance_figure, self)
        return figures


@verb()
def plan_free_motion(
    robot: RobotWord, start: Start, goal: Goal, *,
    least: Annotated[str | None, one_of(LEAST)] = None, duration: float | None = None,
    clearance: float | None = None, obstacles: InputFile = None, in_view: Points = None,
    camera: str | None = None, nearest: float | None = None, knots: int | None = None,
    guess: InputFile = None, limits: Limits = None, cable_speed: float | None = None,
    cable_acceleration: float | None = None, speed: float | None = None, reserve: float = RESERVE,
    pulleys: bool = True, track: bool | None = None, stream: float | None = None,
    stream_model: StreamModel = None, folder: OutFolder = None, overwrite: Switch = False,
    formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> FreeMotion:  # fmt: skip
    """Plans a motion from one pose to another whose path is free, within limits.

    Limits of tensions and winches are kept at knots, cable speeds also halfway between, distances
    and the view everywhere. The motion is the best nearby, not of all.

    Args:
        robot: Robot by name or file.
        start: Pose X_WP at the start [m, deg].
        goal: Pose X_WP at the end [m, deg].
        least: time, tension (mean square, needs a duration) or energy (that over the time);
            default: time.
        duration: Time that the motion takes [s].
        clearance: Least distance of cables from each other, and of cables and platform from
            obstacles [m].
        obstacles: What stands in the way, YAML as of cdpr workspace --obstacles; in Python also
            `Obstacles`, or rows of boxes, shape (o, 15).
        in_view: Points x,y,z of W [m], with ; between them, that the camera on the platform sees
            all along; in Python shape (3, p).
        camera: Mounting of that camera; default: the only one.
        nearest: Least depth of the points in the camera [m]; default: 0.1.
        knots: Number of instants at which limits are checked.
        guess: File motion.csv of another plan between the same poses, such as a proven one, from
            which the solver starts; in Python also a path or motion.
        limits, cable_speed, cable_acceleration, speed, reserve, pulleys: As of `plan_path`.
        track, stream, stream_model, folder, overwrite, formats, follow: As of `plan_path`.

    Raises:
        PlanningError: No motion was found, or an argument is not accepted.
        CdprError: A file cannot be read, or the robot is not accepted.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    if in_view is None and (camera is not None or nearest is not None):
        name = "nearest" if camera is None else "camera"
        raise PlanningError(f"{name}: found without in_view; accepted: with in_view")
    loaded = as_robot(robot, "plan_free_motion")
    limit_settings = LimitSettings(
        tensions=limits, cable_speed=cable_speed, cable_acceleration=cable_acceleration,
        speed=speed, reserve=reserve,
    )  # fmt: skip
    X_start, X_goal = (as_pose(loaded, value_of(pose)) for pose in (start, goal))
    settings = FreeSettings(
        start=X_start, goal=X_goal, least=least or "time", duration=duration,
        knots=KNOTS if knots is None else knots, clearance=clearance,
        obstacles=load_obstacles(Path(obstacles)) if _is_file(obstacles) else obstacles,
        in_view=value_of(in_view), camera=camera, nearest=NEAREST if nearest is None else nearest,
        guess=read_motion(Path(guess)) if _is_file(guess) else guess,
    )  # fmt: skip
    task = robot_task(loaded, limit_settings, pulleys)
    arguments = limit_settings.as_dict(pulleys) | {
        "from": start if isinstance(start, Word) else pose_in_degrees(X_start),
        "to": goal if isinstance(goal, Word) else pose_in_degrees(X_goal),
        "least": least, "duration": duration, "clearance": clearance, "camera": camera,
        "nearest": nearest, "knots": knots,
        "keep_in_view": np.asarray(in_view).tolist()
        if in_view is not None and not isinstance(in_view, Word) else in_view,
        "obstacles": str(obstacles) if _is_file(obstacles) else (
            None if obstacles is None else settings.solids().boxes.tolist()
        ),
        "guess": str(guess) if _is_file(guess) else None if guess is None else "given",
    }  # fmt: skip
    name = f"plans/{loaded.name}"
    with results_folder(name, arguments, folder, overwrite, follow.results) as results:
        follow.doing(f"Planning for {loaded.name}")
        begin = time.perf_counter()
        solution = solve_free_motion(loaded, task, settings, follow.doing)
        plan = FreeMotion(
            robot=loaded, limits=task.limits, arguments=arguments, solution=solution,
            planning_time=time.perf_counter() - begin, settings=settings,
        )  # fmt: skip
        return finished(
            plan, limit_settings, results, track=track, stream=stream, stream_model=stream_model,
            formats=formats, follow=follow,
        )  # fmt: skip


def _is_file(value: object) -> bool:
    return isinstance(value, str | Path)


def limits_figure(plan: FreeMotion) -> Figure:
    """Which share of its limits a motion uses over time, and which limits it reaches when."""
    samples, limits = plan.samples, plan.task.limits
    rows = reached_rows(plan.robot, samples)
    height = 0.8 + 0.24 * max(len(rows), 1)
    title = f"Shares of limits, and the limits that are reached\n{plan.title}"
    figure = bare_figure((11.0, 5.0 + height), title)
    bounds = (1.0, 1.0, limits.cable_acceleration, limits.speed)
    shown = [k for k, bound in enumerate(bounds) if np.isfinite(bound)]
    with styled():
        axes, bars = figure.subplots(2, 1, sharex=True, height_ratios=(4.0, height))
        for number, k in enumerate(shown):
            draw_curve(
                axes, samples.times, samples.uses[:, k], nth_look(number), USES[k],
                phase=phase_of(number, len(shown)),
            )  # fmt: skip
        axes.axhline(1.0, label="limit of the plan", **line_style(BOUND))
        _mark_knots(axes, plan.solution.times)
        axes.set(ylabel="share of the limit [-]", ylim=(0.0, None))
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        draw_bars(bars, samples.times, rows)
        bars.set(xlabel="time [s]", ylabel="limit reached")
        axes.margins(x=0.01)
    return figure


def distance_figure(plan: FreeMotion) -> Figure:
    """Distances and view over time, with what was asked."""
    kinds: list[tuple[dict[str, Array], str, float]] = []
    if plan.distances:
        kinds.append((plan.distances, "distance [m]", plan.settings.clearance or 0.0))
    if plan.view:
        kinds.append((plan.view, "within the view [-], 0 at its edge", 0.0))
    figure = bare_figure((10.0, 1.2 + 3.4 * len(kinds)), f"What the motion stays off\n{plan.title}")
    with styled():
        places: Any = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
        for place, (curves, label, least) in zip(places, kinds, strict=True):
            for k, (name, values) in enumerate(curves.items()):
                draw_curve(
                    place, plan.looks, values, nth_look(k), name, phase=phase_of(k, len(curves))
                )
            place.axhline(least, label="asked for", **line_style(BOUND))
            _mark_knots(place, plan.solution.times)
            place.set(ylabel=label)
            place.margins(x=0.01)
            place.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        places[-1].set(xlabel="time [s]")
    return figure


def _mark_knots(axes: Any, times: Array) -> None:
    """Ticks of the knots, at which the program asks, on the lower edge."""
    axes.plot(
        times, np.zeros(len(times)), "|", transform=axes.get_xaxis_transform(), markersize=10.0,
        color=BOUND.color, clip_on=False, label="knots",
    )  # fmt: skip

"""A motion of a robot from one pose to another whose path is free, within limits."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

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
    View,
    camera_view,
    solve_free_motion,
)
from cdpr_drake.analyses.planning.path_plan import StreamModel
from cdpr_drake.analyses.planning.plans import Plan, finished
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    path_task,
    pose_in_degrees,
    robot_limits,
)
from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.planning.free_path import KNOTS
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.trajectories.sampled_motion import read_motion
from cdpr_drake.workspaces.cable_interference import (
    PART_NAMES,
    Obstacles,
    Surroundings,
    box_row,
    clearances,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

USES = ("tensions and torques", "cable speeds", "cable accelerations", "speed of Po")
"""Columns of `MotionSamples.uses`."""

LOOKS = 200  # instants at which distances and the view are checked, from start to goal
TOLERANCE = 2e-5  # a distance that is missed by less is kept [m]: plans refine to about half of it


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
        least: What it has least of.
        clearance: Least distance of cables and platform; None: not asked for [m].
        obstacles: What stands in the way.
        view: What the camera on the platform shall see; None: nothing.
    """

    solution: FreePathSolution
    least: str
    clearance: float | None
    obstacles: Obstacles
    view: View | None

    @property
    def title(self) -> str:
        """What it is, in words for titles."""
        name, duration = f"{self.robot.name}, {self.geometry}", self.solution.duration
        return f"{name}: free path, least {self.least}, {duration:.4g} s"

    @cached_property
    def looks(self) -> Array:
        """Instants of `distances` and `view_shares`, shape (n,) [s]."""
        return np.linspace(0.0, self.motion.end_time, LOOKS + 1)

    @cached_property
    def distances(self) -> dict[str, Array]:
        """Of cables from each other, and of cables and platform from obstacles, shape (n,) [m].

        They are distances of surfaces, between the knots, too; obstacles and platform are their
        boxes. Empty if no clearance is asked for.
        """
        if self.clearance is None:
            return {}
        body = box_row(self.robot.box_center(), self.robot.platform.size)
        around = Surroundings(
            self.task.cables, self.robot.diameters() / 2.0, body[np.newaxis],
            obstacles=self.obstacles.boxes, solids=self.obstacles.solids,
        )  # fmt: skip
        poses = [self.motion.pose(t) for t in self.looks]
        distances = clearances(
            around,
            np.array([X.translation() for X in poses]),
            np.array([X.rotation().matrix() for X in poses]),
        )
        names = ["cable-cable"] + ["cable-obstacle", "platform"] * bool(self.obstacles.shapes())
        return {name: distances[:, PART_NAMES.index(name)] for name in names}

    @cached_property
    def view_shares(self) -> dict[str, Array]:
        """Of each point that shall stay in view: how far inside it is, shape (n,) [-].

        The view's tangent less the point's, over the view's: 1 in the middle, 0 at an edge; below
        0 also if the point is nearer than asked. Empty if no point shall stay in view.
        """
        view, shares = self.view, dict[str, Array]()
        if view is None:
            return shares
        cameras = [(self.motion.pose(t) @ view.X_PC).inverse() for t in self.looks]
        for number, point in enumerate(view.points.T, 1):
            p = np.array([X @ point for X in cameras])
            inside = 1.0 - np.max(np.abs(p[:, :2]) / np.array(view.slopes) / p[:, 2:], axis=1)
            near = p[:, 2] < view.nearest - TOLERANCE
            shares[f"point {number}"] = np.where(near, np.minimum(inside, -1.0), inside)
        return shares

    def keeps_asked(self) -> bool:
        """True if distances and view are as asked between the knots, too."""
        least = (self.clearance or 0.0) - TOLERANCE
        apart = all(np.min(values) >= least for values in self.distances.values())
        return apart and all(np.min(values) >= -TOLERANCE for values in self.view_shares.values())

    def details(self) -> dict[str, Any]:
        """Duration, cost, solver, and what is missed between knots."""
        solution = self.solution
        return {
            "duration_s": solution.duration,
            "least": self.least,
            "cost": solution.cost,
            "solver": solution.solver,
            "status": solution.status,
            "knots": len(solution.times),
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
            "least_share_of_view": {k: float(np.min(a)) for k, a in self.view_shares.items()},
            "keeps_distances_and_view": self.keeps_asked(),
        }

    def description(self) -> list[str]:
        """Duration and solver, distances, view, and what is missed between knots."""
        solution = self.solution
        lines = [
            f"{solution.duration:.4f} s with the least {self.least}, by "
            f"{solution.solver} at {len(solution.times)} knots"
        ]
        for name, distances in self.distances.items():
            lines.append(f"least distance, {name}: {1e3 * np.min(distances):.2f} mm")
        for name, shares in self.view_shares.items():
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
        figures = {"limits": self._limits_figure, **super().figures()}
        if self.distances or self.view_shares:
            figures["distances"] = self._distance_figure
        return figures

    def _limits_figure(self) -> Figure:
        """Which share of its limits it uses over time, and which limits it reaches when."""
        from cdpr_drake.analyses.planning.plan_figures import Panel, reached_figure

        samples, limits = self.samples, self.task.limits
        bounds = (1.0, 1.0, limits.cable_acceleration, limits.speed)
        curves = {
            name: values
            for name, values, bound in zip(USES, samples.uses.T, bounds, strict=True)
            if np.isfinite(bound)
        }
        label, knots = "share of the limit [-]", self.solution.times
        panel = Panel(label, curves, (1.0,), "limit of the plan", knots)

        def draw(axes: Any) -> None:
            panel.draw(axes, samples.times)
            axes.set_ylim(0.0, None)

        title = self.titled("Shares of limits, and the limits that are reached")
        return reached_figure(title, self.robot, samples, samples.times, "time [s]", 4.0, draw)

    def _distance_figure(self) -> Figure:
        """Distances and view over time, with what was asked."""
        from cdpr_drake.analyses.planning.plan_figures import Panel, panel_figure

        panels = [
            Panel(label, curves, (least,), "asked for", self.solution.times)
            for curves, label, least in (
                (self.distances, "distance [m]", self.clearance or 0.0),
                (self.view_shares, "within the view [-], 0 at its edge", 0.0),
            )
            if curves
        ]
        size = (10.0, 1.2 + 3.4 * len(panels))
        return panel_figure(self.titled("What the motion stays off"), size, self.looks, panels)


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
        limits: Smallest and largest tension [N]; default: the robot's.
        cable_speed: Largest cable speed [m/s]; default: at the motors' rated speed.
        cable_acceleration: Largest cable acceleration [m/s^2]; default: no limit.
        speed: Largest speed of Po [m/s]; default: no limit.
        reserve: Share of every limit that is left for feedback.
        pulleys: Take the robot's pulleys into account.
        track: Also have the simulated robot track the plan at 1 kHz; default: if results are kept.
        stream: Also compute cable lengths and motor angles at so many points a second [Hz].
        stream_model: Cables of the stream: elastic or catenary; default: as the robot's sag.
        folder: Results folder; default: plans/ROBOT, or ROBOT-2, ...; in Python nothing is kept.
        overwrite: Replace earlier results in the folder.
        formats: Formats of the figures in the folder.
        follow: Who follows the work.

    Raises:
        PlanningError: No motion was found, or an argument is not accepted.
        CdprError: A file cannot be read, or the robot is not accepted.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    if in_view is None and (camera is not None or nearest is not None):
        name = "nearest" if camera is None else "camera"
        raise PlanningError(f"{name}: found without in_view; accepted: with in_view")
    loaded = as_robot(robot, "plan_free_motion")
    X_start, X_goal = (as_pose(loaded, value_of(pose)) for pose in (start, goal))
    bounds = robot_limits(
        loaded, limits, cable_speed=cable_speed, cable_acceleration=cable_acceleration, speed=speed
    )
    task = path_task(loaded, bounds, loaded.cable_set(pulleys), reserve=reserve)
    solids, way, view = obstacles, guess, None
    if obstacles is not None and not isinstance(obstacles, Obstacles):
        rows = None if _is_file(obstacles) else np.asarray(obstacles)
        solids = load_obstacles(Path(obstacles)) if rows is None else Obstacles(rows)
    if _is_file(guess):
        way = read_motion(Path(guess))
    if in_view is not None:
        depth = NEAREST if nearest is None else nearest
        view = camera_view(loaded, camera, np.asarray(value_of(in_view)), depth)
    arguments = {
        "limits_n": limits, "cable_speed_m_s": cable_speed,
        "cable_acceleration_m_s2": cable_acceleration, "speed_m_s": speed, "reserve": reserve,
        "pulleys": pulleys,
        "from": start if isinstance(start, Word) else pose_in_degrees(X_start),
        "to": goal if isinstance(goal, Word) else pose_in_degrees(X_goal),
        "least": least, "duration": duration, "clearance": clearance, "camera": camera,
        "nearest": nearest, "knots": knots,
        "keep_in_view": in_view if isinstance(in_view, Word) or view is None
        else view.points.tolist(),
        "obstacles": str(obstacles) if _is_file(obstacles)
        else None if solids is None else solids.boxes.tolist(),
        "guess": str(guess) if _is_file(guess) else None if guess is None else "given",
    }  # fmt: skip
    name = f"plans/{loaded.name}"
    with results_folder(name, arguments, folder, overwrite, follow.results) as results:
        follow.doing(f"Planning for {loaded.name}")
        begin, cost = time.perf_counter(), least or "time"
        solution = solve_free_motion(
            loaded, task, X_start, X_goal, least=cost, duration=duration,
            knots=KNOTS if knots is None else knots, clearance=clearance, obstacles=solids,
            view=view, guess=way, say=follow.doing,
        )  # fmt: skip
        plan = FreeMotion(
            robot=loaded, limits=bounds, arguments=arguments, solution=solution,
            planning_time=time.perf_counter() - begin, least=cost, clearance=clearance,
            obstacles=solids or Obstacles(), view=view,
        )  # fmt: skip
        return finished(
            plan, results, track=track, stream=stream, stream_model=stream_model, formats=formats,
            follow=follow,
        )  # fmt: skip


def _is_file(value: object) -> bool:
    return isinstance(value, str | Path)

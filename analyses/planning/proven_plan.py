"""A motion of a robot from one pose to another that is proven at every instant."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle
from scipy.spatial import ConvexHull

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
    value_of,
    with_word,
    words,
)
from cdpr_drake.analyses.planning.free_plan import Goal, Start
from cdpr_drake.analyses.planning.motions_in_sets import (
    JUDGED,
    POINTS,
    MotionInSets,
    acceleration_figure,
    judged,
    thick,
)
from cdpr_drake.analyses.planning.path_plan import StreamModel
from cdpr_drake.analyses.planning.plans import finished
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    length_scale,
    pose_in_degrees,
    robot_task,
)
from cdpr_drake.analyses.planning.timed_plan import plan_among_moving
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.analyses.visualization.figure_style import bare_figure, styled
from cdpr_drake.analyses.workspaces.proven_sets import (
    BOXES,
    ProofSettings,
    ProvenSets,
    explain_pose,
)
from cdpr_drake.analyses.workspaces.workspace_files import load_all_obstacles
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError, WorkspaceError
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.palette import BOUND, DESIRED, OUTLINE, PLATFORM, SHADED, TARGET
from cdpr_drake.planning.path_in_sets import METHODS, ProvenMotion, proven_motion
from cdpr_drake.planning.path_timing import STATIONS
from cdpr_drake.workspaces.moving_shapes import MovingObstacle
from cdpr_drake.workspaces.proven_sets import PoseSets

ACCELERATION = 0.25
"""Half width of the box of accelerations that is proven by default if nothing turns [m/s^2]."""

VIEWS = ((0, 1), (0, 2), (1, 2))
"""Coordinates across and up of the three views."""

CIRCLE = 24
"""Corners of a round outline."""

PLATFORM_KIND = "collision-free"
"""The kind that keeps the platform off obstacles."""


def accelerations_of(word: str) -> float | list[float]:
    """Half widths of a, ax,ay,az, or a,alpha, which gives (alpha, alpha, alpha, a, a, a)."""
    values = numbers(1, 2, 3)(word).tolist()
    if min(values) <= 0.0 and values != [0.0]:
        raise ValueError(word)
    if len(values) == 2:
        return [*[values[1]] * 3, *[values[0]] * 3]
    return values[0] if len(values) == 1 else list(values)


Accelerations = Annotated[
    Any, words(with_word(accelerations_of), "a or ax,ay,az or a,alpha, each above 0, or 0 [m/s^2, "
               "rad/s^2]", "A|AX,AY,AZ|A,ALPHA", name="--acceleration"),
]  # fmt: skip


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
        yes, no = self.proof()
        least_time = in_sets.cost == "time"
        moments = {} if box is None or box.moments is None else {
            "largest_moments_n_m": box.moments.tolist()
        }  # fmt: skip
        return {
            "duration_s": plan.duration,
            "path_length_m": path.path.length,
            "proven": {
                "path": self.path_proven, "motion": self.motion_proven, "of": yes, "not_of": no,
            },
            "least": in_sets.cost,
            "method": path.method,
            "cost": plan.duration if least_time else path.length,
            "lower_bound": in_sets.time_bound() if least_time else path.lower_bound,
            "straight_m": path.straight,
            "shortest_polyline_m": path.length,
            "curve_at_most_m": path.curve.polygon,
            "largest_accelerations_m_s2": None if box is None else box.accelerations.tolist(),
            **moments,
            "largest_speed_m_s": None if box is None else box.speed,
            "stretches": [
                {"from_m": a, "to_m": b, "set": int(n)} for a, b, n in path.stretches()
            ],
            "sequences": [
                {"length_m": length, "sets": [int(n) for n in sets]}
                for length, sets in path.looked_at
            ],
            "sets": {"count": len(self.sets), "overlaps": len(self.sets.graph), **self.sets.about},
            "judged_samples": self.judged[0],
            "judged_infeasible": dict(self.judged[1]),
            "stations": len(plan.trajectory.stations),
            "sets_time_s": self.sets_time,
            "planning_time_s": self.planning_time,
        }  # fmt: skip

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Sets, obstacles and the path first; accelerations if they are proven."""
        figures: dict[str, Callable[[], Figure]] = {
            "sets": partial(sets_figure, self),
            **super().figures(),
        }
        if self.in_sets.box is not None:
            figures["accelerations"] = partial(acceleration_figure, self, self.in_sets.box)
        return figures


@verb()
def plan_proven_motion(
    robot: RobotWord, start: Start, goal: Goal, *,
    least_time: Annotated[bool, Parameter(name="--time", negative=())] = False,
    clearance: float | None = None, obstacles: InputFile = None,
    moving: Annotated[Sequence[MovingObstacle], Parameter(parse=False)] = (),
    accelerations: Accelerations = None, boxes: int | None = None,
    method: Annotated[str | None, one_of(METHODS)] = None, stations: int = STATIONS,
    sets: Annotated[ProvenSets | None, Parameter(parse=False)] = None, limits: Limits = None,
    cable_speed: float | None = None, cable_acceleration: float | None = None,
    speed: float | None = None, reserve: float = RESERVE, pulleys: bool = True,
    track: bool | None = None, stream: float | None = None, stream_model: StreamModel = None,
    folder: OutFolder = None, overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> MotionInSets:  # fmt: skip
    """Plans a motion from one pose to another in sets of poses that are proven.

    With accelerations, if it turns also angular ones, it is proven of every instant that tensions
    within the limits (less the reserve) give the motion, and that cables and platform meet nothing.
    Among obstacles that move the sets are of poses and time, and the motion waits where it must.

    Args:
        robot: Robot by name or file.
        start: Pose X_WP at the start [m, deg].
        goal: Pose X_WP at the end [m, deg].
        least_time: Least time instead of least length.
        clearance: Least distance of cables from each other, and of cables and platform from
            obstacles [m].
        obstacles: What stands in the way, YAML as of cdpr workspace --obstacles, which may also
            move, and be other robots with their plans; in Python also what `ProvenSets.find` takes.
        moving: Obstacles that move, in addition to those of a file.
        accelerations: The motion stays within accelerations a or ax,ay,az of Po, any of which the
            cables are proven to give; 0: poses only; default: 0.25, or 0 if the platform turns
            [m/s^2]. If it turns: a,alpha, of the centre of mass and about it, with gyroscopic terms
            [m/s^2, rad/s^2]. In Python half widths of the box: one, three, or six, (angular,
            linear).
        boxes: Largest number of boxes of poses that are judged.
        method: How sets are chosen: sequences, short ones from set to set, or gcs, by Drake's graph
            of convex sets, to compare; default: sequences.
        stations: Number of points of the path at which limits are checked.
        sets: Sets that were found before, instead of new ones.
        limits, cable_speed, cable_acceleration, speed, reserve, pulleys: As of `plan_path`.
        track, stream, stream_model, folder, overwrite, formats, follow: As of `plan_path`.

    Raises:
        PlanningError: The sets do not connect the poses, or an argument is not accepted.
        WorkspaceError: Something does not hold at an end, or is not proven there: which kind, and
            numbers.
        CdprError: A file cannot be read, or the robot is not accepted.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    if boxes is not None and boxes < 1:
        raise PlanningError(f"boxes: found {boxes}; accepted: at least 1")
    loaded = as_robot(robot, "plan_proven_motion")
    limit_settings = LimitSettings(
        tensions=limits, cable_speed=cable_speed, cable_acceleration=cable_acceleration,
        speed=speed, reserve=reserve,
    )  # fmt: skip
    task = robot_task(loaded, limit_settings, pulleys)
    X_ends = [as_pose(loaded, value_of(pose)) for pose in (start, goal)]
    ends = [np.concatenate([X.translation(), angles_from_rotation(X.rotation())]) for X in X_ends]
    box, cost = value_of(accelerations), "time" if least_time else "length"
    is_file = isinstance(obstacles, str | Path)
    resting = obstacles
    if is_file:
        resting, more = load_all_obstacles(Path(obstacles))
        moving = (*more, *moving)
    if moving:
        _check_among_moving(method, box, ends)
    arguments = limit_settings.as_dict(pulleys) | {
        "from": start if isinstance(start, Word) else pose_in_degrees(X_ends[0]),
        "to": goal if isinstance(goal, Word) else pose_in_degrees(X_ends[1]),
        "least": cost, "time": least_time, "clearance": clearance, "boxes": boxes,
        "method": method, "stations": stations, "obstacles": str(obstacles) if is_file else None,
        "acceleration": accelerations if isinstance(accelerations, Word) else None,
    }  # fmt: skip
    if box is not None:
        arguments["accelerations"] = box.tolist() if isinstance(box, np.ndarray) else box
    name = f"plans/{loaded.name}"
    with results_folder(name, arguments, folder, overwrite, follow.results) as results:
        follow.doing(f"Planning for {loaded.name}")
        begin = time.perf_counter()
        if sets is None:
            if box is None:
                box = ACCELERATION if np.array_equal(ends[0][3:], ends[1][3:]) else None
            elif np.ndim(box) == 0 and box == 0.0:
                box = None
            proof = ProofSettings(
                boxes=BOXES if boxes is None else boxes, clearance=clearance or 0.0,
                limits=(task.limits.lower, task.limits.upper), pulleys=pulleys,
            )  # fmt: skip
            sets = ProvenSets.find(
                loaded, None, np.array([end[3:] for end in ends]), resting, box,
                must=dict(zip(("from", "to"), ends, strict=True)), settings=proof,
                say=follow.doing,
            )  # fmt: skip
        else:
            _check_ends(sets, ends)
        between = time.perf_counter()
        plan: MotionInSets
        if moving:
            plan = plan_among_moving(
                loaded, sets, moving, (ends[0], ends[1]), task, cost, arguments=arguments,
                begin=begin, say=follow.doing,
            )  # fmt: skip
        else:
            try:
                in_sets = proven_motion(
                    sets, ends[0], ends[1], task, length_scale(loaded), cost=cost,
                    method=method or METHODS[0], stations=stations, say=follow.doing,
                )  # fmt: skip
            except PlanningError as problem:
                if not sets.cut or "do not connect" not in str(problem):
                    raise
                raise PlanningError(
                    f"{problem}; {sets.cut} open cells between them were cut further"
                ) from problem
            plan = ProvenPlan(
                robot=loaded, limits=task.limits, arguments=arguments, solution=in_sets.plan,
                planning_time=time.perf_counter() - between, in_sets=in_sets,
                sets_time=between - begin, judged=judged(sets, in_sets.plan, JUDGED),
            )  # fmt: skip
        return finished(
            plan, limit_settings, results, track=track, stream=stream, stream_model=stream_model,
            formats=formats, follow=follow,
        )  # fmt: skip


def _check_among_moving(method: str | None, accelerations: Any, ends: Sequence[Array]) -> None:
    """Refuses what is not planned among obstacles that move."""
    if method not in (None, METHODS[0]):
        raise PlanningError(
            f"method: found {method!r} with obstacles that move; accepted: {METHODS[0]}"
        )
    if not np.array_equal(ends[0][3:], ends[1][3:]):
        raise PlanningError(
            "from, to: found two orientations with obstacles that move; accepted: one"
        )
    if accelerations is not None and np.ndim(accelerations) == 0 and accelerations == 0.0:
        raise PlanningError(
            "accelerations: found 0 with obstacles that move; accepted: above 0, since when it is "
            "where depends on them"
        )


def _check_ends(sets: ProvenSets, ends: Sequence[Array]) -> None:
    for where, pose in zip(("from", "to"), ends, strict=True):
        if not sets.covers(pose):
            why = explain_pose(sets, pose) if sets.conditions is not None else ""
            raise WorkspaceError(
                f"{where}: lies in none of {len(sets)} sets{': ' * bool(why)}{why}; accepted: a "
                "pose in one of them"
            )


def sets_figure(plan: ProvenPlan) -> Figure:
    """All sets, those that the path goes through, obstacles and the path, in three views.

    A view looks through everything: an obstacle is not touched where the path only seems to cross
    it. Sets are of Po, so obstacles lie deeper than the sets' borders by the platform and cables.
    """
    sets, path = plan.sets, plan.in_sets.path
    used = sorted(set(path.curve.sets))
    lower, upper = plan.robot.reach()
    flat = np.flatnonzero(upper - lower <= 0.0)
    views = [view for view in VIEWS if not set(view) & set(flat.tolist())]
    points = path.path.points(np.linspace(0.0, path.path.length, POINTS))[:, 4:7]
    figure = bare_figure((5.0 * max(len(views), 2), 5.6), f"Proven sets and the path\n{plan.title}")
    with styled():
        places: Any = figure.subplots(1, len(views), squeeze=False)[0]
        for axes, (a, b) in zip(places, views, strict=True):
            boxes = [_rectangle(sets.lower[k], sets.upper[k], a, b) for k in range(len(sets))]
            axes.add_collection(
                PatchCollection(boxes, facecolor=SHADED.color, edgecolor="none", zorder=1)
            )
            for number in used:
                box = _rectangle(sets.lower[number], sets.upper[number], a, b)
                box.set(fill=False, edgecolor=OUTLINE.color, linewidth=0.9, zorder=3)
                axes.add_patch(box)
            for obstacle in sets.about["obstacles"]:
                outline = _outline(np.array(obstacle["points_m"]), obstacle["radius_m"], a, b)
                axes.add_patch(
                    Polygon(
                        outline, facecolor="white", edgecolor=BOUND.color, hatch="////",
                        linewidth=1.2, alpha=0.9, zorder=2,
                    )
                )  # fmt: skip
            axes.plot(points[:, a], points[:, b], zorder=5, **thick(PLATFORM))
            corners = _corners(plan)
            axes.plot(
                corners[:, a], corners[:, b], zorder=4, linewidth=0.0, marker=".",
                color=BOUND.color, markersize=6.0,
            )  # fmt: skip
            for place, look in ((points[0], DESIRED), (points[-1], TARGET)):
                axes.plot(
                    place[a], place[b], zorder=6, linestyle="none", marker=look.marker,
                    markersize=11.0, markerfacecolor="white", color=look.color,
                )  # fmt: skip
            axes.set(
                xlim=(lower[a], upper[a]), ylim=(lower[b], upper[b]),
                xlabel=f"{'xyz'[a]} in W [m]", ylabel=f"{'xyz'[b]} in W [m]", aspect="equal",
            )  # fmt: skip
        figure.legend(handles=_legend(plan, len(used)), loc="outside lower center", ncols=4)
    return figure


def _corners(plan: ProvenPlan) -> Array:
    """Corners of the shortest polyline, positions in W, shape (n, 3) [m]."""
    sets, points = plan.sets, plan.in_sets.path.sequence.points
    corners = np.repeat(sets.lower[:1, :3], len(points), axis=0)
    moved = sets.axes[sets.axes < 3]
    corners[:, moved] = points[:, : len(moved)]
    return corners


def _rectangle(lower: Array, upper: Array, a: int, b: int) -> Rectangle:
    return Rectangle((lower[a], lower[b]), upper[a] - lower[a], upper[b] - lower[b])


def _outline(points: Array, radius: float, a: int, b: int) -> Array:
    """Outline of a convex shape as a view shows it, shape (k, 2) [m]."""
    flat = points[:, [a, b]]
    if radius > 0.0:
        turns = np.linspace(0.0, 2.0 * np.pi, CIRCLE, endpoint=False)
        ring = radius * np.column_stack([np.cos(turns), np.sin(turns)])
        flat = (flat[:, np.newaxis] + ring).reshape(-1, 2)
    return np.asarray(flat[ConvexHull(flat).vertices], float)


def _legend(plan: ProvenPlan, used: int) -> list[Any]:
    shown = [
        Patch(facecolor=SHADED.color, label=f"{len(plan.sets)} proven sets, of Po"),
        Patch(fill=False, edgecolor=OUTLINE.color, label=f"the {used} of the path"),
        Line2D([], [], label="path of Po", **thick(PLATFORM)),
        Line2D([], [], linewidth=0, marker=".", color=BOUND.color, label="shortest polyline"),
        Line2D([], [], linewidth=0, marker=DESIRED.marker, color=DESIRED.color, label="start",
               markerfacecolor="white", markersize=10),
        Line2D([], [], linewidth=0, marker=TARGET.marker, color=TARGET.color, label="goal",
               markerfacecolor="white", markersize=10),
    ]  # fmt: skip
    if plan.sets.about["obstacles"]:
        shown.insert(
            2, Patch(facecolor="white", edgecolor=BOUND.color, hatch="////", label="obstacles")
        )
    return shown

"""`cdpr plan`: the fastest motion of a robot along a path, or a motion whose path is free.

Options of `cdpr plan`, and what their words mean.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from pydrake.math import RigidTransform
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.planning.free_motion import LEAST, FreeSettings, solve_free_motion
from cdpr_drake.analyses.planning.free_plan_results import FreeRun
from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.analyses.planning.plan_results import PlanRun
from cdpr_drake.analyses.planning.plan_tracking import TrackedPlan, track_plan
from cdpr_drake.analyses.planning.robot_limits import (
    CORNERS,
    RESERVE,
    TOLERANCE,
    LimitSettings,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.analyses.reporting.deferred_figures import Pictures, write_pictures
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.output_folder import results_folder
from cdpr_drake.analyses.workspaces.workspace_files import load_obstacles
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Overwrite,
    ResultsAsJson,
    RobotName,
    parse_formats,
    parse_limits,
    parse_numbers,
    parse_pose,
)
from cdpr_drake.cli.run_endings import say_failed, say_kept, say_recovered, shown_path
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing import STATIONS, PathPlan, plan_along_path
from cdpr_drake.trajectories.pose_path import PosePath

PathOption = Annotated[
    Path | None,
    typer.Option(help="Poses: .csv of x,y,z[,phi,theta,psi] [m, deg], or G-code of G0 and G1."),
]
Waypoints = Annotated[
    str | None,
    typer.Option(help="Poses x,y,z or x,y,z,phi,theta,psi [m, deg], with ; between them."),
]
Corners = Annotated[
    str,
    typer.Option(
        help="At the poses: smooth (a spline), blend (lines, corners rounded) or rest (lines, "
        "a rest in each corner).",
        autocompletion=words_among(CORNERS),
    ),
]
Tolerance = Annotated[float, typer.Option(help="How far rounded corners may pass from a pose [m].")]
CableSpeed = Annotated[
    float | None,
    typer.Option(help="Largest cable speed; without, at the motors' rated one [m/s]."),
]
CableAcceleration = Annotated[
    float | None, typer.Option(help="Largest cable acceleration; without, none [m/s^2].")
]
Speed = Annotated[float | None, typer.Option(help="Largest speed of Po; without, none [m/s].")]
Reserve = Annotated[float, typer.Option(help="Share of all limits that is left to feedback.")]
Stations = Annotated[int, typer.Option(help="Points at which limits are asked.")]
Pulleys = Annotated[bool, typer.Option(help="Cables run over the robot's pulleys.")]
Track = Annotated[bool, typer.Option(help="Also have the simulated robot track the plan at 1 kHz.")]
Out = Annotated[
    Path | None, typer.Option(help="Results folder; without, plans/ROBOT, or ROBOT-2, ...")
]
Free = Annotated[
    bool, typer.Option("--free", help="The path is free: from one pose to another, no path given.")
]
From = Annotated[
    str | None, typer.Option("--from", help="With --free: pose at the start, as of --waypoints.")
]
To = Annotated[
    str | None, typer.Option("--to", help="With --free: pose at the end, as of --waypoints.")
]
Least = Annotated[
    str | None,
    typer.Option(
        help="With --free: least time (without this option), tension (mean square, needs "
        "--duration) or energy (that over the time).",
        autocompletion=words_among(LEAST),
    ),
]
Duration = Annotated[
    float | None, typer.Option(help="With --free: time that the motion takes [s].")
]
Clearance = Annotated[
    float | None,
    typer.Option(
        help="With --free: least distance of cables from each other, and of cables and platform "
        "from --obstacles [m]."
    ),
]
Obstacles = Annotated[
    Path | None,
    typer.Option(help="With --free: boxes in the way, YAML as of cdpr workspace --obstacles."),
]
KeepInView = Annotated[
    str | None,
    typer.Option(
        help="With --free: points x,y,z of W [m], with ; between them, that the camera on the "
        "platform sees all along."
    ),
]
Camera = Annotated[
    str | None, typer.Option(help="With --keep-in-view: which mounting; without, the only one.")
]
Nearest = Annotated[
    float | None, typer.Option(help="With --keep-in-view: least depth of the points [m].")
]
Knots = Annotated[int | None, typer.Option(help="With --free: instants at which limits are asked.")]


@dataclass(frozen=True)
class FreeWords:
    """What users wrote of a free path; None: nothing."""

    start: str | None
    goal: str | None
    least: str | None
    duration: float | None
    clearance: float | None
    obstacles: Path | None
    keep_in_view: str | None
    camera: str | None
    nearest: float | None
    knots: int | None

    OPTIONS = (
        "--from", "--to", "--least", "--duration", "--clearance", "--obstacles", "--keep-in-view",
        "--camera", "--nearest", "--knots",
    )  # fmt: skip

    def given(self) -> list[str]:
        """Names of the options that were given."""
        names = list(self.__dataclass_fields__)
        return [
            option
            for option, name in zip(self.OPTIONS, names, strict=True)
            if getattr(self, name) is not None
        ]

    def settings(self) -> FreeSettings:
        """What is asked.

        Raises:
            CdprError: Something is missing or not accepted; names the option.
        """
        if self.start is None or self.goal is None:
            missing = "--from" if self.start is None else "--to"
            raise CdprError(f"{missing}: found none with --free; accepted: a pose")
        if self.keep_in_view is None and (self.camera or self.nearest) is not None:
            raise CdprError(
                "--keep-in-view: found none with --camera or --nearest; accepted: points"
            )
        chosen = {
            name: value
            for name in ("least", "duration", "clearance", "camera", "nearest", "knots")
            if (value := getattr(self, name)) is not None
        }
        points = None
        if self.keep_in_view is not None:
            points = np.array(
                [
                    parse_numbers("--keep-in-view", word, (3,), "points x,y,z [m], with ; between")
                    for word in self.keep_in_view.split(";")
                ]
            ).T
        obstacles = None if self.obstacles is None else load_obstacles(self.obstacles)
        return FreeSettings(
            start=one_pose("--from", self.start), goal=one_pose("--to", self.goal),
            in_view=points, obstacles=obstacles, **chosen,
        )  # fmt: skip

    def as_dict(self) -> dict[str, object]:
        """For JSON, by the names of the options."""
        names = list(self.__dataclass_fields__)
        values = [getattr(self, name) for name in names]
        return {
            option.removeprefix("--").replace("-", "_"): str(v) if isinstance(v, Path) else v
            for option, v in zip(self.OPTIONS, values, strict=True)
        }


def one_pose(option: str, words: str) -> RigidTransform:
    """A pose of an option; raises as `parse_pose`, under its name."""
    try:
        return parse_pose(words)
    except CdprError as problem:
        raise CdprError(str(problem).replace("--pose", option, 1)) from problem


def plan(
    robot: RobotName,
    path: PathOption = None,
    waypoints: Waypoints = None,
    corners: Corners = "smooth",
    tolerance: Tolerance = TOLERANCE,
    limits: Limits = None,
    cable_speed: CableSpeed = None,
    cable_acceleration: CableAcceleration = None,
    speed: Speed = None,
    reserve: Reserve = RESERVE,
    stations: Stations = STATIONS,
    pulleys: Pulleys = True,
    free: Free = False,
    start: From = None,
    goal: To = None,
    least: Least = None,
    duration: Duration = None,
    clearance: Clearance = None,
    obstacles: Obstacles = None,
    keep_in_view: KeepInView = None,
    camera: Camera = None,
    nearest: Nearest = None,
    knots: Knots = None,
    track: Track = True,
    out: Out = None,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> int:
    """Plans a motion within limits of tensions and winches: the fastest on a path, or a free one.

    Writes motion.csv, summary.json and figures; scenarios of dynamic control track the motion by
    trajectory.file. The exit code is 2 where there is no motion: the message says where, and which
    cable.
    """
    formats = parse_formats(figure_format)
    loaded = load_robot(robot)
    given = LimitSettings(
        tensions=parse_limits(limits), cable_speed=cable_speed,
        cable_acceleration=cable_acceleration, speed=speed, reserve=reserve,
    )  # fmt: skip
    words = FreeWords(
        start, goal, least, duration, clearance, obstacles, keep_in_view, camera, nearest, knots
    )
    arguments = {
        "limits_n": given.tensions, "cable_speed_m_s": cable_speed,
        "cable_acceleration_m_s2": cable_acceleration, "speed_m_s": speed, "reserve": reserve,
        "pulleys": pulleys,
    }  # fmt: skip
    cables = loaded.cable_set()
    asked = _Asked(
        loaded, given, path_task(loaded, given, cables if pulleys else cables.without_pulleys()),
        arguments,
    )  # fmt: skip
    if free:
        if path is not None or waypoints is not None:
            raise CdprError("--free: found --path or --waypoints too; accepted: --from and --to")
        asked.arguments.update(words.as_dict())
        planner = _free_planner(asked, words)
    else:
        if words.given():
            raise CdprError(f"{words.given()[0]}: accepted with --free; found no --free")
        asked.arguments.update(
            {
                "path": None if path is None else str(path), "waypoints": waypoints,
                "corners": corners, "tolerance_m": tolerance, "stations": stations,
            }
        )  # fmt: skip
        poses, source, remarks = _poses(loaded, path, waypoints)
        for remark in remarks:
            message_console().print(f"note: {path}: {remark}")
        way = make_path(loaded, poses, corners, tolerance)
        planner = _path_planner(asked, way, source, stations)
    folder = out if out is not None else free_folder(Path("plans") / loaded.name)
    return _run(asked, planner, folder, _Ending(overwrite, formats, as_json, track))


@dataclass(frozen=True)
class _Asked:
    """The robot and its limits, of any plan."""

    robot: Robot
    limits: LimitSettings
    task: PathTask
    arguments: dict[str, Any]


@dataclass(frozen=True)
class _Ending:
    """What is done with a plan."""

    overwrite: bool
    formats: tuple[str, ...]
    as_json: bool
    track: bool


Tracker = Callable[[PathPlan | FreePathSolution, MotionLimits], TrackedPlan | None]
Planner = Callable[[Callable[[str], None], Tracker], PlanRun | FreeRun]


def _told(
    asked: _Asked, found: PathPlan | FreePathSolution, took: float, track: Tracker
) -> dict[str, Any]:
    """What every `MotionRun` has, of a motion that was found in a time [s]."""
    own = robot_limits(asked.robot, asked.limits)
    return {
        "robot": asked.robot,
        "limits": own,
        "arguments": asked.arguments,
        "planning_time": took,
        "tracked": track(found, own),
    }


def _path_planner(asked: _Asked, way: PosePath, source: str, stations: int) -> Planner:
    def plan(say: Callable[[str], None], track: Tracker) -> PlanRun:
        begin = time.perf_counter()
        found = plan_along_path(asked.task, way, stations)
        took = time.perf_counter() - begin
        return PlanRun(plan=found, source=source, **_told(asked, found, took, track))

    return plan


def _free_planner(asked: _Asked, words: FreeWords) -> Planner:
    settings = words.settings()

    def plan(say: Callable[[str], None], track: Tracker) -> FreeRun:
        begin = time.perf_counter()
        found = solve_free_motion(asked.robot, asked.task, settings, say)
        took = time.perf_counter() - begin
        return FreeRun(asked=settings, solution=found, **_told(asked, found, took, track))

    return plan


def _run(asked: _Asked, planner: Planner, folder: Path, ending: _Ending) -> int:
    """Plans, tracks, writes, and says what was found."""
    console, robot = message_console(), asked.robot
    with results_folder(folder, ending.overwrite) as results:
        say_recovered(console, results)
        with working(console, f"Planning for {robot.name}") as say:

            def track(plan: PathPlan | FreePathSolution, own: MotionLimits) -> TrackedPlan | None:
                if not ending.track:
                    return None
                say(f"Tracking the plan of {robot.name}")
                end = plan.duration

                def show(now: float) -> None:
                    say(f"Tracking the plan of {robot.name}: {now:.0f} of {end:.0f} s")

                return track_plan(robot, plan, own, show)

            run = planner(say, track)
            say("Writing results")
            told = run.write(results.path)
            failed = write_pictures(results.path, _pictures(run, ending.formats), say)
            folder = shown_path(results.publish())
    say_kept(console, results.kept)
    if ending.as_json:
        print_json(told)
    else:
        _print(wide_console(), told, folder)
    return say_failed(console, failed, folder, None)


def _pictures(run: PlanRun | FreeRun, formats: tuple[str, ...]) -> Pictures:
    from cdpr_drake.analyses.planning.free_plan_figures import free_pictures
    from cdpr_drake.analyses.planning.plan_figures import plan_pictures

    return free_pictures(run, formats) if isinstance(run, FreeRun) else plan_pictures(run, formats)


def _poses(
    robot: Robot, path: Path | None, waypoints: str | None
) -> tuple[list[RigidTransform], str, tuple[str, ...]]:
    """Poses of the path, what it is in words, and what was left out."""
    if (path is None) == (waypoints is None):
        found = "neither" if path is None else "both"
        raise CdprError(f"--path, --waypoints: found {found}; accepted: one of them")
    if path is not None:
        read = read_path(path, robot.plane_height)
        return read.poses, path.name, read.remarks
    assert waypoints is not None
    words = [word for word in waypoints.split(";") if word.strip()]
    if len(words) < 2:
        raise CdprError(
            f"--waypoints: found {len(words)} poses; accepted: at least 2, with ; between them"
        )
    poses = [one_pose("--waypoints", word) for word in words]
    return poses, f"{len(poses)} waypoints", ()


def _print(console: Console, told: dict[str, Any], folder: Path) -> None:
    if "knots" in told:
        console.print(
            f"{told['robot']}: {told['duration_s']:.4f} s with the least {told['least']}, by "
            f"{told['solver']} at {told['knots']} knots"
        )
        for name, least in told["least_distances_m"].items():
            console.print(f"least distance, {name}: {1e3 * least:.2f} mm")
        for name, least in told["least_share_of_view"].items():
            console.print(f"{name}: {least:.1%} of the view inside its edge")
        if not told["keeps_distances_and_view"]:
            console.print("BETWEEN KNOTS DISTANCES OR VIEW ARE MISSED; more --knots")
    else:
        console.print(
            f"{told['robot']}: {told['duration_s']:.4f} s along {told['path_length_m']:.4g} m, "
            f"planned at {told['stations']} stations"
        )
    console.print(
        f"at a limit in {told['instants_at_a_limit']:.1%} of all instants; largest share of a "
        f"limit {told['largest_share_of_limits']:.4f}"
    )
    table = Table(box=SIMPLE_HEAD, pad_edge=False, title="Limits")
    table.add_column("limit")
    table.add_column("reached [ms]", justify="right")
    for name, count in told["reached"].items():
        table.add_row(name, str(count))
    console.print(table)
    tracked = told["tracked"]
    if tracked is not None:
        table = Table(box=SIMPLE_HEAD, pad_edge=False, title="The simulated robot tracks it")
        table.add_column("limit of the robot")
        table.add_column("largest share used", justify="right")
        for name, share in tracked["largest_share_of_limits"].items():
            table.add_row(name, f"{share:.4f}")
        console.print(table)
        verdict = "all limits kept" if tracked["keeps_limits"] else "LIMITS MISSED; more --reserve"
        console.print(
            f"{verdict}; steps without tensions: {tracked['steps_without_tensions']}; error up to "
            f"{1e3 * tracked['largest_position_error_m']:.3f} mm"
        )
    console.print(f"results: {folder}")

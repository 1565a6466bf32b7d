"""`cdpr plan`: the fastest motion of a robot along a path, or a motion whose path is free."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydrake.math import RigidTransform
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.plans import (
    RESERVE,
    TOLERANCE,
    FreeRun,
    LimitSettings,
    PlanRun,
    TrackedPlan,
    make_path,
    path_task,
    plan_free_motion,
    read_path,
    robot_limits,
    track_plan,
)
from cdpr_drake.analyses.reporting import Pictures, free_folder, results_folder, write_pictures
from cdpr_drake.cli.endings import say_failed, say_kept, say_recovered, shown_path
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Overwrite,
    ResultsAsJson,
    RobotName,
    parse_formats,
    parse_limits,
)
from cdpr_drake.cli.plan_options import (
    CableAcceleration,
    CableSpeed,
    Camera,
    Clearance,
    Corners,
    Duration,
    Free,
    FreeWords,
    From,
    KeepInView,
    Knots,
    Least,
    Nearest,
    Obstacles,
    Out,
    PathOption,
    Pulleys,
    Reserve,
    Speed,
    Stations,
    To,
    Tolerance,
    Track,
    Waypoints,
    one_pose,
)
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.models import Robot, load_robot
from cdpr_drake.planning import (
    STATIONS,
    FreePathSolution,
    MotionLimits,
    PathPlan,
    PathTask,
    plan_along_path,
)
from cdpr_drake.trajectories import PosePath


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
        found = plan_free_motion(asked.robot, asked.task, settings, say)
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
    from cdpr_drake.analyses.plans import free_pictures, plan_pictures

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

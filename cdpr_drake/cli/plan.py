"""`cdpr plan`: the fastest motion of a robot along a path."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from pydrake.math import RigidTransform
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.plans import (
    CORNERS,
    RESERVE,
    TOLERANCE,
    LimitSettings,
    PlanRun,
    make_path,
    path_task,
    read_path,
    robot_limits,
    track_plan,
)
from cdpr_drake.analyses.reporting import free_folder, results_folder, write_pictures
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.endings import say_failed, say_recovered, shown_path
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Overwrite,
    ResultsAsJson,
    RobotName,
    parse_formats,
    parse_limits,
    parse_pose,
)
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.models import Robot, load_robot
from cdpr_drake.planning import STATIONS, plan_along_path


def plan(
    robot: RobotName,
    path: Annotated[
        Path | None,
        typer.Option(help="Poses: .csv of x,y,z[,phi,theta,psi] [m, deg], or G-code of G0 and G1."),
    ] = None,
    waypoints: Annotated[
        str | None,
        typer.Option(help="Poses x,y,z or x,y,z,phi,theta,psi [m, deg], with ; between them."),
    ] = None,
    corners: Annotated[
        str,
        typer.Option(
            help="At the poses: smooth (a spline), blend (lines, corners rounded) or rest (lines, "
            "a rest in each corner).",
            autocompletion=words_among(CORNERS),
        ),
    ] = "smooth",
    tolerance: Annotated[
        float, typer.Option(help="How far rounded corners may pass from a pose [m].")
    ] = TOLERANCE,
    limits: Limits = None,
    cable_speed: Annotated[
        float | None,
        typer.Option(help="Largest cable speed; without, at the motors' rated one [m/s]."),
    ] = None,
    cable_acceleration: Annotated[
        float | None, typer.Option(help="Largest cable acceleration; without, none [m/s^2].")
    ] = None,
    speed: Annotated[
        float | None, typer.Option(help="Largest speed of Po; without, none [m/s].")
    ] = None,
    reserve: Annotated[
        float, typer.Option(help="Share of all limits that is left to feedback.")
    ] = RESERVE,
    stations: Annotated[int, typer.Option(help="Points at which limits are asked.")] = STATIONS,
    pulleys: Annotated[bool, typer.Option(help="Cables run over the robot's pulleys.")] = True,
    track: Annotated[
        bool, typer.Option(help="Also have the simulated robot track the plan at 1 kHz.")
    ] = True,
    out: Annotated[
        Path | None, typer.Option(help="Results folder; without, plans/ROBOT, or ROBOT-2, ...")
    ] = None,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> int:
    """Plans the fastest motion along a path within the limits of tensions and winches.

    Writes motion.csv, summary.json and figures. The exit code is 2 where the path cannot be
    followed: the message says where, and which cable.
    """
    formats = parse_formats(figure_format)
    loaded = load_robot(robot)
    poses, source, remarks = _poses(loaded, path, waypoints)
    given = LimitSettings(
        tensions=parse_limits(limits), cable_speed=cable_speed,
        cable_acceleration=cable_acceleration, speed=speed, reserve=reserve,
    )  # fmt: skip
    cables = loaded.cable_set()
    task = path_task(loaded, given, cables if pulleys else cables.without_pulleys())
    way = make_path(loaded, poses, corners, tolerance)
    folder = out if out is not None else free_folder(Path("plans") / loaded.name)
    console = message_console()
    for remark in remarks:
        console.print(f"note: {path}: {remark}")
    arguments = {
        "path": None if path is None else str(path), "waypoints": waypoints, "corners": corners,
        "tolerance_m": tolerance, "limits_n": given.tensions, "cable_speed_m_s": cable_speed,
        "cable_acceleration_m_s2": cable_acceleration, "speed_m_s": speed, "reserve": reserve,
        "stations": stations, "pulleys": pulleys,
    }  # fmt: skip
    with results_folder(folder, overwrite) as results:
        say_recovered(console, results)
        with working(console, f"Planning for {loaded.name}") as say:
            begin = time.perf_counter()
            found = plan_along_path(task, way, stations)
            took = time.perf_counter() - begin
            own, tracked = robot_limits(loaded, given), None
            if track:
                say(f"Tracking the plan of {loaded.name}")
                end = found.duration

                def show(now: float) -> None:
                    say(f"Tracking the plan of {loaded.name}: {now:.0f} of {end:.0f} s")

                tracked = track_plan(loaded, found, own, show)
            run = PlanRun(loaded, found, own, source, arguments, took, tracked)
            say("Writing results")
            told = run.write(results.path)
            from cdpr_drake.analyses.plans import plan_pictures

            failed = write_pictures(results.path, plan_pictures(run, formats), say)
            folder = shown_path(results.publish())
    if as_json:
        print_json(told)
    else:
        _print(wide_console(), told, folder)
    return say_failed(console, failed, folder, None)


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
    try:
        poses = [parse_pose(word) for word in words]
    except CdprError as problem:
        raise CdprError(str(problem).replace("--pose", "--waypoints", 1)) from problem
    return poses, f"{len(poses)} waypoints", ()


def _print(console: Console, told: dict[str, Any], folder: Path) -> None:
    console.print(
        f"{told['robot']}: {told['duration_s']:.4f} s along {told['path_length_m']:.4g} m, planned "
        f"at {told['stations']} stations"
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

"""`cdpr plan`: the fastest motion of a robot along a path, a free one, or one that is proven.

The options come first, and what users wrote of a free path (`FreeWords`); then the command, and
what it does for either kind of motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.front.planning import PathPoses, path_poses, plan_free_motion, plan_path
from cdpr_drake.analyses.front.proven_motions import plan_proven_motion
from cdpr_drake.analyses.planning.cable_streams import MODELS, cable_stream
from cdpr_drake.analyses.planning.free_motion import LEAST
from cdpr_drake.analyses.planning.free_plan_results import FreeRun
from cdpr_drake.analyses.planning.plan_results import MotionRun, PlanRun
from cdpr_drake.analyses.planning.proven_plan_results import ProvenRun
from cdpr_drake.analyses.planning.robot_path_task import (
    CORNERS,
    RESERVE,
    TOLERANCE,
    LimitSettings,
)
from cdpr_drake.analyses.planning.timed_plan_results import TimedRun
from cdpr_drake.analyses.reporting.deferred_figures import Pictures, drawing, write_pictures
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.output_folder import results_folder, shown_path
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Overwrite,
    Pulleys,
    ResultsAsJson,
    RobotName,
    parse_formats,
    parse_limits,
    parse_numbers,
)
from cdpr_drake.cli.proven_options import (
    Acceleration,
    Boxes,
    LeastTime,
    Method,
    Proven,
    ProvenWords,
    one_pose,
    print_proven,
)
from cdpr_drake.cli.run_endings import report_failures, report_kept_files, report_recovered
from cdpr_drake.cli.terminal import message_console, print_json, print_words, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.path_timing import STATIONS
from cdpr_drake.planning.resistance import wrench_words

PathOption = Annotated[
    Path | None,
    typer.Option(
        help="Poses: .csv of x,y,z[,phi,theta,psi] [m, deg], or G-code: lines, arcs, feeds."
    ),
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
    typer.Option(help="Largest cable speed [m/s]; default: at the motors' rated speed."),
]
CableAcceleration = Annotated[
    float | None, typer.Option(help="Largest cable acceleration [m/s^2]; default: no limit.")
]
Speed = Annotated[float | None, typer.Option(help="Largest speed of Po [m/s]; default: no limit.")]
Reserve = Annotated[
    float, typer.Option(help="Share of every limit that is kept back for feedback.")
]
Feeds = Annotated[
    bool,
    typer.Option("--feeds/--no-feeds", help="Take feed rates of G-code as largest speeds of Po."),
]
Stations = Annotated[
    int, typer.Option(help="Number of points of the path at which limits are checked.")
]
Resist = Annotated[
    Path | None,
    typer.Option(
        help="Wrenches on the platform that must be resisted all along the path, YAML as of cdpr "
        "workspace --wrench-set: vertices, a box."
    ),
]
Track = Annotated[
    bool | None,
    typer.Option(
        "--track/--no-track",
        help="Also have the simulated robot track the plan at 1 kHz; without, bodies do, point "
        "masses do not.",
    ),
]
Stream = Annotated[
    float | None,
    typer.Option(
        help="Also write unstrained cable lengths and motor angles at so many points a second: "
        "lengths.csv, motor_angles.csv, and stream.json, which says whether cables stay taut "
        "between points."
    ),
]
StreamModel = Annotated[
    str | None,
    typer.Option(
        help="Cables of the stream: elastic, stretched by their tension, or catenary, which sag, "
        "too. Default: catenary if the robot file's cables sag.",
        autocompletion=words_among(MODELS),
    ),
]
Out = Annotated[
    Path | None, typer.Option(help="Results folder; default: plans/ROBOT, or ROBOT-2, ...")
]
Free = Annotated[
    bool, typer.Option("--free", help="The path is free: from one pose to another, no path given.")
]
From = Annotated[
    str | None,
    typer.Option("--from", help="With --free or --proven: pose at the start, as of --waypoints."),
]
To = Annotated[
    str | None,
    typer.Option("--to", help="With --free or --proven: pose at the end, as of --waypoints."),
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
        help="With --free or --proven: least distance of cables from each other, and of cables and "
        "platform from --obstacles [m]."
    ),
]
Obstacles = Annotated[
    Path | None,
    typer.Option(
        help="With --free or --proven: what stands in the way, YAML as of cdpr workspace "
        "--obstacles; with --proven it may move, and be other robots with their plans."
    ),
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
Guess = Annotated[
    Path | None,
    typer.Option(
        help="With --free: motion.csv of another plan between the same poses, such as one of "
        "--proven, from which the solver starts."
    ),
]
Knots = Annotated[
    int | None, typer.Option(help="With --free: number of instants at which limits are checked.")
]


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
    guess: Path | None

    OPTIONS = (
        "--from", "--to", "--least", "--duration", "--clearance", "--obstacles", "--keep-in-view",
        "--camera", "--nearest", "--knots", "--guess",
    )  # fmt: skip

    def given(self) -> list[str]:
        """Names of the options that were given."""
        names = list(self.__dataclass_fields__)
        return [
            option
            for option, name in zip(self.OPTIONS, names, strict=True)
            if getattr(self, name) is not None
        ]

    def asked(self) -> dict[str, Any]:
        """What is asked, as `plan_free_motion` takes it.

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
        found: dict[str, Any] = {
            name: value
            for name in (
                "least",
                "duration",
                "clearance",
                "obstacles",
                "camera",
                "nearest",
                "knots",
                "guess",
            )
            if (value := getattr(self, name)) is not None
        }
        if self.keep_in_view is not None:
            found["in_view"] = np.array(
                [
                    parse_numbers("--keep-in-view", word, (3,), "points x,y,z [m], with ; between")
                    for word in self.keep_in_view.split(";")
                ]
            ).T
        start, goal = one_pose("--from", self.start), one_pose("--to", self.goal)
        return found | {"start": start, "goal": goal}

    def as_dict(self) -> dict[str, object]:
        """For JSON, by the names of the options."""
        names = list(self.__dataclass_fields__)
        values = [getattr(self, name) for name in names]
        return {
            option.removeprefix("--").replace("-", "_"): str(v) if isinstance(v, Path) else v
            for option, v in zip(self.OPTIONS, values, strict=True)
        }


SHARED = ("--from", "--to", "--clearance", "--obstacles")
"""Options that --free and --proven have in common."""


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
    feeds: Feeds = True,
    stations: Stations = STATIONS,
    pulleys: Pulleys = True,
    resist: Resist = None,
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
    guess: Guess = None,
    proven: Proven = False,
    time: LeastTime = False,
    acceleration: Acceleration = None,
    boxes: Boxes = None,
    method: Method = None,
    track: Track = None,
    stream: Stream = None,
    stream_model: StreamModel = None,
    out: Out = None,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> int:
    """Plans a motion within limits of tensions and winches: on a path, a free one, or a proven one.

    Writes motion.csv, summary.json and figures; scenarios of dynamic control track the motion by
    trajectory.file. If there is no motion, the exit code is 2 and the message names the place and
    the cable.
    """
    formats = parse_formats(figure_format)
    loaded = load_robot(robot, "cdpr plan")
    given = LimitSettings(
        tensions=parse_limits(limits), cable_speed=cable_speed,
        cable_acceleration=cable_acceleration, speed=speed, reserve=reserve,
    )  # fmt: skip
    words = FreeWords(
        start, goal, least, duration, clearance, obstacles, keep_in_view, camera, nearest, knots,
        guess,
    )  # fmt: skip
    sure = ProvenWords(start, goal, clearance, obstacles, time, acceleration, boxes, method)
    if track is None:
        track = not loaded.motion_type().is_point
        if not track:
            message_console().print("note: not tracked: computed torque moves bodies alone")
    planner: Planner
    if not proven and sure.given():
        raise CdprError(f"{sure.given()[0]}: accepted with --proven; found no --proven")
    if proven:
        other = [one for one in words.given() if one not in SHARED]
        other += ["--free"] * free
        other += [name for name, value in (("--path", path), ("--waypoints", waypoints)) if value]
        if other:
            raise CdprError(f"--proven: found {other[0]} too; accepted: {', '.join(SHARED)}")
        wanted = sure.asked()

        def planner(say: Callable[[str], None]) -> MotionRun:
            found = plan_proven_motion(
                loaded, limits=given, pulleys=pulleys, track=track, say=say, stations=stations,
                **wanted,
            )  # fmt: skip
            return replace(found, arguments=found.arguments | sure.as_dict())

    elif free:
        if path is not None or waypoints is not None:
            raise CdprError("--free: found --path or --waypoints too; accepted: --from and --to")
        if resist is not None:
            raise CdprError("--resist: found with --free; accepted: with --path or --waypoints")
        asked = words.asked()

        def planner(say: Callable[[str], None]) -> MotionRun:
            found = plan_free_motion(
                loaded, limits=given, pulleys=pulleys, track=track, say=say, **asked
            )
            arguments = {k: v for k, v in found.arguments.items() if k != "in_view"}
            return replace(found, arguments=arguments | words.as_dict())

    else:
        if words.given():
            raise CdprError(f"{words.given()[0]}: accepted with --free; found no --free")
        poses = _poses(loaded, path, waypoints)
        for remark in poses.remarks:
            message_console().print(f"note: {path}: {remark}")

        def planner(say: Callable[[str], None]) -> MotionRun:
            found = plan_path(
                loaded, poses, replace(given, feeds=feeds), corners=corners, tolerance=tolerance,
                stations=stations, pulleys=pulleys, resist=resist, track=track, say=say,
            )  # fmt: skip
            asked = {"path": None if path is None else str(path), "waypoints": waypoints}
            return replace(found, arguments=found.arguments | asked)

    folder = out if out is not None else free_folder(Path("plans") / loaded.name)
    return _run(loaded, planner, folder, _Ending(
        overwrite, formats, as_json, None if stream is None else (stream, stream_model)
    ))  # fmt: skip


@dataclass(frozen=True)
class _Ending:
    """What is done with a plan."""

    overwrite: bool
    formats: tuple[str, ...]
    as_json: bool
    stream: tuple[float, str | None] | None = None


Planner = Callable[[Callable[[str], None]], MotionRun]


def _run(robot: Robot, planner: Planner, folder: Path, ending: _Ending) -> int:
    """Plans, tracks, writes, and says what was found."""
    console = message_console()
    with results_folder(folder, ending.overwrite, redo=True) as results:
        report_recovered(console, results)
        with working(console, f"Planning for {robot.name}") as say:
            run = planner(say)
            say("Writing results")
            told = run.write(results.path)
            streamed = None
            if ending.stream is not None:
                streamed = cable_stream(run, *ending.stream)
                told["stream"] = streamed.write(results.path)
            pictures = _pictures(run, ending.formats)
            if streamed is not None:
                from cdpr_drake.analyses.planning.stream_figures import stream_pictures

                pictures = {**pictures, **stream_pictures(streamed, ending.formats)}
            folder = shown_path(results.publish())
            with drawing(folder):
                failed = write_pictures(folder, pictures, say)
    report_kept_files(console, results.kept)
    if ending.as_json:
        print_json(told)
    else:
        _print(wide_console(), told, folder)
        if streamed is not None:
            print_words(streamed.words())
    return report_failures(console, failed, folder, None)


def _pictures(run: MotionRun, formats: tuple[str, ...]) -> Pictures:
    from cdpr_drake.analyses.planning.free_plan_figures import free_pictures
    from cdpr_drake.analyses.planning.plan_figures import plan_pictures
    from cdpr_drake.analyses.planning.proven_plan_figures import proven_pictures
    from cdpr_drake.analyses.planning.timed_plan_figures import timed_pictures

    if isinstance(run, ProvenRun):
        return proven_pictures(run, formats)
    if isinstance(run, TimedRun):
        return timed_pictures(run, formats)
    if isinstance(run, FreeRun):
        return free_pictures(run, formats)
    assert isinstance(run, PlanRun)
    return plan_pictures(run, formats)


def _poses(robot: Robot, path: Path | None, waypoints: str | None) -> PathPoses:
    """Poses of --path or of --waypoints."""
    if (path is None) == (waypoints is None):
        found = "neither" if path is None else "both"
        raise CdprError(f"--path, --waypoints: found {found}; accepted: one of them")
    if path is not None:
        return path_poses(robot, path)
    assert waypoints is not None
    words = [word for word in waypoints.split(";") if word.strip()]
    if len(words) < 2:
        raise CdprError(
            f"--waypoints: found {len(words)} poses; accepted: at least 2, with ; between them"
        )
    return path_poses(robot, [one_pose("--waypoints", word) for word in words])


def _print(console: Console, told: dict[str, Any], folder: Path) -> None:
    console.print(f"cables: {told['geometry']}")
    if "proven" in told:
        print_proven(console, told)
    elif "knots" in told:
        console.print(
            f"{told['robot']}: {told['duration_s']:.4f} s with the least {told['least']}, by "
            f"{told['solver']} at {told['knots']} knots"
        )
        for name, least in told["least_distances_m"].items():
            console.print(f"least distance, {name}: {1e3 * least:.2f} mm")
        for name, least in told["least_share_of_view"].items():
            console.print(f"{name}: {least:.1%} of the view inside its edge")
        for name, one in told["between_knots"].items():
            if one["missed"] > 0.0:
                most = one["missed_at_most"]
                bound = "" if most is None else f", nowhere by more than {most:.3g}"
                console.print(
                    f"between knots: {name} missed by {one['missed']:.3g} ({one['of']}) at "
                    f"{one['at_time_s']:.3f} s{bound}"
                )
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
    if "resist" in told:
        worst = told["resist"]["worst"]
        console.print(
            f"resists {len(told['resist']['corners'])} wrenches; the least margin, "
            f"{worst['least_margin']:.4f} of half the range, has "
            f"{wrench_words(worst['wrench_n_m_n'])} at s = {worst['at_s_m']:.4g} m"
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

"""`cdpr reconfigure`: exit points on rails, put where a task is possible or best."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.design.reconfiguration import (
    AROUND,
    BOXES,
    MARGIN,
    RAIL_GOALS,
    ROBOT_FILE,
    TURN,
    Around,
)
from cdpr_drake.analyses.front.reconfiguration import SAMPLES
from cdpr_drake.analyses.front.reconfiguration import reconfigure as put_on_rails
from cdpr_drake.analyses.reporting.deferred_figures import drawing, write_pictures
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.output_folder import results_folder, shown_path
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Overwrite,
    ResultsAsJson,
    RobotName,
    parse_formats,
    parse_limits,
)
from cdpr_drake.cli.proven_options import one_pose
from cdpr_drake.cli.run_endings import report_failures, report_kept_files, report_recovered
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.reconfiguration import STARTS


def reconfigure(
    robot: RobotName,
    rails: Annotated[
        Path | None,
        typer.Option(
            help="YAML file of rails: cables, axis, lower, upper; without, those of the robot file."
        ),
    ] = None,
    poses: Annotated[
        str | None,
        typer.Option(help="Poses x,y,z or x,y,z,phi,theta,psi [m, deg], with ; between them."),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(help="Path, instead of --poses: CSV or G-code, as of cdpr plan --path."),
    ] = None,
    samples: Annotated[
        int, typer.Option(help="Number of poses of the path that are checked.")
    ] = SAMPLES,
    resist: Annotated[
        Path | None,
        typer.Option(help="Wrenches to resist at each pose, YAML as of cdpr plan --resist."),
    ] = None,
    goal: Annotated[
        str,
        typer.Option(
            help="margin: the largest margin of tensions; tension: the least largest tension.",
            autocompletion=words_among(RAIL_GOALS),
        ),
    ] = MARGIN,
    limits: Limits = None,
    starts: Annotated[
        int, typer.Option(help="Number of starting points of the optimisation.")
    ] = STARTS,
    around: Annotated[
        float,
        typer.Option(
            help="Half width of the box of positions that is proven around each pose [m]."
        ),
    ] = AROUND,
    turn: Annotated[
        float, typer.Option(help="Half width of the angles that are proven around each pose [deg].")
    ] = TURN,
    boxes: Annotated[
        int, typer.Option(help="Largest number of boxes to judge for each pose.")
    ] = BOXES,
    out: Annotated[
        Path | None, typer.Option(help="Results folder; default: rails/ROBOT, or ROBOT-2, ...")
    ] = None,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> int:
    """Places exit points along rails so that poses or a path are feasible or best, with a proof.

    Writes robot.yaml with the new exit points, summary.json and a figure. If no position on the
    rails works, the exit code is 2 and the message names the pose and the wrench. Cables are taken
    as straight from their exit points; whether they collide is not checked.
    """
    formats = parse_formats(figure_format)
    loaded = load_robot(robot, "cdpr reconfigure")
    if (poses is None) == (path is None):
        found = "neither" if poses is None else "both"
        raise CdprError(f"--poses, --path: found {found}; accepted: one of them")
    asked: Any = path
    if poses is not None:
        asked = [one_pose("--poses", word) for word in poses.split(";") if word.strip()]
    console = message_console()
    folder = out if out is not None else free_folder(Path("rails") / loaded.name)
    with results_folder(folder, overwrite, redo=True) as results:
        report_recovered(console, results)
        with working(console, f"Moving exit points of {loaded.name}") as say:
            run = put_on_rails(
                loaded, rails, asked, resist=resist, goal=goal, limits=parse_limits(limits),
                samples=samples, starts=starts, around=Around(around, turn, boxes), say=say,
            )  # fmt: skip
            say("Writing results")
            told = run.write(results.path)
            from cdpr_drake.analyses.design.rail_figures import rail_pictures

            folder = shown_path(results.publish())
            with drawing(folder):
                failed = write_pictures(folder, rail_pictures(run, formats), say)
    report_kept_files(console, results.kept)
    if as_json:
        print_json(told)
    else:
        _print(wide_console(), told, folder)
    return report_failures(console, failed, folder, None)


def _print(console: Console, told: dict[str, Any], folder: Path) -> None:
    table = Table(box=SIMPLE_HEAD, pad_edge=False, title=f"{told['robot']}: rails")
    for column in ("cables", "from [m]", "to [m]", "ends [m]"):
        table.add_column(column, justify="left" if column == "cables" else "right")
    for rail in told["rails"]:
        table.add_row(
            rail["cables"], f"{rail['from_m']:.4f}", f"{rail['to_m']:.4f}",
            f"{rail['lower_m']:g} to {rail['upper_m']:g}",
        )  # fmt: skip
    console.print(table)
    console.print(f"cables: {told['geometry']}")
    console.print(
        f"least margin of {len(told['poses'])} poses under {told['wrenches']} wrenches: "
        f"{told['least_margin_before']:.4f} before, {told['least_margin']:.4f} now, "
        f"{told['least_margin_over_pulleys']:.4f} over pulleys, of half the range of tensions; "
        f"tensions to {told['largest_tension_n']:.4g} N do"
    )
    position, turn = told["proven_around_m_deg"]
    share = min(pose["proven_inside"] for pose in told["poses"])
    verdict = "proven" if told["proven"] else f"NOT PROVEN, {share:.1%} at the worst pose"
    console.print(f"all poses within {position:g} m, {turn:g} deg of each: {verdict}")
    console.print(f"robot: {folder / ROBOT_FILE}")

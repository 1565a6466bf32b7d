"""`cdpr workspace`: where a robot can work, and how well."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.reporting import continued_folder, write_json, write_pictures
from cdpr_drake.analyses.stability import workspace_defaults
from cdpr_drake.analyses.sweeps import STARTING
from cdpr_drake.analyses.workspaces import (
    KINDS,
    MEASURES,
    Asked,
    RobotWorkspace,
    WorkspaceQuestion,
    WorkspaceRun,
    box_numbers,
    certified_boxes,
    hull_numbers,
    load_obstacles,
    make_workspace_question,
    question_hull,
    robot_workspace,
    save_boxes,
    save_hull,
    surroundings,
    write_workspace_scene,
)
from cdpr_drake.cli.endings import say_failed, shown_path
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Mass,
    ResultsAsJson,
    RobotName,
    Wrench,
    parse_formats,
    parse_limits,
    parse_numbers,
    parse_wrench,
)
from cdpr_drake.cli.pose_grid import parse_grid
from cdpr_drake.cli.stop_request import StopRequest
from cdpr_drake.cli.sweep_watch import interrupted, watched
from cdpr_drake.cli.terminal import (
    message_console,
    print_json,
    progress_bar,
    wide_console,
    working,
)
from cdpr_drake.cli.workspace_options import (
    parse_accelerations,
    parse_required,
    parse_turns,
    parse_velocities,
)
from cdpr_drake.errors import CdprError, WorkspaceError
from cdpr_drake.models import Robot, load_robot
from cdpr_drake.workspaces import (
    MESH_ENDINGS,
    CertifiedBoxes,
    write_hull,
)

RESULTS = "results.json"
"""Arguments, versions, volumes and ranges."""


def workspace(
    robot: RobotName,
    kind: Annotated[
        str, typer.Option(help="One or several, separated by commas: " + ", ".join(KINDS) + ".")
    ] = "static",
    measure: Annotated[
        str | None,
        typer.Option(help="One or several, separated by commas: " + ", ".join(MEASURES) + "."),
    ] = None,
    grid: Annotated[
        str | None,
        typer.Option(
            help="x,y,z, each a number of points in the default box, or lower:upper:step [m]."
        ),
    ] = None,
    orientation: Annotated[
        list[str] | None,
        typer.Option(
            help="Angles phi,theta,psi of the platform, each a number or lower:upper:step [deg]; "
            "may be repeated."
        ),
    ] = None,
    orientations: Annotated[
        str, typer.Option(help="Where it must hold: in all (inclusion) or any (maximal) of them.")
    ] = "all",
    wrench_set: Annotated[
        Path | None,
        typer.Option(help="YAML file of the wrenches to resist: vertices, box, ellipsoid."),
    ] = None,
    force: Annotated[
        float | None, typer.Option(help="Forces to resist, up to so much along each axis [N].")
    ] = None,
    moment: Annotated[
        float | None, typer.Option(help="Moments to resist, up to so much about each axis [N m].")
    ] = None,
    acceleration: Annotated[
        str | None,
        typer.Option(
            help="Accelerations to have along and about each axis, up to a,alpha [m/s^2, rad/s^2]."
        ),
    ] = None,
    velocity: Annotated[
        list[str] | None,
        typer.Option(help="At which angular velocity wx,wy,wz [rad/s]; may be repeated; none."),
    ] = None,
    clearance: Annotated[
        float, typer.Option(help="How far cables and platform stay from others, at least [m].")
    ] = 0.0,
    obstacles: Annotated[
        Path | None, typer.Option(help="YAML file of boxes that stand in the frame.")
    ] = None,
    anchor_free: Annotated[
        float | None,
        typer.Option(help="Length next to anchor points not compared with the platform [m]."),
    ] = None,
    exit_free: Annotated[
        float | None,
        typer.Option(help="Length next to exit points not compared with the frame [m]."),
    ] = None,
    scenario: Annotated[
        str | None, typer.Option(help="Scenario whose camera and target count.")
    ] = None,
    hull: Annotated[
        str | None,
        typer.Option(help="Also the hull seen from x,y,z [m], by rays to the frame at most."),
    ] = None,
    rays: Annotated[int, typer.Option(help="Rays of the hull, at most.")] = 10_000,
    tolerance: Annotated[
        float, typer.Option(help="How near to the border rays of the hull end [m].")
    ] = 1e-3,
    mesh: Annotated[
        Path | None,
        typer.Option(help=f"File for the hull's triangles: {', '.join(MESH_ENDINGS)}."),
    ] = None,
    certify: Annotated[
        bool, typer.Option(help="Also boxes of the frame proven inside or outside; one kind.")
    ] = False,
    boxes: Annotated[int, typer.Option(help="Boxes that are judged, at most.")] = 200_000,
    exit_error: Annotated[
        float, typer.Option(help="Proven for exit points off by up to so much [m].")
    ] = 0.0,
    anchor_error: Annotated[
        float, typer.Option(help="Proven for anchor points off by up to so much [m].")
    ] = 0.0,
    limits: Limits = None,
    mass: Mass = None,
    wrench: Wrench = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; without, one below workspace/ named by the arguments."),
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Local processes; all processors.")] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler that computes, tcp://host:port.")
    ] = None,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> int:
    """Finds where a robot can work: kinds of workspaces, what they have in common, and measures.

    Run again with the same arguments, it continues where it was stopped or killed.
    """
    formats = parse_formats(figure_format)
    if workers is not None and workers < 1:
        raise CdprError(f"--workers: found {workers}; accepted: at least 1")
    if mass is not None and not (math.isfinite(mass) and mass > 0.0):
        raise CdprError(f"--mass: found {mass:g}; accepted: > 0 [kg]")
    loaded = load_robot(robot)
    defaults = workspace_defaults(loaded, robot)
    asked = Asked(
        limits=parse_limits(limits),
        mass=mass,
        wrench=parse_wrench(wrench),
        required=parse_required(wrench_set, force, moment),
        accelerations=parse_accelerations(acceleration),
        velocities=parse_velocities(velocity or []),
        clearance=clearance,
        around=surroundings(
            loaded, None if obstacles is None else load_obstacles(obstacles), exit_free, anchor_free
        ),
        scenario=scenario,
    )
    question = make_workspace_question(
        robot,
        kind.split(","),
        parse_grid(
            grid, parse_turns(orientation or []), defaults.lower, defaults.upper, defaults.step
        ),
        () if measure is None else measure.split(","),
        orientations,
        asked,
    )
    console = message_console()
    seen = None
    if mesh is not None and hull is None:
        raise WorkspaceError("--mesh: found no --hull; accepted: both")
    if mesh is not None and mesh.suffix.lstrip(".").lower() not in MESH_ENDINGS:
        raise WorkspaceError(
            f"--mesh {mesh}: accepted: a file that ends in {', '.join(MESH_ENDINGS)}"
        )
    if hull is not None:
        center = np.array(parse_numbers("--hull", hull, (3,), "x,y,z [m]"))
        with working(console, "Casting rays"):
            seen = question_hull(question, loaded, center, rays, tolerance)
    proven = None
    if certify:
        proven = _certified(question, loaded, boxes, (exit_error, anchor_error), console)
    folder = out if out is not None else default_folder(question)
    with continued_folder(folder):  # nobody else writes there meanwhile
        run = watched(
            question.robot,
            folder,
            console,
            lambda show, stop: robot_workspace(question, folder, workers, scheduler, show, stop),
            lambda progress: WorkspaceRun(None, progress),
        )
        if run.workspace is None:
            return interrupted(run.progress, folder, console)
        told = run.workspace.as_dict()
        note = ""
        with working(console, "Writing results"):
            if seen is not None:
                told["hull"] = hull_numbers(seen)
                save_hull(seen, folder)
                if mesh is not None:
                    write_hull(seen, mesh)
            if proven is not None:
                told["certified"] = box_numbers(proven)
                save_boxes(proven, folder)
            write_json(folder / RESULTS, told)
            from cdpr_drake.analyses.workspaces import workspace_pictures

            failed = write_pictures(folder, workspace_pictures(run.workspace, formats))
            note = write_workspace_scene(folder, run.workspace, loaded)
    if note:
        console.print(f"note: {note}")
    if as_json:
        print_json(told)
    else:
        _print_tables(run.workspace, told, folder)
    return say_failed(console, failed, shown_path(folder.resolve()), None)


def _certified(
    question: WorkspaceQuestion,
    robot: Robot,
    boxes: int,
    errors: tuple[float, float],
    console: Console,
) -> CertifiedBoxes:
    """Certified boxes, with progress; Ctrl-C ends the search with what is proven by then."""
    stop = StopRequest("Stopping; what is proven is kept")
    with stop.listening(), progress_bar(console) as bar:
        task = bar.add_task("certify", total=boxes, state=STARTING)

        def show(judged: int, open_share: float) -> None:
            bar.update(task, completed=judged, state=f"{judged} boxes, {open_share:.1%} open")

        return certified_boxes(question, robot, boxes, errors, on_progress=show, should_stop=stop)


def default_folder(question: WorkspaceQuestion) -> Path:
    """A folder below workspace/ that the same arguments find again."""
    digest = hashlib.sha256(json.dumps(question.arguments(), sort_keys=True).encode()).hexdigest()
    kinds = question.kinds[0] if len(question.kinds) == 1 else f"{len(question.kinds)}-kinds"
    return Path("workspace") / f"{question.robot}-{kinds}-{digest[:8]}"


def _print_tables(found: RobotWorkspace, told: dict[str, Any], folder: Path) -> None:
    unit = found.volume().unit
    table = Table(title=f"{told['robot']}: workspaces", box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("kind", no_wrap=True)
    for heading in ("poses [%]", "cells inside [%]", f"volume [{unit}]"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("where")
    for name, numbers in told["workspaces"].items():
        volume = found.volume(name)
        table.add_row(
            name,
            f"{100.0 * numbers['pose_share']:.2f}",
            f"{100.0 * volume.share:.2f}",
            f"{volume.value:.4g}",
            numbers["title"],
        )
    printer = wide_console()
    printer.print(table)
    if told["measured"]:
        table = Table(title="Measures inside", box=SIMPLE_HEAD, pad_edge=False)
        table.add_column("measure", no_wrap=True)
        for heading in ("least", "median", "largest"):
            table.add_column(heading, justify="right", no_wrap=True)
        for numbers in told["measured"].values():
            values = [numbers[key] for key in ("least", "median", "largest")]
            table.add_row(
                f"{numbers['title']} [{numbers['unit']}]",
                *("-" if value is None else f"{value:.4g}" for value in values),
            )
        printer.print(table)
    if "hull" in told:
        hull = told["hull"]
        printer.print(
            f"hull: {hull['volume_m3']:.4g} m^3, {hull['area_m2']:.4g} m^2, {hull['rays']} rays, "
            f"{hull['rays_to_the_frame']} of them to the frame"
        )
    if "certified" in told:
        proven = told["certified"]
        printer.print(
            f"certified: {proven['inside_share']:.2%} of the frame inside, "
            f"{proven['outside_share']:.2%} outside, {proven['open_share']:.2%} open; "
            f"{proven['boxes_judged']} boxes"
        )
    printer.print(f"results: {folder}", soft_wrap=True, highlight=False)

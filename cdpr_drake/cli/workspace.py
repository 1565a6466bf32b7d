"""`cdpr workspace`: where a robot can work, and how well."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from cdpr_drake.analyses.reporting import continued_folder, write_json, write_pictures
from cdpr_drake.analyses.stability import workspace_defaults
from cdpr_drake.analyses.sweeps import STARTING
from cdpr_drake.analyses.workspaces import (
    KINDS,
    MEASURES,
    Asked,
    BoxSearch,
    WorkspaceDrawings,
    WorkspaceRun,
    box_search,
    certified_boxes,
    hull_bound,
    load_obstacles,
    make_workspace_question,
    question_hull,
    robot_workspace,
    surroundings,
    workspace_page,
)
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.endings import say_failed, shown_path
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Mass,
    ResultsAsJson,
    RobotName,
    Scheduler,
    Wrench,
    parse_formats,
    parse_limits,
    parse_numbers,
    parse_wrench,
)
from cdpr_drake.cli.pose_grid import parse_grid, parse_turns
from cdpr_drake.cli.pose_options import (
    ForceToResist,
    GridWords,
    MomentToResist,
    Orientations,
    Out,
    Workers,
    check_mass,
    check_workers,
    default_folder,
)
from cdpr_drake.cli.stop_request import INTERRUPTED, StopRequest
from cdpr_drake.cli.sweep_watch import interrupted, watched
from cdpr_drake.cli.terminal import (
    message_console,
    print_json,
    progress_bar,
    working,
)
from cdpr_drake.cli.workspace_options import (
    grid_box,
    parse_accelerations,
    parse_box,
    parse_required,
    parse_velocities,
)
from cdpr_drake.cli.workspace_words import (
    print_workspace,
    say_contradictions,
    say_what_was_asked,
)
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.models import load_robot
from cdpr_drake.tensions import METHODS
from cdpr_drake.workspaces import (
    GRID_ENDINGS,
    MESH_ENDINGS,
    CertifiedBoxes,
    mesh_ending,
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
    grid: GridWords = None,
    orientation: Orientations = None,
    orientations: Annotated[
        str, typer.Option(help="Where it must hold: in all (inclusion) or any (maximal) of them.")
    ] = "all",
    wrench_set: Annotated[
        Path | None,
        typer.Option(help="YAML file of the wrenches to resist: vertices, box, ellipsoid."),
    ] = None,
    force: ForceToResist = None,
    moment: MomentToResist = None,
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
        typer.Option(
            help="Also the hull seen from x,y,z [m], by rays that end at the frame at the latest; "
            "a frame that was assumed when the robot was imported bounds nothing."
        ),
    ] = None,
    box: Annotated[
        str | None,
        typer.Option(
            help="x0:x1,y0:y1,z0:z1 [m] in the place of the frame: where the hull ends, and the "
            "default grid and the boxes of --certify lie."
        ),
    ] = None,
    unbounded: Annotated[
        bool, typer.Option("--unbounded", help="Nothing bounds the hull.")
    ] = False,
    pulleys: Annotated[
        bool, typer.Option(help="Cables run over the robot's pulleys; else from fixed points.")
    ] = True,
    method: Annotated[
        str | None,
        typer.Option(
            help="For static: the method whose tensions must hold the weight; else any tensions.",
            autocompletion=words_among(list(METHODS)),
        ),
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
    boxes_mesh: Annotated[
        Path | None,
        typer.Option(help=f"File for the boxes as cells of VTK: {', '.join(GRID_ENDINGS)}."),
    ] = None,
    exit_error: Annotated[
        float, typer.Option(help="Proven for exit points off by up to so much [m].")
    ] = 0.0,
    anchor_error: Annotated[
        float, typer.Option(help="Proven for anchor points off by up to so much [m].")
    ] = 0.0,
    limits: Limits = None,
    mass: Mass = None,
    wrench: Wrench = None,
    out: Out = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
) -> int:
    """Finds where a robot can work: kinds of workspaces, what they have in common, and measures.

    Run again with the same arguments, it continues where it was stopped or killed.
    """
    formats = parse_formats(figure_format)
    check_workers(workers)
    check_mass(mass, zero=False)
    _check_files(hull, mesh, certify, boxes_mesh)
    region = parse_box(box)
    if unbounded and (hull is None or region is not None):
        found = "no --hull" if hull is None else "--box"
        raise WorkspaceError(f"--unbounded: found {found}; accepted: with --hull, without --box")
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
            loaded, None if obstacles is None else load_obstacles(obstacles), exit_free,
            anchor_free, pulleys,
        ),
        scenario=scenario,
        pulleys=pulleys,
        method=method,
    )  # fmt: skip
    corners = grid_box(defaults.lower, defaults.upper, defaults.step, region)
    question = make_workspace_question(
        robot,
        kind.split(","),
        parse_grid(grid, parse_turns(orientation or []), *corners),
        () if measure is None else measure.split(","),
        orientations,
        asked,
    )
    console = message_console()
    search = None
    if certify:
        if boxes < 1:
            raise WorkspaceError(f"--boxes: found {boxes}; accepted: at least 1")
        search = box_search(question, loaded, (exit_error, anchor_error), region)
    seen, bound = None, None
    if hull is not None:
        bound = hull_bound(loaded, region, unbounded)
        center = np.array(parse_numbers("--hull", hull, (3,), "x,y,z [m]"))
        with working(console, "Casting rays"):
            seen = question_hull(question, loaded, center, rays, tolerance, bound)
    some = question.kinds[0] if len(question.kinds) == 1 else f"{len(question.kinds)}-kinds"
    name = f"{question.robot}-{some}"
    folder = out if out is not None else default_folder("workspace", name, question.arguments())
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
        proven = None if search is None else _certified(search, boxes, folder, console)
        drawn = WorkspaceDrawings(run.workspace, seen, proven, bound, search)
        with working(console, "Writing results"):
            told = drawn.write(folder, mesh, boxes_mesh)
            write_json(folder / RESULTS, told)
            from cdpr_drake.analyses.workspaces import workspace_pictures

            page, note = workspace_page(run.workspace, loaded, seen, proven)
            pictures = workspace_pictures(run.workspace, formats, proven)
            failed = write_pictures(folder, pictures | page)
    say_what_was_asked(console, told, loaded.frame.assumed and region is None)
    if note:
        console.print(f"note: {note}")
    if as_json:
        print_json(told)
    else:
        print_workspace(run.workspace, told, folder)
    code = say_failed(console, failed, shown_path(folder.resolve()), None)
    if proven is not None and not proven.finished:
        console.print("Interrupted; run again with the same arguments to go on with the boxes")
        code = INTERRUPTED
    return say_contradictions(console, told) or code


def _check_files(
    hull: str | None, mesh: Path | None, certify: bool, boxes_mesh: Path | None
) -> None:
    """Refuses files of what was not asked for, or of another kind."""
    if mesh is not None:
        if hull is None:
            raise WorkspaceError("--mesh: found no --hull; accepted: both")
        mesh_ending(mesh, MESH_ENDINGS)
    if boxes_mesh is not None:
        if not certify:
            raise WorkspaceError("--boxes-mesh: found no --certify; accepted: both")
        mesh_ending(boxes_mesh, GRID_ENDINGS)


def _certified(search: BoxSearch, boxes: int, folder: Path, console: Console) -> CertifiedBoxes:
    """Certified boxes, with progress; Ctrl-C ends the search with what is proven by then."""
    stop = StopRequest("Stopping; what is proven is kept")
    with stop.listening(), progress_bar(console) as bar:
        task = bar.add_task("certify", total=boxes, state=STARTING)
        start = time.monotonic()

        def show(judged: int, open_share: float) -> None:
            speed = judged / max(time.monotonic() - start, 1e-3)
            state = f"{judged} boxes, {speed:.0f} per s, {open_share:.1%} open"
            bar.update(task, completed=judged, state=state)

        return certified_boxes(search, boxes, folder, on_progress=show, should_stop=stop)

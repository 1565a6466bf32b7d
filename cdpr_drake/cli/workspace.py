"""`cdpr workspace`: where a robot can work, and how well.

After the command stand the options that are more than a number (`parse_...`), then what it says of
its results.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.front.workspaces import (
    compute_workspace,
    default_box,
    workspace_question,
)
from cdpr_drake.analyses.reporting.output_folder import shown_path
from cdpr_drake.analyses.simulation.break_report import DEFAULT_SAVING, SAVING
from cdpr_drake.analyses.workspaces.break_tasks import NUMBERED
from cdpr_drake.analyses.workspaces.conditions import KINDS, MEASURES
from cdpr_drake.analyses.workspaces.workspace_results import RobotWorkspace
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.grid_options import (
    ForceToResist,
    GridSession,
    GridWords,
    MomentToResist,
    Orientations,
    Out,
    Workers,
    check_mass,
    check_workers,
    default_folder,
    parse_grid,
    parse_turns,
)
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Mass,
    Pulleys,
    ResultsAsJson,
    RobotName,
    Scheduler,
    Wrench,
    named_options,
    parse_formats,
    parse_limits,
    parse_numbers,
    parse_wrench,
)
from cdpr_drake.cli.process import INTERRUPTED
from cdpr_drake.cli.run_endings import report_failures
from cdpr_drake.cli.terminal import print_json, wide_console
from cdpr_drake.errors import StoppedError, WorkspaceError
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from cdpr_drake.workspaces.mesh_files import GRID_ENDINGS, MESH_ENDINGS

FARTHEST = 1e6
"""Largest coordinate of a corner of --box [m]."""


def parse_accelerations(words: str | None) -> SpatialSet | None:
    """The box of --acceleration; None without; raises as `parse_numbers`."""
    if words is None:
        return None
    meaning = "a or a,alpha, each >= 0 [m/s^2, rad/s^2]"
    numbers = parse_numbers("--acceleration", words, (1, 2), meaning)
    if min(numbers) < 0.0:
        raise WorkspaceError(f"--acceleration: found {words!r}; accepted: {meaning}")
    linear, angular = (*numbers, 0.0)[:2]
    return SpatialSet(box=np.array([*[angular] * 3, *[linear] * 3]))


def parse_box(words: str | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Corners of --box, shape (3,) each [m]; None without.

    Raises:
        WorkspaceError: They are not six numbers up to `FARTHEST`, or a lower one is not below its
            upper one.
    """
    if words is None:
        return None
    try:
        spans = [[float(word) for word in part.split(":")] for part in words.split(",")]
    except ValueError:
        spans = []
    good = len(spans) == 3 and all(
        len(span) == 2 and -FARTHEST <= span[0] < span[1] <= FARTHEST for span in spans
    )
    if not good:
        raise WorkspaceError(
            f"--box: found {words!r}; accepted: lower:upper along x, y and z [m], as in "
            f"-0.4:0.4,-0.4:0.4,0:1; no number beyond {FARTHEST:g}"
        )
    lower, upper = np.array(spans).T
    return lower, upper


def parse_velocities(items: list[str]) -> np.ndarray | None:
    """Velocities of --velocity, shape (k, 6); None without; raises as `parse_numbers`."""
    if not items:
        return None
    turns = [parse_numbers("--velocity", one, (3,), "wx,wy,wz [rad/s]") for one in items]
    return np.array([[*one, 0.0, 0.0, 0.0] for one in turns])


CONTRADICTION = 1
"""Exit code where a proof and the grid or the hull say different things."""

BOUNDS = {"frame": "the frame", "box": "--box", "nothing": "nothing"}
ENDS = {"frame": " there", "box": " there", "nothing": " at ten times the frame"}
"""What is said of what bounds a hull, and of the rays that do not end before."""

AGREEING = {"grid": "poses of the grid", "hull": "ends of the hull's rays"}


def print_workspace(found: RobotWorkspace, told: dict[str, Any], folder: Path) -> None:
    """Prints tables of kinds and measures, and lines on hull and boxes."""
    unit = found.volume().unit
    by = "" if told["method"] is None else f", tensions by {told['method']}"
    title = f"{told['robot']}: workspaces, {told['geometry']}{by}"
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False)
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
    if found.is_tilted():
        printer.print(f"axes: {told['axes']}")
    if told["measured"]:
        table = Table(title="Measures inside", box=SIMPLE_HEAD, pad_edge=False)
        table.add_column("measure", no_wrap=True)
        for heading in ("least", "median", "largest"):
            table.add_column(heading, justify="right", no_wrap=True)
        for name, numbers in told["measured"].items():
            if name in NUMBERED:
                continue
            values = [numbers[key] for key in ("least", "median", "largest")]
            table.add_row(
                f"{numbers['title']} [{numbers['unit']}]",
                *("-" if value is None else f"{value:.4g}" for value in values),
            )
        printer.print(table)
    if "broken" in told:
        for words, key in (("worst cable", "worst_cables"), ("best reaction", "best_reactions")):
            counts = ", ".join(f"{name} at {n}" for name, n in told["broken"][key].items())
            printer.print(f"{words} of the poses: {counts or 'none'}")
    if "hull" in told:
        hull = told["hull"]
        printer.print(
            f"hull: {hull['volume_m3']:.4g} m^3, {hull['area_m2']:.4g} m^2, {hull['rays']} rays, "
            f"bounded by {BOUNDS[hull['bounded_by']]}, {hull['why']}; "
            f"{hull['rays_to_the_bound']} of them were cut{ENDS[hull['bounded_by']]}"
        )
    if "certified" in told:
        proven = told["certified"]
        printer.print(
            f"certified, cables {proven['cables']}: all poses in {proven['inside_share']:.2%} of "
            f"the box inside, in {proven['outside_share']:.2%} outside, "
            f"{proven['open_share']:.2%} open; {proven['boxes_judged']} boxes"
        )
    if "refined" in told:
        more = told["refined"]
        printer.print(
            f"boxes within {more['reach_m']:g} m of the way: {more['open_share_before']:.2%} of "
            f"them were open, {more['open_share_after']:.2%} are; {more['boxes_judged']} boxes"
        )
    for name, one in told.get("agreement", {}).items():
        printer.print(
            f"boxes against {AGREEING[name]}: {one['contradictions']} contradictions at "
            f"{one['poses']} of them; {one['in_boxes_proven_inside']} in boxes proven inside, "
            f"{one['in_boxes_proven_outside']} outside"
        )
    printer.print(f"results: {folder}", soft_wrap=True, highlight=False)


def say_what_was_asked(console: Console, told: dict[str, Any], assumed: bool) -> None:
    """Prints the geometry of the cables, and where boxes of an assumed frame are no result.

    Args:
        console: Of messages.
        told: The results for JSON.
        assumed: Whether an assumed frame is where the default grid and boxes lie.
    """
    lines = [f"{told['robot']}: {told['geometry']}"]
    if assumed:
        lines.append(
            "note: the robot's frame was assumed when it was imported; the default grid and the "
            "boxes of --certify lie in it; --box chooses another"
        )
    if told.get("hull", {}).get("bounded_by") == "nothing" and told["hull"]["rays_to_the_bound"]:
        lines.append(
            f"note: {told['hull']['rays_to_the_bound']} rays of the hull do not end: volume and "
            "area are those of what lies within ten times the frame; --box chooses"
        )
    for line in lines:
        console.print(line, soft_wrap=True, markup=False, highlight=False)


def say_contradictions(console: Console, told: dict[str, Any]) -> int:
    """Says where proven boxes say what is not so; returns the exit code, 0 where there is none."""
    code = 0
    for name, one in told.get("agreement", {}).items():
        if not one["contradictions"]:
            continue
        first = ", ".join(f"{x:g}" for x in one["first_contradictions_m_rad"][0])
        console.print(
            f"cdpr: error: proven boxes contradict {one['contradictions']} of {one['poses']} "
            f"{AGREEING[name]}, first at ({first}) [m, rad]: proof or kernel is wrong; do not use "
            "these results, and report them",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip
        code = CONTRADICTION
    return code


OPTIONS = {
    "kinds": "--kind", "measures": "--measure", "orientations": "--orientations",
    "clearance": "--clearance", "method": "--method", "accelerations": "--acceleration",
    "the argument scenario": "--scenario", "force": "--force", "moment": "--moment",
    "required": "--wrench-set", "required, force or moment": "--wrench-set, --force or --moment",
    "hull": "--hull", "unbounded": "--unbounded", "box": "--box", "mesh": "--mesh",
    "certify": "--certify", "boxes": "--boxes", "boxes_mesh": "--boxes-mesh",
    "refine": "--refine", "refine_reach": "--refine-reach", "refine_boxes": "--refine-boxes",
    "exit_error": "--exit-error", "anchor_error": "--anchor-error", "reactions": "--reactions",
    "moving": "--moving", "after": "--after",
}  # fmt: skip
"""Options by the arguments of `compute_workspace`."""


def workspace(
    robot: RobotName,
    kind: Annotated[
        str, typer.Option(help="One or several, separated by commas: " + ", ".join(KINDS) + ".")
    ] = "static",
    measure: Annotated[
        str | None,
        typer.Option(
            help="One or several, separated by commas: "
            + ", ".join(MEASURES)
            + ". A negative capacity-margin says how far outside a pose is."
        ),
    ] = None,
    grid: GridWords = None,
    orientation: Orientations = None,
    orientations: Annotated[
        str,
        typer.Option(
            help="Orientations in which a kind must hold: all (inclusion "
            "workspace) or any (maximal workspace)."
        ),
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
            help="Largest accelerations to give along and about each axis, a,alpha [m/s^2, "
            "rad/s^2]."
        ),
    ] = None,
    velocity: Annotated[
        list[str] | None,
        typer.Option(
            help="Angular velocity wx,wy,wz of the platform [rad/s]; may be repeated; "
            "default: none."
        ),
    ] = None,
    clearance: Annotated[
        float, typer.Option(help="Least distance of cables and platform from everything else [m].")
    ] = 0.0,
    obstacles: Annotated[
        Path | None,
        typer.Option(
            help="YAML file of what stands in the frame: boxes, spheres, capsules, meshes."
        ),
    ] = None,
    anchor_free: Annotated[
        float | None,
        typer.Option(
            help="Length of cables next to anchor points that is not compared with the "
            "platform [m]."
        ),
    ] = None,
    exit_free: Annotated[
        float | None,
        typer.Option(
            help="Length of cables next to exit points that is not compared with the frame [m]."
        ),
    ] = None,
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Scenario whose camera and target count; for dynamic-single-failure, cables, "
            "winches and torque_control."
        ),
    ] = None,
    hull: Annotated[
        str | None,
        typer.Option(
            help="Also compute the hull seen from x,y,z [m], by rays that end at the frame at "
            "the latest; a frame that was assumed at import does not end them."
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
        bool, typer.Option("--unbounded", help="Let nothing bound the hull.")
    ] = False,
    pulleys: Pulleys = True,
    method: Annotated[
        str | None,
        typer.Option(
            help="For static: tension distribution method that must hold the weight; default: "
            "any tensions.",
            autocompletion=words_among(list(METHODS)),
        ),
    ] = None,
    reactions: Annotated[
        str | None,
        typer.Option(
            help="For dynamic-single-failure: one or several, separated by commas: "
            f"{', '.join(SAVING)}; without it {', '.join(DEFAULT_SAVING)}."
        ),
    ] = None,
    moving: Annotated[
        str | None,
        typer.Option(
            help="For dynamic-single-failure: velocity x,y,z of the platform when a cable "
            "breaks [m/s]; default: at rest."
        ),
    ] = None,
    after: Annotated[
        float,
        typer.Option(help="For dynamic-single-failure: time simulated after a break [s]."),
    ] = 2.0,
    rays: Annotated[int, typer.Option(help="Largest number of rays of the hull.")] = 10_000,
    tolerance: Annotated[
        float, typer.Option(help="Distance from the border within which rays of the hull end [m].")
    ] = 1e-3,
    mesh: Annotated[
        Path | None,
        typer.Option(help=f"File for the hull's triangles: {', '.join(MESH_ENDINGS)}."),
    ] = None,
    certify: Annotated[
        bool, typer.Option(help="Also prove boxes of poses to be inside or outside all kinds.")
    ] = False,
    boxes: Annotated[int, typer.Option(help="Largest number of boxes to judge.")] = 200_000,
    boxes_mesh: Annotated[
        Path | None,
        typer.Option(help=f"File for the boxes as cells of VTK: {', '.join(GRID_ENDINGS)}."),
    ] = None,
    refine: Annotated[
        str | None,
        typer.Option(
            help="With --certify: corners x,y,z of a way of Po [m], with ; between them, about "
            "which open boxes are cut further."
        ),
    ] = None,
    refine_reach: Annotated[
        float,
        typer.Option(
            help="With --refine: largest distance of Po from the way along each axis [m]."
        ),
    ] = 0.05,
    refine_boxes: Annotated[
        int, typer.Option(help="With --refine: largest number of boxes to judge for it.")
    ] = 100_000,
    exit_error: Annotated[
        float,
        typer.Option(help="With --certify: error of exit points up to which the proof holds [m]."),
    ] = 0.0,
    anchor_error: Annotated[
        float,
        typer.Option(
            help="With --certify: error of anchor points up to which the proof holds [m]."
        ),
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
    """Finds where a robot can work: kinds of workspaces, their intersection, and measures.

    The same command continues an interrupted one.
    """
    formats = parse_formats(figure_format)
    check_workers(workers)
    check_mass(mass, zero=False)
    region = parse_box(box)
    center = None if hull is None else parse_numbers("--hull", hull, (3,), "x,y,z [m]")
    way = None if refine is None else [
        parse_numbers("--refine", corner, (3,), "corners x,y,z [m], with ; between")
        for corner in refine.split(";")
    ]  # fmt: skip
    with named_options(OPTIONS | {f"scenario {scenario}": f"--scenario {scenario}"}):
        asked: dict[str, Any] = {
            "kinds": kind.split(","),
            "grid": parse_grid(grid, parse_turns(orientation or []), *default_box(robot, region)),
            "measures": () if measure is None else measure.split(","),
            "orientations": orientations, "box": region, "limits": parse_limits(limits),
            "mass": mass, "wrench": parse_wrench(wrench), "required": wrench_set, "force": force,
            "moment": moment, "accelerations": parse_accelerations(acceleration),
            "velocities": parse_velocities(velocity or []), "clearance": clearance,
            "obstacles": obstacles, "exit_free": exit_free, "anchor_free": anchor_free,
            "scenario": scenario, "pulleys": pulleys, "method": method, "after": after,
            "reactions": None if reactions is None else reactions.split(","),
            "moving": None if moving is None else parse_numbers(
                "--moving", moving, (3,), "x,y,z [m/s]"
            ),
        }  # fmt: skip
        question = workspace_question(robot, **asked)
        some = question.kinds[0] if len(question.kinds) == 1 else f"{len(question.kinds)}-kinds"
        name = f"{question.robot}-{some}"
        folder = out if out is not None else default_folder("workspace", name, question.arguments())
        with GridSession(folder, question.robot) as session:
            try:
                found = compute_workspace(
                    robot, **asked, hull=center, unbounded=unbounded, rays=rays,
                    tolerance=tolerance, mesh=mesh, certify=certify, boxes=boxes,
                    exit_error=exit_error, anchor_error=anchor_error, boxes_mesh=boxes_mesh,
                    refine=way, refine_reach=refine_reach, refine_boxes=refine_boxes,
                    folder=folder, workers=scheduler or workers, formats=formats, session=session,
                )  # fmt: skip
            except StoppedError:
                return session.interrupted()
    told = found.as_dict()
    say_what_was_asked(session.console, told, found.robot.frame.assumed and region is None)
    if as_json:
        print_json(told)
    else:
        print_workspace(found, told, folder)
    code = report_failures(session.console, found.failed, shown_path(folder.resolve()), None)
    if found.interrupted:
        session.say("Interrupted; run again with the same arguments to go on with the boxes")
        code = INTERRUPTED
    return say_contradictions(session.console, told) or code

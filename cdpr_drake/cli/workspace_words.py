"""What `cdpr workspace` says of its results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.workspaces import RobotWorkspace
from cdpr_drake.cli.terminal import wide_console

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
    title = f"{told['robot']}: workspaces, cables {told['cables']}{by}"
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
            f"bounded by {BOUNDS[hull['bounded_by']]}, {hull['why']}; "
            f"{hull['rays_to_the_bound']} of them were cut{ENDS[hull['bounded_by']]}"
        )
    if "certified" in told:
        proven = told["certified"]
        printer.print(
            f"certified, cables {proven['cables']}: {proven['inside_share']:.2%} of the box "
            f"inside, {proven['outside_share']:.2%} outside, {proven['open_share']:.2%} open; "
            f"{proven['boxes_judged']} boxes"
        )
    for name, one in told.get("agreement", {}).items():
        printer.print(
            f"boxes against {AGREEING[name]}: {one['contradictions']} contradictions at "
            f"{one['poses']} of them; {one['in_boxes_proven_inside']} in boxes proven inside, "
            f"{one['in_boxes_proven_outside']} outside"
        )
    printer.print(f"results: {folder}", soft_wrap=True, highlight=False)


def say_what_was_asked(console: Console, told: dict[str, Any], assumed: bool) -> None:
    """Says in the log how cables run, and where boxes of an assumed frame are no result.

    Args:
        console: Of messages.
        told: The results for JSON.
        assumed: Whether an assumed frame is where the default grid and boxes lie.
    """
    lines = [f"{told['robot']}: cables {told['cables']}"]
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

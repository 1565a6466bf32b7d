"""`cdpr simulate --compare-reactions`: one break of a cable, once for each reaction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.front.failures import BreakReactions, compare_reactions
from cdpr_drake.analyses.reporting.output_folder import shown_path
from cdpr_drake.cli.command_session import CommandSession
from cdpr_drake.cli.options import named_options
from cdpr_drake.cli.process import INTERRUPTED
from cdpr_drake.cli.run_endings import report_failures
from cdpr_drake.cli.terminal import print_json, wide_console
from cdpr_drake.errors import StoppedError

STOPPING = "Stopping: nothing is written; Ctrl-C again ends this now"
"""Answer to the first Ctrl-C."""

OPTIONS = {
    "cable": "--compare-reactions", "time": "--break-time", "after": "--after",
    "reactions": "--reactions",
}  # fmt: skip
"""Options by the arguments of `compare_reactions`."""


def tell_reactions(
    scenario: str,
    cable: int,
    of_break: Mapping[str, Any],
    out: Path | None,
    *,
    overrides: Sequence[str],
    formats: Sequence[str],
    overwrite: bool,
    as_json: bool,
) -> int:
    """Compares reactions, prints what they are worth, and returns the exit code.

    Args:
        scenario: Name or path.
        cable: Number of the cable that breaks, from 0.
        of_break: `time`, `after`, and `reactions` as one text; None: as `compare_reactions` has it.
        out: Folder of results; None: nothing is written.
        overrides: Items "key=value" of the scenario.
        formats: Endings of the file of the figure.
        overwrite: Whether results in the folder may be replaced.
        as_json: Whether JSON is printed.
    """
    given = {name: value for name, value in of_break.items() if value is not None}
    if "reactions" in given:
        given["reactions"] = [word.strip() for word in given["reactions"].split(",")]
    with CommandSession(STOPPING, out or Path()) as session, named_options(OPTIONS):
        try:
            found = compare_reactions(
                scenario, cable, overrides=overrides, folder=out, overwrite=overwrite,
                formats=formats, session=session, **given,
            )  # fmt: skip
        except StoppedError as problem:
            session.say(f"Interrupted: {problem}")
            return INTERRUPTED
    if as_json:
        print_json(found.as_dict())
    else:
        _print(found)
    if out is None:
        return 0
    folder = shown_path(out.resolve())
    if not as_json:
        wide_console().print(f"results: {folder}", soft_wrap=True, highlight=False)
    return report_failures(session.console, found.failed, folder, None)


def _print(found: BreakReactions) -> None:
    """Prints a row a reaction."""
    title = f"{found.scenario}: {found.cable} breaks at {found.time:g} s"
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("reaction", no_wrap=True)
    for heading in (
        "excursion [mm]", "turn [deg]", "speed [m/s]", "tension [N]", "slack [s]", "at rest [s]",
    ):  # fmt: skip
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("ends")
    for name, row in found.rows.items():
        out = f", leaves the frame at {row['impact_m_s']:.2f} m/s" if row["leaves"] else ""
        table.add_row(
            name, f"{1e3 * row['excursion_m']:.1f}", f"{np.degrees(row['turn_rad']):.1f}",
            f"{row['largest_speed_m_s']:.3f}", f"{row['tension_n']:.1f}", f"{row['slack_s']:.2f}",
            f"{row['rest_s']:.2f}", row["outcome"] + out,
        )  # fmt: skip
    wide_console(110).print(table)

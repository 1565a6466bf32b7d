"""What `cdpr calibrate` and `cdpr identify` share: options of a robot with a log, and its end."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.front.fitted_robots import FittedRobot
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.cli.command_session import CommandSession, shown
from cdpr_drake.cli.completion import robot_words
from cdpr_drake.cli.run_endings import MISFIT, report_failures
from cdpr_drake.cli.terminal import print_json, wide_console
from cdpr_drake.errors import CdprError

RobotOrCampaign = Annotated[
    str | None,
    typer.Argument(
        help="Robot by name, or path of a robot file.",
        autocompletion=robot_words,
        show_default=False,
    ),
]
LogOrCampaign = Annotated[
    Path | None,
    typer.Argument(help="Log, text with columns.", metavar="LOG", show_default=False),
]
TrackerLate = Annotated[
    float | None, typer.Option(help="By how much the tracker's poses are late [s].")
]
ResultsBelowRuns = Annotated[
    Path | None, typer.Option(help="Results folder; default: a new one below runs/.")
]
STOPPING = ""
"""Nothing is answered to Ctrl-C, which ends a fit at once."""


def check_campaign(robot: str | None, log: Path | None) -> None:
    """Refuses a robot or a log beside a campaign.

    Raises:
        CdprError: There is one.
    """
    if robot is not None or log is not None:
        raise CdprError(f"--campaign: found beside {log or robot}; accepted: without robot, log")


def robot_and_log(command: str, robot: str | None, log: Path | None) -> tuple[str, Path]:
    """Both, where a command has no campaign.

    Raises:
        CdprError: One of them is missing.
    """
    if robot is None or log is None:
        raise CdprError(f"{command}: found no robot or no log; accepted: both, or --campaign")
    return robot, log


def results_below_runs(out: Path | None, name: str) -> Path:
    """The results folder that was asked for, or a free one."""
    return out if out is not None else free_folder(Path("runs") / name)


def comma_words(option: str) -> tuple[str, ...]:
    """Words of an option, with commas between them."""
    return tuple(word.strip() for word in option.split(",") if word.strip())


def tell_fit(found: FittedRobot, session: CommandSession, as_json: bool) -> int:
    """Prints JSON, or tables and where the results are.

    Args:
        found: What was found, in its folder.
        session: Who followed it.
        as_json: Whether JSON is wanted.

    Returns:
        The exit code; `MISFIT` where what was found does not fit what was measured.
    """
    session.say_kept()
    folder = shown(found.folder)
    if as_json:
        print_json(found.as_dict())
    else:
        printer = wide_console(140)
        for table in found.tables():
            printer.print(table)
        printer.print(f"results: {folder}")
    missing = report_failures(session.console, found.failed, folder, None)
    return missing if found.fits else MISFIT

"""What `cdpr calibrate` and `cdpr identify` share: options of a robot with a log, and its end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from cdpr_drake.analyses.calibration.log_fit import LogFit
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.output_folder import results_folder, shown_path
from cdpr_drake.analyses.visualization.figure_files import write_figures
from cdpr_drake.cli.completion import robot_words
from cdpr_drake.cli.run_endings import MISFIT, report_failures, report_kept_files
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
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
    Path | None, typer.Option(help="Results folder; without it, a new one below runs/.")
]


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


class Ending(NamedTuple):
    """What is done with results: printed as JSON, put over others, drawn in these formats."""

    as_json: bool
    overwrite: bool
    formats: tuple[str, ...]


Work = Callable[[Path, Callable[[str], None]], LogFit]
"""Writes results into the folder that it gets; may tell how far it is."""


def write_and_tell(title: str, folder: Path, ending: Ending, work: Work) -> int:
    """Has results written into a folder; prints JSON, or tables and where the results are.

    Figures come last, when the results have their place: one that cannot be written costs nothing
    else.

    Args:
        title: What is done, for whoever waits.
        folder: Of the results.
        ending: What is done with them.
        work: Writes them.

    Returns:
        The exit code; `MISFIT` where what was found does not fit what was measured.

    Raises:
        OutputFolderError: The folder cannot be written, or holds other results.
    """
    console = message_console()
    with results_folder(folder, ending.overwrite) as results, working(console, title) as say:
        fit = work(results.path, say)
        published = results.publish()
        say("figures")
        failed = write_figures(published, fit.drawings, ending.formats)
    report_kept_files(console, results.kept)
    folder = shown_path(published)
    if ending.as_json:
        print_json(fit.numbers)
    else:
        printer = wide_console(140)
        for table in fit.tables:
            printer.print(table)
        printer.print(f"results: {folder}")
    missing = report_failures(console, failed, folder, None)
    return missing if fit.fits else MISFIT

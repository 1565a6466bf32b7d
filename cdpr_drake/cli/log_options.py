"""The end of commands that fit a robot to a log."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cdpr_drake.analyses.frame.folder import shown_path
from cdpr_drake.analyses.front.fitted_robots import FittedRobot
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.cli.process import MISFIT
from cdpr_drake.cli.sessions import Answer, FollowedSession, failures
from cdpr_drake.errors import CdprError


def check_campaign(robot: object, log: object) -> None:
    """Refuses a robot, a log or what goes with them beside a campaign.

    Raises:
        CdprError: There is one.
    """
    if robot is not None or log is not None:
        raise CdprError(f"campaign: found beside {log or robot}; accepted: without robot, log")


def robot_and_log(command: str, robot: Any, log: Path | None) -> tuple[Any, Path]:
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


def fit_answer(fit: FittedRobot, session: FollowedSession) -> Answer:
    """Tables of a fit and where the results are; `MISFIT` if it does not fit what was measured."""
    folder = shown_path(fit.folder or Path())
    missing = [f"The data is complete in {folder}"] if fit.failed else []
    return Answer(
        numbers=fit.as_dict(), printed=[*fit.tables(), f"results: {folder}"],
        words=[*session.kept(), *missing], code=0 if fit.fits else MISFIT,
        failed=failures(fit.failed, folder), drawing=fit.plot,
    )  # fmt: skip

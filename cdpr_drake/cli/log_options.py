"""Options of commands that read logs, and the end of those that fit a robot to one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from cdpr_drake.analyses.frame.folder import shown_path
from cdpr_drake.analyses.frame.words import one_of, words
from cdpr_drake.analyses.front.fitted_robots import FittedRobot
from cdpr_drake.analyses.logs.log_formats import AUTO, LOG_READERS
from cdpr_drake.analyses.logs.log_request import (
    LogRequest,
    axes_rotation,
    checked_units,
    is_rate,
    read_mapping,
)
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.cli.process import MISFIT
from cdpr_drake.cli.sessions import Answer, FollowedSession, failures
from cdpr_drake.errors import CdprError


def _units(word: str) -> dict[str, str]:
    pairs = [item.strip().partition("=") for item in word.split(",")]
    if not all(mark for _, mark, _ in pairs):
        raise ValueError(word)
    return checked_units({dimension: unit for dimension, _, unit in pairs})


def _rate(word: str) -> float:
    rate = float(word)
    if not is_rate(rate):
        raise ValueError(word)
    return rate


LogFormat: TypeAlias = Annotated[str, one_of((*LOG_READERS, AUTO))]
Units: TypeAlias = Annotated[
    dict[str, str] | None,
    words(_units, "DIMENSION=UNIT, as length=mm, or several with commas", "DIMENSION=UNIT,...",
          name="--unit"),
]  # fmt: skip
Mapping: TypeAlias = Annotated[Path | None, words(Path, "the path of a YAML file", "FILE")]
Rate: TypeAlias = Annotated[float | None, words(_rate, "above 0 [1/s]", "RATE")]
Axes: TypeAlias = Annotated[Any, words(axes_rotation, "three axes, as -z,-x,y", "AXIS,AXIS,AXIS")]


def log_request(
    cables: Sequence[str] | None = None, *, unit: dict[str, str] | None, mapping: Path | None,
    rate: float | None, body: str | None, axes: Any,
) -> LogRequest:  # fmt: skip
    """What options say of a log.

    Raises:
        CdprError: Names of cables are empty or the same.
    """
    if cables is not None and (not all(cables) or len(set(cables)) < len(cables)):
        raise CdprError(
            f"cables: found {', '.join(cables)!r}; accepted: different names, as A,B,C,D"
        )
    return LogRequest(
        cables=None if cables is None else tuple(cables), units=unit or {}, body=body, rate=rate,
        mapping=None if mapping is None else read_mapping(mapping), R_WF=axes,
    )  # fmt: skip


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

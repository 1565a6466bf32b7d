"""A robot's constants from logs: of poses, and of motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.calibration.identification_report import identification_fit
from cdpr_drake.analyses.calibration.identification_task import (
    UNKNOWN,
    Identification,
    IdentificationTask,
)
from cdpr_drake.analyses.calibration.identification_task import identify as identify_log
from cdpr_drake.analyses.calibration.log_file import CalibrationLog, read_log
from cdpr_drake.analyses.calibration.tracker import shifted_log
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.fitted_robots import FittedRobot, Keeping, kept_fit
from cdpr_drake.analyses.front.session import Say, Session
from cdpr_drake.errors import CalibrationError, IdentificationError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import as_kind

MOST_PARAMETERS = 7
"""So many are shown where an identification shows itself."""


@dataclass(frozen=True, eq=False, repr=False)
class RobotIdentification(FittedRobot, Identification):
    """An `Identification` that shows and draws itself."""

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: the first parameters, found and believed."""
        result = self.result
        sigmas = np.sqrt(np.diag(result.covariance))
        found = zip(result.names, result.values, sigmas, result.units, result.before, strict=True)
        rows = [
            (name, f"{value:.5g} +- {sigma:.2g} {unit}, believed {before:.5g}")
            for name, value, sigma, unit, before in found
        ][:MOST_PARAMETERS]
        return f"Identification of {self.task.robot.name}: {result.status}", [
            ("residuals", f"{result.spread:.3g} times what sigmas say, {result.degrees} degrees"),
            *rows,
            *(("remark", words) for words in self.remarks[:1]),
        ]


@verb()
def identify(
    robot: Robot | str | Path,
    log: CalibrationLog | Path | str,
    unknown: str | Sequence[str] = UNKNOWN,
    *,
    validate: CalibrationLog | Path | str | None = None,
    tracker_late: float | None = None,
    folder: Path | str | None = None,
    overwrite: bool = False,
    formats: Sequence[str] = DEFAULT_FORMATS,
    say: Say | None = None,
    session: Session | None = None,
    **options: Any,
) -> RobotIdentification:
    """Finds a robot's dynamics in a log of a motion.

    Args:
        robot: The robot as it is believed, or its name or path.
        log: The log, or its file; columns as `cdpr identify --help` says.
        unknown: Groups of `identification.parameters.GROUPS`.
        validate: Log of another motion, which is predicted and not fitted, or its file.
        tracker_late: By how much the tracker's poses are late [s]; None: they must be in time.
        folder: Where identification.json, robot.yaml and figures are written; None: nowhere.
        overwrite: Whether results in the folder may be replaced.
        formats: Endings of the files of figures.
        say: Called with a line on what is done now.
        session: Instead of it: who follows the identification.
        options: Fields of `IdentificationTask`: `common`, `priors`, `bandwidth` [Hz],
            `sigma_lengths` [m], `pulleys`, `outliers`.

    Raises:
        IdentificationError: A log does not hold, or does not tell, what is asked; names it.
        DataFileError: A file cannot be read.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    loaded = as_robot(robot, "identify")
    known = [field.name for field in fields(IdentificationTask)]
    _check_names(options, [k for k in known if k not in ("robot", "unknown")], IdentificationError)
    read = _read(loaded, log, tracker_late)
    other = None if validate is None else _read(loaded, validate, tracker_late)
    given = {"check_clock": tracker_late is None} | options
    task = IdentificationTask(robot=loaded, unknown=_words(unknown), **given)

    def work(folder: Path | None, say: Say) -> RobotIdentification:
        found = identify_log(task, read, other, say)
        fit = identification_fit(found)
        if folder is not None:
            fit.write(folder)
        return as_kind(RobotIdentification, found, fit=fit)

    keeping = Keeping(folder, overwrite, formats)
    return kept_fit(keeping, session or Session(say=say), f"Identifying {loaded.name}", work)


def _read(robot: Robot, log: CalibrationLog | Path | str, late: float | None) -> CalibrationLog:
    if isinstance(log, str | Path):
        log = read_log(Path(log), [cable.name for cable in robot.cables])
    return log if late is None else shifted_log(log, late)


def _words(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _check_names(
    given: Mapping[str, Any], known: Sequence[str],
    error: type[CalibrationError] | type[IdentificationError],
) -> None:  # fmt: skip
    for name in given:
        if name not in known:
            raise error(f"{name!r} is unknown; {closest(name, known)}")

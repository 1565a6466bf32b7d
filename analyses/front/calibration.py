"""A robot's constants from logs: of poses, and of motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.calibration.calibration_report import calibration_fit
from cdpr_drake.analyses.calibration.calibration_request import (
    HOMING,
    CalibrationTask,
    Sigmas,
    TagPlace,
    default_unknown,
    is_homing,
)
from cdpr_drake.analyses.calibration.calibration_task import Calibration
from cdpr_drake.analyses.calibration.calibration_task import calibrate as calibrate_log
from cdpr_drake.analyses.calibration.identification_report import identification_fit
from cdpr_drake.analyses.calibration.identification_task import (
    UNKNOWN,
    Identification,
    IdentificationTask,
)
from cdpr_drake.analyses.calibration.identification_task import identify as identify_log
from cdpr_drake.analyses.calibration.pose_proposal import next_poses
from cdpr_drake.analyses.calibration.tag_file import read_tags
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.fitted_robots import FittedRobot, Keeping, kept_fit
from cdpr_drake.analyses.front.session import Say, Session
from cdpr_drake.analyses.logs.measurements import Measurements, read_measurements
from cdpr_drake.errors import CalibrationError, IdentificationError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import as_kind

MOST_PARAMETERS = 7
"""So many are shown where an identification shows itself."""

UNKNOWN_ZERO = (
    "its motor angles count from somewhere unknown; say at which pose they were zero: zero in "
    "Python, --zero home or --zero POSE"
)
"""What is often missing where a log with motor angles is refused."""

ASKED = ("priors", "mount", "image_size", "start", "rest", "outliers", "zero", "bounds", "hold_out")
KEPT = ("propose", "overwrite", "formats")
"""What `calibrate` takes by name besides: fields of its task, and what is done with results."""


@dataclass(frozen=True, eq=False, repr=False)
class RobotCalibration(FittedRobot, Calibration):
    """A `Calibration` that shows and draws itself."""

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        result = self.result
        told = int(np.sum(np.isfinite(result.std)))
        fits = (f"{kind} {fit.rms:.3g}" for kind, fit in result.residuals.items())
        return f"Calibration of {self.task.robot.name}: {result.status}", [
            ("parameters", f"{told} of {len(result.names)} told by {self.log.count} poses"),
            ("residuals", "rms in sigmas: " + ", ".join(fits)),
            ("not told", ", ".join((*result.gauge, *result.prior_only)) or "nothing"),
            *(("misfit", words) for words in self.misfit[:2]),
            *(("remark", words) for words in self.remarks[:3]),
        ]


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
def calibrate(
    robot: Robot | str | Path,
    log: Measurements | Path | str,
    unknown: str | Sequence[str] | None = None,
    *,
    sigmas: Sigmas | Mapping[str, float] | None = None,
    tags: Mapping[int, TagPlace] | Path | str | None = None,
    tag_size: float | None = None,
    tracker_late: float | None = None,
    folder: Path | str | None = None,
    say: Say | None = None,
    session: Session | None = None,
    **options: Any,
) -> RobotCalibration:
    """Finds a robot's constants in a log of what was measured at poses of its platform.

    Args:
        robot: The robot as it is believed, or its name or path.
        log: The log, or its file; columns as `cdpr calibrate --help` says.
        unknown: Groups of `calibration.parameters.GROUPS`, and names of parameters; None: exit and
            anchor points, of a point mass exit points; of a robot with fewer cables than degrees of
            freedom without a tracker, from where its sensors count.
        sigmas: Standard deviations of what was measured: `Sigmas`, or some of its fields by name.
        tags: What is known of tags by number, or a file of it.
        tag_size: Instead of it: edge of all tags [m].
        tracker_late: By how much the tracker's poses are late [s].
        folder: Where results.json, robot.yaml and figures are written; None: nowhere.
        say: Called with a line on what is done now.
        session: Instead of it: who follows the calibration.
        options: Fields of `CalibrationTask`: `priors`, `mount`, `image_size`, `start`, `rest`,
            `outliers`, `zero`, `bounds`, `hold_out`. `propose`: also proposes so many poses that
            would tell most next.
            `overwrite`: whether results in the folder may be replaced. `formats`: endings of the
            files of figures.

    Returns:
        What was found; its status is "misfit" where it does not fit what was measured.

    Raises:
        CalibrationError: The log does not hold, or does not tell, what is asked; names it.
        DataFileError: A file cannot be read.
        OutputFolderError: The folder holds other things, or cannot be written.
    """
    loaded = as_robot(robot, "calibrate")
    _check_names(options, (*ASKED, *KEPT), CalibrationError)
    read, places = _inputs(loaded, log, tags, tag_size, tracker_late)
    asked = {name: options[name] for name in ASKED if name in options}
    for pose in ("start", "zero"):
        if asked.get(pose) is not None:
            asked[pose] = as_pose(loaded, asked[pose])
    usual = Sigmas()
    if unknown is None:
        unknown = default_unknown(loaded, read)
        usual = HOMING if is_homing(loaded, read) else usual
    task = CalibrationTask(
        robot=loaded, unknown=_words(unknown), sigmas=_sigmas(sigmas, usual), tags=places, **asked
    )

    def work(folder: Path | None, say: Say) -> RobotCalibration:
        try:
            found = calibrate_log(task, read, say)
        except CalibrationError as problem:
            if read.angles is not None and task.zero is None:
                problem.add_note(UNKNOWN_ZERO)
            raise
        fit = calibration_fit(found, *proposed_poses(found, options.get("propose"), folder, say))
        if folder is not None:
            fit.write(folder)
        return as_kind(RobotCalibration, found, fit=fit)

    keeping = Keeping(
        folder, options.get("overwrite", False), options.get("formats", DEFAULT_FORMATS)
    )
    return kept_fit(keeping, session or Session(say=say), f"Calibrating {loaded.name}", work)


def proposed_poses(
    found: Calibration, count: int | None, folder: Path | None, say: Say
) -> tuple[dict[str, Any], list[Table]]:
    """The poses that would tell most next, written; what JSON and terminal say of them.

    Args:
        found: What was found so far.
        count: Number of poses; None: none.
        folder: Where next_poses.csv goes; None: nowhere.
        say: Called with a line on what is done now.

    Raises:
        CalibrationError: None are wanted, or the robot that was found rests at too few poses.
    """
    if count is None:
        return {}, []
    if count < 1:
        raise CalibrationError(f"propose: found {count}; accepted: at least 1")
    proposed = next_poses(found, count, say)
    if folder is not None:
        proposed.write(folder)
    return {"next_poses": proposed.as_dict()}, [proposed.table()]


def _inputs(
    robot: Robot,
    log: Measurements | Path | str,
    tags: Mapping[int, TagPlace] | Path | str | None,
    tag_size: float | None,
    tracker_late: float | None,
) -> tuple[Measurements, dict[int, TagPlace]]:
    """The log and what is known of tags; arguments, and what is raised, as of `calibrate`."""
    if tags is not None and tag_size is not None:
        raise CalibrationError("tag_size: found beside tags; accepted: one of them")
    read = _read(robot, log, tracker_late)
    if tag_size is not None:
        if not 0.0 < tag_size < 1e3:
            raise CalibrationError(f"tag_size: found {tag_size:g}; accepted: > 0 [m]")
        return read, dict.fromkeys(read.corners, TagPlace(tag_size))
    if isinstance(tags, str | Path):
        return read, read_tags(Path(tags))
    return read, dict(tags or {})


@verb()
def identify(
    robot: Robot | str | Path,
    log: Measurements | Path | str,
    unknown: str | Sequence[str] = UNKNOWN,
    *,
    validate: Measurements | Path | str | None = None,
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


def _read(robot: Robot, log: Measurements | Path | str, late: float | None) -> Measurements:
    if isinstance(log, str | Path):
        log = read_measurements(Path(log), [cable.name for cable in robot.cables])
    return log if late is None else log.shifted(late)


def _words(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _sigmas(given: Sigmas | Mapping[str, float] | None, usual: Sigmas) -> Sigmas:
    if isinstance(given, Sigmas):
        return given
    _check_names(given or {}, [field.name for field in fields(Sigmas)], CalibrationError)
    return replace(usual, **(given or {}))


def _check_names(
    given: Mapping[str, Any], known: Sequence[str],
    error: type[CalibrationError] | type[IdentificationError],
) -> None:  # fmt: skip
    for name in given:
        if name not in known:
            raise error(f"{name!r} is unknown; {closest(name, known)}")

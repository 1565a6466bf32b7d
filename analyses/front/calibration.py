"""A robot's constants from logs: of poses, and of motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.calibration.calibrated_robots import calibrated_robot
from cdpr_drake.analyses.calibration.calibration_report import (
    calibration_dict,
    calibration_drawings,
)
from cdpr_drake.analyses.calibration.calibration_request import CalibrationTask, Sigmas, TagPlace
from cdpr_drake.analyses.calibration.calibration_task import Calibration
from cdpr_drake.analyses.calibration.calibration_task import calibrate as calibrate_log
from cdpr_drake.analyses.calibration.identification_report import (
    identification_dict,
    identification_drawings,
)
from cdpr_drake.analyses.calibration.identification_task import (
    UNKNOWN,
    Identification,
    IdentificationTask,
)
from cdpr_drake.analyses.calibration.identification_task import identify as identify_log
from cdpr_drake.analyses.calibration.log_file import CalibrationLog, read_log
from cdpr_drake.analyses.calibration.tag_file import read_tags
from cdpr_drake.analyses.calibration.tracker import shifted_log
from cdpr_drake.errors import CalibrationError, IdentificationError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import Summarized, as_kind

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Say = Callable[[str], None]
"""Told what is done now."""

GEOMETRY = ("exit_points", "anchor_points")
"""What `calibrate` looks for where nothing else is said."""

MOST_PARAMETERS = 7
"""So many are shown where an identification shows itself."""

OPTIONS = ("priors", "mount", "image_size", "start", "rest", "outliers")
"""What `calibrate` takes by name besides."""


class RobotCalibration(Summarized, Calibration):
    """A `Calibration` that shows and draws itself."""

    def as_dict(self) -> dict[str, Any]:
        """For JSON, as `cdpr calibrate --json` prints it."""
        return calibration_dict(self)

    def plot(self) -> Figure:
        """Residuals and parameters."""
        return next(iter(calibration_drawings(self).values()))()

    def robot(self) -> Robot:
        """The calibrated robot."""
        return calibrated_robot(self.task.robot, self.result, self.mount)[0]

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


class RobotIdentification(Summarized, Identification):
    """An `Identification` that shows and draws itself."""

    def as_dict(self) -> dict[str, Any]:
        """For JSON, as `cdpr identify --json` prints it."""
        return identification_dict(self)

    def plot(self) -> Figure:
        """Wrenches as measured and as predicted."""
        return next(iter(identification_drawings(self).values()))()

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


def calibrate(
    robot: Robot | str | Path,
    log: CalibrationLog | Path | str,
    unknown: str | Sequence[str] = GEOMETRY,
    *,
    sigmas: Sigmas | Mapping[str, float] | None = None,
    tags: Mapping[int, TagPlace] | Path | str | None = None,
    tag_size: float | None = None,
    tracker_late: float | None = None,
    say: Say | None = None,
    **options: Any,
) -> RobotCalibration:
    """Finds a robot's constants in a log of what was measured at poses of its platform.

    Args:
        robot: The robot as it is believed, or its name or path.
        log: The log, or its file; columns as `cdpr calibrate --help` says.
        unknown: Groups of `calibration.parameters.GROUPS`, and names of parameters.
        sigmas: Standard deviations of what was measured: `Sigmas`, or some of its fields by name.
        tags: What is known of tags by number, or a file of it.
        tag_size: In the place of it: edge of all tags [m].
        tracker_late: By how much the tracker's poses are late [s].
        say: Told what is done now.
        options: Fields of `CalibrationTask`: `priors`, `mount`, `image_size`, `start`, `rest`,
            `outliers`.

    Returns:
        What was found; its status is "misfit" where it does not fit what was measured.

    Raises:
        CalibrationError: The log does not hold, or does not tell, what is asked; names it.
        DataFileError: A file cannot be read.
    """
    loaded = as_robot(robot)
    _check_names(options, OPTIONS, CalibrationError)
    read, places = calibration_inputs(loaded, log, tags, tag_size, tracker_late)
    if options.get("start") is not None:
        options["start"] = as_pose(loaded, options["start"])
    task = CalibrationTask(
        robot=loaded, unknown=_words(unknown), sigmas=_sigmas(sigmas), tags=places, **options
    )
    return as_kind(RobotCalibration, calibrate_log(task, read, say or _silent))


def calibration_inputs(
    robot: Robot,
    log: CalibrationLog | Path | str,
    tags: Mapping[int, TagPlace] | Path | str | None,
    tag_size: float | None,
    tracker_late: float | None,
) -> tuple[CalibrationLog, dict[int, TagPlace]]:
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


def identify(
    robot: Robot | str | Path,
    log: CalibrationLog | Path | str,
    unknown: str | Sequence[str] = UNKNOWN,
    *,
    validate: CalibrationLog | Path | str | None = None,
    tracker_late: float | None = None,
    say: Say | None = None,
    **options: Any,
) -> RobotIdentification:
    """Finds a robot's dynamics in a log of a motion.

    Args:
        robot: The robot as it is believed, or its name or path.
        log: The log, or its file; columns as `cdpr identify --help` says.
        unknown: Groups of `identification.parameters.GROUPS`.
        validate: Log of another motion, which is predicted and not fitted, or its file.
        tracker_late: By how much the tracker's poses are late [s]; None: they must be in time.
        say: Told what is done now.
        options: Fields of `IdentificationTask`: `common`, `priors`, `bandwidth` [Hz],
            `sigma_lengths` [m], `pulleys`, `outliers`.

    Raises:
        IdentificationError: A log does not hold, or does not tell, what is asked; names it.
        DataFileError: A file cannot be read.
    """
    loaded = as_robot(robot)
    known = [field.name for field in fields(IdentificationTask)]
    _check_names(options, [k for k in known if k not in ("robot", "unknown")], IdentificationError)
    read = _read(loaded, log, tracker_late)
    other = None if validate is None else _read(loaded, validate, tracker_late)
    given = {"check_clock": tracker_late is None} | options
    task = IdentificationTask(robot=loaded, unknown=_words(unknown), **given)
    return as_kind(RobotIdentification, identify_log(task, read, other, say or _silent))


def _read(robot: Robot, log: CalibrationLog | Path | str, late: float | None) -> CalibrationLog:
    if isinstance(log, str | Path):
        log = read_log(Path(log), [cable.name for cable in robot.cables])
    return log if late is None else shifted_log(log, late)


def _words(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _sigmas(given: Sigmas | Mapping[str, float] | None) -> Sigmas:
    if isinstance(given, Sigmas):
        return given
    _check_names(given or {}, [field.name for field in fields(Sigmas)], CalibrationError)
    return replace(Sigmas(), **(given or {}))


def _check_names(
    given: Mapping[str, Any], known: Sequence[str],
    error: type[CalibrationError] | type[IdentificationError],
) -> None:  # fmt: skip
    for name in given:
        if name not in known:
            raise error(f"{name!r} is unknown; {closest(name, known)}")


def _silent(words: str) -> None:
    """Tells nobody."""

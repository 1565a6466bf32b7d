"""What calibrations and identifications make of a log alike: winches, clock, robot file, report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from pydrake.common.yaml import yaml_dump_typed
from rich.table import Table

from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.analyses.reporting.log_files import write_json, write_whole
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.errors import CalibrationError, IdentificationError
from cdpr_drake.identification.result import IdentificationResult
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.time_shift import WORSE

ROBOT = "robot.yaml"
"""File of a results folder: the robot as it is believed now."""

LATE = 0.25
"""A clock is off by more than this share of the time between rows."""


@dataclass(frozen=True, eq=False)
class LogFit:
    """What is told of a robot that was fitted to a log.

    Attributes:
        robot: As it is believed now.
        file: Name of the file of all numbers.
        numbers: For JSON.
        tables: For the terminal.
        drawings: What draws the figures, by name.
        fits: Whether it fits what was measured.
    """

    robot: Robot
    file: str
    numbers: dict[str, Any]
    tables: Sequence[Table]
    drawings: Mapping[str, Callable[[], Figure]]
    fits: bool

    def write(self, folder: Path) -> None:
        """Writes the numbers and `robot.yaml` into a folder."""
        write_json(folder / self.file, self.numbers)
        write_whole(folder / ROBOT, yaml_dump_typed(self.robot))


def fitted_robot(
    robot: Robot, done: str, result: CalibrationResult | IdentificationResult, **changes: Any
) -> Robot:
    """A robot with what was found, and words of it among what its file assumes.

    Args:
        robot: As it was believed.
        done: What was done with it, as "Calibrated".
        result: What was found.
        changes: Its new fields.
    """
    words = f"{done}: {result.status}, {len(result.names)} parameters."
    return replace(robot, **changes, assumptions=f"{robot.assumptions} {words}".strip())


def refuse_late_tracker(
    log: Measurements, against: str, found: tuple[float, float], step: float,
    error: type[CalibrationError] | type[IdentificationError],
) -> None:  # fmt: skip
    """Refuses a tracker that is out of sync.

    Args:
        log: The log with its poses.
        against: What they were compared with.
        found: By how much they are late [s], and how many times better they fit with that shift.
        step: Time between rows [s].
        error: What is raised.

    Raises:
        CalibrationError: It is, or an IdentificationError; says by how much.
    """
    shift, better = found
    if better > WORSE and abs(shift) > LATE * step:
        late = "late" if shift > 0.0 else "early"
        raise error(
            f"{log.path}: tracker: found it {abs(shift):.4g} s {late} against the {against}, "
            f"which fit {better:.2g} times better with that shift; accepted: the same clock, or "
            f"tracker_late {shift:.4g}"
        )

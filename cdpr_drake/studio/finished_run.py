"""The results folder of a run, to be looked at from row to row."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.runs.samples import MarksPicture, shown_limits
from cdpr_drake.arrays import Array
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import ServoModel, servo_model
from cdpr_drake.systems.scenarios.files import check_moves_robot
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

MOST_ROWS = 3000
"""Rows of a log that are shown, evenly spread."""

LOG, SUMMARY, SCENARIO = "log.npz", "summary.json", "scenario.yaml"


def is_run(folder: Path) -> bool:
    """True if a folder has the results of a run."""
    return all((folder / name).is_file() for name in (LOG, SUMMARY, SCENARIO))


class FinishedRun:
    """What a run left.

    Attributes:
        folder: Its folder.
        scenario: Its scenario.
        summary: Its summary.
        cables: Names of the cables.
        limits: Smallest and largest tension [N].
        times: Of the rows, shape (n,) [s].
        samples: Rows of its log, as a run shows them, at most `MOST_ROWS`.
    """

    def __init__(self, folder: Path) -> None:
        """Reads it.

        Raises:
            OutputFolderError: There is no such run, or it cannot be read.
            CdprError: Its scenario is not accepted.
        """
        self.folder = folder
        if not is_run(folder):
            raise OutputFolderError(
                f"{folder.name}: holds no results of a run; accepted: a folder of cdpr simulate"
            )
        check_moves_robot(str(folder / SCENARIO), "the studio")
        self.scenario = load_scenario(folder / SCENARIO)
        robot = load_robot(self.scenario.robot)
        self.cables = [cable.name for cable in robot.cables]
        self.limits = shown_limits(self.scenario, robot)
        self._model: ServoModel | None = None
        if isinstance(self.scenario, Scenario):
            self._model = servo_model(self.scenario, robot)
            self._picture = MarksPicture(self._model)
        try:
            self.summary: dict[str, Any] = load_json((folder / SUMMARY).read_text(encoding="utf-8"))
            with np.load(folder / LOG, allow_pickle=False) as log:
                count = len(log["time"])
                rows = np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).astype(int))
                self._log = {name: log[name][rows] for name in self._columns(log.files)}
            self.times: Array = self._log["time"]
            self.samples = self._samples()
        except (OSError, ValueError, KeyError, zipfile.BadZipFile, zlib.error) as problem:
            raise OutputFolderError(f"{folder.name}: cannot be read: {problem}") from problem

    def row_at(self, time: float) -> int:
        """The row nearest to a time [s]."""
        return int(np.argmin(np.abs(self.times - time)))

    def image(self, row: int) -> bytes:
        """The camera's image, drawn from the marks of the log, as JPEG; empty: no camera."""
        if self._model is None:
            return b""
        marks = self._log[f"{self._model.target.mark}_px"][row]
        return self._picture.jpeg(marks if self._log["found"][row, 0] > 0.0 else None, None)

    def _columns(self, present: list[str]) -> list[str]:
        names = ["time", "X_WP", "tensions", "lengths"]
        names += [name for name in ("unstrained_lengths", "X_WP_desired") if name in present]
        return names if self._model is None else [*names, "found", f"{self._model.target.mark}_px"]

    def _samples(self) -> list[dict[str, Any]]:
        log, model = self._log, self._model
        if model is None:
            distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
        else:
            pairs = zip(log["X_WP"], self.times, strict=True)
            errors = [model.seen_error(pose_from_row(pose), float(time)) for pose, time in pairs]
            distance, angle = np.array(errors).reshape(-1, 2).T
        columns = {
            "t": self.times, "position_error": distance, "rotation_error": angle,
            "tensions": log["tensions"], "lengths": log["lengths"],
            "unstrained": log.get("unstrained_lengths"), "pose": log["X_WP"],
        }  # fmt: skip
        present = {name: values.tolist() for name, values in columns.items() if values is not None}
        rows = (
            {name: values[k] for name, values in present.items()} for k in range(len(self.times))
        )
        return [{"unstrained": None, **finite(sample)} for sample in rows]

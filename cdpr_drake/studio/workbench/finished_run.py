"""The results folder of a run, to be looked at from row to row, and any folder as one file."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import numpy as np

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
    """Whether a folder has the results of a run."""
    return all((folder / name).is_file() for name in (LOG, SUMMARY, SCENARIO))


class FinishedRun:
    """What a run left.

    Attributes:
        folder: Its folder.
        scenario: Its scenario.
        summary: Its summary.
        cables: Names of the cables.
        limits: Smallest and largest tension [N].
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
            summary: dict[str, Any] = load_json((folder / SUMMARY).read_text(encoding="utf-8"))
            with np.load(folder / LOG, allow_pickle=False) as log:
                count = len(log["time"])
                rows = np.unique(np.linspace(0, count - 1, min(count, MOST_ROWS)).astype(int))
                self._log = {name: log[name][rows] for name in self._needed(log.files)}
            self.samples = self._samples()
        except (OSError, ValueError, KeyError, zipfile.BadZipFile, zlib.error) as problem:
            raise OutputFolderError(f"{folder.name}: cannot be read: {problem}") from problem
        self.summary = summary

    @property
    def times(self) -> Array:
        """Of the rows, shape (n,) [s]."""
        return self._log["time"]

    def row_at(self, time: float) -> int:
        """The row nearest to a time [s]."""
        return int(np.argmin(np.abs(self.times - time)))

    def image(self, row: int) -> bytes:
        """What the camera saw, drawn from the marks of the log, as JPEG; empty: no camera."""
        if self._model is None:
            return b""
        found = self._log["found"][row, 0] > 0.0
        marks = self._log[f"{self._model.target.mark}_px"][row] if found else None
        return self._picture.jpeg(marks, None)

    def _needed(self, there: list[str]) -> list[str]:
        names = ["time", "X_WP", "tensions", "lengths"]
        names += [name for name in ("unstrained_lengths", "X_WP_desired") if name in there]
        if self._model is not None:
            names += ["found", f"{self._model.target.mark}_px"]
        return names

    def _samples(self) -> list[dict[str, Any]]:
        log, model = self._log, self._model
        if model is None:
            distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
        else:
            pairs = zip(log["X_WP"], log["time"], strict=True)
            errors = [model.seen_error(pose_from_row(pose), float(time)) for pose, time in pairs]
            distance, angle = np.array(errors).reshape(-1, 2).T
        unstrained = log.get("unstrained_lengths")
        return [
            {
                "t": float(log["time"][k]),
                "position_error": _finite(distance[k]),
                "rotation_error": _finite(angle[k]),
                "tensions": [_finite(value) for value in log["tensions"][k]],
                "lengths": [_finite(value) for value in log["lengths"][k]],
                "unstrained": None if unstrained is None else unstrained[k].tolist(),
                "pose": log["X_WP"][k].tolist(),
            }
            for k in range(len(log["time"]))
        ]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


STORED = frozenset({".png", ".npz", ".mp4", ".zip", ".jpg"})
"""Endings of files that are small already."""


def zipped(folder: Path, file: IO[bytes]) -> None:
    """Writes all of a folder into a zip archive, below the folder's name.

    Links are left out: what they lead to may lie anywhere.

    Raises:
        OutputFolderError: The folder is not there, or the disk is full.
    """
    if not folder.is_dir():
        raise OutputFolderError(f"{folder.name}: is not there any more")
    try:
        with zipfile.ZipFile(file, "w") as archive:
            for path in sorted(folder.rglob("*")):
                if path.is_symlink() or not path.is_file():
                    continue
                small = path.suffix.lower() in STORED
                archive.write(
                    path, Path(folder.name) / path.relative_to(folder),
                    zipfile.ZIP_STORED if small else zipfile.ZIP_DEFLATED,
                )  # fmt: skip
    except OSError as problem:
        raise OutputFolderError(
            f"{folder.name}: cannot be packed: {problem.strerror or problem}"
        ) from problem

"""Arrays over the poses of a grid: computed in chunks, kept as they come, written and read."""

from __future__ import annotations

import json
import shutil
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder, load_arrays, shown_path
from cdpr_drake.analyses.frame.follow import Count, Follow
from cdpr_drake.analyses.frame.job import FinishedJob
from cdpr_drake.analyses.frame.result import STOPPED, Result
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, DataFileError, StoppedError, SweepError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.summaries import numbers
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

ARRAYS, RESULTS = "workspace.npz", "results.json"
"""Files of the arrays, and of the numbers."""

CHUNKS = "chunks"
"""Folder of finished chunks, until `ARRAYS` is written."""

POSES = "poses"
"""Word for what is counted."""

Span = tuple[int, int]
"""Poses of a grid by number: from the first to before the second."""


class Chunks:
    """Arrays over all poses of a grid, which come in chunks; no number depends on these.

    Attributes:
        missing: Spans of the chunks that the folder has not.
    """

    def __init__(self, count: int, chunk: int, folder: Folder | None, follow: Follow) -> None:
        """Reads what the folder has.

        Args:
            count: Number of poses.
            chunk: Poses of a chunk: seconds of work at most.
            folder: Keeps finished chunks; None: nothing is kept.
            follow: Who follows.
        """
        self._spans = [(start, min(start + chunk, count)) for start in range(0, count, chunk)]
        self._chunks: dict[Span, Mapping[str, np.ndarray]] = {}
        for span in self._spans:
            stored = None if folder is None else load_arrays(folder.path / _file(span))
            if stored is not None:
                self._chunks[span] = stored
        self.missing = [span for span in self._spans if span not in self._chunks]
        finished = sum(stop - start for start, stop in self._chunks)
        self._folder, self._count = folder, Count(follow, count, finished, POSES)

    def add(self, job: FinishedJob[dict[str, np.ndarray]]) -> None:
        """Keeps a chunk of `missing`: arrays by name, whose first index counts its poses.

        Raises:
            CdprError: As the work.
            SweepError: The work failed otherwise, or its process died.
        """
        if job.problem is not None:
            raise job.problem if isinstance(job.problem, CdprError) else SweepError(job.words())
        span, arrays = self.missing[job.number], job.result or {}
        if self._folder is not None:
            self._folder.write_arrays(_file(span), arrays)
        self._chunks[span] = arrays
        self._count.add(span[1] - span[0], POSES)

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays over all poses.

        Raises:
            StoppedError: Chunks are missing, as the work was stopped.
        """
        if self._count.done < self._count.total:
            words = f"stopped after {self._count.done:.0f} of {self._count.total} {POSES}"
            words += f"; the same command goes on in {self._folder.path}" if self._folder else ""
            raise StoppedError(words)
        return {
            name: np.concatenate([self._chunks[span][name] for span in self._spans])
            for name in self._chunks[self._spans[0]]
        }


def _file(span: Span) -> str:
    return f"{CHUNKS}/{POSES}-{span[0]:07d}-{span[1]:07d}.npz"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class GridResult(Result):
    """What is known over the poses of a grid, and where it is kept.

    Attributes:
        arguments: All that the arrays depend on.
        grid: The poses.
        versions: Versions of what computed the arrays.
        robot: The robot; None if the result was read from a file.
        folder: The results folder; None if nothing is kept.
        failed: Why figures were not written, by file.
        stopped: True if something is missing since the call was stopped.
    """

    arguments: dict[str, Any]
    grid: WorkspaceGrid
    versions: dict[str, str] = field(default_factory=package_versions)
    robot: Robot | None = None
    folder: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)
    stopped: bool = False

    @property
    def exit_code(self) -> int:
        """130 if the call was stopped."""
        return STOPPED if self.stopped else 0

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words, as `Robot.geometry_words`."""
        return str(self.arguments.get("geometry", "geometry not recorded"))

    @abstractmethod
    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name, as they are kept in `workspace.npz`."""

    @abstractmethod
    def columns(self) -> dict[str, np.ndarray]:
        """A row a pose: positions and angles, and what is known there."""

    @abstractmethod
    def page(self, robot: Robot) -> tuple[Pictures, str]:
        """What writes the page for the browser, and what should be known of it."""

    def to_dataframe(self) -> Any:
        """The columns as a pandas DataFrame."""
        import pandas as pd  # half a second, which few need

        return pd.DataFrame(self.columns())

    def last_lines(self) -> list[str]:
        """Sentences on how it ended and where it is."""
        return [
            *(["stopped; the same call goes on"] if self.stopped else []),
            *([] if self.folder is None else [f"results: {shown_path(self.folder)}"]),
        ]

    def save(self, folder: Folder) -> None:
        """Writes `workspace.npz`, and removes the chunks."""
        about = json.dumps({"arguments": self.arguments, "versions": self.versions})
        grid = {**dict(zip("xyz", self.grid.axes, strict=True)), "angles": self.grid.angles}
        folder.write_arrays(ARRAYS, {"about": np.array(about), **grid, **self.arrays()})
        shutil.rmtree(folder.path / CHUNKS, ignore_errors=True)

    def write(self, folder: Folder, formats: Sequence[str], follow: Follow) -> dict[str, str]:
        """Writes numbers, figures and the page; returns why figures were not written, by file."""
        folder.write_json(RESULTS, self.as_dict())
        from cdpr_drake.analyses.frame.figures import figure_writers

        page, note = ({}, "") if self.robot is None else self.page(self.robot)
        if note:
            follow.say(f"note: {note}")
        return folder.write_all(figure_writers(self.figures(), formats) | page, follow.stop)

    def written(self, folder: Folder | None, formats: Sequence[str], follow: Follow) -> Self:
        """The result with its folder, in which its files are; the same if nothing is kept."""
        if folder is None:
            return self
        result = replace(self, folder=folder.path)
        failed = result.write(folder, formats, follow)
        if not (failed or result.stopped):
            folder.complete()
        stopped = result.stopped or (bool(failed) and follow.stop())
        return replace(result, failed=failed, stopped=stopped)


def load_grid(
    path: Path | str, needed: str, noun: str, command: str
) -> tuple[dict[str, Any], WorkspaceGrid, dict[str, Any]]:
    """Reads what `GridResult.save` wrote: arguments and versions, grid, arrays.

    Args:
        path: The file, or its folder.
        needed: How the name of an array begins that files of this kind have.
        noun: What it should be, and
        command: what writes such files, for the message.

    Raises:
        DataFileError: There is no such file, or it is not of that kind.
    """
    path = Path(path)
    path = path / ARRAYS if path.is_dir() else path
    arrays = load_arrays(path) or {}
    try:
        about = load_json(str(arrays.pop("about")))
        x, y, z, angles = (arrays.pop(name) for name in ("x", "y", "z", "angles"))
        grid = WorkspaceGrid((x, y, z), angles)
        if any(name.startswith(needed) for name in arrays):
            return {name: about[name] for name in ("arguments", "versions")}, grid, arrays
    except (KeyError, ValueError):
        pass
    raise DataFileError(f"{path}: found no stored {noun}; accepted: {ARRAYS} of {command}")


def reused(folder: Folder, follow: Follow) -> bool:
    """True, and said, if an earlier call has finished the arrays of a folder."""
    finished = (folder.path / ARRAYS).is_file()
    if finished:
        follow.say(f"reused the grid of {shown_path(folder.path)}")
    return finished


def grid_words(grid: WorkspaceGrid, robot: Robot | None, rule: str = "all") -> str:
    """Numbers of positions and orientations, and where the grid is in the robot's frame."""
    k, *counts = grid.shape
    words = [f"grid: {' x '.join(map(str, counts))} positions, {_corners(grid.lower, grid.upper)}"]
    if robot is not None:
        words.append(f"the frame: {_corners(robot.frame.lower, robot.frame.upper)}")
    if k > 1:
        words.append(f"{k} orientations, {rule} of them")
    return "; ".join(words)


def _corners(lower: Array, upper: Array) -> str:
    return f"from ({numbers(lower)}) to ({numbers(upper)}) m"


def region_numbers(
    inside: np.ndarray, places: np.ndarray, axes: tuple[Array, Array, Array]
) -> dict[str, Any]:
    """Counts and volumes for JSON of a region: which poses of a grid belong to it, shape
    (k, nx, ny, nz), and which positions, shape (nx, ny, nz)."""
    volumes = [workspace_volume(places, axes, rule) for rule in VolumeRule]
    unit = volumes[0].unit.replace("^", "").replace("-", "1")
    return {
        "poses": int(np.count_nonzero(inside)), "of_poses": int(inside.size),
        "places": int(np.count_nonzero(places)), "of_places": int(places.size),
        **{f"{volume.rule}_{unit}": volume.value for volume in volumes},
        **{f"{volume.rule}_share": volume.share for volume in volumes},
    }  # fmt: skip

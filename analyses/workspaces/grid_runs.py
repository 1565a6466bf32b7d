"""Arrays over the poses of a grid: computed in chunks, kept as they come, written and read."""

from __future__ import annotations

import hashlib
import json
import shutil
import zipfile
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder, load_arrays
from cdpr_drake.analyses.frame.follow import NOBODY, Count, Follow
from cdpr_drake.analyses.frame.jobs import finished_jobs
from cdpr_drake.analyses.frame.result import STOPPED, Result
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.output_folder import shown_path
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, DataFileError, StoppedError, SweepError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.summaries import numbers
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

ARRAYS = "workspace.npz"
"""All arrays of a result, with what they were computed for as JSON in the array `about`."""

RESULTS = "results.json"
"""File of the numbers of a result."""

CHUNKS = "chunks"
"""Folder of finished chunks, until `ARRAYS` is written."""

ITEMS = "poses"
"""Word for what is counted."""

PoseArrays = Callable[[int, int], Mapping[str, np.ndarray]]
"""Arrays by name, shape (n,), of the poses start to stop of a grid."""

Chunk = tuple[str, int, int]
"""Name of one of several `PoseArrays`, start and stop."""


@contextmanager
def grid_folder(
    folder: Path | str | None, arguments: Mapping[str, Any], name: str, overwrite: bool,
    follow: Follow,
) -> Iterator[Folder | None]:  # fmt: skip
    """The results folder of a grid; None if nothing is kept.

    Args:
        folder: Its path; None: one below `follow.results` that the same arguments give again.
        arguments: All that the arrays depend on.
        name: How an unnamed folder begins.
        overwrite: True to replace other results.
        follow: Who follows.
    """
    if folder is None and follow.results is not None:
        digest = hashlib.sha256(json.dumps(arguments, sort_keys=True).encode()).hexdigest()
        folder = follow.results / f"{name}-{digest[:8]}"
    if folder is None:
        yield None
        return
    with Folder(Path(folder), arguments, overwrite, grows=True) as results:
        yield results


def run_grid(
    parts: Mapping[str, PoseArrays], count: int, chunk: int, folder: Folder | None,
    workers: int | str | None, follow: Follow,
) -> dict[str, dict[str, np.ndarray]]:  # fmt: skip
    """Arrays over all poses of a grid, for each of some parts.

    Numbers depend on the pose only, not on chunks and workers.

    Args:
        parts: By name, good as a file's name.
        count: Number of poses.
        chunk: Poses of a chunk: seconds of work at most.
        folder: Where finished chunks are kept and found; None: nowhere.
        workers: As `finished_jobs`.
        follow: Who follows.

    Raises:
        StoppedError: It was stopped; finished chunks are kept.
        CdprError: As the parts.
        SweepError: The cluster cannot be used, or a process died.
    """
    chunks: dict[Chunk, dict[str, np.ndarray]] = {}
    jobs: list[Chunk] = []
    for name in parts:
        for start in range(0, count, chunk):
            job = name, start, min(start + chunk, count)
            arrays = None if folder is None else load_arrays(folder.path / _file(job))
            if arrays is None:
                jobs.append(job)
            else:
                chunks[job] = arrays
    finished = sum(stop - start for _, start, stop in chunks)
    total = len(parts) * count
    counter = Count(follow, total, finished, ITEMS)
    work = partial(chunk_arrays, dict(parts))
    for done in finished_jobs(work, jobs, workers, stop=follow.stop, say=follow.say, name=ITEMS):
        if done.problem is not None:
            raise done.problem if isinstance(done.problem, CdprError) else SweepError(done.words())
        job, arrays = jobs[done.number], done.result or {}
        if folder is not None:
            folder.write_arrays(_file(job), arrays)
        chunks[job] = arrays
        counter.add(job[2] - job[1], job[0])
    if counter.done < total:
        words = f"stopped after {counter.done:.0f} of {total} {ITEMS}"
        words += "" if folder is None else f"; the same command goes on in {folder.path}"
        raise StoppedError(words)
    return {
        name: {key: np.concatenate([chunks[job][key] for job in mine]) for key in chunks[mine[0]]}
        for name in parts
        for mine in [sorted(job for job in chunks if job[0] == name)]
    }


def chunk_arrays(parts: Mapping[str, PoseArrays], job: Chunk) -> dict[str, np.ndarray]:
    """Arrays of a chunk."""
    name, start, stop = job
    return dict(parts[name](start, stop))


def _file(job: Chunk) -> str:
    name, start, stop = job
    return f"{CHUNKS}/{name}-{start:07d}-{stop:07d}.npz"


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
    versions: dict[str, str]
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
    def columns(self) -> dict[str, np.ndarray]:
        """A row a pose: positions and angles, and what is known there."""

    def to_dataframe(self) -> Any:
        """The columns as a pandas DataFrame."""
        import pandas as pd  # half a second, which few need

        return pd.DataFrame(self.columns())

    @abstractmethod
    def page(self, robot: Robot) -> tuple[Pictures, str]:
        """What writes the page for the browser, and what should be known of it."""

    def last_lines(self) -> list[str]:
        """Sentences on how it ended and where it is."""
        return [
            *(["stopped; the same call goes on"] if self.stopped else []),
            *([] if self.folder is None else [f"results: {shown_path(self.folder)}"]),
        ]

    def write(
        self, folder: Folder, formats: Sequence[str] = DEFAULT_FORMATS, follow: Follow = NOBODY
    ) -> dict[str, str]:
        """Writes numbers, figures and the page.

        Returns:
            Why figures were not written, by file.
        """
        folder.write_json(RESULTS, self.as_dict())
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


def save_grid(
    folder: Folder, about: Mapping[str, Any], grid: WorkspaceGrid, arrays: Mapping[str, np.ndarray]
) -> None:
    """Writes `ARRAYS`, and removes the chunks.

    Args:
        folder: The folder.
        about: What the arrays were computed for, and by what, for JSON.
        grid: Their poses.
        arrays: By name.
    """
    axes = dict(zip("xyz", grid.axes, strict=True))
    words = np.array(json.dumps(dict(about)))
    folder.write_arrays(ARRAYS, {"about": words, **axes, "angles": grid.angles, **arrays})
    shutil.rmtree(folder.path / CHUNKS, ignore_errors=True)


def load_grid(
    path: Path | str, needed: str, noun: str, command: str
) -> tuple[dict[str, Any], WorkspaceGrid, dict[str, np.ndarray]]:
    """Reads what `save_grid` wrote: about, grid, arrays.

    Args:
        path: The file, or its folder.
        needed: An array's name, or how it begins, without which it is a file of another kind.
        noun: What it should be, for the message.
        command: What writes such files, for the message.

    Raises:
        DataFileError: There is no such file, or it is not of that kind.
    """
    path = Path(path)
    path = path / ARRAYS if path.is_dir() else path
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = {key: stored[key] for key in stored.files}
        about = load_json(str(arrays.pop("about")))
        x, y, z, angles = (arrays.pop(name) for name in ("x", "y", "z", "angles"))
        if not any(name.startswith(needed) for name in arrays):
            raise KeyError(needed)
        return about, WorkspaceGrid((x, y, z), angles), arrays
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as problem:
        raise DataFileError(
            f"{path}: found no stored {noun} ({type(problem).__name__}); accepted: {ARRAYS} of "
            f"{command}"
        ) from problem


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
    """Counts and volumes of a region for JSON.

    Args:
        inside: Which poses belong to it, shape (k, nx, ny, nz).
        places: Which positions do, shape (nx, ny, nz).
        axes: Coordinates along x, y, z [m].
    """
    volumes = [workspace_volume(places, axes, rule) for rule in VolumeRule]
    unit = volumes[0].unit.replace("^", "").replace("-", "1")
    return {
        "poses": int(np.count_nonzero(inside)),
        "of_poses": int(inside.size),
        "places": int(np.count_nonzero(places)),
        "of_places": int(places.size),
        **{f"{volume.rule}_{unit}": volume.value for volume in volumes},
        **{f"{volume.rule}_share": volume.share for volume in volumes},
    }

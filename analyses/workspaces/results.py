"""Workspaces of a robot over a grid: computed, kept, and read again."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting import WorkProgress, finite, package_versions
from cdpr_drake.analyses.sweeps import SweepFolder, check_scheduler, run_sweep, store_arrays
from cdpr_drake.analyses.workspaces.conditions import KINDS, MEASURES
from cdpr_drake.analyses.workspaces.question import WorkspaceQuestion
from cdpr_drake.errors import DataFileError
from cdpr_drake.workspaces import VolumeRule, WorkspaceGrid, WorkspaceVolume, workspace_volume

ARRAYS = "workspace.npz"
"""All arrays, with the arguments as JSON in the array `about`."""

ALL = "all"
"""Name of what all kinds have in common."""

TASK = "poses"
"""Name of the sweep's only task."""

CHUNK_POSES = 4096
"""Poses per chunk; a tenth of a second, or with cameras or stability seconds of work."""

SLOW_CHUNK_POSES = 256
"""With kinds that take about a millisecond a pose."""

SLOW = {"stable", "target-visible"}


@dataclass(frozen=True, eq=False)
class RobotWorkspace:
    """Where kinds hold on a grid, and measures there.

    Attributes:
        arguments: All that the numbers depend on, see `WorkspaceQuestion.arguments`.
        grid: The poses.
        holds: By kind, shape (k, nx, ny, nz).
        values: By measure, same shape, in its unit.
        versions: Versions of what computed them.
    """

    arguments: dict[str, Any]
    grid: WorkspaceGrid
    holds: dict[str, np.ndarray]
    values: dict[str, np.ndarray]
    versions: dict[str, str]

    def inside(self, kind: str = ALL) -> np.ndarray:
        """Which poses belong to a kind, or to all of them, shape (k, nx, ny, nz)."""
        if kind == ALL:
            return np.asarray(np.logical_and.reduce(list(self.holds.values())))
        return self.holds[kind]

    def places(self, kind: str = ALL) -> np.ndarray:
        """Which positions belong to it, in every or in some orientation, shape (nx, ny, nz)."""
        inside = self.inside(kind)
        return np.asarray(
            (np.all if self.arguments["orientations"] == "all" else np.any)(inside, 0)
        )

    def volume(
        self, kind: str = ALL, rule: VolumeRule | str = VolumeRule.CORNERS
    ) -> WorkspaceVolume:
        """Volume of the positions that belong to it."""
        return workspace_volume(self.places(kind), self.grid.axes, rule)

    def as_dict(self) -> dict[str, Any]:
        """Arguments, versions, shares, volumes and ranges of the measures for JSON."""
        names = [*self.holds, ALL] if len(self.holds) > 1 else list(self.holds)
        return {
            **self.arguments,
            "versions": self.versions,
            "workspaces": {name: self._numbers(name) for name in names},
            "measured": {name: self._range(name) for name in self.values},
        }

    def _numbers(self, kind: str) -> dict[str, Any]:
        inside, places = self.inside(kind), self.places(kind)
        volumes = [self.volume(kind, rule) for rule in VolumeRule]
        unit = volumes[0].unit.replace("^", "").replace("-", "1")
        return {
            "title": KINDS[kind].title if kind in KINDS else "all of these",
            "poses": int(np.count_nonzero(inside)),
            "of_poses": int(inside.size),
            "pose_share": float(np.mean(inside)),
            "places": int(np.count_nonzero(places)),
            "of_places": int(places.size),
            **{f"{v.rule}_{unit}": v.value for v in volumes},
            **{f"{v.rule}_share": v.share for v in volumes},
        }

    def _range(self, name: str) -> dict[str, Any]:
        """Least, median and largest finite value within the workspace."""
        values = self.values[name][self.inside()]
        values = values[np.isfinite(values)]
        some = len(values) > 0
        return {
            "title": MEASURES[name].title,
            "unit": MEASURES[name].unit,
            "least": finite(float(np.min(values))) if some else None,
            "median": finite(float(np.median(values))) if some else None,
            "largest": finite(float(np.max(values))) if some else None,
        }

    def save(self, folder: Path) -> Path:
        """Writes `workspace.npz` into a folder that exists, and returns its path."""
        path = folder / ARRAYS
        arrays = {
            "about": np.array(json.dumps({"arguments": self.arguments, "versions": self.versions})),
            **dict(zip("xyz", self.grid.axes, strict=True)),
            "angles": self.grid.angles,
            **{f"kind/{name}": array for name, array in self.holds.items()},
            **{f"measure/{name}": array for name, array in self.values.items()},
        }
        store_arrays(path, arrays)
        return path


def load_robot_workspace(path: Path | str) -> RobotWorkspace:
    """Reads what `RobotWorkspace.save` wrote, from its file or folder.

    Raises:
        DataFileError: There is no such file, or it is not of that kind.
    """
    path = Path(path)
    path = path / ARRAYS if path.is_dir() else path
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            about = json.loads(str(stored["about"]))
            x, y, z = (stored[name] for name in "xyz")
            groups: dict[str, dict[str, np.ndarray]] = {"kind": {}, "measure": {}}
            for key in stored.files:
                group, slash, name = key.partition("/")
                if slash:
                    groups[group][name] = stored[key]
            if not groups["kind"]:
                raise KeyError("kind")
            return RobotWorkspace(
                about["arguments"],
                WorkspaceGrid((x, y, z), stored["angles"]),
                groups["kind"],
                groups["measure"],
                about["versions"],
            )
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as problem:
        raise DataFileError(
            f"{path}: found no stored workspace ({type(problem).__name__}); accepted: {ARRAYS} of "
            "cdpr workspace"
        ) from problem


@dataclass(frozen=True, eq=False)
class WorkspaceRun:
    """What came of a question: the workspace, None if it was stopped; where the sweep stood."""

    workspace: RobotWorkspace | None
    progress: WorkProgress


def robot_workspace(
    question: WorkspaceQuestion,
    folder: Path | None = None,
    workers: int | None = 1,
    scheduler: str | None = None,
    on_progress: Callable[[WorkProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> WorkspaceRun:
    """Computes a workspace; arguments as `sweeps.run_sweep`.

    Args:
        question: What to compute.
        folder: Where finished chunks are kept and found, and the result; None: nowhere.
        workers: Number of local processes, with one this process does it; None: one for each
            processor.
        scheduler: Address of a Dask scheduler, whose workers compute instead.
        on_progress: Called after every chunk.
        should_stop: Asked often; True ends the sweep once the chunks under way are finished.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: The scheduler does not answer or got lost, or a local process died.
    """
    arguments, count = question.arguments(), question.grid.size
    question.task()(0, 1)  # what is not accepted shows before a folder is made
    if scheduler is not None:
        check_scheduler(scheduler)
    kept = None if folder is None else SweepFolder(folder, arguments)
    if folder is not None and (folder / ARRAYS).is_file():
        progress = WorkProgress("", count, count, 0.0, found=count)
        return WorkspaceRun(load_robot_workspace(folder), progress)
    size = SLOW_CHUNK_POSES if SLOW & {*question.kinds} else CHUNK_POSES
    result = run_sweep(
        {TASK: (question.task(), count)}, size, kept, items="poses", workers=workers,
        scheduler=scheduler, on_progress=on_progress, should_stop=should_stop,
    )  # fmt: skip
    if result.arrays is None:
        return WorkspaceRun(None, result.progress)
    arrays, shape = result.arrays[TASK], question.grid.shape
    workspace = RobotWorkspace(
        arguments,
        question.grid,
        {name: arrays[name].reshape(shape) for name in question.kinds},
        {name: arrays[name].reshape(shape) for name in question.measures},
        package_versions(),
    )
    if folder is not None and kept is not None:
        workspace.save(folder)
        kept.forget_chunks()
    return WorkspaceRun(workspace, result.progress)

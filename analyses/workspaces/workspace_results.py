"""Workspaces of a robot over a grid: computed, kept, and read again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.workspaces.break_tasks import (
    BEST,
    EXCURSION,
    NUMBERED,
    SURVIVES,
    WORST,
)
from cdpr_drake.analyses.workspaces.conditions import KINDS, MEASURES
from cdpr_drake.analyses.workspaces.grid_results import load_grid, region_numbers, save_grid
from cdpr_drake.analyses.workspaces.grid_runs import SweepOptions, run_poses
from cdpr_drake.analyses.workspaces.workspace_question import WorkspaceQuestion
from cdpr_drake.summaries import Tabulated
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, WorkspaceVolume, workspace_volume

ALL = "all"
"""Name of what all kinds have in common."""

TASK = "poses"
"""Name of the sweep's only task."""

CHUNK_POSES = 4096
"""Poses per chunk; a tenth of a second, or with cameras or stability seconds of work."""

SLOW_CHUNK_POSES = 256
"""With kinds that take about a millisecond a pose."""

SHOWN = 4
"""So many kinds, and measures, are shown where a workspace shows itself."""

SLOW = {"stable", "target-visible"}


@dataclass(frozen=True, eq=False, repr=False)
class RobotWorkspace(Tabulated):
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

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words, as `Robot.geometry_words`."""
        return str(self.arguments.get("geometry", "geometry not recorded"))

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

    def is_tilted(self) -> bool:
        """Whether there is a weight that does not pull along -z of W."""
        return self._down() != [0.0, 0.0, -1.0] and self.arguments["statics"]["weight"] > 0.0

    def axes_words(self) -> str:
        """Of which world all coordinates are, and where the weight pulls in it."""
        x, y, z = self._down()
        if not self.is_tilted():
            return "those of W; the weight pulls along -z"
        tilt = np.degrees(np.arctan2(np.hypot(x, y), -z))
        return (
            "those of W, which was not turned; the weight pulls along "
            f"({x:.6g}, {y:.6g}, {z:.6g}), {tilt:.4g} deg off -z"
        )

    def _down(self) -> list[float]:
        found: list[float] = self.arguments["statics"]["down"]
        return found

    def as_dict(self) -> dict[str, Any]:
        """Arguments, axes, versions, shares, volumes and ranges of the measures for JSON."""
        names = [*self.holds, ALL] if len(self.holds) > 1 else list(self.holds)
        return {
            **self.arguments,
            "axes": self.axes_words(),
            "versions": self.versions,
            "workspaces": {name: self._numbers(name) for name in names},
            "measured": {name: self._range(name) for name in self.values},
            **({} if WORST not in self.values else {"broken": self._broken()}),
        }

    def _broken(self) -> dict[str, Any]:
        """What single breaks led to: how often a cable was worst, a reaction best, and each pose.

        Names are null where all cables do not hold the pose.
        """
        about = self.arguments["breaks"]
        names = {WORST: about["cable_names"], BEST: about["reactions"]}
        told = {
            key: [None if np.isnan(n) else of[int(n) - 1] for n in self.values[key].ravel()]
            for key, of in names.items()
        }
        far = [finite(float(one)) for one in self.values[EXCURSION].ravel()]
        rows = self.grid.pose_rows(0, self.grid.size)
        kept = self.holds.get(SURVIVES)
        verdicts = [None] * len(far) if kept is None else kept.ravel().tolist()
        return {
            "worst_cables": dict(Counter(filter(None, told[WORST]))),
            "best_reactions": dict(Counter(filter(None, told[BEST]))),
            "poses": [
                {
                    "pose_m_rad": row.tolist(), "survives": verdict, "worst_cable": cable,
                    "best_reaction": reaction, "excursion_m": excursion,
                }
                for row, verdict, cable, reaction, excursion in zip(
                    rows, verdicts, told[WORST], told[BEST], far, strict=True
                )
            ],
        }  # fmt: skip

    def _numbers(self, kind: str) -> dict[str, Any]:
        inside = self.inside(kind)
        return {
            "title": KINDS[kind].title if kind in KINDS else "all of these",
            "pose_share": float(np.mean(inside)),
            **region_numbers(inside, self.places(kind), self.grid.axes),
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

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: shares and volumes of the first kinds."""
        told = self.as_dict()
        k, *counts = self.grid.shape
        many = f", {k} orientations, {told['orientations']} of them" if k > 1 else ""
        rows = [("grid", " x ".join(map(str, counts)) + many)]
        for name, numbers in list(told["workspaces"].items())[-SHOWN:]:
            volume = self.volume(name)
            share = f"{100.0 * numbers['pose_share']:.4g} % of the poses"
            rows.append((name, f"{share}, {volume.value:.4g} {volume.unit}"))
        for name in [one for one in self.values if one not in NUMBERED][:SHOWN]:
            one = told["measured"][name]
            least, most = one["least"], one["largest"]
            words = "none" if least is None else f"{least:.4g} to {most:.4g} {one['unit']}"
            rows.append((name, words))
        return f"Workspaces of {told['robot']}, {self.geometry}", rows

    def columns(self) -> dict[str, np.ndarray]:
        """A row a pose: where it is, which kinds hold, and the measures in their units."""
        parts = {**self.holds, **self.values}
        return {**self.grid.columns(), **{name: one.reshape(-1) for name, one in parts.items()}}

    def save(self, folder: Path) -> Path:
        """Writes `workspace.npz` into a folder that exists, and returns its path."""
        arrays = {
            **{f"kind/{name}": array for name, array in self.holds.items()},
            **{f"measure/{name}": array for name, array in self.values.items()},
        }
        about = {"arguments": self.arguments, "versions": self.versions}
        return save_grid(folder, about, self.grid, arrays)


def load_robot_workspace(path: Path | str) -> RobotWorkspace:
    """Reads what `RobotWorkspace.save` wrote, from its file or folder.

    Raises:
        DataFileError: There is no such file, or it is not of that kind.
    """
    about, grid, arrays = load_grid(path, "kind/", "workspace", "cdpr workspace")
    groups: dict[str, dict[str, np.ndarray]] = {"kind": {}, "measure": {}}
    for key, array in arrays.items():
        group, _, name = key.partition("/")
        groups[group][name] = array
    return RobotWorkspace(
        about["arguments"], grid, groups["kind"], groups["measure"], about["versions"]
    )


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
    """Computes a workspace.

    Args:
        question: What to compute.
        folder: This and the further ones are those of `SweepOptions`.
        workers: See folder.
        scheduler: See folder.
        on_progress: See folder.
        should_stop: See folder.

    Raises:
        OutputFolderError, SweepError: As `run_poses`.
    """
    arguments, shape = question.arguments(), question.grid.shape

    def assemble(arrays: Mapping[str, Mapping[str, np.ndarray]]) -> RobotWorkspace:
        found = {name: array.reshape(shape) for name, array in arrays[TASK].items()}
        return RobotWorkspace(
            arguments,
            question.grid,
            {name: found[name] for name in question.kinds},
            {name: found[name] for name in question.measures},
            package_versions(),
        )

    size = SLOW_CHUNK_POSES if SLOW & {*question.kinds} else CHUNK_POSES
    if question.about.breaks is not None:
        size = 1  # seconds of work
    tasks = {TASK: (question.task(), question.grid.size)}
    how = SweepOptions(folder, workers, scheduler, on_progress, should_stop)
    run = run_poses(arguments, tasks, size, assemble, load_robot_workspace, how)
    return WorkspaceRun(run.result, run.progress)

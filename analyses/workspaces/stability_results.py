"""Control stability workspaces, the static feasible workspace, and what they have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.workspaces.grid_results import load_grid, region_numbers, save_grid
from cdpr_drake.analyses.workspaces.grid_runs import SweepOptions, run_poses
from cdpr_drake.analyses.workspaces.stability_question import StabilityQuestion
from cdpr_drake.analyses.workspaces.static_feasible import StaticTask
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.summaries import Tabulated
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, WorkspaceVolume, workspace_volume

KINDS = {
    "Z": "control stability workspace",
    "S": "static feasible workspace",
    "SZ": "both",
}
"""Kinds of workspaces by name. Source: servoing thesis (1.25), (3.27), (3.28)."""

CHUNK_POSES = {"sampled": 1024, "searched": 256, "certified": 64}
"""Poses per chunk for each verdict, seconds of work: what Ctrl-C waits for, or loses. Chunks that
were kept under other numbers are not found, and computed again."""

SHOWN = 5
"""So many bounds are shown where workspaces show themselves."""

STATIC = "static"
"""Name of the static feasible workspace among the tasks of the sweep."""

LEVERS_IN_WORDS = {
    "error": "L_s with [e_t]x, as (1.47) of the servoing thesis prints it",
    "object": "L_s with [s_t]x, exact",
}
"""What PBVS' interaction matrix has in its rotational columns, by `StabilityCase.lever`."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class StabilityWorkspaces(Tabulated):
    """Workspaces of one robot and scheme under one or several perturbation bounds.

    Attributes:
        arguments: All that the numbers depend on, see `StabilityQuestion.arguments`.
        grid: The poses.
        names: Names of the perturbation bounds, as in arguments["bounds"].
        stable: Whether the servo is stable under each bounds, shape (b, k, nx, ny, nz).
        margin: Smallest eigenvalue of the symmetric part of Pi, as the verdict knows it, same
            shape [-]; minus infinity where Pi does not exist or nothing was proven.
        feasible: Whether the platform can be held, shape (k, nx, ny, nz).
        versions: Versions of what computed them.
    """

    arguments: dict[str, Any]
    grid: WorkspaceGrid
    names: tuple[str, ...]
    stable: np.ndarray
    margin: np.ndarray
    feasible: np.ndarray
    versions: dict[str, str]

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words, as `Robot.geometry_words`."""
        return str(self.arguments.get("geometry", "geometry not recorded"))

    def inside(self, kind: str, bounds: str | None = None) -> np.ndarray:
        """Which poses belong to a workspace, shape (k, nx, ny, nz).

        Args:
            kind: One of `KINDS`.
            bounds: Name of the perturbation bounds; None: the first.
        """
        index = 0 if bounds is None else self.names.index(bounds)
        masks = {"Z": self.stable[index], "S": self.feasible}
        return masks["Z"] & masks["S"] if kind == "SZ" else masks[kind]

    def places(self, kind: str, bounds: str | None = None) -> np.ndarray:
        """Which positions belong to it in every orientation of the grid, shape (nx, ny, nz)."""
        return np.all(self.inside(kind, bounds), axis=0)

    def volume(
        self, kind: str, rule: VolumeRule | str = VolumeRule.CORNERS, bounds: str | None = None
    ) -> WorkspaceVolume:
        """Volume of the positions that belong to a workspace in every orientation."""
        return workspace_volume(self.places(kind, bounds), self.grid.axes, rule)

    @property
    def interaction_matrix(self) -> str:
        """Which interaction matrix was used, in words; empty where a scheme has but one."""
        asked = self.arguments
        return LEVERS_IN_WORDS[asked["case"]["lever"]] if asked["scheme"] == "pbvs" else ""

    def as_dict(self) -> dict[str, Any]:
        """Arguments, versions and volumes for JSON."""
        return {
            **self.arguments,
            "interaction_matrix": self.interaction_matrix or None,
            "versions": self.versions,
            "workspaces": [
                {"bounds": name, **{kind: self._numbers(kind, name) for kind in KINDS}}
                for name in self.names
            ],
        }

    def _numbers(self, kind: str, name: str) -> dict[str, Any]:
        return region_numbers(self.inside(kind, name), self.places(kind, name), self.grid.axes)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: volumes of the first bounds."""
        about = self.arguments
        k, *counts = self.grid.shape
        rows = [
            ("grid", " x ".join(map(str, counts)) + (f", {k} orientations" if k > 1 else "")),
            ("evidence", about["verdict"]),
            ("geometry", self.geometry),
        ]
        for name in self.names[:SHOWN]:
            found = {kind: self.volume(kind, bounds=name) for kind in KINDS}
            words = (
                f"{kind} {100.0 * one.share:.4g} %, {one.value:.4g} {one.unit}"
                for kind, one in found.items()
            )
            rows.append((name, "; ".join(words)))
        if len(self.names) > SHOWN:
            rows.append(("...", f"{len(self.names) - SHOWN} more bounds"))
        return f"Stability of {about['robot']} under {about['scheme']}", rows

    def columns(self) -> dict[str, np.ndarray]:
        """A row a pose: where it is, whether it can be held, and under each bounds Z and margin."""
        found = {**self.grid.columns(), "S": self.feasible.reshape(-1)}
        for k, name in enumerate(self.names):
            found[f"Z {name}"] = self.stable[k].reshape(-1)
            found[f"margin {name}"] = self.margin[k].reshape(-1)
        return found

    def save(self, folder: Path) -> Path:
        """Writes `workspace.npz` into a folder that exists, and returns its path."""
        about = {"arguments": self.arguments, "versions": self.versions, "bounds": self.names}
        names = ("stable", "margin", "feasible")
        return save_grid(folder, about, self.grid, {name: getattr(self, name) for name in names})


def load_workspaces(path: Path | str) -> StabilityWorkspaces:
    """Reads what `StabilityWorkspaces.save` wrote, from its file or folder.

    Raises:
        DataFileError: There is no such file, or it is not of that kind.
    """
    about, grid, arrays = load_grid(path, "stable", "workspaces", "cdpr stability")
    return StabilityWorkspaces(
        arguments=about["arguments"],
        grid=grid,
        names=tuple(about["bounds"]),
        stable=arrays["stable"],
        margin=arrays["margin"],
        feasible=arrays["feasible"],
        versions=about["versions"],
    )


@dataclass(frozen=True, eq=False)
class StabilityRun:
    """What came of a question.

    Attributes:
        workspaces: The workspaces; None if the sweep was stopped before the end.
        progress: Where the sweep stood at the end.
    """

    workspaces: StabilityWorkspaces | None
    progress: WorkProgress


def stability_workspaces(
    question: StabilityQuestion,
    folder: Path | None = None,
    workers: int | None = 1,
    scheduler: str | None = None,
    on_progress: Callable[[WorkProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> StabilityRun:
    """Computes the workspaces of a question.

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
    arguments, count = question.arguments(), question.grid.size
    tasks: dict[str, Any] = {STATIC: (StaticTask(question.statics, question.grid), count)}
    tasks |= {name: (question.task(name), count) for name in _different(question).values()}
    run = run_poses(
        arguments,
        tasks,
        CHUNK_POSES[question.verdict],
        lambda arrays: _assembled(question, arguments, arrays),
        load_workspaces,
        SweepOptions(folder, workers, scheduler, on_progress, should_stop),
    )
    return StabilityRun(run.result, run.progress)


def _different(question: StabilityQuestion) -> dict[str, str]:
    """For every name of bounds the first name of the same bounds; they are computed once."""
    first: dict[PerturbationBounds, str] = {}
    return {name: first.setdefault(bounds, name) for name, bounds in question.bounds.items()}


def _assembled(
    question: StabilityQuestion,
    arguments: dict[str, Any],
    arrays: Mapping[str, Mapping[str, np.ndarray]],
) -> StabilityWorkspaces:
    shape = question.grid.shape
    names = tuple(question.bounds)
    computed = [arrays[name] for name in _different(question).values()]
    return StabilityWorkspaces(
        arguments=arguments,
        grid=question.grid,
        names=names,
        stable=np.array([part["stable"].reshape(shape) for part in computed]),
        margin=np.array([part["margin"].reshape(shape) for part in computed]),
        feasible=arrays[STATIC]["feasible"].reshape(shape),
        versions=package_versions(),
    )

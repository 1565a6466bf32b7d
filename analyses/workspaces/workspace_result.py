"""A robot's workspace: what it shows, gives as numbers, draws, writes, and how it is read again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.workspaces.conditions import (
    ALL,
    BEST,
    EXCURSION,
    KINDS,
    MEASURES,
    NUMBERED,
    SURVIVES,
    WORST,
)
from cdpr_drake.analyses.workspaces.grid_runs import (
    GridResult,
    grid_words,
    load_grid,
    region_numbers,
)
from cdpr_drake.analyses.workspaces.workspace_hulls import (
    NOTHING,
    HullBound,
    hull_numbers,
    save_hull,
)
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.hull import WorkspaceHull
from cdpr_drake.workspaces.volume import VolumeRule, WorkspaceVolume, workspace_volume

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.analyses.reporting.deferred_figures import Pictures

BOUNDS = {
    "frame": ("the frame", "there"), "box": ("a box", "there"),
    "nothing": ("nothing", "at ten times the frame"),
}  # fmt: skip
"""What bounds a hull, and where its rays end at the latest, in words."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Workspace(GridResult):
    """Where kinds hold on a grid, and measures there; with a hull if it is computed.

    Attributes:
        holds: By kind, shape (k, nx, ny, nz).
        values: By measure, same shape, in its unit.
        hull: Its hull.
        bound: Where the rays of the hull end at the latest.
        region: Lower and upper corner of the box given instead of the frame, shape (3,) each [m].
    """

    holds: dict[str, np.ndarray]
    values: dict[str, np.ndarray]
    hull: WorkspaceHull | None = None
    bound: HullBound | None = None
    region: tuple[Array, Array] | None = None

    def inside(self, kind: str = ALL) -> np.ndarray:
        """Which poses belong to a kind, or to all of them, shape (k, nx, ny, nz)."""
        if kind == ALL:
            return np.asarray(np.logical_and.reduce(list(self.holds.values())))
        return self.holds[kind]

    def places(self, kind: str = ALL) -> np.ndarray:
        """Which positions belong to it, in every or in some orientation, shape (nx, ny, nz)."""
        rule = np.all if self.arguments["orientations"] == "all" else np.any
        return np.asarray(rule(self.inside(kind), 0))

    def volume(
        self, kind: str = ALL, rule: VolumeRule | str = VolumeRule.CORNERS
    ) -> WorkspaceVolume:
        """Volume of the positions that belong to it."""
        return workspace_volume(self.places(kind), self.grid.axes, rule)

    def is_tilted(self) -> bool:
        """True if there is a weight that does not pull along -z of W."""
        statics = self.arguments["statics"]
        return statics["down"] != [0.0, 0.0, -1.0] and statics["weight"] > 0.0

    def axes_words(self) -> str:
        """Of which world all coordinates are, and where the weight pulls in it."""
        x, y, z = self.arguments["statics"]["down"]
        if not self.is_tilted():
            return "those of W; the weight pulls along -z"
        tilt = np.degrees(np.arctan2(np.hypot(x, y), -z))
        return (
            "those of W, which was not turned; the weight pulls along "
            f"({x:.6g}, {y:.6g}, {z:.6g}), {tilt:.4g} deg off -z"
        )

    def as_dict(self) -> dict[str, Any]:
        """Arguments, axes, versions, shares, volumes, ranges of measures, and the hull."""
        result: dict[str, Any] = {
            **self.arguments, "axes": self.axes_words(), "versions": self.versions,
            "workspaces": {name: self._numbers(name) for name in self._regions()},
            "measured": {name: self._range(name) for name in self.values},
        }  # fmt: skip
        if WORST in self.values:
            result["broken"] = self._broken()
        if self.hull is not None and self.bound is not None:
            result["hull"] = hull_numbers(self.hull, self.bound)
        return result

    def _regions(self) -> list[str]:
        return [*self.holds, ALL] if len(self.holds) > 1 else list(self.holds)

    def title(self, kind: str) -> str:
        """What a kind is, in words, or what all have in common."""
        return KINDS[kind].title if kind in KINDS else "all of these"

    def _numbers(self, kind: str) -> dict[str, Any]:
        inside = self.inside(kind)
        return {
            "title": self.title(kind),
            "pose_share": float(np.mean(inside)),
            **region_numbers(inside, self.places(kind), self.grid.axes),
        }

    def _range(self, name: str) -> dict[str, Any]:
        """Least, median and largest finite value within the workspace."""
        values = self.values[name][self.inside()]
        values = values[np.isfinite(values)]
        of: dict[str, Any] = {"least": np.min, "median": np.median, "largest": np.max}
        return {
            "title": MEASURES[name].title, "unit": MEASURES[name].unit,
            **{word: finite(float(take(values))) if len(values) else None
               for word, take in of.items()},
        }  # fmt: skip

    def _broken(self) -> dict[str, Any]:
        """How often each cable is worst and each reaction best, and what is so at each pose.

        Names are null where all cables do not hold the pose.
        """
        about = self.arguments["breaks"]
        worst, best = (
            [None if np.isnan(n) else labels[int(n) - 1] for n in self.values[key].ravel()]
            for key, labels in ((WORST, about["cable_names"]), (BEST, about["reactions"]))
        )
        survives = self.holds.get(SURVIVES)
        columns = {
            "pose_m_rad": self.grid.pose_rows().tolist(),
            "survives": [None] * len(worst) if survives is None else survives.ravel().tolist(),
            "worst_cable": worst, "best_reaction": best,
            "excursion_m": [finite(float(far)) for far in self.values[EXCURSION].ravel()],
        }  # fmt: skip
        return {
            "worst_cables": dict(Counter(filter(None, worst))),
            "best_reactions": dict(Counter(filter(None, best))),
            "poses": [
                dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)
            ],
        }

    def tables(self) -> list[Table]:
        """Shares and volumes of the kinds, and ranges of the measures."""
        method = self.arguments["method"]
        by = "" if method is None else f", tensions by {method}"
        title = f"{self.arguments['robot']}: workspaces, {self.geometry}{by}"
        rows = []
        for name in self._regions():
            volume, about = self.volume(name), self._numbers(name)
            shares = f"{100.0 * about['pose_share']:.2f}", f"{100.0 * volume.share:.2f}"
            rows.append((name, *shares, f"{volume.value:.4g}", about["title"]))
        heads = ("kind", "poses [%]", "cells inside [%]", f"volume [{self.volume().unit}]", "where")
        ranges = []
        for about in (self._range(name) for name in self.values if name not in NUMBERED):
            three = [about[word] for word in ("least", "median", "largest")]
            values = ["-" if value is None else f"{value:.4g}" for value in three]
            ranges.append((f"{about['title']} [{about['unit']}]", *values))
        measured = [Table("Measures inside", ("measure", "least", "median", "largest"), ranges)]
        return [Table(title, heads, rows), *(measured if ranges else [])]

    def lines(self) -> list[str]:
        """The grid, worst cables, hull, and where results are."""
        lines = [grid_words(self.grid, self.robot, self.arguments["orientations"])]
        if self.is_tilted():
            lines.append(f"axes: {self.axes_words()}")
        if WORST in self.values:
            broken = self._broken()
            for words in ("worst cable", "best reaction"):
                counted = broken[f"{words.replace(' ', '_')}s"].items()
                often = ", ".join(f"{name} at {n}" for name, n in counted)
                lines.append(f"{words} of the poses: {often or 'none'}")
        return [*lines, *self._hull_lines(), *self.last_lines()]

    def _hull_lines(self) -> list[str]:
        if self.hull is None or self.bound is None:
            return []
        cut = int(np.count_nonzero(self.hull.cut))
        bounded, ends = BOUNDS[self.bound.kind]
        return [
            f"hull: {self.hull.volume:.4g} m^3, {self.hull.area:.4g} m^2, "
            f"{len(self.hull.vertices)} rays, bounded by {bounded}, {self.bound.why}; {cut} of "
            f"them were cut {ends}"
        ]

    def notes(self) -> list[str]:
        """What may be taken for something else."""
        notes = []
        if self.robot is not None and self.robot.frame.assumed and self.region is None:
            notes.append(
                "note: the robot's frame was assumed when it was imported; the default grid and "
                "certified boxes lie in it; use box for another region"
            )
        endless = 0 if self.hull is None else int(np.count_nonzero(self.hull.cut))
        if endless and self.bound is not None and self.bound.kind == NOTHING:
            notes.append(
                f"note: {endless} rays of the hull do not end: volume and area are those of what "
                "lies within ten times the frame; use box to end them"
            )
        return notes

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Planes of the grid by what holds and by each measure, and breaks."""
        from cdpr_drake.analyses.workspaces import workspace_figures as draw

        figures: dict[str, Callable[[], Figure]] = {
            name or "planes": partial(draw.planes_figure, self, name)
            for name in (None, *self.values) if name not in NUMBERED
        }  # fmt: skip
        if SURVIVES in self.holds:
            figures["breaks"] = partial(draw.breaks_figure, self)
        return figures

    def columns(self) -> dict[str, np.ndarray]:
        """A row a pose: where it is, which kinds hold, and the measures in their units."""
        parts = {**self.holds, **self.values}
        return {**self.grid.columns(), **{name: part.reshape(-1) for name, part in parts.items()}}

    def arrays(self) -> dict[str, np.ndarray]:
        """Names are kind/NAME and measure/NAME."""
        kinds = {f"kind/{name}": part for name, part in self.holds.items()}
        return kinds | {f"measure/{name}": part for name, part in self.values.items()}

    def write(self, folder: Folder, formats: Sequence[str], follow: Follow) -> dict[str, str]:
        """Writes the hull, too."""
        if self.hull is not None:
            save_hull(self.hull, folder)
        return super().write(folder, formats, follow)

    def page(self, robot: Robot) -> tuple[Pictures, str]:
        """What writes the page for the browser, and what should be known of it."""
        from cdpr_drake.analyses.workspaces.workspace_scene import workspace_page

        return workspace_page(self, robot)


def load_workspace(path: Path | str) -> Workspace:
    """Reads what `Workspace.save` wrote, from its file or folder.

    Raises:
        DataFileError: There is no such file, or it is not of that kind.
    """
    about, grid, arrays = load_grid(path, "kind/", "workspace", "cdpr workspace")
    groups: dict[str, dict[str, np.ndarray]] = {"kind": {}, "measure": {}}
    for key, array in arrays.items():
        group, _, name = key.partition("/")
        groups[group][name] = array
    return Workspace(**about, grid=grid, holds=groups["kind"], values=groups["measure"])

"""What came of a search: numbers, tables, the robot file, the table of all designs."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.design.confirmation import Confirmation, design_file
from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.analyses.design.search import DesignSearch
from cdpr_drake.analyses.reporting.log_files import write_json, write_whole
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, write_figures
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DesignError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.summaries import Summarized

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE = "designs.csv"
"""All designs that were judged, in the order of the search."""


@dataclass(frozen=True, eq=False, repr=False)
class DesignResult(Summarized):
    """A finished or stopped search, and what was confirmed of its best design.

    Attributes:
        robot: Name of the robot as it was.
        search: The search.
        confirmed: Volumes proven of the robot and of the design.
        geometry: Geometry of the cables in words, as `Robot.geometry_words`.
        folder: Where it was written; None: nowhere.
        file: The robot file of the best design there; None: there is none.
        failed: Of each figure that could not be written, the file and why.
    """

    robot: str
    search: DesignSearch
    confirmed: tuple[Confirmation, ...]
    geometry: str = ""
    folder: Path | None = None
    file: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)

    @property
    def interrupted(self) -> bool:
        """Whether the search or the proofs were stopped before the end."""
        return self.search.interrupted or not all(one.finished for one in self.confirmed)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: goals of robot, best design and front; what was confirmed."""
        search, best = self.search, self.search.best
        found: dict[str, Any] = {
            "robot": self.robot,
            "geometry": self.geometry,
            "interrupted": self.interrupted,
            "designs_judged": len(search.values),
            "refused": int(np.sum(~np.all(np.isfinite(search.values), axis=1))),
            "coordinates": search.candidates.size,
            "wall_time_s": search.progress.wall_time,
            "settings": plain(search.settings),
            "grid_points": list(search.judging.grid.shape[1:]),
            "orientations": len(search.judging.grid.angles),
            "goals": {
                name: {"title": GOALS[name].title, "unit": GOALS[name].unit}
                for name in search.names
            },
            "original": _named(search.names, search.original),
            "best": None,
            "front": [
                {"design": int(k), **_named(search.names, search.values[k])} for k in search.front
            ],
            "confirmed": [one.as_dict() for one in self.confirmed],
            "versions": package_versions(),
        }
        if best is not None:
            found["best"] = {
                "design": best,
                "cables": self._cables(best),
                "score": float(search.scores[best]),
                **_named(search.names, search.values[best]),
            }
        return found

    def plot(self) -> Figure:
        """How the search went."""
        from cdpr_drake.analyses.design.figures import design_drawings

        return next(iter(design_drawings(self.robot, self.search).values()))()

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: goals of the robot and of the best design."""
        search, best = self.search, self.search.best
        rows = [
            ("geometry", self.geometry),
            ("designs", f"{len(search.values)} judged, {search.candidates.size} coordinates"),
        ]
        for k, name in enumerate(search.names[:4]):
            sign = -1.0 if GOALS[name].smaller else 1.0
            after = "-" if best is None else f"{sign * search.values[best, k]:.5g}"
            rows.append((name, f"{sign * search.original[k]:.5g} to {after} {GOALS[name].unit}"))
        for one in self.confirmed[:3]:
            rows.append(("proven", f"{one.goal} {one.original:.5g} to {one.design:.5g} {one.unit}"))
        return f"Design of {self.robot}" + ", interrupted" * self.interrupted, rows

    def _cables(self, number: int) -> list[int]:
        return [k + 1 for k in self.search.candidates.kept[self.search.sets[number]]]

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        search, best = self.search, self.search.best
        goals = Table(
            box=SIMPLE_HEAD,
            title=f"{self.robot}, {self.geometry}: goals on the search's grid, "
            f"{len(search.values)} designs",
        )
        for heading in ("goal", "unit", "robot", "best design"):
            goals.add_column(heading)
        for k, name in enumerate(search.names):
            sign = -1.0 if GOALS[name].smaller else 1.0
            after = "-" if best is None else f"{sign * search.values[best, k]:.5g}"
            goals.add_row(name, GOALS[name].unit, f"{sign * search.original[k]:.5g}", after)
        proven = Table(box=SIMPLE_HEAD, title="Proven of both, not by the search")
        for heading in ("goal", "robot", "best design", "unit", "open", "gain", "how"):
            proven.add_column(heading)
        for one in self.confirmed:
            gain = "-" if one.gain is None else f"{100.0 * one.gain:+.1f} %"
            opens = f"{one.original_open:.3g}, {one.design_open:.3g}"
            proven.add_row(
                one.goal, f"{one.original:.5g}", f"{one.design:.5g}", one.unit, opens, gain,
                one.method,
            )  # fmt: skip
        return [goals, proven] if self.confirmed else [goals]

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """Writes the table of designs, `results.json`, then the figures, into a folder that exists.

        Returns:
            Of each figure that could not be written, the file and why, in one line.
        """
        self.write_data(folder)
        return self.write_figures(folder, formats)

    def write_data(self, folder: Path) -> None:
        """Writes the table of designs and `results.json` into a folder that exists."""
        write_table(self.search, folder / TABLE)
        write_json(folder / "results.json", self.as_dict())

    def write_figures(self, folder: Path, formats: Sequence[str]) -> dict[str, str]:
        """Writes the figures alone, as `write`."""
        from cdpr_drake.analyses.design.figures import design_drawings

        return write_figures(folder, design_drawings(self.robot, self.search), formats)


def write_design(search: DesignSearch, robot: str, folder: Path) -> Path:
    """Writes the robot file of the best design, which loads as any other, and returns its path.

    Raises:
        DesignError: No design could be judged.
    """
    best = search.best
    if best is None:
        raise DesignError("design: no design could be judged; accepted: smaller reaches")
    title = f"{robot}, design of {len(search.values)} judged for {', '.join(search.names)}"
    text = search.candidates.robot_text(search.sets[best], search.coordinates[best], title)
    path = design_file(folder)
    path.parent.mkdir(exist_ok=True)
    write_whole(path, text)
    load_robot(str(path))
    return path


def write_table(search: DesignSearch, path: Path) -> None:
    """Writes all designs: set of cables, coordinates, goals, score, whether on the front."""
    front = set(search.front.tolist())
    with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        coordinates = [f"x{k + 1}" for k in range(search.candidates.size)]
        rows.writerow(["design", "cables", *coordinates, *search.names, "score", "on_front"])
        for k, x in enumerate(search.coordinates):
            cables = " ".join(str(c + 1) for c in search.candidates.kept[search.sets[k]])
            values = _named(search.names, search.values[k]).values()
            rows.writerow([k, cables, *x.tolist(), *values, search.scores[k], k in front])


def _named(names: Sequence[str], values: Array) -> dict[str, float | None]:
    """Goals by name, as they are: not with the sign changed."""
    return {
        name: None if not np.isfinite(value) else float(-value if GOALS[name].smaller else value)
        for name, value in zip(names, values, strict=True)
    }

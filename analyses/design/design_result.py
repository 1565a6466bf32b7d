"""A better robot: the designs of a search, the best of them, and what is proven of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdpr_drake.analyses.design.candidates import Candidates
from cdpr_drake.analyses.design.confirmation import Confirmation
from cdpr_drake.analyses.design.goals import GOALS, GoalContext, goal_signs
from cdpr_drake.analyses.design.settings import DesignSettings
from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.result import STOPPED, Result, Table
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.arrays import Array
from cdpr_drake.numerics.own_terms import ProgramReport
from cdpr_drake.palette import IDEAL, PLATFORM, nth_look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE, RESULTS, ROBOT_FILE = "designs.csv", "results.json", "design/robot.yaml"
"""Files of a results folder: all designs in the order of the search, numbers, the best design."""


@dataclass(frozen=True, eq=False, repr=False)
class Design(Result):
    """A finished or stopped search, and what was confirmed of its best design.

    Attributes:
        candidates: The designs that there may be.
        settings: Goals, poses and length of the search.
        judging: What designs were judged by.
        original: Goals of the robot as it is, larger is better, shape (goals,).
        sets: Number of the set of cables of each design, shape (n,).
        coordinates: The designs, in the order of the search, shape (n, size).
        values: Their goals, larger is better, shape (n, goals).
        scores: Weighted sums, as `scores_of`, shape (n,).
        complete: True if the search was not stopped.
        earlier: How many of the designs an earlier command had judged.
        wall_time: Time that the search took [s].
        program: How a `DesignProgram` with own terms was solved; None: by a search.
        confirmed: Volumes proven of the robot and of the best design.
        folder: Results folder; None if nothing was kept.
        failed: Of files that could not be written, the name and why.
    """

    candidates: Candidates
    settings: DesignSettings
    judging: GoalContext
    original: Array
    sets: np.ndarray
    coordinates: Array
    values: Array
    scores: Array
    complete: bool = True
    earlier: int = 0
    wall_time: float = 0.0
    program: ProgramReport | None = None
    confirmed: tuple[Confirmation, ...] = ()
    folder: Path | None = None
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def robot(self) -> str:
        """Name of the robot as it was."""
        return self.candidates.present.name

    @property
    def geometry(self) -> str:
        """Geometry of the cables in words, as `Robot.geometry_words`."""
        return self.candidates.present.geometry_words()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the goals."""
        return self.settings.goal_names

    @property
    def best(self) -> int | None:
        """Number of the design with the largest score; None if none could be judged."""
        return int(np.nanargmax(self.scores)) if np.any(np.isfinite(self.scores)) else None

    @property
    def front(self) -> np.ndarray:
        """Numbers of the designs that no other one is better than in everything."""
        return np.flatnonzero(pareto_front(self.values))

    @property
    def file(self) -> Path | None:
        """The robot file of the best design; None: there is none."""
        if self.folder is None or not self.complete or self.best is None:
            return None
        return self.folder / ROBOT_FILE

    @property
    def interrupted(self) -> bool:
        """True if the search or the proofs were stopped before the end."""
        return not (self.complete and all(proof.finished for proof in self.confirmed))

    @property
    def exit_code(self) -> int:
        """Of a stopped search."""
        return STOPPED if self.interrupted else 0

    def as_dict(self) -> dict[str, Any]:
        """For JSON: goals of robot, best design and front, and what was confirmed."""
        best, grid = self.best, self.judging.grid
        return {
            "robot": self.robot,
            "geometry": self.geometry,
            "interrupted": self.interrupted,
            "designs_judged": len(self.values),
            "refused": int(np.sum(~np.all(np.isfinite(self.values), axis=1))),
            "coordinates": self.candidates.size,
            "wall_time_s": self.wall_time,
            "settings": plain(self.settings),
            "grid_points": list(grid.shape[1:]),
            "orientations": len(grid.angles),
            "goals": {
                name: {"title": GOALS[name].title, "unit": GOALS[name].unit}
                for name in self.names
            },
            "original": _named(self.names, self.original),
            "best": None if best is None else {
                "design": best,
                "cables": [k + 1 for k in self.candidates.cable_sets[self.sets[best]]],
                "score": float(self.scores[best]),
                **_named(self.names, self.values[best]),
            },
            "front": [
                {"design": int(k), **_named(self.names, self.values[k])} for k in self.front
            ],
            "confirmed": [proof.as_dict() for proof in self.confirmed],
            "versions": package_versions(),
        }  # fmt: skip

    def tables(self) -> list[Table]:
        """Goals of the robot and of the best design, and what is proven of both."""
        best, signs = self.best, goal_signs(self.names)
        before = [f"{value:.5g}" for value in signs * self.original]
        after = ["-"] * len(signs)
        if best is not None:
            after = [f"{value:.5g}" for value in signs * self.values[best]]
        units = [GOALS[name].unit for name in self.names]
        title = (
            f"{self.robot}, {self.geometry}: goals on the search's grid, {len(self.values)} designs"
        )
        rows = list(zip(self.names, units, before, after, strict=True))
        tables = [Table(title, ("goal", "unit", "robot", "best design"), rows)]
        if self.confirmed:
            headings = ("goal", "robot", "best design", "unit", "open", "gain", "how")
            tables.append(Table("Proven of both, not by the search", headings, [
                (proof.goal, f"{proof.original:.5g}", f"{proof.design:.5g}", proof.unit,
                 f"{proof.original_open:.3g}, {proof.design_open:.3g}",
                 "-" if proof.gain is None else f"{100.0 * proof.gain:+.1f} %", proof.method)
                for proof in self.confirmed
            ]))  # fmt: skip
        return tables

    def lines(self) -> list[str]:
        """Where results are."""
        lines = [] if self.file is None else [f"robot file: {self.file}"]
        lines += [] if self.folder is None else [f"results: {self.folder}"]
        return lines

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """How the score rose; what goals cost each other; which points moved."""
        figures = {"progress": self._progress}
        if len(self.names) > 1:
            figures["pareto"] = self._pareto
        if self.best is not None:
            figures["points"] = self._points
        return figures

    def _progress(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import line_style, new_figure

        figure, axes = new_figure(1, 1, (7.5, 5.0), f"{self.robot}: search")
        for number, cables in enumerate(self.candidates.cable_sets):
            scores = self.scores[self.sets == number]
            if not len(scores):
                continue
            look, index = nth_look(number), np.arange(1, len(scores) + 1)
            axes.plot(index, scores, ".", color=look.color, markersize=3, alpha=0.5)
            axes.step(
                index, np.fmax.accumulate(scores), where="post", color=look.color,
                linestyle=look.dash, label=f"best, {len(cables)} cables",
            )  # fmt: skip
        weights = np.array([goal.weight for goal in self.settings.goals])
        original = np.where(np.isfinite(self.original), np.sign(self.original), 0.0) @ weights
        axes.axhline(original, **line_style(IDEAL), label="robot as it is")
        axes.set(xlabel="designs judged", ylabel="score (robot as it is: 1 for each weight)")
        axes.legend(loc="lower right")
        return figure

    def _pareto(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import panels

        signs, look = goal_signs(self.names), nth_look(1)
        pairs = list(pairwise(range(len(signs))))
        title = f"{self.robot}: what goals cost each other"
        figure, grid = panels(len(pairs), len(pairs), (6.5 * len(pairs), 5.5), title)
        values, original = self.values * signs, self.original * signs
        labels = [
            name + ("" if GOALS[name].unit == "-" else f" [{GOALS[name].unit}]")
            + (", less is better" if GOALS[name].smaller else "")
            for name in self.names
        ]  # fmt: skip
        for axes, (x, y) in zip(grid, pairs, strict=True):
            axes.plot(
                values[:, x], values[:, y], ".", color="#a0a0a0", markersize=3, label="designs"
            )
            front = self.front[np.argsort(values[self.front, x])]
            axes.plot(
                values[front, x], values[front, y], linestyle=look.dash, marker=look.marker,
                color=look.color, markersize=6, label="no other is better in everything",
            )  # fmt: skip
            axes.plot(
                original[x], original[y], "*", color="black", markersize=14, label="robot as it is"
            )
            if self.best is not None:
                best = values[self.best]
                axes.plot(
                    best[x], best[y], "D", markerfacecolor="none", markeredgecolor=PLATFORM.color,
                    markeredgewidth=2, markersize=11, label="best score",
                )  # fmt: skip
            axes.set(xlabel=labels[x], ylabel=labels[y])
            axes.legend(loc="best")
        return figure

    def _points(self) -> Figure:
        from cdpr_drake.analyses.frame.figures import few_ticks, new_figure

        assert self.best is not None
        figure, panels = new_figure(1, 2, (12.0, 5.5), f"{self.robot}: points moved")
        design = self.candidates.robot(self.sets[self.best], self.coordinates[self.best])
        present = self.candidates.present
        before, after = present.cable_set(), design.cable_set()
        cables = list(self.candidates.cable_sets[self.sets[self.best]])
        for axes, kind, frame, old, new in (
            (panels[0], "exit", "W", before.p_WA, after.p_WA),
            (panels[1], "anchor", "P", before.p_PB, after.p_PB),
        ):
            axes.plot(*old[:2], "o", markerfacecolor="none", color="black", label="robot as it is")
            axes.plot(*new[:2], "s", color=nth_look(0).color, markersize=5, label="best design")
            places: dict[tuple[float, ...], list[str]] = {}
            for k, i in enumerate(cables):
                axes.plot(*np.array([old[:2, i], new[:2, k]]).T, "-", color="#707070", lw=1)
                places.setdefault(tuple(old[:2, i].tolist()), []).append(present.cables[i].name)
            for (x, y), names in places.items():
                axes.annotate(
                    ", ".join(names), (x, y), textcoords="offset points",
                    xytext=(-12 if x > 0.0 else 8, -14 if y > 0.0 else 8),
                    ha="right" if x > 0.0 else "left",
                )  # fmt: skip
            few_ticks(axes.xaxis)
            axes.set(
                xlabel=f"x in {frame} [m]", ylabel=f"y in {frame} [m]",
                title=f"{kind} points, from above", aspect="equal",
            )  # fmt: skip
            axes.legend(loc="center")
        return figure

    def write(self, folder: Folder) -> None:
        """Writes the table of designs, then the numbers."""
        front = set(self.front.tolist())
        text = io.StringIO(newline="")
        rows = csv.writer(text)
        coordinates = [f"x{k + 1}" for k in range(self.candidates.size)]
        rows.writerow(["design", "cables", *coordinates, *self.names, "score", "on_front"])
        for k, x in enumerate(self.coordinates):
            cables = " ".join(str(c + 1) for c in self.candidates.cable_sets[self.sets[k]])
            values = _named(self.names, self.values[k]).values()
            rows.writerow([k, cables, *x.tolist(), *values, self.scores[k], k in front])
        with folder.file(TABLE) as part:
            part.write_bytes(text.getvalue().encode())
        folder.write_json(RESULTS, self.as_dict())


def pareto_front(values: Array) -> np.ndarray:
    """Which rows no other row equals or exceeds in everything and exceeds in something.

    Args:
        values: One design a row, larger is better, shape (n, k); rows with NaN never count.

    Returns:
        Shape (n,), bool. Of equal rows the first counts.

    Source: Deb, Multi-objective optimization using evolutionary algorithms, 2001.
    """
    values = np.asarray(values, float)
    good = np.all(np.isfinite(values), axis=1)
    front = good.copy()
    for i in np.flatnonzero(good):
        better = np.all(values[good] >= values[i], axis=1) & np.any(
            values[good] > values[i], axis=1
        )
        equal = np.all(values[:i] == values[i], axis=1) & good[:i]
        front[i] = not np.any(better) and not np.any(equal)
    return front


def _named(names: Sequence[str], values: Array) -> dict[str, float | None]:
    """Goals by name, as they are: not with the sign changed."""
    return {
        name: float(value) if np.isfinite(value) else None
        for name, value in zip(names, values * goal_signs(names), strict=True)
    }

"""Study: how large errors may be before a servo's stability is lost."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.figure_style import new_figure, save_figure
from cdpr_drake.analyses.stability_recipe import DRAWS, recipe_case, recipe_grid, single_bounds
from cdpr_drake.analyses.study_progress import StudyProgress
from cdpr_drake.perturbation_bounds import PerturbationBounds
from cdpr_drake.servo_target import FixedError, OppositeCorner
from cdpr_drake.stability_case import StabilityCase
from cdpr_drake.stability_verdict import VerdictOptions, judge
from cdpr_drake.workspace_volume import VolumeRule, workspace_volume

RESULTS = "results.json"
"""Numbers of the study, rewritten after every row."""

SINGLE_ROBOT, FULL = "acrobot_small", 1.014
"""Robot of 3.4.2, and its full workspace [m^3]."""

SINGLE = {
    "r_pc": {0.2: 1.014, 1.0: 1.014},
    "d_theta_pc_deg": {40.0: 1.014, 55.0: 0.514, 65.0: 0.0},
    "r_s": {0.5: 1.014},
    "d_theta_s_deg": {90.0: 1.014},
    "r_A": {0.01: 0.802, 0.03: 0.503},
    "r_B": {0.01: 0.794, 0.03: 0.506},
    "d_theta_bp_deg": {3.0: 0.936, 10.0: 0.786},
    "r_bp": {0.01: 0.907, 0.1: 0.761},
}
"""Published volumes with one bound and all else known exactly [m^3]. Source: 3.4.2."""

PLANAR_COMBINATIONS = {2: (5.0, 0.5, 0.3, 6.0), 13: (0.5, 0.3, 0.2, 61.0)}
"""Combinations of figure 3.1: limits of each of |e_x|, |e_y| [m], of their errors [m], of the
camera's place [m], and of its turn [deg]. Source: 3.2.1, stability analysis II."""

OBJECT_TURNS = (0.0, 90.0, 160.0)
"""Rotation errors for which the largest error of the object's place is sought [deg]. Source: 3.2.2,
stability analysis I, where 160 deg is the largest."""

PUBLISHED_OBJECT_ERROR = 1.5
"""Largest error of the object's place of figure 3.3 [m]."""


@dataclass(frozen=True)
class RangeRow:
    """One question and its answers.

    Attributes:
        section: Section of the servoing thesis.
        question: What is asked.
        published: What the thesis says.
        unit: Unit of all answers.
        answers: What was found, by name.
    """

    section: str
    question: str
    published: float
    unit: str
    answers: dict[str, float]


@dataclass(frozen=True, eq=False)
class StabilityRangesStudy:
    """What the study found.

    Attributes:
        rows: Rows that were finished.
        quick: Whether it was the quick form, on a coarse grid.
        interrupted: Whether it was stopped before the end.
        wall_time: Time it took [s].
    """

    rows: tuple[RangeRow, ...]
    quick: bool
    interrupted: bool
    wall_time: float

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""
        return {
            "study": "stability-ranges",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.wall_time,
            "parameters": {"draws": DRAWS, "seed": 0, "robot": SINGLE_ROBOT},
            "rows": [asdict(row) for row in self.rows],
        }

    def tables(self) -> list[Table]:
        """One table for each section."""
        tables = []
        for section in dict.fromkeys(row.section for row in self.rows):
            mine = [row for row in self.rows if row.section == section]
            names = list(dict.fromkeys(name for row in mine for name in row.answers))
            table = Table(title=section, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
            table.add_column("question")
            for heading in ("published", *names, "unit"):
                table.add_column(heading, justify="right")
            for row in mine:
                found = (
                    f"{row.answers[name]:.3f}" if name in row.answers else "" for name in names
                )
                table.add_row(row.question, f"{row.published:g}", *found, row.unit)
            tables.append(table)
        return tables

    def write(self, folder: Path) -> None:
        """Writes `results.json` and the figure into a folder that exists."""
        _write(folder, self)
        single = [row for row in self.rows if row.unit == "m^3"]
        if single:
            save_figure(_figure(single), folder / "single_errors.png")


def planar_margin(error: float, d_error: float, d_place: float, psi: float) -> float:
    """Smallest eigenvalue of planar analysis II over boxes of errors, camera turned by psi [rad].

    With d_1, d_2 of the thesis it is (1 + cos psi - sqrt((1 - cos psi)^2 + d_1^2 + d_2^2)) / 2, and
    the length of (d_1, d_2) is convex in the errors, so that the corners of the boxes decide.

    Args:
        error: Limit of |e_x|, |e_y| [m].
        d_error: Limit of their errors [m].
        d_place: Limit of the error of the camera's place along x, y [m].
        psi: Error of its turn [rad].

    Source: servoing thesis (3.15) to (3.17).
    """
    corners = np.array(list(product((-1.0, 1.0), repeat=6)))
    e, e_hat = error * corners[:, :2], error * corners[:, :2] + d_error * corners[:, 2:4]
    dt, c, s = d_place * corners[:, 4:], math.cos(psi), math.sin(psi)
    d1 = e_hat[:, 1] * c - e[:, 1] + e_hat[:, 0] * s - dt[:, 1]
    d2 = -e_hat[:, 0] * c + e[:, 0] + e_hat[:, 1] * s + dt[:, 0]
    return float((1.0 + c - np.sqrt((1.0 - c) ** 2 + np.max(d1**2 + d2**2))) / 2.0)


def largest(stable: Callable[[float], bool], high: float) -> float:
    """The largest number up to `high` up to which `stable` holds, by bisection to 1/1000."""
    low = 0.0
    if stable(high):
        return high
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def study_stability_ranges(
    quick: bool = False,
    folder: Path | None = None,
    on_progress: Callable[[StudyProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> StabilityRangesStudy:
    """Runs the study.

    Args:
        quick: On a coarse grid, to see that everything works.
        folder: Where to keep `results.json` up to date while it runs; None: nowhere.
        on_progress: Called after every row.
        should_stop: Asked as often; what was finished is kept.

    Source: servoing thesis 3.2.1, 3.2.2 and 3.4.2.
    """
    began = time.perf_counter()
    total = 1 + len(PLANAR_COMBINATIONS) + len(OBJECT_TURNS) + sum(map(len, SINGLE.values()))
    rows: list[RangeRow] = []

    def study(interrupted: bool) -> StabilityRangesStudy:
        wall = time.perf_counter() - began
        return StabilityRangesStudy(tuple(rows), quick, interrupted, wall)

    for row in _rows(quick):
        rows.append(row)
        if folder is not None:
            _write(folder, study(interrupted=True))
        if on_progress is not None:
            wall = time.perf_counter() - began
            on_progress(StudyProgress(row.question, len(rows), total, wall, "rows/s"))
        if should_stop is not None and should_stop():
            return study(interrupted=True)
    return study(interrupted=False)


def _rows(quick: bool) -> Iterator[RangeRow]:
    planar = "3.2.1, planar: stability analyses I and II"
    limit = largest(lambda d: planar_margin(0.0, d / math.sqrt(2.0), 0.0, 0.0) > 0.0, 4.0)
    yield RangeRow(planar, "largest error of the object's place alone", 2.0, "m", {"found": limit})
    for number, (e, de, dt, turn) in PLANAR_COMBINATIONS.items():
        yield RangeRow(
            planar,
            f"Cb. {number}: |e| <= {e:g} m, its error {de:g} m, camera off by {dt:g} m; "
            "largest turn of the camera",
            turn,
            "deg",
            {
                "found": largest(
                    lambda a, e=e, de=de, dt=dt: planar_margin(e, de, dt, math.radians(a)) > 0.0,  # type: ignore[misc]
                    90.0,
                )
            },
        )
    robot = recipe_case(SINGLE_ROBOT, "pbvs")
    pose = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3]])
    for turn in OBJECT_TURNS:
        case = StabilityCase(
            robot.p_WA, robot.p_PB, target=FixedError(np.array([0.0, 0.0, math.radians(turn)]))
        )
        yield RangeRow(
            "3.2.2, spatial: stability analysis I",
            f"largest error of the object's place, rotation error {turn:g} deg about z",
            PUBLISHED_OBJECT_ERROR,
            "m",
            {
                verdict: largest(
                    lambda r, case=case, verdict=verdict: bool(  # type: ignore[misc]
                        judge(case, PerturbationBounds(r_s=r), pose, verdict).stable[0]
                    ),
                    4.0,
                )
                for verdict in ("sampled", "searched", "certified")
            },
        )
    yield from _single_rows(quick)


def _single_rows(quick: bool) -> Iterator[RangeRow]:
    robot, grid = recipe_case(SINGLE_ROBOT, "pbvs"), recipe_grid(SINGLE_ROBOT, quick)
    case = StabilityCase(robot.p_WA, robot.p_PB, target=OppositeCorner(grid.lower, grid.upper))
    poses, options = grid.pose_rows(), VerdictOptions(draws=DRAWS, margins=False)
    for name, published in SINGLE.items():
        for value, volume in published.items():
            bounds = single_bounds(PerturbationBounds(), name, value)
            verdicts = ["sampled", "searched"]
            if name != "d_theta_s_deg":
                verdicts.append("certified")
            answers = {}
            for verdict in verdicts:
                stable = judge(case, bounds, poses, verdict, options).stable
                inside = stable.reshape(grid.shape)[0]
                answers[verdict] = workspace_volume(inside, grid.axes, VolumeRule.CORNERS).value
            unit = "deg" if name.endswith("_deg") else "m"
            yield RangeRow(
                f"3.4.2, {SINGLE_ROBOT}: volume with one bound, all else known",
                f"{name.removesuffix('_deg')} = {value:g} {unit}",
                volume,
                "m^3",
                answers,
            )


def _figure(rows: list[RangeRow]) -> Figure:
    figure, axes = new_figure(1, 1, (9.0, 6.5), f"One wrong parameter, {SINGLE_ROBOT}, PBVS")
    places = np.arange(len(rows))
    names = ("published", "sampled", "searched", "certified")
    for k, name in enumerate(names):
        values = [
            row.published if name == "published" else row.answers.get(name, 0.0) for row in rows
        ]
        colour = "0.4" if name == "published" else f"C{k - 1}"
        axes.barh(places + 0.2 * (1.5 - k), values, 0.2, color=colour, label=name)
    axes.set_yticks(places, [row.question for row in rows])
    axes.invert_yaxis()
    axes.set_xlabel("workspace [m^3]")
    axes.set_xlim(0.0, 1.1 * FULL)
    figure.legend(loc="outside lower center", ncols=len(names))
    return figure


def _write(folder: Path, study: StabilityRangesStudy) -> None:
    (folder / RESULTS).write_text(
        json.dumps(study.as_dict(), indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )

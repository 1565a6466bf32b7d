"""`cdpr study proven-paths`: paths in proven sets beside RRT* and free motions, in 20 problems.

A problem is a start and a goal of a robot among a wall, pillars or a shelf, which no straight line
joins. All planners have the same robot, limits, obstacles and exact checks of poses, of which each
path is judged at many samples. Processor times are measured, so that cases run one by one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import EMPTY
from cdpr_drake.analyses.studies.proven_paths.measured import (
    OMPL_COLUMNS,
    OWN_COLUMNS,
    Effort,
    measure_free,
    measure_problem,
    measure_sampled,
)
from cdpr_drake.analyses.studies.proven_paths.problems import (
    PROBLEMS,
    ROBOTS,
    SCENES,
    SEED,
    SPECS,
    Spec,
)
from cdpr_drake.analyses.studies.proven_paths.sampled_planners import OMPL_SECONDS
from cdpr_drake.analyses.studies.proven_paths.statements import (
    CHECKS,
    FREE,
    PROBLEM,
    SAMPLED,
    sampled_length,
)
from cdpr_drake.analyses.visualization.figure_style import few_ticks, line_style, new_figure
from cdpr_drake.palette import BOUND, DISTANCE, IDEAL

NO_PATH = "no proven path"
"""Stands in the panel of a scene in which none was found."""

EFFORT = Effort(
    boxes=150_000, cells=2**18, more_boxes=1_000_000, more_cells=2**21, samples=100_000,
    vertices=200, looks=10_000,
)  # fmt: skip
"""Of the full form."""

QUICK_EFFORT = Effort(
    boxes=30_000,
    cells=2**15,
    more_boxes=0,
    more_cells=0,
    samples=2_000,
    vertices=100,
    looks=2_000,
)
"""Of the quick form."""

QUICK = (Spec("caroca", "wall", 1),)
"""Problems of the quick form."""

FREE_SPECS = tuple(
    Spec("caroca", scene, number)
    for scene, number in (("wall", 1), ("wall", 2), ("pillars", 1), ("pillars", 2), ("shelf", 1))
)
"""Problems of which free motions are planned, too, in the full form."""

FREE_SECONDS = 40.0
"""Processor time after which no further start of a free motion is tried [s]."""


def cases(form: Form) -> Iterator[Case]:
    """The problems, scene by scene; then sampled planners on them; then free motions."""
    effort = QUICK_EFFORT if form.quick else EFFORT
    specs = QUICK if form.quick else SPECS
    for spec in specs:
        yield _case(spec, PROBLEM, spec.name, partial(measure_problem, spec, effort))
    for spec in specs:
        call = partial(measure_sampled, spec, effort)
        yield _case(spec, SAMPLED, f"{spec.name}, RRT*", call)
    for spec in () if form.quick else FREE_SPECS:
        call = partial(measure_free, spec, FREE_SECONDS, effort.samples)
        yield _case(spec, FREE, f"{spec.name}, free motion", call)


def _case(spec: Spec, kind: str, name: str, call: partial[dict[str, Any]]) -> Case:
    keys = {"kind": kind, "robot": spec.robot, "scene": spec.scene, "number": spec.number}
    return Case(name=name, keys=keys, data=call, alone=True)


def measure(case: Case, seed: int) -> Mapping[str, Any]:
    """What was found of a problem, see `measured`."""
    found: Mapping[str, Any] = case.data()
    return found


def parameters(form: Form) -> Mapping[str, Any]:
    """What all problems have in common."""
    return {
        "seed": SEED,
        "accelerations_m_s2": ROBOTS,
        "problems": {name: dict(zip(SCENES, counts, strict=True)) for name, counts in
                     PROBLEMS.items()},
        "effort": asdict(QUICK_EFFORT if form.quick else EFFORT),
        "ompl_s": OMPL_SECONDS,
        "free_s": FREE_SECONDS,
    }  # fmt: skip


def problems_table(runs: Runs) -> Table:
    """A row a problem."""
    table = new_table(
        "Proven paths beside RRT* with shortcuts; processor times; i: infeasible samples",
        ("robot", "scene", "number"),
        (
            "status", "straight [m]", "proven [m]", "bound [m]", "i", "sets [s]", "path [s]",
            "RRT* [m]", "i", "RRT* [s]", "OMPL [m]", "i", "OMPL [s]", "ratio",
        ),
    )  # fmt: skip
    for run in runs(kind=PROBLEM):
        other = _same(runs, run, SAMPLED)
        sampled = [
            words
            for length, wrong, took in (OWN_COLUMNS, OMPL_COLUMNS)
            for words in (
                _number(other, length, ".3f"),
                _number(other, wrong, "d", length),
                _number(other, took, ".1f"),
            )
        ]
        again = 0.0 if np.isnan(run["again_s"]) else run["again_s"]
        ratio = np.nan if other is None else run["length_m"] / sampled_length(other)
        table.add_row(
            run["robot"], run["scene"], str(run["number"]), run["status"],
            _number(run, "straight_m", ".3f"), _number(run, "length_m", ".3f"),
            _number(run, "bound_m", ".3f"), _number(run, "infeasible", "d", "length_m"),
            f"{run['sets_s'] + again:.1f}", _number(run, "path_s", ".2f"), *sampled,
            f"{ratio:.3f}" if np.isfinite(ratio) else EMPTY,
        )  # fmt: skip
    return table


def free_table(runs: Runs) -> Table:
    """A row a free motion, beside the proven one."""
    table = new_table(
        "Free motions between the same poses; processor times; i: infeasible samples",
        ("robot", "scene", "number"),
        ("free [s]", "free [m]", "i", "took [s]", "proven [s]", "proven [m]", "what came of it"),
    )
    for run in runs(kind=FREE):
        proven = _same(runs, run, PROBLEM)
        table.add_row(
            run["robot"], run["scene"], str(run["number"]), _number(run, "duration_s", ".3f"),
            _number(run, "length_m", ".3f"), _number(run, "infeasible", "d", "length_m"),
            _number(run, "free_s", ".1f"), _number(proven, "duration_s", ".3f"),
            _number(proven, "length_m", ".3f"), run["status"],
        )  # fmt: skip
    return table


def _same(runs: Runs, run: Run, kind: str) -> Run | None:
    """The run of another kind of the same problem; None while it is not there."""
    same = ("robot", "scene", "number")
    for other in runs:
        if other["kind"] == kind and all(other[key] == run[key] for key in same):
            return other
    return None


def _number(run: Run | None, column: str, words: str, where: str = "") -> str:
    """A number of a run in words, `EMPTY` where it, or the one of another column, is not there."""
    if run is None:
        return EMPTY
    needed = [run[name] for name in (column, where or column)]
    there = all(value is not None and np.isfinite(value) for value in needed)
    return format(run[column], words) if there else EMPTY


def paths_figure(runs: Runs) -> Figure:
    """All scenes as seen from above: obstacles, proven paths, and those of RRT*."""
    scenes = list(runs(kind=PROBLEM).by("robot", "scene"))
    columns = min(len(scenes), len(SCENES))
    rows = -(-len(scenes) // columns)
    size = (4.2 * columns + 1.0, 3.6 * rows + 1.4)
    figure, axes = new_figure(rows, columns, size, "Proven paths and RRT*, from above")
    places = np.atleast_1d(axes).ravel()
    for place, ((robot, scene), some) in zip(places, scenes, strict=False):
        for box in some.rows[0]["boxes_m"]:
            low, high = box[:2] - box[3:5], box[:2] + box[3:5]
            corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]], low])
            place.fill(*corners.T, color=BOUND.color, alpha=0.3, label="obstacle")
        for run in some:
            other = _same(runs, run, SAMPLED)
            if other is not None:
                place.plot(*other["rrt_path_m"][:, :2].T, label="RRT*", **line_style(IDEAL))
            place.plot(*run["path_m"][:, :2].T, label="proven", **line_style(DISTANCE))
            place.plot(
                *run["ends_m"][:, :2].T, "o", color="black", markerfacecolor="white",
                label="start, goal",
            )  # fmt: skip
        place.set(xlabel="x in W [m]", ylabel="y in W [m]", aspect="equal")
        place.set_title(f"{robot}, {scene}", fontsize=10)
        if not any(len(run["path_m"]) for run in some):
            place.text(
                0.5, 0.5, NO_PATH, transform=place.transAxes, ha="center", va="center", fontsize=9,
                bbox={"facecolor": "white", "edgecolor": "0.6", "alpha": 0.9},
            )  # fmt: skip
        few_ticks(place.xaxis, 3)  # paths may be much longer than wide
        few_ticks(place.yaxis)
    for place in places[len(scenes) :]:
        place.set_axis_off()
    found = dict(zip(*places[0].get_legend_handles_labels()[::-1], strict=True))
    figure.legend(found.values(), found.keys(), loc="outside lower center", ncols=4)
    return figure


STUDY = Study(
    name="proven-paths",
    title="Paths in proven sets beside RRT* and free motions, in problems with obstacles",
    cases=cases,
    measure=measure,
    checks=CHECKS,
    stated="Proven paths",
    tables=[problems_table, free_table],
    figures={"paths": paths_figure},
    parameters=parameters,
    unit="problems",
)

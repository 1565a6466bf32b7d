"""The study: its cases, tables, figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Form, Study
from cdpr_drake.analyses.studies.worked_examples.examples import (
    COMPARED,
    DURATION,
    END,
    GRID,
    LEAST,
    METHODS,
    POSES,
    PRINTED,
    QUICK_GRID,
    ROBOT,
    SHOWN,
    START,
    TRAJECTORY,
    cases,
    measure,
    motion,
)
from cdpr_drake.analyses.studies.worked_examples.statements import CHECKS
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.palette import PLATFORM, SOLID, nth_look


def methods_table(runs: Runs) -> Table:
    """Methods on the grid."""
    row = runs.one(example=METHODS)
    table = new_table(
        f"Methods at the poses of a grid that {ROBOT} can be held at",
        ("method",),
        ("poses", "solved", "with a negative tension", "processor time [us]"),
    )
    for name in COMPARED:
        table.add_row(
            name, str(row["poses"]), str(row["solved"][name]), str(row["pushing"][name]),
            f"{row['cost_us'][name]:.2f}",
        )  # fmt: skip
    return table


def trajectory_figure(runs: Runs) -> Figure:
    """Figures 6.2, 6.4, 6.6 of the Gazebo thesis beside 6.3, 6.5, 6.7."""
    found = runs.one(example=TRAJECTORY)
    figure, axes = new_figure(
        3, 2, (12.0, 11.0), "Trajectory of the Gazebo thesis by two programs, figures 6.2 to 6.7"
    )
    labels = (
        ("desired position [m]", 1.0),
        ("velocity [mm/s]", 1e3),
        ("acceleration [mm/s²]", 1e3),
    )
    programs = {"class": "trajectory class", "conditions": "second program"}
    for column, (program, words) in enumerate(programs.items()):
        parts = motion(found, program)
        for row, ((label, factor), values) in enumerate(zip(labels, parts, strict=True)):
            place = axes[row, column]
            for k, name in enumerate("xyz"):
                draw_curve(
                    place, found["times_s"], values[:, k], nth_look(k), name,
                    scale=factor, phase=phase_of(k, 3),
                )  # fmt: skip
            place.set_ylabel(label)
        axes[0, column].set_title(words)
        axes[2, column].set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def polygons_figure(runs: Runs) -> Figure:
    """Figure 1.19 of the servoing thesis: polygons at both poses, to the same scale."""
    polygons = {name: runs.one(example=name) for name in POSES}
    figure, panels = new_figure(
        1, 2, (13.0, 6.8), "ACROBOT's feasible tensions, as figure 1.19 of the servoing thesis"
    )
    widest = max(float(np.max(np.ptp(p["vertices_n"], axis=1))) for p in polygons.values())
    for axes, (name, place) in zip(panels, POSES.items(), strict=True):
        polygon, vertices = polygons[name], polygons[name]["vertices_n"]
        axes.fill(*vertices, color=PLATFORM.color, alpha=0.15)
        closed = np.column_stack([vertices, vertices[:, 0]])
        axes.plot(*closed, color=PLATFORM.color, linestyle=SOLID)
        for k, method in enumerate(SHOWN):
            look = nth_look(k)
            axes.plot(
                *polygon["etas_n"][method], look.marker, color=look.color, markersize=10,
                label=method.replace("_", " "),
            )  # fmt: skip
        middle = (vertices.min(axis=1) + vertices.max(axis=1)) / 2.0
        half = 0.56 * widest
        axes.set(
            xlim=(middle[0] - half, middle[0] + half),
            ylim=(middle[1] - half, middle[1] + half),
            xlabel=r"$\eta_1$ [N]", ylabel=r"$\eta_2$ [N]",
        )  # fmt: skip
        axes.set_aspect("equal")
        where = ", ".join(f"{x:g}" for x in place)
        axes.set_title(f"{name}: ({where}) m, {polygon['area_n2']:.1f} N²")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def parameters(form: Form) -> Mapping[str, Any]:
    """What the examples are; nothing is random."""
    return {
        "start_m": START.tolist(), "end_m": END.tolist(), "duration_s": DURATION, "robot": ROBOT,
        "poses_m": POSES, "printed_n": PRINTED, "least_tension_n": LEAST,
        "grid": QUICK_GRID if form.quick else GRID,
    }  # fmt: skip


STUDY = Study(
    name="worked-examples",
    title="What the theses show on an example: a trajectory, polygons of tensions, their cost",
    source="Gazebo thesis 6.2; servoing thesis 1.3.4",
    cases=cases,
    measure=measure,
    parameters=parameters,
    unit="examples",
    stated="What the theses state",
    checks=CHECKS,
    tables=[methods_table],
    figures={"trajectory": trajectory_figure, "feasible_polygons": polygons_figure},
)

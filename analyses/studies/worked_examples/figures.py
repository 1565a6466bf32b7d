"""Figures of the study, as the theses draw them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.worked_examples.motion import SampledMotion
from cdpr_drake.analyses.studies.worked_examples.statements import FoundExamples
from cdpr_drake.analyses.studies.worked_examples.tensions import POSES, SHOWN, ExamplePolygon
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.palette import PLATFORM, SOLID, nth_look

PROGRAMS = {"class": "trajectory class", "conditions": "second program"}
"""Columns of the figure of the trajectory."""

ROWS = (("desired position [m]", 1.0), ("velocity [mm/s]", 1e3), ("acceleration [mm/s²]", 1e3))


def example_drawings(found: FoundExamples) -> dict[str, Callable[[], Figure]]:
    """What draws `trajectory` and `feasible_polygons`, by name, as far as found."""
    drawn: dict[str, Callable[[], Figure]] = {}
    if found.motions:
        drawn["trajectory"] = partial(trajectory_figure, found.motions)
    if found.polygons:
        drawn["feasible_polygons"] = partial(polygons_figure, found.polygons)
    return drawn


def trajectory_figure(motions: Mapping[str, SampledMotion]) -> Figure:
    """Figures 6.2, 6.4, 6.6 of the Gazebo thesis beside 6.3, 6.5, 6.7."""
    figure, axes = new_figure(
        3, 2, (12.0, 11.0), "Trajectory of the Gazebo thesis by two programs, figures 6.2 to 6.7"
    )
    for column, (program, words) in enumerate(PROGRAMS.items()):
        motion = motions[program]
        for row, ((label, factor), values) in enumerate(zip(ROWS, motion.parts(), strict=True)):
            place = axes[row, column]
            for k, name in enumerate("xyz"):
                draw_curve(
                    place, motion.times, values[:, k], nth_look(k), name,
                    scale=factor, phase=phase_of(k, 3),
                )  # fmt: skip
            place.set_ylabel(label)
        axes[0, column].set_title(words)
        axes[2, column].set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def polygons_figure(polygons: Mapping[str, ExamplePolygon]) -> Figure:
    """Figure 1.19 of the servoing thesis: polygons at both poses, to the same scale."""
    figure, panels = new_figure(
        1, 2, (13.0, 6.8), "ACROBOT's feasible tensions, as figure 1.19 of the servoing thesis"
    )
    widest = max(float(np.max(np.ptp(p.vertices, axis=1))) for p in polygons.values())
    for axes, (name, place) in zip(panels, POSES.items(), strict=True):
        polygon = polygons[name]
        closed = np.column_stack([polygon.vertices, polygon.vertices[:, 0]])
        axes.fill(*polygon.vertices, color=PLATFORM.color, alpha=0.15)
        axes.plot(*closed, color=PLATFORM.color, linestyle=SOLID)
        for k, method in enumerate(SHOWN):
            look = nth_look(k)
            axes.plot(
                *polygon.etas[method], look.marker, color=look.color, markersize=10,
                label=method.replace("_", " "),
            )  # fmt: skip
        middle = (polygon.vertices.min(axis=1) + polygon.vertices.max(axis=1)) / 2.0
        half = 0.56 * widest
        axes.set(
            xlim=(middle[0] - half, middle[0] + half),
            ylim=(middle[1] - half, middle[1] + half),
            xlabel=r"$\eta_1$ [N]", ylabel=r"$\eta_2$ [N]",
        )  # fmt: skip
        axes.set_aspect("equal")
        where = ", ".join(f"{x:g}" for x in place)
        axes.set_title(f"{name}: ({where}) m, {polygon.area:.1f} N²")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure

"""Figures of the study: workspaces as solids in the frame, a panel each."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.stability_shapes.items import (
    BASELINE,
    NESTED,
    NESTED_FIGURE,
    PLANAR_FIGURE,
    Shape,
    shape_cases,
)
from cdpr_drake.analyses.visualization.figure_style import bare_figure, new_figure
from cdpr_drake.analyses.visualization.solids import draw_solid
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import DESIRED, IDEAL, PLATFORM, WORKSPACES, nth_look
from cdpr_drake.workspaces.volume import surface_quads

COLUMNS = 4
"""Panels side by side."""

LEAST_WIDTH = 8.6
"""Of a figure of solids, so that its legend fits [inch]."""


def figure_name(number: str) -> str:
    """Name of the file of a figure of the thesis."""
    return f"shapes_{number.replace('.', '_')}"


def shapes(runs: Runs, number: str) -> list[Shape]:
    """The workspaces of one of the thesis' figures."""
    return [Shape(run) for run in runs(figure=number)]


def solids_figure(runs: Runs, number: str) -> Figure:
    """The workspaces of one of the thesis' figures."""
    some = shapes(runs, number)
    first = some[0].run
    robot = load_robot(first["robot"])
    columns = min(COLUMNS, len(some))
    rows = -(-len(some) // columns)
    figure = bare_figure(
        (max(4.3 * columns, LEAST_WIDTH), 1.3 + 4.1 * rows),
        f"Control stability workspaces, {first['scheme']} on {first['robot']}, "
        f"as figure {number} of the servoing thesis",
    )
    handles: list[Line2D] = []
    for place, one in enumerate(some, start=1):
        axes = figure.add_subplot(rows, columns, place, projection="3d", computed_zorder=False)
        handles += draw_solid(
            axes, surface_quads(one.inside, one.axes), WORKSPACES["SZ"],
            (robot.frame.lower, robot.frame.upper), robot.cable_set().p_WA,
        )  # fmt: skip
        if (places := one.run["places_m"]) is not None:
            start, goal = places
            axes.plot(*places.T, color=IDEAL.color, linestyle=IDEAL.dash, zorder=5)
            handles += axes.plot(*start, "o", color=PLATFORM.color, zorder=6, label="start",
                                 markeredgecolor="white")  # fmt: skip
            handles += axes.plot(*goal, DESIRED.marker, color=DESIRED.color, markersize=9,
                                 markeredgecolor="white", zorder=6, label="goal")  # fmt: skip
        printed = one.printed and f", published {one.printed} %"
        axes.set_title(f"{one.name}\n{one.share:.1f} %{printed}", fontsize=10, y=1.0, pad=0)
    figure.legend(
        handles=list({one.get_label(): one for one in handles}.values()),
        loc="outside lower center", ncols=4, title_fontsize=9,
        title="by samples; solids are the cells between points of the grid with all corners inside",
    )  # fmt: skip
    return figure


def nested_figure(runs: Runs, number: str) -> Figure:
    """The planar robot's workspaces under one larger bound each, over the baseline."""
    found = {one.name: one for one in shapes(runs, number)}
    base = found.get(BASELINE)
    groups = {
        bound: [one for name, one in found.items() if name.partition("=")[0] == bound]
        for bound in (name.removesuffix("_deg") for name in NESTED)
    }
    groups = {bound: group for bound, group in groups.items() if group}
    rows = -(-max(len(groups), 1) // COLUMNS)
    figure, panels = new_figure(
        rows, COLUMNS, (4.0 * COLUMNS, 1.4 + 4.9 * rows),
        "Planar robot, PBVS: workspaces under one larger bound over that of the baseline, as "
        "figure 3.8 of the servoing thesis",
    )  # fmt: skip
    flat = list(np.ravel(panels))
    for axes, (letter, (bound, group)) in zip(
        flat, zip("abcdefgh", groups.items(), strict=False), strict=False
    ):
        shown = [*([base] if base is not None else []), *group]
        for k, one in enumerate(shown):
            points, look = one.points(), nth_look(k)
            printed = one.printed and f" ({one.printed})"
            axes.plot(
                points[:, 0], points[:, 1], linestyle="", marker="so^"[k],
                markersize=(6.5, 4.5, 3.0)[k], color=("#b9cfe4", *[look.color] * 2)[k],
                markerfacecolor=("#b9cfe4", "white", look.color)[k],
                label=f"{one.name}: {one.share:.1f}{printed} %",
            )  # fmt: skip
        x, y = shown[0].axes[:2]
        axes.set(
            xlim=(x[0] - 0.05, x[-1] + 0.05), ylim=(y[0] - 0.05, y[-1] + 0.05), aspect="equal",
            xlabel="x in W [m]", title=f"({letter}) {bound}",
        )  # fmt: skip
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=9,
                    title="share of the box (published)", title_fontsize=8)  # fmt: skip
    for axes in flat[: len(groups) : COLUMNS]:
        axes.set_ylabel("y in W [m]")
    for axes in flat[len(groups) :]:
        axes.remove()
    return figure


def planar_figure(runs: Runs, number: str) -> Figure:
    """The planar robot's workspaces, one beside the other."""
    some = shapes(runs, number)
    figure, panels = new_figure(
        1,
        len(some),
        (5.5 * len(some), 5.6),
        "Planar robot, PBVS, two combinations of figure 3.1, drawn as figure 3.10",
    )
    for k, (axes, one) in enumerate(zip(np.ravel(panels), some, strict=True)):
        points = one.points()
        look = nth_look(k)
        axes.plot(points[:, 0], points[:, 1], linestyle="", marker="s", markersize=5.0,
                  color=look.color)  # fmt: skip
        x, y = one.axes[:2]
        axes.set(
            xlim=(x[0] - 0.05, x[-1] + 0.05), ylim=(y[0] - 0.05, y[-1] + 0.05), aspect="equal",
            xlabel="x in W [m]", ylabel="y in W [m]",
            title=f"{one.name}: {one.share:.1f} %",
        )  # fmt: skip
    return figure


DRAWN = {PLANAR_FIGURE: planar_figure, NESTED_FIGURE: nested_figure}

FIGURES = {
    figure_name(number): partial(DRAWN.get(number, solids_figure), number=number)
    for number in dict.fromkeys(str(case.keys["figure"]) for case in shape_cases(Form(quick=True)))
}
"""What draws the figures, by name."""

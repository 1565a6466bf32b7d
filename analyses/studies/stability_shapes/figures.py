"""Figures of the study: workspaces as solids in the frame, a panel each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.studies.stability_shapes.items import (
    BASELINE,
    NESTED,
    NESTED_FIGURE,
    PLANAR_FIGURE,
    Shape,
    shape_items,
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


FIGURES = tuple(dict.fromkeys(figure_name(item.figure) for item in shape_items()))
"""Names of all figures that the study can write."""


def shape_drawings(shapes: Sequence[Shape]) -> dict[str, Callable[[], Figure]]:
    """What draws `shapes_3_13` and so on, by name, of what was finished."""
    drawn: dict[str, Callable[[], Figure]] = {}
    for number in dict.fromkeys(one.item.figure for one in shapes):
        some = [one for one in shapes if one.item.figure == number]
        draw = {PLANAR_FIGURE: planar_figure, NESTED_FIGURE: nested_figure}
        drawn[figure_name(number)] = partial(draw.get(number, solids_figure), some)
    return drawn


def solids_figure(some: Sequence[Shape]) -> Figure:
    """The workspaces of one of the thesis' figures."""
    item = some[0].item
    robot = load_robot(item.robot)
    columns = min(COLUMNS, len(some))
    rows = -(-len(some) // columns)
    figure = bare_figure(
        (max(4.3 * columns, LEAST_WIDTH), 1.3 + 4.1 * rows),
        f"Control stability workspaces, {item.scheme} on {item.robot}, "
        f"as figure {item.figure} of the servoing thesis",
    )
    handles: list[Line2D] = []
    for place, one in enumerate(some, start=1):
        axes = figure.add_subplot(rows, columns, place, projection="3d", computed_zorder=False)
        handles += draw_solid(
            axes, surface_quads(one.inside, one.grid.axes), WORKSPACES["SZ"],
            (robot.frame.lower, robot.frame.upper), robot.cable_set().p_WA,
        )  # fmt: skip
        if one.item.places is not None:
            start, goal = one.item.places
            axes.plot(*one.item.places.T, color=IDEAL.color, linestyle=IDEAL.dash, zorder=5)
            handles += axes.plot(*start, "o", color=PLATFORM.color, zorder=6, label="start",
                                 markeredgecolor="white")  # fmt: skip
            handles += axes.plot(*goal, DESIRED.marker, color=DESIRED.color, markersize=9,
                                 markeredgecolor="white", zorder=6, label="goal")  # fmt: skip
        printed = "" if one.item.printed is None else f", published {one.item.printed:g} %"
        axes.set_title(f"{one.item.name}\n{one.share:.1f} %{printed}", fontsize=10, y=1.0, pad=0)
    figure.legend(
        handles=list({one.get_label(): one for one in handles}.values()),
        loc="outside lower center", ncols=4, title_fontsize=9,
        title="by samples; solids are the cells between points of the grid with all corners inside",
    )  # fmt: skip
    return figure


def nested_figure(some: Sequence[Shape]) -> Figure:
    """The planar robot's workspaces under one larger bound each, over the baseline."""
    found = {one.item.name: one for one in some}
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
        for number, one in enumerate(shown):
            points, look = one.points(), nth_look(number)
            printed = "" if one.item.printed is None else f" ({one.item.printed:g})"
            axes.plot(
                points[:, 0], points[:, 1], linestyle="", marker="so^"[number],
                markersize=(6.5, 4.5, 3.0)[number], color=("#b9cfe4", *[look.color] * 2)[number],
                markerfacecolor=("#b9cfe4", "white", look.color)[number],
                label=f"{one.item.name}: {one.share:.1f}{printed} %",
            )  # fmt: skip
        x, y = shown[0].grid.axes[:2]
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


def planar_figure(some: Sequence[Shape]) -> Figure:
    """The planar robot's workspaces, one beside the other."""
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
        x, y = one.grid.axes[:2]
        axes.set(
            xlim=(x[0] - 0.05, x[-1] + 0.05), ylim=(y[0] - 0.05, y[-1] + 0.05), aspect="equal",
            xlabel="x in W [m]", ylabel="y in W [m]",
            title=f"{one.item.name}: {one.share:.1f} %",
        )  # fmt: skip
    return figure

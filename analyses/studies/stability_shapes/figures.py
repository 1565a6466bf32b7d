"""Figures of the study: workspaces as solids in the frame, a panel each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.pictures import (
    bare_figure,
    draw_solid,
    new_figure,
)
from cdpr_drake.analyses.studies.stability_shapes.items import PLANAR_FIGURE, Shape
from cdpr_drake.models import load_robot
from cdpr_drake.palette import WORKSPACES, nth_look
from cdpr_drake.workspaces import surface_quads

COLUMNS = 4
"""Panels side by side."""


def shape_drawings(shapes: Sequence[Shape]) -> dict[str, Callable[[], Figure]]:
    """What draws `shapes_3_13` and so on, by name, of what was finished."""
    drawn: dict[str, Callable[[], Figure]] = {}
    for number in dict.fromkeys(one.item.figure for one in shapes):
        some = [one for one in shapes if one.item.figure == number]
        draw = planar_figure if number == PLANAR_FIGURE else solids_figure
        drawn[f"shapes_{number.replace('.', '_')}"] = partial(draw, some)
    return drawn


def solids_figure(some: Sequence[Shape]) -> Figure:
    """The workspaces of one of the thesis' figures."""
    item = some[0].item
    robot = load_robot(item.robot)
    columns = min(COLUMNS, len(some))
    rows = -(-len(some) // columns)
    figure = bare_figure(
        (4.3 * columns, 1.3 + 4.1 * rows),
        f"Control stability workspaces, {item.scheme} on {item.robot}, "
        f"as figure {item.figure} of the servoing thesis",
    )
    handles: list[Line2D] = []
    for place, one in enumerate(some, start=1):
        axes = figure.add_subplot(rows, columns, place, projection="3d", computed_zorder=False)
        handles = draw_solid(
            axes, surface_quads(one.inside, one.grid.axes), WORKSPACES["SZ"],
            (robot.frame.lower, robot.frame.upper), robot.cable_set().p_WA,
        )  # fmt: skip
        printed = "" if one.item.printed is None else f", published {one.item.printed:g} %"
        axes.set_title(f"{one.item.name}\n{one.share:.1f} %{printed}", fontsize=10, y=1.0, pad=0)
    figure.legend(
        handles=handles, loc="outside lower center", ncols=2, title_fontsize=9,
        title="by samples; solids are the cells between points of the grid with all corners inside",
    )  # fmt: skip
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

"""Figures of exit points on rails: where they were and are, and margins of the poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.design.reconfiguration import Reconfiguration
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.analyses.visualization.figure_style import bare_figure, styled

PALE, DARK = "0.7", "0.15"


def rail_pictures(found: Reconfiguration, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws the figure, by the name of its files."""
    return dict(figure_writers({"rails": lambda: rails_figure(found)}, formats))


def rails_figure(found: Reconfiguration) -> Figure:
    """Rails, exit points before and after with cables to the first pose; margins of all poses."""
    rails, task = found.task.rails, found.task
    before = rails.exit_points(rails.at)
    after = rails.exit_points(found.solution.coordinates)
    ends = rails.exit_points(rails.lower), rails.exit_points(rails.upper)
    title = f"{found.before.name}: exit points on rails, before and after, and margins"
    title += f"\n{found.geometry}"
    figure = bare_figure((11.0, 6.0), title)
    with styled():
        # A column between them: labels of axes in space are outside what a layout counts.
        grid = figure.add_gridspec(1, 3, width_ratios=(1.2, 0.08, 1.0))
        space = figure.add_subplot(grid[0], projection="3d")
        for k in range(before.shape[1]):
            label = "rail" if k == 0 else None
            one = np.array([ends[0][:, k], ends[1][:, k]]).T
            if np.any(one[:, 0] != one[:, 1]):
                space.plot(*one, color=PALE, linewidth=4.0, label=label)
        space.plot(*before, "o", color=DARK, markerfacecolor="none", label="exit point before")
        space.plot(*after, "o", color=DARK, label="exit point after")
        X = task.poses[0]
        p_WB = X.translation()[:, None] + X.rotation().matrix() @ task.case.cables.p_PB
        for k in range(before.shape[1]):
            label = "cable at pose 1" if k == 0 else None
            space.plot(*np.array([after[:, k], p_WB[:, k]]).T, "-", linewidth=0.8, color=DARK,
                       label=label)  # fmt: skip
        places = np.array([Y.translation() for Y in task.poses]).T
        space.plot(*places, "x", color=DARK, label="Po at the poses")
        space.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
        space.set_aspect("equal")
        space.legend(loc="upper left", bbox_to_anchor=(-0.2, 1.05), ncols=1, fontsize="small")
        bars = figure.add_subplot(grid[2])
        number = np.arange(1, len(task.poses) + 1)
        for shift, values, colour, hatch, label in (
            (-0.2, found.margins[0], "white", "//", "before"),
            (0.2, found.margins[1], DARK, "", "after"),
        ):
            bars.bar(
                number + shift, values, 0.4, color=colour, edgecolor=DARK, hatch=hatch, label=label
            )
        bars.plot(
            number + 0.2, found.over_pulleys, "D", color="white", markeredgecolor=DARK,
            markersize=5.0, linestyle="none", label="after, over pulleys",
        )  # fmt: skip
        bars.axhline(0.0, color=DARK, linewidth=0.8)
        bars.set(
            xlabel="pose", ylabel="margin under the worst wrench,\nshare of half the range [-]"
        )
        bars.set_xticks(number)
        bars.legend(loc="best")
    return figure

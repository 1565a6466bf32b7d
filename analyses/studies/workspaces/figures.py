"""Figures of the study: static workspaces in the frame, shares of kinds and of their pairs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.workspaces.items import (
    ALL,
    ALL_BUT_CLOSURE,
    EVERY,
    FIGURE,
    static,
)
from cdpr_drake.analyses.visualization.figure_style import bar_style, bare_figure, new_figure
from cdpr_drake.analyses.visualization.solids import draw_solid
from cdpr_drake.analyses.workspaces.conditions import OF_POSES
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import WORKSPACES, look_of
from cdpr_drake.workspaces.volume import surface_quads

PUBLISHED_FIGURES = {
    "static_acrobot": ("1.17", ("acrobot_small", "acrobot_large")),
    "static_caroca": ("1.18", ("caroca",)),
}
"""Files, the thesis' numbers of the figures, and the robots in their rows."""

DARK = 55.0
"""Numbers on cells of a larger share are white [%]."""


def static_figure(runs: Runs, number: str, robots: tuple[str, ...]) -> Figure:
    """Static workspaces as solids in the frame, a row for each robot.

    Args:
        runs: Of the study.
        number: Number of the thesis' figure.
        robots: Which, with the limit of their files.
    """
    some = runs(group=FIGURE, upper_share=1.0, robot=robots)
    columns = max(some.counts("robot").values())
    figure = bare_figure(
        (5.2 * columns, 0.9 + 4.9 * len(robots)),
        f"Static feasible workspace, as figure {number} of the servoing thesis",
    )
    handles: list[Line2D] = []
    for row, name in enumerate(robots):
        robot = load_robot(name)
        mine = sorted(some(robot=name), key=lambda run: float(run["lower_limit_n"]))
        for column, run in enumerate(mine):
            place = 1 + row * columns + column
            axes = figure.add_subplot(
                len(robots), columns, place, projection="3d", computed_zorder=False
            )
            handles = draw_solid(
                axes,
                surface_quads(static(run), (run["x_m"], run["y_m"], run["z_m"])),
                WORKSPACES["SZ"],
                (robot.frame.lower, robot.frame.upper),
                robot.cable_set().p_WA,
            )
            axes.set_title(
                f"{name}, {run['lower_limit_n']:g} to {run['upper_limit_n']:g} N\n"
                f"{run['volume_m3']:.3g} m³, {100.0 * run['frame_share']:.1f} % of the frame",
                fontsize=11, y=1.0, pad=0,
            )  # fmt: skip
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=2,
        title="The thesis does not print the upper limit: the robot file's. Platform unturned;\n"
        "solids are the cells between points of the grid with all eight corners inside.",
        title_fontsize=10,
    )
    return figure


def kinds_figure(runs: Runs) -> Figure:
    """Share of the frame's poses where each kind holds, a bar for each robot."""
    kinds = runs(group=EVERY)
    names = [*OF_POSES, ALL_BUT_CLOSURE, ALL]
    robots = kinds.list("robot")
    figure, axes = new_figure(1, 1, (10.0, 9.5), "Where each kind holds, of the poses in the frame")
    size = 0.85 / len(kinds)
    for number, one in enumerate(kinds):
        shares = one["pose_shares"]
        asked = [k for k, name in enumerate(names) if name in shares]
        places = [k + size * (number - (len(kinds) - 1) / 2.0) for k in asked]
        axes.barh(
            places, [100.0 * shares[names[k]] for k in asked], 0.9 * size,
            label=one["robot"], **bar_style(look_of(one["robot"], robots)),
        )  # fmt: skip
        for k, name in enumerate(names):
            if name not in shares:
                place = k + size * (number - (len(kinds) - 1) / 2.0)
                axes.text(0.5, place, "not possible", va="center", fontsize=7)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("share of the poses [%]")
    axes.grid(visible=False, axis="y")
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def pairs_figure(runs: Runs) -> Figure:
    """Share of the frame's poses where two kinds hold, a matrix for each robot."""
    kinds = runs(group=EVERY)
    columns = min(3, len(kinds))
    rows = -(-len(kinds) // columns)
    figure, grid = new_figure(
        rows, columns, (1.8 + 4.9 * columns, 1.9 + 4.4 * rows),
        "Where two kinds hold together, of the poses in the frame [%]; one kind on the diagonal, "
        "nothing where a kind is not possible",
    )  # fmt: skip
    panels = list(np.ravel(grid))
    image = None
    for number, (axes, one) in enumerate(zip(panels, kinds, strict=False)):
        names, together = list(OF_POSES), one["pose_shares_of_pairs"]
        shares = np.full((len(names), len(names)), np.nan)
        for a, first in enumerate(names):
            for b, second in enumerate(names[: a + 1]):
                if first in together and second in together:
                    shares[a, b] = 100.0 * together[first][second]
        # Panels of a given aspect shrink after the layout, and names on the left were cut off.
        image = axes.imshow(shares, cmap="Greens", vmin=0.0, vmax=100.0, aspect="auto")
        for (a, b), share in np.ndenumerate(shares):
            if np.isfinite(share):
                color = "white" if share > DARK else "black"
                axes.text(b, a, f"{share:.0f}", ha="center", va="center", fontsize=8, color=color)
        axes.grid(visible=False)
        lowest = number + columns >= len(kinds)
        axes.set_xticks(range(len(names)), names if lowest else [], rotation=90, fontsize=9)
        axes.set_yticks(range(len(names)), names if number % columns == 0 else [], fontsize=9)
        most = 100.0 * one["pose_shares"][ALL_BUT_CLOSURE]
        axes.set_title(f"{one['robot']}\n{ALL_BUT_CLOSURE}: {most:.1f} %", fontsize=11)
    for axes in panels[len(kinds) :]:
        axes.remove()
    if image is not None:
        figure.colorbar(image, ax=panels[: len(kinds)], label="share of the poses [%]")
    return figure


FIGURES: dict[str, Callable[[Runs], Figure]] = {
    **{
        name: partial(static_figure, number=number, robots=robots)
        for name, (number, robots) in PUBLISHED_FIGURES.items()
    },
    "kinds": kinds_figure,
    "pairs": pairs_figure,
}
"""What draws the figures, by name."""

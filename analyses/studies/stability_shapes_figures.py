"""Figures of control stability workspaces: solids in the frame, and planar ones, a panel each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.analyses.visualization.figure_style import bare_figure, new_figure
from cdpr_drake.analyses.visualization.solids import draw_solid
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import DESIRED, IDEAL, PLATFORM, WORKSPACES, nth_look
from cdpr_drake.workspaces.volume import surface_quads

BASELINE = "baseline"
"""Panel of a workspace under the baseline bounds."""

NESTED: dict[str, tuple[float, ...]] = {
    "r_bp": (0.05, 0.1), "r_A": (0.03, 0.06), "r_B": (0.03, 0.06), "r_pc": (0.2,),
    "d_theta_bp_deg": (20.0, 30.0), "d_theta_pc_deg": (30.0, 50.0), "r_s": (0.5,),
}  # fmt: skip
"""Planar robot: rows of table A.8 that are drawn over the baseline, a panel for each bound. Which
ones figure 3.8 shows the text says of r_bp=0.1 and r_pc=0.2 alone."""

COLUMNS = 4
"""Panels side by side."""

LEAST_WIDTH = 8.6
"""Of a figure of solids, so that its legend fits [inch]."""

Row = Mapping[str, Any]


def panels_of(rows: Frame, number: str) -> list[dict[str, Any]]:
    """The workspaces of one of the thesis' figures."""
    return rows[rows["figure"] == number].to_dict("records")


def axes_of(row: Row) -> tuple[Any, Any, Any]:
    """Coordinates of the grid along x, y and z, shape (n,) each [m]."""
    return row["arrays"]["x_m"], row["arrays"]["y_m"], row["arrays"]["z_m"]


def published(row: Row, words: str) -> str:
    """A printed share in words, if there is one."""
    return "" if np.isnan(row["printed_percent"]) else words.format(row["printed_percent"])


def solids_figure(rows: Frame, number: str) -> Figure:
    """The workspaces of one of the thesis' figures."""
    panels = panels_of(rows, number)
    robot = load_robot(panels[0]["robot"])
    columns = min(COLUMNS, len(panels))
    lines = -(-len(panels) // columns)
    figure = bare_figure(
        (max(4.3 * columns, LEAST_WIDTH), 1.3 + 4.1 * lines),
        f"Control stability workspaces, {panels[0]['scheme']} on {panels[0]['robot']}, "
        f"as figure {number} of the servoing thesis",
    )
    handles: list[Line2D] = []
    for place, row in enumerate(panels, start=1):
        axes = figure.add_subplot(lines, columns, place, projection="3d", computed_zorder=False)
        handles += draw_solid(
            axes, surface_quads(row["arrays"]["inside"], axes_of(row)), WORKSPACES["SZ"],
            (robot.frame.lower, robot.frame.upper), robot.cable_set().p_WA,
        )  # fmt: skip
        if row["places_m"] is not None:
            start, goal = row["places_m"]
            axes.plot(
                *np.transpose([start, goal]), color=IDEAL.color, linestyle=IDEAL.dash, zorder=5
            )
            handles += axes.plot(*start, "o", color=PLATFORM.color, zorder=6, label="start",
                                 markeredgecolor="white")  # fmt: skip
            handles += axes.plot(*goal, DESIRED.marker, color=DESIRED.color, markersize=9,
                                 markeredgecolor="white", zorder=6, label="goal")  # fmt: skip
        words = f"{row['share_percent']:.1f} %{published(row, ', published {:g} %')}"
        axes.set_title(f"{row['panel']}\n{words}", fontsize=10, y=1.0, pad=0)
    figure.legend(
        handles=list({one.get_label(): one for one in handles}.values()),
        loc="outside lower center", ncols=4, title_fontsize=9,
        title="by samples; solids are the cells between points of the grid with all corners inside",
    )  # fmt: skip
    return figure


def nested_figure(rows: Frame) -> Figure:
    """The planar robot's workspaces under one larger bound each, over the baseline."""
    panels = panels_of(rows, "3.8")
    base = [row for row in panels if row["panel"] == BASELINE]
    groups = {
        bound: [row for row in panels if row["panel"].partition("=")[0] == bound]
        for bound in (name.removesuffix("_deg") for name in NESTED)
    }
    groups = {bound: group for bound, group in groups.items() if group}
    lines = -(-max(len(groups), 1) // COLUMNS)
    figure, grid = new_figure(
        lines, COLUMNS, (4.0 * COLUMNS, 1.4 + 4.9 * lines),
        "Planar robot, PBVS: workspaces under one larger bound over that of the baseline, as "
        "figure 3.8 of the servoing thesis",
    )  # fmt: skip
    flat = list(np.ravel(grid))
    for letter, axes, (bound, group) in zip("abcdefgh", flat, groups.items(), strict=False):
        for k, row in enumerate([*base, *group]):
            look = nth_look(k)
            words = f"{row['panel']}: {row['share_percent']:.1f}{published(row, ' ({:g})')} %"
            draw_plane(
                axes, row, marker="so^"[k], markersize=(6.5, 4.5, 3.0)[k], label=words,
                color=("#b9cfe4", look.color, look.color)[k],
                markerfacecolor=("#b9cfe4", "white", look.color)[k],
            )  # fmt: skip
        axes.set_title(f"({letter}) {bound}")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=9,
                    title="share of the box (published)", title_fontsize=8)  # fmt: skip
    for axes in flat[: len(groups) : COLUMNS]:
        axes.set_ylabel("y in W [m]")
    for axes in flat[len(groups) :]:
        axes.remove()
    return figure


def planar_figure(rows: Frame) -> Figure:
    """The planar robot's workspaces under combinations of errors, one beside the other."""
    panels = panels_of(rows, "3.10")
    figure, grid = new_figure(
        1, len(panels), (5.5 * len(panels), 5.6),
        "Planar robot, PBVS, two combinations of figure 3.1, drawn as figure 3.10",
    )  # fmt: skip
    for k, (axes, row) in enumerate(zip(np.ravel(grid), panels, strict=True)):
        draw_plane(axes, row, marker="s", markersize=5.0, color=nth_look(k).color)
        axes.set(ylabel="y in W [m]", title=f"{row['panel']}: {row['share_percent']:.1f} %")
    return figure


def draw_plane(axes: Any, row: Row, **style: Any) -> None:
    """Positions inside a planar workspace, on axes of its grid."""
    x, y, _ = axes_of(row)
    i, j, _ = np.nonzero(row["arrays"]["inside"])
    axes.plot(x[i], y[j], linestyle="", **style)
    axes.set(
        xlim=(x[0] - 0.05, x[-1] + 0.05), ylim=(y[0] - 0.05, y[-1] + 0.05), aspect="equal",
        xlabel="x in W [m]",
    )  # fmt: skip

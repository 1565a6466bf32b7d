"""Figures 5.11 to 5.18 of the servoing thesis, as case IX draws them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.sparse.csgraph import connected_components

from cdpr_drake.analyses.frame.figures import bar_style, new_figure
from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.servo_figures import (
    IMAGE,
    IMAGE_AWAY,
    Panel,
    cable_layout,
    draw_stable,
    draw_taut,
    ends_layout,
    layout,
)
from cdpr_drake.analyses.studies.slack import (
    CORRECTED,
    PLAIN,
    SLACKS_CM,
    TENSIONS,
    THRESHOLD,
    holding_problem,
    mean_tensions,
)
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.arrays import Array
from cdpr_drake.palette import PLATFORM, PUBLISHED, SOLID, nth_look
from cdpr_drake.tensions.methods import distribute, feasible_polygon, solution_space

ALL = tuple(f"E{k}" for k in range(1, 11))

SHOWN = ("E1", "E2", "E5", "E6", "E9", "E10")
"""Of which the thesis shows curves by cable, section 5.3.1."""

NEAR = 1.0
"""Names of points within this distance of each other would meet [N]."""

RESIDUALS = {
    "E1": 1.21, "E2": 0.68, "E3": 0.99, "E4": 0.88, "E5": 1.54, "E6": 0.96, "E7": 1.09,
    "E8": 1.63, "E9": 1.06, "E10": 1.02,
}  # fmt: skip
"""Table 5.1 [N]."""


def polygon_figure(rows: Frame, labels: Mapping[str, str]) -> Figure:
    """Figure 5.14: the feasible polygon where E2 ends, tensions of each experiment in its plane."""
    second = rows[rows["configuration"] == "E2"]
    if not len(second):
        raise MissingRuns("E2")
    problem = holding_problem(second.iloc[0]["arrays"]["X_WP"][-1])
    particular, N = solution_space(problem)
    vertices = feasible_polygon(problem)
    title = "Tensions at the end in their feasible polygon, as figure 5.14"
    figure, axes = new_figure(1, 1, (11.0, 7.5), title)
    if vertices.shape[1]:
        closed = np.column_stack([vertices, vertices[:, 0]])
        axes.fill(*vertices, color=PLATFORM.color, alpha=0.15)
        words = f"all above {THRESHOLD:g} N"
        axes.plot(*closed, color=PLATFORM.color, linestyle=SOLID, label=words)
        middle = N.T @ (distribute(problem, "barycenter").tensions - particular)
        axes.plot(*middle, "+", color=PLATFORM.color, markersize=16, label="barycenter")
    for number, name in enumerate(name for name in ALL if name in set(rows["configuration"])):
        look = nth_look(number)
        axes.plot(
            *(N.T @ (mean_tensions(rows, name) - particular)), look.marker, color=look.color,
            markersize=9, label=name, fillstyle="full" if name in CORRECTED else "none",
            linestyle="",
        )  # fmt: skip
    etas = (np.array(list(TENSIONS.values())) - particular) @ N
    axes.plot(
        *etas.T, PUBLISHED.marker, color=PUBLISHED.color, markersize=9, linestyle="",
        label="table 5.1",
    )  # fmt: skip
    name_points(axes, etas, ALL)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(
        xlabel=r"$\eta_1$ [N]", ylabel=r"$\eta_2$ [N]",
        title="full: with correction; means over the runs; at the pose at which E2 ends",
    )  # fmt: skip
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def name_points(axes: Axes, points: Array, names: Sequence[str]) -> None:
    """Writes names beside points, shape (n, 2), of which some are near each other.

    Two near each other have their names on both sides, more than two in one line above them.
    """
    for members in clusters(points):
        some = points[members]
        if len(members) > 2:
            words = ", ".join(names[k] for k in members)
            above = some.mean(axis=0)[0], some.max(axis=0)[1]
            axes.annotate(
                words, above, (0, 7), textcoords="offset points", ha="center", fontsize=8
            )  # fmt: skip
            continue
        for k in members:
            right = bool(points[k, 0] >= np.max(some[:, 0]))
            upper = bool(points[k, 1] >= np.max(some[:, 1]))
            axes.annotate(
                names[k], points[k], (6 if right else -6, 2 if upper else -2),
                textcoords="offset points", ha="left" if right else "right",
                va="bottom" if upper else "top", fontsize=8,
            )  # fmt: skip


def clusters(points: Array) -> list[list[int]]:
    """Numbers of points that are near each other, or near one that is, in ascending order."""
    near = np.linalg.norm(points[:, np.newaxis] - points, axis=2) < NEAR
    count, labels = connected_components(near, directed=False)
    return [np.flatnonzero(labels == number).tolist() for number in range(count)]


def residual_figure(rows: Frame, labels: Mapping[str, str]) -> Figure:
    """Figure 5.15: residuals, and what the sensors' accuracy can make of them."""
    names = [name for name in ALL if name in set(rows["configuration"])]
    if not names:
        raise MissingRuns("E1 to E10")
    title = "Part of the tensions that balances no weight; readings ±0.3 N"
    figure, axes = new_figure(1, 1, (10.0, 6.0), title)
    for place, name in enumerate(names):
        numbers = Frame(list(rows[rows["configuration"] == name]["polygon"])).mean()
        residual, least, most = numbers[["residual_n", "residual_least_n", "residual_most_n"]]
        first = place == 0
        axes.bar(
            place, most - least, 0.6, bottom=least, **bar_style(nth_look(0)),
            label="lowest to highest" if first else None,
        )  # fmt: skip
        axes.plot([place - 0.3, place + 0.3], [residual, residual], color=nth_look(1).color,
                  linewidth=2.5, linestyle=SOLID,
                  label="as measured" if first else None)  # fmt: skip
        axes.plot(place, RESIDUALS[name], PUBLISHED.marker, color=PUBLISHED.color,
                  markersize=10, linestyle="", label="table 5.1" if first else None)  # fmt: skip
    axes.set_xticks(range(len(names)), names)
    axes.set(ylabel="residual [N]", ylim=(0.0, None))
    axes.grid(visible=False, axis="x")
    axes.legend(loc="best")
    return figure


FIGURES = {
    "figure_5_11": partial(cable_layout, "Figure 5.11: cable lengths", "cable_lengths", SHOWN),
    "figure_5_12": partial(cable_layout, "Figure 5.12: cable velocities", "velocities", SHOWN),
    "figure_5_13": partial(cable_layout, "Figure 5.13: cable tensions", "cable_tensions", SHOWN),
    "figure_5_16": layout(
        "Figure 5.16: path of the tag's centre in the image",
        [
            [
                Panel(IMAGE, ALL, "path", "a"),
                Panel(IMAGE_AWAY, ALL, "distance from the straight line", "b"),
            ]
        ],
    ),
    "figure_5_17": ends_layout("5.17", ALL),
    "figure_5_18": layout(
        "Figure 5.18: cables in tension, and whether the criterion of stability holds",
        [
            [
                Panel(draw_taut, pair, f"{slack} cm of slack", letter),
                Panel(draw_stable, pair, f"{slack} cm of slack", letter),
            ]
            for slack, letter, pair in zip(
                SLACKS_CM, "abcde", zip(PLAIN, CORRECTED, strict=True), strict=True
            )
        ],
        height=0.55,
    ),
    "polygon": polygon_figure,
    "residuals": residual_figure,
}

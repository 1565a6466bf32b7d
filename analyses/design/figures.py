"""Figures of a search: how the score rose, what goals cost each other, where points went."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.analyses.design.search import DesignSearch
from cdpr_drake.analyses.visualization.figure_style import few_ticks, line_style, new_figure
from cdpr_drake.models.robot_loader import parse_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import IDEAL, PLATFORM, nth_look


def design_figures(robot: str, search: DesignSearch) -> dict[str, Figure]:
    """The figures by name; `pareto` where there are several goals."""
    return {name: draw() for name, draw in design_drawings(robot, search).items()}


def design_drawings(robot: str, search: DesignSearch) -> dict[str, Callable[[], Figure]]:
    """What draws the figures of `design_figures`, by name."""
    drawn: dict[str, Callable[[], Figure]] = {"progress": partial(_progress, robot, search)}
    if len(search.names) > 1:
        drawn["pareto"] = partial(_pareto, robot, search)
    if search.best is not None:
        drawn["points"] = partial(_points, robot, search)
    return drawn


def _progress(robot: str, search: DesignSearch) -> Figure:
    figure, axes = new_figure(1, 1, (7.5, 5.0), f"{robot}: search")
    _draw_progress(axes, search)
    return figure


def _pareto(robot: str, search: DesignSearch) -> Figure:
    names = search.names
    pairs = list(pairwise(names))
    size = (6.5 * len(pairs), 5.5)
    figure, axes = new_figure(1, len(pairs), size, f"{robot}: what goals cost each other")
    for one, (x, y) in zip(np.atleast_1d(axes), pairs, strict=True):
        _draw_front(one, search, names.index(x), names.index(y))
    return figure


def _points(robot: str, search: DesignSearch) -> Figure:
    figure, axes = new_figure(1, 2, (12.0, 5.5), f"{robot}: points moved")
    _draw_points(axes, search)
    return figure


def _draw_progress(axes: Any, search: DesignSearch) -> None:
    for number in range(len(search.candidates.kept)):
        chosen = search.scores[search.sets == number]
        if not len(chosen):
            continue
        look = nth_look(number)
        words = f"{len(search.candidates.kept[number])} cables"
        index = np.arange(1, len(chosen) + 1)
        axes.plot(index, chosen, ".", color=look.color, markersize=3, alpha=0.5)
        best = np.fmax.accumulate(chosen)
        axes.step(
            index, best, where="post", color=look.color, linestyle=look.dash, label=f"best, {words}"
        )
    weights = np.array([goal.weight for goal in search.settings.goals])
    kept = np.where(np.isfinite(search.original), np.sign(search.original), 0.0) @ weights
    axes.axhline(kept, **line_style(IDEAL), label="robot as it is")
    axes.set(xlabel="designs judged", ylabel="score (robot as it is: 1 for each weight)")
    axes.legend(loc="lower right")


def _draw_front(axes: Any, search: DesignSearch, x: int, y: int) -> None:
    sign = np.array([-1.0 if GOALS[name].smaller else 1.0 for name in search.names])
    shown = search.values * sign
    axes.plot(shown[:, x], shown[:, y], ".", color="#a0a0a0", markersize=3, label="designs")
    front = search.front[np.argsort(shown[search.front, x])]
    look = nth_look(1)
    axes.plot(
        shown[front, x], shown[front, y], linestyle=look.dash, marker=look.marker,
        color=look.color, markersize=6, label="no other is better in everything",
    )  # fmt: skip
    original = search.original * sign
    axes.plot(
        original[x], original[y], "*", color="black", markersize=14, label="robot as it is",
    )  # fmt: skip
    if search.best is not None:
        best = shown[search.best]
        axes.plot(
            best[x], best[y], "D", markerfacecolor="none", markeredgecolor=PLATFORM.color,
            markeredgewidth=2, markersize=11, label="best score",
        )  # fmt: skip
    for axis, k in ((axes.set_xlabel, x), (axes.set_ylabel, y)):
        name = search.names[k]
        unit = "" if GOALS[name].unit == "-" else f" [{GOALS[name].unit}]"
        axis(f"{name}{unit}" + (", less is better" if GOALS[name].smaller else ""))
    axes.legend(loc="best")


def _draw_points(axes: Any, search: DesignSearch) -> None:
    assert search.best is not None
    all_cables = search.candidates
    before = original_robot(search)
    after = all_cables.robot(search.sets[search.best], search.coordinates[search.best])
    kept = list(all_cables.kept[search.sets[search.best]])
    old_set, new_set = before.cable_set(), after.cable_set()
    for one, title, frame, old, new in (
        (axes[0], "exit points, from above", "W", old_set.p_WA, new_set.p_WA),
        (axes[1], "anchor points, from above", "P", old_set.p_PB, new_set.p_PB),
    ):
        one.plot(old[0], old[1], "o", markerfacecolor="none", color="black", label="robot as it is")
        one.plot(new[0], new[1], "s", color=nth_look(0).color, markersize=5, label="best design")
        for k, i in enumerate(kept):
            one.plot([old[0, i], new[0, k]], [old[1, i], new[1, k]], "-", color="#707070", lw=1)
        places: dict[tuple[float, ...], list[str]] = {}
        for i in kept:
            places.setdefault(tuple(old[:2, i].tolist()), []).append(before.cables[i].name)
        for place, cables in places.items():
            inward = (-12 if place[0] > 0.0 else 8, -14 if place[1] > 0.0 else 8)
            one.annotate(", ".join(cables), place, xytext=inward, textcoords="offset points",
                         ha="right" if place[0] > 0.0 else "left")  # fmt: skip
        few_ticks(one.xaxis)
        one.set(
            xlabel=f"x in {frame} [m]", ylabel=f"y in {frame} [m]", title=title, aspect="equal"
        )  # fmt: skip
        one.legend(loc="center")


def original_robot(search: DesignSearch) -> Robot:
    """The robot as it was."""
    return parse_robot(search.candidates.text, Path("robot"))

"""Figures of workspaces: planes by what holds or by a measure, breaks, boxes, wrench sets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.frame.figures import panels
from cdpr_drake.analyses.workspaces.conditions import ALL, BEST, MEASURES, RULES, SURVIVES, WORST
from cdpr_drake.analyses.workspaces.plane_panels import (
    draw_planes,
    draw_regions,
    plane_axes,
)
from cdpr_drake.arrays import Array
from cdpr_drake.workspaces.available_wrenches import AvailableWrenches

if TYPE_CHECKING:
    from cdpr_drake.analyses.workspaces.workspace_result import Workspace

OUTSIDE, SOME, INSIDE = "#e8e8e8", "#f0c27b", "#3f8f5f"
"""Of cells where no kind holds, where some do, and where all do."""

MOST_PLANES = 12

LINE = 60
"""Characters in a line of a title."""

CONTOURS = 6
"""Contour lines of a measure, about."""

LEAST_CONTOURED = 5
"""Lines of equal measure are drawn over so many points in both directions; over fewer they are
straight, and their numbers meet."""

MARKERS = ("s", "o", "^", "D", "v")
"""Symbols of reactions, in the order in which they were asked for."""

BREAK_PLANES, BREAK_COLUMNS = 6, 3

KEPT, LOST, UNHELD = "#ffffff", "#c8c8c8", "#8a8a8a"
"""Of cells where every break is survived, where one is not, and that all cables do not hold."""

LOOKS = {
    KEPT: (None, "every break is survived"),
    LOST: ("///", "one is not"),
    UNHELD: (None, "not held by all cables"),
}
"""Hatching and label by colour."""


def planes_figure(workspace: Workspace, measure: str | None = None) -> Figure:
    """Planes of a grid, coloured by what holds, or by a measure where all kinds hold.

    With several orientations a measure is its least over them.

    Args:
        workspace: The result; with its robot, frame and exit points are drawn.
        measure: Name of a measure of the result; None: what holds.
    """
    return _kinds_figure(workspace) if measure is None else _measure_figure(workspace, measure)


def _kinds_figure(workspace: Workspace) -> Figure:
    each = [workspace.places(kind) for kind in workspace.holds]
    parts = np.where(workspace.places(ALL), 2.0, np.where(np.any(each, axis=0), 1.0, 0.0))
    several = "some of the kinds" if len(workspace.holds) > 1 else None
    colors = {OUTSIDE: "outside", SOME: several, INSIDE: "inside"}
    return draw_regions(
        workspace.grid, _title(workspace, None), parts, colors, workspace.robot, most=MOST_PLANES
    )


def _measure_figure(workspace: Workspace, measure: str) -> Figure:
    inside = workspace.inside()
    # With no pose inside there is nothing else to see; the title says so.
    counted = (inside if inside.any() else True) & np.isfinite(workspace.values[measure])
    values = np.min(np.where(counted, workspace.values[measure], np.inf), axis=0)
    values = np.where(np.isfinite(values), values, np.nan)
    finite = values[np.isfinite(values)]
    limits = (float(np.min(finite)), float(np.max(finite))) if len(finite) else (0.0, 1.0)
    # A plane without a number would be an empty panel.
    colors = colormaps["viridis"].with_extremes(bad=OUTSIDE)
    points = [workspace.grid.axes[k] for k in plane_axes(workspace.grid.shape[1:])[1:]]
    meshes = []

    def paint(axes: Axes, edges: list[Array], plane: Callable[[Array], Array]) -> None:
        cells = plane(values)
        meshes.append(axes.pcolormesh(*edges, cells, cmap=colors, vmin=limits[0], vmax=limits[1]))
        if min(cells.shape) >= LEAST_CONTOURED and np.ptp(limits) > 0.0:
            _contours(axes, points, cells, limits)

    drawn = draw_planes(
        workspace.grid, _title(workspace, measure), paint, workspace.robot, most=MOST_PLANES
    )
    about = MEASURES[measure]
    drawn.figure.colorbar(meshes[-1], ax=drawn.axes, label=f"{about.title} [{about.unit}]")
    handles: list[Artist] = [*drawn.handles]
    if np.any(np.isnan(np.take(values, drawn.chosen, drawn.normal))):
        words = "outside" if inside.any() else "no number"
        handles.insert(0, Patch(facecolor=OUTSIDE, label=words))
    if handles:
        drawn.figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return drawn.figure


def breaks_figure(workspace: Workspace) -> Figure:
    """Planes of a grid: a cell a pose, with its worst cable and the best reaction to that break.

    Of several orientations the first one is drawn, and the title says so. It can be read without
    colours: hatching, numbers and symbols say all of it.
    """
    about, turns = workspace.arguments["breaks"], len(workspace.grid.angles)
    arrays = [workspace.holds[SURVIVES], workspace.values[WORST], workspace.values[BEST]]
    cell = 72.0 * 3.6 / max(workspace.grid.shape[1:])  # side of a cell [pt], about

    def paint(axes: Axes, edges: list[Array], plane: Callable[[Array], Array]) -> None:
        for j, i in np.ndindex(len(edges[1]) - 1, len(edges[0]) - 1):
            sides = edges[0][i : i + 2], edges[1][j : j + 2]
            numbers = [float(plane(array[0])[j, i]) for array in arrays]
            _draw_break(axes, sides, numbers, cell)
        axes.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])

    speed = float(np.linalg.norm(about["moving_m_s"]))
    title = (
        f"{workspace.arguments['robot']}, {workspace.geometry}: any one cable breaks "
        + ("at rest" if speed == 0.0 else f"at {speed:.3g} m/s")
        + (f", first of {turns} orientations" if turns > 1 else "")
        + f"\nsurvived at {np.mean(workspace.holds[SURVIVES]):.0%} of the poses"
    )
    drawn = draw_planes(
        workspace.grid, title, paint, most=BREAK_PLANES, columns=BREAK_COLUMNS, width=3.6
    )
    handles: list[Patch | Line2D] = [
        Patch(facecolor=color, edgecolor="black", hatch=hatch, label=label)
        for color, (hatch, label) in LOOKS.items()
    ]
    handles += [
        Line2D([], [], color="black", marker=marker, linestyle="none", markerfacecolor="white",
               label=f"best: {name}")
        for name, marker in zip(about["reactions"], MARKERS, strict=False)
    ]  # fmt: skip
    drawn.figure.legend(
        handles=handles, loc="outside lower center", ncols=3, title_fontsize=10,
        title="Number: the cable whose break is worst. Symbol: the best reaction to it.",
    )  # fmt: skip
    return drawn.figure


def _draw_break(
    axes: Axes, sides: tuple[Array, Array], numbers: Sequence[float], size: float
) -> None:
    """A cell of so many points: verdict, number of the worst cable and of the best reaction."""
    (left, right), (low, high) = sides
    survives, worst, best = numbers
    color = KEPT if survives else LOST if np.isfinite(worst) else UNHELD
    axes.add_patch(
        Rectangle(
            (left, low), right - left, high - low, facecolor=color, edgecolor="0.4", linewidth=0.5,
            hatch=LOOKS[color][0], hatch_linewidth=0.4,
        )
    )  # fmt: skip
    if np.isfinite(worst):
        x = 0.5 * (left + right)
        axes.text(
            x, low + 0.68 * (high - low), f"{int(worst)}", ha="center", va="center",
            fontsize=float(np.clip(0.42 * size, 4.0, 12.0)),
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        )  # fmt: skip
        axes.plot(
            [x], [low + 0.28 * (high - low)], color="black", markerfacecolor="white",
            marker=MARKERS[int(best) - 1], markersize=float(np.clip(0.26 * size, 2, 8)),
        )  # fmt: skip


def _contours(axes: Axes, along: list[Array], plane: Array, limits: tuple[float, float]) -> None:
    finite = plane[np.isfinite(plane)]
    levels = MaxNLocator(CONTOURS).tick_values(*limits)
    if len(finite) == 0 or not np.any((levels > finite.min()) & (levels < finite.max())):
        return
    lines = axes.contour(
        *along, np.ma.masked_invalid(plane), levels, colors="black", linewidths=0.6
    )
    axes.clabel(lines, fmt="%.3g", fontsize=8)


def _title(workspace: Workspace, measure: str | None) -> str:
    about = workspace.arguments
    volume = workspace.volume()
    what = ", ".join(workspace.holds) if measure is None else MEASURES[measure].title
    turns = len(workspace.grid.angles)
    rule = f"\n{RULES[about['orientations']]}, {turns} orientations" if turns > 1 else ""
    share = f"cells inside: {100.0 * volume.share:.1f} % of the grid's box"
    if measure is not None and not workspace.inside().any():
        share = "no pose inside: numbers of all poses"
    words = wrap(f"{about['robot']}: {what}; {workspace.geometry}", LINE)
    return "\n".join(words) + f"\n{share}{rule}"


def wrench_set_figure(wrenches: AvailableWrenches, at: Array, title: str) -> Figure:
    """Sections through what cables can give: forces at the moments of `at`, and the other way.

    Args:
        wrenches: The wrenches, of six rows or of those of a planar platform, (moment, f_x, f_y).
        at: A wrench W t that is marked, such as what the weight demands, shape (n,) [N m, N].
        title: Title of the figure.
    """
    if len(wrenches.row_scale) == 6:
        pairs = [(3, 4), (3, 5), (4, 5), (0, 1), (0, 2), (1, 2)]
        names = ["m_x", "m_y", "m_z", "f_x", "f_y", "f_z"]
    else:
        pairs, names = [(1, 2), (0, 1), (0, 2)], ["m_z", "f_x", "f_y"]
    units = [f"${name}$ [{'N m' if name[0] == 'm' else 'N'}]" for name in names]
    figure, grid = panels(len(pairs), 3, (11.0, 1.4 * len(pairs)), title)
    for axes, rows in zip(grid, pairs, strict=True):
        corners = wrenches.section(rows, at)
        if len(corners):
            axes.fill(*corners.T, facecolor=INSIDE, alpha=0.35, edgecolor=INSIDE, linewidth=1.5)
        axes.plot(at[rows[0]], at[rows[1]], "k+", markersize=10)
        axes.set(xlabel=units[rows[0]], ylabel=units[rows[1]])
    return figure

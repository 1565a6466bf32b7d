"""Figures of workspaces: planes coloured by a measure or by what holds, and wrench sets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from textwrap import wrap

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure, plain_numbers
from cdpr_drake.analyses.workspaces.break_figures import breaks_figure
from cdpr_drake.analyses.workspaces.break_tasks import NUMBERED, SURVIVES
from cdpr_drake.analyses.workspaces.conditions import MEASURES
from cdpr_drake.analyses.workspaces.stability_figures import (
    around_robot,
    cell_edges,
    draw_robot,
    even_choice,
    plane_axes,
)
from cdpr_drake.analyses.workspaces.workspace_question import RULES
from cdpr_drake.analyses.workspaces.workspace_results import ALL, RobotWorkspace
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import nth_look
from cdpr_drake.workspaces import box_expansion_kernel
from cdpr_drake.workspaces.available_wrenches import AvailableWrenches
from cdpr_drake.workspaces.certified_boxes import CertifiedBoxes

OUTSIDE, SOME, INSIDE = "#e8e8e8", "#f0c27b", "#3f8f5f"
"""Of cells where no kind holds, where some do, and where all do."""

PROVEN = {
    box_expansion_kernel.INSIDE: ("proven inside", INSIDE, None),
    box_expansion_kernel.OUTSIDE: ("proven outside", OUTSIDE, None),
    box_expansion_kernel.OPEN: ("open", SOME, "////"),
}
"""Label, colour and hatching of boxes by what is proven."""

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])

MOST_PLANES = 12
COLUMNS = 4

LINE = 60
"""Characters in a line of a title."""

CONTOURS = 6
"""Contour lines of a measure, about."""

LEAST_CONTOURED = 5
"""Lines of equal measure are drawn over so many points in both directions; over fewer they are
straight, and their numbers meet."""


def workspace_pictures(
    workspace: RobotWorkspace,
    formats: Sequence[str] = DEFAULT_FORMATS,
    boxes: CertifiedBoxes | None = None,
    robot: Robot | None = None,
) -> Pictures:
    """What draws the figures that a result suffices for, by the names of their files.

    Args:
        workspace: The result.
        formats: Endings of the files.
        boxes: Certified boxes; None: there are none.
        robot: Whose frame and exit points are drawn; None: nothing but the grid is.
    """
    drawn: dict[str, Callable[[], Figure]] = {
        name or "planes": partial(planes_figure, workspace, name, robot)
        for name in (None, *workspace.values) if name not in NUMBERED
    }  # fmt: skip
    if SURVIVES in workspace.holds:
        drawn["breaks"] = partial(breaks_figure, workspace)
    if boxes is not None:
        about = workspace.arguments
        drawn["open_share"] = partial(boxes_figure, boxes, about["robot"], workspace.geometry)
        drawn["boxes"] = partial(box_planes_figure, boxes, about["robot"], list(about["kinds"]))
    return dict(figure_writers(drawn, formats))


def planes_figure(
    workspace: RobotWorkspace, measure: str | None = None, robot: Robot | None = None
) -> Figure:
    """Planes of a grid, coloured by what holds, or by a measure where all kinds hold.

    Planes are horizontal, but where the grid has one point along x or y and several along z. With
    several orientations a measure is its least over them.

    Args:
        workspace: The result.
        measure: Name of a measure of the result; None: what holds.
        robot: Whose frame and exit points are drawn; None: nothing but the grid is.
    """
    normal, u, v = plane_axes(workspace.grid.shape[1:])
    places = workspace.grid.axes[normal]
    chosen = even_choice(len(places), MOST_PLANES)
    edges = cell_edges(workspace.grid.axes, (u, v))
    rows = -(-len(chosen) // COLUMNS)
    columns = -(-len(chosen) // rows)
    lower, upper = np.array([[e[0], e[-1]] for e in edges]).T
    if robot is not None:
        lower, upper = around_robot(robot, (u, v), lower, upper)
    extents = upper - lower
    width, height = extents * (3.0 if columns > 1 else 5.5) / np.max(extents)
    figure, grid = new_figure(
        rows,
        columns,
        (max(1.6 + (width + 0.3) * columns, 6.5), 2.2 + (height + 0.4) * rows),
        _title(workspace, measure),
    )
    panels: list[Axes] = list(np.ravel(grid))
    inside = workspace.places(ALL)
    if measure is None:
        kinds = [workspace.places(kind) for kind in workspace.holds]
        cells = np.sum(kinds, axis=0) > 0
        shown: Array = np.where(inside, 2.0, np.where(cells, 1.0, 0.0))
        limits = (-0.5, 2.5)
        colors: Colormap = ListedColormap([OUTSIDE, SOME, INSIDE])
    else:
        held = workspace.inside()
        # With no pose inside there is nothing else to see; the title says so.
        shown = _least(workspace.values[measure], held if held.any() else np.ones_like(held))
        known = shown[np.isfinite(shown)]
        limits = (float(np.min(known)), float(np.max(known))) if len(known) else (0.0, 1.0)
        # A plane without a number would be an empty panel.
        colors = colormaps["viridis"].with_extremes(bad=OUTSIDE)
    mesh = None
    for number, (axes, k) in enumerate(zip(panels, chosen, strict=False)):
        plane = np.take(shown, k, normal).T
        mesh = axes.pcolormesh(*edges, plane, cmap=colors, vmin=limits[0], vmax=limits[1])
        if measure is not None and min(plane.shape) >= LEAST_CONTOURED and np.ptp(limits) > 0.0:
            _contours(axes, [workspace.grid.axes[k] for k in (u, v)], plane, limits)
        if robot is not None:
            draw_robot(axes, robot, (u, v), edges)
            axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))
        axes.set_aspect("equal")
        axes.grid(False)
        axes.set_title(f"{'xyz'[normal]} = {places[k]:.3g} m", fontsize=11)
        axes.tick_params(labelsize=10)
        plain_numbers(axes.xaxis)
        plain_numbers(axes.yaxis)
        first, lowest = number % columns == 0, number + columns >= len(chosen)
        axes.tick_params(labelleft=first, labelbottom=lowest)
        axes.set_ylabel(f"{'xyz'[v]} in W [m]" if first else "")
        axes.set_xlabel(f"{'xyz'[u]} in W [m]" if lowest else "")
    for axes in panels[len(chosen) :]:
        axes.remove()
    lines, _ = panels[0].get_legend_handles_labels()
    if measure is None:
        labels = {OUTSIDE: "outside", SOME: "some of the kinds", INSIDE: "inside"}
        if len(workspace.holds) == 1:
            del labels[SOME]
        figure.legend(
            handles=[
                *(Patch(facecolor=color, label=label) for color, label in labels.items()),
                *lines,
            ],
            loc="outside lower center",
            ncols=3,
            title="Each point of the grid colours the cell around it.",
            title_fontsize=10,
        )
    elif mesh is not None:
        about = MEASURES[measure]
        figure.colorbar(mesh, ax=panels[: len(chosen)], label=f"{about.title} [{about.unit}]")
        handles: list[Artist] = [*lines]
        if np.any(np.isnan(np.take(shown, chosen, normal))):
            words = "outside" if workspace.inside().any() else "no number"
            handles.insert(0, Patch(facecolor=OUTSIDE, label=words))
        if handles:
            figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def boxes_figure(found: CertifiedBoxes, robot: str, cables: str = "") -> Figure:
    """Shares that are proven, and what is open, against the number of boxes.

    Args:
        found: The boxes.
        robot: Name of the robot.
        cables: How its cables run, in words; empty: nothing is said.
    """
    words = wrap(f"{robot}: boxes that are proven" + (f"; cables {cables}" if cables else ""), LINE)
    figure, axes = new_figure(
        1, 1, (7.0, 4.6), "\n".join(words) + f"\n{found.open:.2%} of the box open"
    )
    names = ("proven inside", "proven outside", "open")
    for number, (name, share) in enumerate(zip(names, found.curve[:, 1:].T, strict=True)):
        look = nth_look(number)
        shown = share > 0.0  # on a logarithmic axis
        axes.plot(
            found.curve[shown, 0], 100.0 * share[shown], label=name, **line_style(look),
            marker=look.marker, markersize=4,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="boxes judged", ylabel="share of the box [%]")
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def box_planes_figure(found: CertifiedBoxes, robot: str, kinds: Sequence[str]) -> Figure:
    """What is proven in three planes through the middle of the region that was cut.

    Angles that vary are in the middle of their ranges.

    Args:
        found: The boxes.
        robot: Name of the robot.
        kinds: What was proven.
    """
    low = np.min(found.poses - found.halves, axis=0)
    high = np.max(found.poses + found.halves, axis=0)
    middle = 0.5 * (low + high)
    wide = [k for k in range(3) if low[k] < high[k]]
    planes = [k for k in range(3) if len(set(wide) - {k}) == 2] or [2]
    words = wrap(f"{robot}: poses proven {', '.join(kinds)}", LINE)
    figure, grid = new_figure(1, len(planes), (1.0 + 3.6 * len(planes), 4.8), "\n".join(words))
    # A pose of a border is in several boxes: a little off the middle, where no cut is.
    at = middle + 1e-6 * (high - low)
    for axes, normal in zip(np.ravel(grid), planes, strict=True):
        u, v = (k for k in range(3) if k != normal)
        others = [k for k in range(found.poses.shape[1]) if k not in (u, v)]
        hit = np.all(np.abs(found.poses - at)[:, others] <= found.halves[:, others] + 1e-12, axis=1)
        for verdict, (_, color, hatch) in PROVEN.items():
            some = np.flatnonzero(hit & (found.verdicts == verdict))
            corners = (found.poses - found.halves)[some][:, (u, v)]
            sizes = 2.0 * found.halves[some][:, (u, v)]
            cells = corners[:, np.newaxis] + sizes[:, np.newaxis] * SQUARE
            axes.add_collection(
                PolyCollection(
                    list(cells), facecolor=color, edgecolor="#555555", linewidth=0.1, hatch=hatch
                )
            )
        axes.set(xlim=(low[u], high[u]), ylim=(low[v], high[v]), aspect="equal")
        axes.set(xlabel=f"{'xyz'[u]} [m]", ylabel=f"{'xyz'[v]} [m]")
        axes.grid(False)
        axes.set_title(f"{'xyz'[normal]} = {middle[normal]:.3g} m", fontsize=11)
    figure.legend(
        handles=[
            Patch(facecolor=color, edgecolor="#555555", hatch=hatch, label=label)
            for label, color, hatch in PROVEN.values()
        ],
        loc="outside lower center",
        ncols=3,
    )
    return figure


def _least(values: Array, inside: np.ndarray) -> Array:
    """Least value over the orientations where all holds; NaN where none does."""
    some = np.where(inside & np.isfinite(values), values, np.inf)
    least = np.min(some, axis=0)
    return np.where(np.isfinite(least), least, np.nan)


def _contours(axes: Axes, along: list[Array], plane: Array, limits: tuple[float, float]) -> None:
    known = plane[np.isfinite(plane)]
    levels = MaxNLocator(CONTOURS).tick_values(*limits)
    if len(known) == 0 or not np.any((levels > known.min()) & (levels < known.max())):
        return
    lines = axes.contour(
        *along, np.ma.masked_invalid(plane), levels, colors="black", linewidths=0.6
    )
    axes.clabel(lines, fmt="%.3g", fontsize=8)


def _title(workspace: RobotWorkspace, measure: str | None) -> str:
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


def wrench_set_figure(found: AvailableWrenches, at: Array, title: str) -> Figure:
    """Sections through what cables can give: forces at the moments of `at`, and the other way.

    Args:
        found: The wrenches, of six rows or of those of a planar platform, (moment, f_x, f_y).
        at: A wrench W t that is marked, such as what the weight demands, shape (n,) [N m, N].
        title: Title of the figure.
    """
    if len(found.row_scale) == 6:
        panels = [(3, 4), (3, 5), (4, 5), (0, 1), (0, 2), (1, 2)]
        names = ["m_x", "m_y", "m_z", "f_x", "f_y", "f_z"]
    else:
        panels, names = [(1, 2), (0, 1), (0, 2)], ["m_z", "f_x", "f_y"]
    units = [f"${name}$ [{'N m' if name[0] == 'm' else 'N'}]" for name in names]
    figure, grid = new_figure(-(-len(panels) // 3), 3, (11.0, 4.2 * -(-len(panels) // 3)), title)
    for axes, rows in zip(np.ravel(grid), panels, strict=True):
        corners = found.section(rows, at)
        if len(corners):
            axes.fill(*corners.T, facecolor=INSIDE, alpha=0.35, edgecolor=INSIDE, linewidth=1.5)
        axes.plot(at[rows[0]], at[rows[1]], "k+", markersize=10)
        axes.set(xlabel=units[rows[0]], ylabel=units[rows[1]])
    return figure

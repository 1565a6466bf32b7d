"""Figures of control stability workspaces: planes, solids, and volumes against bounds."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.analyses.visualization.figure_style import (
    COVERED_LINE,
    bare_figure,
    few_ticks,
    line_style,
    new_figure,
    plain_numbers,
)
from cdpr_drake.analyses.visualization.solids import draw_solid
from cdpr_drake.analyses.workspaces.stability_results import KINDS, StabilityWorkspaces
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import IDEAL, OUTLINE, WORKSPACES, look_of
from cdpr_drake.workspaces.volume import surface_quads

COLORS = WORKSPACES
"""Of the parts of a plane; of the solids too."""

LABELS = {
    "neither": "neither",
    "S": "held only (S)",
    "Z": "stable only (Z)",
    "SZ": "stable and held (SZ)",
}

MOST_PLANES = 16
"""So many planes at most are drawn."""

COLUMNS = 4
"""Planes side by side, at most."""

BORDERED_CELLS = 32
"""So many cells side by side at most have visible borders, which would hide smaller ones."""

ONE_CELL = 0.1
"""Size of the cell of a grid of a single point [m]."""

ROOM = 0.04
"""Round frame and exit points in a plane, as a share of its larger side."""

CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])

LINES: dict[str, dict[str, Any]] = {
    "Z": COVERED_LINE,
    "SZ": {"linestyle": "--", "linewidth": 1.4, "marker": "s", "markersize": 4},
}
"""Of the curves; SZ can be seen where it lies on Z. Colour and marker are those of the bound."""


def stability_pictures(
    workspaces: StabilityWorkspaces, robot: Robot, formats: Sequence[str] = DEFAULT_FORMATS
) -> Pictures:
    """What draws the figures that a result suffices for, by the names of their files."""
    drawn: dict[str, Callable[[], Figure]] = {
        "planes": partial(planes_figure, workspaces, robot=robot)
    }
    if min(workspaces.grid.shape[1:]) > 1:
        drawn["solids"] = partial(solids_figure, workspaces, robot)
    if curves(workspaces):
        drawn["volumes"] = partial(curves_figure, workspaces)
    return dict(figure_writers(drawn, formats))


def planes_figure(
    workspaces: StabilityWorkspaces, bounds: str | None = None, robot: Robot | None = None
) -> Figure:
    """Planes of a grid, coloured by what holds there in every orientation.

    Planes are horizontal, but where the grid has one point along x or y and several along z.

    Args:
        workspaces: The result.
        bounds: Name of the perturbation bounds; None: the first.
        robot: Whose frame and exit points are drawn; None: nothing but the grid is.
    """
    normal, u, v = plane_axes(workspaces.grid.shape[1:])
    places = workspaces.grid.axes[normal]
    chosen = even_choice(len(places), MOST_PLANES)
    edges = cell_edges(workspaces.grid.axes, (u, v))
    lower, upper = np.array([[e[0], e[-1]] for e in edges]).T
    if robot is not None:
        lower, upper = around_robot(robot, (u, v), lower, upper)
    extents = upper - lower
    rows = -(-len(chosen) // COLUMNS)
    columns = -(-len(chosen) // rows)
    width, height = extents * (3.0 if columns > 1 else 5.7) / max(extents)
    some = "" if len(chosen) == len(places) else f"\n{len(chosen)} of {len(places)} planes"
    figure, grid = new_figure(
        rows,
        columns,
        (max(0.9 + (width + 0.2) * columns, 6.5), 2.4 + (height + 0.3) * rows),
        _title(workspaces, "Where the servo is stable and where the platform can be held", bounds)
        + some,
    )
    # Panels of fixed proportions come closer to their neighbours than the layout knows.
    figure.set_layout_engine("constrained", w_pad=0.1, h_pad=0.12)
    panels: list[Axes] = list(np.ravel(grid))
    parts = 2 * workspaces.places("Z", bounds) + workspaces.places("S", bounds)
    colors = ListedColormap(list(COLORS.values()))
    for number, (axes, k) in enumerate(zip(panels, chosen, strict=False)):
        cells = np.take(parts, k, normal)  # shape (nu, nv), as u < v
        axes.pcolormesh(
            *edges,
            cells.T,
            cmap=colors,
            vmin=-0.5,
            vmax=3.5,
            edgecolors="white" if max(cells.shape) <= BORDERED_CELLS else "none",
            linewidth=0.5,
        )
        if robot is not None:
            draw_robot(axes, robot, (u, v), edges)
            axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))
        axes.set_aspect("equal")
        axes.grid(False)
        axes.set_title(f"{'xyz'[normal]} = {places[k]:.3g} m", fontsize=11)
        axes.tick_params(labelsize=10)
        for side, along, extent in ((axes.xaxis, u, extents[0]), (axes.yaxis, v, extents[1])):
            if robot is None:
                points, most = workspaces.grid.axes[along], 4 if columns > 1 else 8
                side.set_ticks(_ticks(points, extent, max(extents), most))
            plain_numbers(side)
        first, lowest = number % columns == 0, number + columns >= len(chosen)
        axes.tick_params(labelleft=first, labelbottom=lowest)
        axes.set_ylabel(f"{'xyz'[v]} in W [m]" if first else "")
        axes.set_xlabel(f"{'xyz'[u]} in W [m]" if lowest else "")
    for axes in panels[len(chosen) :]:
        axes.remove()
    lines, _ = panels[0].get_legend_handles_labels()
    patches = [Patch(facecolor=color, label=LABELS[key]) for key, color in COLORS.items()]
    figure.legend(
        handles=[*patches, *lines],
        loc="outside lower center",
        ncols=4 if columns > 2 else 2,
        title="Each point of the grid colours the cell around it.",
        title_fontsize=10,
    )
    return figure


def plane_axes(counts: Sequence[int]) -> tuple[int, int, int]:
    """Numbers of the axis normal to the planes that show most, and of their axes.

    Args:
        counts: Points along x, y, z.
    """
    nx, ny, nz = counts
    if nz > 1 and ny == 1:
        return 1, 0, 2
    if nz > 1 and nx == 1:
        return 0, 1, 2
    return 2, 0, 1


def even_choice(count: int, most: int) -> list[int]:
    """At most so many of 0 to count - 1, evenly spaced, as much left out before as after them."""
    stride = -(-count // most)
    return list(range((count - 1) % stride // 2, count, stride))


def cell_edges(axes: Sequence[Array], which: Sequence[int]) -> list[Array]:
    """Borders of the cells around the points of some axes, shape (n + 1,) each [m].

    Cells end at the grid's box, beyond which nothing was asked: the first and the last of an axis
    are half as wide as the others. The cell of a one-point axis is as large as those of the others.

    Args:
        axes: Coordinates along x, y, z, ascending and evenly spaced, shape (n,) [m].
        which: Numbers of the axes.
    """
    steps = [float(np.ptp(axes[k])) / max(len(axes[k]) - 1, 1) for k in which]
    other = max(steps) or ONE_CELL
    found = []
    for k, step in zip(which, steps, strict=True):
        edges = axes[k][0] + (step or other) * (np.arange(len(axes[k]) + 1) - 0.5)
        if step > 0.0:
            edges[[0, -1]] = axes[k][[0, -1]]
        found.append(edges)
    return found


def around_robot(
    robot: Robot, plane: tuple[int, int], lower: Array, upper: Array
) -> tuple[Array, Array]:
    """Corners, shape (2,) each [m], of what holds a grid, the frame and the exit points."""
    across = list(plane)
    points = np.column_stack([robot.frame.lower, robot.frame.upper, robot.cable_set().p_WA])[across]
    lower = np.minimum(lower, points.min(axis=1))
    upper = np.maximum(upper, points.max(axis=1))
    room = ROOM * np.max(upper - lower)
    return lower - room, upper + room


def draw_robot(axes: Axes, robot: Robot, plane: tuple[int, int], edges: Sequence[Array]) -> None:
    """The grid's box, the frame, and the exit points of the cables, as they are seen in a plane."""
    u, v = plane
    boxes = (
        ("box of the grid", (edges[0][0], edges[1][0]), (edges[0][-1], edges[1][-1]), ":"),
        ("frame", robot.frame.lower[list(plane)], robot.frame.upper[list(plane)], "-"),
    )
    for label, low, high, dash in boxes:
        corners = np.asarray(low) + CORNERS * np.subtract(high, low)
        axes.plot(*corners.T, color=OUTLINE.color, linestyle=dash, linewidth=1.2, label=label)
    points = robot.cable_set().p_WA
    axes.plot(
        points[u], points[v], "^", color=OUTLINE.color, markersize=6, clip_on=False,
        label="exit points of the cables",
    )  # fmt: skip


def solids_figure(
    workspaces: StabilityWorkspaces, robot: Robot, bounds: str | None = None
) -> Figure:
    """Z, S and SZ as solids in the robot's frame: the cells with all eight corners inside.

    Args:
        workspaces: The result.
        robot: The robot, for its frame and exit points.
        bounds: Name of the perturbation bounds; None: the first.
    """
    figure = bare_figure((13.0, 5.7), _title(workspaces, "Workspaces as solids", bounds))
    lower, upper = robot.frame.lower, robot.frame.upper
    exits = robot.cable_set().p_WA
    handles: list[Line2D] = []
    for number, (kind, words) in enumerate(KINDS.items(), start=1):
        axes = figure.add_subplot(1, 3, number, projection="3d", computed_zorder=False)
        quads = surface_quads(workspaces.places(kind, bounds), workspaces.grid.axes)
        handles = draw_solid(axes, quads, COLORS[kind], (lower, upper), exits)
        volume = workspaces.volume(kind, "corners", bounds)
        axes.set_title(
            f"{kind}, {words}\n{volume.value:.3g} m³, {100 * volume.share:.1f} %",
            fontsize=11,
            y=1.0,
            pad=0,
        )
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=2,
        title="Solids are the cells between points of the grid with all eight corners inside; "
        "the figure of planes shows the cells around points.",
        title_fontsize=10,
    )
    return figure


def curves(workspaces: StabilityWorkspaces) -> dict[str, list[tuple[float, str]]]:
    """Per varied bound its values in ascending order [m or deg] with the names of the bounds."""
    found: dict[str, list[tuple[float, str]]] = {}
    base, *varied = workspaces.names
    for name in varied:
        parameter = name.partition("=")[0].removesuffix("_deg")
        found.setdefault(parameter, []).append((_value(workspaces, name, parameter), name))
    for parameter, points in found.items():
        points.append((_value(workspaces, base, parameter), base))
        # Where a value is that of the first bounds, one of the two is enough.
        found[parameter] = sorted({value: (value, name) for value, name in points}.values())
    return found


def curves_figure(workspaces: StabilityWorkspaces) -> Figure:
    """Share of the grid's box in Z, SZ and S against each varied bound, the others as they are."""
    found = curves(workspaces)
    groups = {
        "m": [p for p in found if not p.startswith("d_theta")],
        "deg": [p for p in found if p.startswith("d_theta")],
    }
    groups = {unit: parameters for unit, parameters in groups.items() if parameters}
    figure, grid = new_figure(
        1,
        len(groups),
        (6.5 * len(groups) + 0.5, 5.2),
        _about(workspaces, "Size of the workspace against bounds of the perturbations"),
    )
    for axes, (unit, parameters) in zip(np.ravel(grid), groups.items(), strict=True):
        for parameter in parameters:
            values = [value for value, _ in found[parameter]]
            look = look_of(parameter, list(found))  # few bounds have colours far from each other
            for kind, line in LINES.items():
                shares = [
                    100.0 * workspaces.volume(kind, "corners", name).share
                    for _, name in found[parameter]
                ]
                style = {**line, "color": look.color, "marker": look.marker}
                axes.plot(values, shares, label=f"{kind}, {parameter} [{unit}]", **style)
        static = 100.0 * workspaces.volume("S", "corners").share
        axes.axhline(static, label="S, without perturbation", **line_style(IDEAL))
        what = parameters[0] if len(parameters) == 1 else "bound"
        axes.set(xlabel=f"{what} [{unit}]", ylim=(-3.0, 103.0))
        axes.set_ylabel("cells with all corners inside [% of the box]")
        axes.set_xlim(left=0.0)
        few_ticks(axes.xaxis)
        axes.legend()
    return figure


def _ticks(axis: Array, extent: float, longest: float, most: int) -> Array:
    """Ticks along one side of a plane, as far apart as on the longer side unless that is too far.

    Args:
        axis: Coordinates of the points, shape (n,) [m].
        extent: Length of the side [m].
        longest: Length of the longer side [m].
        most: Ticks on the longer side, about.
    """
    if len(axis) == 1:
        return axis
    low = float(axis[0] + axis[-1] - extent) / 2.0
    spacing = np.diff(MaxNLocator(most, steps=[1, 2, 5, 10]).tick_values(0.0, longest))[0]
    if extent < 2.0 * spacing:
        spacing = np.diff(MaxNLocator(2, steps=[1, 2, 5, 10]).tick_values(0.0, extent))[0]
    first, last = np.ceil(low / spacing), np.floor((low + extent) / spacing)
    return np.asarray(np.arange(first, last + 1) * spacing)


def _value(workspaces: StabilityWorkspaces, name: str, parameter: str) -> float:
    value = float(workspaces.arguments["bounds"][name][parameter])
    return float(np.degrees(value)) if parameter.startswith("d_theta") else value


SCHEME_WORDS = {
    "pbvs": "pose-based visual servoing",
    "pbvs-line": "pose-based visual servoing, camera on a straight line",
    "2.5d": "2 1/2 D visual servoing",
    "ibvs": "image-based visual servoing",
}


def _about(workspaces: StabilityWorkspaces, words: str, more: str = "") -> str:
    """Title: what is shown; robot, scheme, verdict, `more`; and the interaction matrix."""
    a, matrix = workspaces.arguments, workspaces.interaction_matrix
    scheme = SCHEME_WORDS.get(a["scheme"], a["scheme"])
    lines = [words, f"{a['robot']}, {scheme}, {a['verdict']} perturbations{more}"]
    lines.append(workspaces.geometry)
    # A terminal has no formulas, of which these are the letters.
    written = re.sub(r"\[(\w)_t\]x", r"$[\1_t]_\\times$", matrix).replace("L_s", "$L_s$")
    return "\n".join([*lines, written] if matrix else lines)


def _title(workspaces: StabilityWorkspaces, words: str, bounds: str | None) -> str:
    turns = len(workspaces.grid.angles)
    name = f", bounds: {bounds or workspaces.names[0]}"
    more = name + (f", in all of {turns} orientations" if turns > 1 else "")
    return _about(workspaces, words, more)

"""Planes of a grid of poses, a panel each: which are shown, how large, with what of the robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.frame.figures import panels, plain_numbers
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import OUTLINE
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

ONE_CELL = 0.1
"""Size of the cell of a grid of a single point [m]."""

ROOM = 0.04
"""Room around frame and exit points in a plane, as a share of its larger side."""

BORDERED_CELLS = 32
"""So many cells side by side at most have visible borders, which would hide smaller ones."""

CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])


class Planes(NamedTuple):
    """A figure with axes for each of the chosen planes along the normal axis, and what of the robot
    is drawn there, for the legend."""

    figure: Figure
    axes: list[Axes]
    chosen: list[int]
    normal: int
    handles: list[Artist]


Paint = Callable[[Axes, list[Array], Callable[[Array], Array]], object]
"""Draws a plane, with borders of cells along its two axes, and what cuts the plane out of values of
shape (nx, ny, nz), shape (nv, nu)."""


def draw_regions(
    grid: WorkspaceGrid, title: str, parts: Array, colors: Mapping[str, str | None],
    robot: Robot | None, *, most: int, borders: bool = False,
    columns: tuple[int, int] = (3, 3),
) -> Figure:  # fmt: skip
    """Planes of a grid, coloured by what holds at their points.

    Args:
        grid: The grid.
        title: Title of the figure.
        parts: Number of the colour of each point, shape (nx, ny, nz).
        colors: Colours, with their labels; no label: it does not occur.
        robot: As `draw_planes`, like most.
        most: Largest number of planes.
        borders: True: cells have borders, unless they are small.
        columns: Columns of the legend below up to two panels, and below more.
    """
    table = ListedColormap(list(colors))

    def paint(axes: Axes, edges: list[Array], plane: Callable[[Array], Array]) -> None:
        cells = plane(parts)
        edge = "white" if borders and max(cells.shape) <= BORDERED_CELLS else "none"
        axes.pcolormesh(
            *edges, cells, cmap=table, vmin=-0.5, vmax=len(colors) - 0.5, edgecolors=edge,
            linewidth=0.5,
        )  # fmt: skip

    planes = draw_planes(grid, title, paint, robot, most=most, parts=parts)
    patches = [Patch(facecolor=color, label=label) for color, label in colors.items() if label]
    planes.figure.legend(
        handles=[*patches, *planes.handles], loc="outside lower center", title_fontsize=10,
        ncols=columns[len(planes.axes) > 2],
        title="Each point of the grid colours the cell around it.",
    )  # fmt: skip
    return planes.figure


def draw_planes(
    grid: WorkspaceGrid, title: str, paint: Paint, robot: Robot | None = None, *, most: int,
    columns: int = 4, width: float = 3.0, parts: Array | None = None,
) -> Planes:  # fmt: skip
    """Draws planes of a grid, horizontal ones unless the grid has one point along x or y only.

    Args:
        grid: The grid.
        title: Title of the figure; it says if planes are left out.
        paint: Draws a plane.
        robot: Robot whose frame and exit points are drawn.
        most: Largest number of planes.
        columns: Largest number of planes side by side.
        width: Larger side of a plane, if there are several [in].
        parts: What colours tell apart, shape (nx, ny, nz); planes of one colour are left out if
            others have a border.
    """
    normal, u, v = plane_axes(grid.shape[1:])
    places, edges = grid.axes[normal], cell_edges(grid.axes, (u, v))
    telling = np.arange(len(places))
    if parts is not None:
        flat = np.ptp(np.moveaxis(parts, normal, 0).reshape(len(places), -1), axis=1) == 0
        telling = telling if np.all(flat) else np.flatnonzero(~flat)
    chosen = [int(telling[k]) for k in even_choice(len(telling), most)]
    if len(chosen) < len(places):
        title += f"\n{len(chosen)} of {len(places)} planes"
        title += ", the others have one colour" * (len(chosen) == len(telling))
    rows = -(-len(chosen) // columns)
    columns = -(-len(chosen) // rows)
    lower, upper = np.array([[edge[0], edge[-1]] for edge in edges]).T
    if robot is not None:
        lower, upper = _around_robot(robot, (u, v), lower, upper)
    extents = upper - lower
    wide, high = extents * (width if columns > 1 else 5.6) / np.max(extents)
    size = max(1.4 + (wide + 0.3) * columns, 6.5), 2.4 + (high + 0.4) * rows
    figure, axes = panels(len(chosen), columns, size, title)
    # Panels of fixed proportions come closer to their neighbours than the layout knows.
    figure.set_layout_engine("constrained", w_pad=0.1, h_pad=0.12)
    for number, (panel, k) in enumerate(zip(axes, chosen, strict=True)):
        paint(panel, edges, lambda values, k=k: np.take(values, k, normal).T)  # type: ignore[misc]
        if robot is not None:
            _draw_robot(panel, robot, (u, v), edges)
            panel.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))
        panel.set_aspect("equal")
        panel.grid(False)
        panel.set_title(f"{'xyz'[normal]} = {places[k]:.3g} m", fontsize=11)
        for side, along in ((panel.xaxis, u), (panel.yaxis, v)):
            if robot is None and len(grid.axes[along]) == 1:
                side.set_ticks(grid.axes[along])
            elif robot is None:
                bins = 4 if columns > 1 else 8
                side.set_major_locator(MaxNLocator(bins, steps=[1, 2, 5, 10]))
            plain_numbers(side)
        first, lowest = number % columns == 0, number + columns >= len(chosen)
        panel.tick_params(labelleft=first, labelbottom=lowest, labelsize=10)
        panel.set_ylabel(f"{'xyz'[v]} in W [m]" if first else "")
        panel.set_xlabel(f"{'xyz'[u]} in W [m]" if lowest else "")
    handles = [] if robot is None else list(axes[0].get_legend_handles_labels()[0])
    return Planes(figure, axes, chosen, normal, handles)


def plane_axes(counts: Sequence[int]) -> tuple[int, int, int]:
    """Numbers of the axis normal to the planes that show most, and of their axes, for so many
    points along x, y, z."""
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

    Cells end at the grid's box: the first and the last of an axis are half as wide as the others.
    The cell of a one-point axis is as large as the cells of the others.
    """
    steps = [float(np.ptp(axes[k])) / max(len(axes[k]) - 1, 1) for k in which]
    widest = max(steps) or ONE_CELL
    borders = []
    for k, step in zip(which, steps, strict=True):
        edges = axes[k][0] + (step or widest) * (np.arange(len(axes[k]) + 1) - 0.5)
        if step > 0.0:
            edges[[0, -1]] = axes[k][[0, -1]]
        borders.append(edges)
    return borders


def _around_robot(
    robot: Robot, plane: tuple[int, int], lower: Array, upper: Array
) -> tuple[Array, Array]:
    """Corners, shape (2,) each [m], of what holds a grid, the frame and the exit points."""
    across = list(plane)
    points = np.column_stack([robot.frame.lower, robot.frame.upper, robot.cable_set().p_WA])[across]
    lower = np.minimum(lower, points.min(axis=1))
    upper = np.maximum(upper, points.max(axis=1))
    room = ROOM * np.max(upper - lower)
    return lower - room, upper + room


def _draw_robot(axes: Axes, robot: Robot, plane: tuple[int, int], edges: Sequence[Array]) -> None:
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

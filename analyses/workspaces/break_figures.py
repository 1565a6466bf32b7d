"""Figure of single breaks over a grid: where all are survived, the worst cable, the best reaction.

Readable without colours: hatching, numbers and symbols say all of it.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from cdpr_drake.analyses.visualization.figure_style import new_figure, plain_numbers
from cdpr_drake.analyses.workspaces.break_tasks import BEST, SURVIVES, WORST
from cdpr_drake.analyses.workspaces.stability_figures import cell_edges, even_choice, plane_axes
from cdpr_drake.analyses.workspaces.workspace_results import RobotWorkspace
from cdpr_drake.arrays import Array

MARKERS = ("s", "o", "^", "D", "v")
"""Symbols of reactions, in the order in which they were asked for."""

MOST_PLANES, COLUMNS = 6, 3

KEPT, LOST, UNHELD = "#ffffff", "#c8c8c8", "#8a8a8a"
"""Of cells where every break is survived, where one is not, and that all cables do not hold."""

LOOKS = {
    KEPT: (None, "every break is survived"),
    LOST: ("///", "one is not"),
    UNHELD: (None, "not held by all cables"),
}
"""Hatching and label by colour."""


def breaks_figure(workspace: RobotWorkspace) -> Figure:
    """Planes of a grid: a cell a pose, with its worst cable and the best reaction to that break.

    Of several orientations the first one is drawn, and the title says so.

    Args:
        workspace: A result with the kind `dynamic-single-failure`.
    """
    about, shape = workspace.arguments["breaks"], workspace.grid.shape[1:]
    normal, u, v = plane_axes(shape)
    places = workspace.grid.axes[normal]
    chosen = even_choice(len(places), MOST_PLANES)
    edges = cell_edges(workspace.grid.axes, (u, v))
    rows = -(-len(chosen) // COLUMNS)
    columns = -(-len(chosen) // rows)
    extents = np.array([float(np.ptp(e)) for e in edges])
    width, height = extents * 3.6 / np.max(extents)
    size = max(1.6 + (width + 0.3) * columns, 7.5), 2.6 + (height + 0.5) * rows
    figure, grid = new_figure(rows, columns, size, _title(workspace))
    panels: list[Axes] = list(np.ravel(grid))
    values = [workspace.holds[SURVIVES], *(workspace.values[name] for name in (WORST, BEST))]
    smallest = 72.0 * min(width / shape[u], height / shape[v])
    for number, (axes, k) in enumerate(zip(panels, chosen, strict=False)):
        _draw(axes, edges, [np.take(one[0], k, normal).T for one in values], smallest)
        axes.set_title(f"{'xyz'[normal]} = {places[k]:.3g} m", fontsize=11)
        first, lowest = number % columns == 0, number + columns >= len(chosen)
        axes.tick_params(labelleft=first, labelbottom=lowest, labelsize=10)
        plain_numbers(axes.xaxis)
        plain_numbers(axes.yaxis)
        axes.set_ylabel(f"{'xyz'[v]} [m]" if first else "")
        axes.set_xlabel(f"{'xyz'[u]} [m]" if lowest else "")
    for axes in panels[len(chosen) :]:
        axes.remove()
    handles: list[Patch | Line2D] = [
        Patch(facecolor=color, edgecolor="black", hatch=hatch, label=label)
        for color, (hatch, label) in LOOKS.items()
    ]
    handles += [
        Line2D([], [], color="black", marker=marker, linestyle="none", markerfacecolor="white",
               label=f"best: {name}")
        for name, marker in zip(about["reactions"], MARKERS, strict=False)
    ]  # fmt: skip
    figure.legend(
        handles=handles, loc="outside lower center", ncols=3, title_fontsize=10,
        title="Number: the cable whose break is worst. Symbol: the best reaction to it.",
    )  # fmt: skip
    return figure


def _draw(axes: Axes, edges: list[Array], planes: list[np.ndarray], smallest: float) -> None:
    """Cells of a plane: verdicts, numbers of cables and of reactions, shape (nv, nu) each."""
    survives, worst, best = planes
    across, up = edges
    for j, i in np.ndindex(*survives.shape):
        low = float(across[i]), float(up[j])
        high = float(across[i + 1]), float(up[j + 1])
        held = bool(np.isfinite(worst[j, i]))
        color = KEPT if survives[j, i] else LOST if held else UNHELD
        axes.add_patch(
            Rectangle(
                low, high[0] - low[0], high[1] - low[1], facecolor=color, edgecolor="0.4",
                linewidth=0.5, hatch=LOOKS[color][0], hatch_linewidth=0.4,
            )
        )  # fmt: skip
        if not held:
            continue
        x, y = 0.5 * (low[0] + high[0]), low[1] + 0.68 * (high[1] - low[1])
        axes.text(
            x, y, f"{int(worst[j, i])}", ha="center", va="center",
            fontsize=float(np.clip(0.42 * smallest, 4.0, 12.0)),
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        )  # fmt: skip
        axes.plot(
            [x], [low[1] + 0.28 * (high[1] - low[1])], color="black", markerfacecolor="white",
            marker=MARKERS[int(best[j, i]) - 1], markersize=float(np.clip(0.26 * smallest, 2, 8)),
        )  # fmt: skip
    axes.set(xlim=across[[0, -1]], ylim=up[[0, -1]], aspect="equal")
    axes.grid(False)


def _title(workspace: RobotWorkspace) -> str:
    about = workspace.arguments["breaks"]
    speed = float(np.linalg.norm(about["moving_m_s"]))
    turns = len(workspace.grid.angles)
    words = "at rest" if speed == 0.0 else f"at {speed:.3g} m/s"
    share = float(np.mean(workspace.holds[SURVIVES]))
    several = f", first of {turns} orientations" if turns > 1 else ""
    geometry = workspace.geometry
    return (
        f"{workspace.arguments['robot']}, {geometry}: any one cable breaks {words}{several}\n"
        f"survived at {share:.0%} of the poses"
    )

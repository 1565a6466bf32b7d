"""Figures of control stability workspaces: planes, solids, and volumes against bounds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LightSource, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from cdpr_drake.analyses.figure_style import bare_figure, new_figure, save_figure
from cdpr_drake.analyses.stability_question import BASE
from cdpr_drake.analyses.stability_workspaces import KINDS, StabilityWorkspaces
from cdpr_drake.arrays import Array
from cdpr_drake.models import Robot
from cdpr_drake.workspace_surface import surface_quads

COLORS = {"neither": "#e8e8e8", "S": "#f0c27b", "Z": "#7ba6d9", "SZ": "#3f8f5f"}
"""Of the parts of a plane; of the solids too."""

LABELS = {
    "neither": "neither",
    "S": "held only (S)",
    "Z": "stable only (Z)",
    "SZ": "stable and held (SZ)",
}

MOST_PLANES = 12
"""So many heights at most are drawn."""

COLUMNS = 4
"""Planes side by side, at most."""


def write_stability_figures(
    folder: Path, workspaces: StabilityWorkspaces, robot: Robot
) -> list[Path]:
    """Writes the figures that a result suffices for into a folder that exists."""
    made = {"planes.png": planes_figure(workspaces)}
    if min(workspaces.grid.shape[1:]) > 1:
        made["solids.png"] = solids_figure(workspaces, robot)
    if curves(workspaces):
        made["volumes.png"] = curves_figure(workspaces)
    return [save_figure(figure, folder / name) for name, figure in made.items()]


def planes_figure(workspaces: StabilityWorkspaces, bounds: str | None = None) -> Figure:
    """Horizontal planes of a grid, coloured by what holds there in every orientation.

    Args:
        workspaces: The result.
        bounds: Name of the perturbation bounds; None: the first.
    """
    x, y, z = workspaces.grid.axes
    chosen = sorted({*np.linspace(0, len(z) - 1, min(len(z), MOST_PLANES)).round().astype(int)})
    rows = -(-len(chosen) // COLUMNS)
    columns = -(-len(chosen) // rows)
    width = 3.0 if columns > 1 else 6.5
    shape = np.clip((np.ptp(y) or 1.0) / (np.ptp(x) or 1.0), 0.4, 2.5)
    figure, grid = new_figure(
        rows,
        columns,
        (1.2 + width * columns, 1.6 + width * shape * rows),
        _title(workspaces, bounds),
    )
    panels: list[Axes] = list(np.ravel(grid))
    parts = 2 * workspaces.places("Z", bounds) + workspaces.places("S", bounds)
    colors = ListedColormap(list(COLORS.values()))
    for axes, k in zip(panels, chosen, strict=False):
        axes.pcolormesh(x, y, parts[:, :, k].T, cmap=colors, vmin=-0.5, vmax=3.5, shading="nearest")
        axes.set_aspect("equal")
        axes.grid(False)
        axes.set_title(f"z = {z[k]:.3g} m", fontsize=11)
    for number, axes in enumerate(panels):
        if number >= len(chosen):
            axes.remove()
            continue
        if number % columns == 0:
            axes.set_ylabel("y [m]")
        else:
            axes.tick_params(labelleft=False)
        if number + columns >= len(chosen):
            axes.set_xlabel("x [m]")
        else:
            axes.tick_params(labelbottom=False)
    handles = [Patch(facecolor=color, label=LABELS[key]) for key, color in COLORS.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=4 if columns > 1 else 2)
    return figure


def solids_figure(
    workspaces: StabilityWorkspaces, robot: Robot, bounds: str | None = None
) -> Figure:
    """Z, S and SZ as solids in the robot's frame: the cells with all eight corners inside.

    Args:
        workspaces: The result.
        robot: The robot, for its frame and exit points.
        bounds: Name of the perturbation bounds; None: the first.
    """
    figure = bare_figure((13.0, 5.6), _title(workspaces, bounds))
    lower, upper = robot.frame.lower, robot.frame.upper
    for number, (kind, words) in enumerate(KINDS.items(), start=1):
        axes = figure.add_subplot(1, 3, number, projection="3d")
        quads = surface_quads(workspaces.places(kind, bounds), workspaces.grid.axes)
        if len(quads):
            axes.add_collection3d(_shaded(quads, COLORS[kind]))
        _draw_frame(axes, lower, upper)
        exits = robot.exit_points()
        axes.plot(*exits, "k^", markersize=4)
        volume = workspaces.volume(kind, "corners", bounds)
        axes.set_title(
            f"{kind}, {words}\n{volume.value:.3g} m³, {100 * volume.share:.1f} %", fontsize=11
        )
        axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
        axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), zlim=(lower[2], upper[2]))
        axes.set_box_aspect(upper - lower, zoom=0.9)
        axes.view_init(elev=22.0, azim=-58.0)
        axes.tick_params(labelsize=8)
        axes.locator_params(nbins=5)
    return figure


def curves(workspaces: StabilityWorkspaces) -> dict[str, list[tuple[float, str]]]:
    """Per varied bound its values in ascending order [m or deg] with the names of the bounds."""
    found: dict[str, list[tuple[float, str]]] = {}
    for name in workspaces.names:
        if name == BASE:
            continue
        parameter = name.partition("=")[0].removesuffix("_deg")
        found.setdefault(parameter, []).append((_value(workspaces, name, parameter), name))
    for parameter, points in found.items():
        points.append((_value(workspaces, BASE, parameter), BASE))
        # Where a value is that of the baseline, one of the two is enough.
        found[parameter] = sorted({value: (value, name) for value, name in points}.values())
    return found


def curves_figure(workspaces: StabilityWorkspaces) -> Figure:
    """Share of the grid's box in Z, SZ and S against each varied bound, the others as they are."""
    found = curves(workspaces)
    groups = [
        ("bound [m]", [p for p in found if not p.startswith("d_theta")]),
        ("bound [deg]", [p for p in found if p.startswith("d_theta")]),
    ]
    groups = [group for group in groups if group[1]]
    figure, grid = new_figure(
        1,
        len(groups),
        (6.5 * len(groups) + 0.5, 5.2),
        f"{_about(workspaces)}: size of the workspace against bounds",
    )
    order = list(found)
    for axes, (xlabel, parameters) in zip(np.ravel(grid), groups, strict=True):
        for parameter in parameters:
            values = [value for value, _ in found[parameter]]
            color = f"C{order.index(parameter) % 10}"
            for kind, line in (("Z", "o-"), ("SZ", "s--")):
                shares = [
                    100.0 * workspaces.volume(kind, "corners", name).share
                    for _, name in found[parameter]
                ]
                axes.plot(
                    values, shares, line, color=color, markersize=4, label=f"{kind}, {parameter}"
                )
        static = 100.0 * workspaces.volume("S", "corners").share
        axes.axhline(static, color="0.4", linestyle=":", label="S, without perturbation")
        axes.set(xlabel=xlabel, ylabel="cells inside [% of the box]", ylim=(0.0, 102.0))
        axes.set_xlim(left=0.0)
        axes.legend()
    return figure


def _value(workspaces: StabilityWorkspaces, name: str, parameter: str) -> float:
    value = float(workspaces.arguments["bounds"][name][parameter])
    return float(np.degrees(value)) if parameter.startswith("d_theta") else value


def _about(workspaces: StabilityWorkspaces) -> str:
    a = workspaces.arguments
    return f"{a['robot']}, {a['scheme']}, {a['verdict']}"


def _title(workspaces: StabilityWorkspaces, bounds: str | None) -> str:
    name = bounds or workspaces.names[0]
    turns = len(workspaces.grid.angles)
    return f"{_about(workspaces)}, bounds: {name}" + (
        f", in all of {turns} orientations" if turns > 1 else ""
    )


def _shaded(quads: Array, color: str) -> Poly3DCollection:
    return Poly3DCollection(
        quads,
        facecolors=color,
        edgecolors=color,
        linewidths=0.2,
        shade=True,
        lightsource=LightSource(azdeg=200.0, altdeg=45.0),
    )


def _draw_frame(axes: Axes, lower: Array, upper: Array) -> None:
    """The twelve edges of the frame."""
    ends: Sequence[Array] = (lower, upper)
    for along in range(3):
        u, v = (along + 1) % 3, (along + 2) % 3
        for a in ends:
            for b in ends:
                edge = np.empty((3, 2))
                edge[along] = lower[along], upper[along]
                edge[u], edge[v] = a[u], b[v]
                axes.plot(*edge, color="0.6", linewidth=0.8)

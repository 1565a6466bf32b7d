"""Figures of control stability workspaces: planes, solids, and volumes against bounds."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.frame.figures import (
    COVERED_LINE,
    bare_figure,
    few_ticks,
    line_style,
    panels,
)
from cdpr_drake.analyses.visualization.solids import draw_solid
from cdpr_drake.analyses.workspaces.plane_panels import draw_regions
from cdpr_drake.analyses.workspaces.servo_stability import KINDS
from cdpr_drake.errors import StabilityError
from cdpr_drake.palette import IDEAL, WORKSPACES, look_of
from cdpr_drake.workspaces.volume import surface_quads

if TYPE_CHECKING:
    from cdpr_drake.analyses.workspaces.stability import Stability

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

LINES: dict[str, dict[str, Any]] = {
    "Z": COVERED_LINE,
    "SZ": {"linestyle": "--", "linewidth": 1.4, "marker": "s", "markersize": 4},
}
"""Of the curves; SZ can be seen where it lies on Z. Colour and marker are those of the bound."""


def planes_figure(stability: Stability, bounds: str | None = None) -> Figure:
    """Planes of a grid, coloured by what holds there in every orientation under some bounds, by
    default the first."""
    parts = 2 * stability.places("Z", bounds) + stability.places("S", bounds)
    words = "Where the servo is stable and where the platform can be held"
    colors = {color: LABELS[key] for key, color in COLORS.items()}
    return draw_regions(
        stability.grid, _title(stability, words, bounds), parts, colors, stability.robot,
        most=MOST_PLANES, borders=True, columns=(2, 4),
    )  # fmt: skip


def solids_figure(stability: Stability, bounds: str | None = None) -> Figure:
    """Z, S and SZ as solids in the robot's frame: the cells with all eight corners inside.

    Raises:
        StabilityError: The result was read from a file, which has no robot.
    """
    robot = stability.robot
    if robot is None:
        raise StabilityError("solids: found a result without its robot; accepted: one with it")
    figure = bare_figure((13.0, 5.7), _title(stability, "Workspaces as solids", bounds))
    lower, upper = robot.frame.lower, robot.frame.upper
    exits = robot.cable_set().p_WA
    handles: list[Line2D] = []
    for number, (kind, words) in enumerate(KINDS.items(), start=1):
        axes = figure.add_subplot(1, 3, number, projection="3d", computed_zorder=False)
        quads = surface_quads(stability.places(kind, bounds), stability.grid.axes)
        handles = draw_solid(axes, quads, COLORS[kind], (lower, upper), exits)
        volume = stability.volume(kind, "corners", bounds)
        axes.set_title(
            f"{kind}, {words}\n{volume.value:.3g} m³, {100 * volume.share:.1f} %", fontsize=11,
            y=1.0, pad=0,
        )  # fmt: skip
    figure.legend(
        handles=handles, loc="outside lower center", ncols=2, title_fontsize=10,
        title="Solids are the cells between points of the grid with all eight corners inside; "
        "the figure of planes shows the cells around points.",
    )  # fmt: skip
    return figure


def curves(stability: Stability) -> dict[str, list[tuple[float, str]]]:
    """Per varied bound its values in ascending order [m or deg] with the names of the bounds."""
    points_of: dict[str, list[tuple[float, str]]] = {}
    base, *varied = stability.names
    for name in varied:
        parameter = name.partition("=")[0].removesuffix("_deg")
        points_of.setdefault(parameter, []).append((_value(stability, name, parameter), name))
    for parameter, points in points_of.items():
        points.append((_value(stability, base, parameter), base))
        # Where a value is that of the first bounds, one of the two is enough.
        points_of[parameter] = sorted({value: (value, name) for value, name in points}.values())
    return points_of


def curves_figure(stability: Stability) -> Figure:
    """Share of the grid's box in Z, SZ and S against each varied bound, the others as they are."""
    points_of = curves(stability)
    groups = {
        "m": [name for name in points_of if not name.startswith("d_theta")],
        "deg": [name for name in points_of if name.startswith("d_theta")],
    }
    groups = {unit: parameters for unit, parameters in groups.items() if parameters}
    title = _about(stability, "Size of the workspace against bounds of the perturbations")
    size = (6.5 * len(groups) + 0.5, 5.2)
    figure, grid = panels(len(groups), len(groups), size, title)
    for axes, (unit, parameters) in zip(grid, groups.items(), strict=True):
        for parameter in parameters:
            values, names = zip(*points_of[parameter], strict=True)
            look = look_of(parameter, list(points_of))  # few have colours far from each other
            for kind, line in LINES.items():
                shares = [100.0 * stability.volume(kind, "corners", name).share for name in names]
                style = {**line, "color": look.color, "marker": look.marker}
                axes.plot(values, shares, label=f"{kind}, {parameter} [{unit}]", **style)
        static = 100.0 * stability.volume("S", "corners").share
        axes.axhline(static, label="S, without perturbation", **line_style(IDEAL))
        what = parameters[0] if len(parameters) == 1 else "bound"
        axes.set(xlabel=f"{what} [{unit}]", ylim=(-3.0, 103.0))
        axes.set_ylabel("cells with all corners inside [% of the box]")
        axes.set_xlim(left=0.0)
        few_ticks(axes.xaxis)
        axes.legend()
    return figure


def _value(stability: Stability, name: str, parameter: str) -> float:
    value = float(stability.arguments["bounds"][name][parameter])
    return float(np.degrees(value)) if parameter.startswith("d_theta") else value


SCHEME_WORDS = {
    "pbvs": "pose-based visual servoing",
    "pbvs-line": "pose-based visual servoing, camera on a straight line",
    "2.5d": "2 1/2 D visual servoing",
    "ibvs": "image-based visual servoing",
}


def _about(stability: Stability, words: str, more: str = "") -> str:
    """Title: what is shown; robot, scheme, verdict, `more`; and the interaction matrix."""
    a, matrix = stability.arguments, stability.interaction_matrix
    scheme = SCHEME_WORDS.get(a["scheme"], a["scheme"])
    lines = [words, f"{a['robot']}, {scheme}, {a['verdict']} perturbations{more}"]
    lines.append(stability.geometry)
    # A terminal has no formulas, of which these are the letters.
    written = re.sub(r"\[(\w)_t\]x", r"$[\1_t]_\\times$", matrix).replace("L_s", "$L_s$")
    return "\n".join([*lines, written] if matrix else lines)


def _title(stability: Stability, words: str, bounds: str | None) -> str:
    turns = len(stability.grid.angles)
    name = f", bounds: {bounds or stability.names[0]}"
    more = name + (f", in all of {turns} orientations" if turns > 1 else "")
    return _about(stability, words, more)

"""Figures of the study: what poses withstand, shares against bounds, tightness against time."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.stability_bounds.questions import (
    COSTS,
    METHODS,
    SHARES,
    THESIS,
)
from cdpr_drake.analyses.visualization.figure_style import (
    few_ticks,
    line_style,
    new_figure,
    plain_numbers,
)
from cdpr_drake.arrays import Array
from cdpr_drake.palette import VERDICTS, Look, nth_look

LABELS = {
    "sampled": "sampled", "searched": "searched", "simulated": "simulated",
    "certified": "certified", "lipschitz": "Lipschitz", "interval": "intervals",
}  # fmt: skip

ROBOT_LABELS = {
    "planar": "planar", "acrobot_small": "ACROBOT, small", "caroca": "CAROCA",
    "acrobot_fully_constrained": "ACROBOT, fully constrained",
}  # fmt: skip

LOOKS: dict[str, Look] = {
    **VERDICTS, "simulated": nth_look(3), "lipschitz": nth_look(6), "interval": nth_look(5)
}  # fmt: skip

LETTERS = {"planar": "P", "acrobot_small": "S", "acrobot_fully_constrained": "F", "caroca": "C"}

EDGE = "#c00000"
"""Of what is stable under the thesis' bounds."""


def withstood(runs: Runs, robot: str, method: str) -> Array:
    """How many of the scales each pose withstands, from the least one on, shape (nx, ny, nz)."""
    masks = [run[f"inside_{method}"] for run in _by_scale(runs, robot)]
    return np.asarray(np.sum(np.cumprod(np.array(masks, int), axis=0), axis=0))


def _by_scale(runs: Runs, robot: str) -> list[Run]:
    return sorted(runs(experiment=SHARES, robot=robot), key=lambda run: float(run["scale"]))


def _scales(runs: Runs) -> list[float]:
    return sorted({float(run["scale"]) for run in runs(experiment=SHARES)})


def _words(scale: float) -> str:
    return f"{scale:g}" if scale >= 1.0 else f"1/{1.0 / scale:g}"


def maps_figure(runs: Runs) -> Figure:
    """Of every robot and method the largest bounds that each place of a plane withstands."""
    scales = _scales(runs)
    robots = [robot for robot, _ in runs(experiment=SHARES).by("robot")]
    figure, panels = new_figure(
        len(robots), len(METHODS), (2.05 * len(METHODS) + 0.6, 2.35 * len(robots) + 1.6),
        "Largest bounds on the model's errors under which the servo is stable, by method",
    )  # fmt: skip
    colors = ListedColormap(colormaps.get_cmap("YlGnBu")(np.linspace(0.02, 1.0, len(scales) + 1)))
    norm = BoundaryNorm(np.arange(-0.5, len(scales) + 1.5), colors.N)
    for row, robot in zip(np.atleast_2d(panels), robots, strict=True):
        first = _by_scale(runs, robot)[0]
        x, y, z = first["x_m"], first["y_m"], first["z_m"]
        plane = len(z) // 2
        for panel, method in zip(row, METHODS, strict=True):
            levels = withstood(runs, robot, method)[:, :, plane]
            panel.pcolormesh(x, y, levels.T, cmap=colors, norm=norm, shading="nearest")
            _outline(panel, x, y, levels > scales.index(THESIS))
            panel.set_aspect("equal")
            panel.set_title(_panel_words(runs, robot, method), fontsize=8)
            panel.tick_params(labelsize=7, labelleft=panel is row[0])
            panel.grid(visible=False)
            for axis in (panel.xaxis, panel.yaxis):
                few_ticks(axis, 4)
        where = "in its plane" if len(z) == 1 else f"z = {z[plane]:g} m"
        row[0].set_ylabel(f"{ROBOT_LABELS[robot]}\n{where}\ny [m]", fontsize=9)
    for panel in np.atleast_2d(panels)[-1]:
        panel.set_xlabel("x [m]", fontsize=9)
    bar = figure.colorbar(
        ScalarMappable(norm, colors), ax=panels, location="bottom", aspect=60, shrink=0.7,
        ticks=np.arange(len(scales) + 1),
    )  # fmt: skip
    bar.ax.set_xticklabels(["none", *map(_words, scales)])
    bar.set_label("bounds that are withstood, times D_b of the servoing thesis [-]", fontsize=9)
    edge = Line2D([], [], color=EDGE, linewidth=1.6, label="edge of what withstands D_b")
    figure.legend(
        handles=[edge], loc="outside lower center", fontsize=9, title_fontsize=9,
        title="over panels: share of the whole box that withstands D_b, processor time for a pose",
    )  # fmt: skip
    return figure


def _panel_words(runs: Runs, robot: str, method: str) -> str:
    """Method, share of the whole box at the thesis' bounds, processor time for a pose."""
    share = runs(experiment=SHARES, robot=robot, scale=THESIS).one()[f"{method}_percent"]
    words = f"{LABELS[method]}\n{share:.1f} %"
    try:
        seconds = runs(experiment=COSTS, robot=robot).one()["seconds"][method]
    except MissingRuns:
        return words
    return f"{words}, {1e3 * seconds:.2g} ms"


def _outline(panel: Axes, x: Array, y: Array, inside: np.ndarray) -> None:
    """Draws where a set of points of a grid ends inside the grid, halfway between neighbours."""
    xs, ys = (_edges(axis) for axis in (x, y))
    lines = []
    for i, j in np.argwhere(inside[1:] != inside[:-1]):
        lines.append([(xs[i + 1], ys[j]), (xs[i + 1], ys[j + 1])])
    for i, j in np.argwhere(inside[:, 1:] != inside[:, :-1]):
        lines.append([(xs[i], ys[j + 1]), (xs[i + 1], ys[j + 1])])
    panel.add_collection(LineCollection(lines, colors=EDGE, linewidths=1.6))


def _edges(axis: Array) -> Array:
    middle = (axis[1:] + axis[:-1]) / 2.0
    return np.concatenate([[2 * axis[0] - middle[0]], middle, [2 * axis[-1] - middle[-1]]])


def shares_figure(runs: Runs) -> Figure:
    """Of every robot the share of the box against the bounds, by method."""
    robots = [robot for robot, _ in runs(experiment=SHARES).by("robot")]
    figure, panels = new_figure(
        1, len(robots), (3.4 * len(robots), 3.9), "Share of the box that is stable, by method"
    )
    for panel, robot in zip(np.atleast_1d(panels), robots, strict=True):
        some = _by_scale(runs, robot)
        scales = [float(run["scale"]) for run in some]
        for method in METHODS:
            look = LOOKS[method]
            panel.plot(
                scales, [run[f"{method}_percent"] for run in some], **line_style(look),
                marker=look.marker, markersize=4.5, label=LABELS[method],
            )  # fmt: skip
        panel.axvline(THESIS, color="#808080", linewidth=0.8, zorder=0)
        panel.set_xscale("log", base=2)
        panel.set_xticks(scales, [_words(scale) for scale in scales])
        panel.set_ylim(-3.0, 103.0)
        panel.set_title(ROBOT_LABELS[robot], fontsize=10)
        panel.set_xlabel("bounds, times D_b [-]")
    axes = np.atleast_1d(panels)
    axes[0].set_ylabel("share of the box [%]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
    return figure


def tightness(runs: Runs, robot: str, method: str) -> float:
    """Median over poses of the largest bounds of a method as a share of those of the search.

    Of the poses that the search finds stable at the thesis' bounds; 0 where a method withstands
    none of the bounds at more than half of them.
    """
    scales = np.array([0.0, *_scales(runs)])
    searched = scales[withstood(runs, robot, "searched")]
    asked = searched >= THESIS
    if not np.any(asked):
        raise MissingRuns(f"a stable pose of {robot}")
    return float(np.median(scales[withstood(runs, robot, method)][asked] / searched[asked]))


LETTER_PLACES = 10.0, -10.0, 19.0, -19.0, 28.0, -28.0
"""How far above its symbol a letter may stand, where it is wanted most first [pt]."""

LETTER_APART = np.array([7.5, 8.5])
"""Across and up, so far are letters from each other and from symbols of others [pt]."""


def _letters_above(symbols: Array) -> list[float]:
    """How far above its symbol each letter stands, so that letters meet neither each other nor
    other symbols where there is room [pt]; symbols of shape (n, 2) [pt]."""
    letters: list[Array] = []
    for number, symbol in enumerate(symbols):
        others = np.delete(symbols, number, axis=0)
        others = others[np.any(others != symbol, axis=1)]  # one symbol may have many letters

        def met(above: float, symbol: Array = symbol, others: Array = others) -> int:
            away = np.abs(np.vstack([*letters, others]) - symbol - [0.0, above])
            near = np.all(away < LETTER_APART, axis=1)
            return int(10 * np.sum(near[: len(letters)]) + np.sum(near[len(letters) :]))

        letters.append(symbol + np.array([0.0, min(LETTER_PLACES, key=met)]))
    return [float(letter[1] - symbol[1]) for letter, symbol in zip(letters, symbols, strict=True)]


NOTHING = 1 / 128
"""Where the axis of tightness has its zero, below every quotient of two of the scales."""


def tightness_figure(runs: Runs) -> Figure:
    """How large errors are withstood, beside the search, against processor time."""
    figure, panel = new_figure(
        1, 1, (7.2, 4.8), "Tightness against processor time, under the bounds of the thesis"
    )
    robots = [robot for robot, _ in runs(experiment=COSTS).by("robot")]
    points: list[tuple[float, float, str]] = []
    for robot in robots:
        run = runs(experiment=COSTS, robot=robot).one()
        for method in METHODS:
            look, share = LOOKS[method], tightness(runs, robot, method)
            place = 1e3 * run["seconds"][method], share or NOTHING
            panel.plot(
                *place, look.marker, color=look.color, markersize=8, alpha=0.85,
                markerfacecolor=look.color if share else "none",
            )  # fmt: skip
            points.append((*place, LETTERS[robot]))
    panel.set_xscale("log")
    plain_numbers(panel.xaxis)
    panel.set_yscale("log", base=2)
    ticks = 2.0 ** np.arange(-6, 2)
    panel.set_yticks([NOTHING, *ticks], ["none", *map(_words, ticks)])
    panel.set_ylim(NOTHING / 1.8, 3.2)
    panel.set_xlabel("processor time for a pose [ms]", fontsize=10)
    panel.set_ylabel(
        "bounds withstood, as a share of\nthe search's, median over poses [-]", fontsize=10
    )
    handles = [
        Line2D([], [], color=LOOKS[method].color, linestyle="", marker=LOOKS[method].marker,
               label=LABELS[method])
        for method in METHODS
    ]  # fmt: skip
    letters = ", ".join(f"{LETTERS[robot]} {ROBOT_LABELS[robot]}" for robot in robots)
    figure.legend(handles=handles, loc="outside lower center", ncols=6, title=letters,
                  fontsize=9, title_fontsize=9)  # fmt: skip
    figure.draw_without_rendering()  # lays it out: letters need to know how far symbols are apart
    places = panel.transData.transform([(x, y) for x, y, _ in points]) * 72.0 / figure.dpi
    for (x, y, letter), above in zip(points, _letters_above(places), strict=True):
        panel.annotate(
            letter, (x, y), (0, above), ha="center", va="center",
            textcoords="offset points", fontsize=8,
        )  # fmt: skip
    return figure


FIGURES = {"maps": maps_figure, "shares": shares_figure, "tightness": tightness_figure}

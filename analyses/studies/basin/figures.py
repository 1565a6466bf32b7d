"""Figures of the study: from where loops converge, in planes and by the turn of their starts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.studies.basin.loops import CERTIFIED, CONVERGED, ENDS
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.visualization.figure_style import few_ticks, line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.palette import SHADED, VERDICTS, Look, nth_look

LABELS = {"pbvs": "PBVS", "2.5d": "2 1/2 D", "ibvs": "IBVS"}

LAYERS = 4
"""Heights are drawn in so many layers."""

LEAST_IN_CELL, MOST_CELLS = 6, 24
"""Cells along x and y are as many as leave so many loops in one on average, at most so many."""

HALF = 0.5
"""The outline goes round cells of whose starts at least this share converges."""

LEAST_IN_BIN, MOST_BINS = 10, 20
"""Of turns in a bin, and of bins."""

LEVEL = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
"""A pose without a turn, as that of the goal, as `pose_row`."""

LOOKS: dict[str, Look] = {CONVERGED: nth_look(7), **VERDICTS}
"""Of curves by what they count."""

OUTLINE = replace(LOOKS[CONVERGED], dash="-")
"""Of cells whose loops converge."""

EXCEPTIONS: dict[str, Any] = {
    "color": VERDICTS["searched"].color, "marker": "x", "s": 14.0, "linewidths": 1.0, "zorder": 3,
}  # fmt: skip
"""Look of certified starts whose loop does not converge."""


@dataclass(frozen=True, eq=False)
class _Loops:
    """Starts of loops, shape (n, 7), and what is so of each by name, shape (n,)."""

    poses: Array
    holds: dict[str, np.ndarray]


def _loops(runs: Runs) -> _Loops:
    ends = np.concatenate(runs.list("end"))
    holds = {CONVERGED: ends == ENDS.index(CONVERGED)}
    holds |= {name: np.concatenate(runs.list(f"is_{name}")).astype(bool) for name in VERDICTS}
    return _Loops(np.concatenate(runs.list("pose")).reshape(-1, 7), holds)


def basin_figure(runs: Runs) -> Figure:
    """Share of certified starts in cells of layers, where loops converge, and the exceptions."""
    schemes = {scheme: _loops(some) for scheme, some in runs.by("scheme")}
    if not any(len(loops.poses) for loops in schemes.values()):
        raise NothingToDraw("no loop was run")
    places = np.concatenate([loops.poses[:, 4:] for loops in schemes.values()])
    lower, upper = np.min(places, axis=0), np.max(places, axis=0)
    in_layer = len(places) / len(schemes) / LAYERS
    cells = int(np.clip(np.sqrt(in_layer / LEAST_IN_CELL), 2, MOST_CELLS))
    x, y = (np.linspace(lower[k], upper[k], cells + 1) for k in (0, 1))
    z = np.linspace(lower[2], upper[2], LAYERS + 1)
    figure, panels = new_figure(
        len(schemes), LAYERS, (2.6 * LAYERS + 1.0, 2.7 * len(schemes) + 1.6),
        "Certified starts of all turns that are held and see the tag, and where loops converge",
    )  # fmt: skip
    shades = colormaps.get_cmap("gray")
    for row, (scheme, loops) in zip(np.atleast_2d(panels), schemes.items(), strict=True):
        for k, panel in enumerate(row):
            height = loops.poses[:, 6]
            within = (height >= z[k]) & ((height < z[k + 1]) | (k == LAYERS - 1))
            counts = _counts(loops.poses[within], x, y)
            shares = {
                name: _share(loops.poses[within & loops.holds[name]], counts, x, y)
                for name in (CONVERGED, CERTIFIED)
            }
            panel.patch.set(facecolor=SHADED.color, hatch="///", edgecolor="0.5", linewidth=0.0)
            drawn = np.ma.masked_invalid(shares[CERTIFIED].T)
            panel.pcolormesh(x, y, drawn, cmap=shades, vmin=-0.5, vmax=1.0)
            _outline(panel, x, y, np.nan_to_num(shares[CONVERGED]) >= HALF)
            exceptions = within & loops.holds[CERTIFIED] & ~loops.holds[CONVERGED]
            panel.scatter(*loops.poses[exceptions, 4:6].T, **EXCEPTIONS)
            panel.set_aspect("equal")
            panel.grid(visible=False)
            panel.tick_params(labelsize=8, labelleft=k == 0)
            for axis in (panel.xaxis, panel.yaxis):
                few_ticks(axis, 4)
            if scheme == next(iter(schemes)):
                panel.set_title(f"z = {z[k]:.2f} to {z[k + 1]:.2f} m", fontsize=9)
        row[0].set_ylabel(f"{LABELS.get(scheme, scheme)}\ny in W [m]", fontsize=10)
    for panel in np.atleast_2d(panels)[-1]:
        panel.set_xlabel("x in W [m]", fontsize=10)
    bar = figure.colorbar(
        ScalarMappable(Normalize(-0.5, 1.0), shades), ax=panels, location="right", aspect=40,
        shrink=0.8, boundaries=np.linspace(0.0, 1.0, 101), ticks=np.linspace(0.0, 1.0, 6),
    )  # fmt: skip
    bar.set_label("share of a cell's starts that are certified [-]", fontsize=10)
    inside = f"inside: at least {100 * HALF:.0f} % of a cell's loops converge"
    handles = [
        Line2D([], [], label=inside, **_edge(OUTLINE)),
        Line2D(
            [], [], label="certified start whose loop does not converge", linestyle="",
            marker=EXCEPTIONS["marker"], color=EXCEPTIONS["color"],
        ),
    ]  # fmt: skip
    figure.legend(
        handles=handles, loc="outside lower center", ncols=2, fontsize=9, title_fontsize=9,
        title="hatched: no start there is held and sees the tag",
    )  # fmt: skip
    return figure


def _counts(poses: Array, x: Array, y: Array) -> Array:
    """Starts in each cell, from above."""
    return np.histogram2d(poses[:, 4], poses[:, 5], bins=[x, y])[0]


def _share(poses: Array, counts: Array, x: Array, y: Array) -> Array:
    """Of the loops of each cell, NaN where there is none."""
    some = _counts(poses, x, y)
    return np.asarray(np.divide(some, counts, out=np.full_like(some, np.nan), where=counts > 0))


def _edge(look: Look) -> dict[str, Any]:
    return {"color": look.color, "linestyle": look.dash, "linewidth": 2.0}


def _outline(panel: Axes, x: Array, y: Array, inside: np.ndarray) -> None:
    """Draws round cells."""
    padded = np.pad(inside, 1)
    lines = [
        [(x[i], y[j - 1]), (x[i], y[j])]
        for i, j in np.argwhere(padded[1:] != padded[:-1])
        if 0 < j <= len(y) - 1
    ]
    lines += [
        [(x[i - 1], y[j]), (x[i], y[j])]
        for i, j in np.argwhere(padded[:, 1:] != padded[:, :-1])
        if 0 < i <= len(x) - 1
    ]
    style = _edge(OUTLINE)
    panel.add_collection(
        LineCollection(
            lines, colors=[style["color"]], linestyles=[style["linestyle"]], linewidths=2.0,
            clip_on=False,
        )
    )  # fmt: skip


def turn_figure(runs: Runs) -> Figure:
    """Shares of starts over the angle by which they are turned from the goal."""
    schemes = {scheme: _loops(some) for scheme, some in runs.by("scheme")}
    figure, panels = new_figure(
        1, len(schemes), (4.2 * len(schemes), 4.2),
        "Starts that converge, and that verdicts find stable, over the angle of their turn",
    )  # fmt: skip
    for panel, (scheme, loops) in zip(np.ravel(panels), schemes.items(), strict=True):
        if not len(loops.poses):
            continue
        angle = np.degrees(
            pose_rows_distance(loops.poses, np.broadcast_to(LEVEL, loops.poses.shape))[1]
        )
        count = int(np.clip(len(angle) / LEAST_IN_BIN, 1, MOST_BINS))
        edges = np.quantile(angle, np.linspace(0.0, 1.0, count + 1))
        which = np.clip(np.searchsorted(edges, angle, side="right") - 1, 0, count - 1)
        middle = [float(np.mean(angle[which == k])) for k in range(count) if np.any(which == k)]
        for name, holds in loops.holds.items():
            shares = [
                100.0 * np.mean(holds[which == k]) for k in range(count) if np.any(which == k)
            ]
            look = LOOKS[name]
            panel.plot(
                middle, shares, label=name, marker=look.marker or "o", markersize=4,
                **line_style(look),
            )  # fmt: skip
        panel.set_title(LABELS.get(scheme, scheme))
        panel.set(xlabel="turn of the start from level, unturned [deg]", ylim=(-3.0, 103.0))
    np.ravel(panels)[0].set_ylabel("share of the loops [%]")
    np.ravel(panels)[0].legend(loc="lower left")
    return figure


FIGURES = {"basin": basin_figure, "turns": turn_figure}

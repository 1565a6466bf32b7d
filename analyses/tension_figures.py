"""Tensions of each method as bars, and the polygon of feasible tensions, as pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.palette import BOUND, MARKERS, PLATFORM, SOLID, look_of
from cdpr_drake.tensions.methods import METHODS, feasible_polygon, solution_space
from cdpr_drake.tensions.problem import TensionProblem, TensionSolution, TensionStatus

Leaving = tuple[float, int, float]
"""Where a line leaves along an edge, number of its cable from 1, and its bound [N]."""


def polygon_figure(
    problem: TensionProblem, solutions: Sequence[TensionSolution], title: str
) -> Figure:
    """The feasible polygon in the null space with a point for each solution.

    Args:
        problem: The problem.
        solutions: Its solutions; solutions without tensions are left out.
        title: Title.

    Raises:
        TensionProblemError: The redundancy is not 2, or the polygon is empty.

    Source: servoing thesis, figure 1.19.
    """
    vertices = feasible_polygon(problem)
    if vertices.shape[1] == 0:
        raise TensionProblemError("feasible polygon: found none to draw, the problem is infeasible")
    t, N = solution_space(problem)
    figure, axes = new_figure(1, 1, (10.5, 6.5), title)
    closed = np.column_stack([vertices, vertices[:, 0]])
    axes.fill(*vertices, color=PLATFORM.color, alpha=0.15, label="feasible")
    axes.plot(*closed, color=PLATFORM.color, linestyle=SOLID)
    solutions = [s for s in solutions if np.all(np.isfinite(s.tensions))]
    extent = float(np.max(np.ptp(vertices, axis=1)))
    markers = list(MARKERS)
    for eta, labels, filled in _places(solutions, N, extent):
        # A method keeps its look in all polygons; where several meet, the first one's look holds.
        # With more methods than markers some would look alike in grey print.
        look = look_of(labels[0].partition(" ")[0], list(METHODS))
        marker = look.marker if look.marker in markers or not markers else markers[0]
        markers = [other for other in markers if other != marker]
        axes.plot(
            *eta,
            marker,
            color=look.color,
            markersize=9,
            fillstyle="full" if filled else "none",
            label="\n".join(labels),
        )
    points = np.column_stack([vertices, *[(N.T @ s.tensions)[:, None] for s in solutions]])
    low, high = points.min(axis=1), points.max(axis=1)
    room = 0.12 * max(float(np.max(high - low)), 1e-9)
    axes.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room))
    _draw_bounds(axes, problem, t, N)
    axes.set(
        xlabel=r"$\eta_1$ [N], of tensions $t = t_0 + N \eta$ with $W N = 0$",
        ylabel=r"$\eta_2$ [N]", aspect="equal",
    )  # fmt: skip
    figure.legend(loc="outside right center")  # one of the axes would be cut at their aspect
    return figure


def _places(
    solutions: Sequence[TensionSolution], N: Array, extent: float
) -> list[tuple[Array, list[str], bool]]:
    """Points of the plane with the methods that meet there, and whether they are feasible."""
    places: list[tuple[Array, list[str], bool]] = []
    for solution in solutions:
        eta = N.T @ solution.tensions
        feasible = solution.status == TensionStatus.FEASIBLE
        label = solution.method + ("" if feasible else " (missed)")
        for place, labels, _ in places:
            if np.linalg.norm(place - eta) <= 1e-6 * max(extent, 1e-9):
                labels.append(label)
                break
        else:
            places.append((eta, [label], feasible))
    return places


def _draw_bounds(axes: Any, problem: TensionProblem, t: Array, N: Array) -> None:
    """Draws the lines on which a tension is at a bound, with the cable and the bound at their ends.

    The words stand at the right and at the top; lines that leave together share theirs.
    """
    ends: dict[int, list[Leaving]] = {0: [], 1: []}
    for bounds, style in ((problem.lower, "-"), (problem.upper, "--")):
        for i, bound in enumerate(bounds):
            line = _line_within(axes, N[i], bound - t[i])
            if line is None:
                continue
            axes.plot(*line.T, style, color="0.6", linewidth=0.8)
            right = abs(N[i, 1]) > abs(N[i, 0])  # it runs more along x than along y
            last = line[np.argmax(line[:, 0 if right else 1])]
            ends[0 if right else 1].append((float(last[1 if right else 0]), i + 1, float(bound)))
    for across, leaving in ends.items():
        low, high = axes.get_ylim() if across == 0 else axes.get_xlim()
        for group in _near(sorted(leaving), (0.06, 0.24)[across] * (high - low)):
            middle = (group[0][0] + group[-1][0]) / 2.0
            named: dict[float, list[int]] = {}
            for _, number, bound in group:
                named.setdefault(bound, []).append(number)
            words = "\n".join(
                f"cable{'s' * (len(numbers) > 1)} {', '.join(map(str, sorted(numbers)))} at "
                f"{bound:g} N"
                for bound, numbers in named.items()
            )
            place = (1.01, (middle - low) / (high - low))
            axes.text(
                *(place if across == 0 else place[::-1]), words, color="0.3", fontsize=9,
                transform=axes.transAxes, ha="left" if across == 0 else "center",
                va="center" if across == 0 else "bottom",
            )  # fmt: skip


def _line_within(axes: Any, normal: Array, offset: float) -> Array | None:
    """Where a line enters and leaves the axes, shape (2, 2); None where it does not."""
    (x_low, x_high), (y_low, y_high) = axes.get_xlim(), axes.get_ylim()
    (a, b), ends = normal, []
    for x in (x_low, x_high):
        if abs(b) > 1e-12 and y_low <= (offset - a * x) / b <= y_high:
            ends.append((x, (offset - a * x) / b))
    for y in (y_low, y_high):
        if abs(a) > 1e-12 and x_low <= (offset - b * y) / a <= x_high:
            ends.append(((offset - b * y) / a, y))
    return np.array(ends[:2]) if len(ends) >= 2 else None


def _near(
    places: list[tuple[float, int, float]], gap: float
) -> list[list[tuple[float, int, float]]]:
    """Places in a row, together where the first is no farther away than a gap."""
    groups: list[list[tuple[float, int, float]]] = []
    for place in places:
        if groups and place[0] - groups[-1][0][0] <= gap:
            groups[-1].append(place)
        else:
            groups.append([place])
    return groups


def tension_figure(
    names: Sequence[str],
    tensions: Mapping[str, Array],
    bounds: tuple[Array, Array],
    title: str,
) -> Figure:
    """Tensions of each cable as bars, by one method or several, with their bounds.

    Args:
        names: Of the cables.
        tensions: By the method, shape (m,) each [N]; NaN draws nothing.
        bounds: Smallest and largest, shape (m,) each [N].
        title: Title.
    """
    figure, axes = new_figure(1, 1, (10.0, 5.0), title)
    places, width = np.arange(len(names)), 0.8 / max(len(tensions), 1)
    for k, (method, values) in enumerate(tensions.items()):
        look = look_of(method, list(METHODS)) if len(tensions) > 1 else PLATFORM
        shift = (k - (len(tensions) - 1) / 2.0) * width
        axes.bar(places + shift, values, width, label=method, **bar_style(look))
    largest = max(float(np.max(t, where=np.isfinite(t), initial=0.0)) for t in tensions.values())
    if largest == 0.0:
        words = "no tensions hold the platform"
        axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center")
        largest = float("inf")
    for words, values in zip(("lower", "upper"), bounds, strict=True):
        if np.min(values) <= 2.0 * largest:
            same = f" {values[0]:g} N" if np.ptp(values) == 0.0 else ""
            edges = np.arange(len(names) + 1) - 0.5
            axes.stairs(
                values, edges, baseline=None, label=f"{words} bound{same}", **line_style(BOUND)
            )
    axes.set_ylim(bottom=0.0)
    axes.set_xticks(places, names)
    axes.set(ylabel="tension [N]")
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure

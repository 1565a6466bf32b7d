"""Tensions of each method as bars, and the polygon of feasible tensions, as pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import LEGEND_BESIDE, bars, line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.palette import BOUND, MARKERS, PLATFORM, SOLID, look_of
from cdpr_drake.tensions.methods import METHODS, feasible_polygon, solution_space
from cdpr_drake.tensions.problem import TensionProblem, TensionSolution, TensionStatus


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
    ends: dict[str, list[tuple[float, int, float]]] = {"right": [], "top": []}
    for bounds, style in ((problem.lower, "-"), (problem.upper, "--")):
        for i, bound in enumerate(bounds):
            line = _line_within(axes, N[i], bound - t[i])
            if line is not None:
                axes.plot(*line.T, style, color="0.6", linewidth=0.8)
                side, along = ("right", 0) if abs(N[i, 1]) > abs(N[i, 0]) else ("top", 1)
                end = line[np.argmax(line[:, along])]
                ends[side].append((float(end[1 - along]), i + 1, float(bound)))
    for side, gap, limits in (("right", 0.06, axes.get_ylim()), ("top", 0.24, axes.get_xlim())):
        low, high = limits
        groups: list[list[tuple[float, int, float]]] = []
        for end in sorted(ends[side]):
            if groups and end[0] - groups[-1][0][0] <= gap * (high - low):
                groups[-1].append(end)
            else:
                groups.append([end])
        for group in groups:
            numbers: dict[float, list[int]] = {}
            for _, number, bound in group:
                numbers.setdefault(bound, []).append(number)
            words = "\n".join(
                f"cable{'s' * (len(same) > 1)} {', '.join(map(str, sorted(same)))} at {bound:g} N"
                for bound, same in numbers.items()
            )
            middle = (0.5 * (group[0][0] + group[-1][0]) - low) / (high - low)
            at_right = side == "right"
            axes.text(
                *((1.01, middle) if at_right else (middle, 1.01)), words, color="0.3", fontsize=9,
                transform=axes.transAxes, ha="left" if at_right else "center",
                va="center" if at_right else "bottom",
            )  # fmt: skip


def _line_within(axes: Any, normal: Array, offset: float) -> Array | None:
    """Where the line normal @ x = offset enters and leaves the axes, shape (2, 2), or None."""
    (x_low, x_high), (y_low, y_high) = axes.get_xlim(), axes.get_ylim()
    (a, b), ends = normal, []
    for x in (x_low, x_high):
        if abs(b) > 1e-12 and y_low <= (offset - a * x) / b <= y_high:
            ends.append((x, (offset - a * x) / b))
    for y in (y_low, y_high):
        if abs(a) > 1e-12 and x_low <= (offset - b * y) / a <= x_high:
            ends.append(((offset - b * y) / a, y))
    return np.array(ends[:2]) if len(ends) >= 2 else None


def tension_figure(
    names: Sequence[str], tensions: Mapping[str, Array], bounds: tuple[Array, Array], title: str
) -> Figure:
    """Tensions of each cable as bars, by one method or several, with their bounds.

    Args:
        names: Of the cables.
        tensions: By the method, shape (m,) each [N]; NaN draws nothing.
        bounds: Smallest and largest, shape (m,) each [N].
        title: Title.
    """
    figure, axes = new_figure(1, 1, (10.0, 5.0), title)
    looks = [look_of(method, list(METHODS)) for method in tensions if len(tensions) > 1]
    bars(axes, names, tensions, looks or [PLATFORM])
    largest = max(float(np.max(t, where=np.isfinite(t), initial=0.0)) for t in tensions.values())
    if largest == 0.0:
        words = "no tensions hold the platform"
        axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center")
        largest = float("inf")
    edges = np.arange(len(names) + 1) - 0.5
    for words, values in zip(("lower", "upper"), bounds, strict=True):
        if np.min(values) <= 2.0 * largest:
            label = f"{words} bound" + (f" {values[0]:g} N" if np.ptp(values) == 0.0 else "")
            axes.stairs(values, edges, baseline=None, label=label, **line_style(BOUND))
    axes.set_ylim(bottom=0.0)
    axes.set(ylabel="tension [N]")
    axes.legend(**LEGEND_BESIDE)
    return figure

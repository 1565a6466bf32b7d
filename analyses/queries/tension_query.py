"""Tensions of a robot at one pose, by one method or all: numbers and a picture of the polygon."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.pictures import new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions import (
    METHODS,
    TensionProblem,
    TensionSolution,
    TensionStatus,
    distribute,
    feasible_polygon,
    solution_space,
)

_MARKERS = "osD^vP*X<>dphH8"


def applicable_methods(problem: TensionProblem) -> list[str]:
    """Names of the methods that take this redundancy, and a reference if they need one."""
    return [
        name
        for name, method in METHODS.items()
        if method.takes(problem.redundancy)
        and (problem.reference is not None or not method.needs_reference)
    ]


def solve_all(problem: TensionProblem) -> list[TensionSolution]:
    """The answer of every applicable method, in the order of `METHODS`."""
    return [distribute(problem, name) for name in applicable_methods(problem)]


def as_dict(solution: TensionSolution) -> dict[str, Any]:
    """A solution for JSON; tensions that are not there are null."""
    finite = np.all(np.isfinite(solution.tensions))
    return {
        "method": solution.method,
        "status": str(solution.status),
        "tensions_n": solution.tensions.tolist() if finite else None,
        "residual": solution.residual if finite else None,
        "active_bounds": solution.active.tolist(),
        "slack_wrench": solution.slack.tolist() if finite else None,
    }


def polygon_tensions(problem: TensionProblem) -> list[list[float]]:
    """Tensions at the corners of the feasible polygon, one list of m [N] per corner."""
    t, N = solution_space(problem)
    return (t[:, np.newaxis] + N @ feasible_polygon(problem)).T.tolist()


def polygon_figure(problem: TensionProblem, title: str) -> Figure:
    """The feasible polygon in the null space with the point of each method.

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
    axes.fill(*vertices, color="C0", alpha=0.15, label="feasible")
    axes.plot(*closed, color="C0")
    solutions = [s for s in solve_all(problem) if np.all(np.isfinite(s.tensions))]
    extent = float(np.max(np.ptp(vertices, axis=1)))
    for k, (eta, labels, filled) in enumerate(_places(solutions, N, extent)):
        axes.plot(
            *eta,
            _MARKERS[k % len(_MARKERS)],
            color=f"C{k % 10}",
            markersize=9,
            fillstyle="full" if filled else "none",
            label="\n".join(labels),
        )
    points = np.column_stack([vertices, *[(N.T @ s.tensions)[:, None] for s in solutions]])
    low, high = points.min(axis=1), points.max(axis=1)
    room = 0.12 * max(float(np.max(high - low)), 1e-9)
    axes.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room))
    _draw_bounds(axes, problem, t, N)
    axes.set(xlabel=r"$\eta_1$ [N]", ylabel=r"$\eta_2$ [N]", aspect="equal")
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _places(
    solutions: list[TensionSolution], N: Array, extent: float
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
    """The lines on which one tension is at a bound, with the cable's number where they leave."""
    x_low, x_high = axes.get_xlim()
    y_low, y_high = axes.get_ylim()
    for i in range(len(t)):
        for bound, style in ((problem.lower[i], "-"), (problem.upper[i], "--")):
            a, b, c = N[i, 0], N[i, 1], bound - t[i]
            ends = []
            for x in (x_low, x_high):
                if abs(b) > 1e-12 and y_low <= (c - a * x) / b <= y_high:
                    ends.append((x, (c - a * x) / b))
            for y in (y_low, y_high):
                if abs(a) > 1e-12 and x_low <= (c - b * y) / a <= x_high:
                    ends.append(((c - b * y) / a, y))
            if len(ends) >= 2:
                axes.plot(*np.array(ends[:2]).T, style, color="0.6", linewidth=0.8)
                word = f"cable {i + 1} at {bound:g} N"
                axes.annotate(word, ends[0], color="0.4", fontsize=9, clip_on=True)

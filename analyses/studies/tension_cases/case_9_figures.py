"""Figures 5.14 and 5.15 of the servoing thesis: final tensions in their polygon, residuals."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import lsq_linear
from scipy.sparse.csgraph import connected_components

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import Finding, statement
from cdpr_drake.analyses.studies.tension_cases.case_9_statements import (
    PUBLISHED_TENSIONS,
    THRESHOLD,
    final_tensions,
)
from cdpr_drake.analyses.studies.tension_cases.slack_experiments import CORRECTED, there
from cdpr_drake.analyses.visualization.figure_style import bar_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.palette import PLATFORM, PUBLISHED, SOLID, nth_look
from cdpr_drake.tensions.methods import distribute, feasible_polygon, solution_space
from cdpr_drake.tensions.problem import TensionProblem

ACCURACY = 0.3
"""Accuracy of the sensors by which figure 5.15 varies readings [N]."""

NEAR = 1.0
"""Names of points within this distance of each other would meet [N]."""

PAIR = 2
"""Names of so many points near each other have room on both sides."""

PRINTED_RESIDUALS = {
    "E1": 1.21, "E2": 0.68, "E3": 0.99, "E4": 0.88, "E5": 1.54, "E6": 0.96, "E7": 1.09,
    "E8": 1.63, "E9": 1.06, "E10": 1.02,
}  # fmt: skip
"""Servoing thesis, table 5.1 [N]."""

EXPERIMENTS = tuple(PRINTED_RESIDUALS)


def problem_at_end(runs: Runs) -> TensionProblem:
    """Holding the platform, above the threshold, where the first run of E2 ends.

    Raises:
        MissingRuns: E2 was not run.
    """
    row = runs(configuration="E2").rows[0]["X_WP"][-1]
    return _problem(row)


def _problem(row: Array) -> TensionProblem:
    """Holding the platform at a pose above the threshold; pulleys ignored, as in the thesis."""
    robot = load_robot("acrobot_large")
    return tension_problem(
        robot, pose_from_row(row), limits=(THRESHOLD, 60.0), cables=robot.cable_set(pulleys=False)
    )


def residual_range(problem: TensionProblem, tensions: Array, accuracy: float) -> Array:
    """Residual of tensions, and the least and the largest of all within an accuracy of them.

    The residual is the distance |t_pv + N eta - t| from the plane of the solutions. The least is a
    convex program over the box t +- accuracy; the largest is at one of its corners.

    Args:
        problem: At the pose.
        tensions: As measured, shape (m,) [N].
        accuracy: Half the box's edge [N].

    Returns:
        Shape (3,) [N].

    Source: servoing thesis (1.27), figure 5.15.
    """
    particular, N = solution_space(problem)
    off_plane = np.eye(len(tensions)) - N @ N.T
    here = off_plane @ (tensions - particular)
    box = lsq_linear(off_plane, -here, (-accuracy, accuracy))
    corners = accuracy * np.array(list(product((-1.0, 1.0), repeat=len(tensions))))
    most = np.max(np.linalg.norm(here + corners @ off_plane, axis=1))
    return np.array([np.linalg.norm(here), np.sqrt(2.0 * box.cost), most])


def _ranges(runs: Runs) -> dict[str, Array]:
    """Residuals and their ranges by experiment, means over the runs, shape (3,) [N]."""
    problem = {
        name: [_problem(run["X_WP"][-1]) for run in runs(configuration=name)]
        for name in there(runs, EXPERIMENTS)
    }
    return {
        name: np.mean(
            [
                residual_range(one, t, ACCURACY)
                for one, t in zip(problems, final_tensions(runs, name), strict=True)
            ],
            axis=0,
        )
        for name, problems in problem.items()
    }


@statement(
    "The sensors' accuracy of 0.3 N has a considerable effect on the residual.",
    "figure 5.15",
    rule="Considerable: what it can make of the residual spans more than the residual itself.",
)
def sensor_accuracy(runs: Runs) -> Finding:
    """How far the accuracy of the sensors decides on residuals."""
    found = _ranges(runs)
    wide = [most - least > here for here, least, most in found.values()]
    return Finding(
        found="; ".join(
            f"{name} {here:.2f} N, {least:.2f} to {most:.2f}"
            for name, (here, least, most) in found.items()
        ),
        held=wide,
    )


def polygon_figure(runs: Runs) -> Figure:
    """Figure 5.14: the feasible polygon at the end, tensions of each experiment in its plane."""
    problem = problem_at_end(runs)
    particular, N = solution_space(problem)
    vertices = feasible_polygon(problem)
    figure, axes = new_figure(
        1, 1, (11.0, 7.5), "Tensions at the end in their feasible polygon, as figure 5.14"
    )
    if vertices.shape[1]:
        closed = np.column_stack([vertices, vertices[:, 0]])
        axes.fill(*vertices, color=PLATFORM.color, alpha=0.15)
        axes.plot(
            *closed, color=PLATFORM.color, linestyle=SOLID, label=f"all above {THRESHOLD:g} N"
        )
        middle = N.T @ (distribute(problem, "barycenter").tensions - particular)
        axes.plot(*middle, "+", color=PLATFORM.color, markersize=16, label="barycenter")
    for number, name in enumerate(there(runs, EXPERIMENTS)):
        eta = N.T @ (final_tensions(runs, name).mean(axis=0) - particular)
        look = nth_look(number)
        corrected = name in CORRECTED
        axes.plot(
            *eta, look.marker, color=look.color, markersize=9, label=name,
            fillstyle="full" if corrected else "none", linestyle="",
        )  # fmt: skip
    printed = np.array([PUBLISHED_TENSIONS[int(name[1:])] for name in EXPERIMENTS])
    etas = (printed - particular) @ N
    axes.plot(
        *etas.T, PUBLISHED.marker, color=PUBLISHED.color, markersize=9, linestyle="",
        label="table 5.1",
    )  # fmt: skip
    _name_points(axes, etas, EXPERIMENTS)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(
        xlabel=r"$\eta_1$ [N]", ylabel=r"$\eta_2$ [N]",
        title="full: with correction; means over the runs; at the pose at which E2 ends",
    )  # fmt: skip
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _name_points(axes: Axes, points: Array, names: Sequence[str]) -> None:
    """Writes names beside points, shape (n, 2): of two near each other on both sides, of more than
    two in one line above them."""
    for members in _clusters(points):
        some = points[members]
        if len(members) > PAIR:
            words = ", ".join(names[k] for k in members)
            above = some.mean(axis=0)[0], some.max(axis=0)[1]
            axes.annotate(
                words, above, (0, 7), textcoords="offset points", ha="center", fontsize=8
            )  # fmt: skip
            continue
        for k in members:
            right = bool(points[k, 0] >= np.max(some[:, 0]))
            above_other = bool(points[k, 1] >= np.max(some[:, 1]))
            axes.annotate(
                names[k], points[k], (6 if right else -6, 2 if above_other else -2),
                textcoords="offset points", ha="left" if right else "right",
                va="bottom" if above_other else "top", fontsize=8,
            )  # fmt: skip


def _clusters(points: Array) -> list[list[int]]:
    """Numbers of points that are near each other, or near one that is, in ascending order."""
    near = np.linalg.norm(points[:, np.newaxis] - points, axis=2) < NEAR
    count, labels = connected_components(near, directed=False)
    return [np.flatnonzero(labels == one).tolist() for one in range(count)]


def residual_figure(runs: Runs) -> Figure:
    """Figure 5.15: residuals, and what the sensors' accuracy can make of them."""
    found = _ranges(runs)
    figure, axes = new_figure(
        1, 1, (10.0, 6.0), f"Part of the tensions that balances no weight; readings ±{ACCURACY:g} N"
    )
    for place, (name, (here, least, most)) in enumerate(found.items()):
        first = place == 0
        axes.bar(
            place, most - least, 0.6, bottom=least, **bar_style(nth_look(0)),
            label="lowest to highest" if first else None,
        )  # fmt: skip
        axes.plot([place - 0.3, place + 0.3], [here, here], color=nth_look(1).color,
                  linewidth=2.5, linestyle=SOLID,
                  label="as measured" if first else None)  # fmt: skip
        axes.plot(place, PRINTED_RESIDUALS[name], PUBLISHED.marker, color=PUBLISHED.color,
                  markersize=10, linestyle="", label="table 5.1" if first else None)  # fmt: skip
    axes.set_xticks(range(len(found)), list(found))
    axes.set(ylabel="residual [N]", ylim=(0.0, None))
    axes.grid(visible=False, axis="x")
    axes.legend(loc="best")
    return figure


DRAWINGS = {"polygon": polygon_figure, "residuals": residual_figure}
"""Figures of case study IX beside those of every case study."""

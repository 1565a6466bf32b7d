"""Study: what the theses show on an example: a trajectory, polygons of tensions, what they cost.

Source: Gazebo thesis 6.2, figures 6.2 to 6.7; servoing thesis 1.3.4, figure 1.19.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import product
from math import perm

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import draw_curve, new_figure, phase_of
from cdpr_drake.analyses.reporting.timing import interleaved, processor_seconds
from cdpr_drake.analyses.studies.rows import Row
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select
from cdpr_drake.analyses.studies.tension_trials import TRUTH, grid_problems
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.palette import PLATFORM, SOLID, nth_look
from cdpr_drake.tensions.methods import (
    distribute,
    distribute_batch,
    feasible_polygon,
    solution_space,
)
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

TRAJECTORY, METHODS = "trajectory", "methods on a grid"
"""Examples beside the poses of `POSES`."""

START, END = np.array([0.0, -2.0, 2.0]), np.array([3.0, 1.0, 3.0])
"""Gazebo thesis 6.2, at rest in both, platform unturned [m]."""

DURATION = 100.0
"""Gazebo thesis 6.2 [s]."""

TIMES = np.linspace(0.0, DURATION, 201)
"""Moments at which programs are compared [s]."""

MOTION = ("positions_m", "velocities_m_s", "accelerations_m_s2")
"""What a program gives of the trajectory, shape (n, 3) each."""

ROBOT = "acrobot_large"

POSES = {"homing": (0.0, 0.0, 0.15), "border": (0.35, -0.27, 0.45)}
"""Figure 1.19 a and b, platform unturned [m]."""

PRINTED = {
    "homing": (5.22, 5.46, 5.16, 5.41, 5.13, 5.39, 5.22, 5.46),
    "border": (2.08, 2.08, 2.43, 2.58, 3.74, 4.30, 12.76, 13.31),
}
"""Tensions by the barycenter method, servoing thesis 1.3.4 [N]."""

LEAST = 0.0
"""Lower limit of figure 1.17c, to which figure 1.19 refers [N]."""

SHOWN = ("barycenter", "median", "optimally_safe")
"""Methods whose points are drawn in the polygons."""

COMPARED = ("pseudo_inverse", "improved_closed_form", "median", "barycenter")
"""Methods that are run on the grid; the improved closed form is that of [Pot14], which the thesis
calls the median method."""

GRID, QUICK_GRID = (13, 13, 9), (4, 4, 3)
"""Poses on which methods are compared, along x, y and z."""

REPEATS, QUICK_REPEATS = 15, 3

TIMED = 4000
"""Poses of one timing at least; the same ones come again."""

OFF = 1e-6
"""Tensions balance the weight that leave no more of it, and keep limits that are no further beyond
[N, N m]."""


# The trajectory.


def by_class() -> tuple[Array, ...]:
    """`MOTION` by the class that moves simulated robots."""
    poses = tuple(pose_from_angles(place, np.zeros(3)) for place in (START, END))
    trajectory = PoseTrajectory(poses, (DURATION,))
    rows = np.array([trajectory.motion(float(time)) for time in TIMES])
    return rows[:, 4:7], rows[:, 10:13], rows[:, 16:19]


def by_conditions() -> tuple[Array, ...]:
    """By a second program: the six conditions (6.9) to (6.14) as equations in six coefficients."""

    def terms(time: float, order: int) -> list[float]:
        """Derivatives of t^0 to t^5."""
        return [perm(k, order) * time ** max(k - order, 0) for k in range(6)]

    rest = np.zeros(3)
    rows = [terms(time, order) for time in (0.0, DURATION) for order in range(3)]
    return motion_of(np.linalg.solve(rows, np.array([START, rest, rest, END, rest, rest])))


def by_printed_coefficients() -> tuple[Array, ...]:
    """By (6.16) to (6.21) as they are printed, for a motion from rest to rest."""
    way = END - START
    high = [factor * way / (2.0 * DURATION**k) for k, factor in ((3, 20.0), (4, 30.0), (5, 12.0))]
    return motion_of(np.array([START, np.zeros(3), np.zeros(3), *high]))


def motion_of(coefficients: Array) -> tuple[Array, ...]:
    """`MOTION` of polynomials with coefficients c_k of t^k, shape (6, 3)."""
    p = np.polynomial.polynomial
    derivatives = (p.polyder(coefficients, order) for order in range(3))
    return tuple(np.asarray(p.polyval(TIMES, c), np.float64).T for c in derivatives)


PROGRAMS = {
    "class": by_class, "conditions": by_conditions, "printed": by_printed_coefficients,
}  # fmt: skip
"""The trajectory by the class, by another program, by the coefficients that are printed."""


def end_error(motion: tuple[Array, ...]) -> float:
    """How far a motion is off (6.9) to (6.14), the largest of all [m, m/s, m/s^2]."""
    ends = np.array([x[[0, -1]] for x in motion])
    ends[0] -= START, END
    return float(np.max(np.abs(ends)))


def trajectory() -> Row:
    """The trajectory by each of `PROGRAMS`.

    Returns:
        end_error: by program, see `end_error`; difference_m, difference_m_s, difference_m_s2: the
        largest between the class and the second program; times_s, shape (n,); of each program its
        name with each of `MOTION`.
    """
    motions = {name: program() for name, program in PROGRAMS.items()}
    pairs = zip(motions["class"], motions["conditions"], strict=True)
    place, speed, acceleration = (float(np.max(np.abs(a - b))) for a, b in pairs)
    curves = {
        f"{name}_{quantity}": values
        for name, motion in motions.items()
        for quantity, values in zip(MOTION, motion, strict=True)
    }
    return {
        "end_error": {name: end_error(motion) for name, motion in motions.items()},
        "difference_m": place, "difference_m_s": speed, "difference_m_s2": acceleration,
        "times_s": TIMES, **curves,
    }  # fmt: skip


# Polygons.


def polygon(pose: str) -> Row:
    """The polygon of figure 1.19 at a pose of `POSES`.

    Returns:
        area_n2, in the plane of the orthonormal null space; vertices_n, shape (2, k); by each
        method of `SHOWN` its tensions_n, shape (m,), the same in the plane of the polygon, etas_n,
        shape (2,), and their least distance from a limit, margins_n; barycenter_n, by cable;
        unevenness, the largest distance of these from their mean, as a share of it.
    """
    robot = load_robot(ROBOT)
    X_WP = pose_from_angles(np.array(POSES[pose]), np.zeros(3))
    limits, cables = (LEAST, robot.tension_limits()[1]), robot.cable_set(pulleys=False)
    problem = tension_problem(robot, X_WP, limits=limits, cables=cables)
    tensions = {method: distribute(problem, method).tensions for method in SHOWN}
    _, N = solution_space(problem)
    x, y = vertices = feasible_polygon(problem)
    middle = tensions["barycenter"]
    return {
        "area_n2": 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))),
        "vertices_n": vertices,
        "tensions_n": {method: t.tolist() for method, t in tensions.items()},
        "etas_n": {method: (N.T @ t).tolist() for method, t in tensions.items()},
        "margins_n": {
            method: np.min(np.minimum(t - problem.lower, problem.upper - t))
            for method, t in tensions.items()
        },
        "barycenter_n": {f"C{k + 1}": float(t) for k, t in enumerate(middle)},
        "unevenness": float(np.max(np.abs(middle / np.mean(middle) - 1.0))),
    }


# Methods.


def held_problems(counts: tuple[int, int, int]) -> list[TensionProblem]:
    """Problems at those poses of a grid in the frame that can be held, by `TRUTH`.

    Args:
        counts: Positions along x, y and z.
    """
    robot = load_robot(ROBOT)
    limits = (LEAST, robot.tension_limits()[1])
    problems = grid_problems(robot, counts, [(0.0, 0.0, 0.0)], limits)
    return [p for p in problems if distribute(p, TRUTH).status == TensionStatus.FEASIBLE]


def methods(grid: tuple[int, int, int], repeats: int) -> Row:
    """Every method of `COMPARED` on the poses of a grid that can be held, timed in turns.

    Args:
        grid: Positions along x, y and z.
        repeats: Of the timing.

    Returns:
        poses: how many these are; by each method solved: where it says that its tensions hold the
        platform within the limits; wrong: of these, where limits or balance are broken,
        recomputed; pushing: where one of its tensions is negative; cost_us: processor time of one
        pose, on one core, the median of repeats.
    """
    problems = held_problems(grid)
    again = -(-TIMED // len(problems))
    W = np.tile(np.array([p.W for p in problems]), (again, 1, 1))
    w = np.tile(np.array([p.wrench for p in problems]), (again, 1))
    low, high = problems[0].lower, problems[0].upper

    works = [partial(distribute_batch, W, w, low, high, method, threads=1) for method in COMPARED]
    seconds = interleaved([partial(processor_seconds, work) for work in works], repeats)
    costs = dict(zip(COMPARED, (1e6 * time / len(W) for time in seconds), strict=True))
    found = []
    for method, problem in product(COMPARED, problems):
        solution = distribute(problem, method)
        t, solved = solution.tensions, solution.status == TensionStatus.FEASIBLE
        wrong, pushing = solved and not holds(problem, t), bool(np.any(t < 0.0))
        found.append({"method": method, "solved": solved, "wrong": wrong, "pushing": pushing})
    counts = Frame(found).groupby("method", sort=False).sum()
    return {"poses": len(problems), **counts.to_dict(), "cost_us": costs}


def holds(problem: TensionProblem, t: Array) -> bool:
    """True if tensions, shape (m,) [N], balance the weight within the limits."""
    low, high = t - problem.lower, problem.upper - t
    left = problem.W @ t + problem.wrench
    return bool(min(low.min(), high.min()) >= -OFF and np.max(np.abs(left)) <= OFF)


# Tables and figures.


def methods_table(rows: Frame) -> Frame:
    """Methods on the grid."""
    row = select(rows, example=METHODS).iloc[0]
    return Frame({
        "method": list(COMPARED), "poses": row["poses"], "solved": list(row["solved"].values()),
        "with a negative tension": list(row["pushing"].values()),
        "processor time [us]": list(row["cost_us"].values()),
    })  # fmt: skip


def trajectory_figure(rows: Frame) -> Figure:
    """Figures 6.2, 6.4, 6.6 of the Gazebo thesis beside 6.3, 6.5, 6.7."""
    curves = select(rows, example=TRAJECTORY)["arrays"].iloc[0]
    title = "Trajectory of the Gazebo thesis by two programs, figures 6.2 to 6.7"
    figure, axes = new_figure(3, 2, (12.0, 11.0), title)
    labels = {
        "desired position [m]": 1.0, "velocity [mm/s]": 1e3, "acceleration [mm/s²]": 1e3,
    }  # fmt: skip
    programs = {"class": "trajectory class", "conditions": "second program"}
    for column, (program, words) in enumerate(programs.items()):
        panels = zip(axes[:, column], MOTION, labels.items(), strict=True)
        for place, quantity, (label, factor) in panels:
            values = curves[f"{program}_{quantity}"]
            for k, name in enumerate("xyz"):
                draw_curve(
                    place, curves["times_s"], values[:, k], nth_look(k), name,
                    scale=factor, phase=phase_of(k, 3),
                )  # fmt: skip
            place.set_ylabel(label)
        axes[0, column].set_title(words)
        axes[2, column].set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def polygons_figure(rows: Frame) -> Figure:
    """Figure 1.19 of the servoing thesis: polygons at both poses, to the same scale."""
    polygons = {name: select(rows, example=name).iloc[0] for name in POSES}
    title = "ACROBOT's feasible tensions, as figure 1.19 of the servoing thesis"
    figure, panels = new_figure(1, 2, (13.0, 6.8), title)
    corners = {name: row["arrays"]["vertices_n"] for name, row in polygons.items()}
    half = 0.56 * max(float(np.max(np.ptp(vertices, axis=1))) for vertices in corners.values())
    for axes, (name, row) in zip(panels, polygons.items(), strict=True):
        vertices = corners[name]
        axes.fill(*vertices, color=PLATFORM.color, alpha=0.15)
        closed = np.column_stack([vertices, vertices[:, 0]])
        axes.plot(*closed, color=PLATFORM.color, linestyle=SOLID)
        for k, method in enumerate(SHOWN):
            look = nth_look(k)
            axes.plot(
                *row["etas_n"][method], look.marker, color=look.color, markersize=10,
                label=method.replace("_", " "),
            )  # fmt: skip
        x, y = (vertices.min(axis=1) + vertices.max(axis=1)) / 2.0
        axes.set(
            xlim=(x - half, x + half), ylim=(y - half, y + half),
            xlabel=r"$\eta_1$ [N]", ylabel=r"$\eta_2$ [N]",
        )  # fmt: skip
        axes.set_aspect("equal")
        place = ", ".join(f"{coordinate:g}" for coordinate in POSES[name])
        axes.set_title(f"{name}: ({place}) m, {row['area_n2']:.1f} N²")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


# The study.


def cases(form: Form) -> Iterator[Case]:
    """The trajectory, the poses, and the grid, on which methods are timed."""
    yield Case(keys={"example": TRAJECTORY}, call=partial(trajectory))
    for pose in POSES:
        yield Case(keys={"example": pose}, call=partial(polygon, pose))
    grid, repeats = (QUICK_GRID, QUICK_REPEATS) if form.quick else (GRID, REPEATS)
    yield Case(keys={"example": METHODS}, call=partial(methods, grid, repeats), alone=True)


STUDY = Study(
    name="worked-examples",
    title="What the theses show on an example: a trajectory, polygons of tensions, their cost",
    source="Gazebo thesis 6.2; servoing thesis 1.3.4",
    cases=cases,
    parameters=lambda form: {
        "start_m": START, "end_m": END, "duration_s": DURATION, "robot": ROBOT,
        "poses_m": POSES, "printed_n": PRINTED, "least_tension_n": LEAST,
        "grid": QUICK_GRID if form.quick else GRID,
    },
    tables={f"Methods at the poses of a grid that {ROBOT} can be held at": methods_table},
    figures={"trajectory": trajectory_figure, "feasible_polygons": polygons_figure},
)  # fmt: skip

"""Paths in space: with the whole robot, its platform and its frames, and close up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import bare_figure, line_style, shared_legend, styled
from cdpr_drake.arrays import Array
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.cables.models import KELVIN_VOIGT
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import DOTTED, OUTLINE, SOLID, Dash, Look, nth_look

MARKS = 6
"""Symbols on a path."""

NEAR = 2.0
"""The platform is drawn close up too where it is at most this times as large as the paths."""

TRIAD = 0.12
"""Length of the axes of a drawn frame, of the robot's longest edge."""


@dataclass(frozen=True)
class Path3D:
    """A path in W to draw: points of shape (n, 3) [m], its label and look; one point is a symbol.

    Long paths are thinned by their owner, see `path_rows`.
    """

    points: Array
    label: str
    look: Look


def path_figure(
    title: str, robot: Robot, cables: CableSet, log: Mapping[str, Array], paths: Sequence[Path3D]
) -> Figure:
    """Paths in 3D: with the whole robot and its platform at start and end, and close up.

    Args:
        title: Title.
        robot: The robot.
        cables: Its cables as they run, drawn where they are at the end.
        log: "X_WP", shape (n, 7), "slack", shape (n, m).
        paths: What to draw.
    """
    figure = bare_figure((13.0, 7.0), title)
    with styled():
        whole = figure.add_subplot(1, 2, 1, projection="3d")
        close = figure.add_subplot(1, 2, 2, projection="3d")
        for axes in (whole, close):
            for number, path in enumerate(paths):
                _draw_path(axes, path, (number + 0.5) / len(paths))
        X_start, X_end = pose_from_row(log["X_WP"][0]), pose_from_row(log["X_WP"][-1])
        _draw_cables(whole, cables, X_end, np.asarray(log["slack"][-1]))
        _draw_platform(whole, robot, X_start, DOTTED, "platform's body at the start")
        _draw_platform(whole, robot, X_end, SOLID, "platform's body at the end")
        size = TRIAD * float(np.max(robot.frame.upper - robot.frame.lower))
        _draw_triad(whole, RigidTransform(), size, "W")
        _draw_triad(whole, X_end, size, "P")
        set_box(whole, robot.frame.lower, robot.frame.upper)
        whole.set_title("whole robot, cables at the end (dotted: slack)", fontsize=11)
        points = np.vstack([path.points for path in paths])
        bodies = [X.multiply(edge).T for X in (X_start, X_end) for edge in platform_edges(robot)]
        if np.max(robot.platform.size) <= NEAR * np.max(np.ptp(points, axis=0)):
            # Else the paths would be too small beside it.
            points = np.vstack([points, *bodies])
            _draw_platform(close, robot, X_start, DOTTED, None)
            _draw_platform(close, robot, X_end, SOLID, None)
        points = points[np.all(np.isfinite(points), axis=1)]  # a diverged run has any numbers
        low, high = points.min(axis=0), points.max(axis=0)
        half = 0.55 * max(float(np.max(high - low)), 1e-3)
        set_box(close, (low + high) / 2.0 - half, (low + high) / 2.0 + half)
        close.set_title("the paths, close up", fontsize=11)
        shared_legend(figure, (close, whole), ncols=4)
    return figure


def poses_figure(
    title: str, robot: Robot, poses: Mapping[str, RigidTransform],
    slack: Sequence[np.ndarray] | None = None,
) -> Figure:  # fmt: skip
    """A robot with its platform at one pose or several, in 3D.

    Args:
        title: Title.
        robot: The robot.
        poses: X_WP by what they are [m]; each has a look of its own, cables of one pose theirs.
        slack: Which cables are slack at each, shape (m,); None: none.
    """
    figure = bare_figure((9.0, 7.0), title)
    with styled():
        axes = figure.add_subplot(projection="3d")
        cables = robot.cable_set()
        loose = slack or [np.zeros(cables.count)] * len(poses)
        for number, (words, X_WP) in enumerate(poses.items()):
            look = nth_look(number) if len(poses) > 1 else OUTLINE
            _draw_cables(axes, cables, X_WP, loose[number], look if len(poses) > 1 else None)
            _draw_platform(axes, robot, X_WP, look.dash, words, look.color)
        size = TRIAD * float(np.max(robot.frame.upper - robot.frame.lower))
        _draw_triad(axes, RigidTransform(), size, "W")
        ends = [X.multiply(cables.p_PB) for X in poses.values()]
        everything = np.hstack([cables.p_WA, *ends])
        lower = np.minimum(robot.frame.lower, everything.min(axis=1))
        upper = np.maximum(robot.frame.upper, everything.max(axis=1))
        thin = upper - lower < 0.05 * np.max(upper - lower)
        room = 0.5 * np.where(thin, 0.05 * np.max(upper - lower), 0.0)
        set_box(axes, lower - room, upper + room)
        figure.legend(loc="outside lower center", ncols=3)
    return figure


def set_box(axes: Any, lower: Array, upper: Array, zoom: float = 0.92) -> None:
    """Shows a box of the world frame W in its true proportions; corners of shape (3,) [m]."""
    for letter, low, high in zip("xyz", lower, upper, strict=True):
        axes.set(**{f"{letter}lim": (low, high), f"{letter}label": f"{letter} in W [m]"})
    axes.set_box_aspect(upper - lower, zoom=zoom)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        # The last number of one axis and the first of the next would stand in the same corner.
        axis.set_major_locator(MaxNLocator(4, prune="both"))
        axis.labelpad = 7.0
    axes.yaxis.labelpad = 10.0
    axes.zaxis.labelpad = 14.0  # its numbers stand beside the axis, where its label would be
    axes.tick_params(labelsize=9)
    axes.tick_params(axis="z", pad=5.0)


def _draw_path(axes: Any, path: Path3D, phase: float) -> None:
    style = line_style(path.look) | {"linewidth": 1.6, "marker": path.look.marker}
    count = len(path.points)
    if count > 1:
        lengths = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
        way = np.append(0.0, np.cumsum(lengths))
        wanted = (np.arange(MARKS) + phase) / MARKS * way[-1]
        marked = np.unique(np.clip(np.searchsorted(way, wanted), 0, count - 1)).tolist()
        style |= {"markevery": marked, "markersize": 5.0, "markerfacecolor": "white"}
    else:
        style |= {"linestyle": "none", "markersize": 9.0}
    axes.plot(*path.points.T, label=path.label, **style)


def _draw_cables(
    axes: Any, cables: CableSet, X_WP: RigidTransform, slack: np.ndarray, look: Look | None = None
) -> None:
    """Draws cables at a pose straight behind their pulleys, dotted where slack, in their looks."""
    straight = cable_curves(cables, KELVIN_VOIGT, X_WP, np.zeros(cables.count))
    for number, (curve, loose) in enumerate(zip(straight, slack, strict=True)):
        color, dash = (look or nth_look(number)).color, DOTTED if loose else SOLID
        axes.plot(*curve, color=color, linestyle=dash, linewidth=0.9)


def _draw_platform(
    axes: Any, robot: Robot, X_WP: RigidTransform, dash: Dash, label: str | None,
    color: str = OUTLINE.color,
) -> None:  # fmt: skip
    """The edges of the platform's box."""
    for number, edge in enumerate(platform_edges(robot)):
        once = label if number == 0 else None
        axes.plot(*X_WP.multiply(edge), color=color, linestyle=dash, linewidth=1.1, label=once)


def platform_edges(robot: Robot) -> list[Array]:
    """The twelve edges of the platform's box in P, shape (3, 2) each [m]."""
    middle, half = robot.box_center(), np.array(robot.platform.size, float) / 2.0
    corners = [middle + half * np.array(signs) for signs in product((-1.0, 1.0), repeat=3)]
    return [
        np.column_stack([a, b])
        for k, a in enumerate(corners)
        for b in corners[k + 1 :]
        if np.sum(~np.isclose(a, b)) == 1
    ]


def _draw_triad(axes: Any, X_WF: RigidTransform, size: float, name: str) -> None:
    """The axes of a frame with its name."""
    origin = X_WF.translation()
    for letter, column in zip("xyz", X_WF.rotation().matrix().T, strict=True):
        tip = origin + size * column
        axes.plot(*np.column_stack([origin, tip]), "k-", linewidth=1.4)
        axes.text(*(origin + 1.2 * size * column), letter, fontsize=8, ha="center", va="center")
    side = "top" if name == "W" else "bottom"  # so that frames at one place keep both names
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.75}
    axes.text(*origin, f"{name} ", fontsize=11, ha="right", va=side, bbox=box, zorder=10)

"""What wrong models of the cables do to the platform: its pose at rest, and which cables go slack.

A controller commands unstrained lengths for a wanted pose by the model that it believes in; the
platform comes to rest where the true cables let it. Winches count lengths from the home pose, where
they were set right, so that only differences from there are wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.figures import new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CATENARY, ELASTIC, INEXTENSIBLE
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.palette import ANGLE, DISTANCE, SOLID, nth_look
from cdpr_drake.statics.equilibrium import equilibrium_near

RIGID = 1e4
"""Factor on E S of a controller that believes in sagging cables that do not stretch."""


@dataclass(frozen=True)
class Belief:
    """A controller's model of the cables.

    Attributes:
        name: What it gets wrong, for tables.
        model: Name of its cable model.
        cables: Its constants.
    """

    name: str
    model: str
    cables: CableSet


def usual_beliefs(robot: Robot) -> list[Belief]:
    """One wrong thing each, and the straight inextensible cable that is usual in control."""
    true = robot.cable_set()
    return [
        Belief("no pulleys", CATENARY, true.without_pulleys()),
        Belief("no stretch", CATENARY, replace(true, stiffness=RIGID * true.stiffness)),
        Belief("no sag", ELASTIC, true),
        Belief("none of them", INEXTENSIBLE, true.without_pulleys()),
    ]


def wrong_geometry(robot: Robot, size: float, seed: int) -> Belief:
    """All models right, but exit and anchor points off by `size` [m] each, in random directions."""
    true, random = robot.cable_set(), np.random.default_rng(seed)

    def off(points: Array) -> Array:
        d = random.normal(size=points.shape)
        return points + size * d / np.linalg.norm(d, axis=0)

    name = f"points off by {1e3 * size:g} mm"
    return Belief(name, CATENARY, replace(true, p_WA=off(true.p_WA), p_PB=off(true.p_PB)))


def poses_in(robot: Robot, count: int, seed: int = 0) -> list[RigidTransform]:
    """Seeded poses in the middle half of the frame, a little turned."""
    random = np.random.default_rng(seed)
    lower, upper = np.array(robot.frame.lower), np.array(robot.frame.upper)
    middle, half = 0.5 * (lower + upper), 0.25 * (upper - lower)
    return [
        pose_from_angles(random.uniform(middle - half, middle + half), random.uniform(-0.1, 0.1, 3))
        for _ in range(count)
    ]


def commanded_lengths(
    robot: Robot, belief: Belief, poses: Sequence[RigidTransform], upset: Array | float = 0.0
) -> Array:
    """Unstrained lengths that a controller commands for poses, shape (k, m) [m].

    Args:
        robot: The robot; its own cables sag, stretch and run over its pulleys.
        belief: The controller's model.
        poses: Wanted poses.
        upset: What the lengths err by at home, shape (m,) [m].
    """
    home = robot.home.transform()
    right = hold_robot(robot, home, robot.cable_set(), CATENARY).unstrained_lengths
    at_home, *lengths = (
        hold_robot(robot, X_WP, belief.cables, belief.model).unstrained_lengths
        for X_WP in (home, *poses)
    )
    return right + upset + np.array(lengths) - at_home


def pose_errors(
    robot: Robot, beliefs: Sequence[Belief], poses: Sequence[RigidTransform]
) -> pd.DataFrame:
    """Errors of the pose at rest on the robot's own cables, which sag, stretch and have pulleys.

    Returns:
        A row for each belief and pose: `belief`, its name; `distance` [m] and `angle` [rad] from
        the wanted pose; `taut`, the number of cables that pull with more than their weight.
    """
    true, platform, rows = robot.cable_set(), rigid_platform(robot), []
    for belief in beliefs:
        for X_WP, l0 in zip(poses, commanded_lengths(robot, belief, poses), strict=True):
            rest = equilibrium_near(true, CATENARY, platform, l0, X_WP)
            distance, angle = pose_error(rest.X_WP, X_WP)
            rows.append((belief.name, distance, angle, int(np.sum(~rest.slack))))
    return pd.DataFrame(rows, columns=["belief", "distance", "angle", "taut"])


def errors_figure(errors: dict[str, pd.DataFrame]) -> Figure:
    """Median and largest error of position and rotation, by robot and belief."""
    size, title = (6.0 * len(errors), 8.0), "Pose errors at rest, by what the controller gets wrong"
    figure, panels = new_figure(2, len(errors), size, title)
    panels = np.reshape(panels, (2, -1))
    for column, (robot, rows) in enumerate(errors.items()):
        for row, (name, unit, factor, look) in enumerate(
            (("distance", "mm", 1e3, DISTANCE), ("angle", "deg", 180.0 / np.pi, ANGLE))
        ):
            values = factor * rows.groupby("belief", sort=False)[name].agg(["median", "max"])
            axes, places = panels[row, column], np.arange(len(values))
            axes.hlines(places, values["median"], values["max"], color=look.color, linewidth=3.0,
                        alpha=0.35)  # fmt: skip
            axes.plot(values["median"], places, "o", color=look.color, markersize=8, label="median")
            axes.plot(values["max"], places, "|", color=look.color, markersize=12, label="largest")
            axes.set_yticks(places, values.index)
            axes.invert_yaxis()
            axes.set(xlabel=f"{name} [{unit}]", xscale="log")
        panels[0, column].set_title(robot)
    panels[0, -1].legend()
    return figure


def slack_along_path(
    robot: Robot, start: Array, end: Array, count: int, upset: Array
) -> pd.DataFrame:
    """Rests an elastic robot along a straight path on lengths that are a little wrong.

    The controller believes in straight inextensible cables from fixed exit points; the robot's own
    are straight and elastic, over its pulleys. Each search starts at the pose before.

    Args:
        robot: The robot.
        start: Po where the path starts, shape (3,) [m].
        end: Po where it ends, shape (3,) [m].
        count: Number of poses.
        upset: What the lengths err by at home, shape (m,) [m].

    Returns:
        A row for each pose, by its share of the path: tensions by the names of cables [N], and
        `distance` from the wanted pose [m].
    """
    share = np.linspace(0.0, 1.0, count)
    poses = [pose_from_angles(start + s * (end - start), np.zeros(3)) for s in share]
    believed = Belief("", INEXTENSIBLE, robot.cable_set().without_pulleys())
    lengths = commanded_lengths(robot, believed, poses, upset)
    true, platform = robot.cable_set(), rigid_platform(robot)
    rows, guess = [], poses[0]
    for X_WP, l0 in zip(poses, lengths, strict=True):
        rest = equilibrium_near(true, ELASTIC, platform, l0, guess)
        guess = rest.X_WP
        rows.append((*rest.tensions, pose_error(rest.X_WP, X_WP)[0]))
    names = [cable.name for cable in robot.cables]
    return pd.DataFrame(rows, index=share, columns=[*names, "distance"])


def slack_figure(path: pd.DataFrame, title: str) -> Figure:
    """Which cables are taut along a path, and how far the platform is from it."""
    figure, (above, below) = new_figure(2, 1, (10.0, 7.0), title)
    taut = path.drop(columns="distance") > 0.0
    for i, name in enumerate(taut):
        above.plot(
            path.index, np.where(taut[name], float(i), np.nan), linewidth=6.0,
            color=nth_look(i).color, linestyle=SOLID, solid_capstyle="butt",
        )  # fmt: skip
        above.axhline(i, color="0.8", linewidth=0.8, zorder=0)
        above.text(1.01, i, name, va="center")
    rows = (taut.shape[1] - 0.5, -0.5)
    above.set(ylabel="taut cables [-]", yticks=[], xlim=(0.0, 1.0), ylim=rows)
    below.plot(path.index, 1e3 * path["distance"])
    below.set(xlabel="share of the path [-]", ylabel="distance from it [mm]", xlim=(0.0, 1.0))
    return figure

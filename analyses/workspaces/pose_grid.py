"""Grids of poses of a robot: of the words of a command line, and as JSON.

`Grid` and `Orientations` are types of arguments, of which `make_grid` makes a grid.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.words import numbers, words
from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError, WorkspaceGridError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.cable_interference import ONLY_GIVEN
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid, axis_by_count, axis_by_step

MOST_POSES = 10_000_000
"""Poses of the largest grid: its results are some 100 MB for each bounds, and take hours."""

MOST_TURNS = 10_000
"""Orientations of the largest grid."""

SAME_PLACE = 1e-9
"""Coordinates this near are the same [m]."""

Span: TypeAlias = int | Array | Sequence[float]
"""An axis: a number of points in the default box, or lower, upper, step [m]."""


def spans(word: str) -> list[Span]:
    """Axes of a grid of x,y,z, each a number of points or lower:upper:step."""
    axes: list[Span] = []
    for part in word.split(","):
        span = numbers(1, 3, by=":")(part)
        if len(span) == 1 and not float(span[0]).is_integer():
            raise ValueError(word)
        axes.append(int(span[0]) if len(span) == 1 else span)
    if len(axes) != 3:
        raise ValueError(word)
    return axes


def turns(word: str) -> Array:
    """Orientations of phi,theta,psi [deg], each a number or lower:upper:step, shape (k, 3)."""
    axes = []
    for part in word.split(","):
        span = numbers(1, 3, by=":")(part)
        if len(span) == 3:
            low, high, step = span
            if step <= 0.0 or high < low or (high - low) / step > MOST_TURNS:
                raise ValueError(word)
            span = axis_by_step(low, high, step)
        axes.append(span)
    if len(axes) != 3 or math.prod(map(len, axes)) > MOST_TURNS:
        raise ValueError(word)
    return np.array(list(product(*axes)))


Grid: TypeAlias = Annotated[
    WorkspaceGrid | Sequence[Span] | None,
    words(spans, "x,y,z, each a number of points or lower:upper:step [m], as in 33,33,12 or "
          "-0.4:0.4:0.1,-0.4:0.4:0.1,0:1:0.2", "X,Y,Z"),
]  # fmt: skip
Orientations: TypeAlias = Annotated[
    Sequence[Array | Sequence[float]],
    words(turns, "phi,theta,psi, each a number or lower:upper:step [deg], as in 0,0,-20:20:10; at "
          f"most {MOST_TURNS} orientations", "PHI,THETA,PSI", many=True),
]  # fmt: skip


def make_grid(
    robot: Robot, name: Robot | str | Path, grid: WorkspaceGrid | Sequence[Span] | None = None,
    orientation: Sequence[Array | Sequence[float]] = (), box: tuple[Array, Array] | None = None,
) -> WorkspaceGrid:  # fmt: skip
    """A grid of poses of a robot.

    An axis along which the platform does not move stays as it is.

    Args:
        robot: The robot.
        name: As `workspace_defaults`.
        grid: A grid; or axes x, y, z, see `Span`; None: the robot's default.
        orientation: Angles (phi, theta, psi), shape (3,) or (k, 3) each [deg]; none: unturned.
        box: Lower and upper corner of the default box, shape (3,) each [m]; None: the robot's.

    Raises:
        WorkspaceGridError: It has no points, too many, or makes no sense.
        StabilityError: It has no point in the robot's frame, or leaves a planar robot's plane.
    """
    if isinstance(grid, WorkspaceGrid):
        if len(orientation):
            raise WorkspaceGridError("orientation: found with a WorkspaceGrid; accepted: without")
        check_grid(robot, grid)
        return grid
    default = workspace_defaults(robot, name)
    lower, upper, step = default.lower, default.upper, default.step
    if box is not None:
        low, high = (np.asarray(corner, float) for corner in box)
        if low.shape != (3,) or high.shape != (3,) or not np.all(low < high):
            raise WorkspaceGridError("box: accepted: lower below upper corner, shape (3,) each [m]")
        free = lower < upper
        step = np.where(free, step * (high - low) / np.where(free, upper - lower, 1.0), step)
        lower, upper = np.where(free, low, lower), np.where(free, high, upper)
    defaults = list(zip(lower, upper, step, strict=True))
    axes: list[Span] = list(defaults) if grid is None else list(grid)
    if len(axes) != 3:
        raise WorkspaceGridError(
            f"grid: found {grid!r}; accepted: a WorkspaceGrid, or for each of x, y, z a number of "
            "points or (lower, upper, step)"
        )
    rows = [np.atleast_2d(np.asarray(angles, float)) for angles in orientation]
    angles = np.radians(np.vstack(rows)) if rows else np.zeros((1, 3))
    poses = math.prod(map(_count, "xyz", axes, defaults), start=float(len(angles)))
    if poses > MOST_POSES:  # which may not fit into memory
        raise WorkspaceGridError(f"grid: found {poses:.4g} poses; accepted: at most {MOST_POSES:g}")
    x, y, z = map(_axis, "xyz", axes, defaults)
    result = WorkspaceGrid((x, y, z), angles)
    check_grid(robot, result)
    return result


Default = tuple[float, float, float]
"""Lower, upper and step along an axis of the default grid [m]."""


def _count(name: str, span: Span, default: Default) -> float:
    """Points along an axis; 1 of a span that makes no sense, which `_axis` refuses."""
    if isinstance(span, int | np.integer):
        if default[0] == default[1] and span > 1:
            raise WorkspaceGridError(
                f"grid: found {span} points along {name}, where the default box is flat; "
                f"accepted: 1, at {name} = {default[0]:g} [m]"
            )
        return float(span)
    if np.shape(span) != (3,):
        raise WorkspaceGridError(
            f"grid: found {span!r} along {name}; accepted: a number of points, or lower, "
            "upper, step [m]"
        )
    low, high, step = map(float, span)
    sound = bool(np.all(np.isfinite([low, high, step]))) and step > 0.0 and high >= low
    return (high - low) / step + 1.0 if sound else 1.0


def _axis(name: str, span: Span, default: Default) -> Array:
    """Coordinates along an axis, shape (n,) [m]."""
    if isinstance(span, int | np.integer):
        return axis_by_count(default[0], default[1], int(span), name)
    low, high, step = map(float, span)
    return axis_by_step(low, high, step, name)


def grid_arguments(grid: WorkspaceGrid) -> dict[str, Any]:
    """A grid as one of the things that numbers depend on; values for `plain`."""
    return {
        "lower_m": grid.lower, "upper_m": grid.upper, "step_m": grid.steps,
        "points": list(grid.shape[1:]), "angles_rad": grid.angles,
    }  # fmt: skip


def plain(value: Any) -> Any:
    """A value of numbers, texts, arrays, poses, dataclasses and containers, as JSON has them."""
    if isinstance(value, RigidTransform):
        row = pose_row(value).tolist()
        return {"quaternion": row[:4], "position_m": row[4:]}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, CableSet):  # what neither Jacobian nor statics depend on is left out
        names = ["p_WA", "p_PB"]
        names += ["pulley_radius", "swivel_axis"] if value.has_pulleys() else []
        names += ["anchor_pulley_radius", "anchor_swivel_axis"] * value.has_platform_pulleys()
        names += ["arm"] if np.any(value.arm > 0.0) else []
        return {"kind": "CableSet", **{name: plain(getattr(value, name)) for name in names}}
    if is_dataclass(value):
        content = {
            field.name: plain(getattr(value, field.name)) for field in fields(value)
            if not field.metadata.get(ONLY_GIVEN, False) or getattr(value, field.name)
        }  # fmt: skip
        return {"kind": type(value).__name__, **content}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


def check_grid(robot: Robot, grid: WorkspaceGrid) -> None:
    """Checks that a grid has points in the robot's frame and, of a planar robot, lies in its plane.

    A grid may reach beyond the frame; a frame that was assumed when the robot was imported bounds
    none.

    Raises:
        StabilityError: It does not.
    """
    motion = robot.motion_type()
    lower, upper = robot.reach()
    for k in np.flatnonzero(lower == upper):
        name, along = "xyz"[k], grid.axes[k]
        if len(along) != 1 or abs(float(along[0]) - lower[k]) > SAME_PLACE:
            kind, place = ("planar", "plane") if motion.is_plane else (robot.motion, "line")
            raise StabilityError(
                f"grid: found {name} from {along[0]:g} to {along[-1]:g}; accepted for the {kind} "
                f"robot {robot.name}: its {place} {name} = {lower[k]:g} [m]"
            )
    if motion.num_turns == 1 and motion.rows is not None:
        still = [k for k in range(3) if k != motion.rows[0]]
        if np.any(grid.angles[:, still] != 0.0):
            names = " = ".join(("phi", "theta", "psi")[k] for k in still)
            raise StabilityError(
                "grid: found tilted orientations; accepted for the planar robot "
                f"{robot.name}: {names} = 0"
            )
    if robot.frame.assumed:
        return
    low, high = robot.frame.lower, robot.frame.upper
    for name, axis, least, most in zip("xyz", grid.axes, low, high, strict=True):
        if not np.any((axis >= least - SAME_PLACE) & (axis <= most + SAME_PLACE)):
            raise StabilityError(
                f"grid: found {name} from {axis[0]:g} to {axis[-1]:g} by which no point is inside "
                f"the frame of {robot.name}; accepted: points within "
                f"({', '.join(f'{value:g}' for value in low)}) to "
                f"({', '.join(f'{value:g}' for value in high)}) [m]"
            )

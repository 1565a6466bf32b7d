"""Grids of poses of a robot, and all that numbers depend on, as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.workspaces.cable_interference import ONLY_GIVEN
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid


def grid_arguments(grid: WorkspaceGrid) -> dict[str, Any]:
    """A grid as one of the things that numbers depend on; values for `plain`."""
    return {
        "lower_m": grid.lower,
        "upper_m": grid.upper,
        "step_m": grid.steps,
        "points": list(grid.shape[1:]),
        "angles_rad": grid.angles,
    }


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
        names = [
            "p_WA",
            "p_PB",
            *(["pulley_radius", "swivel_axis"] if value.has_pulleys() else []),
        ]
        if value.has_platform_pulleys():
            names += ["anchor_pulley_radius", "anchor_swivel_axis"]
        if np.any(value.arm > 0.0):
            names.append("arm")
        return {"kind": "CableSet", **{name: plain(getattr(value, name)) for name in names}}
    if is_dataclass(value):
        found = {
            field.name: plain(getattr(value, field.name))
            for field in fields(value)
            if not field.metadata.get(ONLY_GIVEN, False) or getattr(value, field.name)
        }
        return {"kind": type(value).__name__, **found}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


def check_grid(robot: Robot, grid: WorkspaceGrid) -> None:
    """Checks that a grid has points in the robot's frame and, of a planar robot, lies in its plane.

    A frame that was assumed when the robot was imported bounds no grid.

    Raises:
        StabilityError: It does not.
    """
    _check_planar(robot, grid)
    if not robot.frame.assumed:
        _check_frame(robot, grid)


def _check_planar(robot: Robot, grid: WorkspaceGrid) -> None:
    motion = robot.motion_type()
    lower, upper = robot.reach()
    for k in np.flatnonzero(lower == upper):
        name, along = "xyz"[k], grid.axes[k]
        if len(along) != 1 or abs(float(along[0]) - lower[k]) > 1e-9:
            kind, place = ("planar", "plane") if motion.is_plane else (robot.motion, "line")
            raise StabilityError(
                f"grid: found {name} from {along[0]:g} to {along[-1]:g}; accepted for the {kind} "
                f"{robot.name}: its {place} {name} = {lower[k]:g} [m]"
            )
    if motion.num_turns != 1 or motion.rows is None:
        return
    still = [k for k in range(3) if k != motion.rows[0]]
    if np.any(grid.angles[:, still] != 0.0):
        names = " = ".join(("phi", "theta", "psi")[k] for k in still)
        raise StabilityError(
            f"grid: found tilted orientations; accepted for the planar {robot.name}: {names} = 0"
        )


def _check_frame(robot: Robot, grid: WorkspaceGrid) -> None:
    """A grid may reach beyond the frame, but has to have points inside it."""
    lower, upper = robot.frame.lower, robot.frame.upper
    for number, (name, axis) in enumerate(zip("xyz", grid.axes, strict=True)):
        inside = (axis >= lower[number] - 1e-9) & (axis <= upper[number] + 1e-9)
        if not np.any(inside):
            corners = [", ".join(f"{value:g}" for value in corner) for corner in (lower, upper)]
            raise StabilityError(
                f"grid: found {name} from {axis[0]:g} to {axis[-1]:g} by which no point is inside "
                f"the frame of {robot.name}; accepted: points within ({corners[0]}) to "
                f"({corners[1]}) [m]"
            )

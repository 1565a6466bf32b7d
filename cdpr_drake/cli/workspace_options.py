"""Options of `cdpr workspace` that are more than a number."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.workspaces import load_wrench_set
from cdpr_drake.cli.options import parse_numbers
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.workspaces import SpatialSet


def parse_required(
    file: Path | None, force: float | None, moment: float | None
) -> SpatialSet | None:
    """The wrenches of --wrench-set, or of --force and --moment; None without.

    Raises:
        CdprError: Both are given, or they are not accepted.
    """
    if file is not None:
        if force is not None or moment is not None:
            raise WorkspaceError("--wrench-set: found --force or --moment too; accepted: one way")
        return load_wrench_set(file)
    if force is None and moment is None:
        return None
    for name, value in (("--force", force), ("--moment", moment)):
        if value is not None and not (math.isfinite(value) and value >= 0.0):
            raise WorkspaceError(f"{name}: found {value:g}; accepted: a finite number >= 0")
    return SpatialSet(box=np.array([*[moment or 0.0] * 3, *[force or 0.0] * 3]))


def parse_accelerations(words: str | None) -> SpatialSet | None:
    """The box of --acceleration; None without; raises as `parse_numbers`."""
    if words is None:
        return None
    meaning = "a or a,alpha, each >= 0 [m/s^2, rad/s^2]"
    numbers = parse_numbers("--acceleration", words, (1, 2), meaning)
    if min(numbers) < 0.0:
        raise WorkspaceError(f"--acceleration: found {words!r}; accepted: {meaning}")
    linear, angular = (*numbers, 0.0)[:2]
    return SpatialSet(box=np.array([*[angular] * 3, *[linear] * 3]))


def parse_velocities(items: list[str]) -> np.ndarray | None:
    """Velocities of --velocity, shape (k, 6); None without; raises as `parse_numbers`."""
    if not items:
        return None
    turns = [parse_numbers("--velocity", one, (3,), "wx,wy,wz [rad/s]") for one in items]
    return np.array([[*one, 0.0, 0.0, 0.0] for one in turns])

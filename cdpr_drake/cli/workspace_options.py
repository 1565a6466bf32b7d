"""Options of `cdpr workspace` that are more than a number."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.workspaces import load_wrench_set
from cdpr_drake.cli.options import parse_numbers
from cdpr_drake.errors import WorkspaceError
from cdpr_drake.workspaces import SpatialSet

FARTHEST = 1e6
"""Largest coordinate of a corner of --box [m]."""


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


def parse_box(words: str | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Corners of --box, shape (3,) each [m]; None without.

    Raises:
        WorkspaceError: They are not six numbers up to `FARTHEST`, or a lower one is not below its
            upper one.
    """
    if words is None:
        return None
    try:
        spans = [[float(word) for word in part.split(":")] for part in words.split(",")]
    except ValueError:
        spans = []
    good = len(spans) == 3 and all(
        len(span) == 2 and -FARTHEST <= span[0] < span[1] <= FARTHEST for span in spans
    )
    if not good:
        raise WorkspaceError(
            f"--box: found {words!r}; accepted: lower:upper along x, y and z [m], as in "
            f"-0.4:0.4,-0.4:0.4,0:1; no number beyond {FARTHEST:g}"
        )
    lower, upper = np.array(spans).T
    return lower, upper


def grid_box(
    lower: np.ndarray, upper: np.ndarray, step: np.ndarray,
    region: tuple[np.ndarray, np.ndarray] | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Corners and step of the default grid, with as many points in a region in its place [m].

    An axis along which the platform does not move stays as it is.
    """
    if region is None:
        return lower, upper, step
    free = lower < upper
    by = np.where(free, step * (region[1] - region[0]) / np.where(free, upper - lower, 1.0), step)
    return np.where(free, region[0], lower), np.where(free, region[1], upper), by


def parse_velocities(items: list[str]) -> np.ndarray | None:
    """Velocities of --velocity, shape (k, 6); None without; raises as `parse_numbers`."""
    if not items:
        return None
    turns = [parse_numbers("--velocity", one, (3,), "wx,wy,wz [rad/s]") for one in items]
    return np.array([[*one, 0.0, 0.0, 0.0] for one in turns])

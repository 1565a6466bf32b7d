"""Paths as users write them: tables of poses, and G-code."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.g_code import parse_g_code
from cdpr_drake.errors import DataFileError, PlanningError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.trajectories.curved_path import STRAIGHT, Move

COLUMNS = ("x", "y", "z", "phi", "theta", "psi")
"""Of a table: position in W [m], and angles, R = Rx(phi) Ry(theta) Rz(psi) [deg]."""

G_CODE = (".gcode", ".nc", ".ngc", ".tap")  # endings of G-code


@dataclass(frozen=True)
class PathPoses:
    """Poses of a path.

    Attributes:
        poses: X_WP, one after the other [m].
        source: What the path is, in words.
        remarks: What was left out of a file, a line each.
        moves: How it goes from each pose to the next: lines, arcs, feeds; none: not said.
    """

    poses: list[RigidTransform]
    source: str
    remarks: tuple[str, ...] = ()
    moves: tuple[Move, ...] = ()


def path_poses(robot: Robot, path: Path | str | Sequence[object]) -> PathPoses:
    """Poses of a path of a robot.

    Args:
        robot: The robot.
        path: A file, .csv of x,y,z[,phi,theta,psi] [m, deg] or G-code; or at least two poses, each
            as `as_pose` takes it [m].

    Raises:
        DataFileError: The file cannot be read, or a line is not accepted.
        PlanningError: There are fewer than two poses.
    """
    if isinstance(path, str | Path):
        return read_path(Path(path), robot.plane_height)
    poses = [as_pose(robot, pose) for pose in path]
    if len(poses) < 2:
        raise PlanningError(f"path: found {len(poses)} poses; accepted: at least 2")
    return PathPoses(poses, f"{len(poses)} waypoints")


def read_path(path: Path, height: float | None = None) -> PathPoses:
    """Reads poses from a table (.csv) or from G-code (see `g_code`).

    Args:
        path: The file.
        height: z where a file of G-code gives none [m]; None: it must.

    Raises:
        DataFileError: It cannot be read, or a line is not accepted; names the line.
    """
    ending = path.suffix.lower()
    if ending != ".csv" and ending not in G_CODE:
        raise DataFileError(
            f"{path}: found the ending {ending!r}; accepted: .csv, {', '.join(G_CODE)}"
        )
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of a path")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise DataFileError(f"{path}: cannot be read as text: {problem}") from problem
    if ending == ".csv":
        result = PathPoses([_pose(row) for row in _table_rows(path, lines)], path.name)
    else:
        code = parse_g_code(path, lines, height)
        plain = all(move.arc is None and move.speed == STRAIGHT.speed for move in code.moves)
        moves = () if plain else tuple(code.moves)
        result = PathPoses([_pose(place) for place in code.places], path.name, code.remarks, moves)
    if len(result.poses) < 2:
        raise DataFileError(f"{path}: found {len(result.poses)} poses; accepted: at least 2")
    return result


def _table_rows(path: Path, lines: list[str]) -> list[list[float]]:
    """Rows of `COLUMNS`, or of the first three; a head with these names may stand above them."""
    rows: list[list[float]] = []
    size = 0
    reader = csv.reader(lines)
    try:
        for number, row in enumerate(reader, 1):
            words = [word.strip() for word in row]
            if not any(words) or words[0].startswith("#"):
                continue
            if not size and words[0].isidentifier():
                size = len(words)
                if tuple(map(str.lower, words)) not in (COLUMNS[:3], COLUMNS):
                    raise DataFileError(
                        f"{path}: line {number}: found the columns {', '.join(words)[:80]}; "
                        f"accepted: {', '.join(COLUMNS[:3])} [m], or {', '.join(COLUMNS)} [m, deg]"
                    )
                continue
            accepted = (size,) if size else (3, 6)
            values = [_number(word) for word in words]
            if len(values) not in accepted or not np.all(np.isfinite(values)):
                raise DataFileError(
                    f"{path}: line {number}: found {','.join(words)[:80]!r}; accepted: "
                    f"{' or '.join(map(str, accepted))} finite numbers, x,y,z [m] and "
                    "phi,theta,psi [deg]"
                )
            size = len(values)
            rows.append(values)
    except csv.Error as problem:
        raise DataFileError(f"{path}: line {reader.line_num}: {problem}") from problem
    return rows


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return np.nan


def _pose(values: Sequence[float]) -> RigidTransform:
    return pose_from_angles(np.array(values[:3]), np.radians(values[3:] or [0.0] * 3))

"""Logs of measurements for a calibration: text with columns, as tools of all kinds write it.

A row is a pose of the platform. Headers name what a column is and may end in a unit; see
`columns`. An empty cell was not measured; NaN and words that are no numbers are refused. A file of
numbers without a header has m lengths, or m lengths and m swivel angles, as GRAB's tools write.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from cdpr_drake.analyses.calibration.columns import (
    ANGLES,
    CORNERS,
    LENGTHS,
    POSITION,
    QUATERNION,
    RPY,
    SWIVELS,
    TAIT,
    TENSIONS,
    TIME,
    TORQUES,
    TURN,
    Column,
    first_number,
    preference,
    read_header,
)
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CalibrationError, why_not_read
from cdpr_drake.geometry.poses import rotation_from_angles, rotation_from_vector
from cdpr_drake.schema.fields import LARGEST
from cdpr_drake.schema.input_files import file_size

ROTATIONS = (QUATERNION, TAIT, TURN, RPY)
"""Columns that a rotation may stand in."""

ParsedColumns = dict[str, dict[int | tuple[int, int, int], Array]]
"""Columns in SI units, by what they hold and by cable, part or corner."""

MOST_BYTES = 200_000_000

MOST_ROWS = 20_000
"""Rows of a log that are read; more are of a motion that was sampled fast, and tell no more."""


@dataclass(frozen=True, eq=False)
class CalibrationLog:
    """What was measured, by rows.

    Attributes:
        path: The file.
        count: Rows k.
        time: Shape (k,) [s]; None where there is none.
        lengths: Shape (k, m) [m], NaN where not measured; None where there are none at all.
        angles: Motor angles, shape (k, m) [rad]; None.
        swivels: Shape (k, m) [rad]; None.
        tensions: Shape (k, m) [N]; None.
        torques: Of the motors, positive pays out, shape (k, m) [N m]; None.
        tilts: Roll, pitch and yaw by an inclinometer or IMU, where no position stands beside them,
            shape (k, 3) [rad], NaN where not measured; None.
        headers: Columns by what is in them, as the file names them: `LENGTHS` and the like.
        poses: X_WP of a tracker, None in rows without; None.
        points: Positions of a tracker that tells no rotation, shape (k, 3) [m], NaN in rows
            without, and in coordinates that the file does not have; None.
        corners: By tag, images of its corners, shape (k, 4, 2) [px].
        remarks: What was left out, in words.
    """

    path: Path
    count: int
    time: Array | None = None
    lengths: Array | None = None
    angles: Array | None = None
    swivels: Array | None = None
    tensions: Array | None = None
    poses: list[RigidTransform | None] | None = None
    corners: dict[int, Array] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    torques: Array | None = None
    tilts: Array | None = None
    headers: dict[str, tuple[str, ...]] = field(default_factory=dict)
    points: Array | None = None

    def only(self, rows: npt.NDArray[np.intp]) -> CalibrationLog:
        """Some of the rows, numbers from 0 that grow."""
        arrays = ("time", "lengths", "angles", "swivels", "tensions", "torques", "tilts", "points")
        parts: dict[str, Any] = {
            name: value[rows] for name in arrays if (value := getattr(self, name)) is not None
        }
        poses = None if self.poses is None else [self.poses[k] for k in rows]
        corners = {tag: uv[rows] for tag, uv in self.corners.items()}
        return replace(self, count=len(rows), poses=poses, corners=corners, **parts)


def read_log(path: Path, cables: Sequence[str]) -> CalibrationLog:
    """Reads a log for a robot with these cables.

    Args:
        path: Text; columns separated by commas, semicolons, tabs or blanks, # begins a comment.
        cables: Names of the cables.

    Raises:
        CalibrationError: The file cannot be read, is empty, or a cell is no number up to
            `LARGEST`; names the line and the column.
    """
    rows, lines = split_cells(path)
    if _is_number(rows[0][0]) and all(_is_number(cell) for cell in rows[0] if cell):
        return _headless(path, rows, lines, cables)
    headers, rows, lines = rows[0], rows[1:], lines[1:]
    if not rows:
        raise CalibrationError(f"{path}: found a header without rows; accepted: at least one row")
    first = first_number(headers, len(cables))
    columns = [read_header(header, cables, first) for header in headers]
    if not any(columns):
        raise CalibrationError(
            f"{path}: columns: found {', '.join(headers)[:120]}; accepted: C1_length_m, x_m, qw, "
            "C1_tension_n, C1_swivel_rad, tag0_u1_px and the like, with names or numbers of cables"
        )
    table = parse_numbers(path, headers, rows, lines, columns)
    _keep_preferred(path, headers, columns)
    found: ParsedColumns = {}
    for j, column in enumerate(columns):
        if column is not None:
            found.setdefault(column.what, {})[column.key] = table[:, j] * column.factor
    unread = [header for header, column in zip(headers, columns, strict=True) if column is None]
    remarks = (f"columns not read: {', '.join(unread)}",) if unread else ()
    read: dict[str, tuple[str, ...]] = {}
    for header, column in zip(headers, columns, strict=True):
        if column is not None:
            read[column.what] = (*read.get(column.what, ()), header)
    log = _assembled(path, found, len(rows), len(cables), remarks)
    return replace(log, headers=read)


def _keep_preferred(path: Path, headers: Sequence[str], columns: list[Column | None]) -> None:
    """Takes out columns of what another one tells better.

    Raises:
        CalibrationError: Two of one thing are as good as each other.
    """
    best: dict[tuple[object, ...], int] = {}
    for j, column in enumerate(columns):
        if column is None:
            continue
        what = (column.what, column.key)
        other = best.setdefault(what, j)
        if other == j:
            continue
        here, there = preference(headers[j]), preference(headers[other])
        if here == there:
            raise CalibrationError(
                f"{path}: column {headers[j]!r}: found {column.what} of it twice; accepted: "
                "each once"
            )
        if here > there:
            best[what] = j
        columns[other if here > there else j] = None


def split_cells(path: Path) -> tuple[list[list[str]], list[int]]:
    """Cells of all rows, and the lines that they stand in."""
    try:
        if file_size(path) > MOST_BYTES:
            raise CalibrationError(f"{path}: found more than {MOST_BYTES:,} bytes; accepted: fewer")
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as problem:
        raise CalibrationError(f"{path}: cannot be read: {why_not_read(problem)}") from problem
    kept = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not kept:
        raise CalibrationError(f"{path}: found an empty log; accepted: rows of measurements")
    if len(kept) > MOST_ROWS + 1:
        raise CalibrationError(
            f"{path}: found {len(kept)} rows; accepted: at most {MOST_ROWS}, such as every tenth"
        )
    first = kept[0][1]
    mark = next((one for one in (";", "\t", ",") if one in first), None)
    lines = [line.replace(",", ".") if mark == ";" else line for _, line in kept]
    if mark is None:
        cells = [line.split() for line in lines]
    else:
        try:
            cells = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)]
        except csv.Error as problem:
            raise CalibrationError(f"{path}: cannot be read as a table: {problem}") from problem
    return cells, [number for number, _ in kept]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def parse_numbers(
    path: Path,
    headers: Sequence[str],
    rows: Sequence[Sequence[str]],
    lines: Sequence[int],
    columns: Sequence[Column | None],
) -> Array:
    """Cells as numbers, shape (k, columns), in the units of the file; NaN where empty or unread."""
    table = np.full((len(rows), len(headers)), np.nan)
    for k, row in enumerate(rows):
        if len(row) != len(headers) and any(row[len(headers) :]):
            raise CalibrationError(
                f"{path}:{lines[k]}: found {len(row)} cells; accepted: {len(headers)}, one a column"
            )
        for j, cell in enumerate(row[: len(headers)]):
            if columns[j] is None or not cell:
                continue
            value = float(cell) if _is_number(cell) else np.nan
            if not abs(value) <= LARGEST:
                raise CalibrationError(
                    f"{path}:{lines[k]}: {headers[j]}: found {cell[:40]}; accepted: a number "
                    f"up to {LARGEST:g}, or an empty cell where nothing was measured"
                )
            table[k, j] = value
    return table


def _headless(
    path: Path, rows: list[list[str]], lines: list[int], cables: Sequence[str]
) -> CalibrationLog:
    m, width = len(cables), len(rows[0])
    if width not in (m, 2 * m):
        raise CalibrationError(
            f"{path}: found {width} columns without a header; accepted: {m} lengths, or {m} "
            f"lengths and {m} swivel angles, or a header"
        )
    columns = [Column(LENGTHS if j < m else SWIVELS, j % m, 1.0) for j in range(width)]
    headers = [f"column {j + 1}" for j in range(width)]
    table = parse_numbers(path, headers, rows, lines, columns)
    words = "no header: lengths [m]" + (" and swivel angles [rad]" if width > m else "")
    return CalibrationLog(
        path, len(rows), lengths=table[:, :m], swivels=table[:, m:] if width > m else None,
        remarks=(words,),
    )  # fmt: skip


def _assembled(
    path: Path, found: ParsedColumns, count: int, m: int, remarks: tuple[str, ...]
) -> CalibrationLog:
    tables: dict[str, Array | None] = {}
    for what in (LENGTHS, ANGLES, SWIVELS, TENSIONS, TORQUES):
        mine = found.get(what)
        table = None
        if mine is not None:
            table = np.full((count, m), np.nan)
            for i, values in mine.items():
                assert isinstance(i, int)
                table[:, i] = values
        tables[what] = table
    corners: dict[int, Array] = {}
    for key, values in found.get(CORNERS, {}).items():
        assert isinstance(key, tuple)
        tag, corner, axis = key
        corners.setdefault(tag, np.full((count, 4, 2), np.nan))[:, corner, axis] = values
    for tag, uv in corners.items():
        seen = np.isfinite(uv).reshape(count, 8).sum(axis=1)
        if np.any((seen > 0) & (seen < 8)):
            k = int(np.argmax((seen > 0) & (seen < 8)))
            raise CalibrationError(
                f"{path}: row {k + 1}: tag {tag}: found {seen[k]} of 8 coordinates of its corners; "
                "accepted: tag{n}_u1 to u4 and v1 to v4, all or none in a row"
            )
    time = found[TIME][0] if TIME in found else None
    if time is not None and np.any(np.diff(time) <= 0.0):
        k = int(np.argmax(np.diff(time) <= 0.0))
        raise CalibrationError(
            f"{path}: time: found {time[k + 1]:g} s after {time[k]:g} s in row {k + 2}; accepted: "
            "times that grow"
        )
    turned = any(kind in found for kind in ROTATIONS)
    return CalibrationLog(
        path, count, time, tables[LENGTHS], tables[ANGLES], tables[SWIVELS], tables[TENSIONS],
        parse_poses(path, found, count) if turned else None, dict(sorted(corners.items())),
        remarks, tables[TORQUES], parse_tilts(path, found, count),
        points=None if turned else parse_points(found, count),
    )  # fmt: skip


def parse_points(found: ParsedColumns, count: int) -> Array | None:
    """Positions from columns, shape (k, 3) [m], NaN where there are none; None: no such columns."""
    if POSITION not in found:
        return None
    points = np.full((count, 3), np.nan)
    for axis, values in found[POSITION].items():
        assert isinstance(axis, int)
        points[:, axis] = values
    return points


def parse_poses(path: Path, found: ParsedColumns, count: int) -> list[RigidTransform | None] | None:
    """Poses from columns, None in rows without; None where there are no such columns."""
    if POSITION not in found:
        return None
    p = _whole(path, found, POSITION, 3, count)
    kind = next((one for one in ROTATIONS if one in found), None)
    if kind is None:
        raise CalibrationError(
            f"{path}: pose: found x, y, z without a rotation; accepted: qw, qx, qy, qz, or "
            "phi_deg, theta_deg, psi_deg (R = Rx Ry Rz), or rx, ry, rz (rotation vector), or "
            "roll, pitch, yaw, beside them"
        )
    numbers = _whole(path, found, kind, 4 if kind == QUATERNION else 3, count)
    poses: list[RigidTransform | None] = []
    for k in range(count):
        if not (np.isfinite(p[k]).all() and np.isfinite(numbers[k]).all()):
            poses.append(None)
            continue
        poses.append(RigidTransform(_rotation(path, kind, numbers[k], k), p[k]))
    return poses


def parse_tilts(path: Path, found: ParsedColumns, count: int) -> Array | None:
    """Roll, pitch and yaw from columns without a position, shape (k, 3) [rad]; None: no such.

    A whole rotation of another kind gives all three; roll or pitch may stand alone.
    """
    if POSITION in found:
        return None
    kind = next((one for one in (RPY, QUATERNION, TAIT, TURN) if one in found), None)
    if kind is None:
        return None
    angles = np.full((count, 3), np.nan)
    if kind == RPY:
        for part, values in found[RPY].items():
            assert isinstance(part, int)
            angles[:, part] = values
        return angles
    numbers = _whole(path, found, kind, 4 if kind == QUATERNION else 3, count)
    for k in np.flatnonzero(np.isfinite(numbers).all(axis=1)):
        angles[k] = RollPitchYaw(_rotation(path, kind, numbers[k], int(k))).vector()
    return angles


def _rotation(path: Path, kind: str, values: Array, row: int) -> RotationMatrix:
    if kind == TAIT:
        return rotation_from_angles(values)
    if kind == TURN:
        return rotation_from_vector(values)
    if kind == RPY:
        return RotationMatrix(RollPitchYaw(values))
    size = float(np.linalg.norm(values))
    if abs(size - 1.0) > 1e-2:
        raise CalibrationError(
            f"{path}: row {row + 1}: quaternion: found length {size:g}; accepted: 1"
        )
    w, x, y, z = values / size
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return RotationMatrix.ProjectToRotationMatrix(R)


def _whole(path: Path, found: ParsedColumns, what: str, size: int, count: int) -> Array:
    mine = found[what]
    if len(mine) != size:
        raise CalibrationError(f"{path}: {what}: found {len(mine)} columns; accepted: all {size}")
    return np.array([mine[k] for k in range(size)]).T.reshape(count, size)

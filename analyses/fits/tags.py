"""Tables of tags: their sizes, and where they are known to be."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.logs.assembly import numbers, read_cells, read_text
from cdpr_drake.analyses.logs.columns import PARTS, POSITION, UNITS, read_header, split_unit
from cdpr_drake.analyses.logs.measurements import poses_of
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CalibrationError


class TagPlace(NamedTuple):
    """A tag in the world.

    Attributes:
        size: Its edge [m].
        X_WT: Its pose [m]; None if it is unknown.
        sigma_place: Standard deviation of each coordinate of that pose [m]; 0 if it is exact.
        sigma_turn: Standard deviation of its turn about each axis [rad].
    """

    size: float
    X_WT: RigidTransform | None = None
    sigma_place: float = 0.0
    sigma_turn: float = 0.0


SIGMAS = {"length": "sigma_place", "angle": "sigma_turn"}
"""Deviations by the dimension of their unit."""


def read_tags(path: Path) -> dict[int, TagPlace]:
    """What is known of tags, by their numbers.

    A row is a tag: tag, size_m, and x_m, y_m, z_m with phi_deg, theta_deg, psi_deg or qw to qz,
    R = Rx Ry Rz; sigma_m and sigma_deg where that was measured, and is no better known. Empty
    deviations, or zeros, stand for a place that is exact.

    Raises:
        LogFileError: The file cannot be read, or a cell is no number.
        CalibrationError: A size is not above 0, or a deviation is not accepted.
    """
    cells = read_cells(path, read_text(path))
    names, lines = [name.strip().lower() for name in cells.rows[0]], cells.lines[1:]
    stems = [re.split(r"[\s_\[(]", name)[0] for name in names]
    if "tag" not in stems or "size" not in stems or not lines:
        raise CalibrationError(
            f"{path}: columns: found {', '.join(names)[:120]}; accepted: tag, size_m and, for tags "
            "whose place is known, x_m, y_m, z_m, phi_deg, theta_deg, psi_deg, sigma_m, sigma_deg"
        )
    table: dict[str, Array] = {}
    for j, (name, stem) in enumerate(zip(names, stems, strict=True)):
        words, unit = split_unit(name)
        dimension, factor = UNITS.get(unit, ("", 1.0))
        column = read_header(name, [])
        key = {"tag": "tag", "size": "size", "sigma": SIGMAS.get(dimension, "")}.get(stem)
        if key == "":
            raise CalibrationError(
                f"{path}: column {name!r}: found a deviation without a unit that is known; "
                "accepted: sigma_m and sigma_deg, or other units of length and angle"
            )
        if key is None and column is None:
            continue
        values, bad = numbers([row[j] for row in cells.rows[1:]], cells.decimal)
        if bad is not None:
            raise CalibrationError(
                f"{path}:{lines[bad]}: {name}: found {cells.rows[bad + 1][j][:40]}; accepted: a "
                "number, or an empty cell"
            )
        table[key or (column.name if column else words)] = factor * values
    placed = set(PARTS[POSITION]) & set(table)
    poses = poses_of(path, table) if placed else [None] * len(lines)
    sigmas = _sigmas(path, table, lines, poses)
    tags: dict[int, TagPlace] = {}
    for k, X_WT in enumerate(poses):
        number, size = table["tag"][k], table["size"][k]
        if not (number >= 0 and number == int(number) and size > 0.0):
            raise CalibrationError(
                f"{path}:{lines[k]}: found tag {number:g} of {size:g} m; accepted: a whole "
                "number and a size > 0"
            )
        if int(number) in tags:
            raise CalibrationError(
                f"{path}:{lines[k]}: found tag {number:g} twice; accepted: each once"
            )
        tags[int(number)] = TagPlace(float(size), X_WT, *sigmas[k].tolist())
    return tags


def _sigmas(
    path: Path, table: dict[str, Array], lines: list[int], poses: list[RigidTransform | None]
) -> Array:
    """Deviations of places and turns, shape (k, 2) [m, rad]; zero where none is given."""
    nothing = np.zeros(len(lines))
    sigmas = np.nan_to_num(
        np.column_stack([table.get(key, nothing) for key in SIGMAS.values()]), nan=0.0
    )
    both, neither = np.all(sigmas > 0.0, axis=1), np.all(sigmas == 0.0, axis=1)
    for k, line in enumerate(lines):
        if not (both[k] or neither[k]):
            raise CalibrationError(
                f"{path}:{line}: sigma: found {sigmas[k, 0]:g} m and {sigmas[k, 1]:g} rad; "
                "accepted: sigma_m and sigma_deg > 0, or neither where the place is exact"
            )
        if both[k] and poses[k] is None:
            raise CalibrationError(
                f"{path}:{line}: sigma: found {sigmas[k, 0]:g} m without a place; accepted: beside "
                "x_m, y_m, z_m and angles"
            )
    return sigmas

"""Tables of tags: their sizes, and where they are known to be."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.columns import UNITS, Column, read_header, split_unit
from cdpr_drake.analyses.calibration.log_file import (
    ParsedColumns,
    parse_numbers,
    parse_poses,
    split_cells,
)
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
        CalibrationError: The file cannot be read, a size is not above 0, or a deviation is not
            accepted.
    """
    rows, lines = split_cells(path)
    names = [name.strip().lower() for name in rows[0]]
    stems = [re.split(r"[\s_\[(]", name)[0] for name in names]
    if "tag" not in stems or "size" not in stems or len(rows) < 2:
        raise CalibrationError(
            f"{path}: columns: found {', '.join(names)[:120]}; accepted: tag, size_m and, for tags "
            "whose place is known, x_m, y_m, z_m, phi_deg, theta_deg, psi_deg, sigma_m, sigma_deg"
        )
    columns: list[Column | None] = [read_header(name, [], 1) for name in names]
    columns[stems.index("tag")] = Column("tag", 0, 1.0)
    size_factor = 1e-3 if names[stems.index("size")].endswith(("mm", "mm]", "mm)")) else 1.0
    columns[stems.index("size")] = Column("size", 0, size_factor)
    for j, name in enumerate(names):
        words, unit = split_unit(name)
        if words == "sigma" and unit in UNITS and UNITS[unit][0] in SIGMAS:
            columns[j] = Column(SIGMAS[UNITS[unit][0]], 0, UNITS[unit][1])
        elif words.startswith("sigma"):
            raise CalibrationError(
                f"{path}: column {name!r}: found a deviation without a unit that is known; "
                "accepted: sigma_m and sigma_deg, or other units of length and angle"
            )
    table = parse_numbers(path, names, rows[1:], lines[1:], columns)
    found: ParsedColumns = {}
    for j, column in enumerate(columns):
        if column is not None:
            found.setdefault(column.what, {})[column.key] = table[:, j] * column.factor
    poses = parse_poses(path, found, len(table)) or [None] * len(table)
    sigmas = _sigmas(path, found, lines[1:], [X is not None for X in poses])
    tags = {}
    for k, X_WT in enumerate(poses):
        number, size = found["tag"][0][k], found["size"][0][k]
        if not (number >= 0 and number == int(number) and size > 0.0):
            raise CalibrationError(
                f"{path}:{lines[k + 1]}: found tag {number:g} of {size:g} m; accepted: a whole "
                "number and a size > 0"
            )
        if int(number) in tags:
            raise CalibrationError(
                f"{path}:{lines[k + 1]}: found tag {number:g} twice; accepted: each once"
            )
        tags[int(number)] = TagPlace(float(size), X_WT, *sigmas[k].tolist())
    return tags


def _sigmas(path: Path, found: ParsedColumns, lines: list[int], placed: list[bool]) -> Array:
    """Deviations of places and turns, shape (k, 2) [m, rad]; zero where none is given."""
    sigmas = np.full((len(placed), 2), np.nan)
    for j, key in enumerate(SIGMAS.values()):
        if key in found:
            sigmas[:, j] = found[key][0]
    given = np.isfinite(sigmas)
    sigmas = np.where(given, sigmas, 0.0)
    both = np.all(sigmas > 0.0, axis=1)
    neither = np.all(sigmas == 0.0, axis=1)
    for k, line in enumerate(lines):
        if not (both[k] or neither[k]):
            raise CalibrationError(
                f"{path}:{line}: sigma: found {sigmas[k, 0]:g} m and {sigmas[k, 1]:g} rad; "
                "accepted: sigma_m and sigma_deg > 0, or neither where the place is exact"
            )
        if both[k] and not placed[k]:
            raise CalibrationError(
                f"{path}:{line}: sigma: found {sigmas[k, 0]:g} m without a place; accepted: beside "
                "x_m, y_m, z_m and angles"
            )
    return sigmas

"""Poses of a tracker in W, when its axes are others."""

from __future__ import annotations

import numpy as np
from pydrake.math import RotationMatrix

from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.arrays import Array

POINTS = ("x_m", "y_m", "z_m")
WHOLE = ("qw", "qx", "qy", "qz")


def turned_columns(columns: Columns, R_WF: Array | None) -> Columns:
    """Columns of poses and points of a frame F, with the axes of W.

    Body axes are renamed alike: a body whose axes are those of F has those of W then. Every
    x_m, y_m, z_m with the same words before them is a point.
    """
    if R_WF is None:
        return columns
    found = dict(columns)
    for header in columns:
        stem = header.removesuffix(POINTS[0])
        names = [f"{stem}{name}" for name in POINTS]
        if stem != header and all(name in columns for name in names):
            p_W = R_WF @ np.array([columns[name] for name in names])
            found |= dict(zip(names, p_W, strict=True))
    if all(name in columns for name in WHOLE):
        axis = R_WF @ np.array([columns[name] for name in WHOLE[1:]])
        found |= dict(zip(WHOLE[1:], axis, strict=True))
    return found


def axes_in_words(R_WF: Array) -> str:
    """Which axes of the file x, y and z of W are."""
    RotationMatrix(R_WF)  # raises where it is none
    words = []
    for row in R_WF:
        k = int(np.argmax(np.abs(row)))
        words.append(f"{'-' if row[k] < 0.0 else ''}{'xyz'[k]}")
    return f"x, y, z of W are {', '.join(words)} of the file"

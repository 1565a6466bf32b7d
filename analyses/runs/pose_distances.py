"""Distances between rows of poses in logs."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array


def pose_rows_distance(rows: Array, others: Array) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] between poses in rows as `pose_row`, shape (n, 7), as (n,)."""
    distance = np.linalg.norm(rows[:, 4:] - others[:, 4:], axis=1)
    q, r = rows[:, :4], others[:, :4]
    # The vector part of conj(q) r, whose norm is the sine of half the angle.
    vector = q[:, :1] * r[:, 1:] - r[:, :1] * q[:, 1:] - np.cross(q[:, 1:], r[:, 1:])
    sine = np.linalg.norm(vector, axis=1)
    cosine = np.abs(np.sum(q * r, axis=1))
    return distance, 2.0 * np.arctan2(sine, cosine)

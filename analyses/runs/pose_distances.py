"""TODO docstring."""

from __future__ import annotations
from collections.abc import Callable
from dataclasses import dataclass
import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator, SimulatorStatus
from pydrake.systems.framework import Context
from cdpr_drake.analyses.runs.loop import (
    Progress,
    advance,
)
from cdpr_drake.arrays import Array
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.diagrams.visual_servo import (
    VisualServo,
    build_visual_servo,
)


def pose_rows_distance(rows: Array, others: Array) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] between poses in rows as `pose_row`, shape (n, 7), as (n,)."""
    distance = np.linalg.norm(rows[:, 4:] - others[:, 4:], axis=1)
    q, r = rows[:, :4], others[:, :4]
    # The vector part of conj(q) r, whose norm is the sine of half the angle.
    vector = q[:, :1] * r[:, 1:] - r[:, :1] * q[:, 1:] - np.cross(q[:, 1:], r[:, 1:])
    sine = np.linalg.norm(vector, axis=1)
    cosine = np.abs(np.sum(q * r, axis=1))
    return distance, 2.0 * np.arctan2(sine, cosine)


def pose_rows_distance(rows: Array, others: Array) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] between poses in rows as `pose_row`, shape (n, 7), as (n,)."""
    distance = np.linalg.norm(rows[:, 4:] - others[:, 4:], axis=1)
    q, r = rows[:, :4], others[:, :4]
    # The vector part of conj(q) r, whose norm is the sine of half the angle.
    vector = q[:, :1] * r[:, 1:] - r[:, :1] * q[:, 1:] - np.cross(q[:, 1:], r[:, 1:])
    sine = np.linalg.norm(vector, axis=1)
    cosine = np.abs(np.sum(q * r, axis=1))
    return distance, 2.0 * np.arctan2(sine, cosine)

"""Benchmark of a point mass calibrated by motor angles, against what is written without it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.math import RigidTransform
from scipy.optimize import least_squares

from cdpr_drake.analyses.calibration.calibrated_robots import calibration_model
from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, processor_seconds
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import MotionType
from cdpr_drake.models.robot_loader import load_robot

ROBOT = "hangprinter_4"
ROWS, KNOWN = 44, 9
"""Rows of motor angles, and those whose position is measured, as in the recorded series."""

SIGMA, PLACE = 1e-3, 1e-6
"""Of lengths, and of positions [m]."""

OFF = 0.02
"""Deviation of each coordinate of an anchor that is believed [m]."""


def point_calibration_rows(quick: bool) -> list[TimingRow]:
    """Anchors of a Hangprinter, against SciPy with differences; `quick` repeats less."""
    ours, scipy, unknowns = point_works()
    works = [lambda: 1e3 * processor_seconds(ours), lambda: 1e3 * processor_seconds(scipy)]
    ours()  # kernels are compiled
    own, other = interleaved(works, 1 if quick else 5)
    return [
        TimingRow(
            f"{ROBOT}: anchors and drums from {ROWS} rows of motor angles, {KNOWN} positions, "
            "covariance",
            own, "ms", f"scipy least_squares, {unknowns} unknowns, numeric Jacobian", other,
            other / own, ratio_means="times faster",
        )
    ]  # fmt: skip


def point_works() -> tuple[Callable[[], Array], Callable[[], Array], int]:
    """One calibration in two ways, and how many unknowns it has; both give anchors, (12,) [m]."""
    robot, random = load_robot(ROBOT), np.random.default_rng(0)
    true = calibration_model(robot)
    A = true.cables.p_WA
    low, high = np.array([-0.6, -0.7, 0.0]), np.array([0.6, 0.7, 1.4])
    p = np.vstack([np.zeros(3), random.uniform(low, high, (ROWS - 1, 3))])
    lengths = np.linalg.norm(p[:, :, None] - A, axis=1)
    drum = robot.drum()
    paid = lengths - np.linalg.norm(A, axis=0) + SIGMA * random.standard_normal(lengths.shape)
    angles = drum.motor_angles(paid)
    known = np.where(np.arange(ROWS)[:, None] < KNOWN, p, np.nan)
    believed = A + OFF * random.standard_normal(A.shape)
    begun = p + OFF * random.standard_normal(p.shape)
    begun[:KNOWN] = p[:KNOWN]
    advantage = np.array([cable.mechanical_advantage for cable in robot.cables])

    def ours() -> Array:
        cables = CableSet.make(believed, true.cables.p_PB, true.cables.stiffness)
        at = [RigidTransform(place) for place in begun]
        program = CalibrationProgram(
            CalibrationModel(true.names, cables), at, ("exit_points", "common_drum_radius"),
            motion=MotionType("3T"),
        )  # fmt: skip
        program.AddZeroedCables(angles, SIGMA, RigidTransform(), drum, advantage=advantage)
        program.AddTrackedPoints(known, PLACE)
        return program.Solve(outliers=False).model.cables.p_WA.T.ravel()

    per_radius = drum.per_radius(angles) / advantage
    wound = drum.paid_out(angles)

    def residuals(x: Array) -> Array:
        points = x[:12].reshape(4, 3).T
        place = np.vstack([p[:KNOWN], x[13:].reshape(-1, 3)])
        model = np.linalg.norm(place[:, :, None] - points, axis=1) - np.linalg.norm(points, axis=0)
        return np.asarray((model - wound - x[12] * per_radius).ravel() / SIGMA)

    start = np.concatenate([believed.T.ravel(), [0.0], begun[KNOWN:].ravel()])

    def by_scipy() -> Array:
        return np.asarray(least_squares(residuals, start, x_scale="jac").x[:12])

    return ours, by_scipy, len(start)

"""Benchmarks of identification and calibration, against what is written without them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.math import RigidTransform
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.calibration.calibrated_robots import calibration_model
from cdpr_drake.analyses.calibration.candidate_poses import rest_poses
from cdpr_drake.analyses.calibration.identified_robots import dynamic_model, platform_size
from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, processor_seconds
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import cross_matrix, pose_row
from cdpr_drake.identification.program import IdentificationProgram
from cdpr_drake.identification.regressor import inertia_regressor
from cdpr_drake.identification.samples import sample_motion
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

ROBOT = "acrobot_large"
ROWS, RATE, BANDWIDTH = 10_000, 250.0, 8.0
UNKNOWN = ("mass", "center_of_mass", "inertia")
PRELOAD = 20.0
"""Tensions about which those of least norm balance the motion [N]."""

STRETCH = 0.8
"""Time from pose to pose [s]."""

POSES = 40
"""Of the calibration."""
LENGTH_SIGMA, TURN_SIGMA, PLACE_SIGMA = 1e-4, 5e-4, 2e-4
"""Of lengths [m] and of a tracker [rad, m]."""
OFF = 5e-3
"""Deviation of each coordinate of an exit or anchor point that is believed [m]."""


def calibration_rows(quick: bool) -> list[TimingRow]:
    """Exit and anchor points by a tracker, against SciPy with differences; `quick` repeats less."""
    ours, scipy, unknowns = calibration_works(POSES)
    works = [lambda: 1e3 * processor_seconds(ours), lambda: 1e3 * processor_seconds(scipy)]
    ours()  # kernels are compiled
    own, other = interleaved(works, 1 if quick else 5)
    return [
        TimingRow(
            f"{ROBOT}: 48 coordinates and {POSES} poses from lengths and a tracker, covariance",
            own, "ms", f"scipy least_squares, {unknowns} unknowns, numeric Jacobian", other,
            other / own, ratio_means="times faster",
        )
    ]  # fmt: skip


def calibration_works(count: int) -> tuple[Callable[[], Array], Callable[[], Array], int]:
    """One calibration from so many poses in two ways, and how many unknowns it has.

    Both give exit, then anchor points, cable by cable, shape (48,) [m]. SciPy gets residuals in
    NumPy over all poses at once, with steps in deviations, and no covariance is asked of it.
    """
    robot, random = load_robot(ROBOT), np.random.default_rng(0)
    exact = calibration_model(robot)
    true = type(exact)(exact.names, exact.cables.without_pulleys())
    poses, _ = rest_poses(robot, count, random)
    start = Point(true, Stations.at(poses[:1])).numbers[0, :, 0]
    readings = simulated_lengths(true, poses, start, LENGTH_SIGMA, random)
    tracked = simulated_poses(poses, TURN_SIGMA, PLACE_SIGMA, random)
    m = true.cables.count
    points = np.vstack([true.cables.p_WA.T, true.cables.p_PB.T]).ravel()
    points = points + OFF * random.standard_normal(points.shape)

    def ours() -> Array:
        exits, anchors = points.reshape(2, m, 3).transpose(0, 2, 1)
        cables = type(true.cables).make(exits, anchors, true.cables.stiffness)
        program = CalibrationProgram(
            type(true)(true.names, cables), tracked, ("exit_points", "anchor_points")
        )
        program.AddLengths(readings, LENGTH_SIGMA, start)
        program.AddTrackedPoses(tracked, TURN_SIGMA, PLACE_SIGMA)
        found = program.Solve(outliers=False).model.cables
        return np.asarray(np.vstack([found.p_WA.T, found.p_PB.T]).ravel())

    return ours, _by_scipy(readings, tracked, points), len(points) + 6 * count


def _by_scipy(readings: Array, tracked: list[RigidTransform], points: Array) -> Callable[[], Array]:
    """The same least squares for SciPy: points, then turns and steps from tracked poses."""
    count, m = readings.shape
    R = np.array([X.rotation().matrix() for X in tracked])
    p = np.array([X.translation() for X in tracked])
    scale = np.concatenate(
        [np.full(len(points), OFF), np.tile([TURN_SIGMA] * 3 + [PLACE_SIGMA] * 3, count)]
    )

    def residuals(x: Array) -> Array:
        values = x * scale
        exits, anchors = (points + values[: len(points)]).reshape(2, m, 3)
        steps = values[len(points) :].reshape(count, 6)
        turned = Rotation.from_rotvec(steps[:, :3]).as_matrix() @ R
        at = anchors @ turned.transpose(0, 2, 1) + (p + steps[:, 3:])[:, None]
        lengths = np.linalg.norm(at - exits, axis=2)
        return np.concatenate([
            ((lengths - readings) / LENGTH_SIGMA).ravel(), x[len(points) :]
        ])  # fmt: skip

    def solve() -> Array:
        found = least_squares(residuals, np.zeros(len(scale)), method="trf", x_scale=1.0)
        return np.asarray(points + found.x[: len(points)] * OFF)

    return solve


def identification_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` repeats less."""
    return [log_row(1 if quick else 5)]


def log_row(repeats: int) -> TimingRow:
    """From rows to parameters with their covariance, against normal equations row by row.

    The loop gets velocities and accelerations for nothing, and gives no covariance.
    """
    robot = load_robot(ROBOT)
    model, cables = dynamic_model(robot), robot.cable_set().without_pulleys()
    random, home = np.random.default_rng(0), robot.home.transform()
    count = int(ROWS / RATE / STRETCH) + 1
    poses = [home]
    for _ in range(count):
        turn = type(home.rotation()).MakeZRotation(random.uniform(-0.3, 0.3))
        tilt = type(home.rotation()).MakeXRotation(random.uniform(-0.3, 0.3))
        place = random.uniform([-0.2, -0.2, 0.15], [0.2, 0.2, 0.45])
        poses.append(type(home)(turn @ tilt, place))
    motion = PoseTrajectory(tuple(poses), (STRETCH,) * count)
    time = np.arange(ROWS) / RATE
    rows = np.array([motion.motion(t) for t in time])
    X = [motion.pose(t) for t in time]
    R = np.array([one.rotation().matrix() for one in X])
    gravity = robot.gravity_vector()
    F = inertia_regressor(R, rows[:, 7:13], rows[:, 13:], gravity) @ model.inertial()
    tensions = np.empty((ROWS, cables.count))
    for n in range(ROWS):
        W, even = -cable_jacobian(X[n], cables).T, np.full(cables.count, PRELOAD)
        tensions[n] = even + np.linalg.pinv(W) @ (F[n] - W @ even)
    tensions += 0.2 * random.standard_normal(tensions.shape)
    table = np.array([pose_row(one) for one in X])

    def ours() -> Array:
        program = IdentificationProgram(model, UNKNOWN, size=platform_size(robot))
        program.AddMotion(sample_motion(time, table, tensions, cables, BANDWIDTH))
        return program.Solve().values

    def loop() -> Array:
        H, g = np.zeros((10, 10)), np.zeros(10)
        for n in range(ROWS):
            Y = naive_regressor(R[n], rows[n, 7:13], rows[n, 13:], gravity)
            wrench = -cable_jacobian(X[n], cables).T @ tensions[n]
            H += Y.T @ Y
            g += Y.T @ wrench
        return np.asarray(np.linalg.solve(H, g))

    works = [lambda: 1e3 * processor_seconds(ours), lambda: 1e3 * processor_seconds(loop)]
    own, other = interleaved(works, repeats)
    return TimingRow(
        f"{ROBOT}: mass and inertia from {ROWS} rows, with covariance", own, "ms",
        "normal equations row by row, NumPy", other, other / own, ratio_means="times faster",
    )  # fmt: skip


def naive_regressor(R: Array, V: Array, A: Array, gravity: Array) -> Array:
    """`inertia_regressor` of one row as it stands in textbooks, shape (6, 10)."""
    w, alpha, b = R.T @ V[:3], R.T @ A[:3], R.T @ (A[3:] - gravity)

    def times(x: Array) -> Array:
        return np.array(
            [
                [x[0], 0.0, 0.0, x[1], x[2], 0.0],
                [0.0, x[1], 0.0, x[0], 0.0, x[2]],
                [0.0, 0.0, x[2], 0.0, x[0], x[1]],
            ]
        )

    Y = np.zeros((6, 10))
    Y[:3, 1:4] = -R @ cross_matrix(b)
    Y[:3, 4:] = R @ (times(alpha) + cross_matrix(w) @ times(w))
    Y[3:, 0] = R @ b
    Y[3:, 1:4] = R @ (cross_matrix(alpha) + cross_matrix(w) @ cross_matrix(w))
    return Y

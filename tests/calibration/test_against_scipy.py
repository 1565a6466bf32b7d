"""Calibrations of points against SciPy, with the same residuals in NumPy and no derivative."""

import numpy as np
from pydrake.math import RigidTransform
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.fits.robots import calibration_model, rest_poses
from cdpr_drake.calibration.measurements import simulated_lengths, simulated_poses
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import MotionType
from cdpr_drake.models.robot_loader import load_robot

LENGTH, TURN, PLACE = 1e-4, 5e-4, 2e-4
"""Standard deviations of lengths [m] and of a tracker [rad, m]."""

OFF = 5e-3
"""Standard deviation of each coordinate of a point that is believed [m]."""


def test_exit_and_anchor_points_by_a_tracker():
    """SciPy ends where its own differences let it, far below deviations of 0.2 mm and more."""
    robot, random, count = load_robot("acrobot_large"), np.random.default_rng(0), 14
    exact = calibration_model(robot)
    true = CalibrationModel(exact.names, exact.cables.without_pulleys())
    poses, _ = rest_poses(robot, count, random)
    start = Point(true, Stations.at(poses[:1])).numbers[0, :, 0]
    readings = simulated_lengths(true, poses, start, LENGTH, random)
    tracked = simulated_poses(poses, TURN, PLACE, random)
    points = np.array([true.cables.p_WA.T, true.cables.p_PB.T])
    points = points + OFF * random.standard_normal(points.shape)

    believed = CableSet.make(points[0].T, points[1].T, true.cables.stiffness)
    program = CalibrationProgram(
        CalibrationModel(true.names, believed), tracked, ("exit_points", "anchor_points")
    )
    program.AddLengths(readings, LENGTH, start)
    program.AddTrackedPoses(tracked, TURN, PLACE)
    cables = program.Solve(outliers=False).model.cables

    R = np.array([X.rotation().matrix() for X in tracked])
    p = np.array([X.translation() for X in tracked])
    scale = np.concatenate([np.full(points.size, OFF), np.tile([TURN] * 3 + [PLACE] * 3, count)])

    def residuals(x):
        """Of lengths, then of the tracker; x are points, turns and steps in deviations."""
        values = x * scale
        exits, anchors = points + values[: points.size].reshape(points.shape)
        steps = values[points.size :].reshape(count, 6)
        turned = Rotation.from_rotvec(steps[:, :3]).as_matrix() @ R
        ends = anchors @ turned.transpose(0, 2, 1) + (p + steps[:, 3:])[:, None]
        lengths = np.linalg.norm(ends - exits, axis=2)
        return np.concatenate([((lengths - readings) / LENGTH).ravel(), x[points.size :]])

    solution = least_squares(residuals, np.zeros(len(scale))).x[: points.size] * OFF
    expected = points + solution.reshape(points.shape)
    np.testing.assert_allclose([cables.p_WA.T, cables.p_PB.T], expected, atol=1e-6)


def test_anchors_and_drums_of_a_point_mass_by_motor_angles():
    """SciPy stops at a relative gain of 1e-8, within hundredths of deviations of 1 mm and more."""
    robot, random, count, known = load_robot("hangprinter_4"), np.random.default_rng(0), 44, 9
    true, sigma, off = calibration_model(robot), 1e-3, 0.02
    A = true.cables.p_WA
    low, high = np.array([-0.6, -0.7, 0.0]), np.array([0.6, 0.7, 1.4])
    p = np.vstack([np.zeros(3), random.uniform(low, high, (count - 1, 3))])
    lengths = np.linalg.norm(p[:, :, None] - A, axis=1)
    drum = robot.drum()
    paid = lengths - np.linalg.norm(A, axis=0) + sigma * random.standard_normal(lengths.shape)
    angles = drum.motor_angles(paid)
    believed = A + off * random.standard_normal(A.shape)
    begun = p + off * random.standard_normal(p.shape)
    begun[:known] = p[:known]
    advantage = np.array([cable.mechanical_advantage for cable in robot.cables])

    cables = CableSet.make(believed, true.cables.p_PB, true.cables.stiffness)
    program = CalibrationProgram(
        CalibrationModel(true.names, cables), [RigidTransform(place) for place in begun],
        ("exit_points", "common_drum_radius"), motion=MotionType("3T"),
    )  # fmt: skip
    program.AddZeroedCables(angles, sigma, RigidTransform(), drum, advantage=advantage)
    program.AddTrackedPoints(np.where(np.arange(count)[:, None] < known, p, np.nan), 1e-6)
    ours = program.Solve(outliers=False).model.cables.p_WA.T.ravel()

    per_radius, wound = drum.per_radius(angles) / advantage, drum.paid_out(angles)

    def residuals(x):
        """Of the wound lengths; x are anchors, the drums' radius, and unknown places."""
        points = x[:12].reshape(4, 3).T
        place = np.vstack([p[:known], x[13:].reshape(-1, 3)])
        model = np.linalg.norm(place[:, :, None] - points, axis=1) - np.linalg.norm(points, axis=0)
        return (model - wound - x[12] * per_radius).ravel() / sigma

    start = np.concatenate([believed.T.ravel(), [0.0], begun[known:].ravel()])
    np.testing.assert_allclose(
        ours, least_squares(residuals, start, x_scale="jac").x[:12], atol=2e-5
    )

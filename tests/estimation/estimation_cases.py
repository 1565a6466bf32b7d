"""Fused beliefs with everything in them, truths that they are wrong about, and differences."""

from dataclasses import replace

import numpy as np

from cdpr_drake.estimation.sensor_filter import (
    COUNTED,
    EXTERNAL,
    OBJECT,
    ON_BOARD,
    POSE,
    VELOCITY,
    FusedBelief,
    Prior,
    know_object,
    move,
    past_columns,
    remember_pose,
    start_fusion,
)
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, logarithm, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot

STEP = 1e-6  # of central differences [rad, m]

ROBOT = load_robot("acrobot_small")
CABLES = ROBOT.cable_set().without_pulleys()
M = CABLES.count
X_WP = pose_from_angles(np.array([0.11, -0.03, 0.3]), np.radians([-12.0, -10.0, 7.0]))
BEFORE = X_WP @ exponential(np.array([0.02, -0.01, 0.03, 0.01, 0.02, -0.01]))
X_PC = ROBOT.camera_mount("onboard").pose.transform()
X_WE = ROBOT.camera_mount("overview").pose.transform()
X_WO = pose_from_angles(np.array([0.22, -0.2, 0.0]), np.radians([3.0, -2.0, 20.0]))
X_PQ = pose_from_angles(np.array([0.0, -0.1, 0.06]), np.radians([55.0, 0.0, 0.0]))
POINTS = 0.03 * np.array([[-1.0, 1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [0.0, 0.0, 0.0, 0.0]])
GRAVITY = np.array([0.0, 0.0, -9.81])


def spread(rotation, translation):
    return np.repeat([rotation, translation], 3)


def belief(past=1):
    """A belief with everything in it."""
    prior = Prior(
        pose=spread(0.02, 0.01), on_board=spread(0.01, 0.005), external=spread(0.01, 0.005),
        offsets=np.full(M, 1e-3), biases=spread(0.01, 0.2),
    )  # fmt: skip
    made = start_fusion(BEFORE, X_PC, X_WE, prior, cable_paths(BEFORE, CABLES).J, past)
    made = know_object(made, X_WO, np.diag(spread(0.02, 0.01) ** 2))
    made = remember_pose(made)
    way = logarithm(BEFORE.inverse() @ X_WP)
    made = move(made, way, 1.0, np.full(6, 1e-5))
    return replace(made, velocity=np.array([0.1, -0.05, 0.02]))


def wrong_by(made, d):
    """The truth of which a belief has the errors d."""
    turned = exponential(d[POSE])
    return FusedBelief(
        turned @ made.X_WP,
        turned.rotation() @ made.velocity + d[VELOCITY],
        exponential(d[OBJECT]) @ made.X_WO,
        made.X_PC @ exponential(d[ON_BOARD]),
        made.X_WE @ exponential(d[EXTERNAL]),
        made.biases + d[27:33],
        made.offsets + d[COUNTED : COUNTED + M],
        tuple(exponential(d[past_columns(M, k)]) @ X for k, X in enumerate(made.past)),
        made.covariance,
    )


def differences(made, read):
    """Derivatives of a reading of the truth by the errors of a belief, by central differences."""
    steps = STEP * np.eye(len(made.covariance))
    return np.array([
        (read(wrong_by(made, d)) - read(wrong_by(made, -d))) / (2.0 * STEP) for d in steps
    ]).T  # fmt: skip


def normalized_error(x, covariance):
    """Chi-square distributed if the errors x have this covariance."""
    return x @ np.linalg.solve(covariance, x)


def pose_innovation(sight, seen):
    """log(Z^-1 Z_seen) of a measured pose [m], shape (6,) [rad, m]."""
    return logarithm(sight.Z.inverse() @ seen)

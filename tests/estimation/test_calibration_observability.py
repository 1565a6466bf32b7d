"""What of two calibrations can be known at all: ranks and null spaces of the nonlinear readings.

Errors in W stay as they are while the platform moves as it is known to, so that the observability
matrix of a motion is the stack of the readings' derivatives, here by central differences.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdpr_drake.estimation.sensor_filter import (
    COUNTED,
    EXTERNAL,
    OBJECT,
    ON_BOARD,
    POSE,
    VELOCITY,
    Increments,
    move_inertially,
)
from cdpr_drake.estimation.sensor_models import sight_external, sight_on_board
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import adjoint, exponential, logarithm
from tests.estimation.estimation_cases import (
    CABLES,
    GRAVITY,
    POINTS,
    X_PC,
    X_PQ,
    X_WE,
    X_WO,
    X_WP,
    M,
    belief,
    differences,
)

NOTHING = 1e-7  # singular values of what is not there: differences leave some 1e-9 of derivatives
SOMETHING = 1e-4  # singular values of what is, of derivatives about 1 over poses decimetres apart
EACH_LENGTH = 1e-4  # deviation of a counted length [m]
OFFSETS = slice(COUNTED, COUNTED + M)

TURNS = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.2, 0.3]])
SHIFTS = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.05], [0.1, 0.1, -0.1]])
POSES = {
    name: [X_WP @ exponential(np.concatenate(twist)) for twist in zip(turns, shifts, strict=True)]
    for name, turns, shifts in (
        ("stands", TURNS[:1], SHIFTS[:1]),
        ("shifted", 0.0 * TURNS, SHIFTS),
        ("moved", TURNS, SHIFTS),
    )
}


def on_board(true, made):
    return logarithm(sight_on_board(made, 0.0).Z.inverse() @ sight_on_board(true, 0.0).Z)


def external(true, made):
    Z = sight_external(made, X_PQ, 0.0).Z
    return logarithm(Z.inverse() @ sight_external(true, X_PQ, 0.0).Z)


def depths(true, _):
    sights = sight_on_board(true, 0.0), sight_external(true, X_PQ, 0.0)
    return np.concatenate([(sight.Z @ POINTS)[2] for sight in sights])


def lengths(true, _):
    return cable_paths(true.X_WP, CABLES).lengths + true.offsets


@cache
def of_reading(poses, reading):
    made = [replace(belief(past=0), X_WP=X) for X in POSES[poses]]
    return np.concatenate([differences(b, lambda true, b=b: reading(true, b)) for b in made])


def stack(poses, *readings):
    """Observability matrix for the errors of pose, object, both cameras and lengths."""
    return np.concatenate([of_reading(poses, reading) for reading in readings])


def rank(matrix, *columns):
    """Rank of some columns; what is there is far from what is not."""
    values = np.linalg.svd(np.hstack([matrix[:, c] for c in columns]), compute_uv=False)
    assert not np.any((values > NOTHING) & (values < SOMETHING))
    return int(np.sum(values > SOMETHING))


def together(twist):
    """Errors of pose, object and external camera if all are moved by a twist of W."""
    errors = np.zeros(len(belief(past=0).covariance))
    errors[POSE] = errors[OBJECT] = twist
    errors[EXTERNAL] = adjoint(X_WE.inverse()) @ twist
    return errors


COMMON = np.array([together(twist) for twist in np.eye(6)]).T


@pytest.mark.parametrize("poses", ["stands", "moved"])
def test_an_external_camera_alone_never_tells_its_error_from_the_pose(poses):
    assert rank(stack(poses, external), POSE, EXTERNAL) == 6


@pytest.mark.parametrize(("poses", "hand_eye"), [("stands", 0), ("shifted", 3), ("moved", 6)])
def test_an_on_board_camera_is_calibrated_by_motion(poses, hand_eye):
    """Turns about two axes show all of hand to eye, shifts alone its rotation; where the target is
    is only known against the platform. Tsai and Lenz, IEEE Trans. Robotics and Automation 5(3),
    1989, for two rotations."""
    assert rank(stack(poses, on_board), POSE, OBJECT, ON_BOARD) == 6 + hand_eye
    if poses == "shifted":
        # The camera beside where it is said to be, and the target beside by as much.
        errors = np.zeros(len(COMMON))
        errors[ON_BOARD] = 0.0, 0.0, 0.0, 1.0, 0.0, 0.0
        errors[OBJECT] = adjoint(X_WP @ X_PC) @ errors[ON_BOARD]
        assert np.max(np.abs(stack(poses, on_board) @ errors)) < NOTHING


@pytest.mark.parametrize("readings", [(on_board, external), (on_board, external, depths)])
def test_both_cameras_and_depths_do_not_see_a_common_motion(readings):
    """Six directions stay, which are the common motion of platform, object and external camera."""
    seen = stack("moved", *readings)
    assert rank(seen, POSE, OBJECT, ON_BOARD, EXTERNAL) == 24 - 6
    assert np.max(np.abs(seen @ COMMON)) < NOTHING


def test_a_common_motion_does_not_move_the_target_in_the_camera():
    """What a servo steers by does not know of it, nor of an external calibration."""
    made = belief(past=0)
    H = sight_on_board(made, 0.0).H
    np.testing.assert_allclose(H @ COMMON, 0.0, atol=1e-12)
    assert not np.any(H[:, EXTERNAL])
    Z = (made.X_WP @ X_PC).inverse() @ X_WO
    np.testing.assert_allclose(H[:, ON_BOARD], -adjoint(Z.inverse()), atol=1e-12)


def test_lengths_see_the_common_motion_once_the_platform_moves():
    """Counted from a start that is not known, in rank. How weakly, a deviation tells: what a length
    is wrong by is in a position more than twenty times as much, from poses decimetres apart."""
    assert rank(stack("stands", external, lengths), POSE, EXTERNAL, OFFSETS) == 6 + M
    seen = stack("moved", on_board, external, lengths)
    assert rank(seen, POSE, OBJECT, ON_BOARD, EXTERNAL, OFFSETS) == 24 + M
    alone = stack("moved", lengths)
    A = np.hstack([alone[:, POSE], alone[:, OFFSETS]])
    deviations = EACH_LENGTH * np.sqrt(np.diagonal(np.linalg.inv(A.T @ A))[3:6])
    assert np.max(deviations) > 20.0 * EACH_LENGTH


def test_an_imu_sees_the_tilt_of_the_common_motion():
    """Yaw and position stay, and the tilt too where accelerometers have a bias nobody knows."""
    made = replace(belief(past=0), velocity=np.zeros(3))
    R = X_WP.rotation()
    up = -(R.matrix().T @ GRAVITY)
    still = Increments(R.inverse() @ R, 0.1 * up, 5e-3 * up, 0.1)

    def velocities(true):
        rows = []
        for _ in range(3):
            rows.append(true.X_WP.rotation().matrix().T @ true.velocity)
            true = move_inertially(true, still, GRAVITY, np.zeros(6), np.zeros(6))
        return np.concatenate(rows)

    seen = differences(made, velocities)
    assert rank(seen, POSE, VELOCITY) == 3 + 2
    assert np.max(np.abs(seen[:, 2:6])) < NOTHING  # yaw and position
    accelerometers = slice(30, 33)
    both = rank(seen, POSE, VELOCITY, accelerometers)
    assert both == rank(seen, VELOCITY, accelerometers)

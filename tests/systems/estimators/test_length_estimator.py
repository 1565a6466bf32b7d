"""Estimators 4 to 7: exact lengths give exact poses; what each model leaves out shows."""

import numpy as np
import pytest

from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths, LengthEstimator
from cdpr_drake.systems.estimators.pose_estimator import KnownTag
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.systems.estimators.estimator_bench import PERIOD, RATE, EstimatorBench

EXACT = 1e-8  # m, rad: tolerance of the search for a pose, with lengths of order one
LARGE = 1e-5  # m: well beyond that

TENSIONS = np.array([40.0, 55.0, 60.0, 35.0, 10.0, 20.0, 5.0, 1.0])
X_PC = pose_from_angles(np.array([-0.06, 0.0, 0.01]), np.array([0.1, 3.0, 0.0]))
X_WK = pose_from_angles(np.array([-0.1, 0.2, 0.05]), np.array([0.2, 0.0, 1.0]))


def robot_way(name):
    robot = load_robot(name)
    home = robot.home.transform()
    planar = robot.is_planar()
    step = np.array([0, 0, 0.3, 0.15, -0.1, 0] if planar else [0.1, -0.2, 0.3, 0.15, -0.1, 0.1])
    way = PoseTrajectory((home, home @ exponential(step)), (1.0,))
    return robot, [way.pose(k * PERIOD) for k in range(26)]


def counted(cables, X_WP, tensions, elastic, zero):
    """What encoders would say that started at zero where they started."""
    lengths = cable_paths(X_WP, cables).lengths
    if elastic:
        lengths = unstrained_lengths(lengths, tensions, cables.stiffness)
    return lengths - zero


def run(robot, poses, truth, model, start=None):
    """Errors [m] along a way, with (cables, elastic) of the truth and of the model."""
    m = robot.cable_set().count
    estimator = LengthEstimator(
        start or poses[0], EncoderLengths(*model), RATE, robot.motion_type()
    )
    bench = EstimatorBench(estimator)
    errors = []
    for k, X_WP in enumerate(poses):
        tensions = TENSIONS[:m] * (1.0 + 0.02 * k)
        found = bench.step(
            measured_lengths=counted(truth[0], X_WP, tensions, truth[1], 0.3),
            measured_tensions=tensions,
        )
        errors.append(pose_error(found, X_WP))
    return np.array(errors)


def test_ports_are_these():
    cables = load_robot("acrobot_small").cable_set()
    estimator = LengthEstimator(X_WK, EncoderLengths(cables, True), RATE)
    assert estimator.GetInputPort("measured_lengths").size() == 8
    assert estimator.GetInputPort("measured_tensions").size() == 8
    assert estimator.num_input_ports() == 2
    assert estimator.num_output_ports() == 1


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize("name", ["acrobot_small", "caroca", "planar"])
def test_lengths_of_its_own_model_give_the_exact_pose(name, elastic, pulleys):
    robot, poses = robot_way(name)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    assert np.max(run(robot, poses, (cables, elastic), (cables, elastic))) < EXACT


@pytest.mark.parametrize(
    ("left_out", "truth", "model"),
    [
        ("pulleys", (True, False), (False, False)),
        ("elasticity", (False, True), (False, False)),
    ],
)
def test_what_the_model_leaves_out_is_an_error_on_the_way_but_not_at_the_start(
    left_out, truth, model
):
    robot, poses = robot_way("caroca")
    over, straight = robot.cable_set(), robot.cable_set().without_pulleys()
    cables = {True: over, False: straight}
    errors = run(robot, poses, (cables[truth[0]], truth[1]), (cables[model[0]], model[1]))
    assert np.max(errors[0]) < EXACT, left_out
    assert errors[-1, 0] > LARGE, left_out


def test_only_the_tautest_cables_count():
    robot, poses = robot_way("acrobot_small")
    cables = robot.cable_set().without_pulleys()
    bench = EstimatorBench(LengthEstimator(poses[0], EncoderLengths(cables, False), RATE))
    for k, X_WP in enumerate(poses):
        lengths = counted(cables, X_WP, TENSIONS, False, 0.0)
        lengths[6:] += 0.05 if k else 0.0  # slack in the two that pull least
        found = bench.step(measured_lengths=lengths, measured_tensions=TENSIONS)
        assert max(pose_error(found, X_WP)) < EXACT


def test_a_start_from_a_wrong_pose_stays_wrong_and_jumps_where_the_cables_change():
    """The reference lengths are those of the wrong pose: each six of them tell another pose."""
    robot, poses = robot_way("acrobot_small")
    cables = robot.cable_set().without_pulleys()
    wrong = poses[0] @ exponential(np.array([0.05, 0.02, -0.05, 0.02, -0.02, 0.02]))
    bench = EstimatorBench(LengthEstimator(wrong, EncoderLengths(cables, False), RATE))
    found = []
    for k, X_WP in enumerate(poses):
        # Half-way slack moves from the last two cables to the first two.
        tensions = TENSIONS if k < 13 else TENSIONS[::-1].copy()
        lengths = counted(cables, X_WP, tensions, False, 0.0)
        found.append(bench.step(measured_lengths=lengths, measured_tensions=tensions))
    error = np.array([X.translation() - Y.translation() for X, Y in zip(found, poses, strict=True)])
    steps = np.linalg.norm(np.diff(error, axis=0), axis=1)
    assert np.linalg.norm(error[-1]) > 0.01
    assert steps[12] > 3.0 * np.max(np.delete(steps, 12))


def test_where_no_pose_has_the_lengths_the_last_one_stays():
    robot, poses = robot_way("acrobot_small")
    cables = robot.cable_set().without_pulleys()
    bench = EstimatorBench(LengthEstimator(poses[0], EncoderLengths(cables, False), RATE))
    lengths = counted(cables, poses[0], TENSIONS, False, 0.0)
    bench.step(measured_lengths=lengths, measured_tensions=TENSIONS)
    impossible = lengths * np.array([0.3, 1, 0.3, 1, 0.3, 1, 1, 1])
    found = bench.step(measured_lengths=impossible, measured_tensions=TENSIONS)
    assert max(pose_error(found, poses[0])) < EXACT
    found = bench.step(measured_lengths=lengths, measured_tensions=TENSIONS)
    assert max(pose_error(found, poses[0])) < EXACT


def test_a_known_tag_corrects_the_reference_too():
    robot, poses = robot_way("acrobot_small")
    cables = robot.cable_set().without_pulleys()
    wrong = poses[0] @ exponential(np.array([0.03, 0.0, 0.0, 0.02, 0.0, 0.0]))
    estimator = LengthEstimator(
        wrong, EncoderLengths(cables, False), RATE, known_tag=KnownTag(X_WK, X_PC, 4.0 * PERIOD)
    )
    bench = EstimatorBench(estimator)
    for k, X_WP in enumerate(poses):
        found = bench.step(
            measured_lengths=counted(cables, X_WP, TENSIONS, False, 0.3),
            measured_tensions=TENSIONS,
            X_CK=(X_WP @ X_PC).inverse() @ X_WK,
            # Seen once: what follows is told by the lengths alone.
            known_tag_found=[float(k == 5)],
        )
        error = max(pose_error(found, X_WP))
        assert error < EXACT if k >= 5 else error > LARGE


def test_readings_below_zero_do_not_shorten_cables():
    cables = load_robot("acrobot_small").cable_set()
    counting = EncoderLengths(cables, True)
    pose = load_robot("acrobot_small").home.transform()
    below = np.full(8, -3.0)
    reference = counting.reference(pose, np.zeros(8), below)
    np.testing.assert_array_equal(reference, cable_paths(pose, cables).lengths)
    np.testing.assert_array_equal(counting.lengths(np.zeros(8), reference, below), reference)

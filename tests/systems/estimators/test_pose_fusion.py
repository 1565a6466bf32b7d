"""The fusing estimator as a block: ports, exact data, and an error of the start that it finds."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, logarithm, pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.estimators.pose_fusion import Landmark, PoseFusion, SeenObject
from cdpr_drake.systems.estimators.tuning import FusionSettings
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.vision.apriltags import tag_corners
from tests.systems.estimators.estimator_bench import PERIOD, RATE, EstimatorBench

ROUND_OFF = 1e-9
"""Of poses after a hundred corrections with exact data."""

ROBOT = load_robot("acrobot_small")
CABLES = ROBOT.cable_set().without_pulleys()
X_PC = ROBOT.camera_mount("onboard").pose.transform()
X_WO = RigidTransform([0.2209, -0.197, 0.0])
X_WK = pose_from_angles(np.array([0.15, -0.1, 0.0]), np.array([0.0, 0.0, 0.5]))
START = pose_from_angles(np.array([0.112, -0.032, 0.301]), np.radians([-12.0, -10.0, 0.0]))
GOAL = pose_from_angles(np.array([0.284, -0.197, 0.08]), np.zeros(3))
WRONG = START @ exponential(np.array([0.06, -0.05, 0.04, 0.03, -0.02, 0.02]))
COUNT = 100
WAY = PoseTrajectory((START, GOAL), (COUNT * PERIOD,))
TAG = SeenObject(tag_corners(0.06), 500.0)
TENSIONS = np.full(8, 8.0)
TUNING = FusionSettings(
    start_position=0.05,
    start_rotation_deg=5.0,
    velocity=5e-4,
    angular_velocity_deg=float(np.degrees(1e-3)),
    camera_position=0.0,
    camera_rotation_deg=0.0,
    points=0.0,
    pixel=0.1,
    length=1e-4,
    length_drift=0.0,
    start_slack=0.05,
    taut=0.5,
)


def fusion(X_WP0, **options):
    counted = EncoderLengths(CABLES, True)
    options = {"target": TAG, **options}
    return PoseFusion(X_WP0, X_PC, counted, TUNING, RATE, **options)


def inputs(k, tensions=TENSIONS, **changes):
    """What is read at step k on the way, exactly; and the true pose."""
    X_WP = WAY.pose(k * PERIOD)
    before = WAY.pose(max(k - 1, 0) * PERIOD)
    lengths = cable_paths(X_WP, CABLES).lengths / (1.0 + tensions / CABLES.stiffness)
    read = {
        "platform_velocity": logarithm(before.inverse() @ X_WP) / PERIOD,
        "measured_lengths": lengths,
        "measured_tensions": tensions,
        "X_CO": (X_WP @ X_PC).inverse() @ X_WO,
        "found": [1.0],
    }
    return {**read, **changes}, X_WP


def names_of(estimator):
    return [estimator.get_input_port(i).get_name() for i in range(estimator.num_input_ports())]


def test_ports_are_those_of_what_it_uses():
    always = ["platform_velocity", "measured_lengths", "measured_tensions"]
    assert names_of(fusion(START)) == [*always, "X_CO", "found"]
    assert names_of(fusion(START, target=None)) == always
    known = fusion(START, known=Landmark(TAG, X_WK))
    assert names_of(known) == [*always, "X_CO", "found", "X_CK", "known_tag_found"]


def test_exact_data_keep_the_exact_pose():
    bench = EstimatorBench(fusion(START))
    for k in range(COUNT):
        read, X_WP = inputs(k)
        assert max(pose_error(bench.step(**read), X_WP)) < ROUND_OFF
    belief = bench.estimator.belief(bench.context)
    assert max(pose_error(belief.X_WO, X_WO)) < ROUND_OFF
    assert max(pose_error(belief.X_WP0, START)) < ROUND_OFF


def test_it_finds_an_error_of_the_start():
    """36 mm and 5 degrees, with control, images and lengths that each alone would keep them."""
    bench = EstimatorBench(fusion(WRONG))
    for k in range(COUNT):
        read, X_WP = inputs(k)
        found = bench.step(**read)
    distance, angle = pose_error(found, X_WP)
    start = pose_error(WRONG, START)
    assert distance < 0.05 * start[0]
    assert angle < 0.05 * start[1]
    assert pose_error(bench.estimator.belief(bench.context).X_WP0, START)[0] < 0.1 * start[0]


def test_between_steps_it_moves_on_with_the_velocity():
    bench = EstimatorBench(fusion(START))
    V = np.array([0.1, 0.0, 0.0, 0.02, 0.0, 0.0])
    read, _ = inputs(0, np.zeros(8), platform_velocity=V, found=[0.0])
    bench.step(**read)
    at_step = bench.context.get_time()
    bench.simulator.AdvanceTo(at_step + 0.5 * PERIOD)
    after = bench.read()
    assert pose_error(after, START)[1] == pytest.approx(0.1 * 1.5 * PERIOD, rel=1e-6)


def test_slack_cables_are_not_used():
    """Two cables with 10 cm too much of them, which say themselves that they hang."""
    slack = np.where(np.arange(8) < 2, 0.0, 8.0)
    bench = EstimatorBench(fusion(START))
    for k in range(20):
        read, X_WP = inputs(k, slack)
        read["measured_lengths"][:2] += 0.1
        assert max(pose_error(bench.step(**read), X_WP)) < ROUND_OFF


def test_a_cable_that_was_slack_at_the_start_counts_once_it_is_taut():
    """Its reference is unknown, and learnt: 3 cm of slack do not move the estimate."""
    bench = EstimatorBench(fusion(START))
    for k in range(40):
        read, X_WP = inputs(k, np.where(np.arange(8) < 2, 0.0, 8.0) if k < 10 else TENSIONS)
        read["measured_lengths"] = inputs(k)[0]["measured_lengths"].copy()
        read["measured_lengths"][0] += 0.03
        found = bench.step(**read)
    assert pose_error(found, X_WP)[0] < 3e-3
    assert bench.estimator.belief(bench.context).offsets[0] == pytest.approx(0.0, abs=5e-3)


def test_an_image_counts_once():
    """The same image read at several steps does not make the filter surer of it."""
    read, _ = inputs(0)
    certain = []
    for repeats in (1, 4):
        bench = EstimatorBench(fusion(START, known=Landmark(TAG, X_WK)))
        extra = {"X_CK": (START @ X_PC).inverse() @ X_WK, "known_tag_found": [1.0]}
        slack = {"measured_tensions": np.zeros(8), "platform_velocity": np.zeros(6)}
        for _ in range(repeats):
            bench.step(**{**read, **extra, **slack})
        certain.append(np.trace(bench.estimator.belief(bench.context).covariance[:6, :6]))
    assert certain[1] >= certain[0]


def test_a_known_tag_is_used_whenever_it_is_seen():
    bench = EstimatorBench(fusion(WRONG, known=Landmark(TAG, X_WK)))
    for k in range(6):
        read, X_WP = inputs(k)
        found = bench.step(**read, X_CK=(X_WP @ X_PC).inverse() @ X_WK, known_tag_found=[1.0])
    assert pose_error(found, X_WP)[0] < 0.1 * pose_error(WRONG, START)[0]


def test_a_planar_platform_stays_in_its_plane():
    robot = load_robot("planar")
    mount = robot.camera_mount("onboard").pose.transform()
    X_WP = robot.home.transform()
    cables = robot.cable_set().without_pulleys()
    estimator = PoseFusion(
        X_WP, mount, EncoderLengths(cables, False), TUNING, RATE, target=TAG, planar=True
    )
    bench = EstimatorBench(estimator)
    random = np.random.default_rng(0)
    target = X_WP @ mount @ RigidTransform(np.array([0.0, 0.0, 0.5]))
    for _ in range(20):
        X_CO = (X_WP @ mount).inverse() @ target @ exponential(1e-3 * random.standard_normal(6))
        found = bench.step(
            platform_velocity=np.zeros(6),
            measured_lengths=cable_paths(X_WP, cables).lengths,
            measured_tensions=np.full(len(cables.p_WA.T), 8.0),
            X_CO=X_CO,
            found=[1.0],
        )
    assert found.translation()[2] == pytest.approx(X_WP.translation()[2], abs=1e-9)
    assert abs(found.rotation().matrix()[2, 2] - 1.0) < 1e-9

"""Fusing estimators as blocks: exact data keep exact poses, wrong starts and sources are found."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.estimation.sensor_models import motion_between
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, logarithm, pose_error, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.estimators.fusion_task import CameraModel, FusionTask
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.estimators.pose_fusion import Landmark, PoseFusion, SeenObject
from cdpr_drake.systems.estimators.sensor_fusion import SensorFusion
from cdpr_drake.systems.estimators.sensor_fusion_settings import SensorFusionSettings, ToldObject
from cdpr_drake.systems.estimators.tuning import FusionSettings
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.vision.apriltags import tag_corners
from tests.systems.estimators.estimator_bench import PERIOD, RATE, EstimatorBench

ROUND_OFF = 1e-9
"""Of poses after a hundred corrections with exact data."""

FUSED = 1e-8
"""The same with two cameras, whose mountings are corrected, too."""

ROBOT = load_robot("acrobot_small")
CABLES = ROBOT.cable_set().without_pulleys()
X_PC = ROBOT.camera_mount("onboard").pose.transform()
X_WE = ROBOT.camera_mount("overview").pose.transform()
X_PQ = pose_from_angles(np.array([0.0, -0.1, 0.06]), np.radians([55.0, 0.0, 0.0]))
X_WO = RigidTransform([0.2209, -0.197, 0.0])
X_WK = pose_from_angles(np.array([0.15, -0.1, 0.0]), np.array([0.0, 0.0, 0.5]))
START = pose_from_angles(np.array([0.112, -0.032, 0.301]), np.radians([-12.0, -10.0, 0.0]))
GOAL = pose_from_angles(np.array([0.284, -0.197, 0.08]), np.zeros(3))
WRONG = START @ exponential(np.array([0.06, -0.05, 0.04, 0.03, -0.02, 0.02]))
COUNT = 100
WAY = PoseTrajectory((START, GOAL), (COUNT * PERIOD,))
TAG = SeenObject(tag_corners(0.06), 500.0)
TENSIONS = np.full(8, 8.0)
SLACK = np.where(np.arange(8) < 2, 0.0, 8.0)
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


def inputs(k, tensions=TENSIONS, late=0, way=WAY, **changes):
    """What is read at step k on the way, exactly; and the true pose."""
    X_WP, seen_at = way.pose(k * PERIOD), way.pose(max(k - late, 0) * PERIOD)
    before = way.pose(max(k - 1, 0) * PERIOD)
    read = {
        "platform_velocity": logarithm(before.inverse() @ X_WP) / PERIOD,
        "measured_lengths": cable_paths(X_WP, CABLES).lengths / (1.0 + tensions / CABLES.stiffness),
        "measured_tensions": tensions,
        "X_CO": (X_WP @ X_PC).inverse() @ X_WO,
        "found": [1.0],
        "X_CK": (X_WP @ X_PC).inverse() @ X_WK,
        "known_tag_found": [1.0],
        "X_CQ": X_WE.inverse() @ seen_at @ X_PQ,
        "platform_tag_found": [float(k >= late)],
    }
    return {**read, **changes}, X_WP


def names_of(estimator):
    return [estimator.get_input_port(i).get_name() for i in range(estimator.num_input_ports())]


class Bench(EstimatorBench):
    """Gives an estimator of the values read those that it has ports for."""

    def step(self, **read):
        return super().step(**{name: read[name] for name in names_of(self.estimator)})

    def belief(self):
        return self.estimator.belief(self.context)

    def output(self, name):
        return np.array(self.estimator.GetOutputPort(name).Eval(self.context))


def fusion(X_WP0=START, **options):
    counted = EncoderLengths(CABLES, True)
    return PoseFusion(X_WP0, X_PC, counted, TUNING, RATE, **{"target": TAG, **options})


def eye(size, latency=0.0):
    pinhole = load_camera("astra").pinhole(640, 480)
    return CameraModel(points=tag_corners(size), pinhole=pinhole, rate=RATE, latency=latency)


def sensor_fusion(
    X_WP0=START, *, on_board=True, external=True, lengths=True, latency=0.0, tuning=None, **more
):
    settings = SensorFusionSettings(
        on_board=on_board, external=external, lengths=lengths, steer=False, patience=0.2,
        start_position=0.02, start_rotation_deg=2.0, **(tuning or {}),
    )  # fmt: skip
    return SensorFusion(FusionTask(
        X_WP0=X_WP0, X_PC=X_PC, counted=EncoderLengths(CABLES, True), tuning=settings, rate=RATE,
        on_board=eye(0.06) if on_board else None,
        external=eye(0.12, latency) if external else None, X_WE=X_WE, X_PQ=X_PQ, **more,
    ))  # fmt: skip


@pytest.mark.parametrize("wrong", [False, True])
def test_exact_data_keep_the_exact_pose_and_find_an_error_of_the_start(wrong):
    """36 mm and 5 degrees, with control, images and lengths that each alone would keep them."""
    bench, start = Bench(fusion(WRONG if wrong else START)), pose_error(WRONG, START)
    for k in range(COUNT):
        read, X_WP = inputs(k)
        distance, angle = pose_error(bench.step(**read), X_WP)
        assert wrong or max(distance, angle) < ROUND_OFF
    belief = bench.belief()
    if wrong:
        assert distance < 0.05 * start[0]
        assert angle < 0.05 * start[1]
        assert pose_error(belief.X_WP0, START)[0] < 0.1 * start[0]
    else:
        assert max(pose_error(belief.X_WO, X_WO)) < ROUND_OFF
        assert max(pose_error(belief.X_WP0, START)) < ROUND_OFF


def test_between_steps_a_fused_pose_moves_on_with_the_velocity():
    bench = Bench(fusion())
    V = np.array([0.1, 0.0, 0.0, 0.02, 0.0, 0.0])
    read, _ = inputs(0, np.zeros(8), platform_velocity=V, found=[0.0])
    bench.step(**read)
    at_step = bench.context.get_time()
    bench.simulator.AdvanceTo(at_step + 0.5 * PERIOD)
    after = bench.read()
    assert pose_error(after, START)[1] == pytest.approx(0.1 * 1.5 * PERIOD, rel=1e-6)


def test_slack_cables_are_not_used_and_one_that_becomes_taut_counts_from_then_on():
    """10 cm too much of those that say themselves that they hang; a reference of 3 cm is learnt."""
    bench = Bench(fusion())
    for k in range(40):
        read, X_WP = inputs(k, SLACK if k < 10 else TENSIONS)
        read["measured_lengths"] = inputs(k)[0]["measured_lengths"] + [0.03, *[0.0] * 7]
        if k < 10:
            read["measured_lengths"][1] += 0.1
        found = bench.step(**read)
        assert k >= 10 or max(pose_error(found, X_WP)) < ROUND_OFF
    assert pose_error(found, X_WP)[0] < 3e-3
    assert bench.belief().offsets[0] == pytest.approx(0.0, abs=5e-3)


def test_an_image_counts_once():
    """The same image read at several steps does not make the filter surer of it."""
    read, _ = inputs(0)
    certain = []
    for repeats in (1, 4):
        bench = Bench(fusion(known=Landmark(TAG, X_WK)))
        slack = {"measured_tensions": np.zeros(8), "platform_velocity": np.zeros(6)}
        for _ in range(repeats):
            bench.step(**{**read, **slack})
        certain.append(np.trace(bench.belief().covariance[:6, :6]))
    assert certain[1] >= certain[0]


def test_a_known_tag_is_used_whenever_it_is_seen():
    bench = Bench(fusion(WRONG, known=Landmark(TAG, X_WK)))
    for k in range(6):
        read, X_WP = inputs(k)
        found = bench.step(**read)
    assert pose_error(found, X_WP)[0] < 0.1 * pose_error(WRONG, START)[0]


def test_a_planar_platform_stays_in_its_plane():
    robot = load_robot("planar")
    mount, X_WP = robot.camera_mount("onboard").pose.transform(), robot.home.transform()
    cables = robot.cable_set().without_pulleys()
    counting = EncoderLengths(cables, False)
    bench = Bench(PoseFusion(X_WP, mount, counting, TUNING, RATE, target=TAG, planar=True))
    random = np.random.default_rng(0)
    target = X_WP @ mount @ RigidTransform(np.array([0.0, 0.0, 0.5]))
    for _ in range(20):
        X_CO = (X_WP @ mount).inverse() @ target @ exponential(1e-3 * random.standard_normal(6))
        found = bench.step(
            platform_velocity=np.zeros(6), X_CO=X_CO, found=[1.0],
            measured_lengths=cable_paths(X_WP, cables).lengths, measured_tensions=np.full(4, 8.0),
        )  # fmt: skip
    assert found.translation()[2] == pytest.approx(X_WP.translation()[2], abs=1e-9)
    assert abs(found.rotation().matrix()[2, 2] - 1.0) < 1e-9


SHORT = PoseTrajectory(
    (START, pose_from_angles(np.array([0.2, -0.15, 0.2]), np.zeros(3))), (40 * PERIOD,)
)
"""The way of a filter with two cameras."""


def run(estimator, change=lambda k, read: read, late=0, count=40):
    """Errors of the estimate [m], and what became of the sources, at each step."""
    bench = Bench(estimator)
    errors, sources = [], []
    for k in range(count):
        read, X_WP = inputs(k, late=late, way=SHORT)
        errors.append(pose_error(bench.step(**change(k, read)), X_WP)[0])
        sources.append(bench.output("fusion_sources"))
    return np.array(errors), np.array(sources), bench


@pytest.mark.parametrize("late", [0, 2])
def test_exact_data_of_all_sensors_keep_the_exact_pose_also_of_late_images(late):
    errors, sources, bench = run(sensor_fusion(latency=late * PERIOD), late=late)
    assert np.max(errors) < FUSED
    np.testing.assert_array_equal(sources[late:, :3], 1.0)
    assert bench.output("fused_found")[0] == 1.0


def test_an_image_whose_lateness_nobody_knows_spoils_the_pose():
    """The same late images, taken for new ones: the error that remembered poses avoid."""
    alone = {"on_board": False, "lengths": False, "tuning": {"gate": 0.0}}
    errors, *_ = run(sensor_fusion(**alone), late=2)
    known, *_ = run(sensor_fusion(**alone, latency=2 * PERIOD), late=2)
    assert np.max(known) < FUSED
    assert np.max(errors[20:]) > 1e-3
    wrong = START @ exponential(np.array([0.02, -0.03, 0.02, 0.015, -0.01, 0.01]))
    errors, *_ = run(sensor_fusion(wrong, lengths=False))
    assert errors[-1] < 0.3 * pose_error(wrong, START)[0]


def off(read):
    """Sees something else, 5 cm beside the object."""
    return {"X_CO": RigidTransform(np.array([0.05, 0.0, 0.0])) @ read["X_CO"]}


FAULTS = {
    "frozen": (lambda read: {"X_CO": inputs(10, way=SHORT)[0]["X_CO"]}, 0.0),
    "covered": (lambda read: {"found": [0.0], "X_CO": RigidTransform()}, 0.0),
    "off": (off, -1.0),  # for four steps, shorter than the patience
}
"""What a camera reads then, and what is said of it."""


@pytest.mark.parametrize("fault", FAULTS)
def test_a_camera_that_is_wrong_is_not_used_and_the_other_goes_on(fault):
    change, said = FAULTS[fault]
    faulty = range(10, 14 if fault == "off" else 20)
    errors, sources, _ = run(
        sensor_fusion(), lambda k, read: {**read, **(change(read) if k in faulty else {})}, count=20
    )
    assert np.max(errors) < FUSED
    np.testing.assert_array_equal(sources[12 : faulty.stop, 0], said)
    np.testing.assert_array_equal(sources[faulty.stop :, 0], 1.0)
    np.testing.assert_array_equal(sources[12:, 1], 1.0)


def test_a_camera_out_of_calibration_is_found_out_and_calibrated():
    """The external camera is hit at step 15 and stands 2 cm and 1 degree off from then on."""
    hit = exponential(np.array([0.0, np.radians(1.0), 0.0, 0.02, 0.0, 0.0]))

    def moved(k, read):
        return {**read, "X_CQ": hit @ read["X_CQ"]} if k >= 15 else read

    errors, sources, bench = run(sensor_fusion(), moved)
    assert np.max(errors) < 2e-3
    assert np.all(sources[15:19, 1] == -1.0)
    assert np.all(sources[25:, 1] == 1.0)
    distance, angle = pose_error(bench.belief().X_WE, X_WE @ hit.inverse())
    assert distance < 0.5 * pose_error(hit, RigidTransform())[0] + 5e-3
    assert angle < np.radians(0.5)


def test_told_where_the_object_is_it_knows_before_it_sees():
    told = {"told_object": ToldObject()}
    estimator = sensor_fusion(on_board=False, external=False, X_WO=X_WO, tuning=told)
    _, _, bench = run(estimator, count=2)
    assert bench.output("fused_found")[0] == 1.0
    blind = sensor_fusion(on_board=False, external=False)
    _, _, bench = run(blind, count=2)
    assert bench.output("fused_found")[0] == 0.0


def test_what_an_imu_off_the_origin_feels_is_turned_to_the_origin():
    """A turn about the origin at a constant rate, and a push, as the definition has them."""
    p_PS, elapsed = np.array([0.05, -0.02, 0.03]), 0.1
    rate, push = np.array([0.3, -0.2, 0.5]), np.array([0.4, 0.1, -0.2])

    def motion(time):
        R = exponential(np.concatenate([rate * time, np.zeros(3)])).rotation().matrix()
        # So less where it was and how it moved at first, as accelerations add up.
        position = 0.5 * push * time**2 + R @ p_PS - p_PS - np.cross(rate, p_PS) * time
        velocity = push * time + R @ np.cross(rate, p_PS) - np.cross(rate, p_PS)
        return np.concatenate([R.ravel(), velocity, position, rate, [time]])

    felt = motion_between(motion(0.2), motion(0.2 + elapsed), p_PS)
    R = exponential(np.concatenate([rate * 0.2, np.zeros(3)])).rotation().matrix()
    assert felt.elapsed == pytest.approx(elapsed)
    np.testing.assert_allclose(felt.velocity, R.T @ push * elapsed, atol=1e-12)
    np.testing.assert_allclose(felt.position, R.T @ push * 0.5 * elapsed**2, atol=1e-12)

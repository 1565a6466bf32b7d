"""The fusing filter as a block: what it uses, what it leaves out, and what it does meanwhile."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.estimation.sensor_models import motion_between
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, logarithm, pose_error, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.sensor_catalogue import load_inertial_sensor
from cdpr_drake.systems.estimators.fusion_task import CameraModel, FusionTask
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.estimators.sensor_fusion import SensorFusion
from cdpr_drake.systems.estimators.sensor_fusion_settings import SensorFusionSettings, ToldObject
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.vision.apriltags import tag_corners
from tests.systems.estimators.estimator_bench import PERIOD, RATE, EstimatorBench

ROUND_OFF = 1e-8
"""Of poses after some dozens of corrections with exact data."""

ROBOT = load_robot("acrobot_small")
CABLES = ROBOT.cable_set().without_pulleys()
X_PC = ROBOT.camera_mount("onboard").pose.transform()
X_WE = ROBOT.camera_mount("overview").pose.transform()
X_PQ = pose_from_angles(np.array([0.0, -0.1, 0.06]), np.radians([55.0, 0.0, 0.0]))
X_WO = RigidTransform([0.2209, -0.197, 0.0])
START = pose_from_angles(np.array([0.112, -0.032, 0.301]), np.radians([-12.0, -10.0, 0.0]))
GOAL = pose_from_angles(np.array([0.2, -0.15, 0.2]), np.zeros(3))
COUNT = 40
WAY = PoseTrajectory((START, GOAL), (COUNT * PERIOD,))
TENSIONS = np.full(8, 8.0)
PINHOLE = load_camera("astra").pinhole(640, 480)


def eye(size, latency=0.0, rate=RATE, **more):
    return CameraModel(
        points=tag_corners(size), pinhole=PINHOLE, rate=rate, latency=latency, **more
    )


def fusion(X_WP0=START, *, on_board=True, external=True, lengths=True, latency=0.0, **more):
    tuning = SensorFusionSettings(
        on_board=on_board,
        external=external,
        lengths=lengths,
        steer=False,
        patience=0.2,
        start_position=0.02,
        start_rotation_deg=2.0,
    )
    for name in ("told_object", "gate"):
        if name in more:
            setattr(tuning, name, more.pop(name))
    task = FusionTask(
        X_WP0=X_WP0,
        X_PC=X_PC,
        counted=EncoderLengths(CABLES, True),
        tuning=tuning,
        rate=RATE,
        on_board=eye(0.06) if on_board else None,
        external=eye(0.12, latency) if external else None,
        X_WE=X_WE,
        X_PQ=X_PQ,
        **more,
    )
    return SensorFusion(task)


def inputs(k, late=0):
    """What is read at step k on the way, exactly; and the true pose."""
    X_WP, seen_at = WAY.pose(k * PERIOD), WAY.pose(max(k - late, 0) * PERIOD)
    before = WAY.pose(max(k - 1, 0) * PERIOD)
    lengths = cable_paths(X_WP, CABLES).lengths / (1.0 + TENSIONS / CABLES.stiffness)
    read = {
        "platform_velocity": logarithm(before.inverse() @ X_WP) / PERIOD,
        "measured_lengths": lengths,
        "measured_tensions": TENSIONS,
        "X_CO": (X_WP @ X_PC).inverse() @ X_WO,
        "found": [1.0],
        "X_CQ": X_WE.inverse() @ seen_at @ X_PQ,
        "platform_tag_found": [float(k >= late)],
    }
    return read, X_WP


def run(estimator, change=lambda k, read: read, late=0, count=COUNT):
    """Errors of the estimate [m], and what became of the sources, at each step."""
    bench = EstimatorBench(estimator)
    names = [estimator.get_input_port(i).get_name() for i in range(estimator.num_input_ports())]
    errors, sources = [], []
    for k in range(count):
        read, X_WP = inputs(k, late)
        read = change(k, read)
        errors.append(pose_error(bench.step(**{n: read[n] for n in names}), X_WP)[0])
        sources.append(np.array(estimator.GetOutputPort("fusion_sources").Eval(bench.context)))
    return np.array(errors), np.array(sources), bench


def test_ports_are_those_of_its_sources():
    def names(estimator):
        return {estimator.get_input_port(i).get_name() for i in range(estimator.num_input_ports())}

    assert names(fusion(external=False, lengths=False)) == {"platform_velocity", "X_CO", "found"}
    assert names(fusion(on_board=False)) == {
        "platform_velocity",
        "measured_lengths",
        "measured_tensions",
        "X_CQ",
        "platform_tag_found",
    }
    imu = fusion(imu=load_inertial_sensor("ideal"), gravity=np.array([0.0, 0.0, -9.81]))
    assert "inertial_motion" in names(imu)


@pytest.mark.parametrize("late", [0, 2])
def test_exact_data_keep_the_exact_pose_also_of_late_images(late):
    errors, sources, bench = run(fusion(latency=late * PERIOD), late=late)
    assert np.max(errors) < ROUND_OFF
    np.testing.assert_array_equal(sources[late:, :3], 1.0)
    assert bench.estimator.GetOutputPort("fused_found").Eval(bench.context)[0] == 1.0


def test_an_image_whose_lateness_nobody_knows_spoils_the_pose():
    """The same late images, taken for new ones: the error that remembered poses avoid."""
    alone = {"on_board": False, "lengths": False, "gate": 0.0}
    errors, *_ = run(fusion(**alone), late=2)
    known, *_ = run(fusion(**alone, latency=2 * PERIOD), late=2)
    assert np.max(known) < ROUND_OFF
    assert np.max(errors[COUNT // 2 :]) > 1e-3


def test_an_external_camera_finds_an_error_of_the_start():
    wrong = START @ exponential(np.array([0.02, -0.03, 0.02, 0.015, -0.01, 0.01]))
    errors, *_ = run(fusion(wrong, lengths=False))
    assert errors[-1] < 0.3 * pose_error(wrong, START)[0]


def test_a_frozen_or_covered_camera_is_not_used_and_the_other_goes_on():
    still = inputs(10)[0]

    def frozen(k, read):
        return {**read, "X_CO": still["X_CO"]} if k >= 10 else read

    def covered(k, read):
        return {**read, "found": [0.0], "X_CO": RigidTransform()} if k >= 10 else read

    for change in (frozen, covered):
        errors, sources, _ = run(fusion(), change, count=20)
        assert np.max(errors) < ROUND_OFF
        np.testing.assert_array_equal(sources[12:, 0], 0.0)
        np.testing.assert_array_equal(sources[12:, 1], 1.0)


def test_a_camera_that_sees_something_else_is_left_out():
    """5 cm beside the object for four steps, shorter than the patience."""

    def off(k, read):
        aside = RigidTransform(np.array([0.05, 0.0, 0.0]))
        return {**read, "X_CO": aside @ read["X_CO"]} if 20 <= k < 24 else read

    errors, sources, _ = run(fusion(), off, count=30)
    assert np.max(errors) < ROUND_OFF
    np.testing.assert_array_equal(sources[20:24, 0], -1.0)
    np.testing.assert_array_equal(sources[24:, 0], 1.0)


def test_a_camera_out_of_calibration_is_found_out_and_calibrated():
    """The external camera is hit at step 15 and stands 2 cm and 1 degree off from then on."""
    hit = exponential(np.array([0.0, np.radians(1.0), 0.0, 0.02, 0.0, 0.0]))

    def moved(k, read):
        return {**read, "X_CQ": hit @ read["X_CQ"]} if k >= 15 else read

    errors, sources, bench = run(fusion(), moved)
    assert np.max(errors) < 2e-3
    assert np.all(sources[15:19, 1] == -1.0)
    assert np.all(sources[25:, 1] == 1.0)
    distance, angle = pose_error(bench.estimator.belief(bench.context).X_WE, X_WE @ hit.inverse())
    assert distance < 0.5 * pose_error(hit, RigidTransform())[0] + 5e-3
    assert angle < np.radians(0.5)


def test_told_where_the_object_is_it_knows_before_it_sees():
    estimator = fusion(on_board=False, external=False, X_WO=X_WO, told_object=ToldObject())
    _, _, bench = run(estimator, count=2)
    assert estimator.GetOutputPort("fused_found").Eval(bench.context)[0] == 1.0
    blind = fusion(on_board=False, external=False)
    _, _, bench = run(blind, count=2)
    assert blind.GetOutputPort("fused_found").Eval(bench.context)[0] == 0.0


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

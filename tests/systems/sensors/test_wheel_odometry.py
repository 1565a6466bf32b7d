"""Odometry of a robot on a track that is known: right without errors, wrong by them."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.sections.perception.wheel_odometry import WheelModel, WheelOdometry, arc_end
from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion, RoundedTrack

TRACK = RoundedTrack(length=0.26, width=0.16, corner_radius=0.05)
START = RigidTransform([0.1, -0.2, 0.05])
MOTION = MobileRobotMotion(START, TRACK, wheel_base=0.06, lap_time=16.0)
FINE = 10**9
"""Counts of an encoder that rounds nothing."""


def odometry(duration, rate=50.0, seed=0, **wheels):
    model = WheelModel(**({"radius": 0.02, "counts_per_turn": FINE} | wheels))
    sensor = WheelOdometry(MOTION, model, seed=seed, rate=rate)
    simulator = Simulator(sensor)
    simulator.AdvanceTo(duration + 0.5 / rate)
    context = simulator.get_context()
    pose = sensor.GetOutputPort("X_WO_odometry").Eval(context)
    return pose, sensor.GetOutputPort("wheel_distances").Eval(context)


def test_wheels_roll_as_their_speeds_say():
    """The distances are the integral of the speeds, and of laps the perimeter."""
    times = np.linspace(0.0, 21.0, 20001)
    speeds = np.array([MOTION.wheel_speeds(t) for t in times])
    rolled = np.array(MOTION.wheel_distances(21.0))
    np.testing.assert_allclose(rolled, np.trapezoid(speeds, times, axis=0), atol=1e-4)
    left, right = MOTION.wheel_distances(32.0)
    assert 0.5 * (left + right) == pytest.approx(2.0 * TRACK.perimeter(), rel=1e-12)
    assert right - left == pytest.approx(2.0 * 2.0 * np.pi * 0.06, rel=1e-12)


def test_without_errors_it_is_right_on_a_straight():
    (pose, rolled), time = odometry(1.0), 1.0
    position, rotation = pose_error(pose, MOTION.at(time))
    assert position < 1e-9
    assert rotation < 1e-9
    np.testing.assert_allclose(rolled, MOTION.wheel_distances(time), atol=1e-9)


def test_an_arc_is_a_circle():
    """A quarter turn of radius 0.5 to the left, and back to where it was."""
    quarter = 0.5 * np.pi
    place = arc_end(np.zeros(3), quarter * 0.45, quarter * 0.55, 0.1)
    np.testing.assert_allclose(place, [0.5, 0.5, quarter], atol=1e-12)
    np.testing.assert_allclose(
        arc_end(place, -quarter * 0.45, -quarter * 0.55, 0.1), np.zeros(3), atol=1e-12
    )
    np.testing.assert_allclose(arc_end(np.zeros(3), 0.3, 0.3, 0.1), [0.3, 0.0, 0.0])


def test_without_errors_a_lap_costs_only_where_straights_end():
    """And the less the oftener it counts: the error falls with the square of the period."""
    errors = [pose_error(odometry(16.0, rate)[0], MOTION.at(16.0))[0] for rate in (7.3, 73.0)]
    assert errors[0] < 2e-3
    assert errors[1] < 0.1 * errors[0]


def test_wheels_that_are_too_large_drive_too_far():
    """Both by one per cent is a track larger by one per cent, the heading turned by as much."""
    sensor = WheelOdometry(MOTION, WheelModel(radius=0.02, counts_per_turn=FINE), rate=50.0)
    sensor._scale = np.array([1.01, 1.01])
    sample = sensor.nothing()
    for number in range(1, 52):
        truth = np.array(MOTION.wheel_distances((number - 1) / 50.0))
        sample = sensor.next_sample(sample, truth, number)
    moved = sensor.reading(sample).translation() - START.translation()
    exact = MOTION.at(1.0).translation() - START.translation()
    np.testing.assert_allclose(moved, 1.01 * exact, atol=1e-9)


def test_slip_and_scale_drift_by_their_sizes_and_seeds():
    """Distance rolled: relative error of the scale, and root of the way for slip."""
    way = np.array(MOTION.wheel_distances(16.0))
    many = range(40)
    slipped = np.array([odometry(16.0, 2.0, seed, slip=0.002)[1] - way for seed in many])
    root = 0.002 * np.sqrt(way)
    np.testing.assert_allclose(np.std(slipped, axis=0) / root, [1.0, 1.0], atol=0.5)
    scaled = np.array([odometry(16.0, 2.0, seed, scale_error=0.01)[1] - way for seed in many])
    np.testing.assert_allclose(np.std(scaled, axis=0) / (0.01 * way), [1.0, 1.0], atol=0.5)
    again, _ = odometry(16.0, 10.0, 7, slip=0.002, scale_error=0.01)
    same, _ = odometry(16.0, 10.0, 7, slip=0.002, scale_error=0.01)
    other, _ = odometry(16.0, 10.0, 8, slip=0.002, scale_error=0.01)
    assert again.IsExactlyEqualTo(same)
    assert pose_error(again, other)[0] > 1e-4


def test_encoders_count_whole_steps():
    _, rolled = odometry(3.0, counts_per_turn=100)
    step = 2.0 * np.pi * 0.02 / 100
    np.testing.assert_allclose(rolled / step, np.round(rolled / step), atol=1e-9)
    assert np.max(np.abs(rolled - MOTION.wheel_distances(3.0))) <= 0.5 * step + 1e-12

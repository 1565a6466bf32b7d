"""Sensors of tensions, drums, poses and depths: errors of their types, by statistics and by hand.

Ports, held samples and seeds of all of them are one table.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator

from cdpr_drake.errors import SensorError
from cdpr_drake.geometry.poses import pose_from_angles, rotation_vector
from cdpr_drake.models.camera_catalogue import CameraFault
from cdpr_drake.models.sensor_catalogue import (
    EncoderModel,
    load_depth_sensor,
    load_pose_sensor,
    load_tension_sensor,
)
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.sensors.depth_at_points import DepthAtPoints
from cdpr_drake.systems.sensors.motor_encoders import MotorEncoders
from cdpr_drake.systems.sensors.pose_sensor import PoseSensor
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.winches.drum import Drum

TENSIONS = np.array([2.0, 10.0, 60.0, 0.0])
VLU850, TRACTEL = load_tension_sensor("vlu850"), load_tension_sensor("tractel")
VIVE = load_pose_sensor("vive")
X_WP = RigidTransform(RollPitchYaw(0.2, -0.1, 0.3), [0.3, -0.2, 0.4])
REFERENCE = np.array([1.0, 1.5, 0.8])
DRUM = Drum(radius=0.041, gear_ratio=10.0, layer_turns=4.0, layer_height=0.002, wound=1.2)
COARSE = EncoderModel(name="coarse", title="", source="", counts_per_turn=100, rate_hz=1000.0)


def readings(sensor, source, value, port, times):
    """Values of a port at some times, of a sensor whose input is held."""
    simulator = Simulator(sensor)
    context = simulator.get_mutable_context()
    sensor.GetInputPort(source).FixValue(context, value)
    rows = []
    for time in times:
        simulator.AdvanceTo(time)
        row = sensor.GetOutputPort(port).Eval(context)
        rows.append(row.copy() if isinstance(row, np.ndarray) else RigidTransform(row))
    return rows


def tensions(sensor, times, truth=TENSIONS):
    return np.array(readings(sensor, "tensions", truth, "measured_tensions", times))


def pose_errors(sensor, times, X=X_WP):
    """Errors of position in W and rotation vectors in P, shape (n, 3) each."""
    rows = readings(sensor, "X_WP", Value(X), "X_WP_measured", times)
    shifts = [row.translation() - X.translation() for row in rows]
    turns = [rotation_vector(X.rotation().inverse() @ row.rotation()) for row in rows]
    return np.array(shifts), np.array(turns)


PORTS = {
    "tension": (
        TensionSensor(VLU850, 8),
        {"tensions": 8},
        {"measured_tensions": 8},
    ),
    "encoders": (
        MotorEncoders(COARSE, DRUM, REFERENCE),
        {"unstrained_lengths": 3},
        {"motor_angles": 3, "measured_lengths": 3},
    ),
    "pose": (PoseSensor(VIVE), {"X_WP": 0}, {"X_WP_measured": 0}),
}


@pytest.mark.parametrize("name", PORTS)
def test_ports_of_a_sensor_are_public(name):
    sensor, inputs, outputs = PORTS[name]
    groups = (
        [sensor.get_input_port(i) for i in range(sensor.num_input_ports())],
        [sensor.get_output_port(i) for i in range(sensor.num_output_ports())],
    )
    found = [{port.get_name(): port.size() for port in group} for group in groups]
    assert found == [inputs, outputs]


def of_tension(seed):
    return tensions(TensionSensor(VLU850, 4, seed=seed, rate=10.0), [0.0, 0.09, 0.11])


def of_pose(seed):
    return pose_errors(PoseSensor(VIVE, seed=seed, rate=10.0), [0.0, 0.09, 0.11])[0]


@pytest.mark.parametrize("read", [of_tension, of_pose])
def test_readings_hold_between_samples_and_repeat_with_the_seed(read):
    first, again, other = (read(seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert np.all(first != other)
    np.testing.assert_array_equal(first[0], first[1])
    assert np.all(first[1] != first[2])


def test_tensions_have_the_statistics_of_their_type():
    sensor = TensionSensor(VLU850, 4, seed=3, rate=100.0)
    error = tensions(sensor, np.arange(1.0, 401.0) / 100.0) - TENSIONS
    assert np.all(np.abs(sensor.offsets()) <= VLU850.accuracy)
    # Four standard deviations of a mean and of a standard deviation of n normal numbers.
    n, sigma = len(error), VLU850.repeatability
    assert np.max(np.abs(error.mean(axis=0) - sensor.offsets())) < 4.0 * sigma / np.sqrt(n)
    assert np.max(np.abs(error.std(axis=0) - sigma)) < 4.0 * sigma / np.sqrt(2.0 * n)


def test_constant_errors_are_uniform_over_the_accuracy():
    offsets = np.concatenate([TensionSensor(VLU850, 8, seed=s).offsets() for s in range(250)])
    share = np.mean(np.abs(offsets) < 0.5 * VLU850.accuracy)
    # A share of one half of 2000: four standard deviations are 0.045.
    assert share == pytest.approx(0.5, abs=0.045)
    assert np.max(np.abs(offsets)) > 0.99 * VLU850.accuracy


def test_slack_cables_show_what_was_reported_on_caroca():
    slack = np.array([120.0, 90.0, 90.0, 50.0, 90.0, 100.0, 0.0, -20.0])
    sensor = TensionSensor(TRACTEL, 8, seed=1, slack_readings=slack)
    shown = tensions(sensor, [0.0], np.zeros(8))[0]
    assert np.all(np.abs(shown - slack) <= TRACTEL.accuracy + 5.0 * TRACTEL.repeatability)
    plain = TensionSensor(TRACTEL, 8, seed=1).offsets()
    np.testing.assert_allclose(sensor.offsets() - plain, slack, atol=1e-12)


def test_tensions_end_at_the_range():
    rows = tensions(TensionSensor(VLU850, 2, rate=10.0), [0.0, 0.1], np.array([500.0, 5.0]))
    assert np.all(rows[:, 0] == 75.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rate": 0.0}, "rate of a sensor: found 0"),
        ({"slack_readings": np.zeros(3)}, "slack_readings: found 3 numbers; accepted: one per"),
    ],
)
def test_settings_of_a_tension_sensor_that_cannot_be_are_named(options, words):
    with pytest.raises(SensorError, match=words):
        TensionSensor(VLU850, 4, **options)


def encoded(encoders, lengths):
    """Angles and lengths that encoders give of unstrained lengths."""
    sample = encoders.measure(np.asarray(lengths), 1)
    return sample[:3], sample[3:]


@given(st.lists(st.floats(-0.5, 0.5), min_size=3, max_size=3))
def test_lengths_are_right_to_half_a_count(paid_out):
    lengths, count = REFERENCE + np.array(paid_out), 2.0 * np.pi / 100
    angles, found = encoded(MotorEncoders(COARSE, DRUM, REFERENCE), lengths)
    np.testing.assert_allclose(angles / count, np.round(angles / count), atol=1e-9)
    largest = 0.5 * count * np.max(DRUM.length_per_angle(angles + np.array([[-count], [count]])))
    assert np.max(np.abs(found - lengths)) <= largest * (1.0 + 1e-9)


def test_a_controller_that_ignores_the_layers_is_wrong_by_them():
    plain = Drum(radius=0.041, gear_ratio=10.0)
    fine = EncoderModel(name="fine", title="", source="", counts_per_turn=2**24, rate_hz=1000.0)
    lengths = REFERENCE + 0.3
    _, found = encoded(MotorEncoders(fine, DRUM, REFERENCE, plain), lengths)
    turned = DRUM.motor_angles(np.full(3, 0.3))
    np.testing.assert_allclose(found, REFERENCE + 0.0041 * turned, atol=1e-8)
    assert np.all(np.abs(found - lengths) > 1e-3)


def test_samples_of_encoders_arrive_on_the_ports():
    for port, expected in (("motor_angles", np.zeros(3)), ("measured_lengths", REFERENCE)):
        encoders = MotorEncoders(COARSE, DRUM, REFERENCE, rate=50.0)
        (found,) = readings(encoders, "unstrained_lengths", REFERENCE, port, [0.01])
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)


def test_metrology_is_right_to_its_accuracy():
    model = load_pose_sensor("c_track")
    shifts, turns = pose_errors(PoseSensor(model, seed=2), np.arange(1.0, 301.0) / 80.0)
    n = len(shifts)
    for values, accuracy, sigma in (
        (shifts, model.position_accuracy, model.position_repeatability),
        (turns, *np.radians([model.rotation_accuracy_deg, model.rotation_repeatability_deg])),
    ):
        mean_error = abs(np.linalg.norm(values.mean(axis=0)) - accuracy)
        assert mean_error < 4.0 * sigma * np.sqrt(3.0 / n)
        assert np.max(np.abs(values.std(axis=0) - sigma)) < 4.0 * sigma / np.sqrt(2.0 * n)


def test_a_tracker_is_right_where_it_was_registered_and_wrong_elsewhere():
    times = np.arange(1.0, 101.0) / VIVE.rate_hz
    noise = 4.0 * VIVE.position_repeatability * np.sqrt(3.0 / len(times))
    for away, expected in ((0.0, 0.0), (0.5, 0.5 * VIVE.error_per_distance)):
        X_WK = RigidTransform(X_WP.rotation(), X_WP.translation() + np.array([0.0, away, 0.0]))
        shifts, _ = pose_errors(PoseSensor(VIVE, X_WK=X_WK, seed=4), times)
        assert abs(np.linalg.norm(shifts.mean(axis=0)) - expected) < noise, away


def test_before_the_first_sample_a_pose_sensor_holds_the_identity():
    sensor = PoseSensor(VIVE)
    pose = sensor.GetOutputPort("X_WP_measured").Eval(sensor.CreateDefaultContext())
    assert pose.IsExactlyIdentity()


PINHOLE = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(49.5))


def depths(kind="kinect", **more):
    """The sensor of depths of a tag's points, at the origin."""
    mounting = CameraMounting(RigidTransform(), RigidTransform())
    model, tag = load_depth_sensor(kind), TagTarget(0, 0.12)
    return DepthAtPoints(model, tag, mounting, PINHOLE, 30.0, **more)


def ahead(distance, aside=0.0):
    return pose_from_angles(np.array([aside, 0.0, distance]), np.radians([180.0, 0.0, 0.0]))


@pytest.mark.parametrize("distance", [1.0, 2.0, 4.0])
def test_noise_of_depths_grows_with_the_square_of_depth(distance):
    """The 1.425 mm at 1 m of the Kinect, within five deviations of a deviation of 800 numbers."""
    sensor = depths()
    read = np.array([sensor.measure(ahead(distance), number) for number in range(200)])
    expected = 1.425e-3 * distance**2
    assert np.std(read - distance) == pytest.approx(expected, rel=5.0 / np.sqrt(2.0 * read.size))


@pytest.mark.parametrize("place", [ahead(0.3), ahead(1.0, aside=5.0)])
def test_outside_its_limits_or_the_image_a_depth_is_nothing(place):
    np.testing.assert_array_equal(depths().measure(place, 1), 0.0)


def test_depths_are_late_as_their_camera_and_blind_with_it():
    fault = CameraFault(kind="dead", start=0.1, duration=0.05)
    sensor = depths("ideal", latency_frames=1, fault=fault)
    times = np.arange(1, 7) / 30.0 - 1e-6
    read = np.array(readings(sensor, "X_WP", ahead(1.0), "depths", times))[:, 0]
    # Images at 0 (twice, at the start), 1/30, ...; those of 3/30 and 4/30 are covered.
    assert read[1:] == pytest.approx([1.0, 1.0, 1.0, 0.0, 0.0])

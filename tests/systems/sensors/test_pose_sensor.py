"""Pose sensors: ports, accuracy and repeatability, growth of the tracker's bias, events."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.poses import rotation_vector
from cdpr_drake.models.sensor_catalogue import load_pose_sensor
from cdpr_drake.systems.sensors.pose_sensor import PoseSensor

X_WP = RigidTransform(RollPitchYaw(0.2, -0.1, 0.3), [0.3, -0.2, 0.4])


def errors(sensor, times, X=X_WP):
    """Errors of position in W and rotation vectors in P, shape (n, 3) each."""
    simulator = Simulator(sensor)
    context = simulator.get_mutable_context()
    sensor.GetInputPort("X_WP").FixValue(context, Value(X))
    shifts, turns = [], []
    for time in times:
        simulator.AdvanceTo(time)
        measured = sensor.GetOutputPort("X_WP_measured").Eval(context)
        shifts.append(measured.translation() - X.translation())
        turns.append(rotation_vector(X.rotation().inverse() @ measured.rotation()))
    return np.array(shifts), np.array(turns)


def test_ports_are_these():
    sensor = PoseSensor(load_pose_sensor("vive"))
    assert (sensor.num_input_ports(), sensor.num_output_ports()) == (1, 1)
    sensor.GetInputPort("X_WP")
    sensor.GetOutputPort("X_WP_measured")


def test_metrology_is_right_to_its_accuracy():
    model = load_pose_sensor("c_track")
    shifts, turns = errors(PoseSensor(model, seed=2), np.arange(1.0, 301.0) / 80.0)
    n = len(shifts)
    for values, accuracy, sigma in (
        (shifts, model.position_accuracy, model.position_repeatability),
        (turns, *np.radians([model.rotation_accuracy_deg, model.rotation_repeatability_deg])),
    ):
        mean_error = abs(np.linalg.norm(values.mean(axis=0)) - accuracy)
        assert mean_error < 4.0 * sigma * np.sqrt(3.0 / n)
        assert np.max(np.abs(values.std(axis=0) - sigma)) < 4.0 * sigma / np.sqrt(2.0 * n)


def test_the_tracker_is_right_where_it_was_registered_and_wrong_elsewhere():
    model = load_pose_sensor("vive")
    times = np.arange(1.0, 101.0) / model.rate_hz
    here, _ = errors(PoseSensor(model, X_WK=X_WP, seed=4), times)
    noise = 4.0 * model.position_repeatability * np.sqrt(3.0 / len(times))
    assert np.linalg.norm(here.mean(axis=0)) < noise
    X_WK = RigidTransform(X_WP.rotation(), X_WP.translation() + np.array([0.0, 0.5, 0.0]))
    far, _ = errors(PoseSensor(model, X_WK=X_WK, seed=4), times)
    assert abs(np.linalg.norm(far.mean(axis=0)) - 0.5 * model.error_per_distance) < noise


def test_measurements_hold_between_samples_and_repeat_with_the_seed():
    model = load_pose_sensor("vive")
    runs = [errors(PoseSensor(model, seed=s, rate=10.0), [0.0, 0.09, 0.11])[0] for s in (1, 1, 2)]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.all(runs[0] != runs[2])
    np.testing.assert_array_equal(runs[0][0], runs[0][1])
    assert np.any(runs[0][1] != runs[0][2])


def test_before_the_first_sample_the_port_holds_the_identity():
    sensor = PoseSensor(load_pose_sensor("vive"))
    context = sensor.CreateDefaultContext()
    assert sensor.GetOutputPort("X_WP_measured").Eval(context).IsExactlyIdentity()

"""Tension sensors: ports, constant errors, noise, range, what slack cables show, events."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from cdpr_drake.errors import SensorError
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor

TENSIONS = np.array([2.0, 10.0, 60.0, 0.0])


def readings(sensor, times, tensions=TENSIONS):
    simulator = Simulator(sensor)
    sensor.GetInputPort("tensions").FixValue(simulator.get_mutable_context(), tensions)
    rows = []
    for time in times:
        simulator.AdvanceTo(time)
        row = sensor.GetOutputPort("measured_tensions").Eval(simulator.get_context())
        rows.append(row.copy())
    return np.array(rows)


def test_ports_are_these():
    sensor = TensionSensor(load_tension_sensor("vlu850"), 8)
    assert [sensor.get_input_port(i).get_name() for i in range(1)] == ["tensions"]
    assert sensor.num_output_ports() == 1
    assert sensor.GetOutputPort("measured_tensions").size() == 8


def test_statistics_are_those_of_the_type():
    model = load_tension_sensor("vlu850")
    sensor = TensionSensor(model, 4, seed=3, rate=100.0)
    error = readings(sensor, np.arange(1.0, 401.0) / 100.0) - TENSIONS
    n = len(error)
    assert np.all(np.abs(sensor.offsets()) <= model.accuracy)
    # Four standard deviations of a mean and of a standard deviation of n normal numbers.
    sigma = model.repeatability
    assert np.max(np.abs(error.mean(axis=0) - sensor.offsets())) < 4.0 * sigma / np.sqrt(n)
    assert np.max(np.abs(error.std(axis=0) - sigma)) < 4.0 * sigma / np.sqrt(2.0 * n)


def test_constant_errors_are_uniform_over_the_accuracy():
    model = load_tension_sensor("vlu850")
    offsets = np.concatenate([TensionSensor(model, 8, seed=s).offsets() for s in range(250)])
    share = np.mean(np.abs(offsets) < 0.5 * model.accuracy)
    # A share of one half of 2000: four standard deviations are 0.045.
    assert share == pytest.approx(0.5, abs=0.045)
    assert np.max(np.abs(offsets)) > 0.99 * model.accuracy


def test_slack_cables_show_what_was_reported_on_caroca():
    model = load_tension_sensor("tractel")
    slack = np.array([120.0, 90.0, 90.0, 50.0, 90.0, 100.0, 0.0, -20.0])
    sensor = TensionSensor(model, 8, seed=1, slack_readings=slack)
    shown = readings(sensor, [0.0], np.zeros(8))[0]
    assert np.all(np.abs(shown - slack) <= model.accuracy + 5.0 * model.repeatability)
    np.testing.assert_allclose(
        sensor.offsets() - TensionSensor(model, 8, seed=1).offsets(), slack, atol=1e-12
    )


def test_readings_hold_between_samples_and_end_at_the_range():
    sensor = TensionSensor(load_tension_sensor("vlu850"), 2, rate=10.0)
    rows = readings(sensor, [0.0, 0.05, 0.0999, 0.1001], np.array([500.0, 5.0]))
    assert np.all(rows[:, 0] == 75.0)
    assert rows[0, 1] == rows[1, 1] == rows[2, 1] != rows[3, 1]


def test_the_same_seed_gives_the_same_readings():
    model = load_tension_sensor("vlu850")
    runs = [readings(TensionSensor(model, 4, seed=s), [0.0, 0.5]) for s in (7, 7, 8)]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.all(runs[0] != runs[2])


def test_bad_settings_are_named():
    model = load_tension_sensor("vlu850")
    with pytest.raises(SensorError, match="rate of a sensor: found 0"):
        TensionSensor(model, 4, rate=0.0)
    with pytest.raises(SensorError, match="slack_readings: found 3 numbers; accepted: one per"):
        TensionSensor(model, 4, slack_readings=np.zeros(3))

"""Figures of motors and sensors: what they draw, and that errors are those of the readings."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation import run_figures
from cdpr_drake.analyses.simulation.hardware_figures import (
    motor_figure,
    reading_errors,
    reading_figure,
)
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings


@pytest.fixture(scope="module")
def run():
    overrides = ["camera.kind=projected", "duration=0.6", "winches.kind=motor"]
    return run_scenario(load_scenario("acrobot_sensors", overrides))


def test_errors_are_those_at_the_instant_of_the_reading(run):
    settings = run.servo.scenario.sensors
    vlu850 = load_tension_sensor("vlu850")
    _, error = reading_errors(run.log, settings, "tension")
    assert np.max(np.abs(error)) < vlu850.accuracy + 5.0 * vlu850.repeatability
    # The tensions themselves change by far more from row to row.
    assert np.max(np.abs(np.diff(run.log["tensions"], axis=0))) > 3.0 * vlu850.accuracy
    _, error = reading_errors(run.log, settings, "encoder")
    assert np.max(np.abs(error)) < np.pi / 65536 * 0.0041 * (1.0 + 1e-3)
    _, error = reading_errors(run.log, settings, "metrology")
    assert np.linalg.norm(error, axis=1) == pytest.approx(1e-4, abs=1e-4)


def test_ideal_sensors_have_no_error():
    times = np.linspace(0.0, 1.0, 11)
    log = {"time": times, "tensions": times[:, None], "measured_tensions": times[:, None]}
    _, error = reading_errors(log, SensorSettings(), "tension")
    np.testing.assert_array_equal(error, 0.0)


def test_readings_are_one_period_old():
    """A ramp, read every 0.2 s and logged before each reading."""
    times = np.linspace(0.0, 1.0, 11)
    held = np.array([0.0, 0.0, 0.0, 0.2, 0.2, 0.4, 0.4, 0.6, 0.6, 0.8, 0.8])
    log = {"time": times, "tensions": times[:, None], "measured_tensions": held[:, None]}
    settings = SensorSettings(tension="vlu850", tension_rate=5.0)
    _, error = reading_errors(log, settings, "tension")
    np.testing.assert_allclose(error, 0.0, atol=1e-12)


def test_each_logged_sensor_has_a_panel(run):
    settings = run.servo.scenario.sensors
    figure = reading_figure("title", run.servo.robot, run.log, settings)
    assert [a.get_ylabel().split(",")[0] for a in figure.axes] == [
        "tension", "length", "tracker", "metrology",
    ]  # fmt: skip
    assert len(figure.axes[0].get_lines()) == 8


def test_motors_have_their_torques_and_friction(run):
    figure = motor_figure("title", run.servo.robot, run.log)
    top, bottom = figure.axes
    assert (len(top.get_lines()), len(bottom.get_lines())) == (8, 10)
    assert "[N m]" in top.get_ylabel()
    assert "[N m]" in bottom.get_ylabel()


def test_each_figure_of_the_hardware_has_its_own_title(run, tmp_path, monkeypatch):
    titles = []
    for name in ("motor_figure", "reading_figure"):
        draw = getattr(run_figures, name)

        def noted(title, *arguments, draw=draw):
            titles.append(title.partition("\n")[0])
            return draw(title, *arguments)

        monkeypatch.setattr(run_figures, name, noted)
    pictures = run_figures.run_figures(run)
    for name in ("motor_torques.png", "readings.png"):
        pictures[name](tmp_path / name)
    assert titles == [
        "Torques of the motors and of their friction", "What the sensors read beyond the truth",
    ]  # fmt: skip

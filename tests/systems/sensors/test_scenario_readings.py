"""Scenarios with sensors: what is logged, when it is wrong and by how much, rates, refusals."""

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.reporting.log_files import column_names
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import RobotFileError, ScenarioError
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo

QUICK = ("camera.kind=projected", "duration=1.0", "log_rate=100", "sensors.metrology_rate=80")


@pytest.fixture(scope="module")
def run():
    return run_scenario(load_scenario("acrobot_sensors", QUICK))


def test_all_readings_are_logged_with_their_units(run):
    names = column_names(run.log, [f"C{i}" for i in range(1, 9)], ["feature"] * 6)
    for column in (
        "measured_tensions.C1_n", "measured_lengths.C8_m", "X_WP_measured.x_m", "X_WP_metrology.qw",
    ):  # fmt: skip
        assert column in names


def test_readings_are_wrong_by_what_their_types_say(run):
    # Readings at the rate of the log; a row shows those of the row before.
    shown = {name: values[2:] for name, values in run.log.items()}
    true = {name: values[1:-1] for name, values in run.log.items()}
    vlu850 = load_tension_sensor("vlu850")
    wrong = shown["measured_tensions"] - true["tensions"]
    assert np.max(np.abs(wrong)) < vlu850.accuracy + 5.0 * vlu850.repeatability
    assert np.max(np.abs(np.mean(wrong, axis=0))) > 10.0 * vlu850.repeatability
    half_count = np.pi / 65536 * 0.0041
    wrong = np.abs(shown["measured_lengths"] - true["unstrained_lengths"])
    assert 0.0 < np.max(wrong) < half_count * (1.0 + 1e-6)
    far, _ = pose_rows_distance(true["X_WP"], shown["X_WP_measured"])
    assert 3e-3 < np.median(far) < 2e-2


def test_metrology_is_right_to_its_accuracy_while_the_platform_rests():
    log = run_scenario(load_scenario("acrobot_sensors", [*QUICK, "duration=0.04"])).log
    away, _ = pose_rows_distance(log["X_WP"], log["X_WP_metrology"])
    assert np.max(np.abs(away - 1e-4)) < 1e-4


def test_readings_of_slack_cables_can_hold_the_constant_errors():
    """Then nothing is left but what a sensor does not repeat."""
    log = run_scenario(
        load_scenario("acrobot_sensors", [*QUICK, "duration=0.1", "sensors.tension_accuracy=0"])
    ).log
    wrong = log["measured_tensions"][2:] - log["tensions"][1:-1]
    assert np.max(np.abs(wrong)) < 6.0 * load_tension_sensor("vlu850").repeatability


def test_sensors_that_nothing_reads_are_not_there():
    servo = build_visual_servo(load_scenario("acrobot_sensors", [*QUICK, "sensors.log=[]"]))
    for name in ("tension_sensors", "encoders", "tracker", "metrology"):
        assert not servo.diagram.HasSubsystemNamed(name)


def test_what_slack_cables_show_stands_in_the_robots_file():
    """And the sensors of CAROCA show it in a scenario."""
    np.testing.assert_array_equal(
        load_robot("caroca").slack_readings, [120.0, 90.0, 90.0, 50.0, 90.0, 100.0, 0.0, -20.0]
    )
    overrides = [*QUICK, "sensors.tension=tractel", "sensors.log=[tension]", "duration=0.1"]
    log = run_scenario(load_scenario("caroca_pbvs", overrides)).log
    shown = np.median(log["measured_tensions"] - log["tensions"], axis=0)
    assert np.max(np.abs(shown - load_robot("caroca").slack_readings)) < 75.0 + 10.0


def test_an_automatic_step_meets_the_fastest_sensor():
    plain = build_visual_servo(load_scenario("caroca_pbvs", QUICK)).max_step
    assert plain > 1.0 / 512.0
    overrides = [*QUICK, "sensors.tension=tractel", "sensors.log=[tension]"]
    assert build_visual_servo(load_scenario("caroca_pbvs", overrides)).max_step == 1.0 / 512.0


def test_a_rate_above_the_simulations_is_named():
    overrides = [*QUICK, "integration.max_step=0.002", "sensors.tension_rate=510"]
    scenario = load_scenario("acrobot_sensors", overrides)
    with pytest.raises(
        ScenarioError, match=r"sensors\.tension_rate: found 510; accepted: at most 5"
    ):
        build_visual_servo(scenario)
    overrides[-1] = "sensors.tension_rate=500"
    assert build_visual_servo(load_scenario("acrobot_sensors", overrides)).max_step == 0.002


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("sensors.tension=hbm", r"sensors\.tension: found hbm; accepted: one of ideal, tractel, v"),
        (
            "sensors.tracker_rate=121",
            r"sensors\.tracker_rate: found 121; accepted: at most 120 \[Hz\], that of vive",
        ),
        (
            "sensors.encoder_rate=0",
            r"sensors\.encoder_rate: found 0; accepted: a number > 0 \[Hz\]",
        ),
        ("sensors.log=[tension, tension]", r"sensors\.log\[1\]: found tension twice; accepted"),
        ("sensors.log=[speed]", r"sensors\.log\[0\]: found speed; accepted"),
    ],
)
def test_bad_sensors_are_named(override, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario("acrobot_sensors", [override])


def test_slack_readings_are_one_for_each_cable(tmp_path):
    content = yaml.safe_load(robot_file("caroca").read_text())
    content["slack_readings"] = [1.0, 2.0]
    path = tmp_path / "robot.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(RobotFileError, match=r"slack_readings: found 2 numbers; accepted: one for"):
        load_robot(str(path))

"""Scenarios with motors on the winches: what they do to a servo, logs, refusals."""

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.reporting.log_files import column_names
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.winches import VelocityWinch

QUICK = "camera.kind=projected"
CABLES = [f"C{i}" for i in range(1, 9)]


@pytest.fixture(scope="module")
def friction_run():
    return run_scenario(load_scenario("acrobot_friction", [QUICK]))


def test_winches_are_ideal_unless_a_scenario_says_otherwise():
    plain = build_visual_servo(load_scenario("acrobot_pbvs", [QUICK]))
    assert isinstance(plain.cable_robot.winches, VelocityWinch)
    motors = build_visual_servo(load_scenario("acrobot_pbvs", [QUICK, "winches.kind=motor"]))
    assert isinstance(motors.cable_robot.winches, MotorWinch)
    assert motors.max_step < plain.max_step


def test_the_servo_arrives_in_spite_of_friction(friction_run):
    assert friction_run.outcome.name == "CONVERGED"


def test_motors_follow_with_the_delay_of_their_loops(friction_run):
    """Cables move as commanded but for lags: far from exactly, near enough to arrive."""
    log, dt = friction_run.log, np.diff(friction_run.log["time"])[:, np.newaxis]
    moved = np.diff(log["unstrained_lengths"], axis=0) / dt
    wanted = log["cable_velocities"][:-1]
    late = np.abs(moved - wanted)
    assert np.max(late) > 1e-4
    settled = log["time"][:-1] > 1.0
    assert np.max(late[settled]) < 0.1 * np.max(np.abs(wanted))


def test_by_position_lengths_follow_the_integral_of_the_velocities():
    """The position loop lags behind by the speed over its bandwidth, and does not drift."""
    overrides = [QUICK, "winches.mode=position", "perturbations.slack=[0.01, 0, 0, 0, 0, 0, 0, 0]"]
    run = run_scenario(load_scenario("acrobot_friction", overrides))
    assert run.outcome.name == "CONVERGED"
    log, law = run.log, run.servo.robot.winch_law()
    # Velocities are held between control steps, of which the log has every row.
    step = np.diff(log["time"])[:, np.newaxis]
    moved = np.vstack([np.zeros(8), np.cumsum(log["cable_velocities"][:-1] * step, axis=0)])
    behind = log["unstrained_lengths"] - log["unstrained_lengths"][0] - moved
    lag = np.max(np.abs(log["cable_velocities"])) / law.position_bandwidth
    assert np.max(np.abs(behind)) < lag
    assert np.max(np.abs(behind[-1])) < 1e-3 * np.max(np.abs(moved[-1]))  # measured 3e-5


def test_torques_are_logged_with_their_units(friction_run):
    names = column_names(friction_run.log, CABLES, ["feature"] * 6)
    assert "applied_torques.C1_nm" in names
    assert "friction_torques.C8_nm" in names
    friction = friction_run.servo.robot.winch_law().friction
    taken = np.abs(friction_run.log["friction_torques"])
    fastest = friction_run.servo.robot.winch.rated_motor_speed()
    assert np.max(taken) <= friction.static + friction.viscous * fastest
    assert np.max(taken) > friction.coulomb


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "winches.kind=hydraulic",
            r"winches\.kind: found hydraulic; accepted: one of ideal, motor",
        ),
        (
            "integration.max_step=0.0021",
            r"integration\.max_step: found 0\.0021; accepted: at most 0\.002 \[s\], twice the",
        ),
    ],
)
def test_bad_winches_are_named(override, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario("acrobot_friction", [override])


def test_ideal_winches_take_velocities_only():
    with pytest.raises(ScenarioError, match=r"winches\.mode: found position with ideal winches"):
        load_scenario("acrobot_pbvs", ["winches.mode=position"])


def test_a_robot_without_motors_is_named(tmp_path):
    content = yaml.safe_load(robot_file("acrobot_small").read_text())
    del content["winch"]["inertia"]
    path = tmp_path / "robot.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(ScenarioError, match=r"winches\.kind: found motor; robot acrobot_small: w"):
        load_scenario("acrobot_friction", [f"robot={path}"])

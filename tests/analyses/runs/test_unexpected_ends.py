"""What is said of ends that nobody expected, and of limits that replace those of the robot."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.runs.checks import limit_warnings, servo_limit_warnings
from cdpr_drake.analyses.runs.unexpected_end import slack_words, unexpected_end
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import ExpectedEnd


@pytest.mark.parametrize(
    ("expected", "outcome", "errors", "words"),
    [
        (None, Outcome.CONVERGED, (0.1, 0.1), ""),
        (None, Outcome.COMPLETED, (0.1, 0.1), ""),
        (None, Outcome.TIMEOUT, (0.0, 0.0), "ended by timeout"),
        (None, Outcome.INTERRUPTED, (0.0, 0.0), ""),
        (("timeout", None, None), Outcome.TIMEOUT, (0.1, 0.1), ""),
        (("timeout", None, None), Outcome.CONVERGED, (0.0, 0.0), "expected timeout"),
        (("converged", 0.001, 0.1), Outcome.CONVERGED, (0.002, 0.0), "2 mm, expected.position"),
        (("converged", 0.001, 0.1), Outcome.CONVERGED, (0.0, 0.01), "0.573 deg, expected.rot"),
        (("converged", 0.001, 0.1), Outcome.CONVERGED, (0.0005, 0.001), ""),
    ],
)
def test_what_is_expected_decides(expected, outcome, errors, words):
    scenario = load_scenario("acrobot_pbvs")
    keys = ("outcome", "position", "rotation_deg")
    end = None if expected is None else ExpectedEnd(**dict(zip(keys, expected, strict=True)))
    found = " ".join(unexpected_end(replace(scenario, expected=end), outcome, errors))
    assert words in found
    assert bool(found) == bool(words)


def test_slack_cables_are_named_the_longest_first():
    slack = np.zeros((4, 8))
    slack[0:1, 2], slack[0:3, 5] = 1.0, 1.0
    log = {"time": np.array([0.0, 1.0, 3.0, 6.0]), "slack": slack}
    robot = load_robot("acrobot_small")
    names = [cable.name for cable in robot.cables]
    assert slack_words(log, robot) == f"cables were slack: {names[5]} 6.0 s, {names[2]} 1.0 s"
    assert slack_words({**log, "slack": 0.0 * slack}, robot) == ""


def test_limits_of_winches_by_torque_and_of_mechanisms_are_said():
    scenario, robot = load_scenario("acrobot_torque_servo"), load_robot("acrobot_small")
    (words,) = servo_limit_warnings(scenario, robot)
    assert "torque_control.limits = 1 to 60 N replace tension_bounds of acrobot_small" in words
    scenario.winches.mode = "velocity"  # which no limits hold
    assert servo_limit_warnings(scenario, robot) == []
    (words,) = limit_warnings("control.limits", np.array([0.0, 9.0]), load_mechanism("cable_arm"))
    assert "control.limits = 0 to 9 N replace tension_bounds of cable_arm" in words

"""A run that does not end as expected says which limit it missed, and what to change."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.start_checks import limit_warnings, servo_limit_warnings
from cdpr_drake.analyses.simulation.unexpected_end import slack_words, unexpected_end
from cdpr_drake.cli.app import main
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import ExpectedEnd
from tests.messages import printed
from tests.newcomer import OWN_ROBOT

SHORT = ["simulate", "acrobot_pbvs", "--camera", "projected", "--duration", "0.6"]
QUICK = ["--set", "integration.engine=compiled", "--set", "integration.loop=compiled"]


def ran(capsys, words):
    """What a command that does what it was asked for prints."""
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 0
    return printed(capsys).out


@pytest.mark.usefixtures("without_pictures")
def test_a_timeout_says_limits_slack_cables_and_keys(capsys, tmp_path):
    told = json.loads(ran(capsys, [*SHORT, *QUICK, "--out", str(tmp_path / "out"), "--json"]))
    assert told["outcome"] == "timeout"
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert written["message"] == told["message"]
    for words in (
        "expected converged", "duration = 0.6 s was over", "stop.position = 0.3 mm",
        "stop.rotation_deg = 0.5 deg", "cables were slack: C", "to change: ", "duration (longer)",
        "initial_pose", "tension_management",
    ):  # fmt: skip
        assert words in told["message"]
    # What it says of cables is what the summary says.
    assert told["slack_cable_seconds"] > 0.0


@pytest.mark.usefixtures("without_pictures")
def test_the_table_of_a_run_has_the_message(capsys, tmp_path):
    out = ran(capsys, [*SHORT, *QUICK, "--out", str(tmp_path / "out")])
    said = " ".join(out.replace("│", " ").split())
    assert "stop.position = 0.3 mm" in said
    assert "cables were slack" in said


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


TRACKING = """\
kind: tension_control
name: tracking
robot: bay.yaml
duration: 0.2
trajectory: {start: {position: [0.0, 0.0, 1.1]},
  stretches: [{pose: {position: [0.01, 0.0, 1.1]}, duration: 2.0}]}
controller: {rate: 100.0, stiffness: 100.0, damping: 20.0}
distribution: {limits: LIMITS}
"""


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(
    ("limits", "used", "said"),
    [
        ("[1.0, 60.0]", [1.0, 60.0], "distribution.limits = 1 to 60 N replace tension_bounds of "
         "bay, 4 to 350 N"),
        ("[4.0, 350.0]", [4.0, 350.0], ""),
        ("null", [4.0, 350.0], ""),
    ],
)  # fmt: skip
def test_limits_that_replace_those_of_the_robot_are_said(
    capsys, tmp_path, monkeypatch, limits, used, said
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bay.yaml").write_text(OWN_ROBOT.read_text())
    (tmp_path / "tracking.yaml").write_text(TRACKING.replace("LIMITS", limits))
    with pytest.raises(SystemExit) as ended:
        main(["simulate", "tracking.yaml", "--json", "--out", "out"])
    out, err = printed(capsys)
    told = json.loads(out)
    assert ended.value.code == 0
    assert told["tension_limits_n"] == used
    assert bool(told["remarks"]) == bool(said)
    assert all(said in words for words in told["remarks"])
    assert ("replace tension_bounds" in err) == bool(said)
    assert used[0] <= told["tension_n"]["min"] <= told["tension_n"]["max"] <= used[1]


def test_limits_of_winches_by_torque_and_of_mechanisms_are_said():
    scenario, robot = load_scenario("acrobot_torque_servo"), load_robot("acrobot_small")
    (words,) = servo_limit_warnings(scenario, robot)
    assert "torque_control.limits = 1 to 60 N replace tension_bounds of acrobot_small" in words
    scenario.winches.mode = "velocity"  # which no limits hold
    assert servo_limit_warnings(scenario, robot) == []
    (words,) = limit_warnings("control.limits", np.array([0.0, 9.0]), load_mechanism("cable_arm"))
    assert "control.limits = 0 to 9 N replace tension_bounds of cable_arm" in words

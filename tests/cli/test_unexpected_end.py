"""A run that does not end as expected says which limit it missed, and what to change."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.unexpected_end import slack_words, unexpected_end
from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import ExpectedEnd
from tests.messages import printed

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

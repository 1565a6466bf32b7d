"""What is said before a run starts, of limits that replace the robot's, and of unexpected ends."""

import re
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.runs import KINDS
from cdpr_drake.analyses.runs.checks import (
    check_start,
    goal_warnings,
    limit_warnings,
    servo_limit_warnings,
    sheave_warnings,
    step_warnings,
)
from cdpr_drake.analyses.runs.unexpected_end import servo_message, slack_words, unexpected_end
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.cable_schema import BehaviourSettings
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_names
from cdpr_drake.systems.scenarios.run_settings import ExpectedEnd
from tests.analyses.runs.run_by_hand import changed, run_by_hand
from tests.cli.commands import refuse

PROJECTED = "camera.kind=projected"


def servo(*overrides, name="acrobot_pbvs"):
    return build_visual_servo(load_scenario(name, [PROJECTED, *overrides]))


@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_circles", "acrobot_eye_to_hand"])
def test_scenarios_of_the_package_see_their_target_and_can_reach_their_goal(name):
    built = servo(name=name)
    check_start(built)
    assert goal_warnings(built) == []


@pytest.mark.parametrize(
    ("pose", "place"),
    [
        ("position=[-0.5, 0.5, 0.0]", "its middle would be at (2937, 3134) px, 0.0847 m away"),
        ("position=[0.2209, -0.197, 0.9]", "m behind the camera"),
        ("angles_deg=[180, 0, 0]", "it is turned away from the camera, or a part"),
    ],
)
def test_a_target_out_of_view_is_refused_with_where_it_would_be(pose, place):
    with pytest.raises(ScenarioError) as caught:
        check_start(servo(f"target.pose.{pose}"))
    message = str(caught.value)
    assert message.startswith("acrobot_pbvs: initial_pose: the camera does not see the target")
    assert place in message
    assert "accepted: all of it within 640 x 480 px, face on" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("[0.1, 0, 0.09]", "the camera does not see all of the target from there"),
        ("[0.0, 0.0, 1.12]", "outside the static workspace: "),
    ],
)
def test_a_goal_that_is_not_seen_or_held_is_a_warning(place, words):
    (warning,) = goal_warnings(servo(f"desired.position={place}"))
    assert warning.startswith(f"acrobot_pbvs: desired: {words}")


def test_friction_of_sheaves_without_pulleys_is_said_to_do_nothing():
    scenario, robot = load_scenario("acrobot_pbvs"), load_robot("acrobot_small")
    assert sheave_warnings(scenario, robot) == []
    robot.cable.behaviour = BehaviourSettings(sheave_friction=0.05)
    (warning,) = sheave_warnings(scenario, robot)
    assert "cable.behaviour.sheave_friction 0.05 of acrobot_small does nothing without" in warning
    assert sheave_warnings(load_scenario("acrobot_pbvs", ["cables.pulleys=true"]), robot) == []


def test_a_step_beyond_the_stable_one_is_warned_of_with_the_number():
    """Such a run once showed tensions of 1,630 N without a word."""
    good = servo()
    assert step_warnings(good) == []
    assert step_warnings(servo(f"integration.max_step={good.max_step}")) == []
    (warning,) = step_warnings(servo("integration.max_step=0.05"))
    largest = float(re.search(r"is about (\S+) s", warning)[1])
    assert good.max_step < largest < 2.0 * good.max_step


STEPS = "accepted: at most 1e+09 steps"


@pytest.mark.parametrize(
    ("name", "setting", "words"),
    [
        *((scenario_names(kind)[0], "integration.max_step=1e-12", STEPS) for kind in KINDS),
        ("acrobot_pbvs", "duration=1e12", STEPS),
        *(
            (name, f"{key}=9e15", f"{key}: found 9e15; accepted: a number .* <= 100000")
            for name in ("acrobot_pbvs", "planar_computed_torque")
            for key in ("controller.rate", "log_rate")
        ),
        ("acrobot_pbvs", "camera.rate=9e15", "camera.rate: found 9e15"),
        ("acrobot_pbvs", "camera.latency_frames=1000000000", "latency_frames: found 1000000000"),
    ],
)
def test_runs_that_would_never_end_are_refused(name, setting, words):
    """Runs by tensions once began whatever their step was."""
    check = lambda scenario: KINDS[scenario.kind](scenario).check()  # noqa: E731
    with pytest.raises(ScenarioError, match=words.replace("+", r"\+")) as refused:
        check(load_scenario(name, [setting]))
    assert "\n" not in str(refused.value)


def test_the_command_refuses_in_one_line_and_writes_nothing(capsys, here):
    for setting in ("integration.max_step=1e-12", "controller.rate=1e9"):
        assert "accepted: " in refuse(capsys, "simulate", "planar_pbvs", "--set", setting)
    assert list(here.iterdir()) == []


# Limits, and ends that nobody expected.


def test_limits_of_winches_by_torque_and_of_mechanisms_are_said():
    scenario, robot = load_scenario("acrobot_torque_servo"), load_robot("acrobot_small")
    (words,) = servo_limit_warnings(scenario, robot)
    assert "torque_control.limits = 1 to 60 N replace tension_bounds of acrobot_small" in words
    scenario.winches.mode = "velocity"  # which no limits hold
    assert servo_limit_warnings(scenario, robot) == []
    (words,) = limit_warnings("control.limits", np.array([0.0, 9.0]), load_mechanism("cable_arm"))
    assert "control.limits = 0 to 9 N replace tension_bounds of cable_arm" in words


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
    keys = ("outcome", "position", "rotation_deg")
    end = None if expected is None else ExpectedEnd(**dict(zip(keys, expected, strict=True)))
    scenario = replace(load_scenario("acrobot_pbvs"), expected=end)
    said = " ".join(unexpected_end(scenario, outcome, errors))
    assert words in said
    assert bool(said) == bool(words)


def test_slack_cables_are_named_the_longest_first():
    slack = np.zeros((4, 8))
    slack[0:1, 2], slack[0:3, 5] = 1.0, 1.0
    log = {"time": np.array([0.0, 1.0, 3.0, 6.0]), "slack": slack}
    robot = load_robot("acrobot_small")
    assert slack_words(log, robot) == "cables were slack: C6 6.0 s, C3 1.0 s"
    assert slack_words({**log, "slack": 0.0 * slack}, robot) == ""


@pytest.mark.parametrize(
    ("distances", "words"),
    [
        ([5e-3, 4e-3, 3e-3, 2e-3], "to change: duration (longer)"),  # it becomes smaller
        ([2e-3] * 4, "to change: stop.position (larger), target.size (larger)"),
        ([1e-5] * 4, "before both limits had held for stop.hold = 0.5 s; to change: duration"),
    ],
)  # fmt: skip
def test_a_timeout_says_which_limits_were_missed_and_what_to_change(distances, words):
    run = run_by_hand()
    seen = np.tile(pose_row(run.built.X_CdO), (4, 1))
    seen[:, 6] += distances
    log = {"X_CO_measured": seen, "time": np.linspace(0.0, 1.0, 4)}
    log |= {"found": np.ones((4, 1)), "slack": np.zeros((4, 8))}
    assert words in servo_message(changed(run, log))

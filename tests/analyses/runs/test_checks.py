"""What is said before a servo starts: a target out of view, a goal that is not possible."""

import re

import pytest

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.checks import (
    check_start,
    goal_warnings,
    sheave_warnings,
    step_warnings,
)
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.simulate import KINDS
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.cli.app import main
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.materials import BehaviourSettings
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.messages import printed

PROJECTED = "camera.kind=projected"


def servo(*overrides, name="acrobot_pbvs"):
    return build_visual_servo(load_scenario(name, [PROJECTED, *overrides]))


@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_circles", "acrobot_eye_to_hand"])
def test_scenarios_of_the_package_see_their_target_and_can_reach_their_goal(name):
    built = servo(name=name)
    check_start(built)
    assert goal_warnings(built) == []


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ("position=[-0.5, 0.5, 0.0]", "its middle would be at (2937, 3134) px, 0.0847 m away"),
        ("position=[0.2209, -0.197, 0.9]", "m behind the camera"),
        ("angles_deg=[180, 0, 0]", "it is turned away from the camera, or a part"),
    ],
)
def test_a_target_out_of_view_is_refused_with_where_it_would_be(pose, expected):
    with pytest.raises(ScenarioError) as caught:
        check_start(servo(f"target.pose.{pose}"))
    message = str(caught.value)
    assert message.startswith("acrobot_pbvs: initial_pose: the camera does not see the target")
    assert expected in message
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


@pytest.mark.parametrize(
    "asked",
    [
        "acrobot_pbvs --camera projected --duration 1e12",
        "acrobot_pbvs --camera projected --set integration.max_step=1e-12",
        "planar_computed_torque --duration 1e12",
        "planar_computed_torque --set integration.max_step=1e-12",
        "planar_computed_torque --set controller.rate=1e9",
        "acrobot_pbvs --set camera.rate=1e9",
        "acrobot_pbvs --set camera.latency_frames=1000000000",
        "acrobot_pbvs --set log_rate=1e300",
    ],
)
def test_steps_rates_and_delays_beyond_sense_are_one_line(asked, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["simulate", *asked.split()])
    error = printed(capsys).err
    assert ended.value.code == 2
    assert "accepted: " in error
    assert len(error.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_camera_of_a_frame_an_hour_is_not_waited_for_in_the_warm_up():
    seen = []
    run = ServoRun(servo("camera.rate=0.0003", "controller.rate=0.0003").scenario)
    result = run.simulate(follow=Follow(seen.append, lambda: len(seen) >= 2))
    assert result.outcome == Outcome.INTERRUPTED
    assert result.sim_time == pytest.approx(0.2)


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_refuses_runs_that_would_never_end(name):
    """Runs by tensions once began whatever their step was."""
    scenario = load_scenario(scenario_names(name)[0], ["integration.max_step=1e-12"])
    with pytest.raises(ScenarioError, match="accepted: at most"):
        KINDS[name](scenario).check()


@pytest.mark.parametrize(
    ("name", "key"),
    [
        *(("acrobot_pbvs", key) for key in ("camera.rate", "controller.rate", "log_rate")),
        *(("planar_computed_torque", key) for key in ("controller.rate", "log_rate")),
    ],
)
def test_rates_that_nothing_follows_are_refused(name, key):
    """Such runs once stood still."""
    load_scenario(name, [f"{key}=1e5"])
    with pytest.raises(ScenarioError, match=f"overrides {key}: found 9e15; .* <= 100000"):
        load_scenario(name, [f"{key}=9e15"])


def test_slow_cameras_and_controllers_do_not_make_warming_up_longer_than_the_run():
    """One image in a hundred years: such a run once began with them."""
    scenario = load_scenario("acrobot_pbvs", [PROJECTED, "camera.rate=3e-10", "duration=0.05"])
    assert ServoRun(scenario).simulate().sim_time == pytest.approx(0.05)
    scenario = load_scenario("planar_computed_torque", ["controller.rate=3e-10", "duration=0.05"])
    assert TensionRun(scenario).simulate().sim_time <= 0.05

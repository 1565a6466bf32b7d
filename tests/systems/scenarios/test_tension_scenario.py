"""Scenario files of dynamic control: values, refusals."""

import numpy as np
import pytest

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import scenario_names
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


@pytest.mark.parametrize("name", scenario_names("tension_control"))
def test_every_scenario_loads_and_ends_in_time(name):
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.trajectory.trajectory().end_time <= scenario.duration


def test_trajectory_passes_its_poses():
    scenario = load_scenario("acrobot_computed_torque")
    trajectory = scenario.trajectory.trajectory()
    np.testing.assert_allclose(trajectory.pose(0.0).translation(), [0.0, 0.0, 0.2])
    np.testing.assert_allclose(trajectory.pose(3.5).translation(), [0.15, -0.1, 0.4], atol=1e-12)
    assert scenario.limits() == (1.0, 60.0)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("distribution.method=foo", "distribution.method: found foo"),
        ("distribution.method=kernel", "trajectory.start: kernel: found redundancy"),
        ("distribution.method=reference_program", "no reference"),
        ("distribution.limits=[9, 3]", "lower <= upper"),
        ("distribution.limits=[1]", "2 numbers"),
        ("trajectory.start.position=[0, 0, 9]", "outside the frame"),
        ("trajectory.start.position=[0.55, 0.55, 1.1]", "a pose that can be held"),
        ("trajectory.stretches=[]", "at least one"),
        ("trajectory.stretches=[{pose: {position: [0, 0, 0.2]}, duration: 0}]", "found 0"),
        ("controller.stiffness=-1", "found -1"),
        (
            "controller.balance=moment",
            "controller.balance: found moment; accepted: one of wrench, force",
        ),
        ("kind=visual_servo", "kind: found visual_servo"),
        ("camera.kind=rendered", "no key camera"),
        ("robot=foo", "foo"),
    ],
)
def test_refusals_are_one_line(override, words):
    with pytest.raises(Exception) as caught:  # noqa: PT011
        load_scenario("acrobot_computed_torque", [override])
    message = str(caught.value)
    assert words in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["distribution.method=barycenter"], "barycenter: found redundancy m - n = 5; accepted: 2"),
        (["predictive={steps: 5}"], "controller.balance: found force beside predictive; accepted"),
    ],
)
def test_what_cannot_balance_forces_alone_is_refused_in_one_line(overrides, words):
    overrides = ["controller.balance=force", *overrides]
    with pytest.raises(ScenarioError) as caught:
        load_scenario("acrobot_computed_torque", overrides)
    assert words in str(caught.value)
    assert "acrobot_computed_torque" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", scenario_names("tension_control"))
def test_every_scenario_can_balance_forces_alone(name):
    """By a method that takes the redundancy that it then has; force laws ask for moments too."""
    if load_scenario(name).force_control is not None:
        with pytest.raises(ScenarioError, match="found force beside force_control"):
            load_scenario(name, ["controller.balance=force"])
        return
    overrides = ["controller.balance=force", "distribution.method=quadratic_program"]
    assert load_scenario(name, overrides).controller.balance == "force"


def test_forces_alone_hold_poses_that_no_wrench_holds():
    """Towards a corner of the frame moments cannot be balanced any more, but forces."""
    away = ["trajectory.start.position=[0.45, 0.45, 0.6]", "distribution.method=quadratic_program"]
    with pytest.raises(ScenarioError, match="a pose that can be held"):
        load_scenario("acrobot_computed_torque", away)
    scenario = load_scenario("acrobot_computed_torque", [*away, "controller.balance=force"])
    np.testing.assert_array_equal(scenario.trajectory.start.position, [0.45, 0.45, 0.6])


def test_reference_reaches_the_method():
    overrides = ["distribution.method=reference_program", "distribution.reference=7"]
    scenario = load_scenario("acrobot_computed_torque", overrides)
    assert scenario.distribution.reference == 7.0


def test_pulleys_are_simulated_and_believed_in_as_asked():
    name = "acrobot_computed_torque"
    robot = load_robot("acrobot_large")
    for overrides, real, believed in (
        ([], False, False),
        (["cables.pulleys=true"], True, True),
        (["cables.pulleys=true", "distribution.pulleys=false"], True, False),
    ):
        scenario = load_scenario(name, overrides)
        assert scenario.cable_set(robot).has_pulleys() == real
        assert scenario.believed_cables(robot).has_pulleys() == believed


def test_a_pose_with_a_pulley_in_the_platform_is_refused():
    robot = load_robot("acrobot_large")
    p = robot.cables[0].exit_point - robot.cables[0].anchor_point
    overrides = ["cables.pulleys=true", f"trajectory.start.position={p.tolist()}"]
    with pytest.raises(ScenarioError, match=r"trajectory\.start: .*pulley"):
        load_scenario("acrobot_computed_torque", overrides)


def test_the_file_says_of_which_kind_a_scenario_is():
    assert isinstance(load_scenario("acrobot_computed_torque"), TensionScenario)
    assert isinstance(load_scenario("acrobot_pbvs"), Scenario)
    with pytest.raises(ScenarioError, match="found visual_servo, not described by TensionScenario"):
        load_scenario("acrobot_pbvs", schema=TensionScenario)

"""Cases of the servoing thesis: their own numbers, and the cables of CAROCA."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.acrobot_cases import overshoot, winding
from cdpr_drake.analyses.studies.caroca_cases import LIFT
from cdpr_drake.analyses.studies.servo import PULLEYS
from cdpr_drake.analyses.studies.study import STUDIES, Form, study_named
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.stiffness import natural_modes, platform_stiffness
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model
from cdpr_drake.systems.robots.settings import simulated_model


def test_turns_of_a_spiral():
    angle = np.linspace(0.0, 5.0 * np.pi, 200)
    radius = 1.0 + angle
    path = np.column_stack([3.0 + radius * np.cos(angle), -1.0 - radius * np.sin(angle)])
    line = np.array([path[0], [3.0, -1.0]])
    assert winding({"image_path": path, "image_line": line}) == pytest.approx(2.5)


def test_overshoot_is_what_lies_beyond_zero():
    time = np.linspace(0.0, 10.0, 1000)
    swinging = np.exp(-0.3 * time) * np.cos(time)  # its lowest point is where tan = -0.3
    lowest = np.pi - np.arctan(0.3)
    expected = -np.exp(-0.3 * lowest) * np.cos(lowest)
    error = np.zeros((1000, 6))
    error[:, 3:5] = np.column_stack([3.0 * swinging, -4.0 * np.exp(-time)])
    error[500] = np.nan
    assert overshoot({"error": error}) == pytest.approx(3.0 * expected / 5.0, rel=1e-3)
    error[:, 3] = error[:, 4]
    assert overshoot({"error": error}) == 0.0


def test_case_4_has_the_printed_heights_and_shows_raised_ones():
    """Section 2.3.5: from 1.899 m up to a believed 2.202 m."""
    cases = study_named("case-4").cases(Form(quick=True))
    changes = {case.keys["configuration"]: case.call.args[1] for case in cases}
    printed, raised = (
        load_scenario("caroca_pbvs", changes[name]) for name in ("beyond", "beyond_raised")
    )
    assert printed.initial_pose.position[2] == pytest.approx(1.899)
    assert raised.initial_pose.position[2] == pytest.approx(1.899 + LIFT)
    assert printed.perturbations.initial_pose.position[2] < 2.3


ROBOT = load_robot("caroca")
SWING_DAMPING = (ROBOT.damping.translation, ROBOT.damping.rotation)

GYRATION = 0.0184
"""Mean moment of inertia about the centre of mass per mass, and damping of turns per that of
translations [m^2]."""

SWING_HZ = 2.23
"""Slowest mode of the platform where the straight model's change of lengths takes it from the
start of section 2.3.4 to its goal: two cables then pull with little more than their weight. Of it
the damping of the robot's file is 5.4 % of critical."""

ROUNDED_HZ = 0.005
"""SWING_HZ has two decimals."""

SAME_SHARE = 0.05
"""By how much damping of turns, printed with two digits, may miss the share of that of places."""

OTHER_CABLES = ("stiffness_", "massless_")
"""Beginnings of configurations of case X that try other cables."""


def cables_of(scenario):
    model = simulated_model(ROBOT, scenario.cables, scenario.damping)
    return model["cable_model"], model["pulleys"], model["overrides"]


COMMON = ("catenary", True, [])


def test_every_case_on_caroca_has_the_same_cables():
    studies = set()
    for name in STUDIES:
        if not name.startswith("case-"):
            continue
        for case in study_named(name).cases(Form(quick=True)):
            scenario, changes, *_ = case.call.args
            configuration = case.keys["configuration"]
            if "caroca" in scenario and not configuration.startswith(OTHER_CABLES):
                assert cables_of(load_scenario(scenario, changes)) == COMMON, configuration
                studies.add(name)
    assert studies >= {"case-4", "case-5", "case-8", "case-10"}


@pytest.mark.parametrize(
    "name", ["caroca_catenary", "caroca_slack_start", "caroca_slack_start_tca"]
)
def test_scenarios_that_ship_have_them_too(name):
    assert cables_of(load_scenario(name)) == COMMON


def test_the_swing_is_that_of_the_rest_where_the_straight_model_leads():
    scenario = load_scenario("caroca_pbvs", [PULLEYS])
    robot = load_robot(scenario.robot)
    cables, straight = scenario.cables.cable_set(robot), robot.cable_set().without_pulleys()
    start = scenario.initial_pose.transform()
    goal = servo_model(scenario, robot).desired_platform_pose()
    way = cable_paths(goal, straight).lengths - cable_paths(start, straight).lengths
    l0 = hold_robot(robot, start, cables, "catenary").unstrained_lengths + way
    platform = rigid_platform(robot)
    rest = equilibrium_near(cables, "catenary", platform, l0, goal, soften=True)
    K = platform_stiffness(cables, "catenary", platform, rest.X_WP, l0).total
    slowest = natural_modes(K, platform, rest.X_WP).frequencies[0]
    assert slowest == pytest.approx(SWING_HZ, abs=ROUNDED_HZ)
    share = SWING_DAMPING[0] / (2.0 * 2.0 * np.pi * SWING_HZ * ROBOT.platform.mass)
    assert share == pytest.approx(0.054, abs=5e-4)
    assert SWING_DAMPING[1] == pytest.approx(GYRATION * SWING_DAMPING[0], rel=SAME_SHARE)
    inertia = np.trace(platform.I_PPo) / 3.0 - 2.0 / 3.0 * platform.mass * platform.p_PCo[2] ** 2
    assert pytest.approx(inertia / platform.mass, rel=0.01) == GYRATION

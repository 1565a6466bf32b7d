"""CAROCA has the same cables in all case studies, and their damping is what its reasons say."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.case_studies import case_1, case_4, case_5, case_8
from cdpr_drake.analyses.studies.framework.case_definition import PULLEYS
from cdpr_drake.analyses.studies.tension_cases import case_10
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.stiffness import natural_modes, platform_stiffness
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model
from cdpr_drake.systems.robots.settings import simulated_model

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


def caroca_runs():
    for study in (case_1.STUDY, case_4.STUDY, case_5.STUDY, case_8.STUDY, case_10.STUDY):
        plan = study.cases
        for one in plan.configurations:
            scenario = one.scenario or plan.scenario
            if "caroca" in scenario and not one.name.startswith(OTHER_CABLES):
                yield study.name, scenario, (*plan.changes, *one.changes), one.name


def cables_of(scenario):
    told = simulated_model(ROBOT, scenario.cables, scenario.damping)
    return told["cable_model"], told["pulleys"], told["overrides"]


COMMON = ("catenary", True, [])


def test_every_case_on_caroca_has_the_same_cables():
    studies = set()
    for study, scenario, changes, name in caroca_runs():
        assert cables_of(load_scenario(scenario, changes)) == COMMON, (study, name)
        studies.add(study)
    assert studies == {"case-1", "case-4", "case-5", "case-8", "case-10"}


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

"""Two robots beside each other with their differences."""

import pytest

from cdpr_drake.analyses.tensions import solve_tensions
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.numbers import robots_side_by_side


def by_name(pairs):
    return {pair.name: pair for pair in pairs}


def test_a_robot_beside_itself_differs_in_nothing():
    robot = load_robot("acrobot_small")
    pairs = robots_side_by_side(robot, load_robot("acrobot_small"))
    assert all(pair.name.startswith("at home") and pair.one == pair.other for pair in pairs)
    assert len(pairs) == 6


def test_fields_that_differ_have_axes_units_and_differences():
    one, other = load_robot("acrobot_small"), load_robot("acrobot_small")
    other.cables[2].exit_point[1] += 0.02
    other.platform.mass *= 2.0
    found = by_name(robots_side_by_side(one, other))
    assert found["cables 3 exit point y [m]"].difference == pytest.approx(0.02)
    mass = one.platform.mass
    assert found["platform mass [kg]"].difference == pytest.approx(mass)
    tension = found["at home: largest tension [N]"]
    wanted = solve_tensions(one, one.home.transform(), method="quadratic_program")
    assert tension.one == pytest.approx(max(wanted.as_dict()["tensions_n"]))
    assert tension.difference > 0.5 * tension.one

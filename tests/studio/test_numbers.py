"""Two robots beside each other with their differences."""

import pytest

from cdpr_drake.analyses.tensions import solve_tensions
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.numbers import robots_side_by_side


def test_only_fields_that_differ_are_there_with_axes_units_and_differences():
    one, other = load_robot("acrobot_small"), load_robot("acrobot_small")
    same = robots_side_by_side(one, other)
    assert all(pair.name.startswith("at home") and pair.one == pair.other for pair in same)
    assert len(same) == 6
    other.cables[2].exit_point[1] += 0.02
    other.platform.mass *= 2.0
    pairs = {pair.name: pair for pair in robots_side_by_side(one, other)}
    assert len(pairs) == len(same) + 2
    assert pairs["cables 3 exit point y [m]"].difference == pytest.approx(0.02)
    assert pairs["platform mass [kg]"].difference == pytest.approx(one.platform.mass)
    tension = pairs["at home: largest tension [N]"]
    assert tension.one == max(solve_tensions(one, one.home.transform()).tensions)
    assert tension.difference > 0.5 * tension.one

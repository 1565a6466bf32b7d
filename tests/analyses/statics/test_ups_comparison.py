"""The platform on rods goes where massless cables take it, as the rods get lighter."""

import numpy as np
import pytest

from cdpr_drake.analyses.statics.rigid_rods import massless_motion, ups_deviation
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.ups_robot import rod_masses
from cdpr_drake.systems.robots.cable_robot import holding_tensions

LINEAR = 0.03
"""How far the deviation is from proportional to the mass, relative."""


@pytest.fixture(scope="module")
def deviations():
    """ACROBOT for a tenth of a second from rest under tensions of 1.1 times those that hold it."""
    robot = load_robot("acrobot_small")
    rods = robot.cable_set(pulleys=False)
    tensions = 1.1 * holding_tensions(robot, robot.home.transform(), rods)
    return [
        ups_deviation(robot, tensions, share * rod_masses(robot), 0.1, 5e-5)
        for share in (1.0, 0.1, 0.01)
    ]


def test_the_deviation_vanishes_with_the_mass(deviations):
    real, tenth, hundredth = (d.distance for d in deviations)
    assert real == pytest.approx(10.0 * tenth, rel=LINEAR)
    assert tenth - hundredth == pytest.approx(0.9 * tenth, rel=LINEAR)
    # What is left without mass is the first order error of the discrete plant.
    assert abs(hundredth - 0.1 * tenth) < 2e-3 * deviations[0].moved
    assert deviations[2].angle < 1e-5


def test_the_loops_stay_closed(deviations):
    assert max(d.gap for d in deviations) < 1e-6


def test_rods_as_heavy_as_cables_matter(deviations):
    """Their weight is two per cent of the platform's and nobody carries it."""
    assert 0.1 < deviations[0].distance / deviations[0].moved < 0.3


def test_massless_cables_that_balance_leave_the_platform_at_rest():
    robot = load_robot("acrobot_small")
    home = robot.home.transform()
    tensions = holding_tensions(robot, home, robot.cable_set(pulleys=False))
    end = massless_motion(robot, home, tensions, 0.1)
    assert np.max(np.abs(end.translation() - home.translation())) < 1e-12

"""Tensions come back into the polygon, by the margin, and the platform stays where it is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform, tension_problem
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.static_tensions import find_static_tensions
from cdpr_drake.tensions.methods import distribute, feasible_polygon, solution_space
from cdpr_drake.tensions.slack_correction import (
    null_part,
    polygon_correction,
    polygon_target,
    tension_correction,
)

ROUNDING = 1e-9  # [N]
MARGIN = 1.0  # [N]
STRAIN = 1e-3  # of the cables; by so much they do not give in proportion to their length
X_WP = pose_from_angles([0.1, -0.15, 0.4], [0.05, 0.0, 0.1])


@pytest.fixture(scope="module")
def problem():
    robot = load_robot("acrobot_large")
    cables = robot.cable_set(pulleys=False)
    return tension_problem(robot, X_WP, limits=(1.0, 60.0), cables=cables)


@pytest.fixture(scope="module")
def middle(problem):
    return distribute(problem, "barycenter").tensions


def target(problem, middle, tensions, margin=MARGIN):
    return polygon_target(
        tensions, middle, problem.W, lower=problem.lower, upper=problem.upper, margin=margin
    )


@given(st.integers(0, 2**32 - 1))
def test_what_is_missing_changes_no_wrench_and_leads_inside(problem, middle, seed):
    tensions = np.random.default_rng(seed).uniform(0.0, 15.0, 8)
    missing, least = target(problem, middle, tensions)
    np.testing.assert_allclose(problem.W @ missing, 0.0, atol=ROUNDING)
    np.testing.assert_allclose(least, np.minimum(problem.lower + MARGIN, middle))
    on_plane = middle + null_part(problem.W, tensions - middle)
    inside = on_plane + missing
    assert np.all(inside >= least - ROUNDING)
    if np.any(on_plane < least - ROUNDING):  # no farther than to the margin
        assert np.min(inside - least) == pytest.approx(0.0, abs=ROUNDING)
    else:
        np.testing.assert_array_equal(missing, 0.0)


def test_corners_of_the_polygon_come_back_and_its_middle_stays(problem, middle):
    base, N = solution_space(problem)
    for corner in feasible_polygon(problem).T:
        tensions = base + N @ corner
        missing, _ = target(problem, middle, tensions)
        # Towards the middle, along a straight line.
        share = np.linalg.norm(missing) / np.linalg.norm(middle - tensions)
        np.testing.assert_allclose(missing, share * (middle - tensions), atol=ROUNDING)
        assert 0.0 < share < 1.0
    np.testing.assert_array_equal(target(problem, middle, middle)[0], 0.0)
    # A margin that nothing keeps makes the middle itself the target.
    missing, least = target(problem, middle, base + N @ corner, margin=25.0)
    np.testing.assert_allclose(missing, middle - base - N @ corner, atol=ROUNDING)
    np.testing.assert_allclose(least, middle)


def test_the_target_is_continuous_where_the_margin_begins(problem, middle):
    base, N = solution_space(problem)
    corner = base + N @ feasible_polygon(problem)[:, 0]
    sizes = [
        np.linalg.norm(target(problem, middle, middle + s * (corner - middle))[0])
        for s in np.linspace(0.0, 1.2, 500)
    ]
    assert sizes[0] == 0.0
    assert sizes[-1] > 0.5
    assert np.max(np.diff(sizes)) < 3.0 * 1.2 / 500 * np.linalg.norm(corner - middle)


def moved(cables, platform, l0, velocities, size=1e-6):
    """How far the platform goes when the largest velocity has acted for `size` [m], over it."""
    step = size * velocities / np.max(np.abs(velocities))
    rest = equilibrium_near(cables, "elastic", platform, l0, X_WP)
    there = equilibrium_near(cables, "elastic", platform, l0 + step, rest.X_WP)
    changes = there.tensions - rest.tensions
    return np.linalg.norm(there.X_WP.translation() - rest.X_WP.translation()) / size, changes


def test_the_platform_stays_where_elastic_cables_hold_it(problem, middle):
    robot = load_robot("acrobot_large")
    cables, platform = robot.cable_set().without_pulleys(), rigid_platform(robot)
    l0 = find_static_tensions(
        cables, "elastic", X_WP, problem.wrench, (1.0, 60.0)
    ).unstrained_lengths
    rest = equilibrium_near(cables, "elastic", platform, l0, X_WP)
    base, N = solution_space(problem)
    tensions = base + N @ feasible_polygon(problem)[:, 0]
    missing, least = target(problem, middle, tensions)
    gains = np.full(8, 0.04)
    added = polygon_correction(tensions, missing, least, problem.W, l0, gains)
    assert np.min(added) < 0.0 < np.max(added)
    distance, changes = moved(cables, platform, l0, added)
    # The tensions that were missing is what changes, and nothing else.
    np.testing.assert_allclose(
        changes / np.max(np.abs(changes)), missing / np.max(np.abs(missing)), atol=STRAIN
    )
    other = tension_correction(tensions, least, gains)
    assert distance < STRAIN * moved(cables, platform, l0, other)[0]
    assert np.min(rest.tensions) > 0.5


def test_slack_cables_are_wound_up_and_moving_others_alone_is_left_out(problem, middle):
    tensions = middle.copy()
    tensions[[0, 1]] = 0.0
    missing, least = target(problem, middle, tensions)
    gains = np.full(8, 0.04)
    added = polygon_correction(tensions, missing, least, problem.W, np.ones(8), gains)
    np.testing.assert_allclose(added[:2], -0.04 * least[:2])
    np.testing.assert_array_equal(added[2:], 0.0)  # six taut cables: each velocity would move it
    tensions[1] = middle[1]
    missing, least = target(problem, middle, tensions)
    added = polygon_correction(tensions, missing, least, problem.W, np.ones(8), gains)
    assert added[0] == pytest.approx(-0.04 * least[0])
    np.testing.assert_allclose(problem.W[:, 1:] @ added[1:], 0.0, atol=ROUNDING)

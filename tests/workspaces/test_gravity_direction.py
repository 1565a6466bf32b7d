"""The weight pulls where the robot's file says: what is found does not depend on the axes of W."""

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_copies import gravity_turn, turned_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.workspaces.box_expansion_kernel import expand_demand
from cdpr_drake.workspaces.demanded_wrenches import (
    MotionDemand,
    SpatialSet,
    accelerating,
    weight_wrenches,
)
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from cdpr_drake.workspaces.stiffness import first_frequencies, stiffness_at
from cdpr_drake.workspaces.tension_factor import tension_factors
from cdpr_drake.workspaces.wrench_capacity import capacity_margins, largest_payloads
from tests.workspaces.workspace_cases import random_poses

LIMITS = (0.0, 60.0)


@pytest.fixture(scope="module")
def seen_twice():
    """A robot with tilted gravity and an arm to its centre of mass, as it is and turned upright.

    Cases, and 400 poses: W's, then those of the world whose -z gravity is along.
    """
    robot = load_robot("acrobot_small")
    robot.gravity_direction = np.array([0.3, -0.2, -0.8])
    robot.platform.center_of_mass = np.array([0.03, -0.02, 0.08])
    R_UW = gravity_turn(robot)
    upright = turned_robot(robot, R_UW)
    np.testing.assert_allclose(upright.down(), [0.0, 0.0, -1.0], atol=1e-15)
    positions, rotations = random_poses(robot, 400)
    R = R_UW.matrix()
    there = positions @ R.T, R @ rotations
    cases = [static_case(each, LIMITS) for each in (robot, upright)]
    return robot, R, cases, [(positions, rotations), there]


def both(seen_twice, function):
    """What a function of case and poses gives in each world."""
    _, _, cases, poses = seen_twice
    return [np.asarray(function(case, *each)) for case, each in zip(cases, poses, strict=True)]


def test_what_can_be_held(seen_twice):
    here, there = both(seen_twice, statically_feasible)
    np.testing.assert_array_equal(here, there)
    assert 0.05 < np.mean(here) < 0.95
    robot, _, _, poses = seen_twice
    robot_here = load_robot("acrobot_small")
    robot_here.platform.center_of_mass = robot.platform.center_of_mass
    along_z = statically_feasible(static_case(robot_here, LIMITS), *poses[0])
    assert np.count_nonzero(along_z != here) > 10  # gravity along -z is another question


@pytest.mark.parametrize("function", [
    lambda case, p, R: capacity_margins(case, p, R).margins,
    lambda case, p, R: largest_payloads(case, p, R, 9.81),
    tension_factors,
])  # fmt: skip
def test_margins_payloads_and_tension_factors(seen_twice, function):
    here, there = both(seen_twice, function)
    np.testing.assert_allclose(here, there, rtol=1e-6, atol=1e-7)
    assert np.count_nonzero(np.isfinite(here)) > 20


def test_accelerations(seen_twice):
    robot, R_UW = seen_twice[:2]
    platform = rigid_platform(robot)
    box = np.array([0, 0, 0, 2.0, 2.0, 2.0])
    # An ellipsoid of accelerations has no axes.
    motion = MotionDemand(
        platform.mass, platform.p_PCo, platform.I_PPo, SpatialSet(ellipsoid=box), np.zeros((1, 6))
    )
    here, there = both(
        seen_twice,
        lambda case, p, R: capacity_margins(case, p, R, accelerating(case, motion, R)).margins,
    )
    np.testing.assert_allclose(here, there, rtol=1e-6, atol=1e-7)
    assert not np.allclose(here, both(seen_twice, lambda *a: capacity_margins(*a).margins)[0])
    assert R_UW[2, 2] < 0.95


def test_stiffness_and_frequency(seen_twice):
    robot, R_UW = seen_twice[:2]
    platform = rigid_platform(robot)
    body = (platform.mass, platform.p_PCo, platform.I_PPo)
    here, there = (stiffness_at(case, *each) for case, each in zip(*seen_twice[2:], strict=True))
    np.testing.assert_array_equal(here.held, there.held)
    turn = np.kron(np.eye(2), R_UW)
    K = turn @ here.K @ turn.T
    np.testing.assert_allclose(K[here.held], there.K[here.held], rtol=1e-7, atol=1e-4)
    frequencies = [
        first_frequencies(found, case, body, each[1])
        for found, case, each in zip((here, there), *seen_twice[2:], strict=True)
    ]
    np.testing.assert_allclose(*frequencies, rtol=1e-7)
    assert np.count_nonzero(np.isfinite(frequencies[0])) > 20


def test_the_weight_s_stiffness_is_the_derivative_of_its_wrench(seen_twice):
    """Of an unloaded pair of cables' worth: the weight's part alone, by differences of turns."""
    robot, _, (case, _), _ = seen_twice
    R0 = rotation_from_angles([0.2, -0.3, 0.4]).matrix()
    step, K = 1e-6, np.empty((3, 3))
    for k in range(3):
        ahead, back = (rotation_from_angles(s * step * np.eye(3)[k]).matrix() for s in (1, -1))
        wrenches = weight_wrenches(case, np.array([ahead @ R0, back @ R0]))
        K[:, k] = -(wrenches[0] - wrenches[1])[:3] / (2.0 * step)
    c, f = R0 @ robot.center_of_mass(), case.force()
    np.testing.assert_allclose(K, (f @ c) * np.eye(3) - np.outer(c, f), atol=1e-6)


def test_boxes_know_the_weight_s_direction(seen_twice):
    """The expansion over a box holds for the wrench itself, and its rest is none too large."""
    case, scale = seen_twice[2][0], seen_twice[2][0].row_scale()
    random, d, shares = np.random.default_rng(3), np.empty((7, 6)), []
    for _ in range(200):
        pose = np.concatenate([random.uniform(-0.2, 0.2, 3), random.uniform(-0.5, 0.5, 3)])
        half = random.uniform(0.0, 0.1, 6)
        rest = expand_demand(pose, half, case.load(), np.arange(6), scale, d)
        move = half * random.uniform(-1.0, 1.0, 6)
        R = rotation_from_angles(pose[3:] + move[3:]).matrix()
        demand = -weight_wrenches(case, R[np.newaxis])[0] / scale
        off = np.abs(demand - d[0] - move @ d[1:]) * scale
        assert np.all(off[3:] <= 1e-12)
        assert np.all(off[:3] <= rest)
        shares.append(np.max(off[:3]) / rest)
    assert max(shares) > 0.05

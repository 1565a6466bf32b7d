"""Stiffness, tension factors, demands of motions and tilted weight: against one pose and HiGHS."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from scipy.optimize import linprog

from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.control.task_space import PlatformDynamics, TaskGains, computed_torque
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.robot_copies import gravity_turn, turned_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.proofs.box_expansion_kernel import expand_demand
from cdpr_drake.statics.stiffness import natural_modes, platform_stiffness
from cdpr_drake.workspaces.demanded_wrenches import (
    MotionDemand,
    SpatialSet,
    accelerating,
    weight_wrenches,
)
from cdpr_drake.workspaces.inertial_wrenches import (
    LEAST_MOMENT,
    inertia_about_mass_centre,
    moment_box,
    turn_bounds,
    turning_wrenches,
)
from cdpr_drake.workspaces.static_feasibility import statically_feasible
from cdpr_drake.workspaces.stiffness import first_frequencies, held_tensions, stiffness_at
from cdpr_drake.workspaces.tension_factor import dexterities, tension_factors
from cdpr_drake.workspaces.wrench_capacity import (
    capacity_margins,
    largest_payloads,
    scaled_matrices,
)
from tests.workspaces.workspace_cases import loaded, random_poses, robot_case, rotations_of

ROUNDING = 1e-9
SAME = 1e-7  # relative; two orders of summation, at stiffnesses of 1e5 N/m


def inertia_of(robot):
    body = rigid_platform(robot)
    return body.mass, body.p_PCo, body.I_PPo


# Stiffness, tension factors, dexterity.


@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_stiffness_and_frequencies_are_those_of_single_poses(name):
    robot, case = robot_case(name, (1.0, 60.0) if name != "caroca" else None)
    body = rigid_platform(robot)
    positions, rotations = random_poses(robot, 30, seed=1, turn=0.1)
    stiffness = stiffness_at(case, positions, rotations)
    frequencies = first_frequencies(stiffness, case, inertia_of(robot), rotations)
    tensions, held = held_tensions(case, positions, rotations)
    np.testing.assert_array_equal(held, statically_feasible(case, positions, rotations))
    assert held.sum() > 3
    rows, scale = np.ix_(case.rows, case.rows), np.outer(case.row_scale(), case.row_scale())
    for k in np.flatnonzero(held):
        X_WP = RigidTransform(RotationMatrix(rotations[k]), positions[k])
        l0 = cable_paths(X_WP, case.cables).lengths / (1.0 + tensions[k] / case.cables.stiffness)
        l0[tensions[k] == 0.0] *= 1.0 + 1e-9  # slack, not by rounding taut
        K = platform_stiffness(case.cables, "elastic", body, X_WP, l0).total
        theirs, size = (0.5 * (K + K.T))[rows], np.abs(K).max()
        np.testing.assert_allclose(stiffness.K[k], theirs, atol=SAME * size)
        smallest = np.linalg.eigvalsh(theirs / scale)[0]
        assert stiffness.smallest[k] == pytest.approx(smallest, abs=1e-6 * size)
        if stiffness.stable[k]:
            first = natural_modes(K, body, X_WP).frequencies[0]
            assert frequencies[k] == pytest.approx(first, rel=1e-3)
        else:
            assert np.isnan(frequencies[k])
    assert np.all(np.isnan(stiffness.smallest[~held]))
    assert not np.any(stiffness.stable[~held])


def test_a_high_centre_of_mass_on_weak_ropes_is_not_stable():
    """A platform that hangs from ropes at its foot falls over where they give way easily."""
    _, case = robot_case("acrobot_large", (0.0, 1e4))
    place = np.array([[0.0, 0.0, 0.3]]), np.eye(3)[None]
    assert stiffness_at(case, *place).stable[0]
    weak = replace(case.cables, stiffness=np.full(8, 1.0))
    high = replace(case, cables=weak, p_PCo=np.array([0.0, 0.0, 5.0]))
    assert not stiffness_at(high, *place).stable[0]


@pytest.mark.parametrize("name", ["acrobot_large", "acrobot_fully_constrained", "planar"])
def test_tension_factors_are_those_of_highs(name):
    robot, case = robot_case(name, (0.2, 60.0))
    poses = random_poses(robot, 60, seed=2, turn=0.1)
    factors = tension_factors(case, *poses)
    held = statically_feasible(case, *poses)
    np.testing.assert_array_equal(np.isfinite(factors), held)
    W, loads = loaded(case, *poses)
    n, m = W.shape[1:]
    eye, one, zero = np.eye(m), np.ones((m, 1)), np.zeros((m, 1))
    A = np.vstack([
        np.hstack([-eye, zero, one]),
        np.hstack([-eye, 0.2 * one, zero]),
        np.hstack([eye, -60.0 * one, zero]),
    ])  # fmt: skip
    for k in np.flatnonzero(held)[:20]:  # unknowns t / max t, 1 / max t, ratio
        best = linprog(
            [*np.zeros(m + 1), -1.0], A_ub=A, b_ub=np.zeros(3 * m),
            A_eq=np.column_stack([W[k], loads[k], np.zeros(n)]), b_eq=np.zeros(n),
            bounds=[(0, 1)] * m + [(0, None), (0, 1)], method="highs",
        )  # fmt: skip
        assert factors[k] == pytest.approx(-best.fun, abs=1e-6)


def test_dexterity_is_the_inverse_condition_number():
    robot, case = robot_case("acrobot_large")
    poses = random_poses(robot, 20)
    numbers = [np.linalg.cond(W) for W in scaled_matrices(case, *poses)]
    np.testing.assert_allclose(dexterities(case, *poses), 1.0 / np.array(numbers), rtol=1e-6)


# Accelerations.


def test_accelerating_needs_the_rate_of_momentum():
    """Against finite differences of linear and angular momentum along a motion."""
    robot, case = robot_case("acrobot_large")
    mass, _, I_PPo = inertia_of(robot)
    p_PCo = np.array([0.03, -0.02, 0.05])
    I_PPo = I_PPo + np.array([[0.02, 0.003, 0], [0.003, 0.03, -0.002], [0, -0.002, 0.04]])
    w, alpha = np.array([1.0, -2.0, 1.5]), np.array([0.5, 0.2, -1.0])
    v, a = np.array([0.3, 0.1, 0.2]), np.array([1.0, 2.0, -3.0])
    R0 = rotation_from_angles(np.array([0.3, -0.2, 0.5])).matrix()

    def momenta(t):
        turn = w * t + 0.5 * alpha * t * t  # good to second order about t = 0
        size = np.linalg.norm(turn)
        K = np.cross(np.eye(3), turn / size)
        R = (np.eye(3) + np.sin(size) * K + (1 - np.cos(size)) * K @ K) @ R0
        # The commutator of w and alpha comes in at t^3 only.
        w_t, v_t, c = w + alpha * t, v + a * t, R @ p_PCo
        linear = mass * (v_t + np.cross(w_t, c))
        about_po = R @ I_PPo @ R.T @ w_t + mass * np.cross(c, v_t)
        moved = v * t + 0.5 * a * t * t
        return np.concatenate([about_po + np.cross(moved, linear), linear])  # about where Po was

    accelerations = SpatialSet(vertices=np.concatenate([alpha, a])[None])
    motion = MotionDemand(mass, p_PCo, I_PPo, accelerations, np.concatenate([w, v])[None])
    demand = accelerating(case, motion, R0[None])
    weightless = demand.points[0, 0] + weight_wrenches(case, R0[None])[0]
    rate = (momenta(1e-5) - momenta(-1e-5)) / 2e-5
    np.testing.assert_allclose(weightless, rate, atol=1e-6)


def test_a_box_of_accelerations_is_that_of_its_corners_and_none_is_weight_alone():
    robot, case = robot_case("caroca")
    positions, rotations = random_poses(robot, 30, seed=5)

    def margins(accelerations, velocities):
        motion = MotionDemand(*inertia_of(robot), accelerations, velocities)
        demand = accelerating(case, motion, rotations)
        return capacity_margins(case, positions, rotations, demand).margins

    box = SpatialSet(box=np.array([1.0, 2.0, 3.0, 1.0, 1.0, 2.0]))
    points = SpatialSet(vertices=box.corners(case.rows))
    V = np.array([[0.5, -0.5, 1.0, 0, 0, 0], [0, 0, 0, 1, 1, 1]])
    np.testing.assert_allclose(margins(box, V), margins(points, V), rtol=1e-9)
    alone = capacity_margins(case, positions, rotations).margins
    np.testing.assert_allclose(margins(SpatialSet(), np.zeros((1, 6))), alone)


# Wrenches of bounded motions.

MASS, C = 3.0, np.array([0.02, -0.05, 0.1])
G = np.array([0.05, 0.07, 0.04])
M_PPo_P = SpatialInertia(MASS, C, UnitInertia(*G, 0.004, -0.003, 0.002).ShiftFromCenterOfMass(C))
I_PPo = M_PPo_P.CalcRotationalInertia().CopyToFullMatrix3()
I_CO = inertia_about_mass_centre(MASS, C, I_PPo)
MIDDLE, HALVES = np.array([0.2, -0.3, 0.9]), np.radians([5.0, 8.0, 20.0])
LINEAR, ANGULAR = np.array([0.5, 0.7, 0.3]), np.array([1.0, 2.0, 0.5])
MOMENTS = moment_box(MASS, C, I_PPo, ANGULAR)


def share(halves, R, w_P, n, a_Co):
    """By how much of the set about zero a motion's wrench lies in it; 1: on its border.

    The wrench is that of the kernel of computed torque, without weight.
    """
    vertices = turning_wrenches(MASS, C, MOMENTS, LINEAR, MIDDLE, halves).vertices
    assert vertices.shape[1] == 6
    alpha_P = np.linalg.solve(I_CO, n - np.cross(w_P, I_CO @ w_P))
    w, alpha, c = R @ w_P, R @ alpha_P, R @ C
    a_Po = a_Co - np.cross(alpha, c) - np.cross(w, np.cross(w, c))
    V, X = np.concatenate([w, np.zeros(3)]), RigidTransform(RotationMatrix(R), np.zeros(3))
    wrench = computed_torque(
        X, V, X, V, np.concatenate([alpha, a_Po]), gains=TaskGains(0.0, 0.0),
        dynamics=PlatformDynamics(M_PPo_P, gravity=0.0),
    )  # fmt: skip
    best = linprog(np.ones(len(vertices)), A_eq=vertices.T, b_eq=-wrench, method="highs")
    assert best.status == 0
    return best.fun


def test_every_motion_within_the_bounds_asks_a_wrench_of_the_set():
    random, largest = np.random.default_rng(0), 0.0
    for k in range(120):
        if k % 2:
            turn, n, a = random.uniform(-1, 1, (3, 3))
        else:
            turn, n, a = random.choice([-1.0, 1.0], (3, 3))
        R = rotation_from_angles(MIDDLE + HALVES * turn).matrix()
        part = share(HALVES, R, random.normal(0.0, 2.0, 3), MOMENTS * n, LINEAR * a)
        assert part <= 1.0 + ROUNDING
        largest = max(largest, part)
    assert largest > 0.9  # and the set is hardly larger than needed


def test_without_a_range_the_set_is_attained_at_all_corners():
    random, R = np.random.default_rng(1), rotation_from_angles(MIDDLE).matrix()
    for a, n in random.choice([-1.0, 1.0], (20, 2, 3)):
        part = share(np.zeros(3), R, np.zeros(3), MOMENTS * n, LINEAR * a)
        assert part == pytest.approx(1.0, abs=ROUNDING)


def test_the_inertia_about_the_mass_centre_is_that_of_drake():
    drake = M_PPo_P.Shift(C).CalcRotationalInertia().CopyToFullMatrix3()
    np.testing.assert_allclose(I_CO, drake, atol=1e-12)
    only = moment_box(MASS, C, I_PPo, np.array([0.0, 0.0, 2.0]))
    assert only[2] == pytest.approx(2.0 * drake[2, 2])
    assert np.min(only) >= LEAST_MOMENT * np.max(only)


@pytest.mark.parametrize("middle", [np.zeros(3), MIDDLE], ids=["upright", "turned"])
def test_turns_from_the_middle_are_bounded_entry_by_entry(middle):
    random = np.random.default_rng(2)
    size, change = turn_bounds(middle, HALVES)
    picks = [*random.choice([-1.0, 1.0], (50, 3)), *random.uniform(-1.0, 1.0, (500, 3))]
    R = rotation_from_angles(middle).matrix()
    E = R.T @ rotations_of(middle + HALVES * np.array(picks))
    most, far = np.abs(E).max(axis=0), np.abs(E - np.eye(3)).max(axis=0)
    assert np.all(most <= size + ROUNDING)
    assert np.all(far <= change + ROUNDING)
    assert np.max(size - most) < 0.1
    yaw = turn_bounds(np.zeros(3), np.array([0.0, 0.0, 0.3]))[0]
    np.testing.assert_allclose(yaw[[0, 1, 2, 2], [2, 2, 0, 1]], 0.0)  # no moment gets from z to x
    assert yaw[0, 1] == pytest.approx(np.sin(0.3))


# Weight that pulls where the robot's file says.


@pytest.fixture(scope="module")
def tilted():
    """A robot with tilted gravity and an arm to its centre of mass, as it is and turned upright.

    The robot, the turn, and per world a case and 250 poses.
    """
    robot = load_robot("acrobot_small")
    robot.gravity_direction = np.array([0.3, -0.2, -0.8])
    robot.platform.center_of_mass = np.array([0.03, -0.02, 0.08])
    R_UW = gravity_turn(robot)
    upright = turned_robot(robot, R_UW)
    np.testing.assert_allclose(upright.down(), [0.0, 0.0, -1.0], atol=1e-15)
    positions, rotations = random_poses(robot, 250)
    R = R_UW.matrix()
    assert R[2, 2] < 0.95
    cases = [static_case(each, (0.0, 60.0)) for each in (robot, upright)]
    worlds = [(cases[0], positions, rotations), (cases[1], positions @ R.T, R @ rotations)]
    return robot, R, worlds


def test_feasibility_does_not_depend_on_the_axes_of_the_world(tilted):
    robot, _, worlds = tilted
    here, there = (statically_feasible(*world) for world in worlds)
    np.testing.assert_array_equal(here, there)
    assert 0.05 < np.mean(here) < 0.95
    straight = load_robot("acrobot_small")
    straight.platform.center_of_mass = robot.platform.center_of_mass
    along_z = statically_feasible(static_case(straight, (0.0, 60.0)), *worlds[0][1:])
    assert np.count_nonzero(along_z != here) > 10  # gravity along -z is another question


def margins_accelerating(case, p, R):
    """An ellipsoid of accelerations has no axes."""
    ball = SpatialSet(ellipsoid=np.array([0, 0, 0, 2.0, 2.0, 2.0]))
    motion = MotionDemand(case.load()[0], case.p_PCo, np.eye(3), ball, np.zeros((1, 6)))
    return capacity_margins(case, p, R, accelerating(case, motion, R)).margins


@pytest.mark.parametrize("function", [
    lambda case, p, R: capacity_margins(case, p, R).margins,
    lambda case, p, R: largest_payloads(case, p, R, 9.81),
    tension_factors,
    margins_accelerating,
], ids=["margins", "payloads", "factors", "accelerating"])  # fmt: skip
def test_numbers_do_not_depend_on_the_axes_of_the_world(tilted, function):
    here, there = (function(*world) for world in tilted[2])
    np.testing.assert_allclose(here, there, rtol=1e-6, atol=1e-7)
    assert np.count_nonzero(np.isfinite(here)) > 15


def test_stiffness_and_frequency_turn_with_the_world(tilted):
    robot, R_UW, worlds = tilted
    here, there = (stiffness_at(*world) for world in worlds)
    np.testing.assert_array_equal(here.held, there.held)
    turn = np.kron(np.eye(2), R_UW)
    K = turn @ here.K @ turn.T
    np.testing.assert_allclose(K[here.held], there.K[here.held], rtol=1e-7, atol=1e-4)
    frequencies = [
        first_frequencies(stiffness, case, inertia_of(robot), R)
        for stiffness, (case, _, R) in zip((here, there), worlds, strict=True)
    ]
    np.testing.assert_allclose(*frequencies, rtol=1e-7)
    assert np.count_nonzero(np.isfinite(frequencies[0])) > 15


def test_boxes_know_the_weight_s_direction(tilted):
    """The expansion over a box holds for the wrench itself, and its rest is none too large."""
    case = tilted[2][0][0]
    scale, random = case.row_scale(), np.random.default_rng(3)
    d, shares = np.empty((7, 6)), []
    for _ in range(200):
        pose = np.concatenate([random.uniform(-0.2, 0.2, 3), random.uniform(-0.5, 0.5, 3)])
        half = random.uniform(0.0, 0.1, 6)
        rest = expand_demand(pose, half, case.load(), np.arange(6), scale, d)
        move = half * random.uniform(-1.0, 1.0, 6)
        demand = -weight_wrenches(case, rotations_of([pose[3:] + move[3:]]))[0] / scale
        off = np.abs(demand - d[0] - move @ d[1:]) * scale
        assert np.all(off[3:] <= 1e-12)
        assert np.all(off[:3] <= rest)
        shares.append(np.max(off[:3]) / rest)
    assert max(shares) > 0.05

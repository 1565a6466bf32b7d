"""What cables hold: nearest held poses, tensions of any cable model, wrenches of few cables."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.optimize import linprog, lsq_linear
from scipy.spatial.transform import Rotation

from cdpr_drake.cables.states import cable_state
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.geometry.straight_cables import gravity_wrench
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.controlled_wrenches import wrench_control
from cdpr_drake.statics.nearest_held_pose import (
    Load,
    holding_tensions,
    nearest_held_pose,
    pose_distance,
)
from cdpr_drake.statics.static_tensions import find_static_tensions, lengths_for_tensions
from tests.statics.statics_cases import displaced

# The nearest held pose.

ROBOT = load_robot("acrobot_large")
CABLES = ROBOT.cable_set().without_pulleys()
LOAD = Load(ROBOT.platform.mass, ROBOT.box_center(), ROBOT.gravity_vector())
"""In the middle of the box: the poses below were found for it."""
SIZE = 0.135
LEAST, MOST = 0.5, 60.0
HOME = ROBOT.home.transform()
EVERY = np.tile([[LEAST], [MOST]], (1, CABLES.count))

HELD = 1e-4
"""Wrench that is missing, per weight, of what least squares count as held: their own tolerance."""


def bounds(broken):
    own = np.arange(CABLES.count) != broken
    return np.array([LEAST * own, MOST * own])


def missing(X_WP, broken, load=LOAD):
    """Wrench per weight that no tensions give, by bounded least squares."""
    own = np.arange(CABLES.count) != broken
    scale = load.weight * np.array([SIZE] * 3 + [1.0] * 3)
    W = -cable_jacobian(X_WP, CABLES).T[:, own] / scale[:, np.newaxis]
    weight = load.mass * load.gravity
    wrench = np.concatenate([np.cross(X_WP.rotation() @ load.p_PCo, weight), weight])
    solved = lsq_linear(W, -wrench / scale, bounds=(LEAST, MOST), method="bvls")
    return float(np.linalg.norm(solved.fun))


def apart(X, Y):
    """|(l theta, p)| of two poses by SciPy's rotations [m]."""
    turn = Rotation.from_matrix(Y.rotation().matrix() @ X.rotation().matrix().T).as_rotvec()
    move = Y.translation() - X.translation()
    return float(np.hypot(SIZE * np.linalg.norm(turn), np.linalg.norm(move)))


TURNED = RigidTransform(
    RollPitchYaw([0.1, -0.15, 0.6]), HOME.translation() + np.array([0.03, -0.02, 0.04])
)
ASIDE = Load(LOAD.mass, np.array([0.02, -0.015, 0.03]), LOAD.gravity)


@pytest.mark.parametrize(
    ("X_WP", "load", "broken"),
    [(HOME, LOAD, 0), (HOME, LOAD, 4), (HOME, LOAD, 7), (TURNED, ASIDE, 0), (TURNED, ASIDE, 6)],
)
def test_the_nearest_held_pose_is_held_and_none_nearer_is(X_WP, load, broken):
    found = nearest_held_pose(X_WP, CABLES, load, bounds(broken), size=SIZE)
    if X_WP is HOME:
        assert 0.001 < found.distance < 0.05
    assert found.distance == pytest.approx(pose_distance(X_WP, found.X_WP, SIZE))
    assert found.distance == pytest.approx(apart(X_WP, found.X_WP), rel=1e-9)
    assert missing(found.X_WP, broken, load) < HELD
    assert missing(X_WP, broken, load) > 10.0 * HELD
    draws = np.random.default_rng(broken)
    for _ in range(80):
        away = draws.standard_normal(6)
        away *= 0.9 * found.distance * draws.uniform() ** (1.0 / 6.0) / np.linalg.norm(away)
        near = displaced(X_WP, np.concatenate([away[:3] / SIZE, away[3:]]))
        assert missing(near, broken, load) > HELD


@pytest.mark.parametrize(
    ("broken", "angles", "position"),
    [
        (4, [-0.0799, 0.5155, -0.0077], [0.0147, 0.1429, 0.1073]),
        (1, [0.1567, -0.6117, 0.0781], [0.0117, -0.2055, 0.391]),
    ],
)
def test_other_starts_find_nearer_ones_and_the_nearest_counts(broken, angles, position):
    """From these poses alone the search ends in a local solution that is farther away."""
    X_WP = RigidTransform(RollPitchYaw(angles), position)
    alone = nearest_held_pose(X_WP, CABLES, LOAD, bounds(broken), size=SIZE)
    helped = nearest_held_pose(X_WP, CABLES, LOAD, bounds(broken), size=SIZE, starts=[HOME])
    assert helped.distance < 0.9 * alone.distance
    assert apart(X_WP, helped.X_WP) == pytest.approx(helped.distance, rel=1e-9)
    assert missing(helped.X_WP, broken) < HELD
    # A start that is farther changes nothing where the own one is best.
    near = nearest_held_pose(HOME, CABLES, LOAD, bounds(broken), size=SIZE)
    same = nearest_held_pose(HOME, CABLES, LOAD, bounds(broken), size=SIZE, starts=[X_WP])
    assert same.distance <= near.distance * (1.0 + 1e-6)


def test_a_cable_whose_tension_is_given_has_it():
    """At home the others cannot hold against 45 N of one; the pose that is found is held so."""
    fixed = EVERY.copy()
    fixed[:, 2] = 45.0
    assert holding_tensions(HOME, CABLES, LOAD, fixed, SIZE) is None
    found = nearest_held_pose(HOME, CABLES, LOAD, fixed, size=SIZE)
    assert found.distance > 1e-3
    assert found.tensions[2] == pytest.approx(45.0, abs=1e-9)
    W, wrench = -cable_jacobian(found.X_WP, CABLES).T, LOAD.wrench(found.X_WP)
    tolerance = 1e-5 * LOAD.weight  # balance is asked to 1e-6 of the weight
    np.testing.assert_allclose(W @ found.tensions, -wrench, atol=tolerance)


def test_tensions_that_hold_a_pose_have_the_least_sum():
    """Beside the same program with equations in place of a room."""
    tensions, W = holding_tensions(HOME, CABLES, LOAD, EVERY, SIZE), -cable_jacobian(HOME, CABLES).T
    least, most = (
        sign * linprog(sign * np.ones(8), A_eq=W, b_eq=-LOAD.wrench(HOME), bounds=EVERY.T).fun
        for sign in (1.0, -1.0)
    )
    assert np.sum(tensions) == pytest.approx(least, rel=1e-4)
    assert most > 1.001 * least


def test_a_pose_that_is_held_stays_and_weak_cables_hold_none():
    found = nearest_held_pose(HOME, CABLES, LOAD, EVERY, size=SIZE)
    assert found.distance < 1e-6
    W = -cable_jacobian(found.X_WP, CABLES).T
    assert W @ found.tensions == pytest.approx(-LOAD.wrench(found.X_WP), abs=1e-4)
    weak = np.tile([[0.0], [1.0]], (1, CABLES.count))
    assert nearest_held_pose(HOME, CABLES, LOAD, weak, size=SIZE) is None
    assert holding_tensions(HOME, CABLES, LOAD, weak, SIZE) is None


# Tensions of any cable model.

BALANCE = 1e-6
"""Force [N] and moment [N m] left of 1.5 kN: lengths of 4 m are rounded to 4e-16 m, times a
stiffness of 1 MN/m for each of eight cables, and tensions are settled to 1e-12."""

CAROCA = load_robot("caroca")
PULLEYS = CAROCA.cable_set()
STRAIGHT = PULLEYS.without_pulleys()
LIMITS = (0.0, 1e4)

poses = st.builds(
    lambda angles, position: RigidTransform(rotation_from_angles(np.array(angles)), position),
    st.tuples(*[st.floats(-0.1, 0.1)] * 3),
    st.tuples(st.floats(-0.6, 0.6), st.floats(-1.0, 1.0), st.floats(0.5, 1.8)),
)


def static_tensions(cables, model, X_WP):
    robot = CAROCA
    w = gravity_wrench(X_WP, robot.platform.mass, robot.center_of_mass(), robot.gravity)
    return find_static_tensions(cables, model, X_WP, w, LIMITS), w


@pytest.mark.parametrize("model", ["elastic", "kelvin_voigt", "catenary"])
@pytest.mark.parametrize("cables", [STRAIGHT, PULLEYS], ids=["straight", "pulleys"])
@settings(max_examples=6, deadline=None)
@given(X_WP=poses)
def test_static_tensions_hold_the_platform(model, cables, X_WP):
    found, w = static_tensions(cables, model, X_WP)
    state = cable_state(cables, model, X_WP, found.unstrained_lengths)
    np.testing.assert_allclose(state.wrench, -w, atol=BALANCE)
    np.testing.assert_allclose(state.tensions, found.tensions, atol=BALANCE)
    np.testing.assert_allclose(state.drum_tensions, found.drum_tensions, atol=BALANCE)
    assert np.all((found.tensions >= -BALANCE) & (found.tensions <= LIMITS[1]))


def test_heavy_cables_carry_themselves_too():
    """The tensions at A hold platform and cables, those at B the platform."""
    X_WP = CAROCA.home.transform()
    heavy, light = (static_tensions(STRAIGHT, name, X_WP)[0] for name in ("catenary", "elastic"))
    assert np.all(heavy.drum_tensions > heavy.tensions)
    rope = np.sum(STRAIGHT.linear_weight * heavy.unstrained_lengths)
    # Half of the cables' weight hangs on the platform, steeply enough to take more than that.
    assert np.sum(heavy.drum_tensions - light.tensions) > 0.5 * rope


def test_inextensible_cables_have_the_lengths_of_their_ways():
    X_WP = CAROCA.home.transform()
    found, _ = static_tensions(PULLEYS, "inextensible", X_WP)
    np.testing.assert_array_equal(found.unstrained_lengths, cable_paths(X_WP, PULLEYS).lengths)


@pytest.mark.parametrize("model", ["elastic", "catenary"])
def test_lengths_belong_to_their_tensions_and_there_are_none_where_nothing_holds(model):
    X_WP, tensions = CAROCA.home.transform(), np.array([20, 30, 100, 300, 1e3, 3e3, 9e3, 50.0])
    l0 = lengths_for_tensions(PULLEYS, model, X_WP, tensions)
    found = cable_state(PULLEYS, model, X_WP, l0).tensions
    np.testing.assert_allclose(found, tensions, rtol=0, atol=1e-6)
    assert static_tensions(STRAIGHT, model, RigidTransform([1.9, 3.4, 1.0]))[0] is None


# What few cables control.

W = np.random.default_rng(4).normal(size=(6, 3))
"""Three cables on six degrees of freedom."""


def control(matrix, wrench):
    m = matrix.shape[1]
    return wrench_control(matrix, wrench, np.zeros(m), np.full(m, 1e12), np.ones(6))


@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e12])
def test_the_rank_does_not_depend_on_the_unit(unit):
    """Of three cables, of which two pull in the same direction up to rounding."""
    doubled = unit * np.column_stack([W[:, 0], W[:, 1], W[:, 0] / 3.0 + W[:, 1] / 7.0])
    assert np.linalg.svd(doubled)[1][2] > 0.0  # rounded, or this looks at nothing
    nearly = unit * np.column_stack([W[:, 0], W[:, 0] + 1e-8 * W[:, 1]])
    ranks = [control(matrix, np.zeros(6)).rank for matrix in (unit * W, doubled, nearly)]
    assert ranks == [3, 2, 2]


def test_cables_without_any_effect_control_nothing():
    nothing = np.zeros((6, 3))
    found = control(nothing, np.zeros(6))
    assert found.rank == 0
    assert found.balances
    np.testing.assert_array_equal(np.abs(found.free).sum(axis=0), np.ones(6))
    assert not control(nothing, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1e-6])).balances


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_a_wrench_of_any_size_is_balanced_up_to_rounding(size):
    tensions = size * np.array([1.0, 2.0, 3.0])
    wrench = -W @ tensions
    found = control(W, wrench)
    assert found.balances
    np.testing.assert_allclose(found.tensions, tensions, rtol=1e-6)
    twist = found.free[:, 0] / np.linalg.norm(found.free[:, 0])
    push = np.linalg.norm(wrench) * twist
    assert control(W, wrench + 1e-10 * push).balances
    pushed = control(W, wrench + 1e-6 * push)
    assert not pushed.balances
    assert pushed.tensions is None


def test_each_free_twist_stands_alone_in_a_row():
    """So that it is read without the others; and none of them changes a length."""
    free = control(W, np.zeros(6)).free
    assert free.shape == (6, 3)
    np.testing.assert_allclose(W.T @ free, 0.0, atol=1e-9)
    for k in range(3):
        others = np.delete(free, k, axis=1)
        assert np.any((free[:, k] != 0.0) & np.all(others == 0.0, axis=1)), k

"""Poses from lengths: those that the lengths are of, least squares by SciPy, covariances."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cdpr_drake.cables.elastic_law import stretched_lengths, unstrained_lengths
from cdpr_drake.errors import ForwardKinematicsError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.motion_type import FREE, LEVEL
from cdpr_drake.geometry.poses import (
    pose_error,
    pose_from_angles,
    pose_from_row,
    pose_row,
    rotation_from_vector,
)
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.statics import pose_fit_kernel as kernel
from cdpr_drake.statics.forward_kinematics import ForwardKinematics, tautest_cables
from cdpr_drake.tensions.methods import exact_tensions
from tests.statics.statics_cases import displaced

EXACT = 1e-9
"""Poses from exact lengths: rounding of lengths of metres, times the condition of J [m, rad]."""

ROUNDING = 1e-13
"""Of lengths, positions and unit vectors by two ways of computing [m, -]."""

WORKSPACE = {
    "acrobot_small": ([-0.35, -0.35, 0.1], [0.35, 0.35, 0.8]),
    "acrobot_large": ([-0.35, -0.35, 0.1], [0.35, 0.35, 0.8]),
    "acrobot_fully_constrained": ([-0.3, -0.3, 0.25], [0.3, 0.3, 0.8]),
    "caroca": ([-1.2, -2.4, 0.3], [1.2, 2.4, 2.4]),
    "planar": ([-0.3, -0.3, 0.3], [0.3, 0.3, 0.3]),
}

ACROBOT = load_robot("acrobot_large")
HOME = ACROBOT.home.transform()
FK = ForwardKinematics(ACROBOT.cable_set())
ASIDE = pose_from_angles([0.1, -0.2, 0.4], [0.1, 0.2, -0.1])


def disturbed(X_WP, random, distance, angle, planar=False):
    """A pose within a distance [m] and an angle [rad] of another."""
    p, w = random.normal(size=3), random.normal(size=3)
    if planar:
        p[2] = w[0] = w[1] = 0.0
    p *= distance * np.cbrt(random.uniform()) / np.linalg.norm(p)
    w *= angle * np.cbrt(random.uniform()) / np.linalg.norm(w)
    return displaced(X_WP, np.concatenate([w, p]))


def starts(name, cables, count, distance, angle):
    """Random poses, their lengths, and guesses beside them."""
    random, planar = np.random.default_rng(0), name == "planar"
    turn = [0.0, 0.0, 0.25] if planar else [0.25] * 3
    true = [
        pose_from_angles(random.uniform(*WORKSPACE[name]), turn * random.uniform(-1.0, 1.0, 3))
        for _ in range(count)
    ]
    guesses = [disturbed(X, random, distance, angle, planar) for X in true]
    fk = ForwardKinematics(cables, LEVEL if planar else FREE)
    rows = [np.array([pose_row(X) for X in poses]) for poses in (true, guesses)]
    return fk, np.array([fk.lengths(X) for X in true]), *rows


def distances(poses, others):
    """Distance [m] and angle [rad] between poses in arrays."""
    sign = np.sign(np.sum(poses[:, :4] * others[:, :4], axis=1))
    chord = np.linalg.norm(sign[:, np.newaxis] * poses[:, :4] - others[:, :4], axis=1)
    return np.linalg.norm(poses[:, 4:] - others[:, 4:], axis=1), 4.0 * np.arcsin(chord / 2.0)


# Starts.


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("name", sorted(WORKSPACE))
def test_no_start_within_5_cm_and_10_deg_fails(name, pulleys):
    cables = load_robot(name).cable_set()
    cables = cables if pulleys else cables.without_pulleys()
    fk, lengths, true, guesses = starts(name, cables, 1000, 0.05, np.radians(10.0))
    many = fk.poses(lengths, guesses)
    assert np.all(many.codes == 1)
    apart, angle = distances(many.poses, true)
    assert np.max(apart) < EXACT
    assert np.max(angle) < EXACT
    for k in range(5):  # one pose is as in a batch
        fit = fk.pose(lengths[k], pose_from_row(guesses[k]))
        assert pose_error(fit.X_WP, pose_from_row(true[k])) < (EXACT, EXACT)
        assert fit.steps == many.steps[k]
        np.testing.assert_allclose(fit.residuals, 0.0, atol=1e-13)


def test_from_anywhere_never_a_wrong_pose():
    fk, lengths, true, guesses = starts("acrobot_large", FK.cables, 1000, 0.6, np.pi)
    many = fk.poses(lengths, guesses)
    right = many.codes == 1
    apart, angle = distances(many.poses[right], true[right])
    assert np.max(apart) < 1e-6
    assert np.max(angle) < 1e-6
    assert np.all(np.isnan(many.poses[~right]))
    assert 0.3 < np.mean(right) < 1.0  # such starts do end at wrong minima


def test_turned_guesses_help_where_the_first_ends_wrong():
    true, cables = RigidTransform([0.0, 0.0, 0.3]), FK.cables.packed()
    lengths, J = np.empty(8), np.empty((8, 6))
    kernel.lengths_at(np.append(pose_row(true), np.zeros(6)), cables, lengths, J)
    state, work, used = np.empty(13), np.empty(kernel.WORK_SHAPE), np.arange(8)
    random, helped, free = np.random.default_rng(0), 0, FREE.packed()
    for _ in range(300):
        R = rotation_from_vector(2.0 * random.normal(size=3) / np.sqrt(3.0))
        guess = np.append(pose_row(RigidTransform(R, [0.0, 0.0, 0.3])), np.zeros(6))
        alone = guess.copy()
        first, _ = kernel._descend(alone, cables, used, lengths, free, 1e-6, work)
        code, _ = kernel.fit_pose(guess[:7], cables, used, lengths, free, 1e-6, state, work)
        helped += code == kernel.FITS != first
        if code == kernel.FITS:
            np.testing.assert_allclose(np.abs(state[:4]), [1.0, 0.0, 0.0, 0.0], atol=1e-9)
        else:
            np.testing.assert_array_equal(state, alone)
    assert helped > 0


# Least squares.


@pytest.mark.parametrize("motion", [FREE, LEVEL])
def test_normal_equations(motion):
    X = pose_from_angles([0.1, -0.1, 0.4], [0.2, 0.1, -0.3])
    paths, used = cable_paths(X, FK.cables), np.array([0, 2, 3, 4, 6, 7])
    lengths = paths.lengths + np.linspace(-0.1, 0.2, 8)
    A, g, state = np.empty((6, 6)), np.empty(6), np.append(pose_row(X), np.zeros(6))
    cost, largest = kernel._normal_equations(
        state, FK.cables.packed(), used, lengths, motion.packed(), np.empty((7, 6)), A, g
    )
    J, r = paths.J[used], (paths.lengths - lengths)[used]
    expected, slope = J.T @ J, J.T @ r
    if motion is LEVEL:
        fixed = np.isin(np.arange(6), [2, 3, 4], invert=True)
        expected[fixed] = 0.0
        expected[:, fixed] = 0.0
        expected[fixed, fixed] = 1.0
        slope[fixed] = 0.0
    np.testing.assert_allclose(np.tril(A), np.tril(expected), atol=1e-12)
    np.testing.assert_allclose(g, slope, atol=1e-12)
    assert cost == pytest.approx(r @ r)
    assert largest == pytest.approx(np.max(np.abs(r)))


def by_scipy(start, lengths):
    """Residuals of the least-squares pose."""

    def residuals(x):
        return FK.lengths(displaced(start, x)) - lengths

    return least_squares(residuals, np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15).fun


def test_measured_lengths_give_the_least_squares_pose():
    lengths = FK.lengths(ASIDE) + 1e-3 * np.random.default_rng(2).normal(size=8)
    fit = FK.pose(lengths, HOME, tolerance=0.01)
    np.testing.assert_allclose(fit.residuals, by_scipy(ASIDE, lengths), atol=1e-9)
    np.testing.assert_allclose(fit.J.T @ fit.residuals, 0.0, atol=1e-12)


def test_lengths_that_no_pose_has_say_by_how_much():
    lengths = FK.lengths(HOME)
    lengths[2] += 0.02
    errors = np.abs(by_scipy(HOME, lengths))
    worst = np.argmax(errors)
    words = f"misses cable {worst + 1} by {1e3 * errors[worst]:.4g} mm"
    with pytest.raises(ForwardKinematicsError, match=words):
        FK.pose(lengths, HOME)
    assert FK.poses(lengths[None], pose_row(HOME)[None]).codes[0] == 0
    FK.pose(lengths, HOME, tolerance=0.02)


def test_covariance_is_that_of_many_measurements():
    """Sample covariances of 10,000 differ from the true one by about 1 per cent."""
    sigma, count = 1e-4, 10_000
    lengths = FK.lengths(ASIDE) + sigma * np.random.default_rng(0).normal(size=(count, 8))
    poses = FK.poses(lengths, np.tile(pose_row(ASIDE), (count, 1)), tolerance=0.01).poses
    turns = Rotation.from_quat(poses[:, [1, 2, 3, 0]])
    turns = turns * Rotation.from_matrix(ASIDE.rotation().matrix()).inv()
    moves = poses[:, 4:] - ASIDE.translation()
    sampled = np.cov(np.column_stack([turns.as_rotvec(), moves]).T)
    expected = FK.pose(FK.lengths(ASIDE), ASIDE).covariance(sigma)
    deviations = np.sqrt(np.diag(expected))
    sizes = np.outer(deviations, deviations)
    np.testing.assert_allclose(sampled / sizes, expected / sizes, atol=0.05)


def test_condition_does_not_depend_on_units():
    cables = FK.cables
    sizes = {k: 1e3 * getattr(cables, k) for k in ("p_WA", "p_PB", "pulley_radius")}
    big, X = ForwardKinematics(replace(cables, **sizes)), HOME
    X_big = RigidTransform(X.rotation(), 1e3 * X.translation())
    conditions = [
        fk.pose(fk.lengths(pose), pose).condition(arm)
        for fk, pose, arm in ((FK, X, 0.125), (big, X_big, 125.0))
    ]
    assert conditions[1] == pytest.approx(conditions[0], rel=1e-9)


# Some of the cables.


def test_six_tautest_elastic_cables():
    robot = load_robot("caroca")
    cables, X = robot.cable_set(), pose_from_angles([0.3, -0.5, 1.2], [0.02, 0.05, -0.1])
    tensions, fk = exact_tensions(tension_problem(robot, X)), ForwardKinematics(cables)
    l0 = unstrained_lengths(fk.lengths(X), tensions, cables.stiffness)
    guess = disturbed(X, np.random.default_rng(0), 0.005, 0.01)
    tautest = tautest_cables(tensions, 6)
    elastic = fk.pose(stretched_lengths(l0, tensions, cables.stiffness), guess, tautest)
    assert pose_error(elastic.X_WP, X) < (EXACT, EXACT)
    assert len(elastic.residuals) == 6
    distance, _ = pose_error(fk.pose(l0, guess, tautest).X_WP, X)
    assert 1e-4 < distance < 1e-2  # a stretch of a millimetre


def test_slack_cables_are_left_alone():
    lengths, tensions = FK.lengths(HOME), np.arange(8.0)
    lengths[:2] += 0.1
    guess = disturbed(HOME, np.random.default_rng(1), 0.003, 0.01)
    fit = FK.pose(lengths, guess, tautest_cables(tensions, 6))
    assert pose_error(fit.X_WP, HOME) < (EXACT, EXACT)
    np.testing.assert_array_equal(tautest_cables([3.0, 1.0, 2.0, 0.0, 2.0], 3), [0, 2, 4])
    np.testing.assert_array_equal(tautest_cables(np.ones(8), 6), np.arange(6))


def test_six_lengths_give_a_near_pose_that_has_them():
    """Several assemblies fit six lengths; which is true, the lengths cannot say."""
    count, arm = 2000, np.array([[1.0], [0.125]])  # turns weigh as they move anchor points [m]
    fk, lengths, true, guesses = starts("acrobot_large", FK.cables, count, 0.05, np.radians(10.0))
    random = np.random.default_rng(4)
    used = np.array([np.sort(random.permutation(8)[:6]) for _ in range(count)])
    many = fk.poses(lengths, guesses, used)
    fits = many.codes == 1
    assert np.mean(fits) > 0.999
    for k in np.flatnonzero(fits)[:200]:
        at = fk.lengths(pose_from_row(many.poses[k]))
        np.testing.assert_allclose(at[used[k]], lengths[k, used[k]], atol=1e-6)
    to_fit, to_true = (
        np.hypot(*(arm * distances(poses[fits], guesses[fits]))) for poses in (many.poses, true)
    )
    assert np.mean(to_fit < to_true + 1e-9) > 0.98
    assert 0.9 < np.mean(distances(many.poses[fits], true[fits])[0] < 1e-6) < 1.0


@given(st.tuples(*[st.floats(-0.3, 0.3)] * 2), st.floats(-0.4, 0.4), st.booleans())
def test_planar_robot_from_three_cables(position, angle, pulleys):
    cables = load_robot("planar").cable_set()
    fk = ForwardKinematics(cables if pulleys else cables.without_pulleys(), LEVEL)
    X = pose_from_angles([*position, 0.3], [0.0, 0.0, angle])
    guess = pose_from_angles([position[0] + 0.01, position[1], 0.3], [0.0, 0.0, angle - 0.02])
    fit = fk.pose(fk.lengths(X), guess, np.array([0, 1, 2]))
    np.testing.assert_allclose(fit.residuals, 0.0, atol=1e-6)
    assert fit.X_WP.translation()[2] == 0.3
    np.testing.assert_array_equal(fit.X_WP.rotation().matrix()[2], [0.0, 0.0, 1.0])
    assert pose_error(fit.X_WP, X) < (1e-6, 1e-6)
    assert fit.J.shape == (3, 3)


# The parts of a fit.


@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_residuals_and_jacobian_are_those_of_the_cables_used(name):
    planar, cables = name == "planar", load_robot(name).cable_set()
    fk, lengths, _, guesses = starts(name, cables, 10, 0.02, 0.1)
    used = np.arange(3 if planar else 7)
    for row, guess in zip(lengths, guesses, strict=True):
        fit = fk.pose(row, pose_from_row(guess), used)
        paths = cable_paths(fit.X_WP, cables)
        J = paths.J[used][:, list(PLANAR_ROWS)] if planar else paths.J[used]
        np.testing.assert_allclose(fit.residuals, (paths.lengths - row)[used], atol=ROUNDING)
        np.testing.assert_allclose(fit.J, J, atol=ROUNDING)


def test_a_fit_is_not_changed_by_the_next():
    fk, lengths, _, guesses = starts("acrobot_large", FK.cables, 2, 0.02, 0.1)
    first = fk.pose(lengths[0], pose_from_row(guesses[0]))
    before = [first.X_WP.GetAsMatrix4(), first.residuals.copy(), first.J.copy()]
    fk.pose(lengths[1], pose_from_row(guesses[1]))
    for now, then in zip([first.X_WP.GetAsMatrix4(), *first[1::2]], before, strict=True):
        np.testing.assert_array_equal(now, then)

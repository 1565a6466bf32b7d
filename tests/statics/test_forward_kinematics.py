from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from scipy.optimize import least_squares

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
from cdpr_drake.statics.forward_kinematics import ForwardKinematics, tautest_cables
from cdpr_drake.statics.pose_fit_kernel import FITS, WORK_SHAPE, fit_pose
from cdpr_drake.tensions.methods import exact_tensions

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


def cables_of(name, pulleys):
    cables = load_robot(name).cable_set()
    return cables if pulleys else cables.without_pulleys()


def random_pose(name, random):
    position = random.uniform(*WORKSPACE[name])
    angles = random.uniform(-0.25, 0.25, 3)
    if name == "planar":
        angles[:2] = 0.0
    return pose_from_angles(position, angles)


def disturbed(X_WP, random, distance, angle, planar=False):
    """A pose within a distance [m] and an angle [rad] of another."""
    p, w = random.normal(size=3), random.normal(size=3)
    if planar:
        p[2] = w[0] = w[1] = 0.0
    p *= distance * np.cbrt(random.uniform()) / np.linalg.norm(p)
    w *= angle * np.cbrt(random.uniform()) / np.linalg.norm(w)
    return RigidTransform(rotation_from_vector(w) @ X_WP.rotation(), X_WP.translation() + p)


def starts(name, cables, count, distance, angle, seed=0):
    random = np.random.default_rng(seed)
    true = [random_pose(name, random) for _ in range(count)]
    guesses = [disturbed(X, random, distance, angle, name == "planar") for X in true]
    fk = ForwardKinematics(cables, LEVEL if name == "planar" else FREE)
    lengths = np.array([fk.lengths(X) for X in true])
    return (
        fk,
        lengths,
        np.array([pose_row(X) for X in true]),
        np.array([pose_row(X) for X in guesses]),
    )


def distances(poses, others):
    """Distance [m] and angle [rad] between poses in arrays."""
    sign = np.sign(np.sum(poses[:, :4] * others[:, :4], axis=1))
    chord = np.linalg.norm(sign[:, np.newaxis] * poses[:, :4] - others[:, :4], axis=1)
    return np.linalg.norm(poses[:, 4:] - others[:, 4:], axis=1), 4.0 * np.arcsin(chord / 2.0)


@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("name", sorted(WORKSPACE))
def test_no_start_within_5_cm_and_10_deg_fails(name, pulleys):
    fk, lengths, true, guesses = starts(
        name, cables_of(name, pulleys), 10_000, 0.05, np.radians(10.0)
    )
    found = fk.poses(lengths, guesses)
    assert np.all(found.codes == 1)
    apart, angle = distances(found.poses, true)
    assert np.max(apart) < EXACT
    assert np.max(angle) < EXACT


def test_one_pose_is_as_in_a_batch():
    cables = cables_of("acrobot_large", True)
    fk, lengths, true, guesses = starts("acrobot_large", cables, 20, 0.05, 0.17)
    many = fk.poses(lengths, guesses, threads=1)
    for k in range(20):
        fit = fk.pose(lengths[k], pose_from_row(guesses[k]))
        assert pose_error(fit.X_WP, pose_from_row(true[k])) < (EXACT, EXACT)
        assert fit.steps == many.steps[k]
        np.testing.assert_allclose(fit.residuals, 0.0, atol=1e-14)
        np.testing.assert_allclose(fit.J, cable_paths(fit.X_WP, cables).J, atol=1e-12)


def test_from_anywhere_never_a_wrong_pose():
    fk, lengths, true, guesses = starts(
        "acrobot_large", cables_of("acrobot_large", True), 2000, 0.6, np.pi
    )
    found = fk.poses(lengths, guesses)
    right = found.codes == 1
    apart, angle = distances(found.poses[right], true[right])
    assert np.max(apart) < 1e-6
    assert np.max(angle) < 1e-6
    assert np.all(np.isnan(found.poses[~right]))
    assert 0.3 < np.mean(right) < 1.0  # such starts do end at wrong minima


def residuals_of(x, fk, start, lengths):
    X = RigidTransform(rotation_from_vector(x[:3]) @ start.rotation(), start.translation() + x[3:])
    return fk.lengths(X) - lengths


def test_measured_lengths_give_the_least_squares_pose():
    robot = load_robot("acrobot_large")
    fk = ForwardKinematics(robot.cable_set())
    X = pose_from_angles([0.1, -0.2, 0.4], [0.1, 0.2, -0.1])
    lengths = fk.lengths(X) + 1e-3 * np.random.default_rng(2).normal(size=8)
    fit = fk.pose(lengths, robot.home.transform(), tolerance=0.01)
    other = least_squares(
        residuals_of, np.zeros(6), args=(fk, X, lengths), xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    np.testing.assert_allclose(fit.residuals, other.fun, atol=1e-9)
    np.testing.assert_allclose(fit.J.T @ fit.residuals, 0.0, atol=1e-12)


def test_lengths_that_no_pose_has_say_by_how_much():
    robot = load_robot("acrobot_large")
    fk = ForwardKinematics(robot.cable_set())
    lengths = fk.lengths(robot.home.transform())
    lengths[2] += 0.02
    other = least_squares(residuals_of, np.zeros(6), args=(fk, robot.home.transform(), lengths))
    worst = np.argmax(np.abs(other.fun))
    words = f"misses cable {worst + 1} by {1e3 * abs(other.fun[worst]):.4g} mm"
    with pytest.raises(ForwardKinematicsError, match=words):
        fk.pose(lengths, robot.home.transform())
    assert fk.poses(lengths[None], pose_row(robot.home.transform())[None]).codes[0] == 0
    fk.pose(lengths, robot.home.transform(), tolerance=0.02)


def test_covariance_is_that_of_many_measurements():
    sigma, count = 1e-4, 10_000
    robot = load_robot("acrobot_large")
    fk = ForwardKinematics(robot.cable_set())
    X = pose_from_angles([0.1, -0.2, 0.4], [0.1, 0.2, -0.1])
    lengths = fk.lengths(X) + sigma * np.random.default_rng(0).normal(size=(count, 8))
    poses = fk.poses(lengths, np.tile(pose_row(X), (count, 1)), tolerance=0.01).poses
    turns = np.array(
        [
            2.0 * (pose_from_row(pose).rotation() @ X.rotation().inverse()).ToQuaternion().xyz()
            for pose in poses
        ]
    )
    found = np.cov(np.column_stack([turns, poses[:, 4:] - X.translation()]).T)
    expected = fk.pose(fk.lengths(X), X).covariance(sigma)
    deviations = np.sqrt(np.diag(expected))
    # Sample covariances of 10,000 differ from the true one by about 1 per cent.
    np.testing.assert_allclose(
        found / np.outer(deviations, deviations),
        expected / np.outer(deviations, deviations),
        atol=0.05,
    )


def test_six_tautest_elastic_cables():
    robot = load_robot("caroca")
    cables = robot.cable_set()
    X = pose_from_angles([0.3, -0.5, 1.2], [0.02, 0.05, -0.1])
    tensions = exact_tensions(tension_problem(robot, X))
    fk = ForwardKinematics(cables)
    l0 = unstrained_lengths(fk.lengths(X), tensions, cables.stiffness)
    guess = disturbed(X, np.random.default_rng(0), 0.005, 0.01)
    tautest = tautest_cables(tensions, 6)
    elastic = fk.pose(stretched_lengths(l0, tensions, cables.stiffness), guess, tautest)
    assert pose_error(elastic.X_WP, X) < (EXACT, EXACT)
    assert len(elastic.residuals) == 6
    stiff = fk.pose(l0, guess, tautest)
    distance, _ = pose_error(stiff.X_WP, X)
    assert 1e-4 < distance < 1e-2  # a stretch of a millimetre


def test_slack_cables_are_left_alone():
    robot = load_robot("acrobot_large")
    fk = ForwardKinematics(robot.cable_set())
    X = robot.home.transform()
    lengths, tensions = fk.lengths(X), np.arange(8.0)
    lengths[:2] += 0.1
    guess = disturbed(X, np.random.default_rng(1), 0.003, 0.01)
    fit = fk.pose(lengths, guess, tautest_cables(tensions, 6))
    assert pose_error(fit.X_WP, X) < (EXACT, EXACT)


def test_six_lengths_give_a_near_pose_that_has_them():
    """Several assemblies fit six lengths; which is true, the lengths cannot say."""
    cables = cables_of("acrobot_large", True)
    fk, lengths, true, guesses = starts("acrobot_large", cables, 5000, 0.05, np.radians(10.0))
    random = np.random.default_rng(4)
    used = np.array([np.sort(random.permutation(8)[:6]) for _ in range(5000)])
    found = fk.poses(lengths, guesses, used)
    fits = found.codes == 1
    assert np.mean(fits) > 0.999
    for k in np.flatnonzero(fits)[:200]:
        at = fk.lengths(pose_from_row(found.poses[k]))
        np.testing.assert_allclose(at[used[k]], lengths[k, used[k]], atol=1e-6)
    arm = 0.125  # turns weigh as much as they move the anchor points [m]
    to_found = np.hypot(*(np.array([[1.0], [arm]]) * distances(found.poses[fits], guesses[fits])))
    to_true = np.hypot(*(np.array([[1.0], [arm]]) * distances(true[fits], guesses[fits])))
    assert np.mean(to_found < to_true + 1e-9) > 0.98
    near = distances(found.poses[fits], true[fits])[0] < 1e-6
    assert 0.9 < np.mean(near) < 1.0


@given(
    st.lists(st.floats(-0.3, 0.3), min_size=2, max_size=2),
    st.floats(-0.4, 0.4),
    st.booleans(),
)
def test_planar_robot_from_three_cables(position, angle, pulleys):
    cables = cables_of("planar", pulleys)
    fk = ForwardKinematics(cables, LEVEL)
    X = pose_from_angles([*position, 0.3], [0.0, 0.0, angle])
    guess = pose_from_angles([position[0] + 0.01, position[1], 0.3], [0.0, 0.0, angle - 0.02])
    fit = fk.pose(fk.lengths(X), guess, np.array([0, 1, 2]))
    np.testing.assert_allclose(fit.residuals, 0.0, atol=1e-6)
    assert fit.X_WP.translation()[2] == 0.3
    np.testing.assert_array_equal(fit.X_WP.rotation().matrix()[2], [0.0, 0.0, 1.0])
    assert pose_error(fit.X_WP, X) < (1e-6, 1e-6)
    assert fit.J.shape == (3, 3)


def test_lengths_that_leave_a_motion_free():
    cables = cables_of("acrobot_large", False)
    ball = replace(cables, p_PB=np.zeros((3, 8)))
    fk = ForwardKinematics(ball)
    X = pose_from_angles([0.1, 0.0, 0.3], [0.0, 0.0, 0.0])
    guess = pose_from_angles([0.11, 0.0, 0.3], [0.1, 0.0, 0.0])
    with pytest.raises(ForwardKinematicsError, match=r"did not settle|do not determine"):
        fk.pose(fk.lengths(X), guess)


def test_condition_does_not_depend_on_units():
    robot = load_robot("acrobot_large")
    X = robot.home.transform()
    fk = ForwardKinematics(robot.cable_set())
    fit = fk.pose(fk.lengths(X), X)
    big = replace(
        robot.cable_set(),
        **{k: 1e3 * getattr(robot.cable_set(), k) for k in ("p_WA", "p_PB", "pulley_radius")},
    )
    X_big = RigidTransform(X.rotation(), 1e3 * X.translation())
    fk_big = ForwardKinematics(big)
    fit_big = fk_big.pose(fk_big.lengths(X_big), X_big)
    assert fit_big.condition(125.0) == pytest.approx(fit.condition(0.125), rel=1e-9)


@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_one_call_is_what_its_parts_are(name):
    robot, planar = load_robot(name), name == "planar"
    cables = robot.cable_set()
    fk, _, poses, guesses = starts(name, cables, 10, 0.02, 0.1)
    used = np.arange(3 if planar else 7)
    free = (LEVEL if planar else FREE).packed()
    for row, guess in zip(poses, guesses, strict=True):
        lengths = fk.lengths(pose_from_row(row))
        fit = fk.pose(lengths, pose_from_row(guess), used)
        state = np.empty(13)
        code, steps = fit_pose(
            guess, cables.packed(), used, lengths, free, 1e-6, state, np.empty(WORK_SHAPE)
        )
        X_WP = RigidTransform(Quaternion(state[:4]), state[4:7])
        paths = cable_paths(X_WP, cables)
        J = paths.J[used][:, list(PLANAR_ROWS)] if planar else paths.J[used]
        assert (code, steps) == (FITS, fit.steps)
        np.testing.assert_allclose(fit.X_WP.GetAsMatrix4(), X_WP.GetAsMatrix4(), atol=ROUNDING)
        np.testing.assert_allclose(fit.residuals, (paths.lengths - lengths)[used], atol=ROUNDING)
        np.testing.assert_allclose(fit.J, J, atol=ROUNDING)


def test_a_fit_is_not_changed_by_the_next():
    robot = load_robot("acrobot_large")
    fk, lengths, _, guesses = starts("acrobot_large", robot.cable_set(), 2, 0.02, 0.1)
    first = fk.pose(lengths[0], pose_from_row(guesses[0]))
    before = [first.X_WP.GetAsMatrix4(), first.residuals.copy(), first.J.copy()]
    fk.pose(lengths[1], pose_from_row(guesses[1]))
    for now, then in zip([first.X_WP.GetAsMatrix4(), *first[1::2]], before, strict=True):
        np.testing.assert_array_equal(now, then)


def test_refuses_what_makes_no_sense():
    robot = load_robot("acrobot_large")
    X = robot.home.transform()
    fk = ForwardKinematics(robot.cable_set())
    lengths = fk.lengths(X)
    for bad, words in (
        (lengths[:5], "found shape"),
        (np.full(8, np.nan), "NaN"),
        (-lengths, "> 0"),
        (np.append(lengths[:7], 0.0), "> 0"),
        (np.append(lengths[:7], np.inf), "> 0"),
    ):
        with pytest.raises(ForwardKinematicsError, match=words):
            fk.pose(bad, X)
    with pytest.raises(ForwardKinematicsError, match="at least 6"):
        fk.pose(lengths, X, np.arange(5))
    with pytest.raises(ForwardKinematicsError, match="accepted: indices 0 to 7"):
        fk.pose(lengths, X, np.arange(3, 9))
    with pytest.raises(ForwardKinematicsError, match="found index -1"):
        fk.pose(lengths, X, np.arange(-1, 6))
    with pytest.raises(ForwardKinematicsError, match="found 2 axes"):
        fk.pose(lengths, X, np.zeros((6, 2)))
    with pytest.raises(ForwardKinematicsError, match="guesses"):
        fk.poses(lengths[None], np.zeros((1, 6)))
    with pytest.raises(ForwardKinematicsError, match="used"):
        fk.poses(lengths[None], pose_row(X)[None], np.arange(8))


def test_tautest_cables():
    np.testing.assert_array_equal(tautest_cables([3.0, 1.0, 2.0, 0.0, 2.0], 3), [0, 2, 4])
    np.testing.assert_array_equal(tautest_cables(np.ones(8), 6), np.arange(6))

"""Stiffness and sensitivity against differences, modes against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.cables.elastic_law import cable_stiffness_matrix
from cdpr_drake.cables.states import cable_derivatives, cable_state
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.motion_type import FREE, LEVEL, MotionType
from cdpr_drake.geometry.poses import pose_from_angles, rotation_vector
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near, principal_stiffnesses
from cdpr_drake.statics.inextensible_equilibrium import tension_stiffness
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.statics.sensitivity import pose_sensitivity
from cdpr_drake.statics.stiffness import inextensible_modes, natural_modes, platform_stiffness
from tests.statics.statics_cases import cables_at, displaced, scene, stiffness_by_differences

DIFFERENCE = 1e-5
"""Central differences relative to the largest stiffness: rounding of E S over 1e-7."""

SUMMING = 1e-13
"""Sums of a few products in another order, relative to the largest element."""

AGREE, SETTLED = 2e-4, 1e-12
"""Differences of poses of rest, relative to the largest entry: steps small enough to keep cables
taut leave four digits. How exact a pose of rest is [m, rad]: forces of 1e-10 of the weight over
1e5 N/m."""

PLATFORM = RigidPlatform(3.0, np.array([0.1, -0.2, 0.3]), np.eye(3), 9.0)
X_WP = pose_from_angles([0.4, 0.5, 0.6], [0.3, -0.2, 0.5])


# The parts.


def test_weight_stiffness_against_differences():
    K = stiffness_by_differences(PLATFORM.weight_wrench, X_WP, 1e-6)
    np.testing.assert_allclose(PLATFORM.weight_stiffness(X_WP), K, atol=1e-8)
    np.testing.assert_allclose(PLATFORM.packed_weight(), [0.0, 0.0, 27.0, 0.1, -0.2, 0.3])


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_mass_matrix_is_drakes(name):
    robot, R = load_robot(name), np.kron(np.eye(2), X_WP.rotation().matrix())
    expected = R @ platform_inertia(robot).CopyToFullMatrix6() @ R.T
    platform = rigid_platform(robot)
    np.testing.assert_allclose(platform.mass_matrix(X_WP), expected, atol=1e-12)
    assert platform.motion == (LEVEL if name == "planar" else FREE)


@pytest.mark.parametrize("pulleys", [False, True])
def test_tension_stiffness_against_differences(pulleys):
    cables = load_robot("caroca").cable_set()
    cables = cables if pulleys else cables.without_pulleys()
    X = pose_from_angles([0.3, -0.5, 1.2], [0.1, 0.2, -0.1])
    tensions = np.linspace(0.0, 700.0, 8)
    K = stiffness_by_differences(lambda X: -cable_paths(X, cables).J.T @ tensions, X, 1e-6)
    stiffness = tension_stiffness(X, cables, tensions)
    np.testing.assert_allclose(stiffness, K, atol=1e-7 * np.max(np.abs(K)))


@pytest.mark.parametrize("model", ["elastic", "catenary"])
@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("name", ["acrobot_large", "caroca"])
def test_stiffness_against_differences_of_the_wrench(name, pulleys, model):
    case = scene(name, pulleys)
    rest = case.rest(model)

    def wrench(X):
        return cable_state(case.cables, model, X, case.lengths).wrench + (
            case.platform.weight_wrench(X)
        )

    K = stiffness_by_differences(wrench, rest.X_WP, 1e-7)
    found = platform_stiffness(case.cables, model, case.platform, rest.X_WP, case.lengths)
    scale = np.max(np.abs(K))
    np.testing.assert_allclose(found.total, K, atol=DIFFERENCE * scale)
    np.testing.assert_allclose(found.total, found.total.T, atol=1e-9 * scale)  # at rest
    if model == "elastic":
        parts = found.elastic + found.tension + found.weight
        np.testing.assert_allclose(found.total, parts, atol=1e-9 * scale)
        # The part of the tensions is small against the elastic one, and not nothing.
        if name == "acrobot_large":
            share = np.max(np.abs(found.tension)) / np.max(np.abs(found.elastic))
            assert 1e-6 < share < 1e-3
    else:
        assert found.elastic is None


@pytest.mark.parametrize("model", ["elastic", "catenary"])
@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_the_parts_are_those_of_separate_formulas(name, pulleys, model):
    """Off rest, with some cables slack, by matrices as one writes them down."""
    case = scene(name, pulleys)
    cables, platform = case.cables, case.platform
    X = displaced(case.rest(model).X_WP, np.array([0.01, -0.02, 0.03, 0.002, 0.003, -0.004]))
    l0 = case.lengths * np.where(np.arange(cables.count) % 3 == 1, 1.05, 1.0)
    found = platform_stiffness(cables, model, platform, X, l0)
    of_cables = -cable_derivatives(cables, model, X, l0).wrench_by_pose
    close = {"rtol": 0.0, "atol": SUMMING * np.max(np.abs(of_cables))}
    np.testing.assert_allclose(found.cables, of_cables, **close)
    np.testing.assert_allclose(found.weight, platform.weight_stiffness(X), **close)
    np.testing.assert_allclose(found.total, of_cables + platform.weight_stiffness(X), **close)
    if model == "catenary":
        assert found.elastic is None
        assert found.tension is None
        return
    tensions, J = cable_state(cables, model, X, l0).tensions, cable_paths(X, cables).J
    assert 0 < np.sum(tensions > 0.0) < cables.count
    taut = np.where(tensions > 0.0, cables.stiffness, 0.0)
    np.testing.assert_allclose(found.elastic, cable_stiffness_matrix(J, taut, l0), **close)
    turning = tension_stiffness(X, cables, tensions)
    tolerance = SUMMING * np.max(np.abs(turning))
    np.testing.assert_allclose(found.tension, turning, rtol=0.0, atol=tolerance)


def test_principal_stiffnesses_count_turns_by_their_arm():
    """Of a stiffness without coupling: moments per turn over the arm's square, and forces."""
    turns, moves, arm = np.array([1.0, 2.0, 3.0]), np.array([100.0, 500.0, 700.0]), 0.1
    platform = RigidPlatform(1.0, np.zeros(3), np.eye(3))
    found = principal_stiffnesses(np.diag([*turns, *moves]), platform, arm)
    np.testing.assert_allclose(found, np.sort([*turns / arm**2, *moves]), rtol=1e-12)
    planar = replace(platform, motion=MotionType("2T1R"))
    found = principal_stiffnesses(np.diag([2.0, 100.0, 500.0]), planar, arm)
    np.testing.assert_allclose(found, [100.0, 200.0, 500.0], rtol=1e-12)


# Modes.


def swing(length):
    """Frequency of a pendulum [Hz]."""
    return np.sqrt(9.81 / length) / (2.0 * np.pi)


def test_a_pendulum_swings_at_its_frequency():
    """Simple pendulum: one cable on the centre of mass, plus the stretching mode."""
    cables, l0 = cables_at([[0.0, 0.0, 2.0]], [[0.0, 0.0, 0.0]]), np.array([1.0])
    platform = RigidPlatform(2.0, np.zeros(3), 0.1 * np.eye(3))
    rest = equilibrium_near(cables, "elastic", platform, l0, RigidTransform([0.0, 0.0, 1.0]))
    K = platform_stiffness(cables, "elastic", platform, rest.X_WP, l0)
    modes = natural_modes(K.total, platform, rest.X_WP)
    slow, stretch = swing(1.0 + 2.0 * 9.81 / 1e5), np.sqrt(1e5 / 2.0) / (2.0 * np.pi)
    np.testing.assert_allclose(modes.frequencies, [0.0, 0.0, 0.0, slow, slow, stretch], rtol=1e-9)


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_modes_are_uncoupled_and_of_mass_one(name):
    case = scene(name)
    platform, X = case.platform, case.rest().X_WP
    K = platform_stiffness(case.cables, "elastic", platform, X, case.lengths).total
    modes, M = natural_modes(K, platform, X), platform.mass_matrix(X)
    shapes, squares = modes.shapes, (2.0 * np.pi * modes.frequencies) ** 2
    np.testing.assert_allclose(shapes.T @ M @ shapes, np.eye(platform.motion.freedom), atol=1e-9)
    stored = shapes.T @ K @ shapes
    np.testing.assert_allclose(stored, np.diag(squares), atol=1e-9 * np.max(squares))


def test_an_unstable_pose_has_no_frequency_there():
    K = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -1.0])
    frequencies = natural_modes(K, rigid_platform(load_robot("acrobot_large")), X_WP).frequencies
    assert np.isnan(frequencies[0])
    assert np.all(np.isfinite(frequencies[1:]))


def test_a_body_on_a_rigid_cable_at_its_origin_turns_freely():
    """No cable has an arm there: a pendulum swings in two directions, and nothing holds a turn."""
    length, mass = 1.5, 3.0
    platform = RigidPlatform(mass, np.zeros(3), np.diag([0.02, 0.03, 0.04]))
    cables, X = cables_at([[0.0, 0.0, 2.0]], [[0.0] * 3]), RigidTransform([0.0, 0.0, 2.0 - length])
    modes = inextensible_modes(cables, platform, X, np.array([mass * 9.81]))
    expected = [0.0, 0.0, 0.0, swing(length), swing(length)]
    np.testing.assert_allclose(modes.frequencies, expected, rtol=1e-9)


def test_a_rigid_cable_across_the_line_of_a_point_holds_no_length():
    """A bead on a level line below its exit point is a pendulum, its cable keeps its length."""
    length, mass, along_x = 1.5, 3.0, MotionType("1T", (1.0, 0.0, 0.0))
    platform = RigidPlatform(mass, np.zeros(3), np.zeros((3, 3)), motion=along_x)
    cables = cables_at([[0.0, 0.0, length]], [[0.0] * 3])
    modes = inextensible_modes(cables, platform, RigidTransform(), np.array([mass * 9.81]))
    np.testing.assert_allclose(modes.frequencies, [swing(length)], rtol=1e-9)


def test_a_rigid_cable_that_repeats_another_one_holds_nothing_more():
    """The second is the first up to rounding: the modes are those of one cable."""
    platform = RigidPlatform(3.0, np.zeros(3), np.diag([0.02, 0.03, 0.04]))
    X, A, B = RigidTransform([0.0, 0.0, 0.5]), np.array([[0.1, 0.0, 2.0]]), [[0.1, 0.0, 0.3]]
    weight, two = 3.0 * 9.81, cables_at(np.vstack([A, A + 1e-13]), B * 2)
    expected = inextensible_modes(cables_at(A, B), platform, X, np.array([weight])).frequencies
    found = inextensible_modes(two, platform, X, np.full(2, 0.5 * weight)).frequencies
    assert len(found) == 5
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


# Sensitivity of the pose of rest to what a robot is made of.


def displacement(X, reference):
    turn = rotation_vector(X.rotation() @ reference.rotation().inverse())
    return np.concatenate([turn, X.translation() - reference.translation()])


def unit(shape, index):
    one = np.zeros(shape)
    one[index] = 1.0
    return one


@pytest.mark.parametrize(
    ("name", "model"), [("caroca", "elastic"), ("caroca", "catenary"), ("planar", "elastic")]
)
def test_sensitivity_against_poses_of_rest_found_anew(name, model):
    case = scene(name, pulleys=True)
    cables, platform, l0, X = case.cables, case.platform, case.lengths, case.rest(model).X_WP
    sensitivity, m = pose_sensitivity(cables, model, platform, X, l0), cables.count

    def pose(s, field, direction):
        parts = {"cables": cables, "platform": platform, "lengths": l0}
        if field == "lengths":
            parts["lengths"] = l0 + s * direction
        else:
            part = "cables" if hasattr(cables, field) else "platform"
            value = getattr(parts[part], field) + s * direction
            parts[part] = replace(parts[part], **{field: value})
        rest = equilibrium_near(parts["cables"], model, parts["platform"], parts["lengths"], X)
        return displacement(rest.X_WP, X)

    def check(derivative, field, direction, step):
        expected = (pose(step, field, direction) - pose(-step, field, direction)) / (2.0 * step)
        tolerance = AGREE * np.max(np.abs(expected)) + SETTLED / step
        np.testing.assert_allclose(derivative, expected, atol=tolerance, err_msg=field)

    for i in (0, m - 1):
        for axis in range(3):
            point = unit((3, m), (axis, i))
            check(sensitivity.exit_points[:, axis, i], "p_WA", point, 1e-7)
            check(sensitivity.anchor_points[:, axis, i], "p_PB", point, 1e-7)
        cable = unit(m, i)
        check(sensitivity.lengths[:, i], "lengths", cable, 1e-7)
        check(sensitivity.pulley_radius[:, i], "pulley_radius", cable, 1e-7)
        check(sensitivity.stiffness[:, i], "stiffness", cable, 1e-4 * cables.stiffness[i])
        if model == "catenary":
            check(sensitivity.linear_weight[:, i], "linear_weight", cable, 1e-3)
    if platform.motion.is_free:
        check(sensitivity.mass, "mass", 1.0, 1e-3)
        for axis in range(3):
            check(sensitivity.center_of_mass[:, axis], "p_PCo", unit(3, axis), 1e-5)


def test_straight_cables_have_no_weight_and_exit_points_carry_the_platform_with_them():
    case = scene("caroca")
    X = case.rest().X_WP
    found = pose_sensitivity(case.cables, "elastic", case.platform, X, case.lengths)
    np.testing.assert_array_equal(found.linear_weight, 0.0)
    together = np.sum(found.exit_points, axis=2)
    np.testing.assert_allclose(together, np.vstack([np.zeros((3, 3)), np.eye(3)]), atol=1e-9)


def test_a_pulley_that_is_not_there_yet():
    case = scene("acrobot_large")
    X = case.rest().X_WP
    found = pose_sensitivity(case.cables, "elastic", case.platform, X, case.lengths)
    tiny = replace(case.cables, pulley_radius=np.full(8, 2e-8))
    rest = equilibrium_near(tiny, "elastic", case.platform, case.lengths, X)
    expected = displacement(rest.X_WP, X) / 2e-8
    slope, tolerance = np.sum(found.pulley_radius, axis=1), 1e-2 * np.max(np.abs(expected))
    np.testing.assert_allclose(slope, expected, atol=tolerance)

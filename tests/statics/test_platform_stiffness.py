"""Stiffness against differences of the wrench, modes against the time response."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.cables.elastic_law import cable_stiffness_matrix, unstrained_lengths
from cdpr_drake.cables.models import cable_derivatives, cable_state
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import MotionType
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near, principal_stiffnesses
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.inextensible_equilibrium import tension_stiffness
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.statics.stiffness import inextensible_modes, natural_modes, platform_stiffness
from cdpr_drake.systems.robots.cable_robot import CableRobot, holding_tensions

STEP = 1e-7
DIFFERENCE = 1e-5
"""Central differences relative to the largest stiffness: rounding of E S over STEP."""

SUMMING = 1e-13
"""Sums of a few products in another order, relative to the largest element."""

TIME_RESPONSE = 0.005
"""Frequencies counted in a second of simulated vibration of a few periods."""


def at_rest(name, model="elastic", pulleys=False):
    robot = load_robot(name)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    home = robot.home.transform()
    lift = 0.0 if robot.is_planar() else 0.1
    X = pose_from_angles(home.translation() + np.array([0.05, -0.03, lift]), [0.0, 0.0, 0.03])
    fk = ForwardKinematics(cables, robot.motion_type())
    tensions = holding_tensions(robot, X) + (5.0 if robot.is_planar() else 0.0)
    l0 = unstrained_lengths(fk.lengths(X), tensions, cables.stiffness)
    platform = rigid_platform(robot)
    return robot, cables, platform, l0, equilibrium_near(cables, model, platform, l0, X)


def displaced(X, d):
    return RigidTransform(rotation_from_vector(d[:3]) @ X.rotation(), X.translation() + d[3:])


@pytest.mark.parametrize("model", ["elastic", "catenary"])
@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("name", ["acrobot_large", "caroca"])
def test_against_differences_of_the_wrench(name, pulleys, model):
    _, cables, platform, l0, rest = at_rest(name, model, pulleys)
    found = platform_stiffness(cables, model, platform, rest.X_WP, l0)
    K = np.empty((6, 6))
    for k, d in enumerate(STEP * np.eye(6)):
        ahead, behind = (
            cable_state(cables, model, X, l0).wrench + platform.weight_wrench(X)
            for X in (displaced(rest.X_WP, d), displaced(rest.X_WP, -d))
        )
        K[:, k] = (behind - ahead) / (2.0 * STEP)
    scale = np.max(np.abs(K))
    np.testing.assert_allclose(found.total, K, atol=DIFFERENCE * scale)
    np.testing.assert_allclose(found.total, found.total.T, atol=1e-9 * scale)  # at rest
    if model == "elastic":
        parts = found.elastic + found.tension + found.weight
        np.testing.assert_allclose(found.total, parts, atol=1e-9 * scale)
    else:
        assert found.elastic is None


@pytest.mark.parametrize("model", ["elastic", "catenary"])
@pytest.mark.parametrize("pulleys", [False, True])
@pytest.mark.parametrize("name", ["acrobot_large", "caroca", "planar"])
def test_the_parts_are_those_of_separate_formulas(name, pulleys, model):
    """Off rest, with some cables slack, by matrices as one writes them down."""
    _, cables, platform, l0, rest = at_rest(name, model, pulleys)
    X = displaced(rest.X_WP, np.array([0.01, -0.02, 0.03, 0.002, 0.003, -0.004]))
    l0 = l0 * np.where(np.arange(cables.count) % 3 == 1, 1.05, 1.0)
    found = platform_stiffness(cables, model, platform, X, l0)
    of_cables = -cable_derivatives(cables, model, X, l0).wrench_by_pose
    scale = np.max(np.abs(of_cables))
    close = {"rtol": 0.0, "atol": SUMMING * scale}
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
    np.testing.assert_allclose(
        found.tension, turning, rtol=0.0, atol=SUMMING * np.max(np.abs(turning))
    )


def test_lengths_and_poses_that_make_no_sense_are_refused():
    _, cables, platform, l0, rest = at_rest("acrobot_large")
    for bad in (l0[:5], -l0, np.full(8, np.nan), np.append(l0[:7], np.inf)):
        with pytest.raises(CableModelError, match="unstrained lengths: found"):
            platform_stiffness(cables, "elastic", platform, rest.X_WP, bad)
    there = RigidTransform(cables.p_WA[:, 2] - cables.p_PB[:, 2])
    with pytest.raises(CableGeometryError, match="cable 3: its anchor point"):
        platform_stiffness(cables, "elastic", platform, there, l0)


def test_tensions_stiffen():
    """The part of the tensions is small against the elastic one, and not nothing."""
    _, cables, platform, l0, rest = at_rest("acrobot_large")
    K = platform_stiffness(cables, "elastic", platform, rest.X_WP, l0)
    share = np.max(np.abs(K.tension)) / np.max(np.abs(K.elastic))
    assert 1e-6 < share < 1e-3


def test_a_pendulum_swings_at_its_frequency():
    """Simple pendulum: one cable on the centre of mass, plus the stretching mode."""
    from cdpr_drake.geometry.cable_set import CableSet
    from cdpr_drake.statics.rigid_platform import RigidPlatform

    cables = CableSet.make(np.array([[0.0], [0.0], [2.0]]), np.zeros((3, 1)), 1e5)
    platform = RigidPlatform(2.0, np.zeros(3), 0.1 * np.eye(3))
    rest = equilibrium_near(
        cables, "elastic", platform, np.array([1.0]), RigidTransform([0.0, 0.0, 1.0])
    )
    K = platform_stiffness(cables, "elastic", platform, rest.X_WP, np.array([1.0]))
    modes = natural_modes(K.total, platform, rest.X_WP)
    length = 1.0 + 2.0 * 9.81 / 1e5
    swing = np.sqrt(9.81 / length) / (2.0 * np.pi)
    stretch = np.sqrt(1e5 / 2.0) / (2.0 * np.pi)
    np.testing.assert_allclose(modes.frequencies, [0.0, 0.0, 0.0, swing, swing, stretch], rtol=1e-9)


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_modes_against_the_time_response(name):
    robot, cables, platform, l0, rest = at_rest(name)
    K = platform_stiffness(cables, "elastic", platform, rest.X_WP, l0)
    modes = natural_modes(K.total, platform, rest.X_WP)
    n = platform.motion.freedom
    M = platform.mass_matrix(rest.X_WP)
    np.testing.assert_allclose(modes.shapes.T @ M @ modes.shapes, np.eye(n), atol=1e-9)
    diagram = CableRobot(robot)
    for k in (0, n - 1):
        context = diagram.CreateDefaultContext()
        diagram.set_at_equilibrium(context, robot.home.transform())
        diagram.winches.set_unstrained_lengths(
            diagram.GetMutableSubsystemContext(diagram.winches, context), l0
        )
        plant = diagram.GetMutableSubsystemContext(diagram.plant, context)
        diagram.in_plant.set_pose(plant, displaced(rest.X_WP, 1e-7 * modes.shapes[:, k]))
        diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(l0)))
        simulator = Simulator(diagram, context)
        simulator.Initialize()
        simulator.get_mutable_integrator().set_maximum_step_size(2e-5)
        amplitudes, times = [], np.arange(1, 1500) / 1499 * 6.0 / modes.frequencies[k]
        for t in times:
            simulator.AdvanceTo(t)
            now = diagram.in_plant.pose(plant).translation() - rest.X_WP.translation()
            turn = (
                diagram.in_plant.pose(plant).rotation() @ rest.X_WP.rotation().inverse()
            ).matrix()
            w = 0.5 * np.array(
                [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
            )
            amplitudes.append(modes.shapes[:, k] @ M @ np.concatenate([w, now]))
        a = np.array(amplitudes)
        crossing = np.flatnonzero((a[:-1] < 0.0) & (a[1:] >= 0.0))
        moments = times[crossing] - a[crossing] * (times[1] - times[0]) / (
            a[crossing + 1] - a[crossing]
        )
        measured = (len(moments) - 1) / (moments[-1] - moments[0])
        assert measured == pytest.approx(modes.frequencies[k], rel=TIME_RESPONSE)


def test_inextensible_cables_are_rigid():
    _, cables, platform, l0, rest = at_rest("acrobot_large")
    with pytest.raises(CableModelError, match="inextensible"):
        platform_stiffness(cables, "inextensible", platform, rest.X_WP, l0)


def test_an_unstable_pose_has_no_frequency_there():
    _, _, platform, _, rest = at_rest("acrobot_large")
    K = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -1.0])
    frequencies = natural_modes(K, platform, rest.X_WP).frequencies
    assert np.isnan(frequencies[0])
    assert np.all(np.isfinite(frequencies[1:]))


def test_a_body_on_a_cable_at_its_origin_turns_freely():
    """No cable has an arm there: a pendulum swings in two directions, and nothing holds a turn."""
    length, mass = 1.5, 3.0
    platform = RigidPlatform(mass, np.zeros(3), np.diag([0.02, 0.03, 0.04]))
    cables = CableSet.make(np.array([[0.0], [0.0], [2.0]]), np.zeros((3, 1)), 1e5)
    X = RigidTransform([0.0, 0.0, 2.0 - length])
    modes = inextensible_modes(cables, platform, X, np.array([mass * 9.81]))
    swing = np.sqrt(9.81 / length) / (2.0 * np.pi)
    np.testing.assert_allclose(modes.frequencies, [0.0, 0.0, 0.0, swing, swing], rtol=1e-9)


def test_a_cable_across_the_line_of_a_point_holds_no_length():
    """A bead on a level line below its exit point is a pendulum, its cable keeps its length."""
    length, mass = 1.5, 3.0
    along_x = MotionType("1T", (1.0, 0.0, 0.0))
    platform = RigidPlatform(mass, np.zeros(3), np.zeros((3, 3)), motion=along_x)
    cables = CableSet.make(np.array([[0.0], [0.0], [length]]), np.zeros((3, 1)), 1e5)
    modes = inextensible_modes(cables, platform, RigidTransform(), np.array([mass * 9.81]))
    swing = np.sqrt(9.81 / length) / (2.0 * np.pi)
    np.testing.assert_allclose(modes.frequencies, [swing], rtol=1e-9)


def test_a_cable_that_repeats_another_one_holds_nothing_more():
    """The second is the first up to rounding: the modes are those of one cable."""
    platform = RigidPlatform(3.0, np.zeros(3), np.diag([0.02, 0.03, 0.04]))
    X = RigidTransform([0.0, 0.0, 0.5])
    A, B = np.array([[0.1], [0.0], [2.0]]), np.array([[0.1], [0.0], [0.3]])
    one = CableSet.make(A, B, 1e5)
    two = CableSet.make(np.hstack([A, A + 1e-13]), np.hstack([B, B]), 1e5)
    weight = 3.0 * 9.81
    expected = inextensible_modes(one, platform, X, np.array([weight])).frequencies
    found = inextensible_modes(two, platform, X, np.full(2, 0.5 * weight)).frequencies
    assert len(found) == 5
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


def test_principal_stiffnesses_count_turns_by_their_arm():
    """Of a stiffness without coupling: moments per turn over the arm's square, and forces."""
    turns, moves, arm = np.array([1.0, 2.0, 3.0]), np.array([100.0, 500.0, 700.0]), 0.1
    platform = RigidPlatform(1.0, np.zeros(3), np.eye(3))
    found = principal_stiffnesses(np.diag([*turns, *moves]), platform, arm)
    np.testing.assert_allclose(found, np.sort([*turns / arm**2, *moves]), rtol=1e-12)
    planar = RigidPlatform(1.0, np.zeros(3), np.eye(3), motion=MotionType("2T1R"))
    found = principal_stiffnesses(np.diag([2.0, 100.0, 500.0]), planar, arm)
    np.testing.assert_allclose(found, [100.0, 200.0, 500.0], rtol=1e-12)

"""Several cables on one winch: a platform on three parallelograms, and a doubled cable."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_exports import export_omissions
from cdpr_drake.models.robot_holding import check_bundles
from cdpr_drake.models.sensor_catalogue import load_encoder
from cdpr_drake.systems.robots.cable_robot import automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.winches import VelocityWinch
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS
from cdpr_drake.winches.groups import WinchGroups
from cdpr_drake.winches.motor import MODES
from cdpr_drake.winches.motor_kernel import pack_winch, winch_rates
from tests.models.robots import robot_of
from tests.systems.robots.engines import bundled, parallelograms, pose, read, settings_of, started

STRETCH = 3e-4
"""How far stretches of cables of 350 kN move a platform of 5 kg [m, rad]."""

ROBOT = bundled()
HOME = ROBOT.home.transform()


def test_winches_are_counted_in_the_order_of_their_first_cables():
    groups = WinchGroups.of_names(["b", None, "b", "a", None])
    assert groups.of_cable == (0, 1, 0, 2, 3)
    assert groups.count == 4
    assert groups.first_cables() == (0, 1, 3, 4)
    assert groups.leaders() == (0, 1, 0, 3, 4)
    np.testing.assert_array_equal(groups.sizes(), [2, 1, 2, 1, 1])
    np.testing.assert_array_equal(groups.means()[0], [0.5, 0, 0.5, 0, 0])
    np.testing.assert_array_equal(groups.to_cables().sum(axis=0), [2, 1, 1, 1])
    assert not WinchGroups.of_names([None] * 4).are_shared()


def test_one_velocity_pays_out_all_cables_of_a_winch():
    winch = VelocityWinch(np.arange(6.0), 0.5, ROBOT.winch_groups())
    simulator = Simulator(winch)
    context = simulator.get_mutable_context()
    winch.GetInputPort("cable_velocities").FixValue(context, [0.1, -0.2, 9.0])
    simulator.AdvanceTo(1.0)
    rates = read(winch, context, "unstrained_length_rates")
    np.testing.assert_allclose(rates, [0.1, 0.1, -0.2, -0.2, 0.5, 0.5])
    lengths = read(winch, context, "unstrained_lengths")
    np.testing.assert_allclose(lengths, np.arange(6.0) + rates, atol=1e-12)


def test_the_platform_moves_without_turning():
    there = RigidTransform(HOME.rotation(), HOME.translation() + np.array([0.02, -0.03, 0.02]))
    cables = ROBOT.cable_set().without_pulleys()
    change = cable_paths(there, cables).lengths - cable_paths(HOME, cables).lengths
    np.testing.assert_allclose(change[::2], change[1::2], atol=1e-15)
    block, simulator, context = started(
        CompiledCableRobot, ROBOT, settings_of(damping=60.0), 1e-4, command=change[::2] / 0.5
    )
    simulator.AdvanceTo(0.5)
    X_WP = pose(block, context)
    assert np.linalg.norm(X_WP.translation() - there.translation()) < 10 * STRETCH
    assert X_WP.rotation().ToAngleAxis().angle() < 10 * STRETCH
    l0 = read(block, context, "unstrained_lengths")
    np.testing.assert_allclose(l0[::2] - l0[1::2], 0.0, atol=1e-4)


def test_a_motor_holds_all_cables_on_its_winch():
    block, simulator, context = started(CompiledCableRobot, ROBOT, settings_of("velocity"))
    tensions, radius = read(block, context, "tensions"), ROBOT.drum().radii(6)[0]
    torques = read(block, context, "applied_torques")
    np.testing.assert_allclose(torques[::2], -radius * (tensions[::2] + tensions[1::2]), rtol=1e-9)
    simulator.AdvanceTo(0.01)
    assert np.max(np.abs(read(block, context, "unstrained_length_rates"))) < 1e-9


def test_the_sum_of_tensions_turns_the_drum():
    content = parallelograms()
    content["winch"]["friction"] = None
    law, out = robot_of(content).winch_law(), np.empty(12)
    tensions, tau = np.array([5.0, 9.0, 4.0, 4.0, 1.0, 2.0]), np.repeat([-0.05, -0.02, 0.01], 2)
    winch_rates(
        np.r_[np.ones(6), np.zeros(6)], tensions, tau, np.zeros(6), np.ones(6), MODES["torque"],
        pack_winch(law), out,
    )  # fmt: skip
    rho = law.drum.radii(6)[0]
    sums = np.repeat(tensions[::2] + tensions[1::2], 2)
    np.testing.assert_allclose(out[6:], rho * (tau + rho * sums) / law.inertia, rtol=1e-12)


def test_one_encoder_tells_of_all_cables_on_a_winch():
    sensor = SENSORS["encoder"]
    encoders = sensor.make(load_encoder(sensor.types()[0]), ROBOT, 0, 100.0)
    home = cable_paths(HOME, ROBOT.cable_set().without_pulleys()).lengths
    paid = np.array([0.1, 0.104, -0.2, -0.2, 0.3, 0.31])  # trimmed by a few millimetres
    angles, lengths = np.split(encoders.measure(home + paid, 0), 2)
    np.testing.assert_array_equal(angles[::2], angles[1::2])
    np.testing.assert_allclose(lengths - home, np.repeat(paid[::2], 2), atol=1e-4)


def test_steps_are_those_of_these_motors():
    doubled = automatic_step(ROBOT, HOME, "runge_kutta3", settings_of("torque"))
    content = parallelograms()
    for cable in content["cables"]:
        cable.pop("winch")
    single = automatic_step(robot_of(content), HOME, "runge_kutta3", settings_of("torque"))
    assert 0.5 * single < doubled < single  # twice the stiffness on each motor


def test_a_translated_pose_is_within_reach_exports_tell_and_commands_are_by_winch():
    there = RigidTransform(HOME.rotation(), [0.1, -0.05, 0.5])
    check_bundles(ROBOT, ROBOT.cable_set(), there)
    assert "a winch of its own" in export_omissions(ROBOT, "wcrfx")["cables[].winch"]
    winches = MotorWinch(ROBOT.winch_law(), "torque", np.ones(6))
    assert winches.GetInputPort("motor_torques").size() == 3

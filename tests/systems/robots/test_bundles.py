"""Several cables on one winch: a platform on three parallelograms, and a doubled cable."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.analyses.workspaces.stability_question import stability_case
from cdpr_drake.errors import CableGeometryError, CdprError, RobotFileError, StabilityError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_exports import export_omissions
from cdpr_drake.models.robot_holding import check_bundles
from cdpr_drake.models.sensor_catalogue import load_encoder
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.settings import CableRobotSettings, DampingSettings, WinchSettings
from cdpr_drake.systems.robots.winches import VelocityWinch
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS
from cdpr_drake.winches.groups import WinchGroups
from cdpr_drake.winches.motor import MODES
from cdpr_drake.winches.motor_kernel import pack_winch, winch_rates
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from tests.models.robots import content_of, robot_of
from tests.systems.robots.engines import made

SAME_STEPS = 1e-8
"""Of states after the same steps by both engines: rounding, times what motors make of it."""

STRETCH = 3e-4
"""How far stretches of cables of 350 kN move a platform of 5 kg [m, rad]."""

HALF = 0.08
"""Half of the width of a parallelogram [m]."""


def parallelograms():
    """A platform on three pairs of parallel cables, each on a winch: it moves without turning."""
    content = content_of()
    cables = []
    for k in range(3):
        out = np.array([np.cos(2.1 * k + 0.3), np.sin(2.1 * k + 0.3), 0.0])
        along = HALF * np.array([-out[1], out[0], 0.0])
        for j, sign in enumerate((1.0, -1.0)):
            exit_point = 0.5 * out + sign * along + [0.0, 0.0, 1.1]
            anchor = 0.1 * out + sign * along + [0.0, 0.0, 0.03]
            cables.append({"name": f"P{k}{'ab'[j]}", "winch": f"W{k}",
                           "exit_point": exit_point.tolist(),
                           "anchor_point": anchor.tolist()})  # fmt: skip
    content["cables"] = cables
    content["platform"]["mass"] = 5.0
    content["home"] = {"position": [0.0, 0.0, 0.4], "angles_deg": [0.0, 0.0, 0.0]}
    content["slack_readings"] = None
    return content


ROBOT = robot_of(parallelograms())
HOME = ROBOT.home.transform()


def settings(mode=None, damping=20.0):
    winches = WinchSettings() if mode is None else WinchSettings(kind="motor", mode=mode)
    calm = DampingSettings(translation=damping, rotation=1.0)
    return CableRobotSettings(winches=winches, damping=calm)


def moved(kind, how, command, duration, step):
    block = made(kind, ROBOT, how)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, HOME)
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context).copy()
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        name = port.get_name()
        if name == "brakes":
            port.FixValue(context, np.zeros(3))
        elif name not in ("commanded_length_rates", "applied_wrench"):
            port.FixValue(context, command(l0) if callable(command) else command)
    if kind is CableRobot:
        ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    else:
        block.integrate_by(StepRule(max_step=step))
    simulator.AdvanceTo(duration)
    return block, context


def value(block, context, name):
    return block.GetOutputPort(name).Eval(context)


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
    rates = winch.GetOutputPort("unstrained_length_rates").Eval(context)
    np.testing.assert_allclose(rates, [0.1, 0.1, -0.2, -0.2, 0.5, 0.5])
    lengths = winch.GetOutputPort("unstrained_lengths").Eval(context)
    np.testing.assert_allclose(lengths, np.arange(6.0) + rates, atol=1e-12)


def test_the_platform_moves_without_turning():
    shift = np.array([0.02, -0.03, 0.02])
    there = RigidTransform(HOME.rotation(), HOME.translation() + shift)
    cables = ROBOT.cable_set().without_pulleys()
    change = cable_paths(there, cables).lengths - cable_paths(HOME, cables).lengths
    np.testing.assert_allclose(change[::2], change[1::2], atol=1e-15)
    velocities = change[::2] / 0.5
    block, context = moved(CompiledCableRobot, settings(damping=60.0), velocities, 0.5, 1e-4)
    X_WP = value(block, context, "X_WP")
    assert np.linalg.norm(X_WP.translation() - there.translation()) < 10 * STRETCH
    assert X_WP.rotation().ToAngleAxis().angle() < 10 * STRETCH
    l0 = value(block, context, "unstrained_lengths")
    np.testing.assert_allclose(l0[::2] - l0[1::2], 0.0, atol=1e-4)


@pytest.mark.parametrize("mode", [None, "velocity", "torque", "position"])
def test_both_engines_move_it_alike(mode):
    command = {
        None: [0.05, -0.02, 0.03],
        "velocity": [0.05, -0.02, 0.03],
        "torque": [-0.15, -0.17, -0.16],
        "position": lambda l0: l0[::2] + np.array([0.002, -0.001, 0.0]),
    }[mode]
    ends = []
    for kind in (CableRobot, CompiledCableRobot):
        block, context = moved(kind, settings(mode), command, 0.02, 1e-4)
        names = ["platform_state", "unstrained_lengths", "unstrained_length_rates", "tensions"]
        names += ["motor_angles", "applied_torques", "friction_torques"] if mode else []
        ends.append(np.concatenate([value(block, context, name) for name in names]))
    np.testing.assert_allclose(*ends, rtol=SAME_STEPS, atol=SAME_STEPS)
    rates = value(block, context, "unstrained_length_rates")
    np.testing.assert_allclose(rates[::2], rates[1::2], atol=1e-12)


def test_a_motor_holds_all_cables_on_its_winch():
    block = CompiledCableRobot(ROBOT, settings("velocity"))
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    tensions = block.set_at_equilibrium(context, HOME)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(3))
    radius = ROBOT.drum().radii(6)[0]
    torques = value(block, context, "applied_torques")
    np.testing.assert_allclose(torques[::2], -radius * (tensions[::2] + tensions[1::2]), rtol=1e-9)
    simulator.AdvanceTo(0.01)
    assert np.max(np.abs(value(block, context, "unstrained_length_rates"))) < 1e-9


def test_the_sum_of_tensions_turns_the_drum():
    content = parallelograms()
    content["winch"]["friction"] = None
    law = robot_of(content).winch_law()
    tensions, tau = np.array([5.0, 9.0, 4.0, 4.0, 1.0, 2.0]), np.repeat([-0.05, -0.02, 0.01], 2)
    out = np.empty(12)
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
    doubled = automatic_step(ROBOT, HOME, "runge_kutta3", settings("torque"))
    content = parallelograms()
    for cable in content["cables"]:
        cable.pop("winch")
    single = automatic_step(robot_of(content), HOME, "runge_kutta3", settings("torque"))
    assert 0.5 * single < doubled < single  # twice the stiffness on each motor


def test_a_pose_that_a_winch_cannot_reach_is_refused():
    cables = ROBOT.cable_set()
    check_bundles(ROBOT, cables, RigidTransform(HOME.rotation(), [0.1, -0.05, 0.5]))
    turned = RigidTransform(RollPitchYaw(0.0, 0.2, 0.3), HOME.translation())
    with pytest.raises(CableGeometryError, match=r"P0a and P0b of .* on one winch, which pays out"):
        check_bundles(ROBOT, cables, turned)


def test_what_does_not_work_with_bundles_says_so():
    content = parallelograms()
    content["cables"][1]["material"] = {"diameter": 0.003}
    with pytest.raises(RobotFileError, match=r"cables\[1\]\.material\.diameter: found 0\.003 on"):
        robot_of(content)
    block = CompiledCableRobot(ROBOT, settings("torque"))
    with pytest.raises(CdprError, match=r"semi_implicit for motors with several cables"):
        block.integrate_by(StepRule(method="semi_implicit", max_step=1e-3))
    assert "a winch of its own" in export_omissions(ROBOT, "wcrfx")["cables[].winch"]
    winches = MotorWinch(ROBOT.winch_law(), "torque", np.ones(6))
    assert winches.GetInputPort("motor_torques").size() == 3


def test_a_certificate_of_stability_says_so():
    grid = WorkspaceGrid(([0.0], [0.0], [0.4]), np.zeros((1, 3)))
    with pytest.raises(StabilityError, match=r"several cables on one winch; accepted: a winch for"):
        stability_case(ROBOT, "pbvs", grid)

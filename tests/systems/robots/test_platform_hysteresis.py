"""Contacts of a platform that rub as it turns, in both engines: against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.primitives import Linearize

from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis, contact_rates
from cdpr_drake.dynamics.contact_kernel import SLIP, pack_contacts, rub
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.platform_hysteresis import BENT
from cdpr_drake.systems.robots.settings import CableRobotSettings
from tests.motion.small_robots import small_robot
from tests.systems.robots.engines import (
    BY_ENGINE,
    CLOSED_FORM,
    ENGINES,
    integrate,
    made,
    read,
    rubbing,
)

TILT, TURN, A = 3.0, 5.0, 0.08
"""K about x and y, and about z [N m/rad]; a [rad]."""

K = np.array([TILT, TILT, TURN])
CONTACTS = ContactHysteresis(tilt=TILT, turn=TURN, slip=A)

INERTIA = 0.12
"""Of the ball, about each axis [kg m^2]."""

PAID_OUT = 9.0
"""Lengths of cables that are slack wherever the platform goes [m]."""


def ball(tilt=TILT, turn=TURN, slip=A):
    """A ball without weight."""
    robot = rubbing(small_robot("hanging_four"), tilt, turn, slip)
    inertia = np.array([INERTIA] * 3 + [0.0] * 3)
    platform = replace(robot.platform, center_of_mass=np.zeros(3), inertia=inertia)
    return replace(robot, gravity=0.0, platform=platform)


def spinning(kind, robot, step, w, X_WP=None, method="runge_kutta3"):
    """The robot on slack cables, its platform turning at w."""
    block = made(kind, robot)
    simulator, X_WP = Simulator(block), X_WP or robot.home.transform()
    context, m = simulator.get_mutable_context(), len(robot.cables)
    still, speeds = np.zeros(m), np.zeros(robot.joint().num_velocities)
    if robot.joint().is_floating:
        speeds[:3] = w
    else:
        speeds[2] = w[2]
    block.GetInputPort("cable_velocities").FixValue(context, still)
    if kind is CableRobot:
        plant_context = block.GetMutableSubsystemContext(block.plant, context)
        block.in_plant.set_pose(plant_context, X_WP)
        block.plant.SetVelocities(plant_context, block.in_plant.model_instance, speeds)
        own = block.GetMutableSubsystemContext(block.winches, context)
        block.winches.hold(own, np.full(m, PAID_OUT), still)
    else:
        own = block.GetMutableSubsystemContext(block.motion, context)
        block.motion.hold(own, X_WP, np.full(m, PAID_OUT), still)
        state, n = block.motion.state(own).copy(), robot.joint().num_states
        state[n - len(speeds) : n] = speeds
        block.motion.set_state(own, state)
    integrate(block, simulator, step, method)
    return block, simulator, context


def turned(state):
    """Turn of a state from where it stood along W, about the axis that it is about [rad]."""
    return 2.0 * np.arctan2(np.linalg.norm(state[1:4]), state[0])


@BY_ENGINE
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_ball_loses_what_the_loop_encloses_and_slips_at_its_moment(kind, axis):
    """One way from unbent contacts: z = a (1 - exp(-s / a)), and what is lost of the energy of
    motion is K a (s - z), under the curve of the moment, which comes to K a."""
    block, simulator, context = spinning(kind, ball(), 2e-4, 5.0 * np.eye(3)[axis])
    simulator.AdvanceTo(0.12)
    state, bent = read(block, context, "platform_state"), read(block, context, BENT)[axis]
    s = turned(state)
    assert s > 4.0 * A  # it slips
    z = CONTACTS.bent(s)
    assert bent == pytest.approx(z, rel=CLOSED_FORM)
    lost = 0.5 * INERTIA * (25.0 - state[7 + axis] ** 2)
    assert lost == pytest.approx(K[axis] * A * (s - z), rel=CLOSED_FORM)
    accelerations = block.GetOutputPort("body_accelerations").Eval(context)
    braked = -INERTIA * accelerations[-1].rotational()[axis]
    held = CONTACTS.held_moments()[axis] * z / A
    assert braked == pytest.approx(held, rel=CLOSED_FORM)


@BY_ENGINE
def test_small_turns_meet_a_spring(kind):
    """Far below a, the platform swings as on a spring K: period 2 pi sqrt(I / K)."""
    small, pulsation = 1e-7 * A, np.sqrt(TURN / INERTIA)
    block, simulator, context = spinning(kind, ball(), 5e-4, [0.0, 0.0, small * pulsation])
    simulator.AdvanceTo(np.pi / 2.0 / pulsation)
    state = read(block, context, "platform_state")
    assert turned(state) == pytest.approx(small, rel=CLOSED_FORM)
    assert abs(state[9]) < CLOSED_FORM * small * pulsation


@BY_ENGINE
def test_motion_and_contacts_lose_what_slips(kind):
    """In space, about all axes: d/dt (I w^2 + z' K z) / 2 = -|w| z' K z / a."""
    step, rows = 1e-3, []
    block, simulator, context = spinning(kind, ball(), step, [1.0, -2.0, 0.7])
    for k in range(401):
        simulator.AdvanceTo(k * step)
        z, w = read(block, context, BENT), read(block, context, "platform_state")[7:10]
        held = float(z @ (K * z))
        rows.append([0.5 * INERTIA * w @ w + 0.5 * held, np.linalg.norm(w) * held / A])
    energy, power = np.array(rows).T
    taken = step * (np.sum(power) - 0.5 * (power[0] + power[-1]))  # by Euler and Maclaurin:
    taken -= step**2 / 12.0 * (np.gradient(power, step)[-1] - np.gradient(power, step)[0])
    assert energy[0] - energy[-1] == pytest.approx(taken, rel=1e-5)
    assert taken > 0.5 * energy[0]


@BY_ENGINE
def test_the_moment_turns_with_the_platform(kind):
    """K differs about z of P: turned by a right angle about x, that axis lies along -y of W."""
    X_WP = RigidTransform(RotationMatrix.MakeXRotation(np.pi / 2.0), [0.1, 0.05, 0.3])
    found = []
    for w, at in (([0.0, -5.0, 0.0], X_WP), ([0.0, 0.0, 5.0], None)):
        block, simulator, context = spinning(kind, ball(), 1e-3, w, at)
        simulator.AdvanceTo(0.1)
        found.append(read(block, context, "platform_state"))
    assert -found[0][8] == pytest.approx(found[1][9], rel=1e-9)


@BY_ENGINE
@pytest.mark.parametrize("name", ["upright_body", "oblique_body"])
def test_a_body_in_a_plane_rubs_about_its_normal(kind, name):
    """K about the normal n is n' K n; the rest is held by the plane."""
    robot = rubbing(replace(small_robot(name), gravity=0.0), TILT, TURN, A)
    n = np.array(robot.motion_type().axis)
    block, simulator, context = spinning(kind, robot, 2e-4, [0.0, 0.0, 5.0])
    begin = read(block, context, "platform_state")[2]
    simulator.AdvanceTo(0.04)
    state = read(block, context, "platform_state")
    s = state[2] - begin
    z = CONTACTS.bent(s)
    assert read(block, context, BENT)[0] == pytest.approx(z, rel=CLOSED_FORM)
    I_n = float(n @ rigid_platform(robot).I_PPo @ n)
    lost = 0.5 * I_n * (25.0 - state[5] ** 2)
    assert lost == pytest.approx(float(n @ (K * n)) * A * (s - z), rel=CLOSED_FORM)


def test_semi_implicit_steps_are_of_second_order_and_bear_stiff_contacts():
    def end(robot, h, w, duration):
        block, simulator, context = spinning(
            CompiledCableRobot, robot, h, w, method="semi_implicit"
        )
        simulator.AdvanceTo(duration)
        return read(block, context, "platform_state", BENT)

    ends = [end(ball(), h, [1.0, -2.0, 0.7], 0.2) for h in (4e-3, 2e-3, 1e-3, 2.5e-4)]
    wrong = [np.linalg.norm(coarse - ends[-1]) for coarse in ends[:-1]]
    assert 3.0 < wrong[0] / wrong[1] < 5.5
    assert 3.0 < wrong[1] / wrong[2] < 5.5
    # A vibration of 2900 rad/s under steps of 4 ms: 11 times what explicit ones bear.
    stiff = end(ball(tilt=1e6, turn=1e6, slip=0.01), 4e-3, [1e-3, -2e-3, 7e-4], 1.0)
    assert np.linalg.norm(stiff[7:10]) < 1e-3


def test_loops_have_the_area_that_is_lost():
    for amplitude in (0.01, 0.08, 0.5):
        s = np.linspace(-amplitude, amplitude, 20001)
        up, back = CONTACTS.loop(s, amplitude, TILT)
        area = float(np.trapezoid(up - back, s))
        assert CONTACTS.loop_energy(amplitude, TILT) == pytest.approx(area, rel=CLOSED_FORM)
        np.testing.assert_allclose(up[[0, -1]], back[[0, -1]], rtol=1e-12)


def test_what_blocks_differentiate_is_what_kernels_compute():
    rng = np.random.default_rng(3)
    R = RotationMatrix(RotationMatrix.MakeXRotation(0.7) @ RotationMatrix.MakeZRotation(0.4))
    state = np.zeros(13)
    state[:4], state[7:10] = R.ToQuaternion().wxyz(), rng.normal(size=3)
    law = np.array([*K, A])
    bent, force, rates = 0.05 * rng.normal(size=3), np.zeros(6), np.zeros(3)
    rub(state, bent, law, force, rates)
    expected = contact_rates(bent, R.matrix().T @ state[7:10], law[SLIP])
    np.testing.assert_allclose(rates, expected, atol=1e-15)
    np.testing.assert_allclose(force[:3], -R.matrix() @ (law[:3] * bent), atol=1e-15)
    assert not contact_rates(bent, np.zeros(3), A).any()


def test_the_plant_is_differentiated_with_its_contacts():
    """The linearised robot at rest swings as a spring K on the ball's inertia."""
    block, _, context = spinning(CableRobot, ball(), 1e-3, [0.0, 0.0, 0.0])
    block.GetInputPort("applied_wrench").FixValue(context, np.zeros(6))
    linear = Linearize(
        block, context, block.GetInputPort("applied_wrench").get_index(),
        block.GetOutputPort("platform_state").get_index(), equilibrium_check_tolerance=1e-6,
    )  # fmt: skip
    assert linear.A().shape[0] == block.plant.num_multibody_states() + 4 + 3
    swings = np.abs(np.imag(np.linalg.eigvals(linear.A())))
    for pulsation in np.sqrt(K / INERTIA):
        assert np.min(np.abs(swings - pulsation)) < 1e-6 * pulsation


def test_a_loop_without_a_diagram_begins_with_unbent_contacts():
    robot = rubbing(load_robot("acrobot_small"), TILT, TURN, A)
    motion = RobotMotion(robot, CableRobotSettings(), StepRule(max_step=1e-4))
    state = motion.resting(robot.home.transform())
    assert len(state) == 13 + 8 + 3
    assert not state[-3:].any()


def test_contacts_make_automatic_steps_shorter_and_none_leave_no_state():
    robot = small_robot("hanging_four")
    X_WP, none = robot.home.transform(), rubbing(robot, 0.0, 0.0, A)
    plain = automatic_step(robot, X_WP, "runge_kutta3")
    stiff = automatic_step(rubbing(robot, 1e6, TURN, A), X_WP, "runge_kutta3")
    assert stiff < 0.5 * plain
    assert automatic_step(none, X_WP, "runge_kutta3") == plain
    assert none.contact_hysteresis() is None
    assert pack_contacts(none.contact_hysteresis(), none.joint())[0] == 0
    assert not any(kind(none).HasOutputPort(BENT) for kind in ENGINES)

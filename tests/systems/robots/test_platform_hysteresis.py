"""A platform that rubs as it turns, in both engines: against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.primitives import Linearize

from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis, contact_rates
from cdpr_drake.dynamics.contact_kernel import SLIP, pack_contacts, rub
from cdpr_drake.errors import CdprError, RobotFileError
from cdpr_drake.models.materials import BehaviourSettings
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import HysteresisSettings
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.platform_hysteresis import BENT
from cdpr_drake.systems.robots.settings import CableRobotSettings, WinchSettings
from tests.motion.small_robots import content, small_robot
from tests.systems.robots.engines import made

ENGINES = [CompiledCableRobot, CableRobot]

SAME_STEPS = 1e-9
"""Difference of states where both engines take the same steps, as in their other tests."""

CLOSED_FORM = 1e-6
"""Relative, of what an engine integrates, against a closed form."""

TILT, TURN, A = 3.0, 5.0, 0.08
"""K about x and y, and about z [N m/rad]; a [rad]."""

INERTIA = 0.12
"""Of the ball, about each axis [kg m^2]."""

PAID_OUT = 9.0
"""Lengths of cables that are slack wherever the platform goes [m]."""


def rubbing(robot, tilt=TILT, turn=TURN, slip=A):
    section = HysteresisSettings(tilt=tilt, turn=turn, slip=slip)
    return replace(robot, platform=replace(robot.platform, hysteresis=section))


def ball(**contacts):
    """A ball without weight."""
    robot = rubbing(small_robot("hanging_four"), **contacts)
    inertia = np.array([INERTIA] * 3 + [0.0] * 3)
    platform = replace(robot.platform, center_of_mass=np.zeros(3), inertia=inertia)
    return replace(robot, gravity=0.0, platform=platform)


def spinning(kind, robot, step, w, X_WP=None, method="runge_kutta3"):
    """A simulator of the robot on slack cables, its platform turning at w."""
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
        ResetIntegratorFromFlags(simulator, method, step).set_fixed_step_mode(True)
    else:
        block.integrate_by(StepRule(method=method, max_step=step))
        own = block.GetMutableSubsystemContext(block.motion, context)
        block.motion.hold(own, X_WP, np.full(m, PAID_OUT), still)
        state, n = block.motion.state(own).copy(), robot.joint().num_states
        state[n - len(speeds) : n] = speeds
        block.motion.set_state(own, state)
    return block, simulator


def told(block, context, *names):
    return np.concatenate([block.GetOutputPort(name).Eval(context) for name in names])


def turned(state):
    """Turn of a state from where it stood along W, about the axis that it is about [rad]."""
    return 2.0 * np.arctan2(np.linalg.norm(state[1:4]), state[0])


@pytest.mark.parametrize("kind", ENGINES)
@pytest.mark.parametrize(("axis", "K"), [(0, TILT), (1, TILT), (2, TURN)])
def test_a_ball_loses_what_the_loop_encloses(kind, axis, K):
    """One way from unbent contacts: z = a (1 - exp(-s / a)), and what is lost of the energy of
    motion is K a (s - z), under the curve of the moment."""
    w = 5.0 * np.eye(3)[axis]
    block, simulator = spinning(kind, ball(), 2e-4, w)
    context = simulator.get_context()
    simulator.AdvanceTo(0.12)
    state, bent = told(block, context, "platform_state"), told(block, context, BENT)[axis]
    s = turned(state)
    assert s > 4.0 * A  # it slips
    z = ContactHysteresis(tilt=TILT, turn=TURN, slip=A).bent(s)
    assert bent == pytest.approx(z, rel=CLOSED_FORM)
    lost = 0.5 * INERTIA * (25.0 - state[7 + axis] ** 2)
    assert lost == pytest.approx(K * A * (s - z), rel=CLOSED_FORM)


@pytest.mark.parametrize("kind", ENGINES)
def test_small_turns_meet_a_spring(kind):
    """Far below a, the platform swings as on a spring K: period 2 pi sqrt(I / K)."""
    small = 1e-7 * A
    pulsation = np.sqrt(TURN / INERTIA)
    block, simulator = spinning(kind, ball(), 2e-4, [0.0, 0.0, small * pulsation])
    simulator.AdvanceTo(np.pi / 2.0 / pulsation)
    state = told(block, simulator.get_context(), "platform_state")
    assert turned(state) == pytest.approx(small, rel=CLOSED_FORM)
    assert abs(state[9]) < CLOSED_FORM * small * pulsation


@pytest.mark.parametrize("kind", ENGINES)
def test_large_turns_meet_the_moment_at_which_contacts_slip(kind):
    block, simulator = spinning(kind, ball(), 2e-4, [0.0, 20.0, 0.0])
    simulator.AdvanceTo(20.0 * A / 20.0)
    accelerations = block.GetOutputPort("body_accelerations").Eval(simulator.get_context())
    braked = -INERTIA * accelerations[-1].rotational()[1]
    held = ContactHysteresis(tilt=TILT, turn=TURN, slip=A).held_moments()[1]
    assert braked == pytest.approx(held, rel=CLOSED_FORM)


@pytest.mark.parametrize("kind", ENGINES)
def test_motion_and_contacts_lose_what_slips(kind):
    """In space, about all axes: d/dt (I w^2 + z' K z) / 2 = -|w| z' K z / a."""
    step, K = 1e-3, np.array([TILT, TILT, TURN])
    block, simulator = spinning(kind, ball(), step, [1.0, -2.0, 0.7])
    context, rows = simulator.get_context(), []
    for k in range(401):
        simulator.AdvanceTo(k * step)
        z, w = told(block, context, BENT), told(block, context, "platform_state")[7:10]
        held = float(z @ (K * z))
        rows.append([0.5 * INERTIA * w @ w + 0.5 * held, np.linalg.norm(w) * held / A])
    energy, power = np.array(rows).T
    taken = step * (np.sum(power) - 0.5 * (power[0] + power[-1]))  # by Euler and Maclaurin:
    taken -= step**2 / 12.0 * (np.gradient(power, step)[-1] - np.gradient(power, step)[0])
    assert energy[0] - energy[-1] == pytest.approx(taken, rel=1e-5)
    assert taken > 0.5 * energy[0]


@pytest.mark.parametrize("kind", ENGINES)
def test_the_moment_turns_with_the_platform(kind):
    """K differs about z of P: turned by a right angle about x, that axis lies along -y of W."""
    X_WP = RigidTransform(RotationMatrix.MakeXRotation(np.pi / 2.0), [0.1, 0.05, 0.3])
    found = []
    for w, at in (([0.0, -5.0, 0.0], X_WP), ([0.0, 0.0, 5.0], None)):
        block, simulator = spinning(kind, ball(), 1e-3, w, at)
        simulator.AdvanceTo(0.1)
        found.append(told(block, simulator.get_context(), "platform_state"))
    assert -found[0][8] == pytest.approx(found[1][9], rel=1e-9)


@pytest.mark.parametrize("kind", ENGINES)
@pytest.mark.parametrize("name", ["upright_body", "oblique_body"])
def test_a_body_in_a_plane_rubs_about_its_normal(kind, name):
    """K about the normal n is n' K n; the rest is held by the plane."""
    robot = rubbing(replace(small_robot(name), gravity=0.0))
    n = np.array(robot.motion_type().axis)
    block, simulator = spinning(kind, robot, 2e-4, [0.0, 0.0, 5.0])
    K = float(n @ (np.array([TILT, TILT, TURN]) * n))
    context = simulator.get_context()
    begin = told(block, context, "platform_state")[2]
    simulator.AdvanceTo(0.04)
    state = told(block, context, "platform_state")
    s = state[2] - begin
    z = ContactHysteresis(tilt=TILT, turn=TURN, slip=A).bent(s)
    assert told(block, context, BENT)[0] == pytest.approx(z, rel=CLOSED_FORM)
    I_n = float(n @ rigid_platform(robot).I_PPo @ n)
    lost = 0.5 * I_n * (25.0 - state[5] ** 2)
    assert lost == pytest.approx(K * A * (s - z), rel=CLOSED_FORM)


@pytest.mark.parametrize(
    ("name", "mode", "creeps"),
    [("hanging_four", "ideal", False), ("oblique_body", "ideal", False),
     ("acrobot_small", "velocity", True)],
)  # fmt: skip
def test_both_engines_move_alike(name, mode, creeps):
    """On cables, pushed; with motors and creep, whose states stand around that of contacts."""
    robot = load_robot(name) if mode == "velocity" else small_robot(name)
    robot = rubbing(robot, tilt=0.3, turn=0.5, slip=0.02)
    if creeps:
        behaviour = BehaviourSettings(creep_stiffness=0.4, creep_time=0.05)
        robot = replace(robot, cable=replace(robot.cable, behaviour=behaviour))
    winches = WinchSettings() if mode == "ideal" else WinchSettings(kind="motor", mode=mode)
    how = CableRobotSettings(winches=winches)
    step, ends = automatic_step(robot, robot.home.transform(), "runge_kutta3", how), []
    step = 0.2 / np.ceil(0.2 / min(step, 2e-3))  # plants leave quaternions longer than 1
    names = ["platform_state", "unstrained_lengths", BENT, *(["crept"] if creeps else [])]
    for kind in ENGINES:
        block = made(kind, robot, how)
        simulator = Simulator(block)
        context = simulator.get_mutable_context()
        block.set_at_equilibrium(context, robot.home.transform())
        port = block.GetInputPort("cable_velocities")
        port.FixValue(context, -0.02 * np.linspace(0.5, 1.0, port.size()))
        block.GetInputPort("applied_wrench").FixValue(context, [0.2, -0.1, 0.3, 0, 0, 0])
        if kind is CableRobot:
            ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
        else:
            block.integrate_by(StepRule(max_step=step))
        assert not told(block, context, BENT).any()
        simulator.AdvanceTo(0.2)
        ends.append(told(block, context, *names))
        assert np.max(np.abs(told(block, context, BENT))) > 1e-4
    np.testing.assert_allclose(*ends, atol=SAME_STEPS)


def test_semi_implicit_steps_are_of_second_order_and_bear_stiff_contacts():
    ends = {}
    for h in (4e-3, 2e-3, 1e-3, 2.5e-4):
        block, simulator = spinning(
            CompiledCableRobot, ball(), h, [1.0, -2.0, 0.7], method="semi_implicit"
        )
        simulator.AdvanceTo(0.2)
        ends[h] = told(block, simulator.get_context(), "platform_state", BENT)
    wrong = [np.linalg.norm(ends[h] - ends[2.5e-4]) for h in (4e-3, 2e-3, 1e-3)]
    assert 3.0 < wrong[0] / wrong[1] < 5.5
    assert 3.0 < wrong[1] / wrong[2] < 5.5
    # A vibration of 2900 rad/s under steps of 4 ms: 11 times what explicit ones bear.
    stiff = ball(tilt=1e6, turn=1e6, slip=0.01)
    block, simulator = spinning(
        CompiledCableRobot, stiff, 4e-3, [1e-3, -2e-3, 7e-4], method="semi_implicit"
    )
    simulator.AdvanceTo(1.0)
    state = told(block, simulator.get_context(), "platform_state")
    assert np.linalg.norm(state[7:10]) < 1e-3


def test_loops_have_the_area_that_is_lost():
    contacts = ContactHysteresis(tilt=TILT, turn=TURN, slip=A)
    for amplitude in (0.01, 0.08, 0.5):
        s = np.linspace(-amplitude, amplitude, 20001)
        up, back = contacts.loop(s, amplitude, TILT)
        area = float(np.trapezoid(up - back, s))
        assert contacts.loop_energy(amplitude, TILT) == pytest.approx(area, rel=CLOSED_FORM)
        assert up[-1] == pytest.approx(back[-1], rel=1e-12)
        assert up[0] == pytest.approx(back[0], rel=1e-12)


def test_what_blocks_differentiate_is_what_kernels_compute():
    rng = np.random.default_rng(3)
    R = RotationMatrix(RotationMatrix.MakeXRotation(0.7) @ RotationMatrix.MakeZRotation(0.4))
    state = np.zeros(13)
    state[:4], state[7:10] = R.ToQuaternion().wxyz(), rng.normal(size=3)
    law = np.array([TILT, TILT, TURN, A])
    bent, force, rates = 0.05 * rng.normal(size=3), np.zeros(6), np.zeros(3)
    rub(state, bent, law, force, rates)
    expected = contact_rates(bent, R.matrix().T @ state[7:10], law[SLIP])
    np.testing.assert_allclose(rates, expected, atol=1e-15)
    np.testing.assert_allclose(force[:3], -R.matrix() @ (law[:3] * bent), atol=1e-15)
    assert not contact_rates(bent, np.zeros(3), A).any()


def test_the_plant_is_differentiated_with_its_contacts():
    """The linearised robot at rest swings as a spring K on the ball's inertia."""
    block, simulator = spinning(CableRobot, ball(), 1e-3, [0.0, 0.0, 0.0])
    context = simulator.get_mutable_context()
    block.GetInputPort("applied_wrench").FixValue(context, np.zeros(6))
    system = block.plant  # for the sizes of the state
    found = Linearize(
        block, context, block.GetInputPort("applied_wrench").get_index(),
        block.GetOutputPort("platform_state").get_index(),
        equilibrium_check_tolerance=1e-6,
    )  # fmt: skip
    assert found.A().shape[0] == system.num_multibody_states() + 4 + 3
    swings = np.abs(np.imag(np.linalg.eigvals(found.A())))
    wanted = np.sqrt(np.array([TILT, TILT, TURN]) / INERTIA)
    for pulsation in wanted:
        assert np.min(np.abs(swings - pulsation)) < 1e-6 * pulsation


def test_a_loop_without_a_diagram_begins_with_unbent_contacts():
    robot = rubbing(load_robot("acrobot_small"))
    motion = RobotMotion(robot, CableRobotSettings(), StepRule(max_step=1e-4))
    state = motion.resting(robot.home.transform())
    assert len(state) == 13 + 8 + 3
    assert not state[-3:].any()


def test_contacts_make_automatic_steps_shorter():
    robot = small_robot("hanging_four")
    X_WP = robot.home.transform()
    plain = automatic_step(robot, X_WP, "runge_kutta3")
    assert automatic_step(rubbing(robot, tilt=1e6), X_WP, "runge_kutta3") < 0.5 * plain
    assert automatic_step(rubbing(robot, 0.0, 0.0), X_WP, "runge_kutta3") == plain


def test_who_does_not_rub_has_no_such_state():
    robot = rubbing(small_robot("hanging_four"), 0.0, 0.0)
    assert robot.contact_hysteresis() is None
    assert pack_contacts(robot.contact_hysteresis(), robot.joint())[0] == 0
    for kind in ENGINES:
        assert not kind(robot).HasOutputPort(BENT)


@pytest.mark.parametrize("name", ["pendulum", "level_point", "lift", "beam"])
def test_platforms_that_do_not_turn_about_their_axes_are_refused(name):
    platform = content(name)["platform"] | {"hysteresis": {"tilt": 1.0}}
    with pytest.raises(RobotFileError, match=r"platform\.hysteresis: found a section for"):
        small_robot(name, platform=platform)


def test_batches_refuse_it():
    robot = rubbing(load_robot("acrobot_small"))
    with pytest.raises(CdprError, match=r"platform\.hysteresis: found a section"):
        BatchRobots(robot, 2)

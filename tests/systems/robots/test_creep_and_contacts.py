"""Cables that stiffen, are warm, creep and rub, and contacts that rub: against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.primitives import Linearize
from scipy.linalg import expm

from cdpr_drake.cables.cable_behaviour import (
    CableBehaviour,
    behaving_cables,
    behaviour_of,
    strain_energy,
    tension_of_strain,
)
from cdpr_drake.cables.models import CABLE_MODELS, cable_law
from cdpr_drake.cables.states import cable_derivatives, cable_state
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis, contact_rates
from cdpr_drake.dynamics.contact_kernel import SLIP, pack_contacts, rub
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium_kernel import energy_at
from cdpr_drake.systems.robots.cable_forces import CREPT
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.platform_hysteresis import BENT
from cdpr_drake.systems.robots.settings import CableSettings
from tests.motion.small_robots import small_robot
from tests.systems.robots.engines import (
    ALL_BEHAVIOUR,
    BY_ENGINE,
    CLOSED_FORM,
    ENGINES,
    behaving,
    integrate,
    made,
    read,
    rubbing,
    settings_of,
    started,
)


@BY_ENGINE
def test_a_weight_on_a_cable_that_creeps_follows_the_linear_equation(kind):
    """A force is put on: platform, cable and creep are a linear system of three states."""
    c, tau, F, duration = 0.6, 0.3, 4.0, 0.2
    robot = behaving(small_robot("pendulum"), creep_stiffness=c, creep_time=tau)
    block, simulator, context = started(kind, robot, step=1e-4, wrench=[0, 0, 0, 0, 0, -F])
    l0, length, crept = read(block, context, "unstrained_lengths", "lengths", CREPT)
    ES, T, m = robot.stiffness()[0], robot.cable.retardation_time, robot.platform.mass
    assert crept == pytest.approx(length / l0 - 1.0, rel=1e-9)
    # (length - where it was, its rate, z - where it was)' = A x + b
    k = ES / l0 / m
    A = np.array(
        [[0.0, 1.0, 0.0], [-k * (1.0 + c), -k * T, k * c * l0], [1.0 / l0 / tau, 0.0, -1.0 / tau]]
    )
    whole = np.zeros((4, 4))
    whole[:3, :3], whole[1, 3] = A, F / m
    simulator.AdvanceTo(duration)
    x = expm(whole * duration)[:3, 3]
    found = read(block, context, "lengths", CREPT) - [length, crept]
    np.testing.assert_allclose(found, x[[0, 2]], rtol=CLOSED_FORM)
    tension = ES * (length / l0 - 1.0) + ES * ((1.0 + c) * x[0] / l0 - c * x[2] + T * x[1] / l0)
    assert read(block, context, "tensions")[0] == pytest.approx(tension, rel=CLOSED_FORM)
    # After long it has the strain of the elastic law, which creep only delays.
    last = -np.linalg.solve(A, [0.0, F / m, 0.0])
    assert last[0] == pytest.approx(F * l0 / ES, rel=1e-9)


@BY_ENGINE
def test_drums_of_a_robot_in_motion_lift_more_than_they_lower(kind):
    friction, how = 0.05, settings_of(pulleys=True)
    robot = behaving(load_robot("acrobot_large"), sheave_friction=friction)
    cables = robot.cable_set()
    wraps = cable_paths(robot.home.transform(), cables).arcs / cables.pulley_radius
    block, _, context = started(kind, robot, how)
    for speed in (-0.02, 0.02, 0.0, 5e-4):
        block.GetInputPort("cable_velocities").FixValue(context, np.full(8, speed))
        ratio = read(block, context, "drum_tensions") / read(block, context, "tensions")
        by_law = np.exp(-friction * wraps * np.tanh(speed / 1e-3))
        np.testing.assert_allclose(ratio, by_law, rtol=CLOSED_FORM, err_msg=f"at {speed} m/s")


def test_the_semi_implicit_method_comes_to_the_same():
    robot = behaving(load_robot("acrobot_small"), **ALL_BEHAVIOUR)
    how, ends = settings_of("velocity", pulleys=True), []
    for method, step in (("runge_kutta3", 2e-4), ("semi_implicit", 2e-4), ("semi_implicit", 1e-4)):
        block, simulator, context = started(
            CompiledCableRobot, robot, how, step, command=-0.02, method=method
        )
        simulator.AdvanceTo(0.1)
        ends.append(read(block, context, "platform_state"))
    errors = [np.max(np.abs(end - ends[0])[:7]) for end in ends[1:]]
    assert errors[1] < 2e-6
    assert errors[1] < 0.5 * errors[0]


BEHAVIOUR = CableBehaviour(stiffening=2e-3, expansion=1.2e-5, warmer=15.0)


def hanging():
    robot = load_robot("acrobot_large")
    cables = behaving_cables(robot.cable_set(), BEHAVIOUR)
    X_WP = robot.home.transform()
    return robot, cables, X_WP, cable_paths(X_WP, cables).lengths / (1.0 + 2e-3)


def test_tensions_and_energy_are_those_of_the_law():
    robot, cables, X_WP, l0 = hanging()
    natural = l0 * BEHAVIOUR.longer()
    strains = cable_paths(X_WP, cables).lengths / natural - 1.0
    by_law = tension_of_strain(strains, cables.stiffness, BEHAVIOUR.stiffening)
    state = cable_state(cables, "elastic", X_WP, l0)
    np.testing.assert_allclose(state.tensions, by_law, rtol=1e-10)
    assert np.all(by_law > 0.0)
    law, motion = cable_law("elastic", cables), robot.motion_type().packed()
    place = (*X_WP.rotation().matrix().ravel(), *X_WP.translation())

    def energy(of):
        return energy_at(
            law, place, of.packed(), l0, 1.0, np.zeros(6), motion, np.zeros((8, 2)), np.empty(6),
            np.empty((6, 6)),
        )[0]  # fmt: skip

    stored = natural * strain_energy(strains, cables.stiffness, BEHAVIOUR.stiffening)
    assert energy(cables) == pytest.approx(float(np.sum(stored)), rel=1e-9)
    weak = replace(cables, stiffness=1e-6 * cables.stiffness)  # the series of small strains
    series = 0.5e-6 * cables.stiffness * strains**2 * natural
    assert energy(weak) == pytest.approx(float(np.sum(series)))


def test_derivatives_are_those_of_differences():
    _, cables, X_WP, l0 = hanging()
    slopes, h = cable_derivatives(cables, "elastic", X_WP, l0), 1e-7

    def state(shift, longer):
        there = RigidTransform(X_WP.rotation(), X_WP.translation() + shift)
        return cable_state(cables, "elastic", there, l0 + longer)

    ahead, back = state(np.zeros(3), h), state(np.zeros(3), -h)
    by_length = (ahead.tensions - back.tensions) / (2.0 * h)
    np.testing.assert_allclose(slopes.tensions_by_length, by_length, rtol=CLOSED_FORM)
    largest = np.max(np.abs(slopes.wrench_by_pose))
    for axis, step in enumerate(h * np.eye(3)):
        by_pose = (state(step, 0.0).wrench - state(-step, 0.0).wrench) / (2.0 * h)
        found = slopes.wrench_by_pose[:, 3 + axis]
        np.testing.assert_allclose(found, by_pose, atol=CLOSED_FORM * largest)


def test_nothing_of_it_leaves_the_law_and_the_cables_as_they_were():
    robot = behaving(load_robot("acrobot_large"), sliding_speed=0.1, creep_time=7.0)
    cables = CableSettings(pulleys=True).cable_set(robot)
    assert cables.beyond.size == 0
    assert cable_law("elastic", cables) == CABLE_MODELS["elastic"].law
    assert behaviour_of(cables) == CableBehaviour()
    with_all = behaving_cables(cables, behaving(robot, **ALL_BEHAVIOUR).cable_behaviour())
    assert behaviour_of(with_all).longer() == pytest.approx(1.0 + 1.2e-5 * 15.0, rel=1e-12)
    assert with_all.packed().shape == (8, 23)
    np.testing.assert_array_equal(with_all.packed()[:, :17], cables.packed())
    assert with_all.chosen(np.arange(3)).packed().shape == (3, 23)


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

"""Visual servoing by torque: twist, wrench, tensions, torques against oracles, closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from pydrake.multibody.tree import MultibodyForces
from scipy.optimize import minimize

from cdpr_drake.control.planned_goal import GoalPlan, goal_offset, goal_pose
from cdpr_drake.control.servo_wrench_kernel import to_world, twist_from_winches, wanted_acceleration
from cdpr_drake.control.tension_controller_kernel import friction_torque, winch_torque
from cdpr_drake.control.torque_law import ServoWrench, TensionController, TorqueServoLaw
from cdpr_drake.errors import ControlGainError, TensionProblemError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.poses import exponential, pose_from_angles, pose_row, rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.tensions.methods import METHODS, distribute, exact_tensions
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.winches.friction import FrictionLaw
from tests.control.awkward_robots import plant_of

ORACLE = 1e-9
"""Difference from Drake's inverse dynamics, relative: products in another order."""

STEP = 1e-5
DIFFERENCES = 1e-4
"""Central differences over `STEP`: their own error, of accelerations of some units."""

DRAWN = 1e-3
"""What the prior draws a fitted twist to, relative to how far off it is, see its weights."""

PERIOD, SERVO_PERIOD = 1e-3, 0.04
LOWER, UPPER = 1.0, 60.0
FRICTION = FrictionLaw(0.02, 0.03, 1e-4, 5.0)
LOOP = TensionController(radius=0.0041, friction=FRICTION)
OUTER = ServoWrench(mu=12.0, kappa=30.0, period=SERVO_PERIOD)

ROBOT = load_robot("acrobot_large")
CABLES = ROBOT.cable_set().without_pulleys()
X_WP = RigidTransform(rotation_from_vector(np.array([0.2, -0.1, 0.3])), [0.1, -0.05, 0.4])

PLANT = plant_of(ROBOT)

CASE_9_START = pose_from_angles([0.202, 0.118, 0.268], np.radians([-18.0, 10.0, 4.0]))

number = st.floats(-0.3, 0.3)
spatial = st.tuples(*[number] * 6).map(np.array)


def make_law(method="quadratic_program", loop=LOOP, wrench=OUTER, cables=CABLES, drums=None):
    scale = tension_problem(ROBOT, X_WP).scale_of_rows
    bounds = np.repeat([[LOWER], [UPPER]], cables.count, axis=1)
    return TorqueServoLaw(
        cables, platform_dynamics(ROBOT), bounds, wrench=wrench, loop=loop, period=PERIOD,
        row_scale=scale, method=method, drums=drums,
    )  # fmt: skip


def run(law, measured, X=None, count=100):
    """Command and memory after some steps, in which the limited rate of tensions comes to rest."""
    memory, X = law.fresh_memory(), CASE_9_START if X is None else X
    rates, wanted = np.zeros(len(measured)), np.zeros(6)
    for k in range(count):
        command, memory = law.step(memory, wanted, X, [measured, rates], k * PERIOD)
    return command, memory


def in_world(V_P):
    V_W = np.empty(6)
    to_world(floating_motion(np.concatenate([pose_row(X_WP), np.zeros(6)])), V_P, V_W)
    return V_W


def held():
    """Tensions that hold the platform, and are far from slack."""
    return distribute(tension_problem(ROBOT, X_WP, limits=(LOWER, UPPER)), "barycenter").tensions


@given(spatial, spatial)
def test_the_wanted_acceleration_is_that_of_a_twist_in_a_turning_frame(V, A_P):
    """d/dt (R V_P) by differences of a platform that moves with V_P(t) = V + A t."""
    out, zero = np.empty(6), np.zeros(6)
    X = floating_motion(np.concatenate([pose_row(X_WP), np.zeros(6)]))
    wanted_acceleration(X, V, A_P, V, zero, 5.0, 0.0, out)

    def V_W(t):
        R = (X_WP @ exponential(V * t + 0.5 * A_P * t * t)).rotation().matrix()
        V_P = V + A_P * t
        return np.concatenate([R @ V_P[:3], R @ V_P[3:]])

    found = (V_W(STEP) - V_W(-STEP)) / (2.0 * STEP)
    np.testing.assert_allclose(out, found, atol=DIFFERENCES)


def test_a_wrong_twist_fades_with_two_poles_of_choice():
    """Of an ideal platform V' = A: e = V_d - V obeys e' + mu e + kappa int e = 0, closed form."""
    mu, kappa, dt = 8.0, 12.0, 1e-4  # poles at -2 and -6
    e0 = np.array([0.1, -0.2, 0.3, 0.05, 0.1, -0.1])
    e, gathered, out = e0.copy(), np.zeros(6), np.empty(6)
    still = floating_motion(np.array([1.0, *np.zeros(12)]))
    for _ in range(5000):
        gathered += dt * e
        # At the identity and with V_d = 0 the acceleration is that of V = -e, less w x v.
        wanted_acceleration(still, np.zeros(6), np.zeros(6), -e, gathered, mu, kappa, out)
        cross = np.concatenate([np.zeros(3), np.cross(-e[:3], -e[3:])])
        e = e - dt * (out - cross)
    t = 0.5
    share = (-2.0 * np.exp(-2.0 * t) + 6.0 * np.exp(-6.0 * t)) / 4.0
    np.testing.assert_allclose(e, share * e0, atol=1e-3)


@given(spatial)
def test_winch_speeds_tell_the_twist_whatever_slack_cables_do(V):
    J = cable_jacobian(X_WP, CABLES)
    W = np.ascontiguousarray(-J.T)
    rates, slack, out = J @ V, np.zeros(8), np.empty(6)
    rates[[0, 5]], slack[[0, 5]] = 7.0, 1.0
    twist_from_winches(W, rates, slack, np.zeros(6), np.empty((6, 6)), np.empty(6), out)
    # The length by hypot: squares of the smallest numbers that are drawn are nothing.
    np.testing.assert_allclose(out, V, atol=30.0 * DRAWN * np.hypot.reduce(V))
    slack[:] = 1.0
    twist_from_winches(W, rates, slack, V, np.empty((6, 6)), np.empty(6), out)
    np.testing.assert_array_equal(out, V)  # nothing pulls: what was wanted is believed


@settings(max_examples=30)
@given(spatial, spatial)
def test_the_wrench_is_that_of_drake_s_inverse_dynamics(V, wanted):
    law, J = make_law(), cable_jacobian(X_WP, CABLES)
    command, memory = law.step(law.fresh_memory(), wanted, X_WP, [held(), J @ in_world(V)], 0.0)
    # The first step: the servo's twist comes from rest, over the servo's period.
    A_P = wanted / SERVO_PERIOD - 12.0 * command.V_P + 30.0 * law.gathered(memory)
    np.testing.assert_allclose(law.gathered(memory), -PERIOD * command.V_P, atol=1e-15)
    R, V_W = X_WP.rotation().matrix(), in_world(command.V_P)
    A_W = np.concatenate([R @ A_P[:3], R @ A_P[3:] + np.cross(V_W[:3], V_W[3:])])
    plant, in_plant, context = PLANT
    in_plant.set_pose(context, X_WP)
    plant.SetVelocities(context, V_W)
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    F = plant.CalcInverseDynamics(context, A_W, forces)
    np.testing.assert_allclose(command.wrench, F, atol=ORACLE * (1.0 + np.max(np.abs(F))))


def test_servo_twists_are_met_without_a_jump_and_when_the_next_one_comes():
    law, memory, rates = make_law(), None, np.zeros(8)
    memory, wanted = law.fresh_memory(), np.array([0, 0, 0, 0.1, 0, 0.05])
    forces = []
    for k in range(60):
        command, memory = law.step(memory, wanted, X_WP, [held(), rates], k * PERIOD)
        forces.append(command.wrench)
    push = np.diff(np.array(forces), axis=0)
    # Over the servo's period the acceleration is constant and V_d grows; then V_d stays.
    largest = np.max(np.abs(push), axis=1)
    assert np.argmax(largest) == 39
    assert np.sort(largest)[-2] < 0.1 * largest[39]


@pytest.mark.parametrize("method", ["quadratic_program", "barycenter", "closed_form"])
def test_limits_and_rates_hold_at_every_step_and_what_cannot_be_is_flagged(method):
    law, J = make_law(method), cable_jacobian(X_WP, CABLES)
    random = np.random.default_rng(3)
    memory, before, measured = law.fresh_memory(), None, held()
    flags = []
    for k in range(300):
        wanted = random.uniform(-0.5, 0.5, 6) * (4.0 if k > 150 else 1.0)
        if k % 20 == 0:
            twist = random.uniform(-0.3, 0.3, 6)
        command, memory = law.step(
            memory, wanted, X_WP, [measured, J @ in_world(twist)], k * PERIOD
        )
        assert np.all(command.tensions >= LOWER)
        assert np.all(command.tensions <= UPPER)
        if before is not None:
            step = np.max(np.abs(command.tensions - before))
            assert step <= LOOP.tension_rate * PERIOD * (1.0 + 1e-12)
        before = command.tensions
        # Feasible is what Drake's inverse dynamics asks of cables within their limits.
        problem = tension_problem(ROBOT, X_WP, limits=(LOWER, UPPER), cables=CABLES)
        asked = TensionProblem(problem.W, -command.wrench, problem.lower, problem.upper)
        assert command.relaxed == (exact_tensions(asked) is None)
        flags.append(command.relaxed)
        measured = command.tensions
    steps, relaxed = law.steps(memory)
    assert (steps, relaxed) == (300, sum(flags))
    assert 0 < relaxed < 300
    assert law.largest_rate(memory) <= LOOP.tension_rate * (1.0 + 1e-12)


def test_slack_cables_are_not_counted_on_and_are_wound_up():
    """Two of eight slack: the others' tensions are determined, and balance the wrench alone."""
    command, _ = run(make_law("barycenter"), np.array([0.0, 0.0, *np.full(6, 6.0)]))
    J = cable_jacobian(CASE_9_START, CABLES)
    alone = np.linalg.solve(-J.T[:, 2:], command.wrench)
    assert np.all(alone >= LOWER)
    assert not command.relaxed
    np.testing.assert_allclose(command.tensions[2:], alone, rtol=1e-9)
    np.testing.assert_array_equal(command.tensions[:2], LOWER)
    # At rest, against the wanted winding at u, the loop pulls with at least K_D u.
    assert np.all(command.torques[:2] <= -LOOP.radius * LOOP.derivative * LOOP.winding_speed)


@pytest.mark.parametrize(("tension", "slack"), [(0.49, True), (0.51, False)])
def test_a_cable_is_slack_below_half_a_newton(tension, slack):
    command, _ = run(make_law("barycenter"), np.array([tension, tension, *np.full(6, 6.0)]))
    assert np.all(command.tensions[:2] == LOWER) == slack


@pytest.mark.parametrize(
    "method", [n for n, r in METHODS.items() if r.takes(0) and not r.needs_reference]
)
def test_six_cables_have_one_answer(method):
    """Without redundancy W t = F is solved, whatever the method; W by `cable_jacobian`."""
    six = CableSet.make(CABLES.p_WA[:, 2:], CABLES.p_PB[:, 2:], 1e5)
    bounds = np.array([[-1e5], [1e5]]).repeat(6, axis=1)
    scale = tension_problem(ROBOT, CASE_9_START).scale_of_rows
    law = TorqueServoLaw(
        six, platform_dynamics(ROBOT), bounds, wrench=OUTER, loop=LOOP, period=PERIOD,
        row_scale=scale, method=method,
    )  # fmt: skip
    command, _ = run(law, np.full(6, 6.0))
    W = -cable_jacobian(CASE_9_START, six).T
    np.testing.assert_allclose(command.tensions, np.linalg.solve(W, command.wrench), rtol=1e-9)


@pytest.mark.parametrize("method", ["barycenter", "quadratic_program"])
@pytest.mark.parametrize("cable", [2, 4])
def test_without_a_cable_the_others_give_the_wrench(method, cable):
    """At a pose that seven cables hold; by scipy's least-norm tensions that only pull."""
    broken = np.arange(CABLES.count) == cable
    home = ROBOT.home.transform()
    tensions = distribute(tension_problem(ROBOT, home, limits=(0.0, UPPER))).tensions
    measured = np.where(broken, 0.0, 6.0 + tensions)
    command, _ = run(make_law(method).without(broken), measured, home, count=200)
    assert not command.relaxed
    assert command.tensions[cable] == 0.0
    W = -cable_jacobian(home, CABLES).T
    left, force = W[:, ~broken], command.wrench
    best = minimize(
        lambda t: 0.5 * t @ t, np.full(7, 5.0), jac=lambda t: t, method="SLSQP",
        bounds=[(0.0, UPPER)] * 7, options={"ftol": 1e-14, "maxiter": 500},
        constraints={"type": "eq", "fun": lambda t: left @ t - force, "jac": lambda t: left},
    )  # fmt: skip
    assert best.success
    SOLVED = 1e-5  # of scipy's iteration [N]
    np.testing.assert_allclose(command.tensions[~broken], best.x, atol=SOLVED)


def test_methods_that_need_a_reference_are_refused():
    with pytest.raises(TensionProblemError, match="reference_program"):
        make_law("reference_program")


def test_drums_have_their_radii_and_shares_of_friction():
    """Torques of cables that differ in their drums: the pull by r, the friction by the share."""
    J = cable_jacobian(X_WP, CABLES)
    rates = J @ np.array([0.1, -0.2, 0.1, 0.3, 0.2, -0.3])
    radius = LOOP.radius
    drums = np.vstack([np.full(8, radius), np.linspace(0.0, 1.0, 8)])

    def torques(loop, drums=None):
        law = make_law(loop=loop, drums=drums)
        return law.step(law.fresh_memory(), np.zeros(6), X_WP, [held(), rates], 0.0)[0].torques

    without = torques(TensionController(radius=radius))
    paid = torques(LOOP) - without
    assert np.all(np.abs(paid) > 0.0)
    share = (torques(LOOP, drums) - without) / paid
    np.testing.assert_allclose(share, drums[1], atol=1e-9)
    larger = np.vstack([2.0 * drums[0], np.zeros(8)])
    np.testing.assert_allclose(torques(LOOP, larger), 2.0 * without, rtol=1e-9)


@pytest.mark.parametrize(("proportional", "on"), [(9.0, True), (4.0, False)])
def test_a_winch_goes_on_when_its_cable_comes_taut_unless_less_is_wanted(proportional, on):
    loop = TensionController(radius=0.0041, friction=FRICTION, proportional=proportional)
    law, X, still = make_law("barycenter", loop), CASE_9_START, np.zeros(6)
    slack = np.array([0.7, 0.7, *np.full(6, 6.0)])
    taut, rates = np.where(slack < 1.0, 1.1, slack), np.zeros(8)
    rates[:2] = -loop.winding_speed
    loose = np.where(slack < 1.0, 0.0, slack)
    memory = law.step(law.fresh_memory(), still, X, [loose, rates], 0.0)[1]
    for k in range(1, 100):  # until the others' tensions hold the platform alone
        before, memory = law.step(memory, still, X, [slack, rates], k * PERIOD)
    np.testing.assert_array_equal(before.tensions[:2], LOWER)
    after, _ = law.step(memory, still, X, [taut, rates], 100 * PERIOD)
    bounds = np.full(8, LOWER), np.full(8, UPPER)
    asked = TensionProblem(-cable_jacobian(X, CABLES).T, -after.wrench, *bounds)
    goal = distribute(asked, "barycenter").tensions[:2]
    begin = 1.1 + loop.derivative * loop.winding_speed / (1.0 + proportional)
    assert np.all(goal > begin) == on
    step = loop.tension_rate * PERIOD
    np.testing.assert_allclose(after.tensions[:2], np.minimum(begin, goal), atol=step)
    if on:  # torques change by what is measured alone, and by the first step of what is wanted
        change = -(after.torques - before.torques)[:2] / loop.radius
        np.testing.assert_allclose(change, 0.4, atol=(1.0 + proportional) * step)


@given(st.floats(-4, 4), st.floats(-0.2, 0.2), st.floats(-0.05, 0.05), st.floats(1.0, 30.0))
def test_within_its_clip_the_loop_is_a_pid_on_tension(error, speed, wanted_speed, tension):
    loop = TensionController(radius=0.004, integral=7.0, winding_speed=10.0).packed()
    torque, gathered = winch_torque(
        tension + error, tension, speed, wanted_speed, False, 1.5, PERIOD, loop
    )
    P, D = 4.0, 300.0
    wrong = (1.0 + P) * error + D * (speed - wanted_speed)
    assert gathered == pytest.approx(1.5 + 7.0 * wrong * PERIOD, abs=1e-12)
    pull = tension + error + P * error + D * (speed - wanted_speed) + gathered
    assert torque == pytest.approx(-0.004 * pull, abs=1e-12)


def test_poles_of_the_sampled_loop_are_those_of_the_loop_run_step_by_step():
    """The law of one winch and its cable, stepped finely: it dies out where the poles say so."""
    k, T, J, n = 3e5, 1e-4, 3e-5, 20
    mass, h = J / 0.0041**2, PERIOD / n
    for proportional, dies in ((0.0, True), (4.0, False)):
        loop = TensionController(
            radius=0.0041, proportional=proportional, winding_speed=1e3, integral=5.0
        )
        packed, x, v, z, sizes = loop.packed(), 1e-6, 0.0, 0.0, []
        for _ in range(400):
            tension = -k * (x + T * v)
            torque, z = winch_torque(0.0, tension, v, 0.0, False, z, PERIOD, packed)
            for _ in range(n):  # symplectic, finer than the cable's vibration
                v += h * (torque / 0.0041 - k * (x + T * v)) / mass
                x += h * v
            sizes.append(abs(x) + abs(v) * 1e-3)
        pole = loop.largest_pole(PERIOD, k, J, T)
        assert (pole < 1.0) == dies
        grown = (max(sizes[300:]) / max(sizes[100:200])) ** (1.0 / 200.0)
        assert grown == pytest.approx(pole, abs=0.02)


def test_friction_is_paid_in_the_direction_of_motion():
    """(5.7) with the sign and the bars that are missing in print."""
    loop = LOOP.packed()
    for speed in (0.01, 0.05, 0.3):
        w = speed / LOOP.radius
        expected = 0.02 + 0.01 * np.exp(-w / 5.0) + 1e-4 * w
        assert friction_torque(speed, loop) == pytest.approx(expected, rel=1e-12)
        assert friction_torque(-speed, loop) == -friction_torque(speed, loop)
        assert expected == pytest.approx(float(FRICTION.sliding(np.array(w))), rel=1e-12)
    assert friction_torque(0.0, loop) == 0.0


@pytest.mark.parametrize(
    ("key", "value"),
    [("proportional", -1.0), ("derivative", 0.0), ("integral", np.nan), ("tension_rate", -5.0)],
)
def test_gains_that_cannot_be_are_refused(key, value):
    with pytest.raises(ControlGainError, match=rf"{key} of a tension loop: found .*; accepted: "):
        make_law(loop=TensionController(radius=0.004, **{key: value}))
    with pytest.raises(ControlGainError, match=r"mu: found -1.0; accepted: a number > 0"):
        make_law(wrench=ServoWrench(mu=-1.0, period=0.04))


def test_from_the_goal_the_object_is_seen_as_desired():
    X_PC = RigidTransform(rotation_from_vector(np.array([3.0, 0.2, 0.1])), [-0.06, 0.0, 0.01])
    X_WO = RigidTransform(rotation_from_vector(np.array([0.1, 0.2, 0.4])), [0.2, 0.1, 0.0])
    X_CdO = RigidTransform(rotation_from_vector(np.array([3.1, 0.0, 0.2])), [0.0, 0.01, 0.3])
    goal = goal_pose(X_WP, X_PC, (X_WP @ X_PC).inverse() @ X_WO, X_CdO)
    assert ((goal @ X_PC).inverse() @ X_WO).IsNearlyEqualTo(X_CdO, 1e-12)


def test_a_goal_that_stays_is_reached_on_the_way_of_the_quintic():
    """Against `PoseTrajectory`, until the rate of the plan ends at its gain."""
    goal = RigidTransform(rotation_from_vector(np.array([-0.3, 0.4, 0.1])), [-0.1, 0.1, 0.5])
    plan = GoalPlan(speed=0.2, rotation_speed=0.5, gain=1e3)
    T = plan.duration(goal_offset(X_WP, goal))
    way, X, n = PoseTrajectory((X_WP, goal), (T,)), X_WP, 2000
    for k in range(int(0.9 * n)):
        V_P = plan.twist(goal_offset(X, goal), (k + 0.5) * T / n, T)
        X = X @ exponential(V_P * T / n)
    assert X.IsNearlyEqualTo(way.pose(0.9 * T), 1e-4)
    speeds = [np.linalg.norm(way.velocity(t)[3:]) for t in np.linspace(0, T, 101)]
    turns = [np.linalg.norm(way.velocity(t)[:3]) for t in np.linspace(0, T, 101)]
    assert max(max(speeds) / 0.2, max(turns) / 0.5) == pytest.approx(1.0, abs=1e-9)
    assert plan.rate(T, T) == plan.rate(2.0 * T, T) == 1e3

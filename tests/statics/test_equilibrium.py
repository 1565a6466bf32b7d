"""Poses of rest against closed forms, differences of energy and a program of Drake."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.math import RigidTransform

from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.cables.models import CABLE_MODELS, STRAIGHT
from cdpr_drake.cables.states import cable_derivatives, cable_state
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.motion_type import FREE, LEVEL
from cdpr_drake.geometry.poses import pose_error, pose_from_angles, pose_row
from cdpr_drake.geometry.rotation_kernel import turn_pose
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics import equilibrium, equilibrium_program
from cdpr_drake.statics.equilibrium import (
    Equilibrium,
    Stability,
    equilibria,
    equilibrium_near,
    random_starts,
)
from cdpr_drake.statics.equilibrium_kernel import RESTS, STUCK, energy_at, settle
from cdpr_drake.statics.equilibrium_program import (
    make_equilibrium_program,
    solve_equilibrium_program,
)
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.inextensible_equilibrium import rigid_cables_rest, taut_tensions
from cdpr_drake.statics.rigid_platform import RigidPlatform
from tests.statics.statics_cases import cables_at, scene

SETTLED = 1e-8
"""Closed forms: the search stops at forces of 1e-10 of the weight, on E S / l of 1e5 N/m."""

AGREE = {"inextensible": 1e-6, "elastic": 1e-5, "catenary": 1e-4}
"""How near SNOPT comes [m, rad]: its tolerance over the stiffness in weights per metre; a gradient
of 1e-9 of stiff energies is lost in rounding earlier."""

MASS, GRAVITY, ES, HEAVY = 2.0, 9.81, 1e5, 0.3
WEIGHT = MASS * GRAVITY
PLATFORM = RigidPlatform(
    MASS, np.array([0.0, 0.0, -0.2]), np.diag([0.1, 0.1, 0.05]) + 0.08 * np.diag([1.0, 1.0, 0.0])
)
POINT = RigidPlatform(MASS, np.zeros(3), np.diag([0.02, 0.02, 0.02]))


def beside(name, pulleys=False):
    """A robot beside its home pose; a planar one has no preload."""
    return scene(name, pulleys, at=(0.1, 0.05, 0.1), turn=0.05, preload=0.0)


def unbalanced(cables, model, platform, l0, X_WP):
    """Wrench of cables and weight, shape (6,)."""
    return cable_state(cables, model, X_WP, l0).wrench + platform.weight_wrench(X_WP)


# Closed forms.


@pytest.mark.parametrize("model", sorted(CABLE_MODELS))
def test_one_cable_is_a_pendulum(model):
    w = HEAVY if model == "catenary" else 0.0
    cables = cables_at([[0.3, -0.2, 2.0]], [[0.0, 0.0, 0.1]], w)
    guess = pose_from_angles([0.5, 0.0, 1.0], [0.2, -0.3, 0.4])
    rest = equilibrium_near(cables, model, PLATFORM, np.array([1.2]), guess)
    stretch = 0.0 if model == "inextensible" else (WEIGHT * 1.2 + 0.5 * w * 1.2**2) / ES
    B = rest.X_WP.multiply(np.array([0.0, 0.0, 0.1]))
    np.testing.assert_allclose(B, [0.3, -0.2, 2.0 - 1.2 - stretch], atol=1e-6)
    np.testing.assert_allclose(rest.X_WP.translation()[:2], [0.3, -0.2], atol=1e-6)
    np.testing.assert_allclose(rest.tensions, WEIGHT, rtol=1e-8)
    assert rest.stability == Stability.NEUTRAL  # it may spin about the cable
    # The pendulum's own stiffness: mg / length for the anchor, mg * arm for the turn.
    assert rest.stiffnesses[1] > 0.0


@pytest.mark.parametrize("model", ["inextensible", "elastic"])
@pytest.mark.parametrize("l0", [(1.3, 1.5), (1.0, 2.4)])
def test_two_cables_on_one_point(model, l0):
    """A triangle, or a pendulum on the shorter cable; with the tensions of the sine law."""
    cables = cables_at([[-1.0, 0.0, 2.0], [1.0, 0.0, 2.0]], [[0.0, 0.0, 0.0]] * 2)
    rest = equilibrium_near(cables, model, POINT, np.array(l0), RigidTransform([-0.9, 0.2, 1.3]))
    a, b = np.array(l0) * (1.0 if model == "inextensible" else 1.0 + rest.tensions / ES)
    if l0[1] > 2.0:
        expected, tensions = [-1.0, 0.0, 2.0 - a], [WEIGHT, 0.0]
    else:
        x = (a * a - b * b) / 4.0
        z = np.sqrt(a * a - (1.0 + x) ** 2)
        expected = [x, 0.0, 2.0 - z]
        tensions = [WEIGHT * a * (1.0 - x) / (2.0 * z), WEIGHT * b * (1.0 + x) / (2.0 * z)]
    np.testing.assert_allclose(rest.X_WP.translation(), expected, atol=SETTLED)
    np.testing.assert_allclose(rest.tensions, tensions, rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(rest.slack, np.array(tensions) == 0.0)


@pytest.mark.parametrize("model", ["inextensible", "elastic", "catenary"])
def test_four_cables_hang_stably_but_softly(model):
    """Fewer cables than degrees of freedom: the pose follows from equilibrium."""
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    exits = np.column_stack([corners, np.full(4, 3.0)])
    anchors = np.column_stack([0.2 * corners, np.full(4, 0.1)])
    guess = pose_from_angles([0.1, 0.1, 1.0], [0.1] * 3)
    cables = cables_at(exits, anchors, HEAVY)
    rest = equilibrium_near(cables, model, PLATFORM, np.full(4, 2.0), guess)
    np.testing.assert_allclose(rest.X_WP.translation()[:2], 0.0, atol=1e-6)
    assert rest.stability == Stability.STABLE
    if model != "inextensible":  # there two cables suffice, and statics cannot tell which
        np.testing.assert_allclose(rest.tensions, rest.tensions[0], rtol=1e-6)


# Robots.


@pytest.mark.parametrize("name", ["acrobot_large", "acrobot_fully_constrained", "caroca", "planar"])
def test_unstrained_lengths_that_hold_a_pose_lead_back_to_it(name):
    case = beside(name)
    X = case.X_WP
    guess = RigidTransform(X.rotation(), X.translation() + np.array([0.01, -0.01, 0.0]))
    rest = equilibrium_near(case.cables, "elastic", case.platform, case.lengths, guess)
    assert pose_error(rest.X_WP, X) < (SETTLED, SETTLED)
    np.testing.assert_allclose(rest.tensions, case.tensions, atol=1e-3)
    assert rest.stability == Stability.STABLE
    assert len(rest.stiffnesses) == (3 if name == "planar" else 6)


@pytest.mark.parametrize("model", ["elastic", "catenary"])
def test_forces_balance_over_pulleys(model):
    case = beside("caroca", pulleys=True)
    rest = case.rest(model)
    wrench = unbalanced(case.cables, model, case.platform, case.lengths, rest.X_WP)
    np.testing.assert_allclose(wrench, 0.0, atol=1e-5)  # of 1500 N
    distance, _ = pose_error(rest.X_WP, case.X_WP)
    # The winches measured these lengths without pulley and sag; each moves CAROCA by millimetres.
    assert distance < (2e-2 if model == "catenary" else 1e-2)


def test_inextensible_cables_keep_six_taut():
    case = beside("acrobot_large")
    l0 = case.lengths + 1e-3 * np.random.default_rng(3).normal(size=8)
    rigid = equilibrium_near(case.cables, "inextensible", case.platform, l0, case.X_WP)
    taut = rigid.tensions > 0.0
    assert np.sum(taut) == 6
    lengths = ForwardKinematics(case.cables).lengths(rigid.X_WP)
    np.testing.assert_allclose(lengths[taut], l0[taut], atol=1e-9)
    assert np.all(lengths <= l0 + 1e-9)
    assert np.all(np.isinf(rigid.stiffnesses))
    stiff = replace(case.cables, stiffness=100.0 * case.cables.stiffness)
    elastic = equilibrium_near(stiff, "elastic", case.platform, l0, case.X_WP)
    distance, _ = pose_error(rigid.X_WP, elastic.X_WP)
    assert distance < 1e-5  # stretches of 1e-6 m
    np.testing.assert_allclose(rigid.tensions, elastic.tensions, atol=0.05)


@pytest.mark.parametrize("pulleys", [False, True])
def test_lengths_of_a_pose_of_rigid_cables_lead_back_to_it(pulleys):
    robot = load_robot("acrobot_large")
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    X = pose_from_angles([0.1, -0.1, 0.3], [0.0, 0.05, 0.1])
    platform, fk = rigid_platform(robot), ForwardKinematics(cables)
    l0 = unstrained_lengths(fk.lengths(X), np.zeros(8), cables.stiffness)
    guess = RigidTransform(X.rotation(), X.translation() + np.array([0.01, 0.0, -0.01]))
    found, tensions, free, left = rigid_cables_rest(cables, platform, l0, guess, 0.1)
    assert pose_error(found, X) < (1e-7, 1e-7)
    assert np.all(tensions >= 0.0)
    assert np.sum(tensions > 0.0) <= 6
    assert len(free) == 6 - np.sum(tensions > 0.0)
    assert left < 1e-8
    wrench = platform.weight_wrench(found) - cable_paths(found, cables).J.T @ tensions
    np.testing.assert_allclose(wrench, 0.0, atol=1e-8)


def test_cables_that_lack_length_carry_all():
    paths = cable_paths(RigidTransform([0.0, 0.0, 0.3]), load_robot("acrobot_large").cable_set())
    lacking = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.1])
    weight = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -30.0])
    tensions = taut_tensions(paths, lacking, weight, FREE, np.eye(3))
    assert np.all(tensions[6:] == 0.0)
    assert np.all(tensions >= 0.0)


# Many poses of rest.


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_distinct_equilibria_from_many_starts_lowest_first(name):
    case = beside(name)
    cables, platform, l0, frame = case.cables, case.platform, case.lengths, case.robot.frame
    lower = np.append(frame.lower[:2], case.X_WP.translation()[2])
    starts = random_starts(lower, frame.upper, 60, 0, platform.motion)
    rests = equilibria(cables, "elastic", platform, l0, starts)
    assert len(rests) > 1  # it hangs upside down or turned half round, too
    assert pose_error(rests[0].X_WP, case.X_WP) < (SETTLED, SETTLED)
    assert [rest.energy for rest in rests] == sorted(rest.energy for rest in rests)
    for k, rest in enumerate(rests):
        assert rest.stability == Stability.STABLE
        wrench = unbalanced(cables, "elastic", platform, l0, rest.X_WP)
        np.testing.assert_allclose(wrench[list(platform.motion.rows)], 0.0, atol=1e-6)
        assert all(pose_error(rest.X_WP, other.X_WP)[1] > 1e-3 for other in rests[:k])


def resting(x, energy, stability):
    return Equilibrium(
        X_WP=RigidTransform([x, 0.0, 0.0]), tensions=np.ones(1), slack=np.zeros(1, bool),
        energy=energy, unbalanced=0.0, stiffnesses=np.zeros(6), stability=stability, steps=1,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("energies", "kinds", "distinct"),
    [
        ((5.0, 5.0), "stable stable", 2),
        ((5.0, 5.0), "neutral neutral", 1),
        ((5.0, 5.0), "neutral stable", 1),
        ((5.0, 5.0 + 4e-6), "neutral neutral", 1),
        ((-5.0, -5.0 - 4e-6), "neutral neutral", 1),
        ((5.0, 5.0 + 6e-6), "neutral neutral", 2),
        ((5.0, -5.0), "neutral neutral", 2),
        ((1e-5, 1e-5 + 9e-10), "neutral neutral", 1),
        ((1e-5, 1e-5 + 2e-9), "neutral neutral", 2),
    ],
)
def test_one_of_a_neutral_family_is_kept(monkeypatch, energies, kinds, distinct):
    """Elsewhere, of the same energy to a millionth, at least to 1 nJ, and one of them neutral."""
    rests = [
        resting(0.1 * k, energy, Stability(kind))
        for k, (energy, kind) in enumerate(zip(energies, kinds.split(), strict=True))
    ]
    searched = iter(rests)
    monkeypatch.setattr(equilibrium, "equilibrium_near", lambda *args, **how: next(searched))
    kept = equilibria(None, "elastic", PLATFORM, None, [rest.X_WP for rest in rests])
    assert len(kept) == distinct


# The kernel.


P_WA = np.array([(x, y, z) for x in (-1.6, 1.7) for y in (-2.9, 3.0) for z in (0.1, 3.2)]).T
P_PB = np.array([(x, y, z) for x in (0.2, -0.21) for y in (-0.1, 0.12) for z in (0.23, 0.0)]).T
BOX = RigidPlatform(5.0, np.array([0.02, -0.03, 0.1]), np.eye(3))
X_WP = pose_from_angles([0.2, -0.3, 1.4], [0.2, -0.1, 0.3])
STATE = np.append(pose_row(X_WP), np.zeros(6))
STEP, DIFFERENCE = 1e-5, 1e-6
"""Central differences with STEP, relative: its square times third derivatives, and rounding."""


def boxed(radius=0.0):
    """Cables of the box and lengths of which some are slack and some taut."""
    cables = CableSet.make(P_WA, P_PB, 1e4, pulley_radius=radius, linear_weight=1.5)
    state = cable_state(cables, "elastic", X_WP, np.full(8, 9.0))
    return cables, state.lengths * np.where(np.arange(8) % 3 == 0, 1.01, 0.99)


def at(state, cables, l0, sags=False, motion=FREE):
    g, H = np.empty(6), np.empty((6, 6))
    energy, pull, good = energy_at(
        int(sags), floating_motion(state)[:12], cables.packed(), l0, 1.0, BOX.packed_weight(),
        motion.packed(), np.zeros((8, 2)), g, H,
    )  # fmt: skip
    assert good
    return energy, pull, g, H


def settled(state, cables, l0):
    return settle(
        state, STRAIGHT, cables.packed(), l0, 1.0, BOX.packed_weight(), FREE.packed(), 0.2,
        np.zeros((8, 2)),
    )  # fmt: skip


def moved(direction):
    state = STATE.copy()
    turn_pose(state, *(STEP * direction[:3]))
    state[4:7] += STEP * direction[3:]
    return state


@pytest.mark.parametrize("radius", [0.0, 0.075])
@pytest.mark.parametrize("sags", [False, True])
def test_gradient_and_hessian(sags, radius):
    cables, l0 = boxed(radius)
    _, pull, g, H = at(STATE, cables, l0, sags)
    slopes, curves = np.empty(6), np.empty((6, 6))
    for k, direction in enumerate(np.eye(6)):
        ahead, behind = (at(moved(s * direction), cables, l0, sags) for s in (1.0, -1.0))
        slopes[k] = (ahead[0] - behind[0]) / (2.0 * STEP)
        curves[:, k] = (ahead[2] - behind[2]) / (2.0 * STEP)
    np.testing.assert_allclose(g, slopes, atol=DIFFERENCE * np.max(np.abs(g)))
    expected = 0.5 * (curves + curves.T)
    np.testing.assert_allclose(H, expected, atol=DIFFERENCE * np.max(np.abs(H)))
    model = "catenary" if sags else "elastic"
    np.testing.assert_allclose(g, -unbalanced(cables, model, BOX, l0, X_WP), atol=1e-9 * pull)
    assert pull == pytest.approx(np.sum(cable_state(cables, model, X_WP, l0).tensions))
    K = BOX.weight_stiffness(X_WP) - cable_derivatives(cables, model, X_WP, l0).wrench_by_pose
    np.testing.assert_allclose(H, 0.5 * (K + K.T), atol=1e-9 * np.max(np.abs(H)))


def test_a_planar_platform_has_three_motions():
    cables, l0 = boxed()
    _, _, g, H = at(STATE, cables, l0)
    _, _, planar_g, planar_H = at(STATE, cables, l0, motion=LEVEL)
    moving = [2, 3, 4]
    np.testing.assert_array_equal(planar_g[moving], g[moving])
    np.testing.assert_array_equal(planar_H[np.ix_(moving, moving)], H[np.ix_(moving, moving)])
    np.testing.assert_array_equal(planar_g[[0, 1, 5]], 0.0)


def test_the_energy_never_grows_on_the_way_to_rest():
    (cables, l0), state = boxed(), STATE.copy()
    before = at(state, cables, l0)[0]
    code, steps, left = settled(state, cables, l0)
    after, pull, _, H = at(state, cables, l0)
    assert code == RESTS
    assert after < before
    assert steps < 200
    assert left <= 1e-8 * (pull + 50.0)
    assert np.all(np.linalg.eigvalsh(H) > 0.0)


def test_a_cable_that_cannot_run_is_no_rest():
    cables, state = boxed(radius=0.3)[0], STATE.copy()
    arm = X_WP.rotation().matrix() @ P_PB[:, 0]
    state[4:7] = P_WA[:, 0] - arm + np.array([0.3, 0.0, 0.0])  # in the groove's circle
    assert settled(state, cables, np.full(8, 3.0))[0] == STUCK


# The program of least potential energy.


@pytest.mark.parametrize(
    ("model", "name"),
    [(model, "acrobot_large") for model in sorted(AGREE)]
    + [("elastic", "planar"), ("catenary", "planar")],  # in its plane, rigid cables are loose
)
def test_the_program_agrees_with_newtons_method(model, name):
    planar = name == "planar"
    case = scene(name, True, at=(0.1, 0.05, 0.25), turn=0.05, preload=0.0)
    cables, platform, m = case.cables, case.platform, case.cables.count
    l0 = case.lengths + np.linspace(-2e-3, 0.0, m) * (0.1 if planar else 1.0)
    rest = equilibrium_near(cables, model, platform, l0, case.X_WP)
    off = np.full(platform.motion.freedom, 0.004)
    start = equilibrium_program.displaced(rest.X_WP, platform, off)
    program = make_equilibrium_program(cables, model, platform, l0, start)
    distance, angle = pose_error(solve_equilibrium_program(program), rest.X_WP)
    assert distance < AGREE[model]
    assert angle < 10.0 * AGREE[model]


@pytest.mark.parametrize("model", AGREE)
def test_slopes_that_the_solver_sees(model):
    robot, step = load_robot("acrobot_large"), 1e-6
    cables, X = robot.cable_set(), robot.home.transform()
    l0 = 0.999 * ForwardKinematics(cables).lengths(X)
    program = make_equilibrium_program(cables, model, rigid_platform(robot), l0, X).program
    x = np.full(program.num_vars(), 0.05)
    for binding in [*program.GetAllCosts(), *program.generic_constraints()]:
        evaluator = binding.evaluator()
        here = x[program.FindDecisionVariableIndices(binding.variables())]
        slope = ExtractGradient(evaluator.Eval(InitializeAutoDiff(here).ravel()))
        tolerance = 1e-6 * max(1.0, np.max(np.abs(slope)))
        for k, d in enumerate(step * np.eye(len(here))):
            difference = (evaluator.Eval(here + d) - evaluator.Eval(here - d)) / (2.0 * step)
            np.testing.assert_allclose(slope[:, k], difference, atol=tolerance)


def test_own_constraints_of_a_program():
    """A stop that keeps the platform from hanging lower."""
    robot = load_robot("acrobot_large")
    cables, X = robot.cable_set().without_pulleys(), robot.home.transform()
    l0 = ForwardKinematics(cables).lengths(X) + 0.05
    made = make_equilibrium_program(cables, "elastic", rigid_platform(robot), l0, X)
    made.program.AddBoundingBoxConstraint(0.0, np.inf, made.displacement[5])
    found = solve_equilibrium_program(made)
    assert found.translation()[2] == pytest.approx(X.translation()[2], abs=1e-6)
    assert np.all(cable_state(cables, "elastic", found, l0).tensions == 0.0)
